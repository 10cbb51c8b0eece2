"""Scene to film to image."""

import contextlib
import functools
import json
import os
import sys
import threading

from . import _crt
from .errors import Error, Kind
from .messages import LOGGER, tell
from .pictures import png
from .scenes import Scene, load, scene as scene_of


class Result:
    """The result of a render.

    film     crt.Film: sums of samples; films of one scene add
    stop     why sampling ended: "samples", "time", "target" (error), "interrupted" (Ctrl-C), or "stopped"
    report   what the run did and cost, a dict: the report that `crt render --report` writes
    saved    paths under which it was saved; crt.denoise keeps off them
    """

    def __init__(self, film, stop, report):
        self.film = film
        self.stop = stop
        self.report = report
        self.saved = []

    @functools.cached_property
    def image(self):
        """Radiance in the scene's colour space: float32, (height, width, 3), top row first, linear; what an
        .exr holds. (height, width, n) for a film of spectral bins or responses, n channels."""
        return develop(self.film).pixels

    @property
    def error(self):
        """crt.ErrorEstimate, relative to the mean luminance; None where it is not known: too few samples, or
        one Sobol sequence (docs/error.md)."""
        return self.film.error

    @functools.cached_property
    def aovs(self):
        """The AOVs that the scene's outputs ask for, by name: (height, width), or (height, width, 3) for
        albedo and normal, top row first; float32, and uint32 for samples and primitive."""
        return planes(self.film, self.film.aovs)

    def save(self, path):
        """Writes the image as `crt render` does, with all metadata: .exr, .png, .jpg, .ppm or .pfm; or the
        film, as .crtfilm. Raises crt.Error of kind OUTPUT."""
        path = os.fspath(path)
        (self.film.save if path.endswith(".crtfilm") else self.film.save_image)(path)
        self.saved.append(os.path.realpath(path))

    def _repr_png_(self):
        """The picture of a notebook."""
        return png(develop(self.film, for_display=True).pixels[..., :3])

    def __repr__(self):
        error = self.error
        known = f", error {error.half_width_95:.2%}" if error else ""
        if error and error.missing_light:
            known += " + missing light"
        return (f"<crt.Result {self.film.width} x {self.film.height}, {self.film.samples} samples a pixel"
                f"{known}, ended by {self.stop}>")


# These come with every plane of noise, and are separate channels in an EXR.
BESIDE_NOISE = ("HalfWidth95.Y", "OwnVariance.Y")


def planes(film, names):
    """The AOVs of these names, as Result.aovs has them. Raises crt.Error of kind USAGE where the film lacks
    one."""
    others = {*film.develop().channels, *BESIDE_NOISE} if names else ()
    return {name: plane(film.develop(aovs=[name]), others) for name in names}


def plane(image, others):
    """The one AOV of an image, whose channels are those that are not among `others`."""
    own = [i for i, name in enumerate(image.channels) if name not in others]
    array = image.pixels[..., own] if own else image.integers
    return array[..., 0] if array.shape[-1] == 1 else array


def render(scene, *, spp=None, seed=None, backend="auto", devices=None, threads=0, target_error=None,
           time_limit=None, sample_range=None, resume=None, progress=None, use_cache=True,
           estimate_error=True, on_progress=None):
    """Renders a scene: a crt.Scene, a crt.Session, a dict, or the path of a file. Returns a Result.

    spp            samples a pixel; the scene's number when None
    seed           of the random numbers; the scene's sampler.seed when None. A session has its own
    backend        "cuda", "embree", "opencl", the path of a plugin, or "auto": the best of this machine
    devices        an index, a list of indices, a part of a device's name, or "all"; the best when None
    threads        of the host; 0: all. Never changes the image
    target_error   stop at this half-width of the error, relative to the mean luminance, in (0, 1)
time_limit stop after this number of seconds
    sample_range   (first, end): exactly these samples, for renders in parts
    resume         an earlier film of the scene, whose samples are not rendered again
    progress       a bar by tqdm. None: where tqdm is installed, and stderr is a terminal or this a notebook
    use_cache      of compiled kernels, on disk
    estimate_error for the report, whose "error" is None otherwise. It takes as long as adding a film;
                   Result.error gives it at any time
    on_progress    called with a dict (samples, samples_wanted, seconds, fraction, seconds_left,
                   paths_per_second, relative_error) some times a second; what it raises ends the render

    Other threads of Python run meanwhile. Ctrl-C ends sampling and keeps the film: `stop` is "interrupted".
    Raises crt.Error; crt.RenderFailed, with the film so far, when a device fails after the first samples.
    """
    if isinstance(scene, Session) and seed is not None:
        raise Error("a session renders with one seed: crt.Session(scene, seed=…)", Kind.USAGE)
    session = scene if isinstance(scene, Session) else Session(scene, seed=seed)
    options = _crt.RenderOptions()
    options.backend = backend
    options.device = device_text(devices)
    options.threads = threads
    options.use_cache = use_cache
    options.samples = spp or 0
    options.sample_range = tuple(sample_range) if sample_range is not None else None
    options.time_limit_seconds = time_limit or 0.0
    options.target_error = target_error or 0.0
    options.estimate_error = estimate_error
    if spp is not None and spp < 1:
        raise Error("spp must be 1 or more", Kind.USAGE)
    with Bar(progress) as bar, session.in_turn() as native:
        def hear(now):
            bar.show(now)
            if on_progress is not None:
                on_progress(now)

        heard = hear if bar.shown or on_progress is not None else None
        film, stop, report = native.render(options, resume, heard, None, tell)
    if stop == "interrupted":
        LOGGER.warning("interrupted after %d samples a pixel; the film is kept", film.samples)
    return Result(film, stop, json.loads(report))


