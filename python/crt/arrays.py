"""NumPy arrays of a scene as files that crt reads: meshes as PLY, textures as PFM or TGA.

Files are read faster than text, and hold the arrays' own numbers.
"""

import collections.abc
import os
import struct

import numpy as np

SMALL = 4096  # Numbers of a mesh that stay in the scene's text, where an error can name their place.


class Arrays:
    """Writes the arrays of a scene's dict below `folder`, and puts the files' names into their places."""

    def __init__(self, folder):
        self.folder = folder
        # By the identity of an array or a mesh, which is written once: itself, so that it stays; its file.
        self.files = {}

    def written(self, value):
        """A copy of `value`, a dict or a part of one, that names files instead of arrays."""
        if isinstance(value, collections.abc.Mapping):
            copy = {key: self.written(inner) for key, inner in value.items()
                    if key not in ("mesh", "texture", "image")}
            if "mesh" in value:
                copy.update(self.mesh(value["mesh"]))
            for key in ("texture", "image"):
                if key in value:
                    copy[key] = self.texture(value[key])
            return copy
        if isinstance(value, (list, tuple)):
            return [self.written(inner) for inner in value]
        return value

    def restored(self, value):
        """The inverse of `written`: a copy of `value` that holds the arrays instead of their files."""
        arrays = {os.fspath(path): array for array, path in self.files.values()}

        def inverse(value):
            if isinstance(value, dict):
                copy = {key: inverse(inner) for key, inner in value.items()}
                if isinstance(copy.get("ply"), collections.abc.Mapping):  # It was the file of this mesh.
                    copy["mesh"] = copy.pop("ply")
                return copy
            if isinstance(value, list):
                return [inverse(inner) for inner in value]
            return arrays.get(value, value) if isinstance(value, str) else value

        return inverse(value)

    def mesh(self, mesh):
        """The keys of an object that stand for its `mesh`."""
        if not isinstance(mesh, collections.abc.Mapping) or "colors" in mesh:
            return {"mesh": mesh}
        arrays = [key for key in ("positions", "faces", "normals", "uvs") if key in mesh]
        numbers = sum(np.size(mesh[key]) for key in arrays if is_array(mesh[key]))
        if set(mesh) != set(arrays) or numbers < SMALL:
            return {"mesh": mesh}
        if id(mesh) not in self.files:
            path = self.folder / f"mesh{len(self.files)}.ply"
            write_ply(path, *(mesh.get(key) for key in ("positions", "faces", "normals", "uvs")))
            self.files[id(mesh)] = (mesh, path)
        return {"ply": os.fspath(self.files[id(mesh)][1])}

    def texture(self, texture):
        """The name of the file that holds `texture`, or `texture` where that is a name already."""
        if not is_array(texture):
            return texture
        if id(texture) not in self.files:
            path = self.folder / f"texture{len(self.files)}{'.tga' if texture.dtype == np.uint8 else '.pfm'}"
            (write_tga if texture.dtype == np.uint8 else write_pfm)(path, texture)
            self.files[id(texture)] = (texture, path)
        return os.fspath(self.files[id(texture)][1])


def plain(value):
    """`value` as numbers, strings, lists and dicts, without NumPy."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, collections.abc.Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value


def is_array(value):
    return isinstance(value, np.ndarray)


def rows(what, values, columns):
    """`values` as an array of shape (n, c) with c in `columns`, finite. Raises ValueError otherwise."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] not in columns or array.dtype.kind not in "iuf":
        wanted = " or ".join(f"(n, {c})" for c in columns)
        raise ValueError(f"{what} of a mesh are numbers of shape {wanted}, not {array.dtype} of "
                         f"{array.shape}")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0, 0])
        raise ValueError(f"{what} of a mesh: row {row} holds {array[row].tolist()}, which is not finite")
    return array


def write_ply(path, positions, faces, normals=None, uvs=None):
    """A binary PLY. `positions` (vertices, 3), `faces` (faces, 3 or 4) of indices of vertices, `normals`
    (vertices, 3), `uvs` (vertices, 2). float32 stays float32, all other numbers are written as float64.
    """
    columns = [("positions", rows("positions", positions, (3,)), ("x", "y", "z"))]
    if normals is not None:
        columns.append(("normals", rows("normals", normals, (3,)), ("nx", "ny", "nz")))
    if uvs is not None:
        columns.append(("uvs", rows("uvs", uvs, (2,)), ("u", "v")))
    faces = rows("faces", faces, (3, 4))
    vertices = len(columns[0][1])
    fields, header = [], ["ply", "format binary_little_endian 1.0", f"element vertex {vertices}"]
    for name, array, axes in columns:
        if len(array) != vertices:
            raise ValueError(f"a mesh has {vertices} positions and {len(array)} {name}")
        single = array.dtype == np.float32
        fields += [(axis, "<f4" if single else "<f8") for axis in axes]
        header += [f"property {'float' if single else 'double'} {axis}" for axis in axes]
    if faces.dtype.kind == "f":
        raise ValueError("faces of a mesh are indices, not floats")
    if faces.size and not (0 <= int(faces.min()) and int(faces.max()) < vertices):
        raise ValueError(f"a face of a mesh uses a vertex that is not among its {vertices}")
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]

    table = np.empty(vertices, fields)
    for _, array, axes in columns:
        for k, axis in enumerate(axes):
            table[axis] = array[:, k]
    corners = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", (faces.shape[1],))])
    corners["count"] = faces.shape[1]
    corners["corners"] = faces
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        file.write(table.tobytes())
        file.write(corners.tobytes())


def write_pfm(path, texture):
    """Floats, linear: `texture` of shape (height, width) or (height, width, 3), top row first."""
    array = np.asarray(texture)
    fits = array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 3)
    if array.dtype.kind not in "iuf" or not fits:
        raise ValueError("a texture is numbers of shape (height, width) or (height, width, 3), not "
                         f"{array.dtype} of {array.shape}")
    kind = "PF" if array.ndim == 3 else "Pf"
    with open(path, "wb") as file:
        file.write(f"{kind}\n{array.shape[1]} {array.shape[0]}\n-1.0\n".encode())
        file.write(array[::-1].astype("<f4").tobytes())


def write_tga(path, texture):
    """8 bits, sRGB as image files are: `texture` of shape (height, width), (height, width, 3) or, with
    alpha, (height, width, 4), top row first."""
    array = np.asarray(texture)
    channels = 1 if array.ndim == 2 else array.shape[-1]
    if array.ndim not in (2, 3) or (array.ndim == 3 and channels not in (3, 4)):
        raise ValueError("a texture of 8 bits has the shape (height, width), (height, width, 3) or "
                         f"(height, width, 4), not {array.shape}")
    height, width = array.shape[:2]
    if max(height, width) > 65535:
        raise ValueError(f"a texture of 8 bits has at most 65535 pixels a side, not {width} x {height}")
    from_top = 0x20
    header = struct.pack("<BBBHHBHHHHBB", 0, 0, 3 if channels == 1 else 2, 0, 0, 0, 0, 0, width, height,
                         8 * channels, from_top | (8 if channels == 4 else 0))
    order = {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]
    with open(path, "wb") as file:
        file.write(header)
        file.write(np.ascontiguousarray(array.reshape(height, width, channels)[:, :, order]).tobytes())
