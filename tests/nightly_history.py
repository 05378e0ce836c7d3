#!/usr/bin/env python3
"""Simulates nights of a project's life with the project's own program: twenty in which nothing is wrong, and twenty with
faults that are put in on purpose, while another program comes and goes. Says with which night each fault was named.

    scripts/build release catoptric_faulty
    tests/nightly_history.py [--seed 1] [--clock cpu|wall] [--minutes N]

Every night has a program of its own: a script that gives catoptric_faulty (tests/faulty_method) the faults of that
night. With --minutes it ends after so long, and the same command goes on; --restart begins anew. Exit 1 when a fault was
not named, was named wrongly, or anything else was called a fault. --quick: two nights with faults, without times
and without other programs, for ctest."""
import argparse
import contextlib
import json
import pathlib
import random
import sqlite3
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
import work_folder  # noqa: E402

# Case: scene, its first frames. Names say which fault a case has in the nights with faults.
CASES = {"slower": "nine_spheres", "creeps": "cornell_box", "step": "nine_spheres", "nan": "moving",
         "crash": "planar_mirror", "counter": "near_far", "removed": "cornell_box", "setting": "moving"}
ADDED = {"new": "near_far"}
CHROME = 6  # id of a reflector of nine_spheres
REGRESSION, CRASH = 2, 3  # outcomes in the history


class Fault:
    """What is wrong from night `begins` on, and what a night may say of it."""

    def __init__(self, case, begins, latest, verdicts, option=None):
        self.case, self.begins, self.latest, self.verdicts = case, begins, latest, verdicts
        self.option = option or (lambda night: "")


def faults(quick):
    """`latest`: the night by which it must have been named. A time may be left undecided, or be void, for some nights."""
    at = (lambda night: 2) if quick else (lambda night: night)
    times = [] if quick else [
        Fault("slower", 5, 8, {("time", "slower"), ("creep", "creeps")}, lambda night: "slower=8"),
        Fault("creeps", 6, 12, {("time", "slower"), ("creep", "creeps")},
              lambda night: f"slower={100 * (1.03 ** min(night - 5, 4) - 1):.4f}")]
    return times + [
        Fault("step", at(7), at(7), {("picture", "changed")}, lambda night: f"object={CHROME} steps=1"),
        Fault("nan", at(8), at(8), {("picture", "not finite")}, lambda night: "nan=2"),
        Fault("crash", at(9), at(9), {("run", "crash")}, lambda night: "crash=3"),
        Fault("counter", at(10), at(10), {("counter", "rises")}, lambda night: "refused=3"),
        Fault("new", at(11), at(11), {("scene", "new")}),
        Fault("removed", at(12), at(12), {("scene", "removed")}),
        Fault("setting", at(13), at(13), {("scene", "changed setting")})]


class Load:
    """Programs that come and go, on the processors that the nights use."""

    def __init__(self, seed):
        self.random, self.stop = random.Random(seed), threading.Event()
        self.thread = threading.Thread(target=self.run)

    def run(self):
        while not self.stop.wait(self.random.expovariate(1 / 9)):
            program = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            self.stop.wait(self.random.expovariate(1 / 3))
            program.kill()
            program.wait()

    def __enter__(self):
        self.thread.start()

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()


class History:
    def __init__(self, folder, arguments, known):
        self.folder, self.arguments, self.known = folder, arguments, known
        folder.mkdir(parents=True, exist_ok=True)
        for case, scene in {**CASES, **ADDED}.items():
            config = {"scene": f"{ROOT}/scenes/{scene}.json", "path": f"{ROOT}/paths/{scene}.json",
                      "image": {"width": arguments.size, "height": arguments.size, "layers": ["s", "id"]},
                      "preview": {"enabled": False}, "threads": 1, "methods": ["faulty"]}
            (folder / f"case_{case}.json").write_text(json.dumps(config))

    def rows(self, query, *values):
        if not (self.folder / "history.db").exists():
            return []
        database = sqlite3.connect(self.folder / "history.db", timeout=10)
        try:
            return database.execute(query, values).fetchall()
        finally:
            database.close()

    def finished(self):
        return len(self.rows("SELECT id FROM night WHERE finished IS NOT NULL"))

    def suite(self, night):
        cases = dict(CASES)
        begun = {fault.case for fault in self.known if night >= fault.begins}
        if "new" in begun:
            cases.update(ADDED)
        if "removed" in begun:
            del cases["removed"]
        scenes = {case: {"config": f"case_{case}.json", "methods": ["faulty"], "frames": {"full": "1-4"},
                         "settings": {"image.height": 48} if case == "setting" and case in begun else {}}
                  for case in cases}
        (self.folder / "own.suite.json").write_text(json.dumps({"title": "Simulated nights", "scenes": scenes}))

    def program(self, night):
        """A build of its own: other bytes, and its faults."""
        lines = ["#!/bin/sh", f"# the build of night {night}", 'case "$*" in']
        for fault in self.known:
            options = fault.option(night) if night >= fault.begins else ""
            more = "".join(f" --set methods.faulty.{option}" for option in options.split())
            if more:
                lines.append(f'*case_{fault.case}.json*) set -- "$@"{more} ;;')
        lines += ["esac", f'exec "{self.arguments.program}" "$@"', ""]
        file = self.folder / f"build_{night}"
        file.write_text("\n".join(lines))
        file.chmod(0o755)
        return file

    def nightly(self, *words):
        done = subprocess.run([self.arguments.program, "nightly", *words, "--history", "history.db"], cwd=self.folder,
                              text=True, capture_output=True)
        if done.returncode not in (0, 6, 7):
            sys.exit(f"{words}: exit {done.returncode}: {done.stderr}")

    def live(self, night):
        self.suite(night)
        self.nightly("own.suite.json", "--program", f"./{self.program(night).name}", "--clock", self.arguments.clock,
                     "--repeats", "2" if self.arguments.quick else "8", "--progress", "none", "-q")
        if not self.rows("SELECT id FROM acknowledgement"):
            self.nightly("accept", "*", "--reason", "the first night")

    def verdicts(self):
        """Night, case, kind, status, the night it is said to have begun with, and whether it is a fault."""
        found = self.rows("SELECT night, name, kind, status, began, outcome, message FROM verdict "
                          "WHERE acknowledgement IS NULL ORDER BY id")
        return [(night, name.split(".")[1], kind, status, began, outcome, message)
                for night, name, kind, status, began, outcome, message in found]


