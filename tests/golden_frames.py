#!/usr/bin/env python3
"""Compares a small frame of each scene family by every method with the kept one, so that a silent change of pixels is seen.

    tests/golden_frames.py                                  compare all
    tests/golden_frames.py cornell_box.traced 'moving.*'    compare some
    tests/golden_frames.py --accept 'moving.*'              render these and keep them as they are now

A NAME is FAMILY.METHOD, with * for any text. tests/golden/families.json says what is rendered and how far frames may
differ; tests/golden/FAMILY.METHOD.exr are the kept frames. The methods are those of `catoptric list`: one without kept
frames fails. The frames are compared by `catoptric compare` with the limits of families.json. A failure names the limit
and a sheet in the work folder: the frame, the kept one (the reference), and their differences. Look at it before you
accept anything, and say in the commit why the pixels changed. Exit code 1: a frame differs, is missing or is not needed
any more."""
import argparse
import concurrent.futures
import fnmatch
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent

KEPT = ROOT / "tests" / "golden"


class Golden:
    def __init__(self, program, work):
        self.program, self.work = str(pathlib.Path(program).resolve()), work_folder.fresh(work)
        self.families = json.loads((KEPT / "families.json").read_text())
        known = subprocess.run([self.program, "list", "methods", "--json"], check=True, capture_output=True, text=True)
        entries = json.loads(known.stdout)["methods"]
        self.methods = [name for m in entries for name in [m["name"], *m["aliases"]]]
        self.small = {name: m.get("tests", {}).get("small", {}) for m in entries for name in [m["name"], *m["aliases"]]}  # options for small frames

    def names(self, patterns):
        every = [f"{family}.{method}" for family in self.families["families"] for method in self.methods]
        return [n for n in every if not patterns or any(fnmatch.fnmatchcase(n, p) for p in patterns)]

    def render(self, family, methods, arguments=()):
        """{method: path of its frame}, or the error's text. `arguments`: more of them for the program."""
        wanted = self.families["families"][family]
        config = self.work / f"{family}.json"
        config.write_text(json.dumps({
            "scene": str(ROOT / "scenes" / f"{wanted['scene']}.json"), "frames": str(wanted["frame"]),
            "path": str(ROOT / "paths" / f"{wanted['scene']}.json"), "preview": {"enabled": False},
            "image": {**self.families["image"], "half": False, "layers": ["s", "id"]},
            "methods": [{"method": m, "name": f"by_{m}", **self.small[m], **self.families["methods"].get(m, {}),
                         **wanted.get("methods", {}).get(m, {})} for m in methods]}))
        out = self.work / family
        done = subprocess.run([self.program, "render", config, "--out", out, "--progress", "none", "-q", *arguments],
                              capture_output=True, text=True, stdin=subprocess.DEVNULL,
                              env=dict(os.environ, XDG_CACHE_HOME=os.environ.get("CATOPTRIC_TEST_CACHE",
                                                                                str(self.work / "cache"))))
        if done.returncode != 0:
            return f"exit {done.returncode}: {done.stderr.strip()}"
        frame = f"frames/frame.{wanted['frame']:04}.exr"
        return {m: out / f"by_{m}" / frame if len(methods) > 1 else out / frame for m in methods}

    def frames(self, names, arguments=()):
        """{name: its frame, or the error's text}; two families at a time."""
        by_family = {}
        for name in names:
            by_family.setdefault(name.split(".")[0], []).append(name.split(".")[1])
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            rendered = pool.map(lambda item: self.render(*item, arguments), by_family.items())
        return {f"{family}.{method}": found if isinstance(found, str) else found[method]
                for family, found in zip(by_family, rendered) for method in by_family[family]}

    def compare(self, frames, kept):
        """Compares frames with others, both {name: path}: {name: faults}, and {name: errors} as compare's JSON has them."""
        folder = work_folder.fresh(self.work / "compared")
        numbers = {str(number): name for number, name in enumerate(frames, 1)}
        for side, files in (("now", frames), ("kept", kept)):
            (folder / side).mkdir()
            for number, name in numbers.items():
                (folder / side / f"{name}.{number:>04}.exr").symlink_to(files[name])
        limits = [word for name, limit in self.families["limits"].items() for word in (f"--{name}", str(limit))]
        done = subprocess.run([self.program, "compare", folder / "now", folder / "kept", *limits, "--json",
                               "--out", folder / "pictures"], capture_output=True, text=True)
        if done.returncode not in (0, 7):
            raise SystemExit(f"golden: compare: exit {done.returncode}: {done.stderr}")
        faults = {}
        for number, fault in re.findall(r"^error: frame (\d+): (.*)$", done.stderr, re.MULTILINE):
            sheet = f"{folder}/pictures/frame.{number:>04}.sheet.png"
            name = numbers[number]
            faults.setdefault(name, [f"see {sheet}; if the change is meant: tests/golden_frames.py --accept {name}"]).append(fault)
        return faults, {numbers[str(e["frame"])]: e for e in json.loads(done.stdout)[0]["frames"]}

    def faults(self, frames):
        """{name: lines} of frames that are not as kept."""
        found = {name: [frame] for name, frame in frames.items() if isinstance(frame, str)}
        made = {name: frame for name, frame in frames.items() if name not in found}
        kept = {name: KEPT / f"{name}.exr" for name in made if (KEPT / f"{name}.exr").is_file()}
        for name in made.keys() - kept.keys():
            found[name] = [f"no kept frame; look at {made[name]}, then: tests/golden_frames.py --accept {name}"]
        if kept:
            found.update(self.compare({name: made[name] for name in kept}, kept)[0])
        return found

    def check(self, frames, whole):
        faults = self.faults(frames)
        if whole:
            faults.update({path.name: ["is of no family and method: remove it"] for path in KEPT.glob("*.exr")
                           if path.name[:-len(".exr")] not in frames})
        for name in sorted(faults):
            print(f"{name}:", *faults[name], sep="\n    ")
        print(f"golden: {len(frames)} frames compared, {len(faults)} faults")
        return 1 if faults or not frames else 0

    def accept(self, names):
        for name, frame in self.frames(names, ["--set", "image.layers=[]"]).items():
            if isinstance(frame, str):
                print(f"{name}: {frame}", file=sys.stderr)
                return 1
            shutil.copyfile(frame, KEPT / f"{name}.exr")
            print(f"{name}: kept as it is now")
        return 0


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--accept", action="store_true", help="keep the frames of these NAMEs as they are now")
    parser.add_argument("--program", default=ROOT / "build/release/bin/catoptric")
    parser.add_argument("--work", default=ROOT / "out/golden", help="frames and sheets; emptied first")
    arguments = parser.parse_args(words)
    golden = Golden(arguments.program, arguments.work)
    names = golden.names(arguments.names)
    if not names or (arguments.accept and not arguments.names):
        parser.error("--accept wants NAMEs" if names else f"no family and method is called {' '.join(arguments.names)}")
    return golden.accept(names) if arguments.accept else golden.check(golden.frames(names), not arguments.names)


if __name__ == "__main__":
    sys.exit(main())
