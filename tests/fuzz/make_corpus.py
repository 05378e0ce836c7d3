"""make_corpus.py FOLDER   writes small valid inputs of every kind into FOLDER/KIND."""
import base64
import copy
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/bad_inputs"))
import valid  # noqa: E402


def corpus():
    document, data = valid.gltf()
    within = copy.deepcopy(document)
    within["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    scene = copy.deepcopy(valid.SCENE)
    scene["objects"] = [o for o in scene["objects"] if "asset" not in o]
    del scene["materials"]["card"]
    shapes = {f"object_{o['name']}": valid.text({"objects": [o], "materials": scene["materials"]}) for o in scene["objects"]}
    compressed = {f.stem: f.read_bytes() for f in sorted((ROOT / "src/scene/gltf/testdata").glob("*.glb"))}
    return {"config": {"config": valid.text(valid.CONFIG), "plain": valid.text({"scene": "a.glb"})},
            "scene": {"scene": valid.text(scene), **shapes},
            "path": {"keyframes": valid.text(valid.KEYFRAMES), "orbit": valid.text(valid.ORBIT),
                     "walk": valid.text(valid.WALK), "segments": valid.text(valid.SEGMENTS)},
            "gltf": {"gltf": valid.text(within), "glb": valid.glb(document, data), **compressed},
            "image": {"png": valid.png(), "jpg": valid.jpeg(), "hdr": valid.hdr(), "exr": valid.exr(),
                      "zip_exr": valid.exr(compression=3),
                      "grey_png": valid.png(2, 2, b"\0\x40\x80" * 2, color=0)}}


def main():
    for kind, inputs in corpus().items():
        folder = pathlib.Path(sys.argv[1]) / kind
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in inputs.items():
            (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
