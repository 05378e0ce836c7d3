"""Reading the .glb files that assimp exports, writing lean ones. Standard library only."""

import array
import json
import math
import os
import struct


def read_glb(path):
    with open(path, "rb") as stream:
        data = stream.read()
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    start = 20 + length + 8
    return document, data[start:]


def accessor_values(document, binary, index):
    """Flat array of an accessor's components (float32 or uint), without sparse."""
    accessor = document["accessors"][index]
    components = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    code = {5126: "f", 5125: "I", 5123: "H", 5121: "B"}[accessor["componentType"]]
    size = struct.calcsize(code)
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", 0)
    count = accessor["count"]
    if stride in (0, components * size):
        values = array.array(code)
        values.frombytes(binary[start : start + count * components * size])
        return values
    values = array.array(code)
    for i in range(count):
        values.frombytes(binary[start + i * stride : start + i * stride + components * size])
    return values


def multiply(a, b):
    """Column-major 4x4 product."""
    return [sum(a[k * 4 + r] * b[c * 4 + k] for k in range(4)) for c in range(4) for r in range(4)]


IDENTITY = [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0]


def read_triangles(document, binary):
    """One dict per primitive: material index, positions, normals or None, uvs or None, indices."""
    primitives = []

    def visit(index, parent):
        node = document["nodes"][index]
        matrix = multiply(parent, node["matrix"]) if "matrix" in node else parent
        if "mesh" in node:
            for primitive in document["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", 4) != 4:
                    continue
                attributes = primitive["attributes"]
                item = {"material": primitive.get("material", 0), "matrix": matrix}
                item["positions"] = accessor_values(document, binary, attributes["POSITION"])
                for key, name in (("normals", "NORMAL"), ("uvs", "TEXCOORD_0")):
                    item[key] = (accessor_values(document, binary, attributes[name]) if name in attributes else None)
                item["indices"] = accessor_values(document, binary, primitive["indices"])
                primitives.append(item)
        for child in node.get("children", []):
            visit(child, matrix)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, IDENTITY)
    return primitives


class GlbWriter:
    def __init__(self, copyright_text):
        self.document = {
            "asset": {"version": "2.0", "generator": "catoptric scripts/prepare_assets",
                      "copyright": copyright_text},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [],
            "images": [], "textures": [], "samplers": [],
        }
        self.binary = bytearray()
        self.images = {}

    def view(self, data, target=None):
        while len(self.binary) % 4:
            self.binary.append(0)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target:
            view["target"] = target
        self.binary += data
        self.document["bufferViews"].append(view)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, data, component, kind, count, target, **more):
        self.document["accessors"].append(
            {"bufferView": self.view(data, target), "componentType": component, "type": kind,
             "count": count, **more})
        return len(self.document["accessors"]) - 1

    def texture(self, path, data, mime):
        """Number of the texture of the image `data`, stored once per `path`."""
        if path not in self.images:
            self.document["images"].append({"bufferView": self.view(data), "mimeType": mime})
            self.document["samplers"] = [{"magFilter": 9729, "minFilter": 9987}]
            self.document["textures"].append({"source": len(self.document["images"]) - 1, "sampler": 0})
            self.images[path] = len(self.document["textures"]) - 1
        return self.images[path]

    def part(self, name, corners, indices, texture, alpha):
        """`corners`: (position, normal, uv, colour) per vertex."""
        positions, normals, uvs, colours = (array.array(c) for c in "fffH")
        lower, upper = [math.inf] * 3, [-math.inf] * 3
        several = len({corner[3] for corner in corners}) > 1
        for position, normal, uv, colour in corners:
            positions.extend(position)
            normals.extend(normal)
            uvs.extend(uv)
            if several:
                colours.extend([min(65535, max(0, round(c * 65535))) for c in colour])
                colours.append(65535)
        count = len(corners)
        for k in range(3):
            lower[k], upper[k] = min(positions[k::3]), max(positions[k::3])
        attributes = {
            "POSITION": self.accessor(positions.tobytes(), 5126, "VEC3", count, 34962,
                                      min=lower, max=upper),
            "NORMAL": self.accessor(normals.tobytes(), 5126, "VEC3", count, 34962),
        }
        pbr = {"metallicFactor": 0, "roughnessFactor": 1}
        material = {"name": name, "pbrMetallicRoughness": pbr}
        if texture is not None:
            attributes["TEXCOORD_0"] = self.accessor(uvs.tobytes(), 5126, "VEC2", count, 34962)
            pbr["baseColorTexture"] = {"index": texture}
            if alpha:
                material["alphaMode"], material["alphaCutoff"] = "MASK", 0.5
        if several:
            attributes["COLOR_0"] = self.accessor(colours.tobytes(), 5123, "VEC4", count, 34962, normalized=True)
        else:
            pbr["baseColorFactor"] = [min(1.0, c) for c in corners[0][3]] + [1]
        code, component = ("H", 5123) if count < 65535 else ("I", 5125)
        index = self.accessor(array.array(code, indices).tobytes(), component, "SCALAR", len(indices), 34963)
        self.document["materials"].append(material)
        self.document["meshes"].append({"name": name, "primitives": [
            {"attributes": attributes, "indices": index, "mode": 4,
             "material": len(self.document["materials"]) - 1}]})
        self.document["nodes"].append({"name": name, "mesh": len(self.document["meshes"]) - 1})
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]) - 1)

    def write(self, path):
        for key in ("images", "textures", "samplers"):
            if not self.document[key]:
                del self.document[key]
        while len(self.binary) % 4:
            self.binary.append(0)
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.binary)
        with open(path + ".tmp", "wb") as stream:
            stream.write(struct.pack("<III", 0x46546C67, 2, total))
            stream.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            stream.write(struct.pack("<II", len(self.binary), 0x004E4942) + self.binary)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(path + ".tmp", path)