def judge(history, nights):
    """Lines of what was named wrongly; prints what was named rightly."""
    wrong, first = [], {}
    known = {fault.case: fault for fault in history.known}
    verdicts = history.verdicts()
    for night, case, kind, status, began, outcome, message in verdicts:
        fault = known.get(case)
        expected = fault is not None and night >= fault.begins and (kind, status) in fault.verdicts
        if expected:
            first.setdefault(case, (night, kind, status, message))
            # Of a creep the anchor says when it began; the accepted build has moved on with its first steps
            if (case, kind) == ("creeps", "time"):
                continue
            if began != fault.begins and f"perhaps since night {fault.begins}," not in message:
                wrong.append(f"night {night}: {case} {kind} {status} is said to have begun with night {began}, "
                             f"not {fault.begins}: {message}")
        elif outcome in (REGRESSION, CRASH) or (kind == "scene" and night > 1):
            wrong.append(f"night {night}: {case} {kind} {status}, which was not put in: {message}")
    for fault in history.known:
        if fault.latest > nights:
            continue
        night, kind, status, message = first.get(fault.case, (99, "", "", ""))
        if night > fault.latest:
            wrong.append(f"{fault.case}, put in with night {fault.begins}, was named with night {night}")
        else:
            print(f"  {fault.case}: put in with night {fault.begins}, named in night {night}: {kind} {status}: {message}")
    times = [status for _, _, kind, status, *_ in verdicts if kind in ("time", "creep")]
    print("  times: " + ", ".join(f"{status} {times.count(status)}" for status in sorted(set(times))))
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/release/bin/catoptric_faulty")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "out/nightly_history")
    parser.add_argument("--nights", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--clock", default="cpu")
    parser.add_argument("--minutes", type=float, default=1e9)
    parser.add_argument("--only", choices=("clean", "faults"), help="one of the two histories")
    parser.add_argument("--restart", action="store_true")
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    arguments.program = arguments.program.resolve()
    end = time.monotonic() + 60 * arguments.minutes
    if arguments.quick:
        arguments.nights, arguments.size = 2, 24
    if arguments.restart or arguments.quick:
        arguments.work = work_folder.fresh(arguments.work)
    work = arguments.work.resolve() / f"{arguments.clock}_{arguments.seed}"
    wanted = [arguments.only] if arguments.only else ["faults"] if arguments.quick else ["clean", "faults"]
    histories = [History(work / name, arguments, faults(arguments.quick) if name == "faults" else [])
                 for name in wanted]
    with contextlib.nullcontext() if arguments.quick else Load(arguments.seed):
        for history in histories:
            while history.finished() < arguments.nights:
                if time.monotonic() > end:
                    print(f"{history.finished()} nights of {history.folder.name}; the same command goes on")
                    return 0
                start = time.monotonic()
                history.live(history.finished() + 1)
                print(f"{history.folder.name}: night {history.finished()} took {time.monotonic() - start:.1f} s", flush=True)
    wrong = []
    for history in histories:
        print(f"{history.folder.name}: {arguments.nights} nights")
        wrong += [f"{history.folder.name}: {line}" for line in judge(history, arguments.nights)]
    print("\n".join(wrong) if wrong else "every fault was named, with the night that it began with, and nothing else was")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
