#!/usr/bin/env python3
"""Renders one small frame of every scene by every method and expects every counter of what must not
happen - refused rays, radiances that are not finite, clamped values - to be there and to be 0.
Usage: counters.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per count."""

import json
import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))
import work_folder  # noqa: E402

# Method: the counters that it must have beside clamped_half
METHODS = {
    "environment_map": {"clamped_cube_map", "refraction_mirrored"},
    "traced": {"refused", "not_finite", "total_reflection"},
    "second_order": {"clamped_cube_map", "refraction_mirrored"},
    "perturbation": {"paths", "path_types", "path_types_missed", "path_types_left_out",
                     "coarse_objects", "reflections_left_out", "total_reflection"},
    "reference": {"refused", "not_finite"},
}
# Pictures so small have more paths to their folds than traced_per_pixel allows: a warning
OPTIONS = {"perturbation": {"unsupported": "environment_map", "traced_per_pixel": 1000},
           "environment_map": {"face_size": 64}, "reference": {"samples": 2, "rays": 4}}
# By which something is seen through it: there is a warning otherwise
THROUGH_LENS = {"perturbation": {"max_bounces": 2}, "traced": {"bounces": 2},
                "reference": {"bounces": 2}}


def counters(scene, program, work):
    """Of each method's frame; None when the render failed."""
    config = {"scene": str(scene), "frames": "1", "preview": {"enabled": False},
              "image": {"width": 64, "height": 48, "samples": 2},
              "methods": [{"method": m, **OPTIONS.get(m, {}),
                           **(THROUGH_LENS.get(m, {}) if scene.stem == "lens" else {})} for m in METHODS]}
    file = work / f"{scene.stem}.json"
    file.write_text(json.dumps(config))
    out = work / scene.stem
    done = subprocess.run([program, "render", str(file), "--out", str(out), "-q"], text=True,
                          env=dict(os.environ, XDG_CACHE_HOME=os.environ.get("CATOPTRIC_TEST_CACHE", str(work / "cache"))), capture_output=True)
    if done.returncode != 0 or done.stderr:
        print(f"{scene.name}: exit {done.returncode}\n{done.stderr}")
        return None
    return {m: json.loads((out / m / "frames.jsonl").read_text())["counters"] for m in METHODS}


def main(root, program, work):
    folder = work_folder.fresh(work)
    scenes = sorted(pathlib.Path(root, "scenes").glob("*.json"))
    faults = 0
    for scene in scenes:
        found = counters(scene, program, folder)
        faults += found is None
        for method, counts in (found or {}).items():
            bad = {n: c for n, c in counts.items() if c > 0 and n.split(".")[-1].startswith(("refused", "not_finite", "clamped"))}
            # What refracts is in one scene, and some methods mirror it
            if "refraction_mirrored" in counts and (counts["refraction_mirrored"] > 0) != (scene.stem == "lens"):
                bad["refraction_mirrored"] = counts["refraction_mirrored"]
            missing = (METHODS[method] | {"clamped_half"}) - set(counts)
            if bad or missing:
                faults += 1
                print(f"{scene.name}, {method}: {bad or ''} {'not counted: ' + ', '.join(missing) if missing else ''}")
    print(f"{len(scenes)} scenes by {len(METHODS)} methods, {faults} faults")
    return 1 if faults or len(scenes) < 10 else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
