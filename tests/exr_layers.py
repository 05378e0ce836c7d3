#!/usr/bin/env python3
"""Renders a frame with all layers and reads it back with oiiotool: every channel is one that Blender's and
others' readers show (LAYER.CHANNEL with a channel of a single letter), and the attributes say what made it.
Usage: exr_layers.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import json
import os
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402

LAYERS = ["Z", "N", "reflection", "diffuse", "s", "id", "cluster"]
CHANNELS = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "s.X", "id.object.X", "id.cluster.X", "mask.reflective.X",
            "mask.glossy.X", "mask.environment.X", "mask.below_horizon.X", "mask.sky.X",
            *(f"{layer}.{c}" for layer in ("reflection", "diffuse") for c in "RGB")}
ATTRIBUTES = {"catoptric.name": '"clusters"', "catoptric.method": '"second_order"', "catoptric.seed": '"7"',
              "catoptric.samplesPerAxis": "2", "catoptric.version": None}


def main(root, program, work):
    folder = work_folder.fresh(work)
    config = {"scene": str(pathlib.Path(root, "scenes/cornell_box.json").resolve()), "frames": "1", "seed": 7,
              "image": {"width": 32, "height": 32, "samples": 2, "masks": True, "layers": LAYERS},
              "methods": [{"method": "second_order", "name": "clusters"}], "preview": {"enabled": False}}
    (folder / "layers.json").write_text(json.dumps(config))
    environment = dict(os.environ, XDG_CACHE_HOME=os.environ.get("CATOPTRIC_TEST_CACHE", str(folder / "cache")))
    subprocess.run([program, "render", str(folder / "layers.json"), "--out", str(folder / "out"), "-q"],
                   check=True, env=environment, stdout=subprocess.DEVNULL)
    info = subprocess.run(["oiiotool", "--info", "-v", str(folder / "out/frames/frame.0001.exr")],
                          check=True, text=True, capture_output=True).stdout
    faults = []
    listed = re.search(r"channel list: (.*)", info).group(1)
    channels = {re.sub(r" \(.*", "", name.strip()) for name in listed.split(",")}
    if channels != CHANNELS:
        faults.append(f"channels missing {sorted(CHANNELS - channels)}, more {sorted(channels - CHANNELS)}")
    for name, value in ATTRIBUTES.items():
        found = re.search(rf"^\s*{re.escape(name)}: (.*)$", info, re.MULTILINE)
        if found is None or (value is not None and found.group(1) != value):
            faults.append(f"{name} is {found and found.group(1)}, expected {value or 'any'}")
    for fault in faults:
        print(fault)
    print(f"{len(channels)} channels, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
