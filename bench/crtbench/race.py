"""Time to an error in crt and in other renderers."""

import dataclasses
import math
import os
import time

import drjit as dr
import mitsuba as mi
import numpy as np

from . import agree_scene, foreign_race, peers, program as crt
from .contestants import Crt, Mitsuba
from .peer_process import Untranslated
from .race_scenes import RACE, SPEED, files_of, write_inputs
from .results import Results

FIRST, FACTOR = 16, 4        # Samples of the first point, and of each over the one before.
REFERENCE_RENDERS = 8
REFERENCE_SEED = 70_000_000


@dataclasses.dataclass
class Point:
    samples: int
    error: float
    seconds: float   # The median of the renders.


class Converged:
    """The mean of renders that nothing else has, and the variance of that mean in every pixel."""

    def __init__(self, render, samples):
        seeds = range(REFERENCE_SEED, REFERENCE_SEED + REFERENCE_RENDERS)
        images = np.array([render(samples, seed).luminance for seed in seeds])
        self.mean = images.mean(axis=0)
        self.variance = float((images.var(axis=0, ddof=1) / REFERENCE_RENDERS).mean())
        self.luminance = float(self.mean.mean())
        self.error = math.sqrt(self.variance) / self.luminance

    def difference(self, other):
        """RMS of the pixels' differences from another converged image, less what noise makes of it."""
        squared = ((self.mean - other.mean) ** 2).mean() - self.variance - other.variance
        return math.sqrt(max(squared, 0.0)) / self.luminance

    def error_of(self, images):
        squared = np.mean([((image - self.mean) ** 2).mean() for image in images]) - self.variance
        return math.sqrt(max(squared, 0.0)) / self.luminance


def points_of(converged, arguments):
    """{contestant: its points of growing numbers of samples, until one is below the target}. `converged`:
    {contestant: its program's converged image}. They render in turn, so that a machine that becomes slower
    does so for all."""
    points, racing, samples = {c: [] for c in converged}, list(converged), FIRST
    while racing and samples <= arguments.most:
        costs = {c: [] for c in racing}
        for contestant in racing:
            contestant.warm_up(samples)
        for render in range(arguments.renders):
            for contestant in racing:
                costs[contestant].append(contestant.render(samples, 1000 + render))
        for contestant in racing:
            points[contestant].append(point_of(contestant, costs[contestant], converged[contestant]))
        racing = [c for c in racing if points[c][-1].error >= arguments.target or len(points[c]) < 2]
        samples *= FACTOR
    return points


def point_of(contestant, costs, converged):
    point = Point(
        costs[0].samples,
        converged.error_of([c.luminance for c in costs]),
        float(np.median([c.seconds for c in costs])),
    )
    print(
        f"{contestant.name:40} {point.samples:6} spp {point.error:8.3%} {point.seconds:8.3f} s", flush=True
    )
    return point


def time_to(points, target):
    """Seconds to the target, a straight line in logarithms between the points around it; None where it was
    not reached."""
    for above, below in zip(points, points[1:]):
        if below.error < target <= above.error:
            share = math.log(above.error / target) / math.log(above.error / below.error)
            return above.seconds * (below.seconds / above.seconds) ** share
    return None


def contestants_of(program, file, arguments):
    """({program: its contestants}, {program: why it has none}); crt first."""
    racing, absent = {}, {}
    racing["crt"] = [
        Crt(program, file, backend, replicates, arguments.size)
        for backend in arguments.backends
        for replicates in arguments.replicates
    ]
    for who in arguments.peers:
        if who == "mitsuba":
            racing["Mitsuba"] = [
                Mitsuba(program, file, variant, sampler, arguments.size)
                for variant in arguments.variants
                for sampler in arguments.samplers
            ]
            continue
        name = peers.KINDS[who].name
        try:
            racing[name] = peers.contestants(program, file, who, arguments.size)
        except Untranslated as reason:
            absent[name] = str(reason)
    return racing, absent


