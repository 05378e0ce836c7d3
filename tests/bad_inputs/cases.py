"""Bad inputs: each a named change to a valid file, with the exit code and the message it must give."""
import copy
import json
import re
import struct
from typing import NamedTuple

import valid

USAGE, SCENE = 2, 3


class Case(NamedTuple):
    name: str
    files: dict      # what differs from valid.files(); a value of None removes the file
    command: list
    code: int
    message: str     # regular expression, searched for in stderr


class Raw(str):
    """JSON text that no JSON library would write."""


GONE = object()


def changed(document, pointer, value):
    """A copy with the value at a JSON pointer replaced, added, or removed (GONE), as text."""
    document = copy.deepcopy(document)
    place = document
    *way, last = [int(k) if k.isdigit() else k for k in pointer.split("/")[1:]]
    for key in way:
        place = place[key]
    if value is GONE:
        del place[last]
    elif isinstance(place, list) and last == len(place):
        place.append(value)
    else:
        place[last] = "\ue000" if isinstance(value, Raw) else value
    out = json.dumps(document, indent=1, ensure_ascii=False)
    return out.replace('"\ue000"', value if isinstance(value, Raw) else "").encode()


def short(value):
    return "gone" if value is GONE else re.sub(r"\s+", "", json.dumps(value, ensure_ascii=True))[:40]


def table(cases, kind, file, document, command, code, rows, named=True):
    """Rows: pointer, bad values, and what the message says beside the file and the place. The place is
    the pointer, or its parent's for what is missing; '@POINTER message' names another. Not `named`: the
    message names no file."""
    for pointer, values, message in rows:
        for value in values:
            place = pointer.rsplit("/", 1)[0] if value is GONE else pointer
            want = message
            if message.startswith("@"):
                place, _, want = message[1:].partition(" ")
            parts = [re.escape(file)] * named + [re.escape(place) + r"\b"] * bool(place) + [want]
            pattern = ".*".join(parts)
            cases.append(Case(f"{kind}{pointer}={short(value)}", {file: changed(document, pointer, value)},
                              command, code, pattern))


TEXT, NUMBER = "text", 5
NOT_TEXT, NOT_NUMBER = [5, [1]], ["text", [1], None, True]
NAN = [Raw("NaN"), Raw("1e999")]
NO_NUMBER = "(is not a number|overflow)"
VEC3 = ["text", [1, 2], [1, 2, 3, 4], [1, 2, "z"], 5]
WANTED = "(is not|must be|expected|allowed)"
RANGE = "out of range"


