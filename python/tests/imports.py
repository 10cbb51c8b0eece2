"""Scenes of other programs as the tests of importers write them."""

import contextlib
import logging
import time

import numpy as np

import crt
from crt import pictures

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def written(folder, name, text):
    """The path of a file; `text` may be bytes."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@contextlib.contextmanager
def quiet():
    """crt warns of lights that face away, which some tests are about."""
    before = logging.getLogger("crt").level
    logging.getLogger("crt").setLevel(logging.ERROR)
    yield
    logging.getLogger("crt").setLevel(before)


@contextlib.contextmanager
def at_most(processor_seconds):
    """Fails where this process computes for longer, on all its threads together."""
    before = time.process_time()
    yield
    took = time.process_time() - before
    assert took < processor_seconds, f"{took:.1f} s of a processor, not {processor_seconds}"


def rendered(scene, spp=16):
    """(height, width, 3)."""
    with quiet():
        return crt.render(scene, spp=spp, threads=1).image


def imported(path, spp=16):
    return rendered(crt.import_scene(path).scene, spp)


def near(value, wanted, share=0.01):
    assert abs(value - wanted) <= share * abs(wanted) + 1e-6, (value, wanted)


def quadrants(image):
    """Means of the colours of top left, top right, bottom left and bottom right: (2, 2, 3)."""
    height, width = image.shape[:2]
    return image.reshape(2, height // 2, 2, width // 2, 3).mean((1, 3))


def pfm(pixels):
    """The bytes of a PFM: top row first in `pixels` (height, width, 3)."""
    pixels = np.asarray(pixels, "<f4")
    return f"PF\n{pixels.shape[1]} {pixels.shape[0]}\n-1.0\n".encode() + pixels[::-1].tobytes()


def write_png(path, pixels):
    """`pixels` (height, width, 3): the bytes of the file, which are sRGB-encoded."""
    path.write_bytes(pictures.png(np.where(pixels / 255 <= 0.04045, pixels / 255 / 12.92,
                                           ((pixels / 255 + 0.055) / 1.055)**2.4)))


def whats(path):
    """The entries of an import: each by its place."""
    return {f"{loss.first.line}": (loss.what, loss.instead, loss.count)
            for loss in crt.import_scene(path).losses}