@dataclasses.dataclass
class Race:
    """Of one scene: {contestant: (points, seconds to the target or None)}, {program: its converged image},
    and {program: why it does not show the scene}."""

    scene: str
    title: str
    found: dict
    references: dict
    absent: dict

    def best(self, who):
        return best(self.found, who)

    def ratio(self, others):
        """Time of crt's best over that of the best of the others."""
        theirs = [self.best(who) for who in others]
        if not self.best("crt") or not any(theirs):
            return None
        return self.best("crt") / min(seconds for seconds in theirs if seconds)


def race(program, file, arguments):
    if arguments.files:
        name, title = foreign_race.name(file), "imported"
        racing, absent = foreign_race.contestants(program, file, arguments), {}
    else:
        name, title = file.stem, agree_scene.title(file)
        racing, absent = contestants_of(program, file, arguments)
    references, converged = {}, {}
    for who, group in racing.items():
        references[who] = Converged(group[0].render, arguments.reference_samples)
        print(f"{name}: converged image of {who}: {references[who].error:.2%} itself", flush=True)
        converged |= dict.fromkeys(group, references[who])
    points = points_of(converged, arguments)
    found = {c.name: (points[c], time_to(points[c], arguments.target)) for c in points}
    for contestant in sum(racing.values(), []):
        if isinstance(contestant, peers.Peer):
            contestant.close()
    return Race(name, title, found, references, absent)


def best(found, who):
    times = [seconds for name, (_, seconds) in found.items() if name.startswith(who) and seconds]
    return min(times) if times else None


def errors_beside(found, who):
    """{samples: the least error of crt over the least of the other program}, of numbers of samples that all
    contestants of both have; ascending."""
    groups = [[points for name, (points, _) in found.items() if name.startswith(program)]
              for program in ("crt", who)]
    if not all(groups):
        return {}
    common = set.intersection(*({p.samples for p in points} for points in sum(groups, [])))

    def least(group, samples):
        return min(p.error for points in group for p in points if p.samples == samples)

    return {n: least(groups[0], n) / least(groups[1], n) for n in sorted(common)}


def row(scene, name, points, seconds):
    steps = ", ".join(f"{p.samples}: {p.error:.2%}" for p in points)
    return [f"`{scene}`", name, steps, f"{points[-1].seconds:.3g} s",
            f"{seconds:.3g} s" if seconds else "not reached"]


def against(found, who):
    """crt and one other program, in words."""
    ours = found.references["crt"]
    theirs = found.references[who]
    ratio = found.ratio([who])
    said = f"**{ratio:.2f}**" if ratio else "not known: the target was not reached"
    equal = ""
    if errors := errors_beside(found.found, who):
        samples, error = max(errors.items())
        equal = f"; at {samples} samples the error of crt over the least of {who}'s is {error:.2f}"
    return (
        f"time of crt's best over that of {who}'s best {said}{equal}. {who}'s converged image has "
        f"{theirs.luminance / ours.luminance - 1:+.2%} in luminance beside crt's, and its pixels differ by "
        f"{ours.difference(theirs):.1%} of the mean (RMS); the converged images are themselves "
        f"{ours.error:.2%} and {theirs.error:.2%} off, which is taken off."
    )


def sentences(found):
    """The results for a scene, in words."""
    said = [against(found, who) for who in found.references if who != "crt"]
    said += [f"{who} is left out, which cannot show {reason}." for who, reason in found.absent.items()]
    return [f"`{found.scene}` ({found.title}): {sentence}" for sentence in said]


def seconds_or_dash(seconds):
    return f"{seconds:.3g}" if seconds else "not reached"


def summary(found, others):
    ratio = found.ratio(others)
    return [
        f"`{found.scene}`: {found.title}",
        *("–" if who in found.absent else seconds_or_dash(found.best(who)) for who in ["crt", *others]),
        f"{ratio:.2f}" if ratio else "–",
    ]


