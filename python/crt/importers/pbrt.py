"""Scenes of pbrt-v4 as scenes of crt."""

import math

import numpy as np

from ..errors import Error, Kind
from . import matrices, pbrt_shapes, sky_image, spectra
from .draft import BLACK, Draft, Thing, half_tangent, has_texture, stretches
from .images import emitted, pixels
from .losses import present, refuse, suggestion
from .pbrt_materials import Materials
from .pbrt_state import State
from .pbrt_text import Parameters
from .pbrt_values import Values

SIDED = ("dielectric", "rough_dielectric", "openpbr", "mix")  # Materials that may let light in.
SAME_IMAGE = {"lightsampler", "regularize", "samplebsdf", "samplelights"}  # Parameters of an integrator.
FILTERS = {"box": "box", "gaussian": "gaussian"}


def read(path, parameters):
    if parameters:
        raise Error(f"'{path}' is a scene of pbrt, which has no parameter '{min(parameters)}'", Kind.USAGE)
    scene = Draft(path)
    state = State(scene.losses).of(path)
    Importer(scene, state).all()
    return scene


class Importer:
    def __init__(self, scene, state):
        self.scene, self.state, self.losses = scene, state, scene.losses
        self.values = Values(state, scene.losses)
        self.materials = Materials(state, scene, self.values)
        self.shapes = pbrt_shapes.Shapes(state, scene.losses)

    def all(self):
        self.film()
        self.camera()
        self.integrator()
        for item in self.state.lights:
            self.light(item)
        for item in self.state.shapes:
            self.thing(item, [matrices.identity()])
        places = {}
        for name, matrix, place in self.state.instances:
            if name not in self.state.objects:
                refuse(place, f"there is no object '{name}'" + suggestion(name, self.state.objects))
            places.setdefault(name, []).append(matrix)
        for name, found in places.items():
            for item in self.state.objects[name]:
                self.thing(item, found, in_object=True)

    def setting(self, directive, default):
        place = self.state.settings.get("Camera")
        return self.state.settings.get(directive) or Parameters(
            directive.lower(), default, place.place if place else None)

    def unused(self, found):
        for name in sorted(found.left):
            self.losses.add(found.values[name][2], f"'{name}' of {found}")
        found.left.clear()

    # The film, the sampler and the integrator.

    def film(self):
        film, sampler = self.setting("Film", "rgb"), self.setting("Sampler", "zsobol")
        width, height = int(film.number("xresolution", 1280)), int(film.number("yresolution", 720))
        if not (1 <= width <= 65535 and 1 <= height <= 65535 and width * height < 2**31):
            refuse(film.place, f"an image of {width} x {height} pixels; crt has 1 to 65535 a side")
        self.scene.film = {"resolution": [width, height]}
        bounds, window = film.array("pixelbounds", count=4), film.array("cropwindow", count=4)
        if bounds is not None:
            self.crop(film, *(int(v) for v in bounds[[0, 2, 1, 3]]))
        elif window is not None:
            x0, x1, y0, y1 = np.clip(window, 0, 1) * [width, width, height, height]
            self.crop(film, *(math.ceil(v) for v in (x0, y0, x1, y1)))
        if film.string("sensor", "cie1931") != "cie1931":
            self.losses.add(film.place, f"the sensor '{film.string('sensor')}'", "CIE 1931")
        shutter = self.setting("Camera", "perspective")
        exposure = (shutter.number("shutterclose", 1) - shutter.number("shutteropen", 0)) \
            * film.number("iso", 100) / 100
        if exposure > 0 and exposure != 1:
            self.scene.film |= {"exposure_ev": math.log2(exposure), "apply_to_float": True}
        self.filter(self.setting("PixelFilter", "gaussian"))
        if film.has("maxcomponentvalue"):
            self.losses.add(film.place, "'maxcomponentvalue' of the film (a clamp of bright samples)",
                            "no clamp")
        film.left -= {"filename", "diagonal", "maxcomponentvalue", "savefp16"}
        self.unused(film)
        samples = sampler.number("pixelsamples", 16)
        if sampler.has("xsamples"):
            samples = sampler.number("xsamples", 4) * sampler.number("ysamples", 4)
        self.scene.sampler = {"samples": int(min(max(samples, 1), 2**53))}
        if sampler.has("seed"):
            self.scene.sampler["seed"] = max(int(sampler.number("seed", 0)), 0)
        sampler.left -= {"randomization", "jitter"}
        self.unused(sampler)

    def crop(self, film, x0, y0, x1, y1):
        width, height = self.scene.film["resolution"]
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            refuse(film.place, f"the crop window lies beyond the {width} x {height} pixels")
        if (x0, y0, x1, y1) != (0, 0, width, height):
            self.scene.film["crop"] = [x0, y0, x1, y1]

    def filter(self, found):
        default = 0.5 if found.name == "box" else 1.5
        x, y = found.number("xradius", default), found.number("yradius", default)
        radius = min(max((x + y) / 2, 0.01), 16)
        if x != y:
            self.losses.add(found.place, "a filter of two radii", "their mean")
        if found.name not in FILTERS:
            self.losses.add(found.place, f"{found}", "a Gaussian filter")
            found.left.clear()
            radius = 1.5
        sigma = min(max(found.number("sigma", 0.5), 1e-3), 16)
        if found.name == "box":
            self.scene.film["filter"] = {"type": "box", "radius": radius} if radius != 0.5 else "box"
        else:
            self.scene.film["filter"] = {"type": "gaussian", "radius": radius, "sigma": sigma}
        self.unused(found)

    def camera(self):
        found = self.setting("Camera", "perspective")
        matrix = self.state.camera_matrix
        if found.name == "orthographic":
            self.orthographic(found, matrix)
        else:
            if found.name != "perspective":
                self.losses.add(found.place, f"{found}", "a perspective camera")
            self.scene.look(found.place, matrix, 1)
            self.scene.camera["fov"] = self.fov(found)
            if radius := max(found.number("lensradius", 0), 0):
                self.scene.camera |= {"aperture_radius": radius,
                                      "focus_distance": max(found.number("focaldistance", 1e6), 1e-6)}
        found.left -= {"focaldistance", "shutteropen", "shutterclose"}
        self.unused(found)

    def half_sizes(self, found):
        """Half of the image's width and height, in units of the shorter side where nothing else is said."""
        width, height = self.scene.film["resolution"]
        aspect = found.number("frameaspectratio", width / height)
        if not 0 < aspect < np.inf:
            refuse(found.place, f"'frameaspectratio' is {aspect:g}, and a frame has a width and a height")
        half = [aspect, 1.0] if aspect > 1 else [1.0, 1 / aspect]
        window = found.array("screenwindow", count=4)
        if window is not None:
            half = [(window[1] - window[0]) / 2, (window[3] - window[2]) / 2]
            if not (half[0] > 0 and half[1] > 0):
                refuse(found.place, f"'screenwindow' is empty: {', '.join(f'{x:g}' for x in window)}")
            if not np.allclose([window[0] + window[1], window[2] + window[3]], 0, atol=1e-6):
                self.losses.add(found.place, "a screen window off the middle", "one in the middle")
        if not np.isclose(half[0] / max(half[1], 1e-30), width / height, rtol=0.01):
            self.losses.add(found.place, "pixels that are not square", "square pixels")
        return half

    def fov(self, found):
        tangent = half_tangent(found.number("fov", 90), found.place_of("fov"))
        return 2 * math.degrees(math.atan(max(abs(min(self.half_sizes(found), key=abs)), 1e-9) * tangent))

    def orthographic(self, found, matrix):
        self.losses.add(found.place, f"{found}", "a perspective camera from far away")
        half = abs(min(self.half_sizes(found), key=abs)) * np.linalg.norm(matrix[:3, 0])
        rigid = matrix.copy()
        rigid[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
        far = 1000 * half
        rigid[:3, 3] -= far * rigid[:3, 2]
        self.scene.look(found.place, rigid, 1)
        self.scene.camera["fov"] = max(2 * math.degrees(math.atan(half / far)), 1e-3)

    def integrator(self):
        found = self.setting("Integrator", "volpath")
        if found.name not in ("path", "volpath", "simplepath", "simplevolpath"):
            own = ", ".join(f"'{name}'" for name in sorted(found.left - {"maxdepth"} - SAME_IMAGE))
            self.losses.add(found.place, f"{found}" + (f" with {own}" if own else ""), "path tracing")
            found.left &= {"maxdepth"}
        # Both count scattering events.
        self.scene.integrator = {"max_depth": min(max(int(found.number("maxdepth", 5)), 0), 10**9)}
        found.left -= SAME_IMAGE
        self.unused(found)

    # Lights.

    def light(self, item):
        found, matrix = item.parameters, item.graphics.matrix
        make = getattr(self, "light_" + found.name, None)
        if make is None:
            known = [name[6:] for name in dir(self) if name.startswith("light_")]
            self.losses.add(found.place, f"{found}{suggestion(found.name, known)}", large=True)
            return
        make(found, matrix)
        self.unused(found)

    def emission(self, found, name, power, area):
        """The spectrum of a light whose `power`, where it is given, is that of `area` times its own."""
        scale = found.number("scale", 1)
        if (given := found.number(power, -1)) > 0:
            scale *= given / max(area, 1e-30)
        return self.values.light(found, name, scale)

    def light_point(self, found, matrix):
        self.scene.lights.append({
            "type": "point", "position": matrices.point(matrix, found.point("from", [0, 0, 0])),
            "radiant_intensity": self.emission(found, "I", "power", 4 * math.pi)})

    def light_goniometric(self, found, matrix):
        self.losses.add(found.place, f"{found}", "a point light")
        found.left -= {"filename"}
        self.light_point(found, matrix)

    def way(self, found, matrix):
        start = matrices.point(matrix, found.point("from", [0, 0, 0]))
        made = matrices.point(matrix, found.point("to", [0, 0, 1])) - start
        if matrices.unit(made) is None:
            refuse(found.place, f"'from' and 'to' of {found} are the same")
        return start, matrices.unit(made)

    def light_spot(self, found, matrix):
        position, direction = self.way(found, matrix)
        cone = min(max(found.number("coneangle", 30), 0.01), 180)
        penumbra = min(max(found.number("conedeltaangle", 5), 0), cone)
        inner, outer = math.cos(math.radians(cone - penumbra)), math.cos(math.radians(cone))
        area = 2 * math.pi * ((1 - inner) + (inner - outer) / 2)
        self.scene.lights.append({
            "type": "spot", "position": position, "direction": direction, "cone_angle_deg": cone,
            "penumbra_deg": penumbra, "radiant_intensity": self.emission(found, "I", "power", area)})

    def light_distant(self, found, matrix):
        self.scene.lights.append({"type": "directional", "direction": self.way(found, matrix)[1],
                                  "irradiance": self.emission(found, "L", "illuminance", 1)})

    def light_infinite(self, found, matrix):
        if self.scene.environment is not None:
            self.losses.add(found.place, "a second infinite light", "the first alone", large=True)
            found.left.clear()
            return
        if found.has("portal"):
            found.left.discard("portal")
        name = found.string("filename")
        if name is None:
            self.scene.environment = {"radiance": self.emission(found, "L", "illuminance", math.pi)}
            return
        path = present(self.state.file(found.place, name), found.values["filename"][2])
        image = pixels(path)
        if image is None:
            self.losses.add(found.place, "an environment image that crt cannot read", "even light",
                            large=True)
            self.scene.environment = {"radiance": self.emission(found, "L", "illuminance", math.pi)}
            return
        scale = found.number("scale", 1)
        made = sky_image.unfolded(image, matrix, self.scene.mirrored)
        if (wanted := found.number("illuminance", -1)) > 0:
            scale *= wanted / max(upper_illuminance(image), 1e-30)
        self.scene.environment = {"image": made} | ({"scale": max(scale, 0)} if scale != 1 else {})

    # Shapes.

    def thing(self, item, placements, in_object=False):
        found, graphics = item.parameters, item.graphics
        emitter = graphics.area_light
        if in_object and emitter is not None:
            self.losses.add(emitter.place, "lights within an object", "dark surfaces", large=True)
            emitter = None
        inside = graphics.inside
        opacity = self.values.number(found, "alpha", 1.0)
        opacity = opacity if isinstance(opacity, dict) else min(max(opacity, 0.0), 1.0)
        material = self.materials.name(graphics.material, opacity, inside)
        if inside and lets_light_in(self.scene.materials.get(material)):
            self.losses.add(found.place, "participating media", "empty space", large=True)
        if material is None:
            if emitter is None:
                return
            self.losses.add(found.place, "a light of material 'interface'", "a black light")
            material = self.scene.material("black", BLACK)
        places = [placement @ graphics.matrix for placement in placements]
        content = self.scene.materials[material]
        sided = emitter is not None or content["type"] in SIDED
        image = emitter is not None and emitter.has("filename")  # In crt only meshes emit images.
        geometry = self.shapes.geometry(found, graphics.reverse, stretches(places) or image, sided=sided,
                                        textured=image or has_texture(content, self.scene.materials))
        if geometry is None:
            return
        emission = None if emitter is None else self.area(emitter, found, geometry, places[0])
        self.unused(found)
        self.scene.add(found.place, Thing(found.name, geometry, places, material, emission))

    def area(self, emitter, shape, geometry, matrix):
        two_sided = emitter.boolean("twosided", False)
        if emitter.name != "diffuse":
            self.losses.add(emitter.place, f"{emitter}", "'diffuse'")
        scale_of = 1.0
        if emitter.number("power", -1) > 0:
            scale_of = math.pi * (2 if two_sided else 1) * self.shapes.area(shape, geometry, matrix)
        made = {"radiance": self.emission(emitter, "L", "power", scale_of)}
        if emitter.has("filename"):
            path = self.state.file(emitter.place, emitter.string("filename"))
            image = pixels(present(path, emitter.place_of("filename")))
            if image is None:
                self.losses.add(emitter.place, "an image that emits light", "even light", large=True)
            elif emitter.number("power", -1) > 0:
                self.losses.add(emitter.place, "the 'power' of an image that emits light",
                                "that of a white one")
            if image is not None and (light := emitted(image)) is not None:
                scale = made["radiance"].get("scale", 1) if isinstance(made["radiance"], dict) else 1
                made = {"radiance": spectra.scaled(light["radiance"], scale), "color": light["color"]}
        self.unused(emitter)
        return made | ({"two_sided": True} if two_sided else {})


def lets_light_in(content):
    """Can one see what is inside a body of this material? None is an interface."""
    if content is None or "opacity" in content or "geometry_opacity" in content:
        return True
    return content["type"] in SIDED and "absorption" not in content


def upper_illuminance(image):
    """Of a square image, of level ground: what pbrt scales to `illuminance`."""
    turn = matrices.rotation([1, 0, 0], -90)  # Its z is crt's y.
    made = sky_image.unfolded(image, turn, False)
    height, width = made.shape[:2]
    theta = (np.arange(height) + 0.5) * math.pi / height
    weights = np.clip(np.cos(theta), 0, None) * np.sin(theta) * math.pi / height * 2 * math.pi / width
    return float((made @ np.array([0.2126, 0.7152, 0.0722], np.float32) * weights[:, None]).sum())
