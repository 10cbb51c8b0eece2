"""The page, the plot and the pictures of bench/peers.

Over 450 lines: the parts of one page, in the order in which they are read.
"""
import math
import statistics

import numpy as np

from . import peer_agreement, peer_plot
from .peer_error import seconds_to, slope_of
from .peer_lines import SCENE
from .program import significant
from .results import processor

METRICS = {
    "error": "luminance, all pixels",
    "error_xyz": "X, Y and Z, all pixels",
    "error_room": "luminance, without the lamp",
}
SPREAD = {"spread": "luminance, between seeds"}


def percent(value, digits=2):
    return f"{100 * value:+.{digits}f} %"


def agreement(program, pools, described, scene):
    a, b = pools["Mitsuba"], pools["crt"]
    dof = min(len(a.images), len(b.images)) - 1
    t = peer_agreement.student(dof)
    mean, mean_se = peer_agreement.ratio(
        a, b, lambda image: image.reshape(-1, 3).mean(axis=0, dtype=np.float64)
    )
    tile, tile_se = peer_agreement.ratio(a, b, peer_agreement.tiles)
    both = np.minimum(a.mean()[:, :, 1], b.mean()[:, :, 1])
    # Pixels wholly of the lamp: bright, with neighbours as bright. Their values besides the lamp's own light
    # are some thousandths.
    bright = both > 0.5 * both.max()
    lamp = bright.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            lamp &= np.roll(bright, step, axis)
    lamp_ratio, lamp_se = (
        peer_agreement.ratio(a, b, lambda image: image[lamp].mean(axis=0, dtype=np.float64))
        if lamp.any()
        else (np.full(3, np.nan),) * 2
    )
    predicted = peer_agreement.predicted_ratios(program.repository, described, scene)
    wall = predicted["mitsuba_over_crt_xyz_by_reflections"][1][1]
    deviation = tile / mean[1] - 1
    z = deviation / (tile_se / mean[1])
    return {
        "dof": dof,
        "t": t,
        "renders": {name: len(p.images) for name, p in pools.items()},
        "samples": {name: int(sum(p.weights)) for name, p in pools.items()},
        "xyz_mean": {name: p.mean().reshape(-1, 3).mean(axis=0).tolist() for name, p in pools.items()},
        "ratio_xyz": mean.tolist(),
        "ratio_xyz_se": mean_se.tolist(),
        "lamp_pixels": int(lamp.sum()),
        "lamp_ratio_xyz": lamp_ratio.tolist(),
        "lamp_ratio_xyz_se": lamp_se.tolist(),
        "predicted": predicted,
        "unexplained_y": mean[1] / wall - 1,
        "tiles": {
            "ratio": tile.tolist(),
            "se": tile_se.tolist(),
            "worst_deviation": float(np.abs(deviation).max()),
            "worst_z": float(np.abs(z).max()),
            "beyond_2_se": int((np.abs(z) > 2).sum()),
            "count": int(z.size),
            "sidak": statistics.NormalDist().inv_cdf((1 + 0.95 ** (1 / z.size)) / 2),
        },
    }


