"""The cases of the test extremes: scenes and cameras at their extremes, each beside its truth."""
import base64
import copy
import json
import math
import pathlib
import struct
from dataclasses import dataclass, field
from typing import Callable, Optional

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"


@dataclass
class Case:
    name: str
    what: str
    make: Callable  # make(folder): writes scene.json or scene.gltf, and path.json
    truth: Optional[str] = None  # a case of BASES, or "reference": that method's picture of the case
    # L1_8bit by method, or (L1_8bit, why it is over three times what was measured); "*": every other method
    bounds: dict = field(default_factory=dict)
    clamped: bool = False  # values beyond half floats are what the case is about
    refused: int = 0  # rays that may be refused: of samples of collapsed triangles
    settings: dict = field(default_factory=dict)  # of the run config's image
    huge: bool = False  # takes minutes
    options: dict = field(default_factory=dict)  # of methods, by name
    methods: tuple = ()  # those that the case is about; else all


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
    (folder / "assets").symlink_to(SCENES / "assets")
    (folder / "scene.json").write_text(json.dumps(scene))
    (folder / "path.json").write_text(json.dumps(view))


SPHERES_EYE, SPHERES_TARGET = (1.5, 2.125, 4.25), (0, 0.375, -0.25)
BOX_EYE, BOX_TARGET = (0, 1, 3.25), (0, 0.875, 0)


def spheres(scale=1.0, offset=(0, 0, 0)):
    scene = moved(unbaked(load("nine_spheres")), scale, offset)
    return scene, camera(point(SPHERES_EYE, scale, offset), point(SPHERES_TARGET, scale, offset),
                         near=0.01 * scale)


def spheres_and_a_far_box():
    """A box that is farther away than floats can hold its shape beside them."""
    scene, view = spheres()
    scene["objects"].append({"name": "far", "shape": "box", "size": [1, 1, 1],
                             "translate": [1e8, 0, 0]})
    return scene, view


def room(name):
    """A room from its door, lit at run time, as a function of scale and offset."""
    def make(scale=1.0, offset=(0, 0, 0)):
        scene = load(name)
        door = scene["cameras"][0]
        view = camera(point(door["position"], scale, offset), point(door["target"], scale, offset),
                      fov=door["fov"], near=0.01 * scale)
        return moved(unbaked(scene), scale, offset), view
    return make


def box(scale=1.0, offset=(0, 0, 0), bake=False):
    scene = moved((baked if bake else unbaked)(load("cornell_box")), scale, offset)
    return scene, camera(point(BOX_EYE, scale, offset), point(BOX_TARGET, scale, offset), fov=40,
                         near=0.01 * scale)


def described(maker, *arguments, **more):
    return lambda folder: write(folder, *maker(*arguments, **more))


# --- Scenes of perfect mirrors, so that methods that trace see what the reference sees ---------

def mirrors_only(scene):
    def walk(objects):
        for thing in objects:
            material = thing.get("material")
            if isinstance(material, dict) and material.get("s", 0) > 0:
                material["g"] = 0
            walk(thing.get("children", []))
    scene = unbaked(scene)
    walk(scene["objects"])
    scene.pop("cameras", None)
    return scene


def seen(name, position, target, **more):
    """A small scene through a camera; its reflective surfaces made perfect mirrors."""
    return lambda folder: write(folder, mirrors_only(load(name)), camera(position, target, **more))


def parallel_mirrors(folder):
    mirror = {"base_color": [0, 0, 0], "s": 0.9, "g": 0, "tint": [1, 0.95, 0.9]}
    scene = {"name": "corridor", "bake": {"mode": "none"}, "ambient": [0.3, 0.3, 0.3], "objects": [
        {"name": "front", "shape": "plane", "size": [3, 3], "rotate": [90, 0, 0],
         "translate": [0, 0, -1], "material": mirror},
        {"name": "back", "shape": "plane", "size": [3, 3], "rotate": [-90, 0, 0],
         "translate": [0, 0, 1], "material": mirror},
        {"name": "floor", "shape": "plane", "size": [3, 2], "translate": [0, -1, 0],
         "material": {"texture": {"procedural": "checker"}}},
        {"name": "box", "shape": "box", "size": [0.4, 0.4, 0.4], "translate": [0.5, -0.8, 0.1],
         "material": {"base_color": [0.8, 0.2, 0.1]}}]}
    write(folder, scene, camera((-0.5, 0.1, 0.5), (0.1, -0.2, -1), fov=70))


