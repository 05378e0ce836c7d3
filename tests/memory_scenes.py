"""Fifteen scenes of all kinds, against which tests/memory.py measures what `plan` says of memory."""

import json
import math
import pathlib
import struct
import zlib

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent
MIRROR = {"s": 0.9, "g": 0}
SKY = {"type": "constant", "color": [0.6, 0.7, 0.8]}
FLOOR = {"name": "floor", "shape": "plane", "size": [12, 12], "material": {"base_color": [0.5, 0.4, 0.3]}}
ORBIT = {"frames": 30, "fps": 30, "fov": 50,
         "orbit": {"center": [0, 0.5, 0], "radius": 4, "height": 1.5, "turns": 0.1}}


def png(size, seed):
    """An RGB picture of stripes."""
    rows = b"".join(b"\0" + bytes((x * seed ^ y) & 255 for x in range(64)) * (3 * size // 64) for y in range(size))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def hdr(width, height):
    """A Radiance image that is brighter to the right."""
    row = b"".join(bytes((100 + x * 100 // width, 120, 140, 129)) for x in range(width))
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + row * height


def balls(count):
    """Balls on a grid; every second one is a mirror."""
    side = math.isqrt(count)
    objects = [FLOOR]
    for i in range(count):
        mirror = i % 2 == 1
        objects.append({"name": f"ball {i}", "shape": "sphere", "radius": 0.3, "segments": [32, 16],
                        "translate": [i % side - side / 2, 0.31, i // side - side / 2],
                        "material": {"base_color": [0.2, 0.3 + 0.07 * (i % 7), 0.4], **(MIRROR if mirror else {})},
                        "reflective": mirror})
    return {"objects": objects, "environment": SKY}


def mirror_ball():
    return {"name": "mirror", "shape": "sphere", "radius": 0.5, "segments": [64, 32], "translate": [0, 0.8, 0],
            "material": MIRROR, "reflective": True}


def millions(folder):
    """Five million triangles in five rings about a mirror ball."""
    rings = [{"name": f"ring {i}", "shape": "torus", "radius": 0.6, "tube": 0.2, "segments": [1000, 500],
              "translate": [2 * (i - 2), 0.8, -1.5], "material": {"base_color": [0.8, 0.2 * i, 0.1]}} for i in range(5)]
    return {"objects": [FLOOR, mirror_ball(), *rings], "environment": SKY}


def textures(folder):
    """24 pictures of 1024 x 1024."""
    tiles = []
    for i in range(24):
        (folder / f"{i}.png").write_bytes(png(1024, 3 + i))
        tiles.append({"name": f"tile {i}", "shape": "box", "size": [0.8, 0.2, 0.8],
                      "translate": [i % 5 - 2, 0, i // 5 - 2], "material": {"texture": f"{i}.png"}})
    return {"objects": [mirror_ball(), *tiles], "environment": SKY}


def lit(folder):
    """An environment of 4096 x 2048."""
    (folder / "sky.hdr").write_bytes(hdr(4096, 2048))
    return {**balls(9), "environment": {"type": "file", "file": "sky.hdr"}}


def own(name, path=None):
    return lambda folder: (REPOSITORY / f"scenes/{name}.json", REPOSITORY / f"paths/{path or name}.json")


def made(make):
    def write(folder):
        (folder / "scene.json").write_text(json.dumps(make(folder)))
        (folder / "path.json").write_text(json.dumps(ORBIT))
        return folder / "scene.json", folder / "path.json"
    return write


def image(width, height, samples):
    return {"width": width, "height": height, "samples": samples}


SMALL = image(320, 240, 2)

# Scene and path, made in a folder, and the size of the frames
SCENES = {
    "cornell_box": (own("cornell_box"), SMALL),
    "nine_spheres": (own("nine_spheres"), SMALL),
    "living_room": (own("living_room", "living_room_a"), SMALL),
    "bathroom": (own("bathroom", "bathroom_a"), image(640, 480, 2)),
    "teapots": (own("teapots"), image(1024, 768, 1)),
    "moving": (own("moving"), {**SMALL, "layers": ["Z", "N", "reflection", "diffuse", "id", "s"], "masks": True}),
    "deforming": (own("deforming"), SMALL),
    "vase_lizard": (own("vase_lizard"), image(640, 480, 2)),
    "glossy_text": (own("glossy_text"), SMALL),
    "normal_mapped": (own("normal_mapped"), SMALL),
    "balls_900": (made(lambda folder: balls(900)), SMALL),
    "five_million": (made(millions), SMALL),
    "textures": (made(textures), SMALL),
    "environment": (made(lit), SMALL),
    "size_4096": (made(lambda folder: balls(9)), image(4096, 4096, 1)),
}