def write_agreement(results, found, described):
    r, se, t = found["ratio_xyz"], found["ratio_xyz_se"], found["t"]
    p, tiles = found["predicted"], found["tiles"]
    results.heading("Do they agree?")
    results.paragraph(
        "Same triangles (quads as fans from their first corner), one-sided lamp, reflectances and lamp as "
        "the tables of the scene, written out to "
        "360 and 832 nm where they "
        f"are clamped, the camera's focal length and sensor as a field of view of {{:.4f}}°, box filter, "
        f"film in XYZ as 32-bit floats, at most "
        f"{found['max_depth']} scattering events "
        f"(Mitsuba's `max_depth` counts the emitter too: {found['max_depth'] + 1}).".format(found["fov"])
    )
    results.paragraph(
        "**Units.** crt: pixel = ∫L·(x̄, ȳ, z̄)dλ / ∫ȳdλ with L in "
        "W·m⁻²·sr⁻¹·nm⁻¹, the observer every nm, "
        f"∫ȳdλ = {p['crt_y_integral_nm']:.6f} nm. Mitsuba: pixel = "
        f"k·∫L·(x̄, ȳ, z̄)dλ with the observer "
        f"every 5 nm, linear between, and "
        f"k = 1/{1 / p['mitsuba_y_normalization']:.6f} nm, which is not quite the inverse of its own "
        f"table's "
        f"integral, "
        f"{p['mitsuba_y_integral_nm']:.6f} nm. So the "
        "conversion is 1, up to the tables. No white point enters: XYZ is written as it is, without a "
        "matrix."
    )
    reflections = p["mitsuba_over_crt_xyz_by_reflections"]
    rows = [
        [
            f"mean of the image, measured, ± 95 % ({found['dof']} degrees of freedom)",
            *(f"{percent(r[c] - 1, 3)} ± {100 * t * se[c]:.3f}" for c in range(3)),
        ],
        [
            f"{found['lamp_pixels']} pixels within the lamp, measured, ± 95 %",
            *(
                f"{percent(found['lamp_ratio_xyz'][c] - 1, 3)} ± "
                f"{100 * t * found['lamp_ratio_xyz_se'][c]:.3f}"
                for c in range(3)
            ),
        ],
    ]
    rows = [row for row in rows if "nan" not in row[1]]
    rows += [
        [
            f"lamp light after {k} reflection{'' if k == 1 else 's'} by white, from the tables alone",
            *(percent(reflections[k][c] - 1, 3) for c in range(3)),
        ]
        for k in range(4)
    ]
    results.table(["Mitsuba against crt", "X", "Y", "Z"], rows)
    agree = abs(found["unexplained_y"]) <= t * se[1] / r[1]
    results.paragraph(
        f"From {found['renders']['crt']} renders by crt ({found['samples']['crt']} samples per pixel "
        f"together) and {found['renders']['Mitsuba']} "
        "by Mitsuba "
        f"({found['samples']['Mitsuba']}), all with seeds of their own. Over light that white has reflected "
        f"once, which is most of what is seen, "
        "the tables of the observer account for "
        f"{percent(reflections[1][1] - 1, 3)} of Y; what remains of the mean is "
        f"{percent(found['unexplained_y'], 3)}, which is "
        f"{'within' if agree else '**beyond**'} the interval of ± {100 * t * se[1] / r[1]:.3f} %. In "
        f"{tiles['count']} tiles of luminance, after "
        "the common factor, the "
        f"largest difference is {100 * tiles['worst_deviation']:.2f} % and the largest in units of its "
        f"standard error {tiles['worst_z']:.2f}; "
        f"{tiles['beyond_2_se']} are beyond two "
        f"standard errors, where chance gives about {0.05 * tiles['count']:.0f}; Šidák's bound on the "
        f"largest is {tiles['sidak']:.2f} at 95 %, so "
        f"{'no tile differs' if tiles['worst_z'] <= tiles['sidak'] else '**some tile differs**'}."
    )
    results.paragraph(
        "Left as differences: the observer's tables (5 nm against 1 nm) and the constant k, both above. "
        "Hero "
        "wavelengths: both place four by one "
        "stratified "
        "number, crt distributed as (x̄ + ȳ + z̄)^0.4, Mitsuba as sech² around 538 nm (Radziszewski et "
        "al.); "
        "that changes noise and no mean. Roulette: "
        "crt survives with "
        "the largest of four throughputs, at least 0.05; Mitsuba with the same, at most 0.95; again noise "
        "alone. Rays leave surfaces by a fixed "
        "relative offset in "
        "Mitsuba and by a clearance proven for each triangle in crt; that could show only where surfaces "
        "meet, which the tiles would tell."
    )


def timing_row(line, target, pixels):
    at = {key: seconds_to(line.points, key, target) for key in ("cpu_seconds", "render_seconds")}
    last = line.points[-1]
    who = {
        key: getattr(line.contestant, key)
        for key in ("name", "renderer", "engine", "replicates", "roulette")
    }
    return {
        **who,
        "cpu_to_target": at["cpu_seconds"][0],
        "wall_to_target": at["render_seconds"][0],
        "extrapolated": at["cpu_seconds"][1],
        "cpu_to_target_by": {
            metric: seconds_to(line.points, "cpu_seconds", target, metric)[:2] for metric in METRICS
        },
        "relative_se": at["cpu_seconds"][2],
        "slope": slope_of(line.points),
        "last_spp": last["spp"],
        "last_error": last["error"],
        "cpu_us_per_sample": 1e6 * last["cpu_seconds"] / (last["spp"] * pixels),
        "points": line.points,
    }


