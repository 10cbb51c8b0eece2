"""Reads the headers of EXR and PNG files without any image library."""

import struct
import zlib


def exr_header(path):
    """Attributes of a single-part OpenEXR file: name -> (type, value), values unpacked where the type is a
    simple one."""
    with open(path, "rb") as file:
        data = file.read(1 << 16)
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError(f"{path} is no EXR file")
    formats = {
        "box2i": "<4i",
        "v2f": "<2f",
        "float": "<f",
        "int": "<i",
        "m44f": "<16f",
        "chromaticities": "<8f",
    }
    at, header = 8, {}
    while data[at] != 0:
        name, kind, rest = data[at:].split(b"\0", 2)[0], data[at:].split(b"\0", 2)[1], None
        at += len(name) + len(kind) + 2
        size = struct.unpack_from("<i", data, at)[0]
        rest = data[at + 4:at + 4 + size]
        at += 4 + size
        kind = kind.decode()
        if kind in formats:
            value = struct.unpack(formats[kind], rest)
            value = value[0] if len(value) == 1 else value
        else:
            value = rest.decode(errors="replace") if kind == "string" else rest
        header[name.decode()] = (kind, value)
    return header


def png_chunks(path):
    """Type and data of every chunk of a PNG file, their checksums proven."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path} is no PNG file")
    at, chunks = 8, []
    while at < len(data):
        size, = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        if zlib.crc32(kind + body) != struct.unpack_from(">I", data, at + 8 + size)[0]:
            raise ValueError(f"{path} has a damaged chunk {kind}")
        chunks.append((kind.decode(), body))
        at += 12 + size
    return chunks


def png_pixels(path):
    """Rows of bytes of a PNG of 8 bits a channel, red, green and blue, not interlaced."""
    chunks = png_chunks(path)
    width, height, *kind = struct.unpack(">IIBBBBB", chunks[0][1])
    if kind != [8, 2, 0, 0, 0]:
        raise ValueError(f"{path} is another kind of PNG: {kind}")
    data = zlib.decompress(b"".join(body for kind, body in chunks if kind == "IDAT"))
    size, rows = 3 * width, [bytes(3 * width)]
    for at in range(0, height * (size + 1), size + 1):
        rows.append(png_row(data[at], data[at + 1:at + 1 + size], rows[-1], 3))
    return rows[1:]


def png_row(kind, row, above, channels):
    """A row of bytes with its filter undone (PNG specification, 9.2)."""
    out = bytearray(row)
    for i in range(len(out)):
        a, b = (out[i - channels] if i >= channels else 0), above[i]
        c = above[i - channels] if i >= channels else 0
        nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
        out[i] = (out[i] + (0, a, b, (a + b) // 2, nearest)[kind]) & 255
    return bytes(out)


def png_texts(path):
    """Keyword -> text of the tEXt, zTXt and iTXt chunks."""
    texts = {}
    for kind, body in png_chunks(path):
        if kind == "tEXt":
            keyword, text = body.split(b"\0", 1)
            texts[keyword.decode("latin-1")] = text.decode("latin-1")
        elif kind == "zTXt":
            keyword, text = body.split(b"\0", 1)
            texts[keyword.decode("latin-1")] = zlib.decompress(text[1:]).decode("latin-1")
        elif kind == "iTXt":
            keyword, rest = body.split(b"\0", 1)
            compressed, text = rest[0], rest[2:].split(b"\0", 2)[2]
            texts[keyword.decode("latin-1")] = (zlib.decompress(text) if compressed else text).decode()
    return texts
