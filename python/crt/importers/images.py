"""Images as arrays, where crt is to have other numbers than those of a file."""

import os

import numpy as np

from .. import _crt
from ..errors import Error

IMAGES = (".png", ".jpg", ".jpeg", ".tga", ".exr", ".hdr", ".rgbe", ".pfm")
BYTES = (".png", ".jpg", ".jpeg", ".tga")  # Files of 8 or 16 bits, which are sRGB-encoded.


def pixels(path, raw=False):
    """An image as (height, width, 3), linear, or `raw`: with the numbers of the file; None where crt cannot
    read it as one."""
    try:
        image = _crt.Image.load(os.fspath(path))
    except Error:
        return None
    names = [name.rpartition(".")[2].upper() for name in image.channels]
    order = [names.index(c) for c in "RGB"] if set("RGB") <= set(names) else [0, 0, 0]
    made = np.array(image.pixels)[:, :, order]
    if raw and path.suffix.lower() in BYTES:
        made = np.where(made <= 0.0031308, 12.92 * made, 1.055 * made ** (1 / 2.4) - 0.055)
    return made.astype(np.float32)


def emitted(image):
    """Pixels of light as the keys of an emission: the radiance of the brightest number, in D65, and the
    image as a share of it. None where all are black."""
    most = float(np.max(image, initial=0))
    if not most > 0:
        return None
    shares = np.clip(image / most, 0, 1).astype(np.float32)
    return {"radiance": {"rgb": [1.0, 1.0, 1.0], "space": "linear", "scale": most},
            "color": {"texture": shares, "color_space": "linear"}}


def powered(made, power):
    """A texture of numbers with its values, held within [0, 1], to a power; None where crt cannot read its
    image."""
    if "checker" in made and all(isinstance(v, float) for v in made["checker"]):
        return made | {"checker": [min(max(v, 0.0), 1.0) ** power for v in made["checker"]]}
    image = made.get("texture")
    if image is not None and not hasattr(image, "dtype"):
        image = pixels(image, made.get("color_space") == "raw")
    if image is None:
        return None
    values = image[:, :, 0] if image.ndim == 3 else image
    kept = {key: value for key, value in made.items() if key != "factor"}
    return kept | {"texture": np.clip(values * made.get("factor", 1), 0, 1).astype(np.float32) ** power,
                   "color_space": "raw"}
