"""Paths a second and time to an error in crt and in Mitsuba 3, scene by scene in one run."""

import dataclasses
import time

import drjit as dr
import mitsuba as mi

from . import race
from .contestants import Crt, Mitsuba
from .program import Spread
from .race_scenes import RACE, SPEED, files_of, write_inputs
from .results import Results

FOLDERS = [SPEED, RACE]
SEED = 5_000_000   # Of the timed renders.


@dataclasses.dataclass
class Rate:
    """Paths a second of one contestant: camera paths over seconds of rendering."""

    name: str
    mpaths_per_s: Spread


def contestants(program, file, backend, variant, samplers, size):
    """crt first."""
    return [
        Crt(program, file, backend, 1, size),
        *(Mitsuba(program, file, variant, sampler, size) for sampler in samplers),
    ]


def rates(program, file, arguments):
    """Each contestant's rate, in turn: A B C A B C …, after a render of each that is not counted."""
    racing = contestants(
        program, file, arguments.backend, arguments.variant, arguments.samplers, arguments.size
    )
    for contestant in racing:
        contestant.warm_up(arguments.samples)
    found = {contestant.name: [] for contestant in racing}
    for run in range(arguments.runs):
        for contestant in racing:
            cost = contestant.render(arguments.samples, SEED + run)
            found[contestant.name].append(arguments.size**2 * cost.samples / cost.seconds / 1e6)
    return [Rate(name, Spread(values)) for name, values in found.items()]


def best(found, whose):
    return max((r for r in found if r.name.startswith(whose)), key=lambda r: r.mpaths_per_s.median)


def seconds_to_error(program, file, arguments):
    """{contestant: (points, seconds to the target or None)}, as `race` has it."""
    racing = contestants(
        program, file, arguments.backend, arguments.variant, arguments.samplers, arguments.error_size
    )
    references = {
        whose: race.Converged(first.render, arguments.reference_samples)
        for whose, first in (("crt", racing[0]), ("Mitsuba", racing[1]))
    }
    points = race.points_of({c: references[c.name.split()[0]] for c in racing}, arguments)
    return {c.name: (points[c], race.time_to(points[c], arguments.target)) for c in racing}


def cells(file, rated, raced):
    """One line of the table."""
    ours, theirs = best(rated, "crt"), best(rated, "Mitsuba")
    row = [
        f"`{file.stem}`",
        ours.mpaths_per_s.text(),
        f"{theirs.mpaths_per_s.text()} ({theirs.name.split(', ')[1]})",
        f"**{ours.mpaths_per_s.median / theirs.mpaths_per_s.median:.2f}**",
    ]
    to_error = [race.best(raced, whose) for whose in ("crt", "Mitsuba")]
    row += [f"{seconds:.3g}" if seconds else "not reached" for seconds in to_error]
    return [*row, f"**{to_error[1] / to_error[0]:.1f}**" if all(to_error) else "not known"]


def measure(program, arguments):
    mi.set_variant(arguments.variant)
    mi.set_log_level(mi.LogLevel.Error)
    if arguments.tiny:
        arguments.size, arguments.samples, arguments.runs = 32, 16, 2
        arguments.error_size, arguments.renders, arguments.target = 16, 2, 0.2
        arguments.reference_samples = 64
    write_inputs(program.scratch)
    results = Results(program, arguments, f"mitsuba-speed-{arguments.backend}", "Speed of crt and Mitsuba 3")
    begin, rows, results.data = time.monotonic(), [], {}
    for file in files_of(program, FOLDERS, arguments.scenes):
        if rows and time.monotonic() - begin > arguments.seconds:
            print(f"{file.stem}: no time is left", flush=True)
            continue
        rated = rates(program, file, arguments)
        for rate in rated:
            print(f"{file.stem:14} {rate.name:40} {rate.mpaths_per_s.text()} Mpaths/s", flush=True)
        raced = seconds_to_error(program, file, arguments)
        rows.append(cells(file, rated, raced))
        print(rows[-1], flush=True)
        results.data[file.stem] = {
            "mpaths_per_s": {rate.name: rate.mpaths_per_s.json() for rate in rated},
            "to_error": {
                name: {"points": [dataclasses.asdict(p) for p in points], "seconds": seconds}
                for name, (points, seconds) in raced.items()
            },
        }
        dr.flush_malloc_cache()
    results.paragraph(
        f"Scenes of `{'` and `'.join(FOLDERS)}`, translated for Mitsuba {mi.__version__} "
        f"(`{arguments.variant}`); no roulette in either; crt on `{arguments.backend}` with Sobol points in "
        f"one sequence, Mitsuba with the better of {', '.join(arguments.samplers)}. *Mpaths/s*: camera "
        f"paths over seconds of rendering at {arguments.size} × {arguments.size} pixels and "
        f"{arguments.samples} samples, median of {arguments.runs} interleaved runs, in brackets the least "
        f"and the most; scenes loaded and kernels compiled before. *To {arguments.target:g}*: seconds of "
        f"rendering until the RMSE of luminance at {arguments.error_size} × {arguments.error_size} pixels "
        "is so much of the mean, each against its own converged image, interpolated between numbers of "
        "samples."
    )
    to = f"to {arguments.target:g}, s:"
    results.table(
        ["scene", "Mpaths/s: crt", "Mitsuba", "ratio", f"{to} crt", f"{to} Mitsuba", "ratio"], rows
    )
    text = (
        f"Scenes translated for Mitsuba {mi.__version__} (`{arguments.variant}`), no roulette; crt with one "
        f"sequence of Sobol points, Mitsuba with {', '.join(arguments.samplers)}. Rates: "
        f"{arguments.size} × {arguments.size} pixels, {arguments.samples} samples, rendering alone, median "
        f"of "
        f"{arguments.runs} interleaved runs. Time: until the RMSE of luminance at {arguments.error_size} × "
        f"{arguments.error_size} pixels is {arguments.target:.0%} of the mean, each program against its own "
        "converged image."
    )
    where = "one GPU" if arguments.backend == "cuda" else "a processor"
    results.claim(
        f"Speed beside Mitsuba 3 on {where}",
        text,
        ["scene", "crt, million paths/s", "Mitsuba", "crt : Mitsuba", f"crt, s to {arguments.target:.0%}",
         "Mitsuba, s", "Mitsuba : crt"],
        rows,
    )
    results.write()
    return 0
