"""run.py PROGRAM WORK [--only TEXT]   gives the program every bad input (cases.py) and every valid one.

Each must end within a minute, by itself, with its exit code and a message that names the place; no
sanitizer may report; nothing may be left in the output folder but the record of a failed run. The asan preset runs the
same test.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
import cases  # noqa: E402
import valid  # noqa: E402
import work_folder  # noqa: E402

TIMEOUT_SECONDS = 60  # on a busy machine; alone each takes less than a second
RUN_RECORDS = (".lock", "summary.json")  # of a run that has begun: they say how it ended
SANITIZERS = re.compile(r"(AddressSanitizer|LeakSanitizer|runtime error:|UndefinedBehaviorSanitizer)")


def fault(case, program, work, number):
    """What is wrong with the program's answer; None when it is as it must be."""
    folder = work / f"{number:04}"
    folder.mkdir()
    for name, data in {**valid.files(), **case.files}.items():
        if data is not None:
            (folder / name).write_bytes(data)
    before = sorted(p.name for p in folder.iterdir())
    environment = dict(os.environ, XDG_CACHE_HOME=str(work / "cache"))
    try:
        done = subprocess.run([program, *case.command], cwd=folder, env=environment, timeout=TIMEOUT_SECONDS,
                              capture_output=True, text=True, errors="replace")
    except subprocess.TimeoutExpired:
        return f"ran longer than {TIMEOUT_SECONDS} s"
    said = f"exit code {done.returncode}, stderr:\n{done.stderr[:2000]}"
    if SANITIZERS.search(done.stderr):
        return f"a sanitizer reports: {done.stderr[:4000]}"
    if done.returncode < 0:
        return f"died of signal {-done.returncode}: {said}"
    allowed = (cases.USAGE, cases.SCENE) if case.code is None else (case.code,)
    if done.returncode not in allowed:
        return f"wanted exit code {' or '.join(map(str, allowed))}, got {said}"
    if case.code != 0 and not re.search(case.message, done.stderr, re.DOTALL):
        return f"wanted a message like {case.message!r}, got {said}"
    if case.code != 0:
        left = [p for p in folder.rglob("*")
                if p.is_file() and str(p.relative_to(folder)) not in before and p.name not in RUN_RECORDS]
        if left:
            return "left files: " + ", ".join(str(p.relative_to(folder)) for p in left)
    shutil.rmtree(folder)
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--only", default="", help="cases whose names contain this")
    options = parser.parse_args()
    program = options.program.resolve()
    options.work = work_folder.fresh(options.work)
    (options.work / "cache").mkdir()
    bad, good = cases.bad(), list(cases.good())
    names = [c.name for c in bad]
    assert len(set(names)) == len(names), [n for n in names if names.count(n) > 1]
    chosen = [c for c in bad + good if options.only in c.name]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        faults = list(pool.map(lambda job: fault(job[1], program, options.work.resolve(), job[0]), enumerate(chosen)))
    failed = [(number, case, what) for number, (case, what) in enumerate(zip(chosen, faults)) if what is not None]
    for number, case, what in failed:
        print(f"FAILED {case.name} (catoptric {' '.join(case.command)} in {options.work}/{number:04})\n  {what}\n")
    print(f"{len(bad)} bad and {len(good)} valid inputs; {len(chosen)} run, {len(failed)} failed")
    return 1 if failed or len(bad) < 300 else 0


if __name__ == "__main__":
    sys.exit(main())
