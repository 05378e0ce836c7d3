"""A scene of two objects, a run of it, a night and a suite, whose commands take moments: what tests disturb."""
import json
import os
import subprocess

SCENE = {"objects": [
    {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.6, 0.5, 0.4]}},
    {"name": "ball", "shape": "sphere", "radius": 0.5, "segments": [24, 12], "translate": [0, 0.5, 0],
     "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}],
    "environment": {"type": "constant", "color": [0.5, 0.6, 0.7]}}


def write(folder, frames, night_frames, width):
    """Writes scene.json, path.json, run.json, n.suite.json and t.suite.json. Frames have 3:2 pixels."""
    files = {
        "scene": SCENE,
        "path": {"frames": frames, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}},
        "run": {"scene": "scene.json", "path": "path.json", "frames": f"1-{frames}",
                "image": {"width": width, "height": width * 2 // 3, "layers": ["id"]},
                "methods": ["traced", {"method": "reference", "name": "truth", "samples": 2, "rays": 1, "bounces": 1,
                                       "max_standard_error": 0}],
                "errors": {"against": ["truth"]}},
        "n.suite": {"title": "Small",
                    "scenes": {"ball": {"config": "run.json", "frames": {"full": night_frames}, "against": "truth"}}},
        "t.suite": {"title": "Small", "runs": {"r": {"config": "run.json", "against": "truth", "times": False}},
                    "efforts": {"smoke": {"image.height": width // 2}},
                    "tables": [{"title": "T", "columns": ["a", "b"],
                                "rows": [["error(r.traced, L1_8bit)", "worst(r.traced, L1_8bit)"]]}]},
    }
    for name, content in files.items():
        (folder / f"{name}.json").write_text(json.dumps(content))


def prepared(work, **sizes):
    """A new folder in `work` with the files and an empty cache."""
    folder = work / "base"
    folder.mkdir()
    (folder / "cache").mkdir()
    write(folder, **sizes)
    return folder


def start(program, folder, command):
    """The command in a copy of that folder, with its cache."""
    return subprocess.Popen([program, *command.split()], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                            env=dict(os.environ, CATOPTRIC_CACHE=str(folder / "cache")))
