"""Tables, pictures and growth curves of [Wang2014], for scripts/paper_tables."""
import json
import os
import statistics
import subprocess

from paper_run import machine, number
from paper_sets import ROOMS as PATHS, sets

BVH = {"traced_static": "static", "traced_refit": "refit", "traced_rebuild_low": "low rebuild",
       "traced_rebuild_medium": "medium rebuild"}
# Views of the pictures: as the rows of Fig. 1, two in the living room and one in the bathroom.
VIEWS = {"living room a": 235, "living room b": 235, "bathroom a": 10}
GLOSSY_VIEW = 10  # of the living room's path a
GLOSSINESS = {"more specular": 0.2, "more matte": 0.4}

# As printed, by path in the order of PATHS: Tables 1, 2, 7 and 9, and the text of section 4.1.
PRINTED = {"reflective": ["50 / 62", "58 / 69", "45 / 55", "44 / 58"],
           "ours_fps": ["18 (25, 13)", "15 (20, 11)", "17 (20, 14)", "18 (29, 15)"],
           "optix_fps": ["1.1", "1.0", "3.3", "2.3 (sic)"],
           "gbuffer": ["0.6 / 0.9", "0.5 / 0.8", "0.5 / 0.8", "0.5 / 0.7"],
           "camera": ["23 / 30", "24 / 28", "20 / 24", "20 / 26"],
           "depth_images": ["26 / 37", "28 / 38", "28 / 39", "24 / 30"],
           "intersect": ["7 / 15", "14 / 28", "11 / 18", "8 / 16"],
           "clusters": ["148 / 195", "120 / 162", "123 / 194", "107 / 158"],
           "planar": ["41 / 52", "33 / 51", "17 / 33", "- / 34"],
           "disoccluded": ["0.62 / 1.3", "", "2.75 / 3.5", ""], "L1": ["6", "3", "9", ""]}


def scene_of(path):
    scene, file = PATHS[path]
    return [f"scene=scenes/{scene}.json", f"path=paths/{file}.json"]


def average_and_most(values, scale=1.0):
    values = [scale * v for v in values]
    return f"{number(statistics.fmean(values))} / {number(max(values))}"


def introduce(bench, document):
    bench.catoptric("render", "configs/papers/second_order.json", "--dry-run", "-q")
    effort = {"full": "every 30th frame", "quick": "`--quick`: every 30th frame for Tables 1, 2, 7, 8, 9 and "
              "accuracy's L1_8bit, every 90th for the others",
              "smoke": "two frames, `--smoke`: figures without meaning,"}[bench.effort]
    document.text(f"""# second_order: the paper's tables and pictures

Written by `{bench.command("second_order")}` ({effort}, of each path of 900) from
configs/papers/second_order*.json. {machine()} The
published figures were measured on a GeForce GTX 570, those of the ray tracer with Optix on it, so compare ratios
and growth, not frame rates. Frames have 512 x 512 pixels with 2 x 2 samples. "a / b" is the average and the maximum
over the frames; times and ratios without "/" are medians over the frames. In Tables 1 to 7 and in the tables of
compound images and of triangles, the time of each step of a frame is the least of two or three renderings, in which
the methods take turns: other programs on the machine can only add to it.""")


# --- Tables 1, 2, 7, 9 --------------------------------------------------------------------------