def measure(program, arguments):
    mi.set_variant(arguments.variants[0])
    mi.set_log_level(mi.LogLevel.Error)
    if arguments.tiny:
        arguments.size, arguments.renders, arguments.target = 16, 2, 0.2
        arguments.reference_samples = 64
    processors = len(os.sched_getaffinity(0))
    dr.set_thread_count(processors)
    files = arguments.files or files_of(
        program, [RACE, SPEED] if arguments.scenes else [RACE], arguments.scenes
    )
    write_inputs(program.scratch)
    others = ["Mitsuba" if who == "mitsuba" else peers.KINDS[who].name for who in arguments.peers]
    results = Results(program, arguments, arguments.name, "Who reaches 1 % first where surfaces are rich?")
    rows, notes, claimed, errors = [], [], [], {}
    before = crt.processor_seconds() - time.process_time() - crt.children_seconds()
    begin = time.monotonic()
    for file in files:
        found = race(program, file, arguments)
        rows += [row(found.scene, name, points, seconds) for name, (points, seconds) in found.found.items()]
        notes += sentences(found)
        claimed.append(summary(found, others))
        errors[found.scene] = errors_beside(found.found, others[0])
        print(*sentences(found), sep="\n", flush=True)
        results.data[found.scene] = {
            name: {"points": [dataclasses.asdict(p) for p in points], "seconds_to_target": seconds}
            for name, (points, seconds) in found.found.items()
        }
    strangers = crt.processor_seconds() - time.process_time() - crt.children_seconds() - before
    share = max(0.0, strangers) / ((time.monotonic() - begin) * os.cpu_count())
    target = f"{arguments.target:.3g}"
    size = arguments.size
    pixels = f"{size} pixels high" if arguments.files else f"{size} × {size} pixels"
    where = "The files that are named" if arguments.files else f"Scenes of `{RACE}` and `{SPEED}`"
    with_what = {"Mitsuba": f" (Mitsuba is {mi.__version__})", **{
        kind.name: f" ({kind.name} is `{kind.package}`)" for kind in peers.KINDS.values()}}
    results.paragraph(
        f"{where}, {pixels}, translated for {' and '.join(others)}"
        f"{''.join(with_what[who] for who in others)}; no roulette in any. *Errors*: RMSE of luminance over "
        f"mean luminance against "
        f"the program's own converged image, of {arguments.renders} renders, by samples a pixel. *Last*: "
        "the median of a render alone of the last number, scene loaded and kernels compiled. "
        f"*To {target}*: interpolated between the last two numbers. crt with Sobol points in one sequence, "
        "or in two (its default, which gives the error of the image); the others with each of the samplers "
        f"that are named. All had {processors} processors; others used {share:.0%} of the machine."
    )
    results.table(["Scene", "Contestant", "Errors", "Last", f"To {target}"], rows)
    for note in notes:
        results.paragraph(note)
    results.claim(
        "Complex scenes beside Mitsuba 3 on a processor" if others == ["Mitsuba"]
        else "Scenes beside other renderers on a processor",
        f"Seconds of rendering until the RMSE of luminance is {arguments.target:.0%} of the mean; "
        f"{pixels}, no roulette. The programs render in turn, and the best of each one's samplers counts.",
        ["scene", "crt, s", *(f"{who}, s" for who in others),
         f"crt : {others[0]}" if len(others) == 1 else "crt : best peer"],
        claimed,
    )
    numbers = sorted(set().union(*errors.values()))
    results.claim(
        f"Error at equal samples beside {others[0]}",
        f"RMSE of luminance of crt's image over that of {others[0]}'s best one with as many samples, each "
        f"against its own converged image; {pixels}, {arguments.renders} renders. *–*: the target of the "
        "race was reached before.",
        ["scene", *(f"{n:,} samples" for n in numbers)],
        [[f"`{scene}`", *(f"{found[n]:.2f}" if n in found else "–" for n in numbers)]
         for scene, found in errors.items()],
        name=f"{arguments.name}-errors",
    )
    results.write()
    return 0
