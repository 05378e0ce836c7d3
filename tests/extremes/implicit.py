"""Cases with implicit surfaces, where paths and normals are singular."""
import cases

MIRROR = {"base_color": [0.1, 0.1, 0.12], "s": 0.9, "g": 0, "tint": [0.97, 0.96, 0.93]}
FLOOR = {"name": "floor", "shape": "plane", "size": [4, 4], "cell": 0.25, "uv": "metres",
         "material": {"texture": {"procedural": "checker", "count": [2, 2]}}}
BLOCK = {"name": "block", "shape": "box", "size": [0.4, 0.4, 0.4], "segments": [3, 3, 3],
         "translate": [0.75, 0.25, 0.75], "material": {"base_color": [0.7, 0.2, 0.1]}}


def scene(position, target, *objects, fov=45, scale=1.0, up=(0, 1, 0)):
    """Objects on a floor under a sky and a sun without shadows; written to a folder."""
    def make(folder):
        description = cases.moved({
            "name": "implicit", "objects": [FLOOR, *objects], "bake": {"mode": "none"},
            "environment": {"type": "gradient", "zenith": [0.2, 0.34, 0.62],
                            "horizon": [0.82, 0.85, 0.88], "ground": [0.25, 0.22, 0.2]},
            "lights": [{"name": "sun", "type": "directional", "direction": [-0.5, -1, -0.62],
                        "intensity": 2}]}, scale)
        at = [scale * v for v in position], [scale * v for v in target]
        cases.write(folder, description, cases.camera(*at, fov=fov, near=0.01 * scale, up=up))
    return make


def surface(kind, **more):
    return {"name": kind, "shape": "implicit", "surface": kind, "material": MIRROR, **more}


def vase(scale):
    return scene((0.5, 2, 4), (0, 0.75, 0), surface("vase", segments=[32, 32]), BLOCK, scale=scale)


def polygon(*vertices):
    return {"name": "polygon", "shape": "polygons", "vertices": [list(v) for v in vertices],
            "faces": [list(range(len(vertices)))], "material": {"base_color": [0.2, 0.5, 0.2]}}


BALL = surface("sphere", radius=0.5, segments=[32, 16], translate=[0, 0.5, 0])
EYE, TARGET = (1.5, 1.75, 3), (0, 0.5, 0)

BASES = [cases.Case("vase", "a vase, an implicit surface, and a block", vase(1.0))]


def against_reference(name, what, make, **bounds):
    return cases.Case(name, what, make, "reference", {**cases.TRACES, **bounds})


CASES = [
    cases.Case("vase_small", "scaled by 1e-4", vase(1e-4), "vase", {"*": 0.05}, options=cases.lengths(1e-4)),
    cases.Case("vase_large", "scaled by 1e5", vase(1e5), "vase", {"*": 0.05}, options=cases.lengths(1e5)),
    against_reference("vase_axis", "the camera looks down the axis of a vase, where its normal is not defined",
                      scene((0, 5, 0), (0, 0, 0), surface("vase", segments=[32, 32]), BLOCK,
                            up=(0, 0, 1)), perturbation=2, second_order=1.5, traced=0.5, glossy_lod=2),
    against_reference("cone_apex", "the camera looks down on a cone's apex, where the gradient vanishes",
                      scene((0, 4, 0), (0, 0, 0), surface("cone", radius=1, height=1, segments=[48, 12],
                                                          translate=[0, 1, 0]), BLOCK, up=(0, 0, 1)),
                      perturbation=2, second_order=1.5, traced=0.5, glossy_lod=1),
    against_reference("torus_hole", "a block through the hole of a torus",
                      scene((0, 1, 3), (0, 0.75, 0), BLOCK | {"translate": [0, 0.75, -0.75]},
                            surface("torus", radius=0.5, tube=0.125, segments=[48, 24],
                                    translate=[0, 0.75, 0], rotate=[90, 0, 0])),
                      perturbation=2.5, second_order=2, traced=0.3, glossy_lod=1.5),
    against_reference("bowl", "the camera looks into a bowl that has an object about its focus",
                      scene((0, 3, 2.5), (0, 0.5, 0), BLOCK | {"translate": [0, 0.75, 0]},
                            surface("sphere", radius=1, bounds=[-1, -1, -1, 1, 0, 1], resolution=32,
                                    translate=[0, 1.125, 0])), perturbation=1.2, second_order=2, traced=0.3,
                      glossy_lod=1.2),
    against_reference("ring", "the camera looks into a ring, whose caustic goes through everything inside",
                      scene((0, 3, 2.5), (0, 0.25, 0), BLOCK | {"translate": [0.25, 0.25, 0]},
                            surface("cylinder", radius=1, height=0.5, segments=[64, 8],
                                    translate=[0, 0.375, 0])), perturbation=5, second_order=0.6, traced=0.6,
                      glossy_lod=1.5),
    against_reference("along_cylinder", "the camera is 3 cm off a cylinder and looks along it",
                      scene((0.53, 0.75, 1.9), (0.53, 0.75, -3),
                            surface("cylinder", radius=0.5, height=4, segments=[64, 16],
                                    translate=[0, 0.75, 0], rotate=[90, 0, 0]), BLOCK),
                      perturbation=0.5, second_order=0.08, traced=0.08, glossy_lod=0.5),
    against_reference("pierced", "an object crosses its reflector",
                      scene(EYE, TARGET, BALL, BLOCK | {"translate": [0.375, 0.625, 0.375]}),
                      perturbation=0.5, second_order=1.5, traced=0.35, glossy_lod=0.7),
    against_reference("on_reflector", "a polygon with its corners on its reflector",
                      scene(EYE, TARGET, BALL, polygon((0.5, 0.5, 0), (0, 1, 0), (0, 0.5, 0.5))),
                      perturbation=0.6, second_order=1, traced=0.35, glossy_lod=1.2),
    against_reference("behind_plane", "objects stand before, behind and across a mirror",
                      scene(EYE, TARGET, surface("plane", normal=[0, 0, 1], bounds=1,
                                                 translate=[0, 1, 0]),
                            BLOCK, BLOCK | {"translate": [-0.5, 0.25, -0.75]},
                            BLOCK | {"translate": [0, 0.75, 0]}),
                      perturbation=0.3, second_order=0.3, traced=0.25, glossy_lod=0.5),
    against_reference("kinks", "a formula makes an octahedron, which has no gradient along its edges",
                      scene(EYE, TARGET, surface("formula", formula="abs(x) + abs(y) + abs(z) - 0.5",
                                                 bounds=0.75, resolution=32, translate=[0, 0.75, 0]),
                            BLOCK), perturbation=0.4, second_order=0.6, traced=0.3, glossy_lod=0.6),
]