def paths(bench, document):
    runs = {}
    for path in PATHS:
        runs[path] = bench.render("second_order", f"paths_{PATHS[path][1]}",
                                  [*scene_of(path), 'image.layers=["s","id"]',
                                    "preview.enabled=false"], bench.path_frames(30, 30), repeats=3)
    samples = 1024 * 1024

    def rate(run):
        times = run.times().values()
        return (f"{number(1e3 / statistics.median(times))} ({number(1e3 / min(times))}, "
                f"{number(1e3 / max(times))})")

    document.text("""## Table 1: frames per second, and Table 9: planar share

"reflective %" is the share of the frame's samples that reflect, and "planar %" the share of these that are in planar
clusters. Rates are in frames per second. Ours are the median, the maximum and the minimum; the printed ones are the
average, the maximum and the minimum.""")
    document.table(
        ["path", "reflective %", "printed", "planar %", "printed", "second_order", "printed",
         "traced static", "medium rebuild", "Optix, printed"],
        [[p, average_and_most(r["second_order"].count("reflective_samples"), 100 / samples),
          PRINTED["reflective"][i],
          average_and_most([100 * a / max(b, 1) for a, b in
                            zip(r["second_order"].count("planar_samples"),
                                r["second_order"].count("reflective_samples"))]),
          PRINTED["planar"][i], rate(r["second_order"]), PRINTED["ours_fps"][i],
          rate(r["traced_static"]), rate(r["traced_rebuild_medium"]), PRINTED["optix_fps"][i]]
         for i, (p, r) in enumerate(runs.items())])
    document.text("""The time of `traced` with the same rays divided by that of second_order, for each policy of the BVH: the median of
the frames' ratios. Above 1, second_order is faster.""")
    document.table(["path", *BVH.values()],
                   [[p, *(r["second_order"].ratio(r[m]) for m in BVH)] for p, r in runs.items()])

    document.text("""## Table 2: milliseconds of the steps

The paper's first column is the G-buffer and the clustering.""")
    names = ["gbuffer", "readback", "cluster", "camera", "depth_images", "intersect", "composite"]
    rows = []
    for i, (p, r) in enumerate(runs.items()):
        rows.append([p, *(average_and_most(r["second_order"].step(n)) for n in names)])
        rows.append(["printed", PRINTED["gbuffer"][i], "", "", PRINTED["camera"][i],
                     PRINTED["depth_images"][i], PRINTED["intersect"][i], ""])
    document.table(["path", *names], rows)

    document.text("## Table 7: clusters")
    document.table(["path", "clusters", "printed", "not searched: samples in none",
                    "triangles drawn, thousands"],
                   [[p, average_and_most(r["second_order"].count("clusters")),
                     PRINTED["clusters"][i], average_and_most(r["second_order"].count("unclustered")),
                     average_and_most(r["second_order"].count("triangles"), 1e-3)]
                    for i, (p, r) in enumerate(runs.items())])
    bench.paths = runs


# Why a step takes more than twice its floor: textures of gbuffer measured without them (AMD EPYC), cluster and
# camera by what the kernel or the copies leave out.
REASONS = {
    "gbuffer": "textures: 27 % in bathroom a, 32 % in living room a",
    "composite": "loads from memory, 4 to 5 ns each; the object's number is loaded, too",
    "cluster": "votes for planes and tests against them; runs by object, bin and plane",
    "camera": "arithmetic: far ends in the scene's box, twice; the upload of each sample's cluster",
    "intersect": "setting up a walk, and what found nothing"}


