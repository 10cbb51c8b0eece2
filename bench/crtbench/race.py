"""Time to an error in crt and in Mitsuba 3, for the scenes of bench/scenes/race."""

import dataclasses
import math
import os
import time

import drjit as dr
import mitsuba as mi
import numpy as np

from . import agree_scene, program as crt
from .agree import write_normals, write_picture, write_sky
from .program import Failure
from .results import Results

FOLDER = "bench/scenes/race"
SUN_CONTRAST = 1e4
FIRST, FACTOR = 16, 4        # Samples of the first point, and of each over the one before.
REFERENCE_RENDERS = 8
REFERENCE_SEED = 70_000_000
WARM_UP_SEED = 999_999_937   # No measured render has it.


def write_sun(path):
    """A grey sky over dark ground, and a sun of 1.4 degrees, SUN_CONTRAST times as bright as the sky."""
    v, u = (np.mgrid[0:512, 0:1024] + 0.5) / 1024
    rgb = np.where(v < 0.25, 1.0, 0.1)[:, :, None] * np.array([0.8, 0.9, 1.0])
    sun = (u - 0.62) ** 2 + (v - 0.13) ** 2 < 0.002**2
    rgb[sun] = SUN_CONTRAST * np.array([1.0, 0.95, 0.9])
    mi.Bitmap(rgb.astype(np.float32)).write(str(path))


def read_pfm(path):
    with open(path, "rb") as file:
        if file.readline().strip() != b"PF":
            raise Failure(f"{path} is not a PFM with three channels")
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), order).reshape(height, width, 3)[::-1].astype(np.float64)


@dataclasses.dataclass
class Cost:
    """A render: its luminance, seconds, and the samples that it took."""

    luminance: np.ndarray
    seconds: float
    samples: int


@dataclasses.dataclass
class Point:
    samples: int
    error: float
    seconds: float   # The median of the renders.


class Crt:
    """One backend of crt, a process for every image, with Sobol points in this number of replicates (crt's
    default
    is two: an image of one does not know its error)."""

    def __init__(self, program, file, backend, replicates, size):
        self.program, self.file, self.backend, self.size = program, file, backend, size
        self.replicates = replicates
        self.name = f"crt {backend}, {replicates} sequence{'s' if replicates > 1 else ''}"

    def render(self, samples, seed):
        image = self.program.scratch / "race.pfm"
        settings = [
            f"film.resolution=[{self.size},{self.size}]",
            "film.color_space=xyz",
            f"sampler.replicates={self.replicates}",
        ]
        if around := agree_scene.environment_image(self.file):  # crt looks beside the scene alone
            settings.append(f"environment.image={self.program.scratch / around}")
        run = self.program.render(
            self.file,
            self.backend,
            ["--spp", samples, "--seed", seed],
            [image],
            settings,
            environment={"CRT_MESH_PATH": self.mesh_path()},
        )
        return Cost(read_pfm(image)[:, :, 1], run.value("seconds", "render"), samples)

    def mesh_path(self):
        return f"{self.program.scratch}:{self.program.environment['CRT_MESH_PATH']}"

    def warm_up(self, samples):
        self.render(samples, WARM_UP_SEED)
        self.program.await_compilers()