class Race:
    """Times to the target, and the best of crt's Embree lines and of Mitsuba's on the
    processor."""

    def __init__(self, lines, starts, target, pixels):
        self.rows = {line.name: timing_row(line, target, pixels) for line in lines}
        self.target = target
        self.start = {
            name: {"cold": s["cold"], "warm": [float(np.median([w[i] for w in s["warm"]])) for i in (0, 1)]}
            for name, s in starts.items()
        }
        self.ours = self.best(lambda row: (row["renderer"], row["engine"]) == ("crt", "embree"))
        self.theirs = self.best(lambda row: row["renderer"] == "Mitsuba" and row["engine"] != "cuda_ad")
        self.factor = self.rows[self.ours]["cpu_to_target"] / self.rows[self.theirs]["cpu_to_target"]
        self.factor_se = self.factor * math.hypot(
            self.rows[self.ours]["relative_se"], self.rows[self.theirs]["relative_se"]
        )

    def best(self, among):
        """Least time to the target, of those that were measured to within five times the target, if there
        are any: farther out, extrapolation decides."""
        rows = [row for row in self.rows.values() if among(row)]
        near = [row for row in rows if row["last_error"] <= 5 * self.target]
        return min(
            near or [row for row in rows if row["replicates"] == 1], key=lambda row: row["cpu_to_target"]
        )["name"]

    def start_of(self, name):
        """Replicates cost nothing to begin: start-up is measured with one."""
        row = self.rows[name]
        alike = ("renderer", "engine", "roulette")
        return next(self.start[n] for n in self.start if all(self.rows[n][key] == row[key] for key in alike))

    def factor_with_start(self, kind):
        """`kind`: warm or cold. Processor seconds of start-up added to both."""
        ours, theirs = (
            self.rows[name]["cpu_to_target"] + self.start_of(name)[kind][1]
            for name in (self.ours, self.theirs)
        )
        return ours / theirs

    def json(self):
        return {
            "ours": self.ours,
            "theirs": self.theirs,
            "cpu": self.factor,
            "se": self.factor_se,
            "with_warm_start": self.factor_with_start("warm"),
            "with_cold_start": self.factor_with_start("cold"),
        }


def write_race(results, race, lines, arguments, roulette_from, reference):
    def seconds(name, key="cpu_to_target"):
        return significant(race.rows[name][key]) + ("*" if race.rows[name]["extrapolated"] else "")

    results.heading("Which is done first?")
    results.paragraph(
        f"On the processor, to {100 * race.target:g} %: {race.ours} takes {seconds(race.ours)} processor "
        f"seconds, {race.theirs} "
        f"{seconds(race.theirs)}: a factor of "
        f"**{race.factor:.2f} ± {1.96 * race.factor_se:.2f}**. With start-up, kernels from the cache: "
        f"{race.factor_with_start('warm'):.2f}; "
        f"nothing cached: "
        f"{race.factor_with_start('cold'):.2f}. At most half of Mitsuba's best was the aim: "
        f"{'reached' if race.factor <= 0.5 else '**missed**'}."
    )
    table = []
    for name, row in sorted(race.rows.items(), key=lambda item: item[1]["cpu_to_target"]):
        kinds = race.start_of(name)
        warm, cold = (f"{kinds[k][1]:.2f} / {kinds[k][0]:.2f}" for k in ("warm", "cold"))
        table.append(
            [
                name,
                f"{seconds(name)} ± {196 * row['relative_se']:.0f} %",
                seconds(name, "wall_to_target"),
                f"{row['cpu_us_per_sample']:.2f}",
                f"{row['slope']:.2f}",
                f"{100 * row['last_error']:.2f} % at {row['last_spp']}",
                warm,
                cold,
            ]
        )
    results.table(
        [
            "",
            "processor s to 1 %",
            "wall s to 1 %",
            "processor µs per path",
            "slope of error over samples",
            "smallest error measured",
            "start-up, warm: processor / wall s",
            "start-up, cold: processor / wall s",
        ],
        table,
    )
    others = float(np.median([p["others"] for line in lines for p in line.points]))
    results.paragraph(
        "Medians. Processor seconds are those of all threads of the render alone (Mitsuba: around "
        "`mi.render` with evaluation and synchronisation, "
        "its kernel "
        "compiled by a render before; crt: the process less its start-up); others on the machine change "
        "them "
        "little. Wall seconds are those of the "
        "render; other "
        f"processes took {others:.1%} of the processor in the median run"
        + (", so they mean little here. " if others > arguments.busy else ". ")
        + "Start-up is a whole process less its render: importing, reading the scene, compiling or loading "
          "kernels; cold is with empty caches, one "
        "run; warm the "
        "median of three. * = beyond what was measured, along the last three points. ± is 95 %, from the "
        "jackknife over replicates."
    )
    results.paragraph(
        f"The error is √(mean of (Y − Y of the reference)² over all pixels and {arguments.replicates} "
        f"renders with different seeds, less the reference's variance) / "
        f"mean Y; the reference has {reference.samples} samples per pixel by crt with other seeds, and is "
        f"itself within {100 * reference.error:.2f} %. Mitsuba's pixels "
        "are divided by what the tables of the observer account for (last section but one). All pixels "
        "count, the lamp's edge too. "
        f"Roulette, where named, may end a path after its scattering event {roulette_from} in both "
        f"programs; "
        f"otherwise there is none. “1 sequence” "
        f"is "
        "`sampler.replicates: 1`, “2 sequences” the default, from which an image knows its own error."
    )


