"""Growth curves and pictures of [Wang2014], for scripts/paper_second_order.py."""
import colorsys
import json
import statistics
import subprocess

from paper_run import exponent, number, preview, sheet
from paper_second_order import GLOSSINESS, GLOSSY_VIEW, PATHS, VIEWS, glossy_scene, scene_of

# --- Growth -------------------------------------------------------------------------------------


def growth(bench, document):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    document.text("""## Growth

The exponent is the slope of log time over log quantity: 1 is proportional growth, 0 is none. The last column has the
law that the growth is held to.""")
    laws = {"diffuse triangles": "sublinear; doubling at most +15 %",
            "non-diffuse triangles": "nothing outside the G-buffer (which is left out here)",
            "rays per sample": "at most linear"}
    rows = []
    figure, axes = pyplot.subplots(1, 3, figsize=(10.5, 3.1), layout="constrained")
    for axis, (name, law) in zip(axes.flat, laws.items()):
        axis.set_visible(False)
        if name not in bench.growth:
            continue
        xs, ys = bench.growth[name]
        power = exponent(xs, ys)
        rows.append([name, " ".join(number(x) for x in xs), " ".join(number(y) for y in ys), power,
                     f"{100 * (2 ** power - 1):+.0f} %", law])
        axis.set_visible(True)
        axis.plot(xs, ys, "o-", color="#1f4e79")
        axis.set_title(f"{name}: exponent {power:.2f}", fontsize=10)
        axis.set(xscale="log", ylabel="ms",
                 ylim=(0, 1.1 * max(ys)))
        axis.set_xticks(xs, [f"{x / 1000:.0f}k" if x >= 5000 else f"{x:.3g}" for x in xs],
                        rotation=30)
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    document.table(["over", "at", "ms", "exponent", "per doubling", "law"], rows)
    figure.savefig(document.picture("growth.png", "Time of a frame over what it grows with"), dpi=100,
                   metadata={"Software": None})
    pyplot.close(figure)


# --- Pictures -----------------------------------------------------------------------------------

def layer(frame, channels, convert=(), depth="uint8"):
    """Channels of an EXR frame as an image of PIL, with 8 or 16 bits."""
    from PIL import Image
    file = frame.with_suffix(".layer.png")
    subprocess.run(["oiiotool", frame, "--ch", channels, *convert, "-d", depth, "-o", file],
                   check=True, stdout=subprocess.DEVNULL)
    with Image.open(file) as image:
        image.load()
    file.unlink()
    return image


def reflection(frame):
    """The reflective component alone, black where nothing reflects."""
    from PIL import Image
    shown = layer(frame, "reflection.R,reflection.G,reflection.B",
                  ["--colorconvert", "linear", "sRGB"]).convert("RGB")
    return Image.composite(shown, Image.new("RGB", shown.size), layer(frame, "mask.reflective.X"))


def red(frame, mask):
    """The reflective component, darkened, with the pixels of a mask in red."""
    from PIL import Image
    return Image.composite(Image.new("RGB", (512, 512), (255, 30, 20)),
                           reflection(frame).point(lambda v: v * 0.6),
                           layer(frame, mask).point(lambda v: 255 if v else 0))


