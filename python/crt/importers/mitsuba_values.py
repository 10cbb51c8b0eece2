"""Spectra and textures of Mitsuba's plugins as crt has them."""

import math
import pathlib

import numpy as np

from . import spectra
from .images import BYTES, IMAGES, emitted, pixels
from .losses import present, refuse, step

FLIP_V = np.array([[1.0, 0, 0], [0, -1, 1], [0, 0, 1]])


def decoded(losses, place, path):
    """The keys of a texture of numbers that are sRGB-encoded in a file, which crt takes linear alone."""
    found = pixels(path)
    if found is None:
        losses.add(place, "an encoded image where crt has linear numbers", "the numbers as they are")
        return {"texture": path}
    return {"texture": found.mean(2), "color_space": "raw"}


def uv_keys(matrix):
    """scale, rotation_deg and offset of crt's textures for an affine map (3, 3) of texture coordinates;
    None where it shears."""
    linear = matrix[:2, :2]
    u, v = np.linalg.norm(linear[:, 0]), np.linalg.norm(linear[:, 1])
    if u == 0 or v == 0 or abs(linear[:, 0] @ linear[:, 1]) > 1e-6 * u * v:
        return None
    angle = math.degrees(math.atan2(linear[1, 0], linear[0, 0]))
    v = math.copysign(v, np.linalg.det(linear))
    if abs(angle) == 180:
        angle, u, v = 0.0, -u, -v
    made = {} if u == v == 1 else {"scale": [float(u), float(v)]}
    made |= {"rotation_deg": angle} if angle else {}
    return made | ({"offset": [float(x) for x in matrix[:2, 2]]} if matrix[:2, 2].any() else {})


def flat(matrix):
    """The part (3, 3) of a transform (4, 4) that acts on texture coordinates."""
    return matrix[np.ix_([0, 1, 3], [0, 1, 3])]


