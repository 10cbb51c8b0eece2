"""A PPM of crt as a smaller PNG, by Python's standard library: where the program that rendered it came
without the library for PNG, nothing else is there."""

import struct
import zlib

from .program import Failure


def to_linear(code):
    value = code / 255
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def to_code(value):
    return round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * value ** (5 / 12) - 0.055))


def smaller(ppm, most):
    """(width, height, bytes of RGB) of a P6 file, with at most `most` pixels a side: means of whole blocks
    of pixels, in linear light."""
    fields = ppm.split(None, 4)
    if len(fields) < 4 or fields[0] != b"P6" or fields[3] != b"255":
        raise Failure("a picture is no PPM of 8 bits, which crt writes")
    width, height = int(fields[1]), int(fields[2])
    pixels = ppm[len(ppm) - 3 * width * height:]
    block = max(1, -(-max(width, height) // most))
    linear = [to_linear(code) for code in range(256)]
    codes = [to_code(k / 4095) for k in range(4096)]
    across, down = width // block, height // block
    out = bytearray()
    for row in range(down):
        sums = [0.0] * (3 * across)
        for y in range(row * block, (row + 1) * block):
            line = [linear[code] for code in pixels[3 * width * y:3 * width * (y + 1)]]
            for channel in range(3):
                values = line[channel::3]
                for x in range(across):
                    sums[3 * x + channel] += sum(values[x * block:(x + 1) * block])
        out += bytes(codes[round(4095 * s / block**2)] for s in sums)
    return across, down, bytes(out)


def write_png(path, width, height, pixels):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    lines = bytearray()
    for y in range(height):
        line = pixels[3 * width * y:3 * width * (y + 1)]
        # Filter 1: the difference from the pixel to the left.
        lines += b"\1" + bytes((a - b) & 255 for a, b in zip(line, b"\0\0\0" + line))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"sRGB", b"\0")
        + chunk(b"IDAT", zlib.compress(bytes(lines), 9))
        + chunk(b"IEND", b"")
    )
