"""Small valid files of every kind that catoptric reads, made from nothing: {name: bytes}."""
import copy
import json
import struct
import zlib

# ---- images ----


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width=4, height=4, rows=None, depth=8, color=2, interlace=0, more=b""):
    """RGB unless told otherwise; `rows` are unfiltered scan lines; `more`: chunks before the image."""
    rows = rows if rows is not None else b"".join(b"\0" + b"\x80\x40\x20" * width for _ in range(height))
    return (b"\x89PNG\r\n\x1a\n"
            + png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, interlace))
            + more + png_chunk(b"IDAT", zlib.compress(rows)) + png_chunk(b"IEND", b""))


def jpeg(width=8, height=8, scan=b"\x3f", components=1):
    """Grey: Huffman tables of one code each, so that a block is the two bits 0 0."""
    def segment(marker, data):
        return b"\xff" + bytes([marker]) + struct.pack(">H", len(data) + 2) + data
    table = b"\x01" + bytes(15) + b"\0"
    return (b"\xff\xd8" + segment(0xDB, b"\0" + b"\x01" * 64)
            + segment(0xC0, struct.pack(">BHHB", 8, height, width, components) + b"\x01\x11\0")
            + segment(0xC4, b"\x00" + table) + segment(0xC4, b"\x10" + table)
            + segment(0xDA, b"\x01\x01\x00\x00\x3f\x00") + scan + b"\xff\xd9")


