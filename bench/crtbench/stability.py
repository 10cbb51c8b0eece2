"""The limits of a backend's arithmetic: sweeps over sizes, gaps, places, fields of view and solid angles,
each to where it ends, with every backend that runs here. Rays are
counted, nothing is timed: it may run on a busy machine. --rows takes what stability_sweep printed on other
machines, with "backend", and "machine" in words, added to each line, and the number of rays asked for as
"asked".
"""

import json
import pathlib

from .program import Failure
from .results import Results, processor

SWEEPS = {
    "misses": "Rays do not pass between triangles",
    "offset-safety": "Rays do not meet the triangle that they leave",
    "offset-tightness": "How near a layer may be and still be seen",
    "far": "Scenes far from the origin",
    "scale": "Huge and tiny scenes",
    "fov": "Narrow and wide fields of view",
    "solid-angle": "Small lights",
}
# Of each point of a sweep; `--times` multiplies them. Offset safety has 20 points.
RAYS = {
    "misses": 2e5,
    "offset-safety": 1e6,
    "offset-tightness": 5e4,
    "far": 1e5,
    "scale": 1e5,
    "fov": 3e5,
    "solid-angle": 3e6,
}
BACKENDS = ["cuda", "embree", "opencl"]


def options(parser):
    parser.add_argument("--scenes", nargs="*", metavar="SWEEP", help=f"only these of {', '.join(SWEEPS)}")
    parser.add_argument("--rows", help="measurements made on another machine, JSON Lines")
    parser.add_argument(
        "--times", type=float, default=1, metavar="N",
        help="so many times the rays of each point (1); 5 makes 1e8 of offset-safety",
    )


def measure(program, arguments):
    if not (program.build / "bin" / "stability_sweep").exists():
        raise Failure("there is no stability_sweep in the build: it needs -DCRT_TESTS=ON")
    sweeps = arguments.scenes or list(SWEEPS)
    if unknown := set(sweeps) - set(SWEEPS):
        raise Failure(f"no such sweep: {', '.join(sorted(unknown))}; there are {', '.join(SWEEPS)}")
    elsewhere = {}
    for line in pathlib.Path(arguments.rows).read_text().splitlines() if arguments.rows else ():
        row = json.loads(line)
        elsewhere.setdefault(row.pop("sweep"), {}).setdefault(row.pop("backend"), []).append(row)
    usable, absent = program.backends(BACKENDS)
    for sweep in sweeps:
        rays = RAYS[sweep] * arguments.times / (100 if arguments.tiny else 1)
        given = elsewhere.get(sweep, {})
        points = {
            backend: given.get(backend) or run(program, backend, sweep, rays)
            for backend in BACKENDS
            if backend in given or backend in usable
        }
        results = Results(program, arguments, f"stability-{sweep}", SWEEPS[sweep])
        text, head, rows = TABLES[sweep](points)
        results.paragraph(text)
        results.table(head, rows)
        results.not_measured(
            {backend: reason for backend, reason in absent.items() if backend not in points}
        )
        if given:
            results.machine = origins(points).rstrip(".")
        results.claim(SWEEPS[sweep], f"{text} {amounts(points)}", head, merged(rows))
        for backend, rows in points.items():
            asked = f"{rows[0]['asked']:.0e}" if "asked" in rows[0] else "RAYS"
            results.command(f"{program.build}/bin/stability_sweep {backend} {sweep} {asked}")
        results.data = {"points": points}
        results.write()


def run(program, backend, sweep, rays, environment=None):
    paths = {
        "CRT_BACKEND_PATH": f"{program.build / 'lib' / 'crt'}:{program.environment['CRT_BACKEND_PATH']}"
    }
    output = program.start(
        [backend, sweep, rays],
        program=program.build / "bin" / "stability_sweep",
        environment={**paths, **(environment or {})},
    ).output
    return [{**json.loads(line), "asked": rays, "machine": processor()} for line in output.splitlines()]


def together(names):
    """`a`, `b` and `c`"""
    *first, last = (f"`{name}`" for name in names)
    return f"{', '.join(first)} and {last}" if first else last


def alike(points, what):
    """{what(rows): backends} of backends' rows."""
    groups = {}
    for backend, rows in points.items():
        groups.setdefault(what(rows), []).append(backend)
    return groups


def amount(rows):
    """Of rays each point of a sweep has, or of samples each pixel; what the backend refused has none."""
    unit, what = (
        ("samples", "samples a pixel") if any("samples" in row for row in rows) else ("rays", "rays a point")
    )
    counts = [row[unit] for row in rows if unit in row] or [0]
    least, most = min(counts), max(counts)
    return f"{least:.3g} {what}" if least == most else f"{least:.3g} to {most:.3g} {what}"


def amounts(points):
    groups = alike(points, amount)
    return (
        next(iter(groups))
        if len(groups) == 1
        else "; ".join(f"{together(backends)} {text}" for text, backends in groups.items())
    ) + "."


