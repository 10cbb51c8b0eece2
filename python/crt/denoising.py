"""Open Image Denoise: a guess at the image without its noise, kept apart from what was measured."""

import functools
import os
import pathlib
import tempfile

import numpy as np

from . import _crt
from .errors import Error, Kind
from .pictures import png, texts
from .rendering import Result, develop, planes

MARK = "crt/denoised"
# Of the header of a measured image: what a denoised one cannot say of itself.
MEASURED_ONLY = ("channels", "type", "crt/errorDegreesOfFreedom", "spectralLayoutVersion", "emissiveUnits")


class Denoised:
    """An image that Open Image Denoise made of a film. It is no measurement: what it leaves out and makes up
    is not known, and so it has no error.

    made_with  "Open Image Denoise 2.5.1 of 16 samples a pixel, with albedo and normal"
    """

    def __init__(self, film, guides, measured=()):
        self._film = film
        self._guides = guides
        self._measured = {os.path.realpath(path) for path in measured}
        version = library("pyoidn").version.oidn_version
        names = f", with {' and '.join(guides)}" if guides else ""
        self.made_with = f"Open Image Denoise {version} of {film.samples} samples a pixel{names}"

    @functools.cached_property
    def image(self):
        """Radiance in the scene's colour space: float32, (height, width, 3), top row first, linear, never
        below 0."""
        return filtered(develop(self._film), self._guides)

    @functools.cached_property
    def display(self):
        """The same with the scene's exposure and white balance, as for .png, still linear."""
        return filtered(develop(self._film, for_display=True), self._guides)

    def save(self, path):
        """Writes .exr, with the metadata of the measured image, or .png; both say that they are denoised:
        the attribute or text `crt/denoised` is `made_with`.

        A file that is there and is no denoised image is left alone, and so is a name under which the result
        was saved. Raises crt.Error of kind USAGE then and for other extensions, of kind OUTPUT where the
        file cannot be written."""
        path = pathlib.Path(path)
        write = {".exr": self._write_exr, ".png": self._write_png}.get(path.suffix)
        if write is None:
            raise Error(f"a denoised image is saved as .exr or .png, and not as '{path.name}'", Kind.USAGE)
        if os.path.realpath(path) in self._measured or os.path.lexists(path) and mark_of(path) is None:
            raise Error(f"'{path}' holds the measured image, or is not a denoised image, so crt does not "
                        f"replace it. Choose another name, such as "
                        f"'{path.with_suffix('')}.denoised{path.suffix}'?", Kind.USAGE)
        try:
            with tempfile.TemporaryDirectory(dir=path.parent, prefix=".crt-denoised-") as folder:
                written = pathlib.Path(folder, f"image{path.suffix}")
                write(written)
                os.replace(written, path)
        except OSError as error:
            raise Error(f"'{path}' cannot be written: {error.strerror or error}", Kind.OUTPUT) from error

    def _write_exr(self, path):
        exr = library("OpenEXR")
        measured = f"{path}.measured.exr"
        self._film.save_image(measured)
        header = {name: value for name, value in exr.File(measured, header_only=True).header().items()
                  if name not in MEASURED_ONLY}
        os.remove(measured)
        header[MARK] = self.made_with
        header["compression"] = exr.ZIP_COMPRESSION
        exr.File(header, {"RGB": np.ascontiguousarray(self.image)}).write(str(path))

    def _write_png(self, path):
        path.write_bytes(png(self.display, {MARK: self.made_with}))

    def _repr_png_(self):
        return png(self.display, {MARK: self.made_with})

    def __repr__(self):
        return f"<crt.Denoised {self._film.width} x {self._film.height}, {self.made_with}>"


def denoise(result, *, aovs=None):
    """A guess at the image without its noise, by Open Image Denoise on the processor, which needs
    the libraries pyoidn and OpenEXR.

    result  a crt.Result or crt.Film
    aovs    names of the planes that guide it, of "albedo" and "normal"; those that the film has when None. A
            scene's outputs ask for them: `aovs: [albedo, normal]`. Without them textures blur.

    Returns a crt.Denoised. Values below 0, which saturated colours have outside of sRGB, count as 0. The
    film and what was saved of it stay as they are. Raises crt.Error of kind USAGE where the film lacks a
    plane.
    """
    film = result.film if isinstance(result, Result) else result
    if not isinstance(film, _crt.Film):
        raise TypeError(f"what is denoised is a crt.Result or a crt.Film, and no {type(result).__name__}")
    names = [name for name in ("albedo", "normal") if name in film.aovs] if aovs is None else list(aovs)
    for name in names:
        if name not in ("albedo", "normal"):
            raise Error(f"'{name}' cannot guide the denoiser; use albedo and normal", Kind.USAGE)
    if names == ["normal"]:
        raise Error("the denoiser takes normals only together with albedo", Kind.USAGE)
    return Denoised(film, planes(film, names), result.saved if isinstance(result, Result) else ())


def filtered(developed, guides):
    limits = {"albedo": (0, 1), "normal": (-1, 1)}
    clipped = {name: np.clip(np.nan_to_num(plane), *limits[name]).astype(np.float32)
               for name, plane in guides.items()}
    color = np.maximum(np.nan_to_num(developed.pixels[..., :3]), 0).astype(np.float32)
    return library("pyoidn").denoise(color, hdr=True, **clipped)


def mark_of(path):
    """The metadata of a denoised file; None if it is not a denoised image."""
    try:
        if path.suffix == ".png":
            return texts(path.read_bytes()).get(MARK)
        return library("OpenEXR").File(str(path), header_only=True).header().get(MARK)
    except (OSError, RuntimeError, ValueError):
        return None


def library(name):
    try:
        if name == "pyoidn":
            import pyoidn
            return pyoidn
        import OpenEXR
        return OpenEXR
    except ImportError as error:
        raise Error(f"denoising needs {name} ({error}): pip install pyoidn OpenEXR", Kind.USAGE) from error
