"""Pictures for notebooks."""

import struct
import zlib

import numpy as np


def srgb8(linear):
    """Linear values as 8 bits of sRGB (IEC 61966-2-1), clipped to [0, 1]."""
    x = np.nan_to_num(np.clip(linear, 0, 1))
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)
    return np.rint(255 * encoded).astype(np.uint8)


def png(linear):
    """The bytes of a PNG of (height, width, 3) linear values."""
    pixels = srgb8(linear)
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))
