"""Becomes a job's program with fewer rights than the service: launch.py PARENT MEMORY CPU_SECONDS FILE_BYTES PROGRAM WORDS…

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
    """Sets soft and hard limit, so that the program cannot raise them; never above what is allowed."""
    _, most = resource.getrlimit(what)
    if most != resource.RLIM_INFINITY:
        value = min(value, most - grace)
    resource.setrlimit(what, (value, value + grace))


def main() -> None:
    parent, memory, cpu_seconds, file_bytes = (int(word) for word in sys.argv[1:5])
    libc = ctypes.CDLL(None, use_errno=True)
    # The job ends with the service, even after kill -9. The check covers a service that ended before.
    if libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0) != 0:
        sys.exit("launch: PR_SET_PDEATHSIG failed")
    if os.getppid() != parent:
        sys.exit("launch: the service has ended")
    libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    limit(resource.RLIMIT_AS, memory)
    limit(resource.RLIMIT_CPU, cpu_seconds, grace=5)  # SIGXCPU gives the reason, unlike SIGKILL
    limit(resource.RLIMIT_FSIZE, file_bytes)
    limit(resource.RLIMIT_CORE, 0)
    os.nice(5)  # the service itself has priority
    try:
        with open("/proc/self/oom_score_adj", "w") as score:
            score.write("500")  # out of memory, the system kills jobs before the service
    except OSError:
        pass
    os.execv(sys.argv[5], sys.argv[5:])


main()
