"""Spectra of other programs as crt's YAML has them, and their luminance."""

import math
import pathlib

import numpy as np

from .losses import reads

# The luminous efficiency of photopic vision, CIE 1931, every 10 nm from 360 nm (ISO/CIE 11664-1).
EFFICIENCY_NM = np.arange(360, 831, 10)
EFFICIENCY = np.array([
    3.917e-6, 1.239e-5, 3.9e-5, 1.2e-4, 3.96e-4, 1.21e-3, 4e-3, 1.16e-2, 2.3e-2, 3.8e-2, 6e-2, 9.098e-2,
    0.13902, 0.20802, 0.323, 0.503, 0.71, 0.862, 0.954, 0.99495, 0.995, 0.952, 0.87, 0.757, 0.631, 0.503,
    0.381, 0.265, 0.175, 0.107, 6.1e-2, 3.2e-2, 1.7e-2, 8.21e-3, 4.102e-3, 2.091e-3, 1.047e-3, 5.2e-4,
    2.492e-4, 1.2e-4, 6e-5, 3e-5, 1.499e-5, 7.466e-6, 3.703e-6, 1.836e-6, 9.11e-7, 4.52e-7])
GRID_NM = np.arange(360, 831)
GRID = np.interp(GRID_NM, EFFICIENCY_NM, EFFICIENCY)

METALS = ("Ag", "Al", "Au", "Cu")  # The same numbers as in pbrt and Mitsuba.
# Reflectances straight on: means of 600 to 700, 500 to 570 and 430 to 480 nm of `crt data metals/…`.
METAL_COLORS = {"Ag": [0.970, 0.956, 0.922], "Al": [0.912, 0.922, 0.924], "Au": [0.941, 0.751, 0.389],
                "Cu": [0.929, 0.624, 0.556], "Ti": [0.615, 0.576, 0.547], "V": [0.528, 0.538, 0.563],
                "Cr": [0.556, 0.556, 0.555], "Mn": [0.604, 0.572, 0.546], "Fe": [0.532, 0.512, 0.497],
                "Co": [0.685, 0.652, 0.622], "Ni": [0.699, 0.635, 0.574], "Pd": [0.734, 0.693, 0.659],
                "Zn": [0.738, 0.769, 0.768], "Mo": [0.600, 0.605, 0.601], "Nb": [0.504, 0.507, 0.503],
                "Pt": [0.678, 0.635, 0.591], "Ir": [0.745, 0.729, 0.705], "Rh": [0.796, 0.763, 0.744],
                "W": [0.516, 0.494, 0.471], "Hg": [0.782, 0.779, 0.779], "CuZn": [0.885, 0.752, 0.461]}
OTHER_DATA = "its indices by another publication"


def rgb(values, scale=1):
    """A linear colour with sRGB primaries. Negative numbers become 0."""
    made = [float(max(v, 0)) for v in values]
    return {"rgb": made, "space": "linear"} | ({} if scale == 1 else {"scale": float(scale)})


def d65(scale):
    """D65 whose luminance is `scale`."""
    return {"illuminant": "D65", "scale": float(scale)}


def table(nm, values, outside="zero", scale=1):
    """Samples in any order; of equal wavelengths the first counts. One value is the same at all."""
    pairs = sorted({float(n): float(v) for n, v in reversed(list(zip(nm, values)))}.items())
    if len(pairs) == 1:
        return pairs[0][1] * scale
    made = {"table": {"nm": [n for n, _ in pairs], "value": [max(v, 0.0) for _, v in pairs]}}
    if pairs[0][0] > 360 or pairs[-1][0] < 830:
        made["outside"] = outside
    return made | ({} if scale == 1 else {"scale": float(scale)})


COLOR_OF_ANY_SIZE = "its numbers at 610, 540 and 460 nm, and a straight line between them"


def of_color(values):
    """A spectrum of any size, such as an index of refraction, that a file gives as [r, g, b]."""
    red, green, blue = values
    return table([460, 540, 610], [blue, green, red], "clamp")


