"""Shapes of pbrt as geometry of crt."""

import math

import numpy as np

from . import matrices, shapes
from .draft import ball, meshed, plate, tube
from .losses import present, refuse, suggestion
from .meshes import Damaged, faced, ply_header, read_bytes, read_ply

CORNERS = np.array([[0, 0], [1, 0], [1, 1]], np.float32)  # Texture coordinates of a triangle without any.


def with_corners(mesh):
    """The mesh with the texture coordinates that pbrt gives to triangles without any."""
    if "uvs" in mesh:
        return mesh
    flat = mesh["faces"].reshape(-1)
    made = {key: mesh[key][flat] for key in ("positions", "normals") if key in mesh}
    return made | {"faces": np.arange(len(flat)).reshape(-1, 3),
                   "uvs": np.tile(CORNERS, (len(flat) // 3, 1))}


class Shapes:
    def __init__(self, state, losses):
        self.state, self.losses = state, losses

    def geometry(self, found, reverse, stretched, *, sided, textured):
        """The keys of an object; None for what crt has not. `sided`: it matters which side is outside."""
        make = getattr(self, "of_" + found.name, None)
        if make is None:
            known = [name[3:] for name in dir(self) if name.startswith("of_")]
            self.losses.add(found.place, f"{found}{suggestion(found.name, known)}", large=True)
            found.left.clear()
            return None
        return make(found, reverse, stretched, sided, textured)

    def area(self, found, geometry, matrix):
        """In the world, of one placement."""
        if "sphere" in geometry:
            ball_of = geometry["sphere"]
            radius = ball_of["radius"]
            height = ball_of.get("to_z", radius) - ball_of.get("from_z", -radius)
            return 2 * math.pi * radius * height * matrices.uniform_scale(matrix) ** 2
        if "disk" in geometry:
            return math.pi * geometry["disk"]["radius"] ** 2 * matrices.uniform_scale(matrix) ** 2
        if "cylinder" in geometry:
            tube_of = geometry["cylinder"]
            length = tube_of["to_z"] - tube_of["from_z"]
            return 2 * math.pi * tube_of["radius"] * length * matrices.uniform_scale(matrix) ** 2
        mesh = geometry["mesh"] if "mesh" in geometry else self.ply(found, geometry["ply"])
        return shapes.area(mesh, matrix)

    def angle(self, found):
        return min(max(found.number("phimax", 360), 0.1), 360)

    def of_sphere(self, found, reverse, stretched, sided, textured):
        radius = self.above_zero(found, "radius", 1)
        low, high = sorted((found.number("zmin", -radius), found.number("zmax", radius)))
        low, high = max(low / radius, -1), min(high / radius, 1)
        if low >= high:
            refuse(found.place, "a sphere whose range from 'zmin' to 'zmax' is empty")
        return ball(radius, stretched, flip=reverse, low=low, high=high, phi_max=self.angle(found))

    def of_cylinder(self, found, reverse, stretched, sided, textured):
        radius = self.above_zero(found, "radius", 1)
        low, high = sorted((found.number("zmin", -1), found.number("zmax", 1)))
        if low == high:
            refuse(found.place, "a cylinder has a height above 0")
        return tube(radius, low, high, stretched, flip=reverse, phi_max=self.angle(found))

    def of_disk(self, found, reverse, stretched, sided, textured):
        radius, inner = self.above_zero(found, "radius", 1), max(found.number("innerradius", 0), 0)
        if inner >= radius:
            refuse(found.place, "the inner radius of a disk is below its radius")
        return plate(radius, stretched or textured, flip=reverse, inner=inner, phi_max=self.angle(found),
                     height=found.number("height", 0))

    def above_zero(self, found, name, default):
        made = found.number(name, default)
        if not made > 0:
            refuse(found.place, f"'{name}' of {found} is above 0, not {made:g}")
        return made

    def arrays(self, found, corners):
        """positions, faces of `corners` corners, and normals and uvs where there are any."""
        positions = found.array("P", 3)
        if positions is None or len(positions) < 3:
            refuse(found.place, f"{found} has no vertices 'P'")
        indices = found.array("indices")
        if indices is None:
            if len(positions) != corners:
                refuse(found.place, f"{found} has no 'indices'")
            indices = np.arange(corners)
        if len(indices) % corners or np.any(indices != np.floor(indices)):
            refuse(found.values["indices"][2], f"'indices' are whole numbers, {corners} a face, not "
                                               f"{len(indices)}")
        if len(indices) and not 0 <= indices.min() <= indices.max() < len(positions):
            refuse(found.values["indices"][2], f"an index is not among the {len(positions)} vertices")
        if not len(indices):
            return None
        made = {"positions": positions.astype(np.float32),
                "faces": indices.astype(np.int64).reshape(-1, corners)}
        for key, names, columns in (("normals", ("N",), 3), ("uvs", ("uv", "st"), 2)):
            array = next((found.array(name, columns) for name in names if found.has(name)), None)
            if array is not None and len(array) != len(positions):
                self.losses.add(found.place, f"{key} whose number is not that of vertices")
            elif array is not None:
                made[key] = array.astype(np.float32)
        for name in ("S", "faceIndices", "T"):
            found.left.discard(name)
        return made

    def of_trianglemesh(self, found, reverse, stretched, sided, textured):
        mesh = self.arrays(found, 3)
        if mesh is None:
            self.losses.add(found.place, "a mesh without faces")
            return None
        mesh = faced(mesh)
        return meshed(with_corners(mesh) if textured else mesh, reverse)

    def of_bilinearmesh(self, found, reverse, stretched, sided, textured):
        mesh = self.arrays(found, 4)
        if mesh is None:
            self.losses.add(found.place, "a mesh without faces")
            return None
        found.left.discard("emissionfilename")
        faces = mesh["faces"][:, [0, 1, 3, 2]]
        corners = mesh["positions"][faces].astype(float)
        first, last = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
        bent = np.abs((np.cross(first, last) * (corners[:, 2] - corners[:, 0])).sum(1))
        size = np.linalg.norm(corners.max(1) - corners.min(1), axis=1)
        if np.any(bent > 1e-4 * size**3):
            self.losses.add(found.place, "bent patches", "two triangles each")
        if "uvs" not in mesh and textured:
            flat = faces.reshape(-1)
            mesh = {key: mesh[key][flat] for key in ("positions", "normals") if key in mesh}
            mesh["uvs"] = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (len(faces), 1))
            faces = np.arange(len(flat)).reshape(-1, 4)
        triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
        return meshed(faced(mesh | {"faces": triangles}), reverse)

    def of_loopsubdiv(self, found, reverse, stretched, sided, textured):
        mesh = self.arrays(found, 3)
        for name in ("levels", "scheme"):
            found.left.discard(name)
        self.losses.add(found.place, f"{found}", "its control mesh, shaded smoothly")
        if mesh is None:
            return None
        return meshed(with_corners(mesh) if textured else mesh, reverse) | {
            "normals": "smooth", "crease_angle_deg": 180}

    def ply(self, found, path):
        try:
            return read_ply(path)
        except Damaged as error:
            refuse(found.values["filename"][2], f"'{path}' cannot be read: {error}")

    def of_plymesh(self, found, reverse, stretched, sided, textured):
        name = found.string("filename")
        if name is None:
            refuse(found.place, "a 'plymesh' has no 'filename'")
        path = present(self.state.file(found.place, name), found.values["filename"][2])
        for name in ("displacement", "edgelength"):
            if found.has(name):
                self.losses.add(found.place, "displaced meshes", "the mesh as it is")
                found.left.discard(name)
        if path.suffix != ".gz" and not sided and not (textured and not self.ply_has_uvs(found, path)):
            return {"ply": path}
        mesh = faced(self.ply(found, path))
        return meshed(with_corners(mesh) if textured else mesh, reverse)

    def ply_has_uvs(self, found, path):
        try:
            _, elements, _ = ply_header(read_bytes(path))
            names = {name for element, _, properties in elements if element == "vertex"
                     for name, _, _ in properties}
        except Damaged as error:
            refuse(found.values["filename"][2], f"'{path}' cannot be read: {error}")
        return bool(names & {"u", "s", "texture_u"})
