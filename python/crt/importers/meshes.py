"""Files of meshes that crt does not read as they are: PLY to be turned inside out, PLY within gzip, and
Mitsuba's serialized meshes."""

import struct
import zlib

import numpy as np

TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
         "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
         "float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
UVS = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))


class Damaged(Exception):
    """A file is not what it should be."""


# Limits of the unpacked size of a packed file. Real meshes and scenes expand 3 to 30 times.
UNPACKED_LEAST, UNPACKED_RATIO = 64_000_000, 200


def read_bytes(path):
    """The file's contents, unpacked where it is a gzip file. Raises OSError or Damaged."""
    if not path.is_file():
        raise Damaged("it is no file")
    data = path.read_bytes()
    if data[:2] != b"\x1f\x8b":
        return data
    made, most = [], UNPACKED_LEAST + UNPACKED_RATIO * len(data)
    while data:  # A gzip file may have several members, and zeros behind them.
        part, data = unpacked(data, 16 + zlib.MAX_WBITS, most)
        made.append(part)
        most -= len(part)
        data = data.lstrip(b"\0")
    return b"".join(made)


def unpacked(data, form, most=None):
    """One stream of zlib's (`form` as zlib.decompressobj has it), and what is behind it. Raises Damaged."""
    if most is None:
        most = UNPACKED_LEAST + UNPACKED_RATIO * len(data)
    stream = zlib.decompressobj(form)
    try:
        made = stream.decompress(data, most + 1)
    except zlib.error as error:
        raise Damaged(f"the packed file is damaged: {error}") from None
    if len(made) > most:
        raise Damaged(f"unpacked it is more than {most / 1e6:.0f} MB, {UNPACKED_RATIO} times its size")
    if not stream.eof:
        raise Damaged("the packed file is incomplete: its end is missing")
    return made, stream.unused_data


def ply_header(data):
    """The format, the elements as (name, count, [(property, type, type of counts or None)]), and where the
    header ends."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise Damaged("it is not a PLY file")
    kind, elements = None, []
    try:
        for line in data[:end].decode("latin-1").splitlines()[1:]:
            words = line.split()
            if words[:1] == ["format"]:
                kind = words[1]
            elif words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1][2].append((words[4], TYPES[words[3]], TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1][2].append((words[2], TYPES[words[1]], None))
    except (KeyError, IndexError, ValueError):
        raise Damaged(f"its header has an invalid line: {line.strip()!r}") from None
    if kind not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise Damaged(f"its format is '{kind}'")
    return kind, elements, data.index(b"\n", end) + 1


def ply_vertex(path):
    """The names of a vertex's properties by the header. None of what is no PLY: crt will say so."""
    with open(path, "rb") as file:
        head = file.read(65536).partition(b"end_header")[0]
    names = set()
    for line in head.partition(b"element vertex")[2].partition(b"element")[0].splitlines():
        words = line.split()
        if len(words) == 3 and words[0] == b"property":
            names.add(words[2].decode("latin-1"))
    return names


def read_ply(path):
    """A mesh as a dict of arrays: positions, faces (triangles), and normals and uvs where there are any.
    Raises OSError or Damaged."""
    data = read_bytes(path)
    kind, elements, offset = ply_header(data)
    words = iter(data[offset:].split()) if kind == "ascii" else None
    order = ">" if kind == "binary_big_endian" else "<"
    found = {}
    try:
        for name, count, properties in elements:
            if not 0 <= count <= len(data):
                raise Damaged(f"it is too short for {count} of '{name}'")
            if any(counts for _, _, counts in properties):
                rows, offset = lists(data, offset, words, order, count, properties)
            elif words is not None:
                rows = np.array([[float(next(words)) for _ in properties] for _ in range(count)])
                rows = {inner[0]: rows.reshape(count, -1)[:, k] for k, inner in enumerate(properties)}
            else:
                row = np.dtype([(inner, order + form) for inner, form, _ in properties])
                rows = np.frombuffer(data, row, count, offset)
                offset += row.itemsize * count
                rows = {inner: rows[inner] for inner, _, _ in properties}
            found[name] = rows
        return mesh_of(found)
    except (StopIteration, ValueError, struct.error, KeyError):
        raise Damaged("it ends too early, or has something other than numbers") from None


