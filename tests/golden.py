#!/usr/bin/env python3
"""Every scene family by every method is drawn as kept in tests/golden/ (golden_frames.py), and the comparison is able to
fail: it finds another method's frame and a frame that nobody kept. Each frame's largest reflector covers more pixels than
may differ, so that it is found when it is brighter by 1/255. The counters of each frame are held to what the methods say
of them, as in counters.py.
Usage: golden.py PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import json
import sys

sys.dont_write_bytecode = True
import counters  # noqa: E402
import golden_frames as golden  # noqa: E402
import method_list  # noqa: E402


def counter_faults(test, made):
    methods = method_list.Methods(test.program)
    found = []
    for name, frame in made.items():
        family, method = name.split(".")
        counts = json.loads((frame.parent.parent / "frames.jsonl").read_text().splitlines()[0])["counters"]
        scene = test.families["families"][family]["scene"]
        found += [f"{name}: {fault}" for fault in counters.faults_of(scene, counts, method, methods)]
        if not counters.faults_of(scene, {**counts, "refused": 1}, method, methods):
            found.append(f"{name}: a refused ray is not found")
    return found


def main(program, work):
    test = golden.Golden(program, work)
    frames = test.frames(test.names([]))
    code = test.check(frames, True)
    made = {name: frame for name, frame in frames.items() if not isinstance(frame, str)}
    limits, faults = test.families["limits"], counter_faults(test, made)
    for name, errors in test.compare(made, made)[1].items():
        largest = max((part["pixels"] for part in errors["objects"]), default=0)
        if not 100 * largest / errors["pixels"] > limits["fail-percent"] or not limits["fail"] < 1 / 255:
            faults.append(f"{name}: a reflector of {largest} pixels that is brighter by 1/255 would not be found")
    one, other = "cornell_box.traced", golden.KEPT / "cornell_box.environment_map.exr"
    if one not in test.compare({one: made[one]}, {one: other})[0]:
        faults.append("another method's frame is not found")
    golden.KEPT = test.work
    if "--accept" not in test.faults({one: made[one]})[one][0]:
        faults.append("a frame that nobody kept is not found")
    print(*faults, f"{len(made)} frames looked at, {len(faults)} faults", sep="\n")
    return 1 if code or faults or not made else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