def read_spd(path):
    """Wavelengths and values of a file of two columns. Raises ValueError, with the line, or OSError."""
    most = 1 << 26  # Bytes: a hundred times the longest tables.
    path = pathlib.Path(path)
    if not path.is_file():
        raise ValueError("it is no file")
    if path.stat().st_size > most:
        raise ValueError(f"it has more than {most >> 20} MB")
    reads(path)
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            nm, value = map(float, words)
        except ValueError:
            raise ValueError(f"line {number} is not a wavelength with a value: {line.strip()!r}") from None
        found.append((nm, value))
    if not found:
        raise ValueError("no line has a wavelength and a value")
    return zip(*found)


def is_grey(values):
    return len(set(values)) == 1


def scaled(spectrum, factor):
    """The spectrum of crt times a number."""
    if factor == 1:
        return spectrum
    if isinstance(spectrum, (int, float)):
        return spectrum * factor
    return spectrum | {"scale": spectrum.get("scale", 1) * float(factor)}


def largest(spectrum):
    """The largest value of a reflectance by a number, a colour or a table; 0 of others."""
    if isinstance(spectrum, (int, float)):
        return spectrum
    values = spectrum.get("rgb") or spectrum.get("table", {}).get("value", [0])
    return max(values) * spectrum.get("scale", 1)


LEAST_INDEX = 0.01


def index_above_0(index):
    """An index of refraction, whose values of 0 or less become LEAST_INDEX; and whether it had any."""
    if isinstance(index, (int, float)):
        return max(index, LEAST_INDEX), index <= 0
    if "table" not in index:
        return index, False
    found = index["table"]["value"]
    raised = [value if value > 0 else LEAST_INDEX for value in found]
    return index | {"table": index["table"] | {"value": raised}}, raised != found


def planck(kelvin, nm):
    """W·m⁻²·sr⁻¹·nm⁻¹."""
    metres = np.asarray(nm, float) * 1e-9
    exponent = np.minimum(0.014387768775 / (metres * kelvin), 700)
    return 1.1910429724e-16 / metres**5 / np.expm1(exponent) * 1e-9


def luminance(spectrum):
    """∫ L y dλ / ∫ y dλ of the spectrum L of a light: the Y that its radiance gives. None where it
    is not known (a name, a file)."""
    if isinstance(spectrum, (int, float)):
        return float(spectrum)
    scale = spectrum.get("scale", 1)
    if "illuminant" in spectrum:
        return scale
    if "rgb" in spectrum:
        return scale * float(np.dot([0.212639, 0.715169, 0.072192], spectrum["rgb"]))
    if "blackbody" in spectrum:
        values = planck(spectrum["blackbody"], GRID_NM)
        if spectrum.get("normalise", True):
            values = values / values.max()
    elif "table" in spectrum:
        nm, value = spectrum["table"]["nm"], spectrum["table"]["value"]
        beyond = {} if spectrum.get("outside") == "clamp" else {"left": 0, "right": 0}
        values = np.interp(GRID_NM, nm, value, **beyond)
    else:
        return None
    return scale * float(values @ GRID / GRID.sum())


def mean(spectrum):
    """One number for a spectrum, where only a number will do."""
    if isinstance(spectrum, (int, float)):
        return float(spectrum)
    if "table" in spectrum:
        return float(np.mean(spectrum["table"]["value"])) * spectrum.get("scale", 1)
    if "rgb" in spectrum:
        return float(np.mean(spectrum["rgb"])) * spectrum.get("scale", 1)
    return None


def roughness(alpha):
    """crt's, which is the square root of GGX's width, for that width."""
    return min(math.sqrt(max(alpha, 0)), 1.0)


def anisotropic(along, across):
    """The keys of crt for GGX's widths along the tangent and across it."""
    if along == across:
        return {"roughness": roughness(along)}
    turned = along < across
    wide, narrow = max(along, across), max(min(along, across), 0)
    share = narrow / wide
    made = {"roughness": roughness(wide * math.sqrt((1 + share**2) / 2)),
            "roughness_anisotropy": 1 - share}
    return made | ({"anisotropy_rotation_deg": 90} if turned else {})
