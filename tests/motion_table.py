#!/usr/bin/env python3
"""The table of docs/benchmarks.md: how much each method flickers against traced on the paths through the rooms.

    tests/motion_table.py build/release/bin/catoptric out/motion
"""

import argparse
import json
import pathlib
import statistics
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
PATHS = {"living_room_a": "living_room", "living_room_b": "living_room", "bathroom_a": "bathroom", "bathroom_b": "bathroom"}
METHODS = ["environment_map", "billboards", "depth_impostors", "second_order", "perturbation", "reprojection",
           "image_warp", "glossy_lod"]


def render(arguments, path, out):
    subprocess.run([arguments.program, "render", ROOT / "configs/nightly/every.json", "--frames", arguments.frames,
                    "--method", ",".join(["traced", *arguments.methods]), "--threads", str(arguments.threads),
                    "--set", f"scene={ROOT}/scenes/{PATHS[path]}.json", "--set", f"path={ROOT}/paths/{path}.json",
                    "--set", f"image.width={arguments.size}", "--set", f"image.height={arguments.size}",
                    "--set", 'image.layers=["s","id","Z","motion"]', "--set", "methods.perturbation.unsupported=traced",
                    "--existing", "resume", "--no-tables", "--out", out, "-q"], check=True)


def motion(arguments, run, truth):
    found = subprocess.run([arguments.program, "compare", run, truth, "--json", "-q"], check=True, capture_output=True)
    return json.loads(found.stdout)[0]["motion"]


def line(cells):
    print("    " + "".join(cell.ljust(width) for cell, width in zip(cells, (18, 26, 30, 0))), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--frames", default="1-120", help="consecutive ones, at least the 8 that steady needs")
    parser.add_argument("--size", type=int, default=192)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--methods", type=lambda text: text.split(","), default=METHODS)
    arguments = parser.parse_args()
    for path in PATHS:
        render(arguments, path, arguments.work / path)
    line(["", "flicker", "flicker_mc, steady, unsteady", "most flicker"])
    for method in arguments.methods:
        found = {path: motion(arguments, arguments.work / path / method, arguments.work / path / "traced")
                 for path in PATHS}
        worst = max(found, key=lambda path: found[path]["frames"][str(found[path]["worst_frame"])])
        most = found[worst]
        line([method, ", ".join(f"{one['flicker']:.2f}" for one in found.values()),
              ", ".join(f"{statistics.fmean(one[name] for one in found.values()):.2f}"
                        for name in ("flicker_mc", "steady", "unsteady")),
              f"{most['frames'][str(most['worst_frame'])]:.2f}: {worst} {most['worst_frame']}"])


if __name__ == "__main__":
    main()