def hdr(width=8, height=4, size_line=None, head=b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n", rows=None):
    line = size_line if size_line is not None else b"-Y %d +X %d\n" % (height, width)
    row = struct.pack(">BBH", 2, 2, width) + b"".join(bytes([128 + width, v]) for v in (128, 64, 32, 129))
    return head + line + (rows if rows is not None else row * height)


def exr_attribute(name, kind, data):
    return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data


def exr(width=8, height=4, channels=("B", "G", "R"), compression=0, window=None, sampling=1, flags=0,
        drop=(), pixel=2):
    """Scan lines of floats, stored plain (0) or by zip (3: one block of up to 16 lines)."""
    window = window if window is not None else (0, 0, width - 1, height - 1)
    listed = b"".join(c.encode() + b"\0" + struct.pack("<IIII", pixel, 0, sampling, sampling) for c in channels)
    attributes = {
        "channels": (b"chlist", listed + b"\0"), "compression": (b"compression", bytes([compression])),
        "dataWindow": (b"box2i", struct.pack("<4i", *window)),
        "displayWindow": (b"box2i", struct.pack("<4i", *window)), "lineOrder": (b"lineOrder", b"\0"),
        "pixelAspectRatio": (b"float", struct.pack("<f", 1)),
        "screenWindowCenter": (b"v2f", struct.pack("<2f", 0, 0)),
        "screenWindowWidth": (b"float", struct.pack("<f", 1))}
    head = struct.pack("<II", 20000630, 2 | flags) + b"".join(
        exr_attribute(name.encode(), *value) for name, value in attributes.items() if name not in drop) + b"\0"
    line = struct.pack("<f", 0.5) * (width * len(channels))
    if compression == 0:
        blocks = [line] * height
    else:
        raw = line * height
        split = raw[0::2] + raw[1::2]
        delta = bytes([split[0]] + [(b - a + 128) % 256 for a, b in zip(split, split[1:])])
        blocks = [zlib.compress(delta)]
    at = len(head) + 8 * len(blocks)
    table, body = b"", b""
    for i, block in enumerate(blocks):
        table += struct.pack("<Q", at + len(body))
        body += struct.pack("<iI", window[1] + i, len(block)) + block
    return head + table + body


# ---- glTF ----

FLOAT, USHORT = 5126, 5123


def gltf():
    """A textured, lit, animated triangle with a camera: (JSON, bytes of its buffer)."""
    positions = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    normals = struct.pack("<9f", 0, 0, 1, 0, 0, 1, 0, 0, 1)
    uv = struct.pack("<6f", 0, 0, 1, 0, 0, 1)
    indices = struct.pack("<4H", 0, 1, 2, 0)
    times = struct.pack("<2f", 0, 1)
    moves = struct.pack("<6f", 0, 0, 0, 0, 1, 0)
    picture = png()
    picture += bytes(-len(picture) % 4)
    parts = [positions, normals, uv, indices, times, moves, picture]
    views, at = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part)
    def accessor(view, kind, count, component=FLOAT):
        return {"bufferView": view, "componentType": component, "type": kind, "count": count}
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "nodes": [{"name": "triangle", "mesh": 0, "scale": [1, 1, 1]},
                  {"name": "lamp", "translation": [0, 2, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}},
                  {"name": "eye", "translation": [0, 0, 3], "camera": 0}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 10, "color": [1, 1, 1], "range": 9, "spot": {"outerConeAngle": 0.5}}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
                                    "indices": 3, "material": 0, "mode": 4}]}],
        "materials": [{"name": "paint", "doubleSided": True, "alphaMode": "MASK", "alphaCutoff": 0.5,
                       "emissiveFactor": [0, 0, 0],
                       "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0.5,
                                                "roughnessFactor": 0.2, "baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 10497, "magFilter": 9729}],
        "images": [{"bufferView": 6, "mimeType": "image/png"}],
        "accessors": [accessor(0, "VEC3", 3), accessor(1, "VEC3", 3), accessor(2, "VEC2", 3),
                      accessor(3, "SCALAR", 3, USHORT), accessor(4, "SCALAR", 2), accessor(5, "VEC3", 2)],
        "animations": [{"samplers": [{"input": 4, "output": 5, "interpolation": "LINEAR"}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
        "bufferViews": views, "buffers": [{"byteLength": at, "uri": "data.bin"}]}
    return document, b"".join(parts)


def glb(document, data, version=2, length=None):
    document = copy.deepcopy(document)
    document["buffers"][0].pop("uri", None)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<4sII", b"glTF", version, length if length is not None else 12 + len(body)) + body


# ---- JSON ----

SCENE = {
    "name": "small",
    "objects": [
        {"name": "box", "shape": "box", "size": [1, 1, 1], "translate": [0, 0, 0], "material": "steel",
         "faces": ["+x", "+y", "+z"]},
        {"name": "ball", "shape": "sphere", "radius": 0.5, "segments": [8, 4], "translate": [1, 0, 0],
         "morph": {"type": "bulge", "amplitude": 0.1}},
        {"name": "leaf", "shape": "polygons", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]},
        {"name": "vase", "shape": "revolution", "profile": [[0.1, 0], [0.2, 0.5], [0.1, 1]], "segments": [8, 4]},
        {"name": "hose", "shape": "tube", "points": [[0, 0, 0], [0, 1, 0]], "radius": 0.1, "segments": [6, 2]},
        {"name": "bar", "shape": "prism", "outline": [[0, 0], [1, 0], [0, 1]], "height": 0.2},
        {"name": "blob", "shape": "implicit", "surface": "metaballs", "balls": [[0, 0, 0, 0.4]], "resolution": 8},
        {"name": "ring", "shape": "disk", "radius": 1, "inner": 0.5, "segments": [8, 1]},
        {"name": "wall", "shape": "panel", "size": [2, 2], "openings": [[-0.5, 0.5, 1, 1]]},
        {"name": "import", "asset": "tri.gltf", "nodes": ["tri*"], "materials": {"paint": "steel"}},
        {"name": "copies", "shape": "plane", "size": [1, 1], "repeat": {"count": [2, 1, 1], "step": [1, 0, 0]}},
        {"name": "group", "scale": 2, "children": [{"shape": "plane", "size": [1, 1], "rotate": [0, 90, 0]}]}],
    "materials": {"steel": {"base_color": "#808080", "metallic": 1, "roughness": 0.2},
                  "card": {"texture": "picture.png", "s": 0.2, "g": 0.1}},
    "lights": [{"type": "spot", "position": [0, 3, 0], "direction": [0, -1, 0], "color": [1, 1, 1],
                "intensity": 5, "inner_cone": 10, "outer_cone": 30, "range": 0}],
    "environment": {"type": "gradient", "zenith": [1, 1, 1], "horizon": [1, 1, 1], "ground": [0, 0, 0], "scale": 1},
    "ambient": [0.1, 0.1, 0.1],
    "bake": {"mode": "none", "rays": 8, "bounces": 1, "distance": 0},
    "animation": [{"object": "box", "channel": "translate", "interpolation": "linear",
                   "keys": [[0, 0, 0, 0], [1, 0, 1, 0]]}],
    "cameras": [{"name": "front", "position": [0, 1, 5], "target": [0, 0, 0], "fov": 50}]}

KEYFRAMES = {"fps": 30, "frames": 4, "fov": 60, "near": 0.01, "up": [0, 1, 0], "closed": False,
             "keyframes": [{"time": 0, "position": [0, 1, 5], "target": [0, 0, 0], "fov": 50},
                           {"time": 1, "position": [1, 1, 5], "target": [0, 0, 0]}]}
ORBIT = {"frames": 2, "orbit": {"center": [0, 0, 0], "radius": 4, "height": 1, "turns": 1}}
WALK = {"frames": 2, "walk": {"points": [[0, 4], [1, 4], [2, 3]], "look": "ahead", "eye_height": 1.5}}
SEGMENTS = {"segments": [ORBIT, {"frames": 1, "gltf_camera": "front"}]}

CONFIG = {"scene": "scene.json", "path": "keyframes.json", "frames": "1-2",
          "image": {"width": 8, "height": 8, "samples": 1, "layers": ["Z"], "masks": False, "half": True,
                    "compression": "zip"},
          "methods": ["environment_map", {"method": "traced", "name": "rays", "bvh": "static"},
                      {"method": "reference", "samples": 1, "rays": 1, "bounces": 1, "max_standard_error": 0}],
          "errors": {"against": ["rays"]}, "preview": {"enabled": False, "exposure": 0},
          "seed": 1, "device": "auto", "threads": 1}


def sky(name):
    """A scene whose environment is an image."""
    return {"objects": [{"shape": "plane", "size": [1, 1]}], "environment": {"type": "file", "file": name},
            "cameras": [{"position": [0, 1, 3], "target": [0, 0, 0]}]}


def text(document):
    return json.dumps(document, indent=1).encode()


def files():
    document, data = gltf()
    return {"tri.gltf": text(document), "data.bin": data, "tri.glb": glb(document, data),
            "picture.png": png(), "picture.jpg": jpeg(), "sky.hdr": hdr(), "sky.exr": exr(),
            "zip.exr": exr(compression=3), "scene.json": text(SCENE),
            "keyframes.json": text(KEYFRAMES), "orbit.json": text(ORBIT), "walk.json": text(WALK),
            "segments.json": text(SEGMENTS), "config.json": text(CONFIG)}