def origins(points):
    parts = []
    # This machine comes last.
    for machine, backends in sorted(
        alike(points, lambda rows: rows[0].get("machine", "another machine")).items(),
        key=lambda item: item[0] == processor(),
    ):
        verb = "" if parts else " was measured" if len(backends) == 1 else " were measured"
        parts.append(
            f"{together(backends)}{verb} on {machine}"
        )
    return "; ".join(parts) + "."


def count(point):
    """Failures of rays; with none, what rate 99.9 % confidence leaves (Clopper and Pearson)."""
    if point["failures"] == 0:
        return (
            f"0 of {point['rays']:.3g} (rate < {7.61 / point['rays']:.1g})" if point["rays"] else "no rays"
        )
    return f"{point['failures']} of {point['rays']:.3g} ({point['failures'] / point['rays']:.2g})"


def by_point(points, keys, heads, cell):
    """(head, rows): a row a point, a column a backend."""
    backends = list(points)
    rows = []
    for same in zip(*points.values()):
        rows.append(
            [
                *(f"{same[0][k]:g}" if isinstance(same[0][k], (int, float)) else same[0][k] for k in keys),
                *(cell(p) for p in same),
            ]
        )
    return [*heads, *backends], rows


def misses(points):
    text = (
        "A crumpled sheet covers the whole film, a vertex or an edge on every pixel's first ray: by "
        "continuity no ray can pass it. Failures are rays that do. "
        "Faces are aimed at by further, random samples of the same pixels."
    )
    return text, *by_point(points, ("place", "aim"), ("place", "rays at"), count)


def offset_safety(points):
    text = (
        "One triangle in a random place and pose, of random shape, in a scene that is 1 to 10⁶ times as "
        "large, so that its coordinates become coarse; rays scatter off it "
        "by the cosine. Failures meet the triangle that they have just left. Lengths in the author's units."
    )
    heads = ("triangle's size", "scene's half extent : size")
    return text, *by_point(points, ("size", "extent"), heads, count)


def offset_tightness(points):
    text = (
        "Two parallel squares of edge 1 and 2 in a random place and pose, `gap` apart, in a scene whose "
        "half "
        "extent is 1 (1.5 for the first rows) to 10⁴; rays pass through the first, "
        "whose index is 1. Failures do not meet the second. The last gap with hardly any failure is the "
        "limit that the manual gives."
    )
    return text, *by_point(points, ("extent", "gap"), ("scene's half extent : size", "gap : size"), count)


def merged(rows):
    """Neighbours that differ in one column alone, that in which the first two rows differ, become one row,
    `first … last`."""
    column = next((i for i, cell in enumerate(rows[0]) if cell != rows[1][i]), 0) if len(rows) > 1 else 0
    groups = []
    for row in rows:
        others = row[:column] + row[column + 1:]
        if groups and groups[-1][0] == others:
            groups[-1][1].append(row)
        else:
            groups.append((others, [row]))
    for _, same in groups:
        if len(same) > 1:
            same[0][column] = f"{same[0][column]} … {same[-1][column]}"
    return [same[0] for _, same in groups]


def relation(point):
    if "refused" in point:
        return f"refused: {point['refused']}"
    same = "same bits" if point["pixels"] == 0 else f"{point['pixels']} of {point['of']} pixels differ"
    return f"{same}; mean {point['mean']:+.2g}"


def far(points):
    text = (
        "A lit room moved along (1, 0.7, −0.3) by many times its size: once with vertices that the sum in "
        "double holds exactly, once a third of it, which rounds. "
        "Against the same room at the origin, with the same random numbers: pixels that differ in any bit, "
        "and the relative difference of the mean."
    )
    for same in points.values():
        for p in same:
            p["how"] = "exactly" if p["representable"] else "rounded"
    return text, *by_point(points, ("sizes", "how"), ("moved by … sizes", "shift"), relation)


def scale(points):
    text = (
        "A lit room times 2^m and 10^m, against itself: pixels that differ in any bit, and the relative "
        "difference of the mean, with the same random numbers."
    )
    for same in points.values():
        for p in same:
            p["factor"] = f"{p['base']}^{p['exponent']}"
    return text, *by_point(points, ("factor",), ("times",), relation)


def fov(points):
    text = (
        "Stripes two pixels wide where the film's columns are, 128 × 128 pixels, the view along (1, "
        "1, 1). Failures are rays that see the stripe of another column: what the rounding "
        "of directions to float costs, in rays."
    )
    return text, *by_point(points, ("degrees",), ("field of view, degrees",), count)


def solid_angle(points):
    text = (
        "A square light at height 1 over a floor, from 2 rad across to nothing: the irradiance below its "
        "centre against the closed form (Howell, B-4). Relative error, and its standard error "
        "from 16 seeds."
    )
    return text, *by_point(
        points,
        ("half_edge", "solid_angle"),
        ("half edge", "solid angle, sr"),
        lambda p: f"{p['error']:+.2g} ± {p['standard_error']:.1g}",
    )


TABLES = {
    "misses": misses,
    "offset-safety": offset_safety,
    "offset-tightness": offset_tightness,
    "far": far,
    "scale": scale,
    "fov": fov,
    "solid-angle": solid_angle,
}