def cluster_colors(frame):
    """Clusters in false colours, what is in none in grey."""
    ids = layer(frame, "id.cluster.X", ["--mulc", str(1 / 65535)], "uint16").getdata()
    grey = preview(frame).convert("L").point(lambda v: v // 2 + 40).convert("RGB")
    colors = {i: tuple(round(255 * c) for c in
                       colorsys.hsv_to_rgb(0.618034 * i % 1, 0.55 + 0.15 * (i % 4), 0.7 + 0.1 * (i % 3)))
              for i in set(ids)}
    grey.putdata([colors[i] if i else pixel for i, pixel in zip(ids, grey.getdata())])
    return grey


def views_of(bench):
    """The views of Fig. 1: frames by path and method, and counters by method as "counts"."""
    views = {}
    for path, frame in VIEWS.items():
        name = f"view_{PATHS[path][1]}"
        runs = bench.render("second_order_pictures", name, scene_of(path), [([], [frame])])
        views[path] = {m: bench.work / name / "0" / m / "frames" / f"frame.{frame:04d}.exr"
                       for m in runs}
        views[path]["counts"] = {m: r.counters[frame] for m, r in runs.items()}
    return views


def glossy_frames(bench):
    """The glossy views: frames by level and method."""
    levels = {level: bench.work / f"figure_{level.split()[1]}" for level in GLOSSINESS}
    frames = {}
    for level, folder in levels.items():
        runs = bench.render("second_order_glossy", folder.name,
                            [glossy_scene(bench, level), 'image.layers=["reflection","s","cluster"]',
                             "image.masks=true"], [([], [GLOSSY_VIEW])],
                            ["second_order_8", "second_order_49", "traced_8"])
        frames[level] = {m: folder / "0" / m / "frames" / f"frame.{GLOSSY_VIEW:04d}.exr"
                         for m in runs}
    return frames


def figures_of_clusters(views, frames, document):
    """Figs. 4 and 7."""
    document.text("## Fig. 4: clusters\n\nSamples in no cluster are grey.")
    glossy_view = frames["more specular"]["second_order_8"]
    sheet(document.picture("fig4.png", "Clusters in false colours"),
          [[*(cluster_colors(v["second_order"]) for v in views.values()), cluster_colors(glossy_view)]],
          [f"{p}: {v['counts']['second_order']['clusters']}" for p, v in views.items()]
          + ["glossy (Fig. 2)"])

    view = views["living room a"]
    density = {"bins_0.3": 0.3, "bins_3": 3, "second_order": 10}
    document.text("## Fig. 7: disocclusions (red) by number of clusters\n\nThe reflective component alone; "
                  "the lower row is second_order's picture of it. " + "; ".join(
                      f"bin_density {d}: {view['counts'][m]['disoccluded'] / 1048576:.2%} of the samples"
                      for m, d in density.items()) + ".")
    sheet(document.picture("fig7.png", "Disocclusions"),
          [[red(view[m], "mask.disoccluded.X") for m in density], [reflection(view[m]) for m in density]],
          [f"{view['counts'][m]['clusters']} clusters" for m in density])


def figures_of_errors(bench, views, document):
    """Figs. 8 to 10."""
    document.text("## Fig. 8: differences from `traced`\n\nThe lower row shows them 50 times as large. "
                  "L1_8bit, where the paper prints 6, 3 and 9: ")
    rows = [[], []]
    l1 = []
    for path, v in views.items():
        out = bench.work / f"difference_{PATHS[path][1]}"
        result = json.loads(bench.catoptric("compare", v["second_order"], v["traced"], "--out", out,
                                            "--json"))
        l1.append(f"{path} {number(result[0]['pooled']['L1_8bit'])}")
        from PIL import Image
        rows[0].append(Image.open(out / f"frame.{VIEWS[path]:04d}.png"))
        rows[1].append(Image.open(out / f"frame.{VIEWS[path]:04d}.x50.png"))
    document.blocks[-1] += ", ".join(l1) + "."
    sheet(document.picture("fig8.png", "Differences"), rows, list(views))

    view = views["living room a"]
    document.text("## Fig. 9: pixels that took the cube map (red)\n\n"
                  f"{view['counts']['second_order']['environment'] / 1048576:.2%} of the samples.")
    sheet(document.picture("fig9.png", "Fallbacks"),
          [[reflection(view["second_order"]), red(view["second_order"], "mask.environment.X")]],
          ["reflective component", "cube map in red"])

    document.text("## Fig. 10: depth images with a third of the resolution\n\nThe picture shows a vase "
                  "and its surroundings in living room b, pixel for pixel.")
    sheet(document.picture("fig10.png", "Resolution of depth images"),
          [[reflection(views["living room b"][m]).crop((60, 60, 316, 316))
            for m in ("second_order", "third")]], ["scale 1", "scale 1/3"])


def figures_of_lobes(frames, document):
    """Figs. 11 and 12."""
    document.text("## Fig. 11: two levels of glossiness, 8 rays\n\nThe pictures are without and with "
                  "the diffuse component, and by `traced`.")
    sheet(document.picture("fig11.png", "Glossy reflections, 8 rays"),
          [[reflection(f["second_order_8"]), preview(f["second_order_8"]), preview(f["traced_8"])]
           for f in frames.values()], ["reflective component", "second order", "traced"])

    document.text("## Fig. 12: the same with 49 rays")
    sheet(document.picture("fig12.png", "Glossy reflections, 49 rays"),
          [[preview(f["second_order_49"]) for f in frames.values()]], list(frames))


def figure_of_normal_map(bench, document):
    """Fig. 13."""
    runs = bench.render("second_order_normal_map", "normal_map", parts=[([1, 2], [4, 6, 8, 10, 12])])
    document.text("## Fig. 13: a normal-mapped reflector\n\n"
                  f"{1e3 / runs['second_order'].ms():.1f} fps (printed: 31), traced / ours "
                  f"{runs['second_order'].ratio(runs['traced']):.2f}, "
                  f"{statistics.fmean(runs['second_order'].count('clusters')):.0f} clusters.")
    sheet(document.picture("fig13.png", "Normal-mapped reflector"),
          [[preview(bench.work / "normal_map" / "0" / m / "frames" / "frame.0006.exr") for m in runs]],
          [m.replace("_", " ") for m in runs])


def pictures(bench, document):
    views = views_of(bench)
    shown = ", ".join(f"{path} frame {frame}" for path, frame in VIEWS.items())

    document.text(f"## Fig. 1: environment mapping, ray tracing, second_order\n\n{shown}.")
    methods = ["environment_map", "traced", "second_order"]
    sheet(document.picture("fig1.png", "Three views by three methods"),
          [[preview(v[m]) for m in methods] for v in views.values()],
          [m.replace("_", " ") for m in methods])

    frames = glossy_frames(bench)
    document.text("## Fig. 2: two levels of glossiness\n\n"
                  + ", ".join(f"{k}: g {v}" for k, v in GLOSSINESS.items()) + "; 8 rays.")
    sheet(document.picture("fig2.png", "Glossy reflections"),
          [[preview(f["second_order_8"]) for f in frames.values()]], list(frames))

    figures_of_clusters(views, frames, document)
    figures_of_errors(bench, views, document)
    figures_of_lobes(frames, document)
    figure_of_normal_map(bench, document)
