"""Scenes of Mitsuba as scenes of crt."""

import math

import numpy as np

from . import matrices, mitsuba_sky, sky_image, spectra
from .images import pixels
from .losses import at, refuse, step, suggestion
from .mitsuba_materials import Materials
from .mitsuba_shapes import Shapes
from .mitsuba_tree import Reader
from .mitsuba_values import Values
from .draft import BLACK, Draft, Thing, half_tangent, has_texture, stretches

ENDLESS = 1_000_000  # Depths that Mitsuba writes as -1; Russian roulette ends paths before.
AREA = ("area", "directionalarea")


def read(path, parameters):
    reader = Reader(path, parameters)
    tree = reader.read()
    made = Importer(reader, path)
    made.scene_of(tree)
    return made.scene


def merged(plugin):
    """The shapes of a merge and of the merges in it, all counted before the first one is made."""
    shapes = []
    for part in plugin.all("shape"):
        step(part.place)
        shapes += merged(part) if part.kind == "merge" else [part]
    return shapes


class Importer:
    def __init__(self, reader, path):
        self.reader = reader
        self.scene = Draft(path)
        self.losses = self.scene.losses
        self.values = Values(reader, self.losses)
        self.materials = Materials(reader, self.scene)
        self.shapes = Shapes(reader, self.losses)
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
            self.medium(medium.place)
        for plugin in self.materials.left:
            self.unused(plugin)

    def medium(self, place):
        self.losses.add(place, "participating media", "empty space", large=True)

    def unused(self, plugin):
        """Lists parameters that nothing asked for."""
        plugin.unused(self.losses)

    # The film, the sampler and the integrator.

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
            depth = int(plugin.number("max_depth", -1))
            known = {"rr_depth", "hide_emitters", *plugin.older()}
            own = ", ".join(f"'{name}'" for name in sorted(plugin.left - known))
            self.losses.add(plugin.place, f"{plugin}" + (f" with {own}" if own else ""), "path tracing")
            plugin.left &= known
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
            self.orthographic(plugin, matrix, aspect)
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

    def orthographic(self, plugin, matrix, aspect):
        self.losses.add(plugin.place, f"{plugin}", "a perspective camera from far away")
        # Mitsuba's x axis is half of the image's width; crt's field of view spans the shorter side.
        half = np.linalg.norm(matrix[:3, 0]) * min(1, 1 / aspect)
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
            tangent = half_tangent(plugin.number("fov", 50), plugin.place_of("fov"))
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
            self.losses.add(plugin.place, f"{plugin}{suggestion(plugin.kind, known)}", large=True)
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
            self.losses.add(plugin.place, "the texture of a spot", "without it", large=True)
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
            refuse(plugin.place, f"the direction of {plugin} is 0")
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
            self.losses.add(plugin.place, f"an environment image of type '{path.suffix}'", "even light",
                            large=True)
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
        if self.scene.environment is None:
            self.scene.environment = made
        elif both := mitsuba_sky.together(self.scene.environment, made):
            self.scene.environment = both
        else:
            self.losses.add(plugin.place, "a second environment", "the first alone", large=True)

    def sky(self, plugin):
        found = mitsuba_sky.Daylight(plugin, self.reader.version < (2, 0))
        if plugin.kind == "timed_sunsky":
            self.losses.add(plugin.place, f"{plugin}", "the sky of one time", large=True)
        if found.elevation_deg <= 0:
            self.losses.add(plugin.place, f"the light of a sun {-found.elevation_deg:.1f} degrees below the "
                            "horizon", large=True)
            plugin.left.clear()
            return
        albedo = self.values.reflectance(plugin, "albedo", 0.3)
        if isinstance(albedo, dict) and {"texture", "checker", "attribute"} & set(albedo):
            self.losses.add(plugin.place, f"a texture as 'albedo' of {plugin}", "0.3")
            albedo = 0.3
        self.one_environment(plugin, {"clear_sky": found.keys(albedo)})

    light_sunsky = light_sky = light_sun = light_timed_sunsky = sky

    # Shapes.

    def shape(self, plugin):
        if plugin.kind == "shapegroup":
            return
        if plugin.kind == "instance":
            group = next((part for part in plugin.all("shape") if part.kind == "shapegroup"), None)
            if group is None:
                self.losses.add(plugin.place, "an instance without a shapegroup")
                return
            self.groups.setdefault(id(group), (group, []))[1].append(plugin.transform())
            self.unused(plugin)
            return
        if plugin.kind == "merge":
            for part in merged(plugin):
                self.shape(part)
            return
        self.thing(plugin, [matrices.identity()])

    def thing(self, plugin, placements, in_group=False):
        at(plugin.place)
        found = self.shapes.read(plugin)
        if found is None:
            close = suggestion(plugin.kind, self.shapes.known())
            self.losses.add(plugin.place, f"{plugin}{close}", large=True)
            return
        matrix, geometry = found
        places = [placement @ matrix for placement in placements]
        # crt's v is 1 - v in Mitsuba's spheres, and in its OBJ files unless that is off.
        flip_v = plugin.kind == "sphere" or (
            plugin.kind == "obj" and plugin.get("flip_tex_coords", True) is not False)
        # Before version 2 a shape with a medium and without a bsdf lets light pass; later it is diffuse.
        passes = self.reader.version < (2, 0) and plugin.all("medium") and not plugin.all("bsdf")
        material = None if passes else self.materials.name(
            plugin.one("bsdf"), flip_v=flip_v, has_uvs=self.shapes.has_uvs,
            has_colors=self.shapes.has_colors)
        emission = self.emission(plugin, in_group, flip_v)
        # In crt only meshes emit images.
        image = emission is not None and "color" in emission
        textured = image or (material and has_texture(self.scene.materials[material], self.scene.materials))
        geometry = geometry(stretches(places) or image, textured)
        if plugin.all("medium"):
            self.medium(plugin.place)
        for name in ("silhouette_sampling_weight", "optimize"):
            plugin.get(name)
        self.unused(plugin)
        if material is None:
            if emission is None:
                return
            material = self.scene.material("black", BLACK)
            self.losses.add(plugin.place, "a light of bsdf 'null'", "a black light")
        self.scene.add(plugin.place, Thing(plugin.id or plugin.kind, geometry, places, material, emission))

    def emission(self, plugin, in_group, flip_v):
        emitter = plugin.one("emitter")
        if emitter is None:
            return None
        if in_group:
            self.losses.add(emitter.place, "lights within a shapegroup", "dark surfaces", large=True)
            return None
        if emitter.kind not in AREA:
            self.losses.add(emitter.place, f"{emitter} of a shape", "a dark surface", large=True)
            return None
        if emitter.kind == "directionalarea":
            self.losses.add(emitter.place, f"{emitter}", "emitter 'area'")
        values = Values(self.reader, self.losses, flip_v=flip_v, has_uvs=self.shapes.has_uvs)
        made = values.surface_light(emitter)
        emitter.get("sampling_weight")
        self.unused(emitter)
        return made
