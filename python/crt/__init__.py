"""crt in Python: scenes, renders, films and images of the spectral path tracer crt, as NumPy arrays.

    import crt

    scene = crt.load("cornell_box.yaml", set={"film.resolution": [256, 256]})
    scene["sampler.samples"] = 64
    result = crt.render(scene, backend="auto")
    result.image            # float32, (height, width, 3), top row first, linear
    result.error            # the error that the image estimates of itself
    result.save("box.png")

A film from Python has the bits of one from the program `crt`: the same scene, seed and samples give the same
sums on every backend, however the samples are split. Films of different samples of one scene add:
`a.film + b.film` has the bits of one render of all.
"""

import importlib

from . import pickling
from ._crt import Device, ErrorEstimate, Film, Image, Plugin, bits_version
from ._crt import version as _version
from .denoising import Denoised, denoise
from .errors import Error, Kind, MissingKey, RenderFailed
from .importers import Imported, import_scene
from .judging import Judgement, compare, converge, verify
from .rendering import Result, Session, develop, plugins, render
from .scenes import Scene, example, examples, load, scene

pickling.register()
__version__ = _version()
__all__ = ["Denoised", "Device", "Error", "ErrorEstimate", "Film", "Image", "Imported", "Judgement", "Kind",
           "MissingKey", "Plugin", "RenderFailed", "Result", "Scene", "Session", "bits_version", "compare",
           "converge", "denoise", "develop", "example", "examples", "import_scene", "load", "plugins",
           "render", "scene", "verify"]


def __getattr__(name):
    """crt.distributed, imported on first use because it imports Dask."""
    if name == "distributed":
        return importlib.import_module(".distributed", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
