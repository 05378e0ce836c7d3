"""Cases for lobes and for what glossy_lod makes of the scene: geometry images and boxes."""
import math
import struct

import cases
from impostors import BALL, coloured

METHODS = ("traced", "glossy_lod", "reference")
RED, BLUE = (0.7, 0.2, 0.1), (0.1, 0.3, 0.7)
RING = coloured("ring", "torus", (0, 0.3, 0), BLUE, radius=0.7, tube=0.2, segments=[48, 24])
BLOCK = coloured("block", "box", (0.3, 0.3, -0.8), size=[0.5, 0.6, 0.4], rotate=[0, 30, 0])


def floor(**lobe):
    return {"name": "floor", "shape": "plane", "size": [3, 3], "reflective": True,
            "material": {"base_color": [0.1, 0.1, 0.12], "s": 0.9, **lobe}}


def scene(*objects, position=(1.2, 1.2, 2.4), target=(0, 0.2, 0), sky=None, lights=True):
    def make(folder):
        description = {"name": "lobes", "objects": list(objects), "bake": {"mode": "none"},
                       "environment": sky or {"type": "gradient", "zenith": [0.2, 0.34, 0.62],
                                              "horizon": [0.82, 0.85, 0.88], "ground": [0.25, 0.22, 0.2]},
                       "lights": [{"name": "sun", "type": "directional", "direction": [-0.5, -1, -0.62],
                                   "intensity": 2}] if lights else []}
        cases.write(folder, description, cases.camera(position, target))
    return make


def sun(folder):
    """A sky of 64 x 32 texels in Radiance's format; one of them is a sun 30,000 times as bright."""
    width, height = 64, 32
    texels = bytearray()
    for y in range(height):
        for x in range(width):
            texels += rgbe(6000.0 if (x, y) == (40, 7) else 0.2 + 0.3 * (y < height // 2))
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    (folder / "sun.hdr").write_bytes(header + texels)
    scene(floor(n=100), RING, BLOCK, sky={"type": "file", "file": "sun.hdr"}, lights=False)(folder)


def rgbe(value):
    mantissa, exponent = math.frexp(value)
    return struct.pack("BBBB", *[int(256 * mantissa)] * 3, exponent + 128)


def sheet(corners):
    """A mesh of one triangle."""
    return {"name": f"sheet {corners[0]}", "shape": "polygons", "vertices": [list(c) for c in corners],
            "faces": [[0, 1, 2]], "material": {"base_color": list(RED)}}


SHEETS = [sheet([(x, 0.1, -0.5), (x + 0.5, 0.1, -0.5), (x, 0.9, -0.7)]) for x in (-1.0, -0.3, 0.4)]
DULL = {"glossy_lod": {"rays": 160, "alpha": 1}, "traced": {"rays": 160}, "reference": {"rays": 64}}

BASES = [
    cases.Case("mirror", "a mirror under a ring and a block", scene(floor(g=0), RING, BLOCK), methods=METHODS),
    cases.Case("sun_256", "a sky with a sun, n = 100, 256 rays", sun, methods=METHODS[:2],
               options={"glossy_lod": {"rays": 256, "alpha": 0}, "traced": {"rays": 256, "environment": "filtered"}}),
    cases.Case("size_512", "size 512", scene(floor(n=500), RING, BLOCK, BALL), methods=("glossy_lod",),
               options={"glossy_lod": {"size": 512, "rays": 20}}),
]


def lobes(name, what, make, glossy_lod=0.05, traced=0.05, **more):
    return cases.Case(name, what, make, "reference", {"glossy_lod": glossy_lod, "traced": traced}, methods=METHODS, **more)


CASES = [
    cases.Case("n_1e6", "the exponent is 1e6: a mirror", scene(floor(n=1e6), RING, BLOCK), "mirror", {"*": 0},
               methods=METHODS),
    lobes("n_0", "the exponent is 0: a lobe as wide as half a sphere", scene(floor(n=0), RING, BLOCK), 1, 1,
          options=DULL),
    lobes("alpha_1e3", "alpha is 1e3: as coarse as the geometry can be had", scene(floor(n=100), RING, BLOCK), 10, 0.25,
          options={**DULL, "glossy_lod": {"rays": 160, "alpha": 1e3}}),
    lobes("in_boxes", "mirrors inside a ring and a block, and in their boxes",
          scene(floor(g=0), RING, {**BLOCK, "translate": [0, 0.2, -0.5]},
                {**BALL, "radius": 0.25, "translate": [0, 0.3, 0]}), 0.3),
    lobes("one_triangle", "meshes of one triangle over a mirror", scene(floor(g=0), *SHEETS)),
    lobes("squashed", "a ring that is flattened to a thousandth, and a block stretched to a needle",
          scene(floor(g=0), {**RING, "scale": [1, 0.001, 1]}, {**BLOCK, "scale": [0.01, 3, 1]}), 0.2),
    cases.Case("sun", "a sky with a sun 30,000 times as bright, 8 rays", sun, "sun_256", {"*": 2, "glossy_lod": 3},
               methods=METHODS[:2], options={"glossy_lod": {"rays": 8, "alpha": 0}, "traced": {"rays": 8, "environment": "filtered"}}),
    cases.Case("most_quads", "more quads are asked for than there is room for",
               scene(floor(n=500), RING, BLOCK, BALL, *[{**BALL, "name": f"far {i}", "translate": [9, 0, i]} for i in range(4)]),
               "size_512", {"glossy_lod": 0.2}, methods=("glossy_lod",), huge=True,
               options={"glossy_lod": {"size": 1024, "rays": 20}}),
]