def write_samplers(results, scores, roulette_from):
    results.heading("Mitsuba's samplers")
    results.paragraph(
        f"`llvm_ad_spectral`, 3 renders each, roulette from event {roulette_from}; least error² × time "
        f"goes into the race, in all variants, with and without "
        "roulette. Spectra are tables on a regular grid, which Mitsuba evaluates faster than irregular "
        "ones, "
        "and each material is one mesh."
    )
    results.table(
        [
            "sampler",
            "samples",
            "relative RMSE",
            "spread between seeds",
            "processor s",
            "error² × processor s",
        ],
        [
            [
                sampler,
                d["spp"],
                f"{100 * d['error']:.2f} %",
                f"{100 * d['spread']:.2f} %",
                significant(d["cpu_seconds"]),
                significant(d["error2_seconds"]),
            ]
            for sampler, d in sorted(scores.items(), key=lambda item: item[1]["error2_seconds"])
        ],
    )
    results.paragraph(
        "Where the error is larger than the spread between seeds, all seeds have an error in common, which "
        "averaging renders does not remove: who measures noise by repeating "
        "renders does not see it."
    )


def write_points(results, lines):
    results.heading("Every point")
    results.table(
        ["", "samples", *METRICS.values(), *SPREAD.values(), "processor s", "wall s", "others"],
        [
            [
                line.name,
                p["spp"],
                *(f"{100 * p[m]:.3f} ± {196 * p[m + '_se']:.3f} %" for m in (*METRICS, *SPREAD)),
                significant(p["cpu_seconds"]),
                significant(p["render_seconds"]),
                f"{p['others']:.0%}",
            ]
            for line in lines
            for p in line.points
        ],
    )


