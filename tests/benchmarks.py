#!/usr/bin/env python3
"""scripts/benchmarks --effort smoke measures every figure of docs/benchmarks.md, and the script ends as soon as another
process computes.
Usage: benchmarks.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import importlib.machinery
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.dont_write_bytecode = True
BURN = [sys.executable, "-c", "import time\nwhile time.process_time() < 1: pass"]


def start(*command):
    return subprocess.Popen(command, start_new_session=True)


def main(source, program, work):
    loader = importlib.machinery.SourceFileLoader("benchmarks", f"{source}/scripts/benchmarks")
    script = importlib.util.module_from_spec(importlib.util.spec_from_loader("benchmarks", loader))
    loader.exec_module(script)
    faults = []

    own = start(*BURN)
    before = script.own_ticks({own.pid})
    _, _, used = os.wait4(own.pid, 0)
    own.returncode = 0
    seconds = (script.own_ticks(set()) - before) / os.sysconf("SC_CLK_TCK")
    if abs(seconds - used.ru_utime - used.ru_stime) > 0.1:
        faults.append(f"own processes took {used.ru_utime + used.ru_stime:.2f} s, {seconds:.2f} were counted")

    script.WINDOW_SECONDS = 0.5
    job, watch = start("sleep", "60"), script.Watch(0.1)
    watch.sessions.add(job.pid)
    other, limit = start(*BURN), time.monotonic() + 30
    while job.poll() is None and time.monotonic() < limit:
        time.sleep(0.05)
    other.wait()
    if job.poll() != -signal.SIGTERM:
        faults.append(f"another process computed, and the job went on: {job.poll()}")
        job.kill()

    done = subprocess.run([f"{source}/scripts/benchmarks", "--effort", "smoke", "--program", program, "--work", work],
                          capture_output=True, text=True)
    tables = done.stdout.count("\n**")
    if done.returncode != 0 or tables < 7:
        faults.append(f"exit code {done.returncode}\n{done.stdout}{done.stderr}")
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))
