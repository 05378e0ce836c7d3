"""What configs/papers/perturbation.suite.json does not make of [Chen2000]'s page, for scripts/paper_tables."""
import json
import pathlib
import statistics

import paper_povray
from paper_run import exponent, number, preview
from paper_run import sheet as panels

FIGURES = {"Fig. 8": "perturbation", "Fig. 9": "perturbation_bounces", "Fig. 10": "perturbation_window"}
DENSITIES = [8, 16, 32, 64]  # sample rays along a side: Fig. 11
ORDERS = ["nearest", "linear", "quadratic", "auto"]
SEGMENTS = [8, 16, 25, 48]  # around and along, of vase and sphere: Fig. 12
POVRAY = {"vase_lizard": 1, "vase_sphere": 2, "vase_window": 1}


def moving(bench, frames):
    """Frames of a path of which the first is the initial one."""
    count = {"full": frames, "quick": min(frames, 12), "smoke": 2}[bench.effort]
    return [([], list(range(1, count + 1)))]


def after_first(run):
    """Without the first frame, which makes the paths."""
    rest = type(run)()
    rest.kinds = run.kinds
    first = min(run.steps)
    rest.steps = {n: s for n, s in run.steps.items() if n != first}
    rest.counters = {n: c for n, c in run.counters.items() if n != first}
    return rest


def frame_of(bench, name, method, number_):
    return bench.work / name / "0" / method / "frames" / f"frame.{number_:04d}.exr"


def l1(bench, name, method, against="traced"):
    frames, _ = bench.errors(name, method, against)
    return statistics.fmean(f["L1_8bit"] for f in frames)