def bright(emission=1.0, sky=1.0, lamp=1.0):
    """The box with a lamp, an environment and a light of these factors; the front wall is left out
    so that the sky is seen."""
    def make(folder):
        scene = mirrors_only(load("cornell_box"))
        scene["objects"] = [o for o in scene["objects"] if o["name"] not in ("ceiling", "ball")]
        scene["materials"]["lamp"]["emissive_strength"] = emission
        scene["materials"]["glossy"]["g"] = 0
        scene["environment"] = {"type": "gradient", "zenith": [0.3, 0.4, 0.6],
                                "horizon": [0.5, 0.5, 0.5], "ground": [0.2, 0.2, 0.2],
                                "scale": sky}
        scene["lights"][0]["intensity"] *= lamp
        write(folder, scene, camera((0, 1, 3.25), (0, 1.25, 0), fov=60))
    return make


# --- glTF ---------------------------------------------------------------------------------------

class Gltf:
    """A glTF file under construction, its one buffer inside."""

    def __init__(self):
        self.bytes = bytearray()
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
                     "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
                     "materials": []}

    def accessor(self, values, kind):
        flat = [x for v in values for x in v] if kind != "SCALAR" else values
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": 4 * len(flat)}
        self.bytes += struct.pack(f"<{len(flat)}{'I' if kind == 'SCALAR' else 'f'}", *flat)
        entry = {"bufferView": len(self.json["bufferViews"]), "count": len(values), "type": kind,
                 "componentType": 5125 if kind == "SCALAR" else 5126}
        if kind == "VEC3":
            packed = [struct.unpack("<3f", struct.pack("<3f", *v)) for v in values]
            entry["min"] = [min(v[k] for v in packed) for k in range(3)]
            entry["max"] = [max(v[k] for v in packed) for k in range(3)]
        self.json["bufferViews"].append(view)
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def material(self, color, metallic):
        """A mirror of metal, or a diffuse surface: with an ior of 1 it reflects nothing."""
        self.json["materials"].append({
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
                                     "roughnessFactor": 0 if metallic else 1},
            "extensions": {"KHR_materials_ior": {"ior": 1}}})
        return len(self.json["materials"]) - 1

    def mesh(self, shape, material):
        positions, normals, indices = shape
        self.json["meshes"].append({"primitives": [{
            "attributes": {"POSITION": self.accessor(positions, "VEC3"),
                           "NORMAL": self.accessor(normals, "VEC3")},
            "indices": self.accessor(indices, "SCALAR"), "material": material}]})
        return len(self.json["meshes"]) - 1

    def node(self, root=True, **members):
        self.json["nodes"].append(members)
        if root:
            self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)
        return len(self.json["nodes"]) - 1

    def write(self, folder, view):
        data = "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        if self.bytes:
            self.json["buffers"] = [{"byteLength": len(self.bytes), "uri": data}]
        document = {k: v for k, v in self.json.items() if v not in ([], {})}
        (folder / "scene.gltf").write_text(json.dumps(document))
        (folder / "path.json").write_text(json.dumps(view))


def grid(size, cells):
    """A square floor, facing +y: positions, normals, indices."""
    row = cells + 1
    positions = [(size * (i / cells - 0.5), 0.0, size * (j / cells - 0.5))
                 for j in range(row) for i in range(row)]
    indices = []
    for j in range(cells):
        for i in range(cells):
            a = j * row + i
            indices += [a, a + row, a + 1, a + 1, a + row, a + row + 1]
    return positions, [(0.0, 1.0, 0.0)] * len(positions), indices


def ball(radius, around=32, rings=16):
    positions, indices = [], []
    for j in range(rings + 1):
        for i in range(around + 1):
            theta, phi = math.pi * j / rings, 2 * math.pi * i / around
            positions.append((math.sin(theta) * math.cos(phi), math.cos(theta),
                              math.sin(theta) * math.sin(phi)))
    for j in range(rings):
        for i in range(around):
            a, b = j * (around + 1) + i, (j + 1) * (around + 1) + i
            indices += [a, a + 1, b, b, a + 1, b + 1]
    return [tuple(radius * x for x in p) for p in positions], positions, indices


VIEW = camera((1.5, 1.75, 3.5), (0, 0.375, 0), fov=40)


