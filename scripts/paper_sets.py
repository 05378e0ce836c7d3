"""The frames on which second_order's constants were chosen (tuning), and frames and scenes on which no constant
was ever chosen (validation). Whoever chooses a constant looks at the tuning set alone; the tables judge on both.

A constant that is chosen on anything else moves that into the tuning set. Never the other way round."""
import json
import statistics

ROOMS = {"living room a": ("living_room", "living_room_a"),
         "living room b": ("living_room", "living_room_b"),
         "bathroom a": ("bathroom", "bathroom_a"), "bathroom b": ("bathroom", "bathroom_b")}

# Rows: name, scene, path, first frame, last frame, step.
TUNING = [
    *((name, scene, path, 45, 900, 90) for name, (scene, path) in ROOMS.items()),
    ("glossy sphere", "glossy_sphere", "glossy_sphere", 4, 16, 6),
    ("normal mapped", "normal_mapped", "normal_mapped", 4, 12, 4),
    ("moving", "moving", "moving", 4, 24, 8),
    ("teapots", "teapots", "teapots", 4, 16, 6),
    ("nine spheres", "nine_spheres", "nine_spheres", 4, 24, 8),
]
# Lenses are not among them: second_order mirrors what refracts, `traced` refracts it.
VALIDATION = [
    *((name, scene, path, 17, 900, 90) for name, (scene, path) in ROOMS.items()),
    ("deforming", "deforming", "deforming", 4, 24, 8),
    ("Cornell box", "cornell_box", "cornell_box", 4, 12, 4),
    ("vase and sphere", "vase_sphere", "vase_sphere", 4, 24, 8),
    ("vase and lizard", "vase_lizard", "vase_lizard", 4, 24, 8),
    ("vase and window", "vase_window", "vase_window", 4, 48, 16),
    ("user's formula", "user_formula", "user_formula", 4, 24, 8),
]
SETS = {"tuning": TUNING, "validation": VALIDATION}


def frames_of(row):
    """Numbers of a row's frames."""
    first, last, step = row[3:]
    return list(range(first, last + 1, step))


def rows_of(bench, kind):
    """Errors and disocclusions of each scene of a set, against `traced` with the same rays."""
    from paper_second_order import average_and_most
    for row in SETS[kind]:
        name, scene, path = row[:3]
        frames = frames_of(row)[:1 if bench.effort == "smoke" else None]
        folder = f"{kind}_{path}"
        runs = bench.render("second_order_pictures", folder,
                            [f"scene=scenes/{scene}.json", f"path=paths/{path}.json",
                             'image.layers=["s","id"]', "image.masks=false", "preview.enabled=false"],
                            [([], frames)], ["second_order", "traced"])
        out = bench.work / folder / "0"
        compared = json.loads(bench.catoptric("compare", out / "second_order", out / "traced", "--json",
                                              "--num-exposures", "1"))[0]
        objects = compared["pooled"]["objects"]
        reflective = {r["id"] for r in json.loads(bench.catoptric(
            "info", f"scenes/{scene}.json", "--json"))["reflectors"]}
        ours = [(o["pixels"], o["L1_8bit"]) for o in objects if o["id"] in reflective]
        pixels = sum(n for n, _ in ours)
        counted = runs["second_order"]
        samples = [max(1, n) / 100 for n in counted.count("reflective_samples")]
        percent = {c: [n / s for n, s in zip(counted.count(c), samples)]
                   for c in ("disoccluded", "wrong_hit")}
        yield [kind, name, str(len(frames)), average_and_most([e["L1_8bit"] for e in compared["frames"]]),
               sum(n * e for n, e in ours) / pixels if pixels else None,
               average_and_most(percent["disoccluded"]), average_and_most(percent["wrong_hit"]),
               statistics.fmean(counted.count("clusters"))]


def sets(bench, document):
    """The table of both sets."""
    rows = [row for kind in SETS for row in rows_of(bench, kind)]
    document.text("""## Tuning set and validation set

All constants of the method were chosen on the tuning set: every 90th frame from 45 on of the four paths, and the small
scenes of that name in the table. No constant was ever chosen on the validation set: every 90th frame from 17 on of the
paths, and other scenes. `scripts/paper_sets.py` lists both. L1_8bit is the mean absolute difference from `traced` per
channel, of 255, over the frame; "of reflectors" has it over the pixels of reflective objects. The next columns are
shares of the reflective samples: disoccluded samples, where a ray found nothing although Embree's ray hits a surface,
and wrong hits, where it found another surface than Embree's, or one where there is none. "a / b" is the average and the
maximum over the frames.""")
    document.table(["set", "scene, path", "frames", "L1_8bit", "of reflectors", "disoccluded %", "wrong hit %",
                    "clusters"], rows)
