"""Shapes of Mitsuba as geometry of crt."""

import math

import numpy as np

from . import matrices, shapes
from .draft import ball, meshed, plate, tube
from .losses import present, refuse
from .meshes import Damaged, faced, ply_vertex, read_obj, read_ply, read_serialized


class Shapes:
    """After read(): does the mesh have texture coordinates (`has_uvs`), and colours at its vertices
    (`has_colors`)?"""

    def __init__(self, reader, losses):
        self.reader, self.losses = reader, losses
        self.has_uvs, self.has_colors = True, False

    def known(self):
        return [name[3:] for name in dir(self) if name.startswith("of_")]

    def read(self, plugin):
        """`to_world`, and a function (stretches, textured) that makes the keys of an object; None for a
        shape that crt does not have."""
        make = getattr(self, "of_" + plugin.kind, None)
        self.has_uvs, self.has_colors = True, False
        return None if make is None else make(plugin)

    def flip(self, plugin):
        return bool(plugin.get("flip_normals", False))

    def of_sphere(self, plugin):
        center, radius = plugin.triple("center", [0, 0, 0]), plugin.number("radius", 1)
        if radius <= 0:
            refuse(plugin.place, "a sphere has a radius above 0")
        flip = self.flip(plugin)
        return (plugin.transform() @ matrices.translation(*center),
                lambda stretched, textured: ball(radius, stretched, flip=flip))

    def of_disk(self, plugin):
        flip = self.flip(plugin)
        return plugin.transform(), lambda stretched, textured: (
            meshed(polar(shapes.disk(1)), flip) if textured else plate(1, stretched, flip=flip))

    def of_cylinder(self, plugin):
        low, high = (np.array(plugin.triple(name, default), float)
                     for name, default in (("p0", [0, 0, 0]), ("p1", [0, 0, 1])))
        length = np.linalg.norm(high - low)
        radius = plugin.number("radius", 1)
        if length == 0 or radius <= 0:
            refuse(plugin.place, "a cylinder has a length and a radius above 0")
        flip = self.flip(plugin)
        axis = (high - low) / length
        other = np.cross([0, 0, 1], axis)
        angle = math.degrees(math.atan2(np.linalg.norm(other), axis[2]))
        turn = matrices.rotation(other if np.any(other) else [1, 0, 0], angle)
        return (plugin.transform() @ matrices.translation(*low) @ turn,
                lambda stretched, textured: tube(radius, 0, length, stretched, flip=flip))

    def of_rectangle(self, plugin):
        flip = self.flip(plugin)
        return plugin.transform(), lambda stretched, textured: (
            meshed(shapes.rectangle(), True) if flip else {"rectangle": {"size": [2, 2]}})

    def of_cube(self, plugin):
        flip = self.flip(plugin)
        return plugin.transform(), lambda stretched, textured: (
            meshed(cube(), flip) if flip or textured else {"box": {"size": [2, 2, 2]}})

    def file(self, plugin):
        name = plugin.get("filename")
        if not isinstance(name, str):
            refuse(plugin.place, f"{plugin} has no 'filename'")
        path = present(self.reader.file(plugin.place, name), plugin.values["filename"][2])
        return path

    def normals(self, plugin, has_normals):
        """Mitsuba works normals out where the file has none."""
        if plugin.get("face_normals", False):
            return {"normals": "flat"}
        return {} if has_normals else {"normals": "smooth", "crease_angle_deg": 180}

    def mirrors(self, plugin):
        """Does `to_world` mirror? Mitsuba applies it to the vertices of a mesh. If these have no normals,
        their order says where the outside is, and a mirror turns that around."""
        return bool(np.linalg.det(plugin.transform()[:3, :3]) < 0)

    def mesh_file(self, plugin, key, path, read, has_normals):
        """A file as it is, unless its faces must be turned: for Mitsuba normals say where the outside is."""
        has_normals = has_normals and not plugin.get("face_normals", False)
        flip = self.flip(plugin) != (not has_normals and self.mirrors(plugin))
        keys = self.normals(plugin, has_normals)
        if flip or has_normals:
            try:
                mesh = read(path)
            except Damaged as error:
                refuse(plugin.values["filename"][2], f"'{path}' cannot be read: {error}")
            turned = faced(mesh) if has_normals else mesh
            if flip or turned is not mesh:
                return meshed(turned, flip) | keys
        return {key: path} | ({"override": True} if key == "obj" else {}) | keys

    def of_obj(self, plugin):
        path = self.file(plugin)
        with open(path, "rb") as file:
            words = {line[:3] for line in file}
        has_normals, self.has_uvs = b"vn " in words, b"vt " in words
        made = self.mesh_file(plugin, "obj", path, read_obj, has_normals)
        return plugin.transform(), lambda stretched, textured: made

    def of_ply(self, plugin):
        path = self.file(plugin)
        if plugin.get("flip_tex_coords", False):
            self.losses.add(plugin.place, f"'flip_tex_coords' of {plugin}", "false")
        names = ply_vertex(path)
        self.has_uvs, self.has_colors = bool(names & {"u", "s", "texture_u"}), "red" in names
        made = self.mesh_file(plugin, "ply", path, read_ply, "nx" in names)
        return plugin.transform(), lambda stretched, textured: made

    def of_serialized(self, plugin):
        path = self.file(plugin)
        try:
            mesh, is_flat = read_serialized(path, int(plugin.number("shape_index", 0)))
        except Damaged as error:
            refuse(plugin.values["filename"][2], f"'{path}' cannot be read: {error}")
        self.has_uvs = "uvs" in mesh
        has_normals = "normals" in mesh and not plugin.get("face_normals", False)
        flip = self.flip(plugin) != (not has_normals and self.mirrors(plugin))
        made = meshed(faced(mesh) if has_normals else mesh, flip)
        made |= self.normals(plugin, is_flat or has_normals)
        return plugin.transform(), lambda stretched, textured: made


def polar(mesh):
    """A disk with Mitsuba's texture coordinates: the distance from the middle, and the angle."""
    around, inwards = mesh["uvs"].T
    return mesh | {"uvs": np.stack([1 - inwards, around], -1)}


def cube():
    """From -1 to 1 with Mitsuba's texture coordinates on each side."""
    sides = np.array([
        [[1, -1, -1], [1, -1, 1], [-1, -1, 1], [-1, -1, -1]],
        [[1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1]],
        [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]],
        [[1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, 1]],
        [[-1, -1, 1], [-1, 1, 1], [-1, 1, -1], [-1, -1, -1]],
        [[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]]], float)
    corners = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    return {"positions": sides.reshape(-1, 3), "faces": np.arange(24).reshape(6, 4),
            "uvs": np.tile(corners, (6, 1))}
