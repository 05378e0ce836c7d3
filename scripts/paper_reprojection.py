"""Tables, pictures and curves of [Xie2017], for scripts/paper_tables."""
import csv
import json
import pathlib
import shutil
import statistics
import subprocess

from display_steps import display, l1
from paper_run import exponent, number, preview, sheet

# Scene, path, as printed: key-frame intervals (max, avg), recomputed %. The paper's toilet is our bathroom.
PATHS = {"living room a": ("living_room", "living_room_temporal", "164 / 53.1", "18.7"),
         "living room b": ("living_room", "living_room_temporal_b", "92 / 24.2", "18.5"),
         "bathroom a": ("bathroom", "bathroom_temporal", "51 / 20.6", "20.8"),
         "bathroom b": ("bathroom", "bathroom_temporal_b", "63 / 20.0", "18.9")}
LATER = 15  # frames from a key frame to that of the pictures
OWN = ("search", "shift", "warp")


def path_frames(bench):
    """Consecutive frames, from a restart on."""
    return {"full": list(range(1, 501)), "quick": list(range(193, 205)), "smoke": [193, 194, 195]}[bench.effort]


def render(bench, name, scene, path, methods=None, frames=None, config="reprojection", settings=()):
    sets = [f"scene={scene}", f"path={path}"] if scene else []
    return bench.render(config, name, [*sets, *settings], [([], frames or path_frames(bench))], methods)


def reflective(counters):
    return counters["reused"] + counters["retraced"] + counters["key_frame_samples"]


def recomputed(run):
    """Mean share of the reflective samples that were traced in frames that are no key frames, %."""
    return statistics.fmean(100 * c["retraced"] / max(1, reflective(c)) for c in run.counters.values() if not c["key_frame"])


def errors_of(bench, name, method):
    """L1_8bit against `traced` of each frame."""
    folder = bench.work / name / "0"
    return [l1(display(folder / method / "frames" / f.name), display(f))
            for f in sorted((folder / "traced" / "frames").glob("*.exr"))]


def masked(frame):
    """A frame with what was traced anew in red."""
    from PIL import Image
    file = frame.with_suffix(".mask.png")
    subprocess.run(["oiiotool", frame, "--ch", "mask.retraced.X", "-d", "uint8", "-o", file], check=True)
    with Image.open(file) as image:
        mask = image.convert("L").point(lambda v: 255 if v else 0)
    file.unlink()
    shown = preview(frame).convert("RGB")
    return Image.composite(Image.new("RGB", shown.size, (230, 30, 30)), shown, mask)


def figures(bench, document):
    from PIL import ImageChops
    runs = {name: render(bench, name.replace(" ", "_"), f"scenes/{scene}.json", f"paths/{path}.json")
            for name, (scene, path, *_) in PATHS.items()}
    later = min(LATER, len(path_frames(bench)) - 1)
    document.text(f"## Figs. 1 and 6: image_warp, reprojection, traced\n\nThe frames that follow their key frame by {later}, whole and at the "
                  "place of the largest difference.")
    whole, differences, marked, labels = [], [], [], []
    for name in runs:
        folder = bench.work / name.replace(" ", "_") / "0"
        numbers = path_frames(bench)
        chosen = numbers[later]
        frame = lambda m, n=chosen: folder / m / "frames" / f"frame.{n:04d}.exr"  # noqa: E731,B023
        shown = [preview(frame(m)).convert("RGB") for m in ("image_warp", "reprojection", "traced")]
        x, y = place_of(ImageChops.difference(shown[0], shown[2]))
        whole += [shown, [p.crop((x, y, x + 256, y + 256)) for p in shown]]
        difference = ImageChops.difference(shown[1], shown[2])
        differences.append([shown[1], difference, difference.point(lambda v: min(255, 60 * v))])
        marked.append([preview(frame("reprojection", numbers[0])), masked(frame("reprojection"))])
        labels.append(name)
    sheet(document.picture("fig6.png", "Reflections of four paths"), whole, ["image_warp", "reprojection", "traced"], 170)
    document.text("## Fig. 7: key frame and the frame of Fig. 6, traced anew in red\n\n" + ", ".join(labels) + ":")
    sheet(document.picture("fig7.png", "What was traced anew"), marked, ["key frame", "the frame"], 170)
    document.text("## Fig. 8: differences to traced, and 60 times as large")
    sheet(document.picture("fig8.png", "Differences"), differences, ["reprojection", "difference", "times 60"], 170)


