#!/usr/bin/env python3
"""Every scene family by every method is drawn as kept in tests/golden/ (scripts/golden), and the comparison is able to
fail: each frame's largest reflector, brighter by 1/255, is found, and so is a frame that nobody kept.
Usage: golden.py PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import collections
import importlib.machinery
import importlib.util
import pathlib
import struct
import sys

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
loader = importlib.machinery.SourceFileLoader("golden", str(ROOT / "scripts" / "golden"))
golden = importlib.util.module_from_spec(importlib.util.spec_from_loader("golden", loader))
loader.exec_module(golden)


def largest_reflector(frame):
    """Its pixels."""
    ids = frame.values(next(n for n in frame.channels if n.startswith("id.object")))
    pixels = collections.defaultdict(list)
    for i, (number, s) in enumerate(zip(ids, frame.values("s.X"))):
        if number > 0 and s > 0:
            pixels[number].append(i)
    return max(pixels.values(), key=len, default=[])


def brighter(frame, pixels):
    changed = dict(frame.channels)
    for channel in "RGB":
        values = list(frame.values(channel))
        for i in pixels:
            values[i] += 1 / 255
        changed[channel] = (frame.channels[channel][0], struct.pack(f"<{len(values)}f", *values))
    return golden.exr.Image(frame.width, frame.height, changed)


def main(program, work):
    code = golden.main(["--program", program, "--work", work])
    test = golden.Golden(program, golden.work_folder.fresh(pathlib.Path(work) / "changed"))
    found, faults = 0, 0
    for name in test.names([]):
        family, method = name.split(".", 1)
        frames = list(pathlib.Path(work).glob(f"*/{family}/by_{method}/frames/*.exr"))
        if len(frames) != 1:
            continue  # refused; said above
        frame = golden.exr.read(frames[0])
        if not test.faults_of(name, brighter(frame, largest_reflector(frame))):
            faults += 1
            print(f"{name}: a reflector that is brighter by 1/255 is not found")
        found += 1
    golden.KEPT = test.work
    missing = test.faults_of("cornell_box.traced", frame)
    if not any("--accept" in line for line in missing) or not (test.work / "cornell_box.traced.candidate.exr").is_file():
        faults += 1
        print("a frame that nobody kept is not found")
    print(f"{found} frames changed and compared again, {faults} faults")
    return 1 if code or faults or not found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
