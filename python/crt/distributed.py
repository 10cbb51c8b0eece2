"""Renders on many machines, as tasks of Dask: parts of the samples, whose films are added.

    import distributed
    import crt.distributed

    client = distributed.Client("tcp://scheduler:8786")
    result = crt.distributed.render("scene.yaml", client, spp=4096, checkpoint="scene.crtfilm")

Any cluster of Dask serves: local, SSH, Slurm, Kubernetes (docs/cluster.md). The film has the bits of one
render of all samples, independent of the distribution over workers.
"""

import signal
import threading
import time

try:
    import dask.sizeof
    import distributed
except ImportError as missing:
    raise ImportError(f"crt.distributed needs Dask ({missing}): pip install dask distributed") from missing

from . import _crt
from .cluster_work import Work
from .errors import Error, Kind, RenderFailed
from .messages import LOGGER
from .rendering import Bar, Result, as_scene, device_text, with_seed
from .sample_ranges import ENDLESS, Missing, PartSize

SECONDS_A_LOOK = 0.2


@dask.sizeof.sizeof.register(_crt.Film)
def film_size(film):
    """Bytes of a film without AOVs in memory, for what Dask knows of its workers' memory."""
    return 72 * film.width * film.height


def render(scene, client=None, *, spp=None, seed=None, parts=None, backend="auto", devices=None,
           threads=0, target_error=None, time_limit=None, checkpoint=None, checkpoint_every=60,
           progress=None, on_progress=None):
    """Renders a scene on the workers of a Dask cluster. Returns a crt.Result.

    scene             as crt.render takes it. A file, and files that a text names, must lie at the same path
                      on every machine; text, dicts and their arrays are sent
    client            distributed.Client; the current one of Dask when None
    spp               samples a pixel, those of a checkpoint included; the scene's number when None and
                      neither time nor error ends the render
    seed              of the random numbers; the scene's sampler.seed when None
parts this number of parts, of equal size; of a size that follows the workers' speed when None
    backend, devices, threads   as crt.render takes them, on each worker and for each of its threads
    target_error      stop at this half-width of the error, relative to the mean luminance, in (0, 1). It is
                      looked at when the number of samples has doubled, of all pixels and of the even and the
                      odd ones, as `crt render` does (docs/error.md)
time_limit stop after this number of seconds; parts that run then end early, and count
    checkpoint        path of a .crtfilm: what there is comes into it every `checkpoint_every` seconds, and
                      at the end. Where it exists, only what it lacks is rendered
    checkpoint_every  seconds; more where parts or films are so large that it would cost much
    progress          a bar by tqdm, as of crt.render
    on_progress       called after each part with a dict: samples, samples_wanted, seconds, fraction,
parts, threads, relative_error. An exception that it raises ends the render

    Workers may come and go. Parts that a worker takes along are rendered again. A worker whose device fails
    gets no more parts, and the others do its part; the third failure of a part ends the render. Ctrl-C ends
    the render and keeps what is done: `stop` is "interrupted"; a second one leaves at once.
    Raises crt.Error, of a scene before anything is sent; crt.RenderFailed, with the film so far, where the
    cluster fails later.
    """
    scene = with_seed(as_scene(scene), seed)
    check(spp, parts, target_error, time_limit)
    client = client_or_current(client)
    kept = earlier(checkpoint)
    wanted = scene.native.samples  # Raises what is wrong with the scene, once and here.
    if spp is not None:
        wanted = spp
    elif target_error or time_limit:
        wanted = ENDLESS
    missing = Missing(kept.sample_ranges if kept is not None else [], wanted)
    size = PartSize(-(-missing.left // parts) if parts else None)
    options = {"backend": backend, "devices": device_text(devices) or None, "threads": threads}
    work = Work(client, scene, options, missing, size, kept, checkpoint, checkpoint_every)
    with Bar(progress) as bar, Interrupt() as interrupt:
        def tell():
            now = told(work, wanted, time_limit)
            bar.show(now)
            if on_progress is not None:
                on_progress(now)

        stop = "samples"
        try:
            stop = carried_on(work, interrupt, target_error, time_limit, tell)
            work.finish()
        except Error as error:
            if work.kept is None or error.kind not in (Kind.DEVICE, Kind.BACKEND):
                raise
            raise RenderFailed(str(error), error.kind, error.file or "", error.line or 0, error.column or 0,
                               work.kept) from error
        finally:
            work.cancel()
    if work.kept is None:
        raise Error(f"the render ended before its first part was done ({stop})", Kind.USAGE)
    if stop == "interrupted":
        LOGGER.warning("interrupted after %d samples a pixel; the film is kept", work.kept.samples)
    return Result(work.kept, stop, work.report(stop))


def check(spp, parts, target_error, time_limit):
    for name, value in (("spp", spp), ("parts", parts)):
        if value is not None and value < 1:
            raise Error(f"{name} must be 1 or more", Kind.USAGE)
    if target_error is not None and not 0 < target_error < 1:
        raise Error("target_error must be above 0 and below 1", Kind.USAGE)
    if time_limit is not None and not time_limit > 0:
        raise Error("time_limit must be above 0 seconds", Kind.USAGE)
    if parts is not None and spp is None and (target_error or time_limit):
        raise Error("parts divide spp samples: give spp too", Kind.USAGE)


def client_or_current(client):
    if client is not None:
        return client
    try:
        return distributed.default_client()
    except ValueError:
        raise Error("there is no client of Dask: make one with client = distributed.Client(…), of a "
                    "scheduler or of this machine", Kind.USAGE) from None


def earlier(checkpoint):
    """The film of a checkpoint; None where there is none yet."""
    if checkpoint is None:
        return None
    try:
        with open(checkpoint, "rb"):
            pass
    except FileNotFoundError:
        return None
    return _crt.Film.load(str(checkpoint))


def carried_on(work, interrupt, target_error, time_limit, tell):
    """Submits parts and takes them back until one of the ends is reached; returns which."""
    look = Look(target_error, work.scene) if target_error else None
    began = time.monotonic()
    while True:
        left = None if time_limit is None else time_limit - (time.monotonic() - began)
        if interrupt.came:
            return "interrupted"
        if left is None or left > 0:
            work.submit(left, look.until(work.samples) if look else ENDLESS)
        if not work.running:
            return "time" if left is not None and left <= 0 else "samples"
        if work.collect(SECONDS_A_LOOK):
            tell()
        if work.harvest(look.due(work.samples) if look else False) and look and look.reached(work):
            return "target"


class Look:
    """Decides when to check the error, and if it is small enough: continuous checks stop at the
    luckiest moment."""

    FIRST = 64
    PATHS = 1_000_000

    def __init__(self, target, scene):
        self.target = target
        self.next = max(self.FIRST, -(-self.PATHS // (scene.width * scene.height)))

    def due(self, samples):
        return samples >= self.next

    def until(self, samples):
        """The number of samples at the next look; of the one after it, while one is on its way."""
        return 2 * self.next if self.due(samples) else self.next

    def reached(self, work):
        """For the film that has just been merged."""
        if work.kept.samples < self.next:
            return False  # It was merged for a checkpoint.
        while self.next <= work.kept.samples:
            self.next *= 2
        return work.kept.error_within(self.target)


def told(work, wanted, time_limit):
    """The values that on_progress receives."""
    seconds = time.monotonic() - work.began
    fraction = work.samples / wanted
    if time_limit is not None:
        fraction = max(fraction, min(1.0, seconds / time_limit))
    return {"samples": work.samples, "samples_wanted": wanted if wanted != ENDLESS else None,
            "seconds": seconds, "fraction": fraction, "parts": work.parts, "threads": work.threads,
            "relative_error": work.error.half_width_95 if work.error else None}


class Interrupt:
    """Hears the first Ctrl-C, so that it comes between parts and loses none; the second one is raised."""

    def __init__(self):
        self.came = False

    def __enter__(self):
        self.main = threading.current_thread() is threading.main_thread()
        if self.main:
            self.before = signal.signal(signal.SIGINT, self.hear)
        return self

    def __exit__(self, *_):
        if self.main:
            signal.signal(signal.SIGINT, self.before)

    def hear(self, number, frame):
        self.came = True
        signal.signal(signal.SIGINT, signal.default_int_handler)
