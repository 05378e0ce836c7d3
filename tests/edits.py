#!/usr/bin/env python3
"""Edits a file that a command has read, at random moments of commands that measure for long: each edit must end the command
with exit 2 and name the file. Given again, the command must measure what it measures in an empty folder.
One edit for each command; with CATOPTRIC_LONG=1 five each.
Usage: edits.py PROGRAM WORK_FOLDER [--only COMMAND]; exit 1 and a line for each edit that was not noticed."""
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import small_project  # noqa: E402
import work_folder  # noqa: E402

EDITS = 5 if os.environ.get("CATOPTRIC_LONG") == "1" else 1
MOST_TRIES = 10  # a command may end before its edit, or have measured all
WRITING = 0.2  # share of a command's time in which it may write its tables, once all is measured

STUDY = "--against truth --frames 1-8 --repeats 8 --out new --progress none"
COMMANDS = {  # and what is added when they are given again
    "sweep": (f"sweep run.json --method truth --vary methods.truth.rays=1,2,3 {STUDY}", "--existing resume"),
    "tune": (f"tune run.json --method truth --max-error L1_8bit<=9 --vary methods.truth.samples=1,2 {STUDY}",
             "--existing resume"),
    "tables": ("tables t.suite.json --effort full --out new --progress none", ""),
    "nightly": ("nightly n.suite.json --history new/history.db --progress none", ""),
}


def change_scene(scene):
    scene["objects"][0]["material"]["base_color"][0] += 0.1


def change_path(path):
    path["orbit"]["radius"] += 0.1


def change_run(run):
    run["image"]["fresnel"] = True


CHANGES = {"scene.json": change_scene, "path.json": change_path, "run.json": change_run}


def errors(folder):
    """What was measured, without times: the errors of studies, the pixels of nights."""
    texts = {path.name: path.read_text() for path in folder.rglob("errors/*.json")}
    return texts or {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.exr")}


class Editor:
    def __init__(self, program, work):
        self.program, self.work = str(pathlib.Path(program).resolve()), work
        self.base = small_project.prepared(work, frames=8, night_frames="1-8", width=48)
        self.wrong = []
        self.noticed = 0

    def complete(self, name, folder, command):
        process = small_project.start(self.program, folder, command)
        _, said = process.communicate(timeout=300)
        if process.returncode != 0:
            self.wrong.append(f"{name}: exit {process.returncode} of `{command}`: {said}")
        return process.returncode == 0

    def wait_for_worker(self, process, folder):
        """Until the inputs are read, and a worker reads them, too."""
        while process.poll() is None and not any((folder / "new").rglob("logs/*")):
            time.sleep(0.01)

    def edited(self, name, number, seconds, chance):
        """One edit. False: the command had ended, or measured all."""
        command, more = COMMANDS[name]
        file = list(CHANGES)[(number + sorted(COMMANDS).index(name)) % len(CHANGES)]
        folder = self.work / f"{name}.{number}"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.base, folder)
        process = small_project.start(self.program, folder, command)
        self.wait_for_worker(process, folder)
        time.sleep(chance.random() * seconds)
        content = json.loads((folder / file).read_text())
        CHANGES[file](content)
        if process.poll() is not None:
            process.communicate()
            return False
        (folder / file).write_text(json.dumps(content))
        begin = time.monotonic()
        _, said = process.communicate(timeout=300)
        if process.returncode == 0 and time.monotonic() - begin < WRITING * seconds:
            if errors(folder / "new") != errors(self.work / f"{name}.free/new"):
                self.wrong.append(f"{name}, edit {number} of {file}: other errors than of the scene before, and no word")
            return False
        if process.returncode != 2 or f"{file} has changed" not in said:
            self.wrong.append(f"{name}, edit {number} of {file}: exit {process.returncode}: {said.strip()}")
            return True
        self.noticed += 1
        fresh = self.work / f"{name}.{number}.fresh"
        shutil.copytree(self.base, fresh)
        shutil.copy(folder / file, fresh / file)
        if self.complete(name, folder, f"{command} {more}") and self.complete(name, fresh, command):
            has, wanted = errors(folder / "new"), errors(fresh / "new")
            if not wanted or any(has.get(key) != wanted[key] for key in wanted):
                self.wrong.append(f"{name}, edit {number} of {file}: given again, it measures something else")
        return True

    def compare(self, name):
        free = self.work / f"{name}.free"
        shutil.copytree(self.base, free)
        process = small_project.start(self.program, free, COMMANDS[name][0])
        self.wait_for_worker(process, free)
        begin = time.monotonic()
        _, said = process.communicate(timeout=300)
        seconds = time.monotonic() - begin
        if process.returncode != 0:
            self.wrong.append(f"{name}: exit {process.returncode} undisturbed: {said}")
            return
        chance = random.Random(name)
        for number in range(EDITS):
            if not any(self.edited(name, number, 0.9 * seconds, chance) for _ in range(MOST_TRIES)):
                self.wrong.append(f"{name}, edit {number}: it ended before the edit, or did not notice it, {MOST_TRIES} times")


def main():
    editor = Editor(sys.argv[1], work_folder.fresh(sys.argv[2]))
    names = [name for name in COMMANDS if len(sys.argv) < 5 or sys.argv[4] == name]
    for name in names:
        editor.compare(name)
    print(f"{editor.noticed} of {EDITS * len(names)} edits were noticed; {len(editor.wrong)} wrong")
    print("\n".join(editor.wrong))
    sys.exit(1 if editor.wrong else 0)


if __name__ == "__main__":
    main()
