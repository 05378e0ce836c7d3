#!/usr/bin/env python3
"""Kills commands at moments spread over their time, continues them, and compares with an undisturbed command: every byte but
those of times. render and nightly are killed by crash_test and nightly_app_test, too.
A kill or two for each command; with CATOPTRIC_LONG=1 25 each.
Usage: kills.py PROGRAM WORK_FOLDER [--only COMMAND]; exit 1 and a line for each difference."""
import json
import os
import pathlib
import random
import shutil
import sqlite3
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import small_project  # noqa: E402
import work_folder  # noqa: E402

KILLS = 25 if os.environ.get("CATOPTRIC_LONG") == "1" else 1

STUDY = "--against truth --repeats 1 --frames 1-3 --out new --progress none"
NIGHTLY = "n.suite.json --history h/history.db --progress none"
# Command, what continues it after a kill, and the commands before it.
COMMANDS = {
    "render": ("render run.json --out new", "render run.json --out new --existing resume", []),
    "sweep": (f"sweep run.json --method truth --vary methods.truth.rays=1,2,3 {STUDY}", "--existing resume", []),
    "tune": (f"tune run.json --method truth --max-error L1_8bit<=9 --vary methods.truth.samples=1,2 {STUDY}",
             "--existing resume", []),
    "tables": ("tables t.suite.json --effort smoke --out new --progress none", "", []),
    "nightly": (f"nightly {NIGHTLY}", "", []),
    "accept": ("nightly accept * --reason r --history h/history.db", "", [f"nightly {NIGHTLY}"]),
    "submit": ("submit run.json --chunks 4 --to script --out new", "", []),
    "merge": ("merge part1 part2 --out new", "--existing overwrite",
              ["render run.json --chunk 1/2 --out part1", "render run.json --chunk 2/2 --out part2"]),
}


def frames(folder):
    """Frames, previews and layers, by name."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.suffix in (".exr", ".png") and path.name != "contact_sheet.png"}


def records(folder):
    """Records of frames without their times."""
    texts = {}
    for path in sorted(folder.rglob("frames.jsonl")):
        for line in path.read_text().splitlines():
            record = json.loads(line)
            record.pop("steps")
            texts[f"{path.relative_to(folder)} {record['frame']}"] = record
    return texts


def studied(folder):
    return {path.name: path.read_bytes() for path in sorted((folder / "new/errors").iterdir())}


def night(folder):
    """What nights have seen, without times; a night that was killed may have seen a part of it, too."""
    with sqlite3.connect(f"file:{folder / 'h/history.db'}?mode=ro", uri=True) as history:
        seen = set(history.execute("SELECT frame, pixels, counters, not_finite FROM frame"))
    return {"seen": seen, **{str(path.relative_to(folder)): path.read_bytes()
                             for path in sorted((folder / "h/accepted").rglob("*.exr"))}}


RESULTS = {
    "render": lambda folder: {**frames(folder / "new"), **records(folder / "new")},
    "sweep": studied,
    "tune": studied,
    "tables": lambda folder: (folder / "new/report.md").read_bytes() if (folder / "new/report.md").exists()
    else {path.name: path.read_bytes() for path in sorted((folder / "new").glob("*.md"))},
    "nightly": night,
    "accept": night,
    "submit": lambda folder: sorted(str(path.relative_to(folder)) for path in (folder / "new").rglob("*")),
    "merge": lambda folder: {**frames(folder / "new"), **records(folder / "new")},
}


class Killer:
    def __init__(self, program, work):
        self.program, self.work = str(pathlib.Path(program).resolve()), work
        self.base = small_project.prepared(work, frames=8, night_frames="1-3", width=48)
        self.wrong = []
        self.killed = self.tried = 0

    def complete(self, folder, command):
        process = small_project.start(self.program, folder, command)
        _, said = process.communicate(timeout=300)
        return process.returncode, said

    def compare(self, name):
        command, more, before = COMMANDS[name]
        again = more if more.startswith("render") else f"{command} {more}".strip()
        base = self.work / f"{name}.base"
        shutil.copytree(self.base, base)
        for step in before:
            if self.complete(base, step)[0] != 0:
                self.wrong.append(f"{name}: `{step}` failed")
                return
        free = self.work / f"{name}.free"
        shutil.copytree(base, free)
        begin = time.monotonic()
        code, said = self.complete(free, command)
        seconds = time.monotonic() - begin
        if code != 0:
            self.wrong.append(f"{name}: exit {code} undisturbed: {said}")
            return
        wanted = RESULTS[name](free)
        chance = random.Random(name)
        for number in range(KILLS):
            folder = self.work / f"{name}.{number}"
            shutil.copytree(base, folder)
            process = small_project.start(self.program, folder, command)
            time.sleep(seconds * (number + chance.random()) / KILLS)
            process.kill()
            process.communicate()
            self.tried += 1
            self.killed += process.returncode < 0
            code, said = self.complete(folder, again)
            if code in (2, 5) and RESULTS[name](folder) == wanted:
                code = 0  # it was complete, and is not made again
            if code != 0:
                self.wrong.append(f"{name}, kill {number}: exit {code} when continued: {said.strip()}")
            elif RESULTS[name](folder) != wanted:
                self.wrong.append(f"{name}, kill {number}: differs from the undisturbed one")
                continue
            shutil.rmtree(folder)


def main():
    killer = Killer(sys.argv[1], work_folder.fresh(sys.argv[2]))
    for name in COMMANDS:
        if len(sys.argv) < 5 or sys.argv[4] == name:
            killer.compare(name)
    print(f"{killer.killed} of {killer.tried} were killed before their end; {len(killer.wrong)} wrong")
    print("\n".join(killer.wrong))
    sys.exit(1 if killer.wrong else 0)


if __name__ == "__main__":
    main()
