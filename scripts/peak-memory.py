#!/usr/bin/env python3
"""Runs a command and says how long it took and the most anonymous memory that it had: peak-memory.py COMMAND…

Anonymous memory is what the program has for itself. Pages of files, which the system takes back when it needs them, are not counted.
Looked at every 20 ms; Linux only."""

import subprocess
import sys
import time

begin = time.monotonic()
process = subprocess.Popen(sys.argv[1:])
peak = 0
while process.poll() is None:
    try:
        with open(f"/proc/{process.pid}/status") as status:
            peak = max(peak, *(int(line.split()[1]) for line in status if line.startswith("RssAnon")), 0)
    except (OSError, TypeError):
        pass
    time.sleep(0.02)
print(f"{time.monotonic() - begin:.1f} s, at most {peak / 1e6:.2f} GB of anonymous memory", file=sys.stderr)
sys.exit(process.returncode)