def floors(bench, document):
    """What each step takes at least, by second_order_benchmark."""
    document.text("""## Floors

A floor is what a step takes at least on this machine: a program that does only what the step cannot avoid. Times are
CPU times of all threads in milliseconds, since other programs disturb them less than the clock on the wall; two threads
do most of the work. `second_order_benchmark SCENE PATH FRAMES` measures the frame and the floors in turns, for four
frames of each path, 20 times. (With two or five repetitions a frame's time over its floor came out anywhere between
1.14 and 1.28.)

- `gbuffer` and `depth_images`: the same triangles are drawn without shading. For "once" they are shaded, over the depth
  of the same picture, so that each sample is shaded once; what a step takes beyond that is overdraw, and clearing the
  depth images.
- `readback`: as many bytes are copied.
- `cluster`: position, normal and share of the sums are computed for each reflective sample, and bin and ray for those
  that are not in planar mirrors, by vector instructions; what is read of the other samples is copied.
- `camera`: what it must read and write is copied.
- `intersect`: a pass reads what each ray needs and writes the result. For a walk that is its cluster's seven rows of the
  table, the very texels that it reads up to its hit (of eight samples side by side, those of the longest walk), and
  four depths and four colours there; for a planar mirror it is one row, one depth and one colour.
- `composite`: a pass reads the diffuse and the reflected colours (in the living room, whose reflectors are tinted, the
  tints of the samples' objects, too) and writes the frame.""")
    repeated = ("450", "1") if bench.effort == "smoke" else ("45-900x270", "20")
    rows = []
    for path, (scene, file) in PATHS.items():
        done = subprocess.run([bench.program.parent / "second_order_benchmark",
                               f"scenes/{scene}.json", f"paths/{file}.json", *repeated],
                              capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"paper_tables: {done.stderr.strip()}")
        measured = json.loads(done.stdout)
        for step in ("gbuffer", "readback", "cluster", "camera", "depth_images", "intersect",
                     "composite", "frame"):
            ms = measured[step]
            over = ms["whole"] / ms["least"]
            once = ms["once"] if step in ("gbuffer", "depth_images", "frame") else None
            rows.append([path if step == "gbuffer" else "", step, ms["whole"], ms["least"], over, once,
                         ms["whole"] / once if once else None,
                         REASONS.get(step, "") if over > 2 else ""])
    document.table(["path", "step", "CPU ms", "floor", "over it", "once", "over it",
                    "why more than 2"], rows)


def accuracy(bench, document):
    """Differences from `traced`, and disocclusions, as in section 4.1."""
    rows = []
    for i, path in enumerate(PATHS):
        name = PATHS[path][1]
        errors, objects = bench.errors(f"paths_{name}", "second_order", "traced_static")
        reflectors = json.loads(bench.catoptric("info", f"scenes/{PATHS[path][0]}.json",
                                                "--json"))["reflectors"]
        planar = [objects[r["id"]] for r in reflectors if r["planar"] and r["id"] in objects]
        mirror = [objects[r["id"]] for r in reflectors
                  if r["name"] == "mirror glass" and r["id"] in objects]
        checked = bench.render("second_order_pictures", f"disocclusions_{name}",
                               [*scene_of(path), "image.layers=[]", "image.masks=false",
                                "preview.enabled=false"], methods=["second_order"])["second_order"]
        share = 100 / (1024 * 1024)
        rows.append([path, average_and_most([e["L1_8bit"] for e in errors]), PRINTED["L1"][i],
                     sum(n * e for n, e in planar) / sum(n for n, _ in planar) if planar else None,
                     mirror[0][1] if mirror else None, average_and_most(checked.count("disoccluded"), share),
                     PRINTED["disoccluded"][i], average_and_most(checked.count("wrong_hit"), share),
                     average_and_most(checked.count("environment"), share)])
    document.text("""## Accuracy (section 4.1): differences from `traced` static, disocclusions

L1_8bit is the mean absolute difference per channel, of 255, over the frame; the next columns have it over the pixels
of all planar reflectors, and of the mirror where one is seen. The other columns are shares of the frame's samples:
disoccluded samples, where a ray found nothing although Embree's ray hits a surface; wrong hits, where it found another
surface than Embree's, or one where there is none; and samples that took the cube map.""")
    document.table(["path", "L1_8bit", "printed, of 3 images", "planar reflectors", "mirror",
                    "disoccluded %", "printed",
                    "wrong hit %", "environment %"], rows)


def concave(bench, document):
    runs = bench.render("second_order_concave", "concave")
    document.text("""## Concave reflectors (section 4.4)

Bathroom, path a. With `concave: ignore`, as in the other tables, rays do not meet their own object. With
`self_intersect` the rays of concave clusters are also intersected with their object's samples in the frame, and with
`self_intersect_all` all rays but those of planar mirrors.""")
    document.table(["way", "concave clusters", "ms", "`intersect` ms", "L1_8bit against traced"],
                   [[n, statistics.fmean(runs[n].count("concave_clusters")), runs[n].ms(),
                     statistics.median(runs[n].step("intersect")),
                     average_and_most([e["L1_8bit"] for e in bench.errors("concave", n, "traced")[0]])]
                    for n in ("ignore", "self_intersect", "self_intersect_all")])


