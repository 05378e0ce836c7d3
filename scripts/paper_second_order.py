"""What configs/papers/second_order.suite.json does not make of [Wang2014]'s page: variants of scenes, pictures; for
scripts/paper_tables."""
import json
import os
import statistics

from paper_run import number
from paper_sets import ROOMS as PATHS

# Views of the pictures: as the rows of Fig. 1, two in the living room and one in the bathroom.
VIEWS = {"living room a": 235, "living room b": 235, "bathroom a": 10}
GLOSSY_VIEW = 10  # of the living room's path a
GLOSSINESS = {"more specular": 0.2, "more matte": 0.4}

# As printed, by path in the order of PATHS: Table 7, and the text of section 4.1.
PRINTED = {"clusters": ["148 / 195", "120 / 162", "123 / 194", "107 / 158"],
           "disoccluded": ["0.62 / 1.3", "", "2.75 / 3.5", ""], "L1": ["6", "3", "9", ""]}


def scene_of(path):
    scene, file = PATHS[path]
    return [f"scene=scenes/{scene}.json", f"path=paths/{file}.json"]


def average_and_most(values, scale=1.0):
    values = [scale * v for v in values]
    return f"{number(statistics.fmean(values))} / {number(max(values))}"


# Furniture that is wholly diffuse, from the largest.
DIFFUSE = ["sofa", "armchair", "chair back", "chair side", "piano bench", "yucca", "sideboard",
           "speaker left", "speaker right", "bookcase left", "bookcase right"]


def room(bench, name, change, bake_rays=4):
    """Writes a variant of the living room; its `scene` setting. `change` works on the description.
    Few rays make its light: times do not depend on it."""
    folder = bench.work / "scenes"
    folder.mkdir(exist_ok=True)
    if not (folder / "assets").exists():
        (folder / "assets").symlink_to(os.path.abspath("scenes/assets"))
    with open("scenes/living_room.json") as file:
        scene = json.load(file)
    scene["bake"].update(rays=bake_rays, bounces=1)
    change(scene)
    (folder / f"{name}.json").write_text(json.dumps(scene, indent=1))
    return f"scene={folder / name}.json"


def without(names):
    def change(scene):
        scene["objects"] = [o for o in scene["objects"] if o["name"] not in names]
    return change


def stacked(names, times):
    """Copies of furniture, on top of it."""
    def change(scene):
        scene["objects"] += [{**o, "name": f"{o['name']} {i + 2}", "translate":
                              [o["translate"][0], o["translate"][1] + 0.8 * (i + 1),
                               o["translate"][2]]}
                             for i in range(times) for o in scene["objects"]
                             if o["name"] in names[i]]
    return change


def tessellated(factor):
    """The reflective shapes with other numbers of segments."""
    standard = {"teapot": 10, "revolution": [64, 48], "sphere": [48, 24], "torus": [64, 32]}

    def visit(scene, objects):
        for thing in objects:
            visit(scene, thing.get("children", []))
            material = scene["materials"].get(thing.get("material"), {})
            if thing.get("shape") in standard and material.get("s", 0) > 0:
                segments = thing.get("segments", standard[thing["shape"]])
                thing["segments"] = (round(segments * factor) if isinstance(segments, (int, float))
                                     else [round(s * factor) for s in segments])
    return lambda scene: visit(scene, scene["objects"])


def triangle_runs(bench, kind, variants, key):
    rows = []
    for name, change in variants.items():
        setting = room(bench, f"{kind}_{name}", change)
        counts = json.loads(bench.catoptric("info", setting.removeprefix("scene="), "--json"))
        triangles = {"diffuse": counts["diffuse_triangles"],
                     "other": counts["triangles"] - counts["diffuse_triangles"]}
        runs = bench.render("second_order_triangles", f"{kind}_{name}", [setting], bench.one_part(),
                            repeats=3)
        rows.append((triangles[key], runs, name))
    return sorted(rows, key=lambda row: row[0])