def lists(data, offset, words, order, count, properties):
    """The rows of an element with lists: by name, lists of numbers."""
    rows = {name: [] for name, _, _ in properties}
    if words is None and len(properties) == 1 and count:
        name, form, counts = properties[0]
        size = length(np.frombuffer(data, order + counts, 1, offset)[0])
        row = np.dtype([("size", order + counts), ("values", order + form, (size,))])
        if offset + row.itemsize * count <= len(data):
            table = np.frombuffer(data, row, count, offset)
            if (table["size"] == size).all():
                return {name: table["values"]}, offset + row.itemsize * count
    for _ in range(count):
        for name, form, counts in properties:
            if words is not None:
                size = length(next(words)) if counts else 1
                rows[name].append([float(next(words)) for _ in range(size)])
                continue
            size = 1
            if counts:
                size = length(np.frombuffer(data, order + counts, 1, offset)[0])
                offset += np.dtype(counts).itemsize
            rows[name].append(np.frombuffer(data, order + form, size, offset).tolist())
            offset += np.dtype(form).itemsize * size
    return rows, offset


def length(number):
    """Of a list. Raises Damaged where it is below 0."""
    size = int(number)
    if size < 0:
        raise Damaged(f"a list has {size} values")
    return size


def fans(polygons):
    """Triangles of convex polygons."""
    if isinstance(polygons, np.ndarray):
        corners = [polygons[:, [0, k, k + 1]] for k in range(1, polygons.shape[1] - 1)]
        return np.stack(corners, 1).reshape(-1, 3).astype(np.int64)
    made = [[p[0], p[k], p[k + 1]] for p in polygons for k in range(1, len(p) - 1)]
    return np.array(made, np.int64).reshape(-1, 3)


def faced(mesh):
    """Faces that their normals see from behind are turned, where normals say what the outside is."""
    if "normals" not in mesh:
        return mesh
    corners = mesh["positions"][mesh["faces"]].astype(float)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    behind = (across * mesh["normals"][mesh["faces"]].astype(float).sum(1)).sum(1) < 0
    if not behind.any():
        return mesh
    faces = mesh["faces"].copy()
    faces[behind] = faces[behind][:, ::-1]
    return mesh | {"faces": faces}


def mesh_of(elements):
    vertices, faces = elements["vertex"], elements["face"]
    polygons = faces.get("vertex_indices", faces.get("vertex_index"))
    made = {"positions": np.stack([vertices[axis] for axis in "xyz"], -1), "faces": fans(polygons)}
    if all(axis in vertices for axis in ("nx", "ny", "nz")):
        made["normals"] = np.stack([vertices[axis] for axis in ("nx", "ny", "nz")], -1)
    for names in UVS:
        if all(axis in vertices for axis in names):
            made["uvs"] = np.stack([vertices[axis] for axis in names], -1)
    return checked(made)


def checked(mesh):
    """In types that crt's PLY has; refused where a face names no vertex or a number is not finite."""
    for key in ("positions", "normals", "uvs"):
        if key in mesh:
            single = mesh[key].dtype.itemsize == 4
            mesh[key] = np.ascontiguousarray(mesh[key], np.float32 if single else np.float64)
            if not np.isfinite(mesh[key]).all():
                raise Damaged(f"a number of its {key} is not finite")
    faces, vertices = mesh["faces"], len(mesh["positions"])
    if len(faces) and not 0 <= int(faces.min()) <= int(faces.max()) < vertices:
        raise Damaged(f"a face uses a vertex that is not among its {vertices}")
    if not len(faces):
        raise Damaged("it has no faces")
    return mesh