def place_of(difference, size=256):
    """The upper left corner of the part that differs most."""
    small = difference.convert("L").resize((16, 16), 4)  # box filter
    w, h = difference.size
    best = max(range(256), key=lambda i: small.getpixel((i % 16, i // 16)))
    return (min(max(0, best % 16 * w // 16 - size // 2), w - size), min(max(0, best // 16 * h // 16 - size // 2), h - size))


def pillars(bench, document):
    frames = [1, 14, 27, 40] if bench.effort != "smoke" else [1, 2]
    render(bench, "pillars", None, None, frames=frames, config="reprojection_pillars")
    document.text("""## Fig. 9: pillars

A pillar of the back row that the key frame saw hidden behind one of the front row comes out, in the mirror. A reflected
ray that misses the front pillar finds the wall in the key frame, and nothing tells that a pillar stands before it: so in the
paper; here the nearest of several matches narrows the error.""")
    folder = bench.work / "pillars" / "0"
    crop = lambda p: p.convert("RGB").crop((p.width // 8, p.height * 5 // 16, p.width * 7 // 8, p.height * 11 // 16))  # noqa: E731
    sheet(document.picture("fig9.png", "Pillars"),
          [[crop(preview(folder / m / "frames" / f"frame.{n:04d}.exr")) for n in frames] for m in ("image_warp", "reprojection", "traced")],
          [f"frame {n}" for n in frames], 170)
    errors = {m: errors_of(bench, "pillars", m) for m in ("reprojection", "image_warp")}
    document.table(["L1_8bit of frame", *map(str, frames)], [[m, *values] for m, values in errors.items()])


def triangles(bench, document):
    """Time over the number of triangles, in scenes made for it."""
    rows, counts, own = [], [], []
    source = json.loads(pathlib.Path("scenes/pillars.json").read_text())
    for times in (1, 4, 16, 22) if bench.effort != "smoke" else (1, 2):
        scene = json.loads(json.dumps(source))
        for row in scene["objects"]:
            for child in row.get("children", []):
                child["segments"] = [48 * times, 8 * times]
        scene["bake"] = {"mode": "none"}
        for light in scene["lights"]:
            del light["baked"]
        file = bench.work / f"pillars_{times}.json"
        file.write_text(json.dumps(scene))
        run = render(bench, f"triangles_{times}", file, "paths/pillars.json", ["traced", "reprojection"], list(range(1, 9)),
                     settings=["image.layers=[]", "image.masks=false"])
        ours, traced = run["reprojection"], run["traced"]
        plain = [n for n, c in ours.counters.items() if not c["key_frame"]]
        counts.append(8 * (2 * 48 * times * 8 * times + 96 * times))
        own.append(statistics.median(1e3 * sum(ours.steps[n].get(s, 0) for s in OWN) for n in plain))
        rows.append([f"{counts[-1] / 1e6:.3f}", own[-1], statistics.median(ours.step("recompute")),
                     statistics.median(a + b for a, b in zip(traced.step("trace"), traced.step("resolve"))),
                     traced.ms(), ours.ms(), ours.ratio(traced)])
    document.text("## Growth with triangles\n\nThe pillars with finer meshes: milliseconds of `search`, `shift` and `warp` together, whose exponent "
                  f"is {number(exponent(counts, own), 2)}, and of what traces.")
    document.table(["million triangles of the pillars", "own part", "`recompute`", "`traced`: `trace` and `resolve`",
                    "frame of `traced`", "frame", "ratio"], rows)


def mapping(bench, document):
    """Fig. 5: points against meshes, where the camera comes nearer to a mirror."""
    path = bench.work / "nearer.json"
    path.write_text(json.dumps({"fps": 30, "frames": 13, "fov": 45.8, "keyframes": [
        {"position": [0.3, 1.3, 1.2], "target": [0, 1, -2]}, {"position": [0.2, 1.2, 0.3], "target": [0, 1, -2]}]}))
    names = {"gather": "our gather", "grid": "meshes", "splat": "points"}
    frames = [1, 5, 9, 13] if bench.effort != "smoke" else [1, 2]
    runs, shown, rows = {}, [], []
    for name in names:
        runs[name] = render(bench, f"mapping_{name}", "scenes/planar_mirror.json", path, ["traced", "reprojection"], frames,
                            settings=[f"methods.1.mapping={name}", "methods.1.keyframe_threshold=1"])["reprojection"]
        folder = bench.work / f"mapping_{name}" / "0" / "reprojection" / "frames"
        shown.append([masked(folder / f"frame.{n:04d}.exr").crop((330, 430, 586, 686)) for n in frames])
        errors = errors_of(bench, f"mapping_{name}", "reprojection")
        share = [100 * c["retraced"] / reflective(c) for c in runs[name].counters.values()]
        rows += [[f"{names[name]}: recomputed %", *share], [f"{names[name]}: L1_8bit", *errors]]
    document.text("## Fig. 5: points and meshes\n\nThe camera of planar_mirror comes nearer to the mirror, by 8 cm a frame; frame 1 is "
                  "the only key frame. In red what was traced anew: between the points of `mapping: splat` holes open, between the "
                  "triangles of `mapping: grid` none. Our default looks from the other side and knows no holes.")
    sheet(document.picture("fig5.png", "Points and meshes"), shown, [f"frame {n}" for n in frames], 170)
    document.table(["frame", *map(str, frames)], rows)


def slow(bench, document):
    """Where tracing is slow."""
    count = {"full": 128, "quick": 12, "smoke": 2}[bench.effort]
    rows = []
    for what, scene, path, bounces, frames in [
            *((f"living room b, {n}", "living_room", "living_room_temporal_b", n, list(range(193, 193 + count))) for n in (1, 2, 3)),
            ("user_formula, 1", "user_formula", "nearly_still", 1, list(range(1, 1 + min(count, 4))))]:
        if path == "nearly_still":
            file = bench.work / "user_formula.json"
            orbit = json.loads(pathlib.Path("paths/user_formula.json").read_text())
            file.write_text(json.dumps({**orbit, "frames": 384, "name": "user_formula_slow"}))
        else:
            file = f"paths/{path}.json"
        folder = f"slow_{scene}_{bounces}"
        run = render(bench, folder, f"scenes/{scene}.json", file, ["traced", "reprojection"],
                     frames, settings=[f"methods.0.bounces={bounces}", f"methods.1.bounces={bounces}", "image.masks=false"])
        errors = errors_of(bench, folder, "reprojection")
        ours, traced = run["reprojection"], run["traced"]
        plain = [n for n, c in ours.counters.items() if not c["key_frame"]]
        method = statistics.median(1e3 * sum(ours.steps[n].get(s, 0) for s in (*OWN, "recompute")) for n in plain)
        rays = statistics.median(a + b for a, b in zip(traced.step("trace"), traced.step("resolve")))
        rows.append([what, traced.ms(), ours.ms(), ours.ratio(traced), rays, method, rays / method,
                     recomputed(ours), statistics.fmean(errors)])
    document.text("## Where tracing is slow\n\nSeveral bounces, and reflectors that are given by a formula (a camera that turns by "
                  "0.11 degrees a frame). Milliseconds of whole frames, and of what differs: `trace` and `resolve` of `traced`, `search` "
                  "to `recompute` of reprojection in frames that are no key frames.")
    document.table(["scene, bounces", "`traced` frame", "frame", "ratio", "`traced` alone", "alone", "ratio", "recomputed %", "L1_8bit"], rows)


CURVES = {"keyframe_threshold": "0.05,0.1,0.15,0.22", "epsilon": "0.01,0.05,0.1,0.2", "fidelity": "0.1,0.25,0.5,1",
          "magnification": "1,2,4,16", "restart_every": "4,8,16,64", "border": "0,1,2,4"}


def curves(bench, document):
    """Time and error over one option at a time, drawn by `catoptric sweep`."""
    frames = {"full": "193-224", "quick": "193-204", "smoke": "193-194"}[bench.effort]
    sets = ["scene=scenes/living_room.json", "path=paths/living_room_temporal.json", "image.layers=[]", "image.masks=false",
            "preview.enabled=false"]
    document.text(f"## Curves of the trade\n\nTime and error over one option at a time, living room a, frames {frames}, by `catoptric sweep`: CPU "
                  "time, three rounds in turns. The last value is the default, but of `epsilon` (0.05), `fidelity` (0.25) and `border` (0).")
    rows = []
    for option, values in CURVES.items():
        out = bench.work / f"curve_{option}.{bench.effort}"
        command = ["sweep", "configs/papers/reprojection.json", "-q", "--method", "traced,reprojection", "--frames", frames,
                   "--repeats", 3, "--clock", "cpu", "--ratio-to", "traced", "--against", "traced", "--vary",
                   f"methods.reprojection.{option}={values}", "--out", out, "--existing", "resume" if out.exists() else "error"]
        for setting in sets:
            command += ["--set", setting]
        bench.catoptric(*command)
        shutil.copy(out / "tradeoff.svg", document.picture(f"curve_{option}.svg", f"Time and error over {option}"))
        with open(out / "points.csv", newline="") as file:
            points = list(csv.DictReader(file))
        first = float(points[0]["seconds"])
        rows += [[option, value, first / float(p["seconds"]), float(p["L1_8bit"])]
                 for value, p in zip(values.split(","), points[1:])]
    document.table(["option", "value", "traced / ours, CPU", "L1_8bit"], rows)


PARTS = {"figures": figures, "pillars": pillars, "curves": curves, "slow": slow, "triangles": triangles, "mapping": mapping}
# All parts of the page in their order; the others are made by configs/papers/reprojection.suite.json.
PAGE = ["tables", "figures", "pillars", "options", "curves", "slow", "triangles", "mapping"]
