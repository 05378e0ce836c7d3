#!/usr/bin/env python3
"""Holds the papers' configs and suites to what the program accepts.

Usage: paper_configs.py SOURCE_FOLDER PROGRAM
Plans every config of configs/papers/ with a small scene (the rooms' assets may be missing). No frame of the tuning set is in the validation set."""
import json
import os
import pathlib
import subprocess
import sys

SMALL = ["scene=scenes/cornell_box.json", "path=paths/cornell_box.json", "image.width=32", "image.height=32",
         'image.layers=["s","id"]']


def numbers(text):
    """The frames of "4-12x4" or "1,5"."""
    for part in text.split(","):
        ends, _, step = part.partition("x")
        first, _, last = ends.partition("-")
        yield from range(int(first), int(last or first) + 1, int(step or 1))


def main(source, program):
    os.chdir(source)
    failed = []

    folder = pathlib.Path("configs/papers")
    for config in sorted(folder.glob("*.json")):
        if not config.name.endswith(".suite.json"):
            # These need their own scenes: implicit surfaces, objects that they name
            settings = [] if config.name.startswith(("perturbation", "impostors")) else SMALL
            done = subprocess.run([program, "plan", config, "--frames", "1", *(p for s in settings for p in ("--set", s))],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            if done.returncode != 0:
                failed.append(f"{config.name}: exit {done.returncode}: {done.stderr.strip()}")
    sets = {"tuning": set(), "validation": set()}
    for suite in sorted(folder.glob("*.suite.json")):
        for name, run in json.loads(suite.read_text())["runs"].items():
            settings = run.get("settings", {})
            kind = name.partition("_")[0]
            if kind in sets:
                sets[kind] |= {(settings["scene"], settings["path"], n) for n in numbers(run["frames"]["full"])}
    if not all(sets.values()) or sets["tuning"] & sets["validation"]:
        failed.append(f"frames in both sets: {sorted(sets['tuning'] & sets['validation'])}")
    print("\n".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:3])))