class Mitsuba:
    """One variant with one of its samplers, in this process."""

    def __init__(self, program, file, variant, sampler, size):
        self.variant, self.sampler = variant, sampler
        self.name = f"Mitsuba {variant}, {sampler}"
        mi.set_variant(variant)
        meshes = program.build / "share" / "crt" / "meshes"
        given = agree_scene.translate(file, program.scratch, FIRST, meshes=meshes)
        given["sensor"]["film"] |= {"width": size, "height": size}
        given["sensor"]["sampler"]["type"] = sampler
        self.scene = mi.load_dict(given)

    def render(self, samples, seed):
        mi.set_variant(self.variant)
        begin = time.perf_counter()
        image = mi.render(self.scene, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        seconds = time.perf_counter() - begin
        took = self.scene.sensors()[0].sampler().sample_count()
        return Cost(np.array(image)[:, :, 1].astype(np.float64), seconds, took)

    def warm_up(self, samples):
        """Kernels are compiled for each number of samples."""
        self.render(samples, WARM_UP_SEED)


class Converged:
    """The mean of renders that nothing else has, and the variance of that mean in every pixel."""

    def __init__(self, render, samples):
        seeds = range(REFERENCE_SEED, REFERENCE_SEED + REFERENCE_RENDERS)
        images = np.array([render(samples, seed).luminance for seed in seeds])
        self.mean = images.mean(axis=0)
        self.variance = float((images.var(axis=0, ddof=1) / REFERENCE_RENDERS).mean())
        self.luminance = float(self.mean.mean())
        self.error = math.sqrt(self.variance) / self.luminance

    def error_of(self, images):
        squared = np.mean([((image - self.mean) ** 2).mean() for image in images]) - self.variance
        return math.sqrt(max(squared, 0.0)) / self.luminance


def points_to(contestant, converged, arguments):
    """Points of growing numbers of samples, until one is below the target."""
    points, samples = [], FIRST
    while samples <= arguments.most:
        contestant.warm_up(samples)
        costs = [contestant.render(samples, 1000 + r) for r in range(arguments.renders)]
        point = Point(
            costs[0].samples,
            converged.error_of([c.luminance for c in costs]),
            float(np.median([c.seconds for c in costs])),
        )
        points.append(point)
        print(
            f"{contestant.name:40} {point.samples:6} spp {point.error:8.3%} {point.seconds:8.3f} s",
            flush=True,
        )
        if point.error < arguments.target and len(points) > 1:
            break
        samples *= FACTOR
    return points


def time_to(points, target):
    """Seconds to the target, a straight line in logarithms between the points around it; None where it was
    not reached."""
    for above, below in zip(points, points[1:]):
        if below.error < target <= above.error:
            share = math.log(above.error / target) / math.log(above.error / below.error)
            return above.seconds * (below.seconds / above.seconds) ** share
    return None


def race(program, file, arguments):
    """Each contestant's points and seconds to the target, by its name."""
    ours = [
        Crt(program, file, backend, replicates, arguments.size)
        for backend in arguments.backends
        for replicates in arguments.replicates
    ]
    theirs = [
        Mitsuba(program, file, variant, sampler, arguments.size)
        for variant in arguments.variants
        for sampler in arguments.samplers
    ]
    references = {
        "crt": Converged(ours[0].render, arguments.reference_samples),
        "Mitsuba": Converged(theirs[0].render, arguments.reference_samples),
    }
    for name, converged in references.items():
        print(f"{file.stem}: converged image of {name}: {converged.error:.2%} itself", flush=True)
    ratio = references["Mitsuba"].luminance / references["crt"].luminance
    found = {}
    for contestant in [*ours, *theirs]:
        converged = references["crt" if isinstance(contestant, Crt) else "Mitsuba"]
        points = points_to(contestant, converged, arguments)
        found[contestant.name] = (points, time_to(points, arguments.target))
    return found, ratio, references


def best(found, who):
    times = [seconds for name, (_, seconds) in found.items() if name.startswith(who) and seconds]
    return min(times) if times else None


def error_at(found, who):
    """The least error of a program's contestants at the largest number of samples that all have."""
    common = set.intersection(*({p.samples for p in points} for points, _ in found.values()))
    if not common:
        return None, None
    samples = max(common)
    return samples, min(
        p.error
        for name, (points, _) in found.items()
        for p in points
        if name.startswith(who) and p.samples == samples
    )


def row(scene, name, points, seconds):
    steps = ", ".join(f"{p.samples}: {p.error:.2%}" for p in points)
    reached = f"{seconds:.3g} s" if seconds else "not reached"
    return [f"`{scene}`", name, steps, f"{points[-1].seconds:.3g} s", reached]


def sentence(file, found, ratio, references):
    """The result for a scene, in words."""
    ours, theirs = best(found, "crt"), best(found, "Mitsuba")
    said = f"**{ours / theirs:.2f}**" if ours and theirs else "not known: the target was not reached"
    samples, our_error = error_at(found, "crt")
    equal = ""
    if samples:
        equal = (
            f"; at {samples} samples in all of them the error of crt over the least of Mitsuba's is "
            f"{our_error / error_at(found, 'Mitsuba')[1]:.2f}"
        )
    return (
        f"`{file.stem}` ({agree_scene.title(file)}): time of crt's best over that of Mitsuba's best {said}"
        f"{equal}. Mitsuba's converged image has {ratio - 1:+.2%} in luminance beside crt's; the converged "
        f"images are themselves {references['crt'].error:.2%} and {references['Mitsuba'].error:.2%} off, "
        "which is taken off."
    )


def measure(program, arguments):
    mi.set_variant(arguments.variants[0])
    mi.set_log_level(mi.LogLevel.Error)
    if arguments.tiny:
        arguments.size, arguments.renders, arguments.target = 16, 2, 0.2
        arguments.reference_samples = 64
    processors = len(os.sched_getaffinity(0))
    dr.set_thread_count(processors)
    files = sorted((program.repository / FOLDER).glob("*.yaml"))
    if arguments.scenes:
        files = [f for f in files if f.stem in arguments.scenes]
        if unknown := set(arguments.scenes) - {f.stem for f in files}:
            raise Failure(f"there is no {FOLDER}/{sorted(unknown)[0]}.yaml")
    write_picture(program.scratch / "picture.png")
    write_normals(program.scratch / "normals.png")
    write_sky(program.scratch / "sky.exr")
    write_sun(program.scratch / "sun.exr")
    results = Results(program, arguments, arguments.name, "Who reaches 1 % first where surfaces are rich?")
    rows, notes, summary = [], [], []
    before = crt.processor_seconds() - time.process_time() - crt.children_seconds()
    begin = time.monotonic()
    for file in files:
        found, ratio, references = race(program, file, arguments)
        rows += [row(file.stem, name, points, seconds) for name, (points, seconds) in found.items()]
        notes.append(sentence(file, found, ratio, references))
        times = [best(found, whose) for whose in ("crt", "Mitsuba")]
        summary.append([f"`{file.stem}`: {agree_scene.title(file)}",
                        *(f"{seconds:.3g}" if seconds else "not reached" for seconds in times),
                        f"{times[0] / times[1]:.2f}" if all(times) else "–"])
        print(notes[-1], flush=True)
        results.data[file.stem] = {
            name: {"points": [dataclasses.asdict(p) for p in points], "seconds_to_target": seconds}
            for name, (points, seconds) in found.items()
        }
    others = crt.processor_seconds() - time.process_time() - crt.children_seconds() - before
    share = max(0.0, others) / ((time.monotonic() - begin) * os.cpu_count())
    target = f"{arguments.target:.3g}"
    results.paragraph(
        f"Scenes of `{FOLDER}`, {arguments.size} × {arguments.size} pixels, translated for Mitsuba "
        f"{mi.__version__}; no roulette in either. *Errors*: RMSE of luminance over mean luminance against "
        f"the program's own converged image, of {arguments.renders} renders, by samples a pixel. *Last*: "
        "the median of a render alone of the last number, scene loaded and kernels compiled. "
        f"*To {target}*: interpolated between the last two numbers. crt with Sobol points in one sequence, "
        "or in two (its default, which gives the error of the image); Mitsuba with each of its samplers "
        f"that is named. Both had {processors} processors; others used {share:.0%} of the machine."
    )
    results.table(["Scene", "Contestant", "Errors", "Last", f"To {target}"], rows)
    for note in notes:
        results.paragraph(note)
    results.claim(
        "Complex scenes beside Mitsuba 3 on a processor",
        f"Seconds of rendering until the RMSE of luminance is {arguments.target:.0%} of the mean; "
        f"{arguments.size} × {arguments.size} pixels, no roulette. The best of each program's samplers "
        f"counts.",
        ["scene", "crt, s", "Mitsuba, s", "crt : Mitsuba"],
        summary,
    )
    results.write()
    return 0
