"""Cases for methods that show objects by flat pictures of them: billboards, depth_impostors."""
import cases
from bad_inputs import valid

MIRROR = {"base_color": [0.1, 0.1, 0.12], "s": 0.9, "g": 0}
FLOOR = {"name": "floor", "shape": "plane", "size": [4, 4], "uv": "metres",
         "material": {"texture": {"procedural": "checker", "count": [2, 2]}}}
BALL = {"name": "mirror", "shape": "sphere", "radius": 0.5, "segments": [48, 24], "translate": [0, 0.5, 0],
        "material": MIRROR, "reflective": True}
EYE, TARGET = (1.5, 1.5, 3), (0, 0.5, 0)


def coloured(name, shape, translate, colour=(0.7, 0.2, 0.1), **more):
    return {"name": name, "shape": shape, "translate": list(translate),
            "material": {"base_color": list(colour)}, **more}


def scene(*objects, position=EYE, target=TARGET, scale=1.0):
    """Objects under a sky and a sun without shadows."""
    def make(folder):
        description = cases.moved({
            "name": "impostors", "objects": list(objects), "bake": {"mode": "none"},
            "environment": {"type": "gradient", "zenith": [0.2, 0.34, 0.62],
                            "horizon": [0.82, 0.85, 0.88], "ground": [0.25, 0.22, 0.2]},
            "lights": [{"name": "sun", "type": "directional", "direction": [-0.5, -1, -0.62],
                        "intensity": 2}]}, scale)
        at = [scale * v for v in position], [scale * v for v in target]
        cases.write(folder, description, cases.camera(*at, near=0.01 * scale))
    return make


def leaves(folder):
    """Two crossing boards with a texture of round leaves, the rest of it cut out."""
    size = 64
    rows = b""
    for y in range(size):
        rows += b"\0"
        for x in range(size):
            u, v = (4 * x / size) % 1 - 0.5, (4 * y / size) % 1 - 0.5
            rows += bytes((60, 140 + 4 * (x % 16), 40, 255 if u * u + v * v < 0.16 else 0))
    (folder / "leaves.png").write_bytes(valid.png(size, size, rows, color=6))
    material = {"texture": "leaves.png", "alpha_cutoff": 0.5}
    boards = [{"name": f"leaves {angle}", "shape": "panel", "size": [1, 1], "translate": [1, 0, 0.6],
               "rotate": [0, angle, 0], "material": material} for angle in (20, 110, 200, 290)]
    scene(FLOOR, BALL, *boards)(folder)


def crowd(count, *others):
    across = 25
    balls = [{"name": f"mirror {i}", "shape": "sphere", "radius": 0.06, "segments": [12, 6],
              "translate": [0.15 * (i % across - across // 2), 0.06, 0.15 * (i // across - count // across // 2)],
              "material": MIRROR, "reflective": True} for i in range(count)]
    return scene(FLOOR, *balls, *others)


METHODS = ("environment_map", "traced", "billboards", "depth_impostors", "reference")
RED_BALL = {"radius": 0.3, "segments": [32, 16]}
BASES = [cases.Case("ball", "a mirror ball and a ball on a floor",
                    scene(FLOOR, BALL, coloured("ball", "sphere", (0.9, 0.3, 0.5), **RED_BALL)), methods=METHODS)]


def case(name, what, make, billboards, depth_impostors, **bounds):
    return cases.Case(name, what, make, "reference",
                      {**cases.TRACES, "billboards": billboards, "depth_impostors": depth_impostors, **bounds}, methods=METHODS)


CASES = [
    *(cases.Case(f"ball_{size}", f"scaled by {factor:g}",
                 scene(FLOOR, BALL, coloured("ball", "sphere", (0.9, 0.3, 0.5), **RED_BALL), scale=factor),
                 "ball", {"*": 0.05}, methods=METHODS) for size, factor in (("tiny", 1e-4), ("giant", 1e5))),
    case("leaves", "crossing boards whose texture is cut out between round leaves", leaves, 1.5, 1.5, traced=1),
    case("crossing", "two boxes cross each other before a mirror ball",
         scene(FLOOR, BALL, coloured("one", "box", (1, 0.3, 0.5), size=[0.9, 0.3, 0.2], rotate=[0, 30, 0]),
               coloured("two", "box", (1, 0.3, 0.5), (0.1, 0.3, 0.7), size=[0.2, 0.5, 0.9], rotate=[0, 30, 0])), 1.5, 0.8,
         traced=0.25),
    case("within_object", "a mirror ball within an open tube",
         scene(FLOOR, BALL, coloured("tube", "cylinder", (0, 0, 0), radius=0.9, height=0.6, caps=False)), 3, 0.6, traced=0.2),
    case("touching", "a ball touches a mirror ball",
         scene(FLOOR, BALL, coloured("ball", "sphere", (0.7, 0.5, 0.387), **RED_BALL)), 1, 1, traced=0.25),
    case("intersecting", "a ball is half inside a mirror ball",
         scene(FLOOR, BALL, coloured("ball", "sphere", (0.4, 0.5, 0.22), **RED_BALL)), 0.6, 0.6, traced=0.3),
    case("coinciding", "a ring about a mirror ball: their centroids are one",
         scene(FLOOR, BALL, coloured("ring", "torus", (0, 0.5, 0), radius=0.8, tube=0.08, segments=[48, 12])), 3, 1, traced=0.3),
    case("no_diffuse", "two mirror balls under a sky, and nothing else",
         scene(BALL, {**BALL, "name": "other", "translate": [1.1, 0.5, 0.3]}), 1, 0.08),
    case("large_floor", "the floor has 10 km, the rest 1 m",
         scene({**FLOOR, "size": [1e4, 1e4]}, BALL, coloured("ball", "sphere", (0.9, 0.3, 0.5), **RED_BALL)), 6, 6,
         traced=1),
    case("speck", "a ball of 1 mm beside a mirror ball",
         scene(FLOOR, BALL, coloured("ball", "sphere", (0.6, 0.5, 0.3), radius=0.001, segments=[12, 6])), 1, 1, traced=0.3),
    # 64 objects get billboards, 256 depth maps (the option most); the other balls stay in the environment map
    case("reflectors_500", "500 mirror balls and a box on a floor",
         crowd(500, coloured("box", "box", (0, 0.5, -1.9), size=[2, 1, 0.1])), 15, 15, traced=0.1),
]