class Values:
    """`flip_v`: the v of the shape's texture coordinates, as crt reads them, is 1 - v of Mitsuba's.
    `has_uvs`, `has_colors`: does the mesh have coordinates, and colours at its vertices?"""

    def __init__(self, reader, losses, flip_v=False, has_uvs=True, has_colors=False):
        self.reader, self.losses = reader, losses
        self.has_uvs, self.has_colors = has_uvs, has_colors
        self.uv = FLIP_V if flip_v else np.eye(3)

    # The value of a parameter: a plugin, or a plain value.

    def reflectance(self, plugin, name, default=0.5):
        """A spectrum or a texture of crt, from 0 to 1."""
        if part := plugin.part(name):
            return self.texture(part)
        return self.at_most_one(self.plain(plugin, name, default))

    def number(self, plugin, name, default):
        """A number, or a texture of numbers."""
        if part := plugin.part(name):
            made = self.texture(part, numbers=True)
            if isinstance(made, dict) and not {"texture", "checker"} & set(made):
                return self.one_number(part.place, made, default)
            return made
        made = self.plain(plugin, name, default)
        return made if isinstance(made, (int, float)) else \
            self.one_number(plugin.values[name][2], made, default)

    def one_number(self, place, spectrum, default):
        self.losses.add(place, "a spectrum where crt has a number", "its mean")
        found = spectra.mean(spectrum)
        return default if found is None else found

    def constant(self, plugin, name, default):
        """A number and no texture."""
        made = self.number(plugin, name, default)
        if isinstance(made, dict):
            self.losses.add(plugin.place, f"a texture as '{name}' of {plugin}", f"{default:g}")
            return default
        return made

    def spectrum(self, plugin, name, default):
        """A spectrum of any size, such as an index of refraction."""
        if part := plugin.part(name):
            made = self.texture(part)
            if isinstance(made, dict) and {"texture", "checker", "attribute"} & set(made):
                self.losses.add(part.place, f"a texture as '{name}'", f"{default:g}")
                return default
        else:
            made = self.plain(plugin, name, default)
        if isinstance(made, dict) and "rgb" in made:
            self.losses.add(plugin.place_of(name), f"a colour as '{name}' of {plugin}",
                            spectra.COLOR_OF_ANY_SIZE)
            return spectra.of_color(made["rgb"])
        if isinstance(made, dict) and ("table" in made or "file" in made):
            made = made | ({"outside": "clamp"} if "outside" in made else {})
        return made

    def emission(self, plugin, name, default=1.0):
        """A spectrum of a light. A number is D65 of that luminance; <spectrum> is the same at all
        wavelengths, and of sets of them absolute."""
        if part := plugin.part(name):
            return self.emitted(part)
        value, tag = plugin.get(name, default), plugin.values.get(name, (0, "float"))[1]
        if isinstance(value, (int, float)):
            return float(max(value, 0)) if tag == "spectrum" else spectra.d65(max(value, 0))
        return spectra.rgb(value) if isinstance(value, list) else self.form(value)

    def plain(self, plugin, name, default):
        return self.form(plugin.get(name, default))

    def form(self, value):
        """A parameter's value, as mitsuba_tree has it, in crt's form."""
        if isinstance(value, (bool, str, np.ndarray)):
            return 0.5
        if isinstance(value, (int, float)):
            return float(value)
        if isinstance(value, dict) and "nm" in value:
            return spectra.table(value["nm"], value["values"])
        if isinstance(value, dict) and "kelvin" in value:
            return {"blackbody": min(max(value["kelvin"], 100), 1e7), "normalise": False} | (
                {} if value["scale"] == 1 else {"scale": value["scale"]})
        if isinstance(value, dict):
            try:
                return spectra.table(*spectra.read_spd(value["file"]))
            except (OSError, ValueError) as error:
                refuse(value["place"], f"'{value['file']}' cannot be read: {error}")
        value = list(value)
        return value[0] if spectra.is_grey(value) else spectra.rgb(value)

    @staticmethod
    def at_most_one(made):
        if isinstance(made, (int, float)):
            return min(max(made, 0), 1)
        if "rgb" in made:
            return made | {"rgb": [min(v, 1.0) for v in made["rgb"]]}
        if "table" in made:
            return made | {"table": made["table"] | {"value": [min(v, 1.0) for v in made["table"]["value"]]}}
        return made

    # Plugins of textures and spectra.

    def texture(self, plugin, numbers=False):
        step(plugin.place)
        made = getattr(self, "of_" + plugin.kind, None)
        if made is None:
            self.losses.add(plugin.place, f"texture '{plugin.kind}'", "0.5")
            plugin.left.clear()
            return 0.5
        if plugin.kind in ("bitmap", "checkerboard") and not self.has_uvs:
            self.losses.add(plugin.place, "a texture on a mesh without texture coordinates", "0.5")
            return 0.5
        found = made(plugin, numbers)
        plugin.unused(self.losses, {"accel", "format", "raw"})
        return found

    def surface_light(self, plugin):
        """The keys of an emission for a light of a surface."""
        part = plugin.part("radiance")
        if part is None or part.kind != "bitmap":
            return {"radiance": self.emission(plugin, "radiance")}
        found = self.pixels_of_light(part)
        image = None if found is None else emitted(found)
        if not self.has_uvs or image is None:
            return {"radiance": self.mean_light(part, found)}
        return {"radiance": image["radiance"], "color": image["color"] | self.sampled(part)}

    def pixels_of_light(self, plugin):
        path, _ = self.image(plugin)
        found = None if path is None else pixels(path, plugin.get("raw", False))
        if path is not None and found is None:
            self.losses.add(plugin.place, f"a texture of type '{path.suffix}' that emits light",
                            "white of radiance 1", large=True)
        return found

    def mean_light(self, plugin, found):
        if found is None:
            return spectra.d65(1)
        self.losses.add(plugin.place, "a texture that emits light", "its mean colour", large=True)
        return spectra.rgb(found.mean((0, 1)).tolist())

    def emitted(self, plugin):
        if plugin.kind == "bitmap":
            return self.mean_light(plugin, self.pixels_of_light(plugin))
        if plugin.kind == "d65":
            scale = plugin.number("scale", 1)
            color = plugin.get("color")
            return spectra.d65(scale) if color is None or isinstance(color, float) else \
                spectra.rgb(color, scale)
        made = self.texture(plugin)
        if isinstance(made, dict) and {"texture", "checker", "attribute"} & set(made):
            self.losses.add(plugin.place, "a texture that emits light", "D65", large=True)
            return spectra.d65(1)
        return made

    def of_uniform(self, plugin, numbers):
        return plugin.number("value", 1)

    def of_rawconstant(self, plugin, numbers):
        return self.form(plugin.get("value", 1.0))

    def of_srgb(self, plugin, numbers):
        made = self.form(plugin.get("color", [0.5, 0.5, 0.5]))
        return made

    of_rgb = of_srgb

    def of_d65(self, plugin, numbers):
        return spectra.d65(plugin.number("scale", 1))

    def of_blackbody(self, plugin, numbers):
        return self.form({"kelvin": plugin.number("temperature", 6500), "scale": plugin.number("scale", 1)})

    def of_irregular(self, plugin, numbers):
        if plugin.has("value"):
            return self.form(plugin.get("value"))
        nm, values = self.words(plugin, "wavelengths"), self.words(plugin, "values")
        if len(nm) != len(values) or not nm:
            refuse(plugin.place, f"{len(nm)} wavelengths do not go with {len(values)} values")
        return spectra.table(nm, values)

    def of_discrete(self, plugin, numbers):
        self.losses.add(plugin.place, "a spectrum of single wavelengths", "lines 2 nm wide")
        nm, values = self.words(plugin, "wavelengths"), self.words(plugin, "values")
        lines = [(n + d, v * (d == 0)) for n, v in zip(nm, values or [1] * len(nm)) for d in (-1, 0, 1)]
        return spectra.table(*zip(*lines)) if lines else 0.0

    def of_regular(self, plugin, numbers):
        values = self.words(plugin, "values")
        low = plugin.number("wavelength_min", plugin.get("lambda_min", 360.0))
        high = plugin.number("wavelength_max", plugin.get("lambda_max", 830.0))
        if len(values) < 2 or not 0 < low < high:
            refuse(plugin.place, "a regular spectrum has two values or more, and wavelength_min below "
                                 "wavelength_max")
        return spectra.table(np.linspace(low, high, len(values)), values)

    def words(self, plugin, name):
        text = plugin.get(name, "")
        try:
            found = [float(word) for word in str(text).replace(",", " ").split()]
        except ValueError:
            found = [math.nan]
        if not np.isfinite(found).all():
            refuse(plugin.values[name][2], f"'{name}' is a list of numbers, not '{text}'")
        return found

    def of_checkerboard(self, plugin, numbers):
        # Mitsuba's squares have a side of one half, and numbers come in the other order than colours.
        names = ("color1", "color0") if numbers else ("color0", "color1")
        read = self.number if numbers else self.reflectance
        colors = [read(plugin, name, {"color0": 0.4, "color1": 0.2}[name]) for name in names]
        half = np.diag([2.0, 2.0, 1.0])
        return {"checker": colors} | self.placed(plugin, half @ flat(plugin.transform("to_uv")) @ self.uv)

    def of_mesh_attribute(self, plugin, numbers):
        name = str(plugin.get("name", "vertex_color"))
        if numbers or not self.has_colors or "color" not in name or not name.startswith("vertex_"):
            self.losses.add(plugin.place, f"the mesh attribute '{name}'", "0.5")
            return 0.5
        return {"attribute": "colors"}

    def image(self, plugin):
        """The path of a bitmap, and whether crt reads such files."""
        name = plugin.get("filename")
        if not isinstance(name, str):
            self.losses.add(plugin.place, "a bitmap without a file", "0.5")
            return None, False
        path = present(self.reader.file(plugin.place, name), plugin.values["filename"][2])
        return path, path.suffix.lower() in IMAGES

    def of_bitmap(self, plugin, numbers):
        path, readable = self.image(plugin)
        raw = plugin.get("raw", False)
        if not readable:
            if path:
                self.losses.add(plugin.place, f"images of type '{path.suffix}'", "0.5")
            return 0.5
        made = {"texture": pathlib.Path(path)}
        if raw:
            made["color_space"] = "raw" if numbers else "linear"
        elif numbers and path.suffix.lower() in BYTES:
            made = decoded(self.losses, plugin.place, path)
        return made | self.sampled(plugin)

    def sampled(self, plugin):
        """The keys of a bitmap's look-up."""
        wrap, filtering = plugin.text("wrap_mode", "repeat"), plugin.text("filter_type", "bilinear")
        made = {"wrap": wrap} if wrap in ("mirror", "clamp") else {}
        if filtering == "nearest":
            made["filter"] = "nearest"
        return made | self.placed(plugin, FLIP_V @ flat(plugin.transform("to_uv")) @ self.uv)

    def placed(self, plugin, matrix):
        keys = uv_keys(matrix)
        if keys is None:
            self.losses.add(plugin.place, "a sheared texture", "the texture, not placed")
            return {}
        return keys
