"""Errors, disocclusions and clusters of every frame of the papers' paths, for scripts/paper_tables."""
import csv
import hashlib
import json
import math
import shutil
import statistics

from paper_run import Bench, Document, number
from paper_second_order import PATHS, PRINTED, average_and_most, scene_of

FRAMES, CHUNK = 900, 100
SAMPLES = 512 * 512 * 4
COLUMNS = ["frame", "l1_8bit", "planar_pixels", "planar_l1_8bit", "mirror_pixels", "mirror_l1_8bit",
           "disoccluded", "wrong_hit", "environment", "clusters"]


def pooled(objects, ids):
    """Pixels and mean error of some objects together."""
    parts = [(o["pixels"], o["L1_8bit"]) for o in objects if o["id"] in ids]
    pixels = sum(n for n, _ in parts)
    return pixels, sum(n * e for n, e in parts) / pixels if pixels else 0.0


def measure(bench, path, numbers, planar, mirror):
    """Rows of COLUMNS of some frames; the frames themselves are deleted."""
    name = f"every_{PATHS[path][1]}"
    runs = bench.render("second_order_pictures", name,
                        [*scene_of(path), 'image.layers=["s","id"]', "image.masks=false",
                         "preview.enabled=false"], [([], numbers)], ["second_order", "traced"])
    out = bench.work / name / "0"
    # One exposure: HDR-FLIP is not asked for
    compared = json.loads(bench.catoptric("compare", out / "second_order", out / "traced", "--json",
                                          "--num-exposures", "1"))
    shutil.rmtree(bench.work / name)
    counters = runs["second_order"].counters
    return [[e["frame"], e["L1_8bit"], *pooled(e["objects"], planar), *pooled(e["objects"], mirror),
             *(counters[e["frame"]].get(c, 0) for c in COLUMNS[-4:])]
            for e in compared[0]["frames"]]


def rows_of(bench, path, frames):
    """Rows of all frames of a path; what an interrupted run of this build has measured is taken from its
    file."""
    reflectors = json.loads(bench.catoptric("info", f"scenes/{PATHS[path][0]}.json",
                                            "--json"))["reflectors"]
    planar = {r["id"] for r in reflectors if r["planar"]}
    mirror = {r["id"] for r in reflectors if r["name"] == "mirror glass"}
    build = hashlib.sha256(bench.program.read_bytes()).hexdigest()[:8]
    file = bench.work / f"every_{PATHS[path][1]}.{build}.csv"
    rows = []
    if file.exists():
        with open(file, newline="") as text:
            rows = [[float(v) for v in row] for row in list(csv.reader(text))[1:]]
    done = {int(row[0]) for row in rows}
    left = [n for n in frames if n not in done]
    for chunk in (left[i:i + CHUNK] for i in range(0, len(left), CHUNK)):
        rows += measure(bench, path, chunk, planar, mirror)
        temporary = file.with_suffix(".tmp")
        with open(temporary, "w", newline="") as text:
            csv.writer(text).writerows([COLUMNS, *rows])
        temporary.replace(file)
    return sorted(row for row in rows if row[0] in set(frames))


def plot(file, paths):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(3, 1, figsize=(10, 7.5), sharex=True, layout="constrained")
    curves = [("L1_8bit", COLUMNS.index("l1_8bit"), 1), ("disoccluded, % of the samples",
              COLUMNS.index("disoccluded"), 100 / SAMPLES), ("clusters", COLUMNS.index("clusters"), 1)]
    for axis, (title, column, scale) in zip(axes, curves):
        for path, rows in paths.items():
            axis.plot([r[0] for r in rows], [scale * r[column] for r in rows], linewidth=1, label=path)
        axis.set(ylabel=title, ylim=(0, None))
        axis.grid(alpha=0.3)
    axes[-1].set(xlabel="frame", xlim=(1, FRAMES))
    axes[0].legend(ncol=len(paths), fontsize=9)
    figure.savefig(file, dpi=100, metadata={"Software": None})
    pyplot.close(figure)


def write(bench: Bench, document: Document, frames=range(1, FRAMES + 1)):
    """Measures the paths and writes the document."""
    paths = {path: rows_of(bench, path, frames) for path in PATHS}
    document.text(f"""# second_order: every frame of the paths

Written by `scripts/paper_tables second_order --every-frame`: {len(frames)} frames of each path, 512 x 512
pixels with 2 x 2 samples, second_order compared with `traced` with the same rays. "a / b" is the average and the
maximum over the frames. L1_8bit is the mean absolute difference per channel, of 255, over the frame; the next columns
have it over the pixels of all planar reflectors and of the mirror. The other columns are shares of the samples:
disoccluded samples, where a ray found nothing although Embree's ray hits a surface; wrong hits, where it found another
surface than Embree's, or one where there is none; and samples that took the cube map.""")

    def column(rows, name):
        return [row[COLUMNS.index(name)] for row in rows]

    def over_pixels(rows, name):
        weights = column(rows, f"{name}_pixels")
        return (sum(w * e for w, e in zip(weights, column(rows, f"{name}_l1_8bit"))) / sum(weights)
                if any(weights) else None)

    document.table(
        ["path", "L1_8bit", "printed, of 3 images", "planar reflectors", "mirror", "disoccluded %",
         "printed", "wrong hit %", "environment %"],
        [[path, average_and_most(column(rows, "l1_8bit")), PRINTED["L1"][i], over_pixels(rows, "planar"),
          over_pixels(rows, "mirror"), average_and_most(column(rows, "disoccluded"), 100 / SAMPLES),
          PRINTED["disoccluded"][i], average_and_most(column(rows, "wrong_hit"), 100 / SAMPLES),
          average_and_most(column(rows, "environment"), 100 / SAMPLES)]
         for i, (path, rows) in enumerate(paths.items())])

    document.text("## Clusters\n\nThe last columns say how their number changes from a frame to the next: the "
                  "mean, the 95th percentile and the most.")
    table = []
    for i, (path, rows) in enumerate(paths.items()):
        counts = column(rows, "clusters")
        steps = sorted(abs(b - a) for a, b in zip(counts, counts[1:]))
        table.append([path, average_and_most(counts), PRINTED["clusters"][i], statistics.fmean(steps),
                      number(steps[math.ceil(0.95 * len(steps)) - 1]), number(steps[-1])])
    document.table(["path", "clusters", "printed", "change", "95 %", "most"], table)
    plot(document.picture("every_frame.png", "Errors, disocclusions and clusters along the paths"), paths)

    document.text("## Worst frames\n\nTo look at them: `catoptric render configs/papers/second_order_pictures.json "
                  "--set scene=... --set path=... --frames N`.")
    document.table(["path", "frames of the largest L1_8bit", "of most disocclusions"],
                   [[path, *(", ".join(f"{r[0]:.0f}" for r in sorted(
                       rows, key=lambda r, c=COLUMNS.index(name): -r[c])[:3])
                       for name in ("l1_8bit", "disoccluded"))] for path, rows in paths.items()])
    document.write()