def write(program, results, arguments, run):
    lines, size, version = run["lines"], run["setup"]["size"], next(iter(run["described"].values()))
    race = Race(lines, run["starts"], run["target"], size**2)
    found = agreement(program, run["pools"], version, run["scene"])
    found["max_depth"], found["fov"] = run["setup"]["max_depth"], run["scene"]["fov_degrees"]
    results.paragraph(
        f"`{SCENE}` at {size} × {size} in crt and in Mitsuba {version['mitsuba']} (Dr.Jit "
        f"{version['drjit']}): whether their converged images "
        f"agree, and how long each "
        "takes to a relative RMSE of 1 % in luminance. Same machine, same run, all threads, everything "
        "interleaved."
    )
    results.lines += ["![Error against processor seconds](peers.svg)", ""]
    write_race(results, race, lines, arguments, run["roulette_from"], run["reference"])
    where_time_goes(results, race.rows, race.factor, int(run["reference"].room.sum()))
    write_samplers(results, run["scores"], run["roulette_from"])
    write_agreement(results, found, version)
    write_points(results, lines)
    settings = next(line.contestant for line in lines if line.contestant.renderer == "crt").settings()
    results.command(
        f"crt render configs/{SCENE}.yaml --backend embree --spp N --seed SEED "
        + " ".join(f"--set '{s}'" for s in settings)
        + " -o image.pfm"
    )
    results.data = {
        "size": size,
        "target": run["target"],
        "factor": race.json(),
        "lines": race.rows,
        "start_wall_cpu": race.start,
        "agreement": found,
        "samplers": run["scores"],
        "versions": {
            v: {k: d[k] for k in ("mitsuba", "drjit", "numpy", "python", "threads", "llvm")}
            for v, d in run["described"].items()
        },
    }
    write_pictures(program.repository / "out" / "peers", run["pools"])
    arguments.results.mkdir(parents=True, exist_ok=True)
    curves = [
        (
            line.contestant,
            [(p["cpu_seconds"], p["error"]) for p in line.points if p["cpu_seconds"] > 0 and p["error"] > 0],
        )
        for line in lines
    ]
    (arguments.results / "peers.svg").write_text(
        peer_plot.draw(
            [c for c in curves if c[1]],
            run["target"],
            f"Cornell box, {size} × {size}: error against time",
            f"processor seconds of the render, all threads ({processor()})",
        )
    )
    results.write()
    return 0


def write_pictures(folder, pools):
    folder.mkdir(parents=True, exist_ok=True)
    for name, pool in pools.items():
        peer_agreement.write_png(folder / f"{name.lower()}.png", pool.mean())


def where_time_goes(results, rows, factor, room):
    """Time to an error is time per path times paths needed; the two factors of each pairing that has the
    same roulette."""
    results.heading("Time by stage")
    table, per_paths = [], []
    for roulette in (False, True):
        ours, theirs = (
            next(
                r
                for r in rows.values()
                if (r["renderer"], r["engine"], r["replicates"], r["roulette"]) == (*who, 1, roulette)
            )
            for who in (("crt", "embree"), ("Mitsuba", "llvm_ad"))
        )
        per_path = ours["cpu_us_per_sample"] / theirs["cpu_us_per_sample"]
        per_paths.append(per_path)
        for metric, text in METRICS.items():
            (a, beyond_a), (b, beyond_b) = (
                ours["cpu_to_target_by"][metric],
                theirs["cpu_to_target_by"][metric],
            )
            table.append(
                [
                    f"{ours['name']} against {theirs['name']}",
                    text,
                    f"{per_path:.2f}",
                    f"{a / b / per_path:.2f}",
                    f"{a / b:.2f}" + ("*" if beyond_a or beyond_b else ""),
                ]
            )
    results.paragraph(
        f"Time to an error = processor seconds per path × paths. crt over Mitsuba, so that less than 1 is "
        f"to "
        f"crt's advantage; * as above. “Without the lamp” are the {room} pixels that do "
        "not see it and have no neighbour that does."
    )
    results.table(["", "error of", "time per path", "paths to 1 %", "time to 1 %"], table)
    if factor > 0.5:
        results.paragraph(
            f"So a path costs crt {min(per_paths):.2f} to {max(per_paths):.2f} of what it costs Mitsuba, "
            f"and "
            f"the rest is noise per path. *Per "
            "path*: Mitsuba's `llvm_ad_spectral` compiles the path "
            "tracer into one kernel of vectors as wide as the processor has (16 lanes with AVX-512), a path "
            "in each lane, with tracing by Embree; "
            "crt follows one path a "
            "thread, with eight triangles a test and four wavelengths as its vectors. This scene, of 38 "
            "triangles and one kind of material, where "
            "lanes hardly part, is the best case for wide "
            "kernels. The scalar variant, a path at a time, is in the table above. *Noise*: the lamp and "
            "its "
            "edges, seen directly and a hundred times brighter than "
            "the walls, weigh most in luminance over all pixels; what counts there is how evenly the points "
            "of one pixel lie over the pixel, and over wavelengths. The "
            "rows without the lamp, and for X, Y and Z, show how much of it that is."
        )