def balls(folder, change=lambda shape, name: shape, node=lambda name: {}, more=None, floor=True):
    """A floor with a mirror ball and a diffuse one; `change` makes the meshes, `node` adds to the
    nodes, `more` adds what it likes."""
    file = Gltf()
    gold, red = file.material((0.9, 0.7, 0.4), 1), file.material((0.7, 0.2, 0.1), 0)
    grey = file.material((0.5, 0.6, 0.6), 0)
    if floor:
        file.node(mesh=file.mesh(change(grid(4, 8), "floor"), grey), **node("floor"))
    for name, material, x in (("mirror", gold, -0.5), ("diffuse", red, 0.625)):
        file.node(mesh=file.mesh(change(ball(0.5), name), material),
                  **{"translation": [x, 0.5, 0], **node(name)})
    file.json["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_ior"]
    file.json["extensions"] = {"KHR_lights_punctual": {
        "lights": [{"type": "point", "intensity": 60}, {"type": "directional", "intensity": 1}]}}
    file.node(translation=[2, 3, 2], extensions={"KHR_lights_punctual": {"light": 0}})
    file.node(rotation=[-0.7071067811865476, 0, 0, 0.7071067811865476],
              extensions={"KHR_lights_punctual": {"light": 1}})
    if more:
        more(file)
    file.write(folder, VIEW)


def variant(**more):
    return lambda folder: balls(folder, **more)


def with_degenerate(shape, _):
    """Triangles without area between the others, and every triangle twice."""
    positions, normals, indices = shape
    a, b, c = indices[:3]
    middle = tuple((p + q) / 2 for p, q in zip(positions[a], positions[b]))
    positions = [*positions, middle, middle, middle]
    normals = [*normals, *[normals[a]] * 3]
    m = len(positions) - 3
    bad = [a, a, b, a, a, a, a, b, m, m, m + 1, m + 2]
    return positions, normals, bad + indices + bad + indices


def with_odd_normals(shape, _):
    """Lengths from 1e-3 to 1e3."""
    positions, normals, indices = shape
    return positions, [tuple(10.0 ** (k % 7 - 3) * x for x in n)
                       for k, n in enumerate(normals)], indices


def with_zero_normals(shape, _):
    positions, normals, indices = shape
    return positions, [(0.0, 0.0, 0.0)] * len(normals), indices


def stretched(factors):
    """The mesh shrunk by what its node stretches; normals by the inverse transpose."""
    def change(shape, name):
        if name == "floor":
            return shape
        positions, normals, indices = shape
        if math.prod(factors) < 0:
            indices = [i for k in range(0, len(indices), 3)
                       for i in (indices[k], indices[k + 2], indices[k + 1])]
        unit = []
        for n in normals:
            n = [x * f for x, f in zip(n, factors)]
            length = math.sqrt(sum(x * x for x in n))
            unit.append(tuple(x / length for x in n))
        return [tuple(x / f for x, f in zip(p, factors)) for p in positions], unit, indices
    return {"change": change,
            "node": lambda name: {} if name == "floor" else {"scale": list(factors)}}


def vanishing(file):
    """Balls that a scale of zero or a singular matrix leaves nothing of, and zero points."""
    for members in ({"scale": [0, 0, 0]}, {"scale": [1, 0, 0]},
                    {"matrix": [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.75, 0, 1]},
                    {"matrix": [0.25, 0.25, 0, 0] * 3 + [0, 0.5, 0, 1]},
                    {"matrix": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]}):
        for mesh in (1, 2):
            file.node(mesh=mesh, **members)


def flattened(file):
    """Balls that singular matrices flatten into disks: front and back in one plane."""
    for mesh, x in ((1, -1.25), (2, 1.25)):
        file.node(mesh=mesh, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, x, 0.625, 0.75, 1])


def crowd(count):
    """Nodes without meshes: most side by side, some in a chain."""
    def more(file):
        chain = 500
        for _ in range(count - chain):
            file.node(translation=[1, 2, 3])
        file.node()
        for _ in range(chain):
            file.json["nodes"][-1]["children"] = [len(file.json["nodes"])]
            file.node(root=False, translation=[0.5, 0, 0])
    return more


