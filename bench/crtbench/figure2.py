"""Figure 2 of the paper that crt grew out of: render time against samples per pixel, 1 … 1024, of the
Cornell box at 1440 × 1440, and at 2880 × 2880, for every backend."""

from . import log_log
from .program import Spread, significant

SCENE = "cornell_box"
COUNTS = [2**k for k in range(11)]
COLOURS = {
    "embree": ("#0067a5", "#56b4e9"),
    "opencl": ("#00785a", "#2fc39b"),
    "cuda": ("#b34700", "#ff9455"),
}


def few_runs(spp, _seconds):
    """Of a number of samples, where the last one took `_seconds`."""
    return 1 if spp > 4 else 2


def timings(program, backends, resolutions, longest, settings=(), runs=few_runs, keep=print):
    """A row for every render: of growing numbers of samples, as long as one is likely to take less than
`longest` seconds. `runs(spp, seconds of the last)`: how often each is rendered; `keep(row)` gets
    each row when it is there."""
    rows = []
    for resolution in resolutions:
        size = f"film.resolution=[{resolution},{resolution}]"
        for spp in COUNTS:
            last = {b: last_seconds(rows, b, resolution) for b in backends}
            cases = {
                b: (
                    lambda b=b, spp=spp: program.render(
                        SCENE, b, ["--spp", spp], settings=[size, "outputs.0.aovs=[]", *settings]
                    )
                )
                for b in backends
                if last[b] * 2 < longest
            }
            if not cases:
                break
            for repeats in sorted({runs(spp, last[b]) for b in cases}):
                chosen = {b: case for b, case in cases.items() if runs(spp, last[b]) == repeats}
                # The kernel is the same for all counts: a long render needs no uncounted one before it.
                warm_up = max(last[b] for b in chosen) < 1
                for backend, done in program.interleaved(chosen, repeats, warm_up=warm_up).items():
                    for i, r in enumerate(done):
                        rows.append(
                            {
                                "backend": backend,
                                "resolution": resolution,
                                "spp": spp,
                                "repeat": i,
                                "render": r.value("seconds", "render"),
                                "others": round(r.others, 4),
                            }
                        )
                        keep(rows[-1])
    return rows


def last_seconds(rows, backend, resolution):
    return max(
        (r["render"] for r in rows if r["backend"] == backend and r["resolution"] == resolution), default=0.0
    )


def medians(rows):
    """{(backend, resolution): [(spp, seconds)]}"""
    lines = {}
    for key in sorted({(r["backend"], r["resolution"]) for r in rows}):
        of_key = [r for r in rows if (r["backend"], r["resolution"]) == key]
        lines[key] = [
            (spp, Spread(r["render"] for r in of_key if r["spp"] == spp).median)
            for spp in sorted({r["spp"] for r in of_key})
        ]
    return lines


def line_fit(points):
    """t = t0 + c N with relative errors: (t0, c, largest relative deviation)."""
    weights = [1 / t**2 for _, t in points]
    total = sum(weights)
    mean_n = sum(w * n for w, (n, _) in zip(weights, points)) / total
    mean_t = sum(w * t for w, (_, t) in zip(weights, points)) / total
    c = (sum(w * (n - mean_n) * (t - mean_t) for w, (n, t) in zip(weights, points))
         / sum(w * (n - mean_n) ** 2 for w, (n, _) in zip(weights, points)))
    t0 = mean_t - c * mean_n
    return t0, c, max(abs(t0 + c * n - t) / t for n, t in points)


def slope(points):
    """d log t / d log N over the upper half of the points."""
    return log_log.PowerLaw(points[len(points) // 2 - 1:] if len(points) > 3 else points).exponent


def show(results, lines):
    """The table of the fits; returns them for programs."""
    table, data = [], {}
    for (backend, resolution), points in lines.items():
        if len(points) < 3:
            continue
        t0, c, deviation = line_fit(points)
        megapaths = resolution**2 / c * 1e-6
        table.append(
            [
                backend,
                f"{resolution}²",
                f"{points[0][0]} – {points[-1][0]}",
                significant(points[-1][1]),
                significant(1e3 * t0),
                significant(1e3 * c),
                significant(megapaths),
                significant(slope(points)),
                f"{deviation:.1%}",
            ]
        )
        data[f"{backend} {resolution}"] = {
            "points": points,
            "t0": t0,
            "seconds_per_sample": c,
            "mpaths_per_second": megapaths,
            "slope_upper_half": slope(points),
            "largest_deviation": deviation,
        }
    results.table(
        [
            "backend",
            "resolution",
            "samples",
            "s at the last",
            "t₀, ms",
            "c, ms per sample",
            "Mpaths/s",
            "slope (upper half)",
            "farthest from t₀ + cN",
        ],
        table,
    )
    return data


def doublings(lines, data):
    """A sentence a backend on the larger image's cost; adds the ratio to the fits."""
    sentences = []
    for backend in sorted({b for b, _ in lines}):
        small, large = (
            (data.get(f"{backend} {r}") for r in sorted({r for b, r in lines if b == backend})[:2])
            if len({r for b, r in lines if b == backend}) > 1
            else (None, None)
        )
        if small and large:
            ratio = large["seconds_per_sample"] / small["seconds_per_sample"]
            data[f"{backend} doubling"] = ratio
            sentences.append(
                f"- {backend}: twice the width and height costs {significant(ratio)} times as much a "
                f"sample; "
                f"4 is linear in the number of pixels"
            )
    return sentences


def draw(lines):
    """{(backend, resolution): [(spp, seconds)]} as a chart, as SVG."""
    title = "Render seconds against samples per pixel, Cornell box"
    seconds = [t for points in lines.values() for _, t in points]
    largest = max(resolution for _, resolution in lines)
    with log_log.style():
        figure, axes = log_log.canvas()
        axes.set_xscale("log", base=2)
        axes.set(
            title=title,
            xlabel="samples per pixel",
            xlim=(COUNTS[0] / 1.15, COUNTS[-1] * 1.15),
            ylim=(min(seconds) * 0.7, max(seconds) * 2.2),
        )
        for (backend, resolution), points in lines.items():
            name = f"{backend}, {resolution}²"
            log_log.curve(axes, points, COLOURS[backend], name, dashed=resolution == largest)
        axes.set_xticks(COUNTS, labels=map(str, COUNTS))
        log_log.decimal_ticks(axes.yaxis, lambda value: f"{value:g} s")
        log_log.name_above(axes)
        return log_log.svg(figure, title, COLOURS.values())
