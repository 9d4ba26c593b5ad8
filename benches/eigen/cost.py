#!/usr/bin/env python3
"""Runs a command that prints one line of JSON, and adds what the process cost: CPU seconds of all threads, peak memory."""
import json
import os
import subprocess
import sys

process = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE, text=True)
output = process.stdout.read()
_, status, usage = os.wait4(process.pid, 0)
if os.waitstatus_to_exitcode(status) != 0:
    raise SystemExit(f"{sys.argv[1]}: exit code {os.waitstatus_to_exitcode(status)}")
found = json.loads(output.strip().splitlines()[-1])
print(json.dumps(found | {"process_cpu": usage.ru_utime + usage.ru_stime, "peak_mb": usage.ru_maxrss / 1024}))
