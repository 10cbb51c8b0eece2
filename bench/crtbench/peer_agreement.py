"""Do two renderers converge to one image? Means, tiles, and what their tables of the observer account
for."""

import re
import struct
import zlib

import numpy as np


TILES = 8
STUDENT_975 = {
    3: 3.182,
    4: 2.776,
    5: 2.571,
    6: 2.447,
    7: 2.365,
    10: 2.228,
    15: 2.131,
    20: 2.086,
    30: 2.042,
    60: 2.000,
}


def student(dof):
    """The 97.5 % point, from the next smaller tabulated number of degrees of freedom, so never too small."""
    return STUDENT_975[max(k for k in STUDENT_975 if k <= max(3, dof))]


class Pool:
    """The mean of independent renders, each weighted with its samples, and how sure it is."""

    def __init__(self):
        self.images, self.weights = [], []

    def add(self, image, samples):
        self.images.append(image.astype(np.float32))
        self.weights.append(float(samples))

    def mean(self):
        return np.average(self.images, axis=0, weights=self.weights)

    def of(self, function):
        """Mean and variance of that mean of a linear function of the image: renders are unbiased and
        independent, so each is evidence for the other."""
        w = np.array(self.weights) / sum(self.weights)
        values = np.array([function(i) for i in self.images], dtype=np.float64)
        mean = np.tensordot(w, values, 1)
        return mean, np.tensordot(w**2, (values - mean) ** 2, 1) * len(w) / (len(w) - 1)


def tiles(image):
    y = image[:, :, 1].astype(np.float64)
    high, wide = y.shape[0] // TILES, y.shape[1] // TILES
    return y[: high * TILES, : wide * TILES].reshape(TILES, high, TILES, wide).mean(axis=(1, 3))


def ratio(a, b, function):
    """a/b with its standard error, to first order, of a function of both pools."""
    (ma, va), (mb, vb) = a.of(function), b.of(function)
    return ma / mb, np.abs(ma / mb) * np.sqrt(va / ma**2 + vb / mb**2)


def observer_of_crt(repository):
    """x̄, ȳ, z̄ as crt has them, every nm from 360 to 830."""
    text = (repository / "core" / "spectra" / "spectra_data.cpp").read_text()
    columns = [re.search(rf"kCie{axis} = \{{(.*?)\}}", text, re.S)[1] for axis in "XYZ"]
    return np.array([[float(v) for v in c.replace("\n", " ").split(",") if v.strip()] for c in columns]).T


def integral(nm, values):
    return ((values[1:] + values[:-1]) / 2 * np.diff(nm)[:, None]).sum(axis=0)


def predicted_ratios(repository, described, scene):
    """Mitsuba/crt in X, Y, Z that the observer's tables alone account for: light of the lamp after 0 …
    3 reflections by white. Both tables are taken as piecewise linear; Mitsuba's has a node every 5 nm and is
divided by a separate constant, crt's every nm and is divided by ∫ȳdλ.
    """
    fine = np.arange(360.0, 830.0 + 1e-9, 0.125)
    nm = np.arange(360.0, 831.0)
    ours, theirs = observer_of_crt(repository), np.array(described["cie_xyz"])

    def on_fine(given):
        return np.interp(fine, given["nm"], given["value"])

    lamp, white = on_fine(scene["parts"]["lamp"]["radiance"]), on_fine(
        scene["parts"]["white"]["reflectance"]
    )
    # np.interp of Mitsuba's curves, evaluated every nm, is exact: its nodes are whole nm.
    ours_fine, theirs_fine = (np.array([np.interp(fine, nm, c) for c in t.T]).T for t in (ours, theirs))
    our_y = integral(fine, ours_fine)[1]
    rows = []
    for bounces in range(4):
        light = (lamp * white**bounces)[:, None]
        a = integral(fine, light * ours_fine) / our_y
        b = integral(fine, light * theirs_fine) * described["y_normalization"]
        rows.append((b / a).tolist())
    return {
        "mitsuba_over_crt_xyz_by_reflections": rows,
        "crt_y_integral_nm": float(our_y),
        "mitsuba_y_integral_nm": float(integral(fine, theirs_fine)[1]),
        "mitsuba_y_normalization": described["y_normalization"],
    }


def write_png(path, xyz):
    """XYZ to sRGB (IEC 61966-2-1), one stop up, clipped; for looking at."""
    to_rgb = np.array(
        [
            [3.2404542, -1.5371385, -0.4985314],
            [-0.9692660, 1.8760108, 0.0415560],
            [0.0556434, -0.2040259, 1.0572252],
        ]
    )
    linear = np.clip(2 * xyz @ to_rgb.T, 0, 1)
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    rows = b"".join(b"\0" + row.tobytes() for row in np.round(255 * coded).astype(np.uint8))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", xyz.shape[1], xyz.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows, 9))
        + chunk(b"IEND", b"")
    )
