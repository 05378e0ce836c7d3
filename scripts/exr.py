"""Reads and writes OpenEXR scanline files with Python's standard library alone: small frames of tests and
comparisons. Compressions none, zips and zip, which catoptric writes; anything else is refused."""
import struct
import zlib

TYPES = {0: ("I", 4), 1: ("e", 2), 2: ("f", 4)}  # uint, half, float: format of struct, bytes
LINES = {0: 1, 2: 1, 3: 16}  # scanlines of a block, by compression


class Image:
    """Channels by name, each the raw bytes of its rows from the top and the number of its type."""

    def __init__(self, width, height, channels):
        self.width, self.height, self.channels = width, height, channels

    def values(self, name):
        kind, data = self.channels[name]
        return struct.unpack(f"<{self.width * self.height}{TYPES[kind][0]}", data)


def text_at(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def header_of(data):
    """(attributes, where the offset table starts)."""
    if data[:4] != b"\x76\x2f\x31\x01" or struct.unpack_from("<I", data, 4)[0] & 0x1a00:
        raise ValueError("not a scanline file of a single part")
    attributes, at = {}, 8
    while data[at]:
        name, at = text_at(data, at)
        _, at = text_at(data, at)
        size = struct.unpack_from("<I", data, at)[0]
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def channels_of(listed):
    """[(name, type)] in the file's order."""
    found, at = [], 0
    while listed[at]:
        name, at = text_at(listed, at)
        kind, _, x, y = struct.unpack_from("<IIII", listed, at)
        if (x, y) != (1, 1):
            raise ValueError(f"{name} is subsampled")
        found.append((name, kind))
        at += 16
    return found


def unpacked(block, size):
    """A zip block's bytes: deltas summed, halves interleaved."""
    if len(block) == size:
        return block
    deltas = bytearray(zlib.decompress(block))
    for i in range(1, len(deltas)):
        deltas[i] = (deltas[i - 1] + deltas[i] - 128) & 255
    half = (len(deltas) + 1) // 2
    joined = bytearray(len(deltas))
    joined[0::2], joined[1::2] = deltas[:half], deltas[half:]
    return bytes(joined)


def packed(raw):
    halves = raw[0::2] + raw[1::2]
    deltas = bytearray(halves)
    for i in range(len(halves) - 1, 0, -1):
        deltas[i] = (halves[i] - halves[i - 1] + 128) & 255
    block = zlib.compress(bytes(deltas), 9)
    return block if len(block) < len(raw) else raw


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    attributes, at = header_of(data)
    compression = attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"{path}: compression {compression} is not read here")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels = channels_of(attributes["channels"])
    rows = {name: [b""] * height for name, _ in channels}
    row_bytes = sum(TYPES[kind][1] for _, kind in channels) * width
    blocks = -(-height // LINES[compression])
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<iI", data, offset)
        lines = min(LINES[compression], bottom + 1 - y)
        block, start = unpacked(data[offset + 8:offset + 8 + size], row_bytes * lines), 0
        for line in range(y - top, y - top + lines):
            for name, kind in channels:
                end = start + TYPES[kind][1] * width
                rows[name][line] = block[start:end]
                start = end
    return Image(width, height, {name: (kind, b"".join(rows[name])) for name, kind in channels})


def write(path, image):
    """Zip-compressed, with the fewest attributes that a file has."""
    names = sorted(image.channels)
    listed = b"".join(n.encode() + struct.pack("<xIIII", image.channels[n][0], 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, image.width - 1, image.height - 1)
    attributes = [("channels", "chlist", listed), ("compression", "compression", b"\3"),
                  ("dataWindow", "box2i", window), ("displayWindow", "box2i", window),
                  ("lineOrder", "lineOrder", b"\0"), ("pixelAspectRatio", "float", struct.pack("<f", 1)),
                  ("screenWindowCenter", "v2f", bytes(8)), ("screenWindowWidth", "float", struct.pack("<f", 1))]
    head = b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join(
        f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value for name, kind, value in attributes) + b"\0"
    blocks = []
    for y in range(0, image.height, LINES[3]):
        raw = b""
        for line in range(y, min(y + LINES[3], image.height)):
            for name in names:
                kind, data = image.channels[name]
                row = TYPES[kind][1] * image.width
                raw += data[row * line:row * (line + 1)]
        block = packed(raw)
        blocks.append(struct.pack("<iI", y, len(block)) + block)
    offset, table = len(head) + 8 * len(blocks), b""
    for block in blocks:
        table += struct.pack("<Q", offset)
        offset += len(block)
    with open(path, "wb") as file:
        file.write(head + table + b"".join(blocks))
