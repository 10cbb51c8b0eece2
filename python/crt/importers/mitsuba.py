"""Scenes of Mitsuba as scenes of crt."""

import math

import numpy as np

from . import matrices, shapes, sky_image, spectra
from .images import pixels
from .losses import at, present, refuse, step, suggestion
from .meshes import Damaged, faced, ply_vertex, read_obj, read_ply, read_serialized
from .mitsuba_materials import Materials
from .mitsuba_tree import Reader
from .mitsuba_values import Values
from .draft import BLACK, Draft, Thing, ball, meshed, plate, stretches, tube

ENDLESS = 1_000_000  # Depths that Mitsuba writes as -1; Russian roulette ends paths before.
SKY = 0.2  # Luminance of the even sky that stands for Mitsuba's models.
AREA = ("area", "directionalarea")


def read(path, parameters):
    reader = Reader(path, parameters)
    tree = reader.read()
    made = Importer(reader, path)
    made.scene_of(tree)
    return made.scene


class Importer:
    def __init__(self, reader, path):
        self.reader = reader
        self.scene = Draft(path)
        self.losses = self.scene.losses
        self.values = Values(reader, self.losses)
        self.materials = Materials(reader, self.scene)
        self.has_uvs, self.has_colors = True, False  # The mesh that is being read.
        self.groups = {}  # By the identity of a shapegroup: itself, and its instances' matrices.

    def scene_of(self, tree):
        if tree.all("integrator"):
            self.integrator(tree.all("integrator")[-1])
        sensors = tree.all("sensor")
        if len(sensors) > 1:
            self.losses.add(sensors[1].place, "further sensors", "the first alone")
        if sensors:
            self.sensor(sensors[0])
        for emitter in tree.all("emitter"):
            if emitter.kind not in AREA:  # Those are there to be referred to.
                self.emitter(emitter)
        for shape in tree.all("shape"):
            self.shape(shape)
        for group, placements in self.groups.values():
            for shape in group.all("shape"):
                self.thing(shape, placements, in_group=True)
            self.unused(group)
        for medium in tree.all("medium"):
            self.losses.add(medium.place, "participating media", "empty space")
        for plugin in self.materials.left:
            self.unused(plugin)

    def unused(self, plugin):
        """Lists parameters that nothing asked for."""
        for name in sorted(plugin.left):
            self.losses.add(plugin.values[name][2], f"'{name}' of {plugin}")
        plugin.left.clear()

    # How it is rendered.

    def integrator(self, plugin):
        inner = plugin.one("integrator")
        if inner:
            self.losses.add(plugin.place, f"{plugin}", f"{inner}")
            return self.integrator(inner)
        if plugin.kind == "direct":
            plugin.left.clear()
            self.scene.integrator = {"max_depth": 1}
            return None
        if plugin.kind not in ("path", "volpath", "volpathmis"):
            self.losses.add(plugin.place, f"{plugin}", "path tracing")
        # Mitsuba counts a path's edges, crt what happens between them.
        depth = int(plugin.number("max_depth", -1))
        self.scene.integrator = {"max_depth": ENDLESS if depth < 0 else max(depth - 1, 0)}
        if plugin.has("rr_depth"):
            first = int(plugin.number("rr_depth", 5)) - 1
            self.scene.integrator["roulette_depth"] = min(max(first, 0), 10**9)
        if plugin.get("hide_emitters", False):
            self.losses.add(plugin.place, "'hide_emitters'", "lights are seen")
        return self.unused(plugin)

    def sensor(self, plugin):
        film = plugin.one("film")
        width, height = self.film(film)
        if sampler := plugin.one("sampler"):
            self.sampler(sampler)
        matrix = plugin.transform()
        aspect = width / height
        if plugin.kind == "orthographic":
            self.orthographic(plugin, matrix)
        else:
            if plugin.kind not in ("perspective", "thinlens"):
                self.losses.add(plugin.place, f"{plugin}", "a perspective camera")
            self.scene.look(plugin.place, matrix, -1)
            self.scene.camera["fov"] = self.fov(plugin, aspect)
        if plugin.kind == "thinlens":
            distance = plugin.number("focus_distance", 0)
            self.scene.camera |= {"aperture_radius": max(plugin.number("aperture_radius", 0), 0),
                                  "focus_distance": max(distance, 0)}
        for name in ("near_clip", "far_clip", "shutter_open", "shutter_close", "focus_distance"):
            plugin.get(name)
        for name in ("principal_point_offset_x", "principal_point_offset_y"):
            if plugin.number(name, 0) == 0:
                plugin.left.discard(name)
        self.unused(plugin)

    def orthographic(self, plugin, matrix):
        self.losses.add(plugin.place, f"{plugin}", "a perspective camera from far away")
        half = np.linalg.norm(matrix[:3, 0])
        rigid = matrix.copy()
        rigid[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
        far = 1000 * half
        rigid[:3, 3] -= far * rigid[:3, 2]
        self.scene.look(plugin.place, rigid, -1)
        self.scene.camera["fov"] = max(2 * math.degrees(math.atan(half / far)), 1e-3)

    def fov(self, plugin, aspect):
        """Across the shorter side, as crt has it."""
        axis = plugin.text("fov_axis", "x")
        if plugin.has("fov"):
            tangent = math.tan(math.radians(min(max(plugin.number("fov", 50), 1e-3), 179.9)) / 2)
        else:
            text = str(plugin.get("focal_length", "50mm"))
            try:
                length = float(text.removesuffix("mm"))
            except ValueError:
                refuse(plugin.values["focal_length"][2], f"a focal length is like '50mm', not '{text}'")
            axis, tangent = "diagonal", math.hypot(36, 24) / 2 / max(length, 1e-3)
        if axis not in ("x", "y", "diagonal", "smaller", "larger"):
            axes = ("x", "y", "diagonal", "smaller", "larger")
            refuse(plugin.values["fov_axis"][2], f"there is no axis '{axis}'{suggestion(axis, axes)}")
        if axis == "diagonal":
            tangent /= math.hypot(1, aspect)  # Now of y.
            axis = "y"
        along_x = axis == "x" or (axis == "smaller") == (aspect < 1) and axis != "y"
        y = tangent / aspect if along_x else tangent
        return 2 * math.degrees(math.atan(min(y, y * aspect)))

    def film(self, plugin):
        if plugin is None:
            self.scene.film = {"resolution": [768, 576], "filter": {"type": "gaussian", "radius": 2}}
            return 768, 576
        width, height = (int(plugin.number(name, default)) for name, default in
                         (("width", 768), ("height", 576)))
        if not (1 <= width <= 65535 and 1 <= height <= 65535 and width * height < 2**31):
            refuse(plugin.place, f"an image of {width} x {height} pixels; crt has 1 to 65535 a side")
        self.scene.film = {"resolution": [width, height]}
        x, y = int(plugin.number("crop_offset_x", 0)), int(plugin.number("crop_offset_y", 0))
        across, down = (int(plugin.number(name, size)) for name, size in
                        (("crop_width", width), ("crop_height", height)))
        if (x, y, across, down) != (0, 0, width, height):
            if x < 0 or y < 0 or across < 1 or down < 1 or x + across > width or y + down > height:
                refuse(plugin.place, f"the crop window lies beyond the {width} x {height} pixels")
            self.scene.film["crop"] = [x, y, x + across, y + down]
        self.filter(plugin.one("rfilter"))
        if plugin.kind != "hdrfilm":
            self.losses.add(plugin.place, f"{plugin}", "a film of colours")
        for name in ("pixel_format", "component_format", "file_format", "compensate", "sample_border",
                     "banner", "gamma", "attach_log"):
            plugin.get(name)
        self.unused(plugin)
        return width, height

    def filter(self, plugin):
        kind = plugin.kind if plugin else "gaussian"
        if kind == "box":
            return
        sigma = plugin.number("stddev", 0.5) if plugin else 0.5
        if kind != "gaussian":
            self.losses.add(plugin.place, f"{plugin}", "a Gaussian filter")
            plugin.left.clear()
            sigma = 0.5
        sigma = min(max(sigma, 1e-3), 4)
        self.scene.film["filter"] = {"type": "gaussian", "sigma": sigma, "radius": 4 * sigma}

    def sampler(self, plugin):
        self.scene.sampler = {"samples": min(max(int(plugin.number("sample_count", 4)), 1), 2**53)}
        if plugin.has("seed"):
            self.scene.sampler["seed"] = max(int(plugin.number("seed", 0)), 0)
        plugin.left -= {"jitter", "scramble"}
        self.unused(plugin)

    # Lights.

    def emitter(self, plugin):
        at(plugin.place)
        make = getattr(self, "light_" + plugin.kind, None)
        if make is None:
            known = [name[6:] for name in dir(self) if name.startswith("light_")]
            self.losses.add(plugin.place, f"{plugin}{suggestion(plugin.kind, known)}")
            return
        make(plugin)
        plugin.get("sampling_weight")
        self.unused(plugin)

    def light_point(self, plugin):
        where = plugin.triple("position", None) or matrices.point(plugin.transform(), [0, 0, 0])
        self.scene.lights.append({"type": "point", "position": where,
                                  "radiant_intensity": self.values.emission(plugin, "intensity")})

    def light_spot(self, plugin):
        matrix = plugin.transform()
        cone = min(max(plugin.number("cutoff_angle", 20), 0.01), 180)
        full = min(max(plugin.number("beam_width", cone * 0.75), 0), cone)
        if full < cone:
            self.losses.add(plugin.place, "a spot whose light falls linearly in the angle",
                            "Hermite's cubic of the cosine")
        if plugin.part("texture"):
            self.losses.add(plugin.place, "the texture of a spot", "without it")
        self.scene.lights.append({
            "type": "spot", "position": matrix[:3, 3], "direction": self.forward(plugin, matrix),
            "cone_angle_deg": cone, "penumbra_deg": cone - full,
            "radiant_intensity": self.values.emission(plugin, "intensity")})

    def forward(self, plugin, matrix):
        found = matrices.unit(matrix[:3, 2])
        if found is None:
            refuse(plugin.place, f"the transform of {plugin} has no direction")
        return found

    def light_directional(self, plugin):
        direction = plugin.triple("direction", None)
        direction = self.forward(plugin, plugin.transform()) if direction is None else direction
        if matrices.unit(direction) is None:
            refuse(plugin.place, f"{plugin} goes nowhere: its direction is 0")
        self.scene.lights.append({"type": "directional", "direction": direction,
                                  "irradiance": self.values.emission(plugin, "irradiance")})

    def light_constant(self, plugin):
        self.one_environment(plugin, {"radiance": self.values.emission(plugin, "radiance")})

    def light_envmap(self, plugin):
        path, _ = self.values.image(plugin)
        if path is None:
            return
        matrix, scale = plugin.transform(), plugin.number("scale", 1)
        found = pixels(path)
        if found is None:
            self.losses.add(plugin.place, f"an environment image of type '{path.suffix}'", "even light")
            self.one_environment(plugin, {"radiance": spectra.d65(max(scale, 0))})
            return
        turn = sky_image.about_y(matrix)
        wide = found.shape[1] == 2 * found.shape[0] and path.suffix.lower() in (".exr", ".hdr", ".pfm")
        if turn is not None and wide and not self.scene.mirrored:
            image = {"image": path} | ({"rotation_deg": (180 + turn) % 360} if turn != -180 else {})
        else:
            image = {"image": sky_image.turned(found, matrix, self.scene.mirrored)}
        self.one_environment(plugin, image | ({"scale": max(scale, 0)} if scale != 1 else {}))

    def one_environment(self, plugin, made):
        if self.scene.environment is not None:
            self.losses.add(plugin.place, "a second environment", "the first alone")
            return
        self.scene.environment = made

    def sky(self, plugin):
        """The models of Mitsuba's skies have no counterpart of the same size."""
        self.losses.add(plugin.place, f"{plugin}", "an even sky")
        plugin.left.clear()
        self.one_environment(plugin, {"radiance": spectra.d65(SKY)})

    light_sunsky = light_sky = light_sun = light_timed_sunsky = sky

    # Shapes.

    def shape(self, plugin):
        if plugin.kind == "shapegroup":
            return
        if plugin.kind == "instance":
            group = next((part for part in plugin.all("shape") if part.kind == "shapegroup"), None)
            if group is None:
                self.losses.add(plugin.place, "an instance of no shapegroup")
                return
            self.groups.setdefault(id(group), (group, []))[1].append(plugin.transform())
            return
        if plugin.kind == "merge":
            for part in plugin.all("shape"):
                step(part.place)
                self.shape(part)
            return
        self.thing(plugin, [matrices.identity()])

    def thing(self, plugin, placements, in_group=False):
        at(plugin.place)
        make = getattr(self, "shape_" + plugin.kind, None)
        if make is None:
            known = [name[6:] for name in dir(self) if name.startswith("shape_")]
            self.losses.add(plugin.place, f"{plugin}{suggestion(plugin.kind, known)}")
            return
        self.has_uvs, self.has_colors = True, False
        matrix, geometry = make(plugin)
        places = [placement @ matrix for placement in placements]
        geometry = geometry(stretches(places))
        # What crt reads as v is 1 - v in Mitsuba's spheres, and in its OBJ files unless that is off.
        flip_v = plugin.kind == "sphere" or (
            plugin.kind == "obj" and plugin.get("flip_tex_coords", True) is not False)
        material = self.materials.name(plugin.one("bsdf"), flip_v=flip_v, has_uvs=self.has_uvs,
                                       has_colors=self.has_colors)
        emission = self.emission(plugin, in_group)
        if plugin.all("medium"):
            self.losses.add(plugin.place, "participating media", "empty space")
        for name in ("silhouette_sampling_weight", "optimize"):
            plugin.get(name)
        self.unused(plugin)
        if material is None:
            if emission is None:
                return
            material = self.scene.material("black", BLACK)
            self.losses.add(plugin.place, "a light of bsdf 'null'", "a black light")
        self.scene.add(plugin.place, Thing(plugin.id or plugin.kind, geometry, places, material, emission))

    def emission(self, plugin, in_group):
        emitter = plugin.one("emitter")
        if emitter is None:
            return None
        if in_group:
            self.losses.add(emitter.place, "lights within a shapegroup", "dark surfaces")
            return None
        if emitter.kind not in AREA:
            self.losses.add(emitter.place, f"{emitter} of a shape", "a dark surface")
            return None
        if emitter.kind == "directionalarea":
            self.losses.add(emitter.place, f"{emitter}", "emitter 'area'")
        made = {"radiance": self.values.emission(emitter, "radiance")}
        emitter.get("sampling_weight")
        self.unused(emitter)
        return made

    def flip(self, plugin):
        return bool(plugin.get("flip_normals", False))

    def shape_sphere(self, plugin):
        center, radius = plugin.triple("center", [0, 0, 0]), plugin.number("radius", 1)
        if radius <= 0:
            refuse(plugin.place, "a sphere has a radius above 0")
        flip = self.flip(plugin)
        return (plugin.transform() @ matrices.translation(*center),
                lambda stretched: ball(radius, stretched, flip=flip))

    def shape_disk(self, plugin):
        flip = self.flip(plugin)
        return plugin.transform(), lambda stretched: plate(1, stretched, flip=flip)

    def shape_cylinder(self, plugin):
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
                lambda stretched: tube(radius, 0, length, stretched, flip=flip))

    def shape_rectangle(self, plugin):
        if self.flip(plugin):
            return plugin.transform(), lambda stretched: meshed(shapes.rectangle(), True)
        return plugin.transform(), lambda stretched: {"rectangle": {"size": [2, 2]}}

    def shape_cube(self, plugin):
        if self.flip(plugin):
            return plugin.transform(), lambda stretched: meshed(shapes.cube(), True)
        return plugin.transform(), lambda stretched: {"box": {"size": [2, 2, 2]}}

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

    def mesh_file(self, plugin, key, path, read, has_normals):
        """A file as it is, unless its faces must be turned: for Mitsuba normals say where the outside is."""
        flip = self.flip(plugin)
        keys = self.normals(plugin, has_normals)
        if flip or has_normals:
            try:
                mesh = read(path)
            except Damaged as error:
                refuse(plugin.values["filename"][2], f"'{path}' cannot be read: {error}")
            turned = faced(mesh)
            if flip or turned is not mesh:
                return meshed(turned, flip) | keys
        return {key: path} | ({"override": True} if key == "obj" else {}) | keys

    def shape_obj(self, plugin):
        path = self.file(plugin)
        with open(path, "rb") as file:
            words = {line[:3] for line in file}
        has_normals, self.has_uvs = b"vn " in words, b"vt " in words
        made = self.mesh_file(plugin, "obj", path, read_obj, has_normals)
        return plugin.transform(), lambda stretched: made

    def shape_ply(self, plugin):
        path = self.file(plugin)
        if plugin.get("flip_tex_coords", False):
            self.losses.add(plugin.place, f"'flip_tex_coords' of {plugin}", "false")
        names = ply_vertex(path)
        self.has_uvs, self.has_colors = bool(names & {"u", "s", "texture_u"}), "red" in names
        made = self.mesh_file(plugin, "ply", path, read_ply, "nx" in names)
        return plugin.transform(), lambda stretched: made

    def shape_serialized(self, plugin):
        path = self.file(plugin)
        try:
            mesh, is_flat = read_serialized(path, int(plugin.number("shape_index", 0)))
        except Damaged as error:
            refuse(plugin.values["filename"][2], f"'{path}' cannot be read: {error}")
        self.has_uvs = "uvs" in mesh
        made = meshed(faced(mesh), self.flip(plugin)) | self.normals(plugin, is_flat or "normals" in mesh)
        return plugin.transform(), lambda stretched: made