def k_means(bench, document):
    rows = []
    for path in PATHS:
        name = f"k_means_{PATHS[path][1]}"
        runs = bench.render("second_order_k_means", name, scene_of(path), bench.path_frames(90))
        for n in ("bins", "k_means"):
            samples = 100 / (1024 * 1024)
            rows.append([path, n, average_and_most(runs[n].count("clusters")),
                         statistics.median(runs[n].step("cluster")), runs[n].ms(),
                         average_and_most([e["L1_8bit"] for e in bench.errors(name, n, "traced")[0]]),
                         average_and_most(runs[n].count("disoccluded"), samples),
                         average_and_most(runs[n].count("wrong_hit"), samples)])
    document.text("""## k-means (the paper's outlook)

Every 90th frame is measured, with `clustering: bins` as in the other tables, and with `k_means`, which groups each
object's rays around as many means as there are clusters by bins.""")
    document.table(["path", "clustering", "clusters", "`cluster` ms", "ms", "L1_8bit against traced",
                    "disoccluded %", "wrong hit %"], rows)


def compound(bench, document):
    rows = []
    for path in PATHS:
        name = f"compound_{PATHS[path][1]}"
        runs = bench.render("second_order_compound", name, [*scene_of(path), "preview.enabled=false"],
                            repeats=2)
        for way in ("separate", "compound"):
            errors = bench.errors(name, way, "traced")[0]
            rows.append([path, way, statistics.median(runs[way].step("depth_images")),
                         statistics.fmean(runs[way].count("triangles")) / 1e3,
                         average_and_most([e["L1_8bit"] for e in errors])])
    document.text("""## Compound depth images (section 4.4)

"compound": one draw sends an object's triangles to all images of a layer. "separate" (`compound: false`): each image
has a draw of its own.""")
    document.table(["path", "way", "`depth_images` ms", "triangles drawn, thousands",
                    "L1_8bit against traced"], rows)


def levels(bench, document):
    rows = []
    for path in ("living room a", "bathroom b"):
        name = f"levels_{PATHS[path][1]}"
        runs = bench.render("second_order_levels", name, [*scene_of(path), "preview.enabled=false"],
                            bench.path_frames(90))
        reflectors = json.loads(bench.catoptric("info", f"scenes/{PATHS[path][0]}.json",
                                                "--json"))["reflectors"]
        for n in ("0", "0.375", "0.75", "1.5", "3"):
            errors, objects = bench.errors(name, n, "traced")
            mirror = [objects[r["id"]] for r in reflectors
                      if r["name"] == "mirror glass" and r["id"] in objects]
            rows.append([path, n, statistics.fmean(runs[n].count("triangles")) / 1e3,
                         statistics.median(runs[n].step("depth_images")), runs[n].ms(),
                         average_and_most([e["L1_8bit"] for e in errors]),
                         mirror[0][1] if mirror else None])
    document.text("""## Levels of detail in depth images (ours)

Every 90th frame is measured, with `level_error` from 0, which always takes the finest level, on; 0.75 is the default.""")
    document.table(["path", "`level_error`", "triangles drawn, thousands", "`depth_images` ms", "ms",
                    "L1_8bit against traced", "of the mirror"], rows)


