"""Spectra and textures of pbrt's parameters as crt has them."""

import math

import numpy as np

from . import spectra
from .losses import absence, present, refuse, step, suggestion
from .images import BYTES, IMAGES, pixels
from .mitsuba_values import decoded
from .pbrt_text import TYPES, only

GLASSES = {"BK7": "N-BK7", "BAF10": "N-BAF10", "FK51A": "N-FK51A", "LASF9": "N-LASF9", "F10": "SF10",
           "F11": "SF11"}
# Indices at 587.6 nm and Abbe's numbers of the catalogue.
OTHER_GLASSES = {"F5": (1.67270, 32.21)}
ILLUMINANTS = ("A", "D50", "D65", "F2", "F7", "F11")
NEAREST_ILLUMINANT = {"stdillum-F1": "F7", "stdillum-F3": "F2", "stdillum-F4": "F2", "stdillum-F5": "F7",
                      "stdillum-F6": "F2", "stdillum-F8": "F7", "stdillum-F9": "F2", "stdillum-F10": "F11",
                      "stdillum-F12": "F11", "illum-acesD60": "D65"}
# From linear colours of other primaries to linear sRGB.
TO_SRGB = {
    "srgb": np.eye(3),
    "rec2020": np.array([[1.6604910, -0.5876411, -0.0728499], [-0.1245505, 1.1328999, -0.0083494],
                         [-0.0181508, -0.1005789, 1.1187297]]),
    "dci-p3": np.array([[1.2249402, -0.2249402, 0], [-0.0420570, 1.0420570, 0],
                        [-0.0196376, -0.0786361, 1.0982736]]),
    "aces2065-1": np.array([[2.5216861, -1.1341309, -0.3875552], [-0.2764799, 1.3727191, -0.0962392],
                            [-0.0153781, -0.1529753, 1.1683534]])}


def cauchy(index, abbe):
    """A + B/λ², λ in µm, through an index at 587.6 nm with Abbe's number."""
    slope = (index - 1) / abbe / (1 / 0.4861**2 - 1 / 0.6563**2)
    return {"cauchy": [index - slope / 0.5876**2, slope]}


