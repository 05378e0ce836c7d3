#!/usr/bin/env python3
"""Holds the papers' configs to what the program accepts, and the arithmetic of scripts/paper_tables.

Usage: paper_tables.py SOURCE_FOLDER PROGRAM WORK_FOLDER
Plans every config of configs/papers/ with a small scene (the rooms' assets may be missing), renders
two frames of one as the tables do, and fits slopes to known laws.
"""

import os
import pathlib
import sys

sys.dont_write_bytecode = True


def main(source: pathlib.Path, program: pathlib.Path, work: pathlib.Path) -> int:
    sys.path.insert(0, str(source / "scripts"))
    import paper_frames
    import paper_run
    import paper_second_order
    import paper_second_order_pictures  # noqa: F401
    import paper_sets
    import work_folder

    os.chdir(source)
    work = work_folder.fresh(work)
    failed = []

    def expect(what, value, wanted):
        if value != wanted:
            failed.append(f"{what}: {value!r}, expected {wanted!r}")

    xs = [1.0, 2.0, 5.0]
    expect("exponent", round(paper_run.exponent(xs, [3 * x ** 0.75 for x in xs]), 9), 0.75)
    expect("slope", round(paper_run.slope(xs, [7 - 2 * x for x in xs]), 9), -2)
    expect("number", [paper_run.number(v) for v in (0.012345, 9.876, 1234.5, 0)],
           ["0.0123", "9.88", "1234", "0"])

    objects = [{"id": 1, "pixels": 30, "L1_8bit": 1.0}, {"id": 2, "pixels": 10, "L1_8bit": 3.0},
               {"id": 3, "pixels": 9, "L1_8bit": 99.0}]
    expect("pooled", [paper_frames.pooled(objects, {1, 2}), paper_frames.pooled(objects, {4})],
           [(40, 1.5), (0, 0.0)])

    bench = paper_run.Bench(program.parent.parent, work, "quick")
    expect("parts", [(w, n[:2], len(n)) for w, n in bench.path_frames()],
           [([43, 44], [45, 225], 5), ([133, 134], [135, 315], 5)])
    small = ["scene=scenes/cornell_box.json", "path=paths/cornell_box.json", "image.width=32",
             "image.height=32", 'image.layers=["s","id"]']
    for config in sorted((source / "configs" / "papers").glob("*.json")):
        if config.name.endswith(".suite.json"):
            continue
        # These need their own scenes: implicit surfaces, objects that they name
        sets = [] if config.name.startswith(("perturbation", "impostors")) else [
            part for setting in small for part in ("--set", setting)]
        bench.catoptric("plan", config, "--frames", "1", *sets)

    runs = bench.render("second_order_resolution", "small", small, [([1], [2, 3]), ([4], [6])],
                        ["second_order", "traced"])
    expect("frames that count", sorted(runs["second_order"].steps), [2, 3, 6])
    expect("frames that count", sorted(runs["traced"].counters), [2, 3, 6])
    expect("clusters", all(runs["second_order"].count("clusters")), True)
    expect("parts of a frame", runs["traced"].ms() > runs["traced"].ms(without={"trace"}) > 0, True)
    frames, objects = bench.errors("small", "second_order", "traced")
    expect("frames compared", len(frames), 5)
    expect("objects compared", [n > 0 and e >= 0 for n, e in objects.values()], [True] * 3)

    scene = {"materials": {"a": {"s": 0.2, "g": 0}, "b": {"s": 0}},
             "objects": [{"shape": "teapot", "material": "a", "children": [
                 {"shape": "sphere", "material": "b"}]}, {"asset": "x", "materials": {"*": {"s": 1, "g": 0}}}]}
    paper_second_order.tessellated(2)(scene)
    paper_second_order.all_glossy(0.3)(scene)
    expect("segments", [scene["objects"][0].get("segments"),
                        scene["objects"][0]["children"][0].get("segments")], [20, None])
    expect("glossiness", [scene["materials"]["a"]["g"], scene["objects"][1]["materials"]["*"]["g"],
                          "g" in scene["materials"]["b"]], [0.3, 0.3, False])

    def frames(rows):
        return {(row[1], row[2], n) for row in rows for n in paper_sets.frames_of(row)}

    expect("frames in both sets", frames(paper_sets.TUNING) & frames(paper_sets.VALIDATION), set())
    for row in paper_sets.TUNING + paper_sets.VALIDATION:
        known = [(source / folder / f"{name}.json").exists()
                 for folder, name in (("scenes", row[1]), ("paths", row[2]))]
        expect(f"scene and path of {row[0]}", known, [True, True])
    for line in failed:
        print(line)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))