def read_obj(path):
    """A mesh as read_ply gives it. Faces without normals, where others have some, get those of the plane."""
    rows, corners = {b"v": [], b"vt": [], b"vn": []}, []
    try:
        for line in path.read_bytes().replace(b"\\\n", b" ").splitlines():
            word, *rest = line.split() or [b""]
            if word in rows:
                rows[word].append([float(number) for number in rest[:2 if word == b"vt" else 3]])
            elif word == b"f":
                found = [indices(corner, rows) for corner in rest]
                corners += [found[k] for i in range(1, len(found) - 1) for k in (0, i, i + 1)]
    except (ValueError, IndexError):
        raise Damaged(f"it has an invalid line: {line[:60].decode('latin-1')!r}") from None
    if not corners:
        raise Damaged("it has no faces")
    unique, faces = np.unique(np.array(corners), axis=0, return_inverse=True)
    made = {"faces": faces.reshape(-1, 3)}
    for column, (key, word) in enumerate((("positions", b"v"), ("uvs", b"vt"), ("normals", b"vn"))):
        if key == "positions" or (len(rows[word]) and (unique[:, column] >= 0).all()):
            table = np.array(rows[word], float)
            if unique[:, column].max() >= len(table) or unique[:, column].min() < 0:
                raise Damaged(f"a face uses a '{word.decode()}' that is not among its {len(table)}")
            made[key] = table[unique[:, column]]
    return checked(made)


def indices(corner, rows):
    """v/vt/vn as three numbers from 0; -1 where there is none."""
    made = []
    for word, number in zip((b"v", b"vt", b"vn"), (corner.split(b"/") + [b"", b""])[:3]):
        index = int(number) if number else 0
        made.append(index - 1 if index > 0 else len(rows[word]) + index if index < 0 else -1)
    return made


def read_serialized(path, index):
    """Mesh number `index` of a file of Mitsuba's serialized meshes (versions 3 and 4), and whether it says
    that its faces are flat. Raises OSError or Damaged."""
    data = read_bytes(path)
    try:
        mark, version = struct.unpack_from("<HH", data)
        count, = struct.unpack_from("<I", data, len(data) - 4)
        if mark != 0x041C or version not in (3, 4):
            raise Damaged(f"it is no serialized mesh of version 3 or 4 (0x{mark:04x}, {version})")
        if not 0 <= index < count:
            raise Damaged(f"it has {count} meshes, none with the number {index}")
        form = "<Q" if version == 4 else "<I"
        size = struct.calcsize(form)
        start, = struct.unpack_from(form, data, len(data) - 4 - size * (count - index))
        return serialized_mesh(unpacked(data[start + 4:], zlib.MAX_WBITS)[0], version)
    except (struct.error, zlib.error, ValueError) as error:
        raise Damaged(f"it is damaged: {error}") from None


def serialized_mesh(data, version):
    flags, = struct.unpack_from("<I", data)
    offset = 4
    if version == 4:
        offset = data.index(b"\0", offset) + 1
    vertices, triangles = struct.unpack_from("<QQ", data, offset)
    offset += 16
    number = np.dtype("<f8" if flags & 0x2000 else "<f4")
    if vertices * number.itemsize * 3 > len(data) or triangles * 12 > len(data):
        raise Damaged(f"it is too short for {vertices} vertices and {triangles} triangles")

    def take(columns, form=number, rows=vertices):
        nonlocal offset
        made = np.frombuffer(data, form, rows * columns, offset).reshape(rows, columns)
        offset += made.nbytes
        return made
    mesh = {"positions": take(3)}
    if flags & 0x1:
        mesh["normals"] = take(3)
    if flags & 0x2:
        mesh["uvs"] = take(2)
    if flags & 0x8:
        take(3)
    mesh["faces"] = take(3, np.dtype("<u4"), triangles).astype(np.int64)
    return checked(mesh), bool(flags & 0x10)
