#!/usr/bin/env python3
"""Renders one small frame of every scene by every method and holds its counters to what the methods say of them
(`catoptric list methods --json`): those that are always there are there, those that must be 0 - refused rays, radiances
that are not finite, clamped values - are 0, and no other is there.
By default the only scene is a furnished room: the test golden holds the frames that it renders of each scene family to
the same. With CATOPTRIC_LONG=1 every scene is rendered.
Usage: counters.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per count."""

import json
import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
import method_list  # noqa: E402
import work_folder  # noqa: E402

ROOM = "bathroom"
REFRACTS = "lens"  # the scene with a body that refracts, which some methods mirror and count


def counters(scene, program, methods, work):
    """Of each method's frame; None when the render failed."""
    config = {"scene": str(scene), "frames": "1", "preview": {"enabled": False},
              "image": {"width": 64, "height": 48, "samples": 2},
              "methods": methods.configured(refracting=scene.stem == REFRACTS)}
    file = work / f"{scene.stem}.json"
    file.write_text(json.dumps(config))
    out = work / scene.stem
    cache = os.environ.get("CATOPTRIC_TEST_CACHE", str(work / "cache"))
    done = subprocess.run([program, "render", str(file), "--out", str(out), "-q"], text=True,
                          env=dict(os.environ, XDG_CACHE_HOME=cache), capture_output=True)
    if done.returncode != 0 or done.stderr:
        print(f"{scene.name}: exit {done.returncode}\n{done.stderr}")
        return None
    return {m: json.loads((out / m / "frames.jsonl").read_text())["counters"] for m in methods.names}


def faults_of(scene, counts, method, methods):
    """What is wrong with one frame's counters."""
    faults = []
    # METHOD.COUNTER is of another method that fills some of the reflectors
    others = {name.split(".")[0] for name in counts if "." in name}
    known = methods.counters(method) + [{**c, "name": f"{other}.{c['name']}", "only_with": "its reflectors"}
                                        for other in others for c in methods.counters(other)]
    for counter in known:
        name = counter["name"]
        if name not in counts and not counter["only_with"]:
            faults.append(f"{name} is not counted")
        if counter["must_be_zero"] and counts.get(name, 0) > 0:
            faults.append(f"{name} is {counts[name]}")
    faults += [f"{name} is not described" for name in set(counts) - {c["name"] for c in known}]
    mirrored = counts.get("refraction_mirrored", None)
    if mirrored is not None and (mirrored > 0) != (scene == REFRACTS):
        faults.append(f"refraction_mirrored is {mirrored}")
    return faults


def main(root, program, work):
    folder = work_folder.fresh(work)
    methods = method_list.Methods(program)
    scenes = sorted(pathlib.Path(root, "scenes").glob("*.json"))
    if os.environ.get("CATOPTRIC_LONG") != "1":
        scenes = [scene for scene in scenes if scene.stem == ROOM]
    faults = 0
    for scene in scenes:
        found = counters(scene, program, methods, folder)
        faults += found is None
        for method, counts in (found or {}).items():
            for fault in faults_of(scene.stem, counts, method, methods):
                faults += 1
                print(f"{scene.name}, {method}: {fault}")
    zeros = sum(c["must_be_zero"] for m in methods.names for c in methods.counters(m))
    print(f"{len(scenes)} scenes by {len(methods.names)} methods, {zeros} counters that must be 0, {faults} faults")
    return 1 if faults or not scenes or zeros < len(methods.names) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