def tiles(cells, apart):
    """The floor as one mesh, or as a node and an object for every triangle of one shared mesh."""
    def more(file):
        if not apart:
            file.node(mesh=file.mesh(grid(4, cells), 2))
            return
        step = 4 / cells
        halves = []
        for indices in ([0, 2, 1], [1, 2, 3]):
            corners = [(step * i, 0.0, step * j) for j in (0, 1) for i in (0, 1)]
            halves.append(file.mesh((corners, [(0.0, 1.0, 0.0)] * 4, indices), 2))
        for k in range(cells * cells):
            place = [step * (k % cells) - 2, 0, step * (k // cells) - 2]
            for mesh in halves:
                file.node(mesh=mesh, translation=place)
    return {"floor": False, "more": more}


def empty_gltf(folder):
    Gltf().write(folder, VIEW)


def empty_description(folder):
    write(folder, {"name": "empty", "objects": [], "environment": {
        "type": "gradient", "zenith": [0.2, 0.4, 0.9], "horizon": [0.9, 0.9, 0.9],
        "ground": [0.2, 0.2, 0.2]}}, VIEW)


BASES = [
    Case("spheres", "nine_spheres, lit at run time", described(spheres)),
    Case("box", "cornell_box, lit at run time", described(box)),
    Case("living_room", "living_room, lit at run time", described(room("living_room"))),
    Case("bathroom", "bathroom, lit at run time", described(room("bathroom"))),
    Case("baked_box", "cornell_box, baked", described(box, bake=True)),
    Case("telephoto", "nine_spheres from 23 km, 0.01 degrees",
         seen("nine_spheres", (0, 0.5, 2.3e4), (0, 0.5, 0), fov=0.01)),
    Case("bright", "cornell_box without ceiling, its lamp 1e4 times as bright", bright(1e4),
         clamped=True),
    Case("balls", "two balls on a floor, glTF", variant()),
    Case("tiled", "two balls on a floor of 100,352 triangles", variant(**tiles(224, False))),
]

# What methods hold that trace the same rays as the reference, unless a case says more
TRACES = {"traced": 0.05, "glossy_lod": 0.05}


def traces(second_order=0.05, **more):
    """... and what second_order stays below, whose rays find what its depth images show."""
    return {**TRACES, "second_order": second_order, **more}


def lengths(factor):
    """Options in metres, for a scene that is scaled."""
    return {"screen_space": {"thickness": 0.1 * factor}}


CASES = [
    Case("spheres_small", "the scene is scaled by 1e-4", described(spheres, 1e-4), "spheres", {"*": 0.05},
         options=lengths(1e-4)),
    Case("spheres_large", "the scene is scaled by 1e5", described(spheres, 1e5), "spheres", {"*": 0.05},
         options=lengths(1e5)),
    Case("spheres_far", "the scene is moved by 1e5 m along x", described(spheres, 1, (1e5, 0, 0)), "spheres",
         {"*": 0.05}),
    # Cube maps are drawn from the scene's middle, which the box moves away
    Case("spheres_and_far", "there is also a box 1e8 m away", described(spheres_and_a_far_box), "spheres",
         {"traced": 0.05, "reference": 0.05, "second_order": 3}),
    Case("box_small", "the scene is scaled by 1e-4", described(box, 1e-4), "box", {"*": 0.05}, options=lengths(1e-4)),
    Case("box_large", "the scene is scaled by 1e5", described(box, 1e5), "box", {"*": 0.05}, options=lengths(1e5)),
    Case("box_far", "the scene is moved by 1e5 m along x, y and z", described(box, 1, (1e5, -1e5, 1e5)), "box",
         {"*": 0.3}),
    *(Case(f"{name}_{size}", f"the scene is scaled by {factor:g}", described(room(name), factor), name,
           {"*": 0.05}, options=lengths(factor)) for name in ("living_room", "bathroom")
      for size, factor in (("small", 1e-4), ("large", 1e5))),
    Case("baked_box_small", "the scene is scaled by 1e-4, and its light is baked", described(box, 1e-4, bake=True), "baked_box",
         {"*": 0.05}, options=lengths(1e-4)),
    Case("baked_box_large", "the scene is scaled by 1e5, and its light is baked", described(box, 1e5, bake=True), "baked_box",
         {"*": 0.05}, options=lengths(1e5)),
    Case("baked_box_far", "the scene is moved by 1e5 m along x, y and z, and its light is baked",
         described(box, 1, (1e5, -1e5, 1e5), bake=True), "baked_box", {"*": 0.4}),

    Case("grazing_mirror", "the camera is 1 mm off a mirror and looks along it",
         seen("planar_mirror", (1.1, 1.1, -1.989), (-1.2, 1.1, -1.989)), "reference",
         traces(0.1, traced=0.1, glossy_lod=0.15)),
    Case("grazing_floor", "the camera is 1 mm above the floor and looks along it",
         seen("nine_spheres", (1.9, 0.001, 4), (0, 0.001, 0)), "reference", traces(3, traced=0.1, glossy_lod=0.35)),
    Case("on_floor", "the camera is in the floor's plane and looks along it",
         seen("nine_spheres", (1.9, 0, 4), (0, 0, 0)), "reference", traces(3, glossy_lod=0.25)),
    Case("on_mirror", "the camera is in a mirror's plane and looks away from it",
         seen("planar_mirror", (0.1, 1.1, -1.99), (0.3, 0.9, 2)), "reference",
         traces(0.25, traced=0.25, glossy_lod=0.25)),
    Case("on_ball", "the camera is on the pole of a mirror ball",
         seen("nine_spheres", (0, 0.9, 0), (0, 0.5, -3)), "reference",
         traces(0.3, traced=0.12, glossy_lod=5)),
    Case("in_ball", "the camera is inside a mirror ball",
         seen("nine_spheres", (0.1, 0.45, 0), (-1, 0.45, 0.2)), "reference", traces(glossy_lod=0.15)),
    Case("narrow", "a field of view of 0.001 degrees, of a mirror ball 5 m away",
         seen("nine_spheres", (0, 0.5, 5), (0, 0.5, 0), fov=0.001), "reference", traces()),
    Case("narrow_far", "a field of view of 0.001 degrees, from 230 km away",
         seen("nine_spheres", (0, 0.5, 2.3e5), (0, 0.5, 0), fov=0.001), "telephoto",
         {"*": 2, "environment_map": 0.1, "perturbation": 0.15, "billboards": 0.15,
          "depth_impostors": 0.15}),
    Case("wide", "a field of view of 179.9 degrees",
         seen("cornell_box", (0.25, 0.5, 1), (0, 0.75, -1), fov=179.9), "reference", traces()),
    Case("parallel_mirrors", "the camera is between two mirrors; methods with bounces make 16",
         parallel_mirrors, "reference", traces(8, glossy_lod=8),
         options={"traced": {"bounces": 16}, "reference": {"bounces": 16}}),

    Case("degenerate", "some triangles have no area, and all are there twice",
         variant(change=with_degenerate), "balls", {"*": 0.05}),
    Case("odd_normals", "the normals are 0.001 to 1000 long", variant(change=with_odd_normals), "balls",
         {"*": 0.05}),
    Case("zero_normals", "the normals have the length 0", variant(change=with_zero_normals), "balls",
         {"*": 0.25, "billboards": 0.12}),
    Case("negative_scale", "the scene is scaled by -1 along x", variant(**stretched((-1, 1, 1))), "balls",
         {"*": 0.05}),
    Case("nonuniform_scale", "the scene is scaled by 4, 0.25 and -100 along its axes", variant(**stretched((4, 0.25, -100))),
         "balls", {"*": 0.05}),
    Case("zero_scale", "there are also nodes with a scale of 0, and with singular matrices",
         variant(more=vanishing), "balls",
         {"*": 0.05}, refused=8),
    Case("flattened", "there are also balls that singular matrices flatten", variant(more=flattened),
         "reference", traces(0.6, traced=0.2, glossy_lod=0.25), refused=8),
    Case("nodes_100k", "there are also 100,000 nodes", variant(more=crowd(100_000)), "balls", {"*": 0.05}),
    Case("objects_100k", "the floor consists of 100,352 objects of one triangle each",
         variant(**tiles(224, True)), "tiled",
         # A floor's image has other texels than those of its tiles
         {"*": 0.05, "billboards": 1, "depth_impostors": 1, "glossy_lod": 0.25}),
    Case("empty", "the scene description has no objects", empty_description, "reference",
         {"*": 0.05}),
    Case("empty_gltf", "the glTF file has nothing in it", empty_gltf, "reference", {"*": 0}),

    Case("bright_1e5", "the lamp is 1e5 times as bright", bright(1e5), "bright", {"*": 0.05},
         clamped=True),
    Case("bright_1e30", "the lamp is 1e30 times as bright", bright(1e30), "bright", {"*": 0.05},
         clamped=True),
    Case("blinding", "the lamp, the sky and the light are 1e29 times as bright", bright(1e29, 1e29, 1e29),
         "reference", traces(), clamped=True),

    Case("one_pixel", "the frame has one pixel", seen("nine_spheres", SPHERES_EYE, SPHERES_TARGET), "reference",
         traces(), settings={"width": 1, "height": 1}),
    Case("column", "the frame has 1 x 16384 pixels, with one sample each", seen("nine_spheres", SPHERES_EYE, SPHERES_TARGET),
         "reference", traces(0.35, traced=0.35, glossy_lod=1), settings={"width": 1, "height": 16384, "samples": 1}),
    Case("row", "the frame has 16384 x 1 pixels, with one sample each", seen("nine_spheres", SPHERES_EYE, SPHERES_TARGET),
         "reference", traces(), settings={"width": 16384, "height": 1, "samples": 1}),
    Case("huge", "the frame has 8192 x 8192 pixels, with one sample each", seen("nine_spheres", SPHERES_EYE, SPHERES_TARGET),
         "reference", traces(0.6, traced=0.3),
         settings={"width": 8192, "height": 8192, "samples": 1}, huge=True),
]