def figures(bench, document):
    runs = {figure: bench.render(config, config, parts=moving(bench, 24)) for figure, config in FIGURES.items()}
    last = max(runs["Fig. 8"]["perturbation"].steps)
    document.text("## Pictures\n\nFig. 8, by perturbation and by rays:")
    shown = [preview(frame_of(bench, "perturbation", m, last)) for m in ("perturbation", "traced")]
    sheet(document.picture("fig8.png", "The vase and the lizard"), [shown, [close(p) for p in shown]],
          ["perturbation", "traced"])
    document.text("Fig. 9: perturbation with two bounces, and rays with two and with five bounces. Against rays with five "
                  "bounces, perturbation has an L1_8bit of "
                  f"{number(l1(bench, 'perturbation_bounces', 'perturbation', 'traced_5'))}, and rays with two bounces "
                  f"have {number(l1(bench, 'perturbation_bounces', 'traced', 'traced_5'))}.")
    shown = [preview(frame_of(bench, "perturbation_bounces", m, last))
             for m in ("perturbation", "traced", "traced_5")]
    sheet(document.picture("fig9.png", "Two reflectors"), [shown, [close(p) for p in shown]],
          ["perturbation", "traced, 2 bounces", "traced, 5 bounces"])
    document.text("Fig. 10, while the icosahedron moves:")
    numbers = sorted(runs["Fig. 10"]["perturbation"].steps)
    chosen = [numbers[i * (len(numbers) - 1) // 2] for i in range(3)]
    sheet(document.picture("fig10.png", "The vase by the window"),
          [[preview(frame_of(bench, "perturbation_window", m, n)) for n in chosen]
           for m in ("perturbation", "traced")], [f"frame {n}" for n in chosen])
    document.text("Fig. 13, the orders nearest, linear and quadratic:")
    sheet(document.picture("fig13.png", "Approximation orders"),
          [[close(preview(frame_of(bench, "perturbation", m, last)))
            for m in ("nearest", "linear", "quadratic")]], ["nearest", "linear", "quadratic"])


def sheet(file, rows, labels):
    panels(file, rows, labels, 1152 // max(3, len(labels)))


def close(picture):
    """The middle of a picture."""
    w, h = picture.size
    return picture.crop((w // 4, h // 2 - h // 16, 3 * w // 4, h // 2 - h // 16 + h // 2))


def density(bench, document):
    runs = bench.render("perturbation_density", "density", parts=moving(bench, 12))
    errors, times = {}, {}
    for n in DENSITIES:
        for order in ORDERS:
            run = runs[f"{order}_{n}x{n}"]
            first = min(run.steps)
            initial = 1e3 * sum(run.steps[first].get(s, 0) for s in ("paths", "virtual_objects"))
            errors.setdefault(order, []).append(l1(bench, "density", f"{order}_{n}x{n}"))
            times.setdefault(order, []).append(initial)
    curves(document.picture("density.png", "Error and time by density and order"),
           "sample rays along a side", DENSITIES, {"L1_8bit": errors, "initial ms": times})
    last = max(runs["traced"].steps)
    shown = [f"quadratic_{n}x{n}" for n in DENSITIES[:3]]
    sheet(document.picture("fig11.png", "Sample densities"),
          [[close(preview(frame_of(bench, "density", m, last))) for m in [*shown, "traced"]]],
          [*(f"{n} x {n} rays" for n in DENSITIES[:3]), "traced"])


def curves(file, across, xs, panels):
    """A panel for each quantity, a line for each of its series, both axes logarithmic."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(panels), figsize=(4.5 * len(panels), 3.2))
    for axis, (quantity, series) in zip(axes, panels.items()):
        for name, ys in series.items():
            axis.loglog(xs, ys, "o-", label=name)
        axis.set_xlabel(across)
        axis.set_ylabel(quantity)
        axis.set_xticks(xs, labels=map(str, xs))
        axis.minorticks_off()
        axis.grid(alpha=0.3)
        axis.legend()
    figure.tight_layout()
    figure.savefig(file, dpi=100)


def tessellation(bench, document):
    document.text("## Fig. 12: tessellation\n\nVase and sphere are reflected with the triangles that are given: edges are not halved.")
    rows, pictures, labels = [], [], []
    scene = json.loads(pathlib.Path("scenes/vase_sphere.json").read_text())
    for n in SEGMENTS:
        for thing in scene["objects"]:
            if thing["shape"] == "implicit":
                thing["segments"] = [n, n]
        file = bench.work / "scenes" / f"vase_sphere_{n}.json"
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(scene))
        name = f"tessellation_{n}"
        run = bench.render("perturbation_tessellation", name, [f"scene={json.dumps(str(file))}"],
                           moving(bench, 6))["perturbation"]
        first, moved = min(run.steps), after_first(run)
        rows.append([2 * n * n, run.counters[first]["vertices"],
                     1e3 * run.steps[first]["virtual_objects"], moved.ms(),
                     l1(bench, name, "perturbation")])
        labels.append(f"{2 * n * n} triangles each")
        pictures.append(close(preview(frame_of(bench, name, "perturbation", max(run.steps)))))
    document.table(["triangles of each reflector, at most", "vertices looked up", "initial `virtual_objects` ms",
                    "frame ms after a move", "L1_8bit"], rows)
    document.text("The time of the initial virtual objects grows with the number of vertices to the power of "
                  f"{exponent([r[1] for r in rows], [r[2] for r in rows]):.2f}.")
    curves(document.picture("tessellation.png", "Error and time by tessellation"),
           "triangles of each reflector", [r[0] for r in rows],
           {"L1_8bit": {"auto": [r[-1] for r in rows]},
            "initial virtual objects, ms": {"auto": [r[2] for r in rows]}})
    sheet(document.picture("fig12.png", "Tessellations"), [pictures], labels)


def povray(bench, document, scenes=tuple(POVRAY)):
    paper_povray.install()
    document.text("""## POV-Ray

POV-Ray 3.7 renders the same scenes on two threads, with a checker on the floor, so that both programs show
the same. The first tables have hard shadows of the light, as our scenes have them (ours are baked with one ray
per vertex of a floor in cells of 0.12 m, so their edges are softer, and what moves casts none), light from
everywhere alike and a black sky. The second tables have lights without shadows and a sky of one colour: this is
POV-Ray's fastest form, and it shows less than our scenes do. For POV-Ray the vase is a lathe of two Bezier
pieces, its fastest exact primitive, or an isosurface. Its seconds are of tracing alone, the least of three runs;
ours are of a frame after a move, as above, and "update" is the virtual objects without their drawing. The
pictures are of time 0 with one ray per pixel, and errors are against POV-Ray's lathe. One thing differs: after
the last bounce a reflector that is seen in a reflector shows its diffuse component here, and (1 - s) of it in
POV-Ray (the mouth of the vase).""")
    moved = {"full": 24, "quick": 12, "smoke": 1}[bench.effort]
    for shadows in (True, False):
        document.text(f"### {'With' if shadows else 'Without'} shadows")
        rows, errors = [], []
        for scene in scenes:
            both = paper_povray.Comparison(bench, scene, POVRAY[scene], moved, shadows)
            for samples, (lathe, isosurface, runs) in both.times.items():
                frame = 1e-3 * runs["perturbation"].ms()
                update = 1e-3 * statistics.median(runs["perturbation"].step("virtual_objects"))
                rows.append([scene, f"{samples ** 2}", lathe, isosurface, 1e-3 * runs["traced"].ms(),
                             frame, update, lathe / frame, isosurface / frame, lathe / update])
            errors.append([scene, *(both.errors[n] for n in ("isosurface", "traced", "perturbation"))])
            name = f"povray_{scene}{'_shadows' if shadows else ''}.png"
            both.picture(document.picture(name, "POV-Ray, perturbation, four times their difference"))
        document.table(["scene", "rays a pixel", "lathe s", "isosurface s", "`traced` s", "frame s",
                        "update s", "lathe / frame", "isosurface / frame", "lathe / update"], rows)
        document.text("L1_8bit from POV-Ray's picture:")
        document.table(["scene", "isosurface", "`traced`", "perturbation"], errors)


PARTS = {"figures": figures, "density": density, "tessellation": tessellation, "povray": povray}
# All parts of the page in their order; the others are made by configs/papers/perturbation.suite.json.
PAGE = ["steps", "figures", "rays", "density", "tessellation", "povray"]
