"""Pictures for notebooks."""

import struct
import zlib

import numpy as np


def srgb8(linear):
    """Linear values as 8 bits of sRGB (IEC 61966-2-1), clipped to [0, 1]."""
    x = np.nan_to_num(np.clip(linear, 0, 1))
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)
    return np.rint(255 * encoded).astype(np.uint8)


SIGNATURE = b"\x89PNG\r\n\x1a\n"


def png(linear, words=None):
    """The bytes of a PNG of (height, width, 3) linear values. `words` is a dict of texts that it carries, in
    Latin-1."""
    pixels = srgb8(linear)
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    said = b"".join(chunk(b"tEXt", f"{key}\0{value}".encode("latin-1"))
                    for key, value in (words or {}).items())
    return (SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + said
            + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))


def texts(data):
    """The texts (tEXt) in the bytes of a PNG, a dict. Raises ValueError for what is no PNG."""
    if not data.startswith(SIGNATURE):
        raise ValueError("no PNG")
    found, at = {}, len(SIGNATURE)
    while at + 8 <= len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        if data[at + 4:at + 8] == b"tEXt":
            key, _, value = data[at + 8:at + 8 + size].partition(b"\0")
            found[key.decode("latin-1")] = value.decode("latin-1")
        at += size + 12
    return found
