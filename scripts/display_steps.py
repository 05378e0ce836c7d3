"""Differences of frames in display steps, fast: for the papers' tables with hundreds of frames."""
import struct

import numpy

BYTES = {0: 4, 1: 2, 2: 4}  # of a channel's value: uint, half, float


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


def steps_of_halves():
    """By bits of a half: its display value, rounded sRGB steps 0 to 255."""
    value = numpy.arange(65536, dtype=numpy.uint16).view(numpy.float16).astype(numpy.float64)
    value = numpy.clip(numpy.nan_to_num(value, nan=0.0), 0, 1)
    value = numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return numpy.floor(255 * value + 0.5).astype(numpy.int16)


STEPS = steps_of_halves()


def display(file):
    """R, G, B of an uncompressed EXR file, which it has as halves, in display steps."""
    data = file.read_bytes()
    attributes, start = header_of(data)
    channels = channels_of(attributes["channels"])
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    if attributes["compression"] != b"\0" or any(kind != 1 for name, kind in channels if name in ("R", "G", "B")):
        raise SystemExit(f"paper_tables: {file}: compressed, or its colours are no halves")
    begins, at = {}, 8  # of a line: its number and size first
    for name, kind in channels:
        begins[name] = at
        at += width * BYTES[kind]
    lines = numpy.frombuffer(data, dtype=numpy.uint8, offset=start + 8 * height).reshape(height, at)
    halves = [lines[:, begins[c]:begins[c] + 2 * width].copy().view(numpy.uint16) for c in "RGB"]
    return STEPS[numpy.stack(halves)]


def l1(a, b):
    """L1_8bit of two frames, as `catoptric compare` has it."""
    return float(abs(a - b).mean())
