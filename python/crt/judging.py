"""Judgements: are two images the same, how large is the error after a given time, does a backend reproduce
known results? The program crt judges; its figures come back as dicts."""

import contextlib
import json
import os
import pathlib
import tempfile

from . import _crt, program
from .errors import Error, Kind
from .rendering import Result, as_scene

DIFFER = 7


class Judgement:
    """The result of a check.

    passed   whether the exit code of the program would be 0
    figures  everything in numbers, a dict; its keys are those of the JSON that the program writes
    folder   pathlib.Path of the folder that holds more, or None
    """

    def __init__(self, passed, figures, folder=None):
        self.passed = passed
        self.figures = figures
        self.folder = folder

    def __bool__(self):
        return self.passed

    def __repr__(self):
        where = f", more in '{self.folder}'" if self.folder else ""
        return f"<crt.Judgement {'passed' if self.passed else 'FAILED'}{where}>"


def compare(a, b, *, tolerance=0.0, all_channels=False):
    """Compares two images: paths, crt.Image, crt.Film or Result. Films and results are compared as the .exr
    that they would be written as, with the variance that they know.

    tolerance     root mean square difference, as a share of b's mean, that counts as equal; 0: the same bits
    all_channels  every channel, not only R, G and B

Returns a Judgement; `figures` has the differing pixels, the metrics and, if an image states its noise,
    whether the difference is noise or bias. Raises crt.Error for files that are no images.
    """
    with tempfile.TemporaryDirectory(prefix="crt-compare-") as folder:
        files = [image_file(image, pathlib.Path(folder, name)) for image, name in ((a, "a"), (b, "b"))]
        channels = ["--all-channels"] if all_channels else []
        names = map(program.file_argument, files)
        code, printed = program.run(["compare", *names, "--tolerance", tolerance, *channels, "--json"],
                                    answers=(0, DIFFER))
    return Judgement(code == 0, json.loads(printed))


def image_file(image, stem):
    """The path of an image that the program reads; written as `stem`.exr where it is no file yet."""
    if isinstance(image, (str, os.PathLike)):
        return os.fspath(image)
    path = f"{stem}.exr"
    if isinstance(image, Result):
        image = image.film
    if isinstance(image, _crt.Film):
        image.save_image(path)
    elif isinstance(image, _crt.Image):
        image.save(path)
    else:
        raise TypeError("an image is a path, crt.Image, crt.Film or crt.Result, and no "
                        f"{type(image).__name__}")
    return path


def converge(scenes, output, *, backends=None, vary=None, references=(), time_limit=None, replicates=None,
             max_spp=None, resolution=None, resume=False, device=None, threads=0):
    """Measures error against run time, as `crt converge` does, into the folder `output`.

    scenes      a scene as crt.render takes it, or a list of them, with the same values set in all
    backends    names; all that can run when None
    vary        a dict of keys and lists of values: each combination is measured
    references  paths of `crt reference`, or luminances of every pixel; made by the run when there are none
    time_limit  seconds for everything (60)
    replicates  seeds of each, at least
    max_spp     no more samples a pixel
    resolution  longer side in pixels, where the scene's film.resolution was not set (128); 0: the scene's
    resume      continue the run in that folder, with the same experiment

    Returns a Judgement, which has not passed when a backend is wrong; `figures` are the folder's manifest.
    """
    arguments = ["converge", "-o", output, "-q"]
    if resume:
        arguments.append("--resume")
    if backends:
        arguments += ["--backends", ",".join(backends)]
    for key, values in (vary or {}).items():
        arguments += ["--vary", f"{key}=" + ",".join(word(value) for value in values)]
    for reference in references:
        arguments += ["--reference", reference]
    arguments += options({"--time": time_limit, "--replicates": replicates, "--max-spp": max_spp,
                          "--resolution": resolution, "--device": device, "--threads": threads or None})
    with contextlib.ExitStack() as files:
        shown = [files.enter_context(as_scene(scene).arguments()) for scene in listed(scenes)]
        settings = {tuple(scene[1:]) for scene in shown}
        if len(settings) != 1:
            raise Error("the scenes of one run must have the same values set", Kind.USAGE)
        names = [program.file_argument(scene[0]) for scene in shown]
        code, _ = program.run([*arguments, *names, *settings.pop()], answers=(0, DIFFER))
    folder = pathlib.Path(output)
    return Judgement(code == 0, json.loads((folder / "manifest.json").read_text("utf-8")), folder)


def verify(backend="auto", *, cases=(), level="commit", output=None, device=None, threads=0):
    """Asks a backend what physics, geometry and arithmetic demand, as `crt verify` does (docs/stability.md).

    cases   ids (A03), names (furnace) or groups (H); all of the level when there are none
    level   "commit" (a minute or so), "merge" or "nightly"
    output  a folder for the page and its figures; none when None

    Returns a Judgement; `figures["cases"]` has each case with what was expected and measured.
    """
    with tempfile.TemporaryDirectory(prefix="crt-verify-") as temporary:
        folder = pathlib.Path(output if output is not None else temporary)
        code, _ = program.run(["verify", "--backend", backend, "--level", level, "-o", folder, "-q",
                               *options({"--case": ",".join(cases) or None, "--device": device,
                                         "--threads": threads or None})], answers=(0, DIFFER))
        figures = json.loads((folder / "verify.json").read_text("utf-8"))
    return Judgement(code == 0, figures, folder if output is not None else None)


def options(values):
    return [word for item in values.items() if item[1] is not None for word in item]


def listed(scenes):
    return scenes if isinstance(scenes, (list, tuple)) else [scenes]


def word(value):
    return str(value).lower() if isinstance(value, bool) else str(value)