class Values:
    def __init__(self, state, losses):
        self.state, self.losses = state, losses

    # Spectra.

    def rgb(self, parameters, values, place):
        space = getattr(parameters, "color_space", "srgb")
        if space not in TO_SRGB:
            self.losses.add(place, f"the colour space '{space}'{suggestion(space, TO_SRGB)}", "srgb")
        return (TO_SRGB.get(space, TO_SRGB["srgb"]) @ values[:3]).tolist()

    def form(self, parameters, name, outside):
        """The spectrum of a parameter: a number, [r, g, b] or a spectrum of crt. None where it has none."""
        kind, values, place = parameters.raw(name)
        if kind == "texture" or len(values) == 0:
            return None
        pair = kind == "blackbody" and len(values) == 2 and self.state.version_3
        if TYPES[kind] and len(values) > TYPES[kind] and not pair:
            self.losses.add(place, f"'{name}' of {parameters} with {len(values) // TYPES[kind]} values",
                            "the first value")
        if kind in ("rgb", "color"):
            return self.rgb(parameters, values, place)
        if kind == "blackbody":
            # pbrt-v3 has a temperature and a scale.
            made = {"blackbody": float(min(max(values[0], 100), 1e7))}
            return spectra.scaled(made, max(values[1], 0)) if pair else made
        if isinstance(values, np.ndarray):
            if kind != "spectrum" or len(values) == 1:
                return float(values[0])
            if len(values) % 2 or values[::2].min() <= 0:
                refuse(place, f"'{name}' is pairs of wavelength and value, not {len(values)} numbers")
            return spectra.table(values[::2], values[1::2], outside)
        return self.named(only(values, place, f"'{name}' of {parameters} is one spectrum"), place, outside)

    def named(self, name, place, outside):
        family, _, rest = name.partition("-")
        if family == "metal" and rest.rpartition("-")[2] in ("eta", "k"):
            metal, _, part = rest.rpartition("-")
            if metal in spectra.METAL_COLORS and metal not in spectra.METALS:
                self.losses.add(place, f"the metal '{metal}'", spectra.OTHER_DATA)
            elif metal not in spectra.METALS:
                close = suggestion(metal, spectra.METAL_COLORS)
                self.losses.add(place, f"the metal '{metal}'{close}", "'Al'")
                metal = "Al"
            return {"data": f"metals/{metal}/{'n' if part == 'eta' else 'k'}"}
        if family == "glass":
            if rest in GLASSES:
                return {"glass": GLASSES[rest]}
            if rest not in OTHER_GLASSES:
                known = [*GLASSES, *OTHER_GLASSES]
                self.losses.add(place, f"the glass '{rest}'{suggestion(rest, known)}", "'N-BK7'")
            else:
                self.losses.add(place, f"the glass '{rest}'", "Cauchy's formula with its Abbe number")
            return cauchy(*OTHER_GLASSES[rest]) if rest in OTHER_GLASSES else {"glass": "N-BK7"}
        if family == "stdillum" and rest in ILLUMINANTS:
            return {"illuminant": rest}
        if name in NEAREST_ILLUMINANT:
            self.losses.add(place, f"the illuminant '{name}'", f"'{NEAREST_ILLUMINANT[name]}'")
            return {"illuminant": NEAREST_ILLUMINANT[name]}
        path = self.state.file(place, name)
        if not path.is_file():
            refuse(place, f"'{name}' is not a spectrum of pbrt, and {absence(path)}")
        try:
            return spectra.table(*spectra.read_spd(path), outside)
        except (OSError, ValueError) as error:
            refuse(place, f"'{path}' cannot be read: {error}")

    def unbounded(self, parameters, name, default):
        """Such as an index of refraction."""
        made = self.form(parameters, name, "clamp") if parameters.has(name) else None
        if made is None:
            if parameters.has(name):
                self.losses.add(parameters.values[name][2], f"a texture as '{name}'", "its default")
            return default
        if not isinstance(made, list):
            return made
        if spectra.is_grey(made):
            return made[0]
        self.losses.add(parameters.values[name][2], f"a colour as '{name}' of {parameters}",
                        spectra.COLOR_OF_ANY_SIZE)
        return spectra.of_color(made)

    def light(self, parameters, name, scale):
        """The spectrum of a light. Its luminance is `scale`, independent of its own size; of a colour or a
        spectrum with a factor, times that."""
        made = self.form(parameters, name, "zero") if parameters.has(name) else None
        if made is None:
            return spectra.d65(max(scale, 0))
        if isinstance(made, list):
            return spectra.rgb(made, max(scale, 0))
        own = spectra.luminance(made)
        if not own:
            return spectra.scaled(made, max(scale, 0)) if own is None else 0.0
        if isinstance(made, dict):
            own /= made.get("scale", 1)
        return spectra.scaled(made, max(scale, 0) / own)

    # A value that may be a texture.

    def reflectance(self, parameters, name, default):
        if not parameters.has(name):
            return default
        if parameters.raw(name)[0] == "texture":
            return self.named_texture(parameters, name, "spectrum")
        made = self.form(parameters, name, "zero")
        return default if made is None else bounded(made)

    def named_texture(self, parameters, name, kind, depth=0):
        _, values, place = parameters.raw(name)
        wanted = only(values, place, f"'{name}' of {parameters} is one texture")
        return self.texture(kind, wanted, place, depth)

    def number(self, parameters, name, default):
        """A number, or a texture of numbers."""
        if not parameters.has(name):
            return default
        kind, values, place = parameters.raw(name)
        if kind == "texture":
            return self.named_texture(parameters, name, "float")
        if kind in ("float", "integer") or (isinstance(values, np.ndarray) and len(values) == 1):
            return parameters.number(name, default)
        if kind in ("rgb", "color") and len(values) == 3:
            if np.any(values != values[0]):
                self.losses.add(place, f"a colour as '{name}' of {parameters}", "its mean")
            return float(np.mean(values))
        self.losses.add(place, f"'{name}' of {parameters}", f"{default}")
        return default

    def constant(self, parameters, name, default):
        made = self.number(parameters, name, default)
        if isinstance(made, dict):
            self.losses.add(parameters.values[name][2], f"a texture as '{name}' of {parameters}",
                            f"{default:g}")
            return default
        return made

    def texture(self, kind, name, place, depth=0):
        step(place)
        known = {other for form, other in self.state.textures if form == kind}
        if (kind, name) not in self.state.textures:
            refuse(place, f"there is no texture '{name}' of type '{kind}'" + suggestion(name, known))
        if depth > 32:
            refuse(place, f"the texture '{name}' contains itself")
        found = self.state.textures[kind, name]
        make = getattr(self, "tex_" + found.name, None)
        if make is None:
            makes = [name[4:] for name in dir(self) if name.startswith("tex_")]
            self.losses.add(found.place, f"{found}{suggestion(found.name, makes)}", "0.5")
            return 0.5
        made = make(found, kind, depth + 1)
        for left in sorted(found.left - {"maxanisotropy", "filter"}):
            self.losses.add(found.values[left][2], f"'{left}' of {found}")
        found.left.clear()
        return made

    def part(self, found, kind, name, default, depth):
        """A parameter of a texture."""
        if not found.has(name):
            return default
        form = found.raw(name)[0]
        if form == "texture":
            return self.named_texture(found, name, kind, depth)
        if kind == "float":
            return found.number(name, default)
        made = self.form(found, name, "zero")
        return default if made is None else bounded(made)

    def tex_constant(self, found, kind, depth):
        return self.part(found, kind, "value", 1.0, depth)

    def tex_imagemap(self, found, kind, depth):
        name = found.string("filename")
        if name is None:
            refuse(found.place, "an 'imagemap' has no 'filename'")
        path = present(self.state.file(found.place, name), found.values["filename"][2])
        if path.suffix.lower() not in IMAGES:
            self.losses.add(found.place, f"images of type '{path.suffix}'", "0.5")
            return 0.5
        made = {"texture": path} | self.placed(found)
        encoding = found.string("encoding", "")
        if encoding == "linear":
            made["color_space"] = "linear" if kind == "spectrum" else "raw"
        elif encoding not in ("", "sRGB"):
            self.losses.add(found.place, f"the encoding '{encoding}'", "sRGB")
        elif kind == "float" and path.suffix.lower() in BYTES:
            made |= decoded(self.losses, found.place, path)
        wrap = found.string("wrap", "repeat")
        if wrap == "clamp":
            made["wrap"] = "clamp"
        elif wrap != "repeat":
            self.losses.add(found.place, f"the wrap mode '{wrap}'", "'repeat'")
        if found.string("filter", "bilinear") == "point":
            made["filter"] = "nearest"
        return self.factored(found, made, found.number("scale", 1), found.boolean("invert", False))

    def factored(self, found, made, scale, invert):
        """An image times a number, and 1 minus that."""
        if not invert and 0 <= scale <= 1:
            return made | ({"factor": scale * self.factor(made)} if scale != 1 else {})
        image, raw = made["texture"], made.get("color_space") == "raw"
        image = image if hasattr(image, "dtype") else pixels(image, raw)
        if image is None:
            self.losses.add(found.place, "an image that is inverted or made brighter", "the image as it is")
            return made
        image = image * np.float32(scale)
        image = np.clip(1 - image if invert else image, 0, 1)
        return made | {"texture": image, "color_space": "raw" if raw else "linear"}

    @staticmethod
    def factor(made):
        return made.get("factor", 1)

    def placed(self, found):
        mapping = found.string("mapping", "uv")
        if mapping != "uv":
            self.losses.add(found.place, f"the mapping '{mapping}' of textures", "'uv'")
            for name in ("v1", "v2"):
                found.left.discard(name)
        scale = [found.number("uscale", 1), found.number("vscale", 1)]
        offset = [found.number("udelta", 0), found.number("vdelta", 0)]
        return ({} if scale == [1, 1] else {"scale": scale}) | ({"offset": offset} if any(offset) else {})

    def tex_scale(self, found, kind, depth):
        one = self.part(found, kind, "tex", 1.0, depth)
        other = self.part(found, "float", "scale", 1.0, depth)
        if isinstance(one, (int, float)):
            one, other = other, one
        if not isinstance(other, (int, float)):
            mean = None if "texture" in other or "checker" in other else spectra.mean(other)
            self.losses.add(found.place, "a texture times a texture", "the first alone")
            other = 1.0 if mean is None else mean
        if isinstance(one, (int, float)):
            return one * other
        if "texture" in one:
            if kind == "spectrum" and one.get("color_space") == "raw":  # It was the scale.
                one = one | {"color_space": "linear"}
            return self.factored(found, one, other, False)
        if "checker" in one:
            return one | {"checker": [scaled_part(value, other) for value in one["checker"]]}
        return bounded(spectra.scaled(one, other))

    def tex_mix(self, found, kind, depth):
        one, other = self.part(found, kind, "tex1", 0.0, depth), self.part(found, kind, "tex2", 1.0, depth)
        amount = self.part(found, "float", "amount", 0.5, depth)
        if all(isinstance(v, (int, float)) for v in (one, other, amount)):
            return one * (1 - amount) + other * amount
        self.losses.add(found.place, f"{found}", "the one of its textures that has the larger share")
        return one if isinstance(amount, float) and amount < 0.5 else other

    def tex_checkerboard(self, found, kind, depth):
        one, other = self.part(found, kind, "tex1", 1.0, depth), self.part(found, kind, "tex2", 0.0, depth)
        if found.number("dimension", 2) != 2:
            self.losses.add(found.place, "a checkerboard in three dimensions", "its first value")
            return one
        return {"checker": [one, other]} | self.placed(found)


def scaled_part(value, factor):
    if isinstance(value, (int, float)):
        return value * factor
    if "texture" in value or "checker" in value:
        return value
    return bounded(spectra.scaled(value, factor))


def bounded(made):
    """A reflectance: from 0 to 1."""
    if isinstance(made, list):
        clipped = [float(min(max(v, 0), 1)) for v in made]
        return clipped[0] if spectra.is_grey(clipped) else spectra.rgb(clipped)
    if isinstance(made, (int, float)):
        return float(min(max(made, 0), 1)) if math.isfinite(made) else 0.0
    if "table" in made:
        values = [min(v * made.get("scale", 1), 1.0) for v in made["table"]["value"]]
        made = {key: value for key, value in made.items() if key != "scale"}
        return made | {"table": made["table"] | {"value": values}}
    return made