def triangles(bench, document):
    rows = triangle_runs(bench, "diffuse", {
        "least": without(DIFFUSE), "less": without(DIFFUSE[:1]), "room": lambda scene: None,
        "most": stacked([DIFFUSE, DIFFUSE[:5]], 2)}, "diffuse")
    document.text("""## Table 6: number of diffuse triangles

Living room, path a: without its diffuse furniture, without the sofa, as it is, and with copies of the furniture on top
of it. The paper prints 63, 132, 162 and 289 thousand triangles at 15, 15, 12 and 10 frames per second.""")
    document.table(["diffuse triangles, thousands", "ms", "fps", "`depth_images` ms",
                    "triangles drawn, thousands", "traced static / ours", "medium rebuild / ours"],
                   [[n / 1e3, r["second_order"].ms(), 1e3 / r["second_order"].ms(),
                     statistics.median(r["second_order"].step("depth_images")),
                     statistics.fmean(r["second_order"].count("triangles")) / 1e3,
                     r["second_order"].ratio(r["traced_static"]),
                     r["second_order"].ratio(r["traced_rebuild_medium"])] for n, r, _ in rows])
    bench.growth["diffuse triangles"] = ([n for n, *_ in rows],
                                         [r["second_order"].ms() for _, r, _ in rows])

    rows = triangle_runs(bench, "reflective", {
        "coarse": tessellated(0.5), "room": lambda scene: None, "fine": tessellated(1.5),
        "finest": tessellated(2)}, "other")
    document.text("""## Non-diffuse triangles

The paper says that the time does not depend on them. Living room, path a, where the teapot, the vases, the bowls and
the balls have 0.5, 1, 1.5 and 2 times as many segments along each direction.""")
    document.table(["non-diffuse triangles, thousands", "ms", "`gbuffer` ms", "without `gbuffer` ms",
                    "clusters", "traced static / ours", "medium rebuild / ours"],
                   [[n / 1e3, r["second_order"].ms(),
                     statistics.median(r["second_order"].step("gbuffer")),
                     r["second_order"].ms(without={"gbuffer"}),
                     statistics.fmean(r["second_order"].count("clusters")),
                     r["second_order"].ratio(r["traced_static"]),
                     r["second_order"].ratio(r["traced_rebuild_medium"])] for n, r, _ in rows])
    bench.growth["non-diffuse triangles"] = (
        [n for n, *_ in rows], [r["second_order"].ms(without={"gbuffer"}) for _, r, _ in rows])


def all_glossy(glossiness):
    """Every reflector of the room with one g."""
    def visit(value):
        if isinstance(value, dict):
            if value.get("s", 0) and "g" in value:
                value["g"] = glossiness
            value = list(value.values())
        if isinstance(value, list):
            for part in value:
                visit(part)

    def change(scene):
        visit(scene["materials"])
        visit(scene["objects"])
    return change


def glossy_scene(bench, level):
    return room(bench, f"glossy_{GLOSSINESS[level]}", all_glossy(GLOSSINESS[level]),
                bake_rays=24)


def glossy(bench, document):
    printed = {("more specular", "second_order_8"): ("112", "6", "1"),
               ("more specular", "second_order_49"): ("651", "1.4", "0.4"),
               ("more matte", "second_order_8"): ("163", "5", "1"),
               ("more matte", "second_order_49"): ("814", "1.1", "0.4")}
    parts = [([], [450])] if bench.effort == "smoke" else [([13, 14], list(range(15, 901, 30)))]
    rows = []
    for level in GLOSSINESS:
        methods = None if level == "more matte" else ["second_order_8", "second_order_49",
                                                      "neighbourhood_8", "traced_8", "traced_49"]
        runs = bench.render("second_order_glossy", "glossy_" + level.split()[1],
                            [glossy_scene(bench, level), "preview.enabled=false"], parts, methods)
        for name in ("second_order_8", "second_order_49", "neighbourhood_8"):
            rays = name.split("_")[-1]
            ours, theirs = runs[name], runs[f"traced_{rays}"]
            ms, fps, optix = printed.get((level, name), ("", "", ""))
            rows.append([f"{level}, g {GLOSSINESS[level]}", name.replace("_", " "),
                         statistics.median(ours.step("intersect")), ms, 1e3 / ours.ms(), fps,
                         1e3 / theirs.ms(), optix, ours.ratio(theirs),
                         average_and_most([e["L1_8bit"] for e in bench.errors(
                             "glossy_" + level.split()[1], name, f"traced_{rays}")[0]])])
    document.text("""## Table 8: glossy reflections

Living room, path a, where every reflector has the same g, compared with `traced` (static BVH, the same rays). With
"neighbourhood" one ray of a lobe is walked and the others are looked up at its distance.""")
    document.table(["glossiness", "way, rays", "`intersect` ms", "printed", "fps", "printed",
                    "traced fps", "Optix, printed", "traced / ours", "L1_8bit"], rows)
    bench.growth["rays per sample"] = ([4, 8, 16, 49],
                                       [runs[f"second_order_{n}"].ms() for n in (4, 8, 16, 49)])


def pictures(bench, document):
    import paper_second_order_pictures
    paper_second_order_pictures.pictures(bench, document)


def growth(bench, document):
    import paper_second_order_pictures
    paper_second_order_pictures.growth(bench, document)


PARTS = {"triangles": triangles, "glossy": glossy, "growth": growth, "pictures": pictures}
# All parts of the page in their order; the others are made by configs/papers/second_order.suite.json.
PAGE = ["steps", "tables", "triangles", "glossy", "laws", "growth", "pictures"]