def syntax(cases, kind, file, document, command, code):
    """What is wrong with any JSON file before it means anything."""
    text = json.dumps(document, indent=1)
    first = next(iter(document))
    for name, data, message in [
            ("empty", b"", ""),
            ("blank", b"  \n ", ""),
            ("cut", text[:len(text) // 2].encode(), ""),
            ("array", b"[1, 2]", ""),
            ("text", b'"text"', ""),
            ("null", b"null", ""),
            ("comment", b"// note\n" + text.encode(), ""),
            ("trailing_comma", text[:text.rindex("}")].rstrip().encode() + b",}", ""),
            ("two_values", text.encode() + b"{}", ""),
            ("single_quotes", text.replace('"', "'").encode(), ""),
            ("duplicate", text.replace("{", '{"%s": 1,' % first, 1).encode(), re.escape(first)),
            ("not_utf8", text.encode().replace(b'"', b'"\xff\xfe', 1), ""),
            ("nested", b'{"x":' + b"[" * 20000 + b"]" * 20000 + b"}", "(deep|nest)"),
            ("binary", bytes(range(256)) * 4, ""),
            ("zero_byte", text.encode() + b"\0{}", "zero"),
            ("zero_inside", text.encode().replace(b"{", b"{\0", 1), "zero"),
            ("nan", text.replace("{", '{"x": NaN,', 1).encode(), "")]:
        cases.append(Case(f"{kind}:{name}", {file: data}, command, code, re.escape(file) + ".*" + message))


def configs(cases):
    command = ["plan", "config.json"]
    syntax(cases, "config", "config.json", valid.CONFIG, command, USAGE)
    table(cases, "config", "config.json", valid.CONFIG, command, USAGE, [
        ("/scene", [5, [1], None, True], WANTED),
        ("/scene", [GONE], '.*scene'),
        ("/path", NOT_TEXT, WANTED),
        ("/frames", NOT_TEXT, WANTED),
        ("/image", [5, TEXT, [1]], WANTED),
        ("/image/width", NOT_NUMBER + [1.5], WANTED),
        ("/image/width", [0, -8, 16385], RANGE),
        ("/image/width", [1e30], WANTED),
        ("/image/height", [0, -8, 16385], RANGE),
        ("/image/samples", [0, 9, "2"], "(out of range|is not)"),
        ("/image/samples", NAN, NO_NUMBER),
        ("/image/layers", [5, TEXT], WANTED),
        ("/image/layers/0", ["z", "reflexion", 5], WANTED),
        ("/image/masks", [1, "yes"], WANTED),
        ("/image/half", [0, "no"], WANTED),
        ("/image/compression", ["zipp", 5], WANTED),
        ("/image/widht", [8], 'width'),
        ("/methods", [5, TEXT], WANTED),
        ("/methods", [[]], ""),
        ("/methods/0", ["traced2", 5, [1]], ""),
        ("/methods/1/method", ["tracd", 5, GONE], ""),
        ("/methods/1/bvh", ["fast", 5], WANTED),
        ("/methods/1/bvhh", ["static"], "bvh"),
        ("/methods/1/name", ["reference"], "@/methods/2 two methods"),
        ("/methods/1/name", [5], ""),
        ("/methods/2/samples", [0, -1, 1.5, "4"], ""),
        ("/methods/2/rays", [0, 1e12], RANGE),
        ("/errors/against/0", ["nobody", 5], ""),
        ("/preview/exposure", ["bright"], WANTED),
        ("/ground", ["grass", 5], WANTED),
        ("/seed", [-1, 1.5, "x"], ""),
        ("/threads", [-1, 5000, "all"], ""),
        ("/unknown", [1], "unknown"),
        ("/mehtods", [["traced"]], "methods"),
    ])
    table(cases, "config:use", "config.json", valid.CONFIG, command, USAGE, [
        ("/device", ["gpu", "egl:x"], "@ device"),
        ("/frames", ["0", "1-", "a", "5-1", "1-99", "1x0", "1,,2"], "@ frame"),
        ("/scene", ["config.json", "keyframes.json"], "@ (config|keyframes)"),
        ("/path", ["none.json", "scene.json", "picture.png"], "@ (none|scene|picture)"),
    ], named=False)
    table(cases, "config:use", "config.json", valid.CONFIG, command, SCENE, [
        ("/scene", ["none.json", "picture.png", "."], "@ (none.json|picture.png|not a regular file)"),
    ], named=False)


INFO_SCENE = ["info", "scene.json"]


def scene_table(cases, rows):
    table(cases, "scene", "scene.json", valid.SCENE, INFO_SCENE, SCENE, rows)


def scenes(cases):
    syntax(cases, "scene", "scene.json", valid.SCENE, INFO_SCENE, SCENE)
    scene_objects(cases)
    scene_surroundings(cases)
    scene_products(cases)
    whole_scenes(cases)
    for name, file, message in [("none", "none.json", "no such file|none.json"), ("folder", ".", ""),
                                ("png", "picture.png", "not a kind of scene"), ("exr", "sky.exr", "not a kind of scene")]:
        cases.append(Case(f"scene:file_{name}", {}, ["info", file], None, message))


def scene_objects(cases):
    ball, leaf = "/objects/1", "/objects/2"
    scene_table(cases, [
        ("/objects", [5, TEXT, GONE], ""),
        ("/objects", [[]], "@/animation/0/object "),
        ("/objects/0", [5, TEXT, [1]], ""),
        ("/objects/0/shape", ["bx", 5, GONE], ""),
        ("/objects/0/size", VEC3, WANTED),
        ("/objects/0/size", [[0, 1, 1], [-1, 1, 1], [1e9, 1, 1]], "(out of range|above|allowed)"),
        ("/objects/0/size/1", NAN, NO_NUMBER),
        ("/objects/0/faces", [[], ["up"], 5], ""),
        ("/objects/0/translate", VEC3, WANTED),
        ("/objects/0/translate/2", NAN, NO_NUMBER),
        ("/objects/0/material", ["gold", 5], ""),
        ("/objects/0/quaternion", [[0, 0, 0, 0], [1, 2, 3]], ""),
        ("/objects/0/scale", ["big"], ""),
        ("/objects/0/fit", [[1, 1], [None, None, None], [-1, 1, 1], 5], ""),
        ("/objects/0/anchor", ["side"], WANTED),
        ("/objects/0/radius", [1], "(unknown|allowed)"),
        ("/objects/0/asset", ["tri.gltf"], "@/objects/0 both"),
        ("/objects/0/reflective", [5, {"q": 1}], ""),
        ("/objects/0/segments", [[1, 1], [0, 1, 1], [1e5, 1e5, 1e5], [1.5, 1, 1]], ""),
        ("/objects/0/cell", [1e-9, 0], ""),
        (ball + "/radius", [0, -1, "r", 1e30], ""),
        (ball + "/segments", [[2, 2], [8]], ""),
        (ball + "/morph/type", ["bend", 5], ""),
        (ball + "/morph/axis", [[0, 0, 0]], ""),
        (leaf + "/vertices", [[], [[0, 0, 0]], 5, GONE], ""),
        (leaf + "/vertices/1", [[1, 2], ["a", 0, 0]], ""),
        (leaf + "/vertices/1", [[0, 0, 0], [0, 2, 0]], f"@{leaf}/faces/0 .*no area"),
        (leaf + "/faces", [[], 5, GONE], ""),
        (leaf + "/faces/0", [[0, 1], [0, 1, 3], [0, 1, -1], [0, 0, 0], [0, 1, 0.5]], ""),
        ("/objects/3/profile", [[], [[1, 0]], [[-1, 0], [1, 1]], [[1, 0], [1, 0]], GONE], ""),
        ("/objects/4/points", [[], [[0, 0, 0]], [[0, 0, 0], [0, 0, 0]], GONE], ""),
        ("/objects/4/radius", [0, -1, [1], "x"], ""),
        ("/objects/5/outline", [[], [[0, 0], [1, 0]], GONE], ""),
        ("/objects/5/height", [0, -1], ""),
        ("/objects/6/surface", ["cube", GONE], ""),
        ("/objects/6/balls", [[], [[0, 0, 0]], [[0, 0, 0, 0]]], ""),
        ("/objects/6/resolution", [0, 1e6], RANGE),
        ("/objects/7/inner", [1, 2, -1], ""),
        ("/objects/8/openings", [[[-1, 0, 2, 2]], [[0, 0, 0, 1]], [[0, 0, 1]]], "@/objects/8 "),
        ("/objects/9/asset", ["none.gltf", "/etc/passwd", "", 5], ""),
        ("/objects/9/asset", ["../tri.gltf", "a/../../tri.gltf", ".."], "is outside the folder"),
        ("/objects/9/nodes", [["square*"], 5], ""),
        ("/objects/9/materials/glass", ["steel"], "no material"),
        ("/objects/10/repeat/count", [0, -1, 1e9, [1, 1], "x"], ""),
        ("/objects/10/repeat/stp", [[1, 0, 0]], "unknown"),
        ("/objects/11/children", [5, [5]], ""),
        ("/objects/11/morph", [{"type": "bulge"}], ""),
    ])


def scene_surroundings(cases):
    """Materials, lights, environment, animation, cameras."""
    scene_table(cases, [
        ("/materials/steel/base_color", ["#8080", "grey", [1, 1], [-1, 0, 0], 5, [1e38, 0, 0]], ""),
        ("/ambient", [[1e38, 1e38, 1e38], [0, 0, 2e9]], RANGE),
        ("/materials/steel/metallic", [2, -1, "m"], ""),
        ("/materials/steel/roughness", NAN, NO_NUMBER),
        ("/materials/steel/metalic", [1], "metallic"),
        ("/lights/0/type", ["lamp", 5, GONE], ""),
        ("/lights/0/direction", [[0, 0, 0], [0, 1]], "@/lights/0 "),
        ("/lights/0/intensity", [-1, "x", 1e40], ""),
        ("/lights/0/inner_cone", [40, -1], "@/lights/0 "),
        ("/lights/0/color", [[1, 1], "red"], ""),
        ("/lights/0/baked", [True, 5], "@/lights/0 "),
        ("/lights/0/target", [[0, 0, 0]], "@/lights/0 "),
        ("/lights/0/object", ["nobody"], ""),
        ("/environment/type", ["sky", GONE], ""),
        ("/environment/zenith", [[1], "x"], ""),
        ("/environment/scale", [-1, 1e40], ""),
        ("/environment/zenith", [[1e38, 0, 0]], RANGE),
        ("/materials/steel/texture", ["a.png\0.jpg"], "u0000 is not allowed"),
        ("/environment", [{"type": "file", "file": "none.hdr"}, {"type": "file"}], ""),
        ("/environment", [{"type": "file", "file": "../sky.hdr"}], "is outside the folder"),
        ("/ambient", [[1, 1], "x", [-1, 0, 0]], ""),
        ("/bake/mode", ["all"], ""),
        ("/bake/rays", [0, 1e9, 1.5], ""),
        ("/bake/bounces", [-1, 100], ""),
        ("/animation/0/object", ["nobody", 5, GONE], ""),
        ("/animation/0/channel", ["move", "morph"], "@/animation/0 "),
        ("/animation/0/keys", [[], [[0, 1]], [[0, 0, 0, 0], [0, 1, 1, 1]], [[1, 0, 0, 0], [0, 1, 1, 1]], GONE], ""),
        ("/animation/0/interpolation", ["cubic"], ""),
        ("/animation/1", [valid.SCENE["animation"][0]], "animated already"),
        ("/cameras/0/target", [[0, 1, 5], [1e-30, 1, 5], [1, 2], GONE], "@/cameras/0 "),
        ("/cameras/0/fov", [0, 180, "wide"], ""),
        ("/light", [[]], "lights"),
    ])


def scene_products(cases):
    """Each number is in its range; their products are not."""
    huge = [1e20, -1e20, 1e12]
    scene_table(cases, [
        ("/objects/7/translate", [[x, 0, 0] for x in huge], '@ "ring" reaches'),
        ("/objects/11/scale", [1e10, [1e19, 1e19, 1e19]], "@ reaches"),
        ("/objects/11/translate", [[0, 1e15, 0]], "@ reaches"),
        ("/animation/0/keys/1", [[1, 0, 1e20, 0]], '@ "box" reaches .* at '),
        ("/lights/0/position", [[1e20, 0, 0]], "@ light .* reaches"),
        ("/lights", [[{"type": "point", "position": [0, 0, 0]}] * 256], "@ 257 lights"),
    ])


def whole_scenes(cases):
    deep = '{"children": [' * 60 + '{"shape": "plane"}' + "]}" * 60
    for name, data, message in [
            ("deep_children", '{"objects": [' + deep + "]}", "(deep|nest)"),
            ("only_a_group", '{"objects": [{"name": "group"}]}', "/objects.*no visible object"),
            ("invisible", '{"objects": [{"shape": "plane", "visible": false}]}', "/objects.*no visible object"),
            ("many_nodes", '{"objects": [{"shape": "plane", "repeat": {"count": [1000, 1000, 1000]}}]}',
             "/objects/0.*nodes allowed"),
            ("texture_missing", '{"objects": [{"shape": "plane", "material": {"texture": "none.png"}}]}', "none.png"),
            ("texture_outside", '{"objects": [{"shape": "plane", "material": {"texture": "../picture.png"}}]}',
             "/objects/0/material/texture.*is outside the folder"),
            ("refraction_without_s", '{"objects": [{"shape": "sphere", "material": {"refraction": 1.5}}]}', "/objects/0/material/refraction.*needs an .s. above 0"),
            ("refraction_of_gloss", '{"objects": [{"shape": "plane", "material": {"s": 1, "g": 0.5, "refraction": 1.5}}]}', "/objects/0/material/refraction.*glossy"),
            ("two_errors", '{"objects": [{"shape": "plane", "sise": 1}, {"shape": "sphere", "radius": -1}]}',
             "/objects/0/sise.*/objects/1/radius"),
            ("two_errors_of_shapes", '{"objects": [{"shape": "plane", "quaternion": [0, 0, 0, 0]}, {"shape": "plane", "material": "m"}]}',
             "/objects/0/quaternion.*/objects/1/material"),
            ("texture_is_folder", '{"objects": [{"shape": "plane", "material": {"texture": "."}}]}', ""),
            ("no_procedural", '{"objects": [{"shape": "plane", "material": {"texture": {"procedural": "lava"}}}]}',
             "lava")]:
        cases.append(Case(f"scene:{name}", {"scene.json": data.encode()}, INFO_SCENE, SCENE, "scene.json.*" + message))


def paths(cases):
    command = ["plan", "config.json"]
    def paths_of(kind, document, rows):
        config = valid.text(dict(valid.CONFIG, path=kind + ".json", frames=""))
        before = len(cases)
        table(cases, "path", kind + ".json", document, command, USAGE, rows)
        cases[before:] = [c._replace(files={**c.files, "config.json": config}) for c in cases[before:]]
    syntax(cases, "path", "keyframes.json", valid.KEYFRAMES, command, USAGE)
    paths_of("keyframes", valid.KEYFRAMES, [
        ("/fps", [0, -1, "fast"], ""),
        ("/fps", NAN, NO_NUMBER),
        ("/frames", [0, -1, 1.5, 1e9, "all"], ""),
        ("/fov", [0, 180, "wide"], ""),
        ("/near", [0, -1, "x"], ""),
        ("/up", [[0, 0, 0], [1, 2], 5], ""),
        ("/closed", [1, "yes"], ""),
        ("/keyframes", [[], 5], ""),
        ("/keyframes/0", [5, {}], ""),
        ("/keyframes/0/position", VEC3 + [GONE], ""),
        ("/keyframes/0/target", [[0, 1, 5]], "@/keyframes/0 "),
        ("/keyframes/1/target", [GONE], ""),
        ("/keyframes/0/orientation", [[0, 0, 0, 1]], "@/keyframes/0 "),
        ("/keyframes/1/time", [0, -1, GONE, "x"], ""),
        ("/keyframes/0/fov", [0, 200], ""),
        ("/keyframes/0/positon", [[0, 0, 0]], "position"),
        ("/orbit", [{"center": [0, 0, 0], "radius": 1}], "@ "),
        ("/keyframes/0/position/0", [1e20], "too far"),
    ])
    paths_of("orbit", valid.ORBIT, [
        ("/orbit", [5, {}], ""),
        ("/orbit/center", VEC3 + [GONE], ""),
        ("/orbit/radius", [0, -1, "x", GONE], ""),
        ("/orbit/radius", [1e20], "too far"),
        ("/orbit/turns", ["x"], ""),
    ])
    paths_of("walk", valid.WALK, [
        ("/walk/points", [[], [[0, 0]], 5, GONE], ""),
        ("/walk/points/1", [[1], ["a", 1], [1, 2, 3, 4]], ""),
        ("/walk/points/1/0", [1e20], "too far"),
        ("/walk/look", ["back", "target", "targets"], "@/walk "),
        ("/walk/pitch", [100], ""),
    ])
    paths_of("segments", valid.SEGMENTS, [
        ("/segments", [[], 5], ""),
        ("/segments/0", [5, {}], ""),
        ("/segments/1/gltf_camera", ["nobody", 5], ""),
    ])


INFO_GLTF = ["info", "tri.gltf"]
PRIMITIVE = "/meshes/0/primitives/0"


def gltfs(cases):
    document, data = valid.gltf()
    syntax(cases, "gltf", "tri.gltf", document, INFO_GLTF, SCENE)
    gltf_nodes(cases, document)
    gltf_meshes(cases, document)
    gltf_data(cases, document)
    gltf_buffers(cases, document, data)
    glbs(cases, document, data)


def gltf_nodes(cases, document):
    light = "/extensions/KHR_lights_punctual/lights/0"
    table(cases, "gltf", "tri.gltf", document, INFO_GLTF, SCENE, [
        ("/asset", [GONE, 5], "@/asset "),
        ("/asset/minVersion", [2.0, [1], "2.1"], "@/asset/minVersion "),
        ("/asset/version", ["1.0", "3.0", 2.0, GONE], "@/asset/version "),
        ("/extensionsRequired", [["KHR_materials_volume"]], "@/extensionsRequired/0 "),
        ("/scene", [1, -1, "0"], ""),
        ("/scenes", [5], ""),
        ("/scenes/0/nodes", [[3], [-1], ["a"], 5], ""),
        ("/scenes/0/nodes", [[0, 0]], ""),
        ("/nodes/0/mesh", [1, -1, 0.5, "0", 4294967296], ""),
        ("/nodes/0/children", [[0], [9], 5], ""),
        ("/nodes/0/scale", [[1, 1], "x", [1, 1, 1e30]], ""),
        ("/nodes/0/scale/0", NAN, NO_NUMBER),
        ("/nodes/0/rotation", [[0, 0, 0, 0], [1, 1, 1, 1], [0, 0, 1]], ""),
        ("/nodes/0/matrix", [[1] * 16], "@/nodes/0 "),
        ("/nodes/0/skin", [0], ""),
        ("/nodes/2/camera", [1], ""),
        ("/nodes/1/extensions/KHR_lights_punctual/light", [1, -1, GONE], ""),
        (light + "/type", ["area", GONE, 5], ""),
        (light + "/intensity", [-1, "x"], ""),
        (light + "/color", [[1, 1], [-1, 0, 0]], ""),
        (light + "/spot/outerConeAngle", [3, -1], ""),
        ("/cameras/0/type", ["fisheye", GONE], ""),
        ("/cameras/0/perspective", [GONE], ""),
        ("/cameras/0/perspective/yfov", [0, 4, GONE], ""),
        ("/nodes/2/translation", [[1e15, 0, 0]], '@ "eye" reaches'),
    ])


def gltf_meshes(cases, document):
    """Meshes, materials, images."""
    table(cases, "gltf", "tri.gltf", document, INFO_GLTF, SCENE, [
        ("/meshes/0/primitives", [[], GONE, 5], ""),
        (PRIMITIVE + "/attributes", [GONE, 5], ""),
        (PRIMITIVE + "/attributes/POSITION", [9, -1, "0"], ""),
        (PRIMITIVE + "/attributes/NORMAL", [4, 3], ""),
        (PRIMITIVE + "/attributes/TEXCOORD_0", [4, 0], ""),
        (PRIMITIVE + "/indices", [9, 0], ""),
        (PRIMITIVE + "/mode", [7, -1, "4"], ""),
        (PRIMITIVE + "/material", [1], ""),
        (PRIMITIVE + "/targets", [[{"POSITION": 4}], [{"POSITION": 9}], 5], ""),
        ("/meshes/0/weights", [[1]], ""),
        ("/materials/0/alphaMode", ["GLASS"], ""),
        ("/materials/0/emissiveFactor", [[1], [-1, 0, 0]], ""),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", [[1, 1, 1], [2, 0, 0, 1]], ""),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", [2, -1, "m"], ""),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", [1, GONE, "0"], ""),
        ("/textures/0/source", [1], ""),
        ("/textures/0/sampler", [1], ""),
        ("/samplers/0/wrapS", [5], ""),
        ("/images/0/bufferView", [9, 0, 5], "@/images/0 "),
        ("/images/0", [{}, {"uri": "../secret.png"}, {"uri": "/etc/passwd"}, {"uri": "http://x/y.png"},
                       {"uri": "%2e%2e/x.png"}, {"uri": "none.png"}, {"uri": "."}, {"uri": "a%zz.png"}], ""),
    ])


def gltf_data(cases, document):
    """Accessors, animations, buffers."""
    table(cases, "gltf", "tri.gltf", document, INFO_GLTF, SCENE, [
        ("/accessors/0/bufferView", [9, -1], ""),
        ("/accessors/0/count", [0, -1, 1.5, "3", GONE], "@/accessors/0 "),
        ("/accessors/0/count", [4, 1000, 9007199254740991], f"@{PRIMITIVE}/attributes/POSITION "),
        ("/accessors/0/componentType", [5130, 5123, GONE], "@/accessors/0 "),
        ("/accessors/0/type", ["VEC5", "VEC2", GONE], "@ "),
        ("/accessors/0/byteOffset", [2, 9007199254740990, -4], "@ "),
        ("/accessors/0/sparse", [{"count": 1}, {"count": 9, "indices": {"bufferView": 3, "componentType": 5123},
                                                "values": {"bufferView": 0}}], "@ "),
        ("/animations/0/channels/0/sampler", [1], ""),
        ("/animations/0/channels/0/target/node", [9], ""),
        ("/animations/0/samplers/0/input", [5, 9, GONE], "@/animations/0 "),
        ("/animations/0/samplers/0/output", [4, 9], "@/animations/0 "),
        ("/animations/0/samplers/0/interpolation", ["SPLINE"], ""),
        ("/bufferViews/0/buffer", [1, -1, GONE], ""),
        ("/bufferViews/0/byteLength", [0, 99999, 9007199254740991], "@ "),
        ("/bufferViews/0/byteOffset", [-1, 99999, 9007199254740991, 2], "@ "),
        ("/bufferViews/0/byteStride", [2, 300, 6], ""),
        ("/buffers/0/byteLength", [99999, 0, 1e15, GONE], "@/buffers/0 "),
        ("/buffers/0/uri", ["none.bin", "../data.bin", "/etc/passwd", "file:///etc/passwd", ".",
                            "data:application/octet-stream;base64,AAAA", "data:text/plain,AAAA", ""], "@/buffers/0 "),
    ])


def gltf_buffers(cases, document, data):
    floats = {"nan": b"\0\0\xc0\x7f", "infinity": b"\0\0\x80\x7f", "huge": struct.pack("<f", 3e38)}
    for name, value in floats.items():
        for at, what in [(0, "POSITION"), (36, "NORMAL")]:
            bad = data[:at] + value + data[at + 4:]
            cases.append(Case(f"gltf:{what}_{name}", {"data.bin": bad}, INFO_GLTF, SCENE, "tri.gltf.*" + what))
    index = document["bufferViews"][3]["byteOffset"]
    cases.append(Case("gltf:index_beyond", {"data.bin": data[:index] + b"\x03\0" + data[index + 2:]}, INFO_GLTF, SCENE,
                      "tri.gltf.*/indices.*out of range"))
    cases.append(Case("gltf:buffer_short", {"data.bin": data[:50]}, INFO_GLTF, SCENE, "tri.gltf.*/buffers/0"))
    cases.append(Case("gltf:buffer_gone", {"data.bin": None}, INFO_GLTF, SCENE, "tri.gltf.*/buffers/0"))


def glbs(cases, document, data):
    good = valid.glb(document, data)
    command = ["info", "tri.glb"]
    size = struct.unpack("<I", good[12:16])[0]
    for name, bad in [
            ("empty", b""), ("magic", b"glTX" + good[4:]), ("header_only", good[:12]), ("cut_header", good[:9]),
            ("version_1", valid.glb(document, data, version=1)), ("version_3", valid.glb(document, data, version=3)),
            ("too_long", valid.glb(document, data, length=len(good) + 4)), ("length_0", valid.glb(document, data, length=0)),
            ("cut_json", good[:40]), ("cut_bin", good[:-40]),
            ("json_size", good[:12] + struct.pack("<I", 0xFFFFFFFC) + good[16:]),
            ("json_odd", good[:12] + struct.pack("<I", size - 1) + good[16:]),
            ("json_type", good[:16] + b"BIN\0" + good[20:]),
            ("no_bin", valid.glb(document, b"")),
            ("short_bin", valid.glb(document, data[:40])),
            ("zeros", bytes(200))]:
        cases.append(Case(f"glb:{name}", {"tri.glb": bad}, command, SCENE, "tri.glb"))


def images(cases):
    good = valid.png()
    scene = {"objects": [{"shape": "plane", "size": [1, 1], "material": {"texture": "picture.png"}}]}
    document, data = valid.gltf()
    document["images"] = [{"uri": "picture.png"}]
    base = {"scene.json": valid.text(scene), "tri.gltf": valid.text(document)}
    chunk = valid.png_chunk
    grey = valid.jpeg()
    bad = {
        "empty": b"", "one_byte": b"\x89", "text": b"hello", "gif": b"GIF89a" + bytes(30), "signature": good[:8],
        "cut_header": good[:20], "cut_data": good[:50], "no_end": good[:-30],
        "zero_width": valid.png(0, 4, b""), "huge": valid.png(2**31 - 1, 2**31 - 1, b""),
        "too_many": valid.png(65536, 65536, b""), "bad_depth": valid.png(depth=3), "bad_colour": valid.png(color=5),
        "bad_interlace": valid.png(interlace=9), "few_rows": valid.png(4, 4, bytes(13)),
        "bad_filter": valid.png(1, 1, b"\x09abc"), "no_palette": valid.png(1, 1, b"\0\0", color=3),
        "palette_beyond": valid.png(1, 1, b"\0\x09", color=3, more=chunk(b"PLTE", b"\0" * 5)),
        "crc": good[:40] + bytes([good[40] ^ 1]) + good[41:], "garbage_in_data": good[:45] + b"\xff" * 20 + good[65:],
        "two_headers": good[:33] + good[8:], "no_header": good[:8] + good[33:],
        "critical_chunk": valid.png(more=chunk(b"ABCD", b"x")),
        "jpeg_cut": grey[:60], "jpeg_no_scan": grey[:-12], "jpeg_soi": grey[:2] + b"\xff\xd9",
        "jpeg_zero": valid.jpeg(0, 0), "jpeg_huge": valid.jpeg(65500, 65500),
        "jpeg_no_tables": grey[:2] + grey[71:], "jpeg_short_scan": valid.jpeg(512, 512, b""),
        "jpeg_components": valid.jpeg(components=9), "jpeg_length": grey[:4] + b"\xff\xff" + grey[6:60]}
    for name, data_ in bad.items():
        for kind, file in [("scene", "scene.json"), ("gltf", "tri.gltf")]:
            cases.append(Case(f"image_{kind}:{name}", {**base, "picture.png": data_}, ["info", file], SCENE,
                              re.escape("picture.png") + ".*"))
    # ---- environments ----
    flat = valid.hdr()
    hdr = {"empty": b"", "cut_header": flat[:15], "cut_rows": flat[:-5], "no_rows": flat[:50],
           "format": flat.replace(b"rle_rgbe", b"rle_xyze"), "no_size": valid.hdr(size_line=b"\n"),
           "orientation": valid.hdr(size_line=b"+Y 4 +X 8\n"), "negative": valid.hdr(size_line=b"-Y -4 +X 8\n"),
           "zero": valid.hdr(size_line=b"-Y 0 +X 8\n"), "huge": valid.hdr(size_line=b"-Y 2000000000 +X 2000000000\n"),
           "not_numbers": valid.hdr(size_line=b"-Y a +X b\n"), "row_width": valid.hdr(rows=b"\2\2\0\x09" + bytes(90)),
           "run_beyond": valid.hdr(rows=b"\2\2\0\x08" + b"\xff\x01" * 40), "run_first": valid.hdr(4, 1, rows=b"\1\1\1\5"),
           "exposure": valid.hdr(head=b"#?RADIANCE\nEXPOSURE=0\n\n"), "exposure_nan": valid.hdr(head=b"#?RADIANCE\nEXPOSURE=nan\n\n"),
           "too_bright": valid.hdr(rows=(b"\2\2\0\x08" + b"\x88\xff" * 4) * 4),
           "long_line": b"#?RADIANCE\n" + b"x" * 9000, "png": good}
    plain, packed = valid.exr(), valid.exr(compression=3)
    exr = {"empty": b"", "magic": plain[:4], "cut_header": plain[:100], "cut_table": plain[:-300], "cut_rows": plain[:-10],
           "no_channels": valid.exr(channels=()), "huge": valid.exr(window=(0, 0, 2**31 - 2, 2**31 - 2)), "inverted": valid.exr(window=(5, 5, 0, 0)),
           "far": valid.exr(window=(-2**31, -2**31, 2**31 - 1, 2**31 - 1)), "sampled": valid.exr(sampling=2),
           "no_sampling": valid.exr(sampling=0), "deep": valid.exr(flags=0x800), "multipart": valid.exr(flags=0x1000),
           "version": b"\x76\x2f\x31\x01\x09" + plain[5:], "no_window": valid.exr(drop=("dataWindow",)),
           "no_compression": valid.exr(drop=("compression",)), "no_list": valid.exr(drop=("channels",)),
           "pixel_type": valid.exr(pixel=9), "compression": valid.exr(compression=0).replace(b"compression\0\1\0\0\0\0", b"compression\0\1\0\0\0\x63"),
           "no_colour": valid.exr(channels=("Z",)), "zip_damaged": packed[:-12] + b"\xff" * 12, "zip_cut": packed[:-6]}
    for kind, bad in [("hdr", hdr), ("exr", exr)]:
        for name, data_ in bad.items():
            file = "sky." + kind
            cases.append(Case(f"{kind}:{name}", {"scene.json": valid.text(valid.sky(file)), file: data_},
                              ["plan", "scene.json"], SCENE, re.escape(file)))
        cases.append(Case(f"{kind}:info", {"scene.json": valid.text(valid.sky(file)), file: bad["cut_rows"]},
                          ["info", "scene.json"], SCENE, re.escape(file)))
        cases.append(Case(f"{kind}:render", {"scene.json": valid.text(valid.sky(file)), file: b""},
                          ["render", "scene.json", "--out", "out"], SCENE, re.escape(file)))


def good():
    """What must be accepted, and by what."""
    document, data = valid.gltf()
    for file in ["picture.png", "picture.jpg"]:
        pictured = copy.deepcopy(document)
        pictured["images"] = [{"uri": file}]
        yield Case(f"gltf with {file}", {"tri.gltf": valid.text(pictured)}, ["info", "tri.gltf"], 0, "")
    for file in ["scene.json", "tri.gltf", "tri.glb"]:
        yield Case(file, {}, ["info", file], 0, "")
    for file in ["keyframes.json", "orbit.json", "walk.json", "segments.json"]:
        yield Case(file, {"config.json": valid.text(dict(valid.CONFIG, path=file, frames=""))}, ["plan", "config.json"], 0, "")
    for file in ["sky.hdr", "sky.exr", "zip.exr"]:
        yield Case(file, {"scene.json": valid.text(valid.sky(file))},
                   ["render", "scene.json", "--set", "image.width=4", "--set", "image.height=4", "--frames", "1",
                    "--out", "out"], 0, "")


def bad():
    cases = []
    for make in [configs, scenes, paths, gltfs, images]:
        make(cases)
    return cases
