"""The cases of scripts/extremes: scenes and cameras at their extremes, each beside its truth."""
import base64
import copy
import json
import math
import pathlib
import struct
from dataclasses import dataclass, field
from typing import Callable, Optional

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"


@dataclass
class Case:
    name: str
    what: str
    make: Callable  # make(folder): writes scene.json or scene.gltf, and path.json
    truth: Optional[str] = None  # a case of BASES, or "reference": that method's picture of the case
    bounds: dict = field(default_factory=dict)  # L1_8bit by method; "*": every other method
    clamped: bool = False  # values beyond half floats are what the case is about
    settings: dict = field(default_factory=dict)  # of the run config's image
    huge: bool = False  # takes minutes
    methods: Optional[tuple] = None  # only these


# --- Scene descriptions -------------------------------------------------------------------------

def load(name):
    return json.loads((SCENES / f"{name}.json").read_text())


def unbaked(scene):
    """Lit at run time: no bake to wait for, and the light's formulas are part of the case."""
    scene = copy.deepcopy(scene)
    scene["bake"] = {"mode": "none"}
    for light in scene.get("lights", []):
        light["baked"] = False
    return scene


def baked(scene, rays=16):
    scene = copy.deepcopy(scene)
    scene["bake"] = {"mode": "full", "rays": rays, "bounces": 1}
    return scene


def moved(scene, scale=1.0, offset=(0, 0, 0)):
    """The scene in a group that scales and moves it, its lights with it: the same radiance."""
    scene = copy.deepcopy(scene)
    scene["objects"] = [{"name": "all", "scale": scale, "translate": list(offset),
                         "children": scene["objects"]}]
    for light in scene.get("lights", []):
        if "position" in light:
            light["position"] = point(light["position"], scale, offset)
            light["intensity"] = light.get("intensity", 1) * scale * scale
        if light["type"] != "directional":
            light["radius"] = light.get("radius", 0) * scale
    scene.pop("cameras", None)
    return scene


def point(p, scale, offset):
    return [scale * x + o for x, o in zip(p, offset)]


def camera(position, target, fov=45, near=0.01, up=(0, 1, 0)):
    return {"fov": fov, "near": near, "up": list(up),
            "keyframes": [{"position": list(position), "target": list(target)}]}


def write(folder, scene, view):
    (folder / "scene.json").write_text(json.dumps(scene))
    (folder / "path.json").write_text(json.dumps(view))


SPHERES_EYE, SPHERES_TARGET = (1.5, 2.125, 4.25), (0, 0.375, -0.25)
BOX_EYE, BOX_TARGET = (0, 1, 3.25), (0, 0.875, 0)


def spheres(scale=1.0, offset=(0, 0, 0)):
    scene = moved(unbaked(load("nine_spheres")), scale, offset)
    return scene, camera(point(SPHERES_EYE, scale, offset), point(SPHERES_TARGET, scale, offset),
                         near=0.01 * scale)


def box(scale=1.0, offset=(0, 0, 0), bake=False):
    scene = moved((baked if bake else unbaked)(load("cornell_box")), scale, offset)
    return scene, camera(point(BOX_EYE, scale, offset), point(BOX_TARGET, scale, offset), fov=40,
                         near=0.01 * scale)


def described(maker, *arguments, **more):
    return lambda folder: write(folder, *maker(*arguments, **more))


BASES = [
    Case("spheres", "nine_spheres, lit at run time", described(spheres)),
    Case("box", "cornell_box, lit at run time", described(box)),
    Case("baked_box", "cornell_box, baked", described(box, bake=True)),
]

CASES = [
    Case("spheres_small", "scaled by 1e-4", described(spheres, 1e-4), "spheres", {"*": 0.05}),
    Case("spheres_large", "scaled by 1e5", described(spheres, 1e5), "spheres", {"*": 0.05}),
    Case("spheres_far", "moved by 1e5 along x", described(spheres, 1, (1e5, 0, 0)), "spheres",
         {"*": 0.05}),
    Case("box_small", "scaled by 1e-4", described(box, 1e-4), "box", {"*": 0.05}),
    Case("box_large", "scaled by 1e5", described(box, 1e5), "box", {"*": 0.05}),
    Case("box_far", "moved by 1e5 along x, y and z", described(box, 1, (1e5, -1e5, 1e5)), "box",
         {"*": 0.3}),
    Case("baked_box_small", "scaled by 1e-4, baked", described(box, 1e-4, bake=True), "baked_box",
         {"*": 0.05}),
    Case("baked_box_large", "scaled by 1e5, baked", described(box, 1e5, bake=True), "baked_box",
         {"*": 0.05}),
    Case("baked_box_far", "moved by 1e5, baked", described(box, 1, (1e5, -1e5, 1e5), bake=True),
         "baked_box", {"*": 0.4}),
]