class Session:
    """Renders of one scene that follow each other, as it is when the session is made: its devices stay open
    and the scene stays compiled from one to the next, as long as backend, devices, threads and use_cache are
    the same. Each has the bits of crt.render.

        with crt.Session("box.yaml") as session:
            parts = [session.render(sample_range=(first, first + 64)) for first in range(0, 256, 64)]

    `seed` replaces the scene's sampler.seed. A session holds memory of its devices until it is closed or
    forgotten. Threads take turns.
    """

    def __init__(self, scene, *, seed=None):
        self.scene = with_seed(as_scene(scene), seed)  # It keeps the files of its arrays.
        self._native = _crt.Session(self.scene.native)
        self._lock = threading.Lock()

    def render(self, **options):
        """Does the same as crt.render, with its options. Raises crt.Error of kind USAGE when the session is
        closed."""
        return render(self, **options)

    def close(self):
        """Closes the devices."""
        with self._lock:
            self._native = None

    @contextlib.contextmanager
    def in_turn(self):
        """The native session, for one thread at a time."""
        with self._lock:
            if self._native is None:
                raise Error("this session is closed", Kind.USAGE)
            yield self._native

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def as_scene(scene):
    if isinstance(scene, (str, os.PathLike)):
        return load(scene)
    return scene if isinstance(scene, Scene) else scene_of(scene)


def with_seed(scene, seed):
    """The crt.Scene itself where the seed is None, else a copy with that seed."""
    if seed is None:
        return scene
    copy = scene.copy()
    copy["sampler.seed"] = seed
    return copy


def device_text(devices):
    if devices is None:
        return ""
    if isinstance(devices, (list, tuple)):
        return ",".join(str(int(index)) for index in devices)
    return str(devices)


class Bar:
    """A bar of tqdm, or none."""

    def __init__(self, wanted):
        self.bar = None
        if wanted is None:
            wanted = sys.stderr.isatty() or "ipykernel" in sys.modules
            optional = True
        else:
            optional = False
        if not wanted:
            return
        try:
            from tqdm.auto import tqdm
        except ImportError:
            if not optional:
                raise
            return
        self.bar = tqdm(total=1.0, bar_format="{l_bar}{bar}| {elapsed}<{remaining}{postfix}", leave=False)

    @property
    def shown(self):
        return self.bar is not None

    def show(self, now):
        if self.bar is None:
            return
        self.bar.update(max(0.0, now["fraction"] - self.bar.n))
        error = now["relative_error"]
        self.bar.set_postfix_str(f"{now['samples']:.0f} samples a pixel"
                                 + (f", error {error:.2%}" if error is not None else ""))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.close()


def develop(film, *, for_display=False, exposure_ev=None, aovs=()):
    """A film as a crt.Image: radiance in the scene's colour space, or, `for_display` or with an exposure in
    stops instead of the scene's, exposed and white-balanced as for .png, still linear. `aovs` are more
    planes, named as in scenes; the film must hold them. Raises crt.Error of kind USAGE otherwise.
    """
    return film.develop(for_display, exposure_ev, list(aovs))


def plugins():
    """The backends that are installed with crt: name, version, devices, and why one cannot run here."""
    return _crt.plugins(tell)