def layers(bench, document):
    rows = []
    for path in PATHS:
        name = f"layers_{PATHS[path][1]}"
        runs = bench.render("second_order_layers", name, [*scene_of(path), "preview.enabled=false"],
                            bench.path_frames(90))
        for n in ("one", "two"):
            samples = 100 / (1024 * 1024)
            rows.append([path, n, statistics.median(runs[n].step("depth_images")),
                         statistics.median(runs[n].step("intersect")),
                         average_and_most([e["L1_8bit"] for e in bench.errors(name, n, "traced")[0]]),
                         average_and_most(runs[n].count("disoccluded"), samples),
                         average_and_most(runs[n].count("wrong_hit"), samples),
                         average_and_most(runs[n].count("second_layer_hits"), samples)])
    document.text("""## A second depth layer (the paper's outlook)

Every 90th frame is measured. Depth images, but for those of planar mirrors, keep the nearest surface (`depth_layers:
1`), or the second nearest, too.""")
    document.table(["path", "layers", "`depth_images` ms", "`intersect` ms", "L1_8bit against traced",
                    "disoccluded %", "wrong hit %", "found in the second %"], rows)


# --- Tables 3 to 6, 8 ---------------------------------------------------------------------------

def clusters(bench, document):
    runs = bench.render("second_order_clusters", "clusters", repeats=2)
    rows = sorted((statistics.fmean(r.count("clusters")), r.ms(),
                   r.ms(without={"gbuffer", "readback", "composite"}), r.ratio(runs["traced"]), n)
                  for n, r in runs.items() if n != "traced")
    document.text("""## Table 3: number of clusters

Living room, path a, with the `bin_density` that the name says (with 40 there are also twice as many bins along each
angle). The paper prints 156, 141, 123, 86 and 32 clusters at 12, 13, 15, 15 and 20 frames per second.""")
    document.table(["bins", "clusters", "ms", "fps", "traced / ours"],
                   [[n, c, ms, 1e3 / ms, ratio] for c, ms, _, ratio, n in rows])
    bench.growth["clusters"] = ([r[0] for r in rows], [r[1] for r in rows])


def sizes(bench, document):
    printed = {2048: "7.5", 1024: "15", 512: "23", 256: "29"}
    rows = []
    for size, fps in printed.items():
        runs = bench.render("second_order_resolution", f"size_{size}",
                            [f"image.width={size}", f"image.height={size}", "image.samples=1"],
                            bench.one_part(), ["second_order", "traced"], repeats=3)
        ours = runs["second_order"]
        rows.append([f"{size} x {size}", ours.ms(), 1e3 / ours.ms(), fps,
                     statistics.fmean(ours.count("clusters")), ours.ratio(runs["traced"])])
    document.text("## Table 4: size of the frame\n\nLiving room, path a, one sample per pixel.")
    document.table(["pixels", "ms", "fps", "printed fps", "clusters", "traced / ours"], rows)
    bench.growth["frame pixels"] = ([s * s for s in printed], [r[1] for r in rows])


def depth_images(bench, document):
    runs = bench.render("second_order_resolution", "resolution", repeats=2)
    scales = {"half": (0.5, "15"), "second_order": (1, "15"), "double": (2, "14")}
    document.text("## Table 5: resolution of the depth images\n\nLiving room, path a.")
    document.table(["scale", "ms", "fps", "printed fps", "`depth_images` ms", "`intersect` ms",
                    "texels, millions", "traced / ours"],
                   [[s, runs[n].ms(), 1e3 / runs[n].ms(), fps,
                     statistics.median(runs[n].step("depth_images")),
                     statistics.median(runs[n].step("intersect")),
                     statistics.fmean(runs[n].count("texels")) / 1e6, runs[n].ratio(runs["traced"])]
                    for n, (s, fps) in scales.items()])
    bench.growth["depth-image scale"] = ([s for s, _ in scales.values()],
                                         [runs[n].ms() for n in scales])


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


PARTS = {"paths": paths, "floors": floors, "accuracy": accuracy, "sets": sets, "concave": concave,
         "k_means": k_means, "compound": compound, "levels": levels, "layers": layers,
         "clusters": clusters, "sizes": sizes, "depth_images": depth_images,
         "triangles": triangles, "glossy": glossy, "growth": growth,
         "pictures": pictures}
