"""Becomes a job's program, with less rights than the service: launch.py PARENT MEMORY CPU_SECONDS FILE_BYTES PROGRAM WORDS…

Runs by itself (python -I -S), before the program is there: nothing of the service has to happen between fork and exec.
"""

import ctypes
import os
import resource
import signal
import sys

_PR_SET_PDEATHSIG = 1
_PR_SET_NO_NEW_PRIVS = 38


def limit(what: int, value: int, grace: int = 0) -> None:
    """Both limits, so that the program cannot raise them again; never above what is allowed."""
    _, most = resource.getrlimit(what)
    if most != resource.RLIM_INFINITY:
        value = min(value, most - grace)
    resource.setrlimit(what, (value, value + grace))


def main() -> None:
    parent, memory, cpu_seconds, file_bytes = (int(word) for word in sys.argv[1:5])
    libc = ctypes.CDLL(None, use_errno=True)
    # The service's end is the job's end, also by kill -9; unless the service ended before this was said.
    if libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0) != 0:
        sys.exit("launch: PR_SET_PDEATHSIG failed")
    if os.getppid() != parent:
        sys.exit("launch: the service has ended")
    libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    limit(resource.RLIMIT_AS, memory)
    limit(resource.RLIMIT_CPU, cpu_seconds, grace=5)  # SIGXCPU says why it ended, SIGKILL would not
    limit(resource.RLIMIT_FSIZE, file_bytes)
    limit(resource.RLIMIT_CORE, 0)
    os.nice(5)  # answering comes first
    try:
        with open("/proc/self/oom_score_adj", "w") as score:
            score.write("500")  # where memory ends, a job does and not the service
    except OSError:
        pass
    os.execv(sys.argv[5], sys.argv[5:])


main()
