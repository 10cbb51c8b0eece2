"""Figure 2 of the paper that crt grew out of: render time against samples per pixel, 1 … 1024, of the Cornell box at 1440 × 1440, and at 2880 × 2880, for
every backend. --rows takes measurements of the same kind made on another machine (JSON Lines with backend, resolution, spp, repeat, render)."""
import json
import math
import pathlib

from .program import Failure, Spread, significant
from .results import Results

SCENE = "cornell_box"
COUNTS = [2**k for k in range(11)]
COLOURS = {"embree": ("#0067a5", "#56b4e9"), "opencl": ("#00785a", "#2fc39b"), "cuda": ("#b34700", "#ff9455")}


def measure(program, arguments):
    resolutions = (72, 144) if arguments.tiny else (1440, 2880)
    longest = 0.2 if arguments.tiny else 16.0   # Seconds that one render may take: a processor does not get to 1024.
    usable, absent = program.backends(["cuda", "embree", "opencl"])
    rows = []
    for resolution in resolutions:
        for spp in COUNTS:
            cases = {b: (lambda b=b: program.render(SCENE, b, ["--spp", spp], settings=[f"film.resolution=[{resolution},{resolution}]", "outputs.0.aovs=[]"]))
                     for b in usable if last_seconds(rows, b, resolution) * 2 < longest}
            if not cases:
                break
            for backend, done in program.interleaved(cases, 1 if spp > 4 else 2).items():
                rows += [{"backend": backend, "resolution": resolution, "spp": spp, "repeat": i, "render": r.value("seconds", "render")}
                         for i, r in enumerate(done)]
            print(rows[-1], flush=True)
    if arguments.rows:
        rows += [json.loads(line) for line in pathlib.Path(arguments.rows).read_text().splitlines()]
    if not rows:
        raise Failure("no backend can run here")
    write(program, arguments, rows, absent)


def last_seconds(rows, backend, resolution):
    return max((r["render"] for r in rows if r["backend"] == backend and r["resolution"] == resolution), default=0.0)


def medians(rows):
    """{(backend, resolution): [(spp, seconds)]}"""
    lines = {}
    for key in sorted({(r["backend"], r["resolution"]) for r in rows}):
        of_key = [r for r in rows if (r["backend"], r["resolution"]) == key]
        lines[key] = [(spp, Spread(r["render"] for r in of_key if r["spp"] == spp).median) for spp in sorted({r["spp"] for r in of_key})]
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
    upper = points[len(points) // 2 - 1:] if len(points) > 3 else points
    xs, ys = [math.log(n) for n, _ in upper], [math.log(t) for _, t in upper]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def write(program, arguments, rows, absent):
    results = Results(program, arguments, "figure2", "Time against samples: the paper's Figure 2")
    lines = medians(rows)
    results.paragraph("Render seconds by the backend's report, median of repeats. A render that would take over 16 s on a processor was left out.")
    results.paragraph("![Seconds against samples per pixel](figure2.svg)")
    table, data = [], {}
    for (backend, resolution), points in lines.items():
        if len(points) < 3:
            continue
        t0, c, deviation = line_fit(points)
        megapaths = resolution**2 / c * 1e-6
        table.append([backend, f"{resolution}²", f"{points[0][0]} – {points[-1][0]}", significant(points[-1][1]), significant(1e3 * t0), significant(1e3 * c),
                      significant(megapaths), significant(slope(points)), f"{deviation:.1%}"])
        data[f"{backend} {resolution}"] = {"points": points, "t0": t0, "seconds_per_sample": c, "mpaths_per_second": megapaths,
                                           "slope_upper_half": slope(points), "largest_deviation": deviation}
    results.table(["backend", "resolution", "samples", "s at the last", "t₀, ms", "c, ms per sample", "Mpaths/s", "slope (upper half)",
                   "farthest from t₀ + cN"], table)
    doubling = []
    for backend in sorted({b for b, _ in lines}):
        small, large = (data.get(f"{backend} {r}") for r in sorted({r for b, r in lines if b == backend})[:2]) if len({r for b, r in lines if b == backend}) > 1 else (None, None)
        if small and large:
            ratio = large["seconds_per_sample"] / small["seconds_per_sample"]
            data[f"{backend} doubling"] = ratio
            doubling.append(f"- {backend}: twice the width and height costs {significant(ratio)} times as much a sample; 4 is linear in the number of pixels")
    results.heading("The doubling")
    results.lines += [*doubling, ""]
    for name, reason in absent.items():
        if not any(b == name for b, _ in lines):
            results.paragraph(f"Not measured: `{name}` ({reason}).")
    results.command(f"crt render configs/{SCENE}.yaml --backend BACKEND --spp N --set 'film.resolution=[1440,1440]' --set 'outputs.0.aovs=[]' -o unseen.pfm")
    results.data = {"rows": rows, "fits": data}
    results.write()
    (arguments.results / "figure2.svg").write_text(draw(lines))


def draw(lines):
    """Log-log, labels at the lines' ends."""
    width, height, left, right, top, bottom = 860, 520, 70, 190, 24, 56
    seconds = [t for points in lines.values() for _, t in points]
    low, high = math.log10(min(seconds) * 0.7), math.log10(max(seconds) * 1.4)
    x = lambda n: left + (width - left - right) * math.log2(n) / 10
    y = lambda t: height - bottom - (height - top - bottom) * (math.log10(t) - low) / (high - low)
    style = ".ink{fill:#1a1a1a}.soft{fill:#555}.grid{stroke:#e2e2e2}.ground{fill:#fff}"
    dark = ".ink{fill:#eee}.soft{fill:#b0b0b0}.grid{stroke:#343434}.ground{fill:#161616}"
    for name, (light, night) in COLOURS.items():
        style += f".{name}{{stroke:{light};fill:none}}.t-{name}{{fill:{light}}}"
        dark += f".{name}{{stroke:{night}}}.t-{name}{{fill:{night}}}"
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="system-ui, sans-serif" font-size="13" role="img">',
           "<title>Render seconds against samples per pixel, Cornell box</title>",
           f"<style>{style}@media (prefers-color-scheme: dark){{{dark}}}</style>", f'<rect class="ground" width="{width}" height="{height}"/>']
    for n in COUNTS:
        out.append(f'<line class="grid" x1="{x(n):.1f}" x2="{x(n):.1f}" y1="{top}" y2="{height - bottom}"/>'
                   f'<text class="soft" x="{x(n):.1f}" y="{height - bottom + 18}" text-anchor="middle">{n}</text>')
    for exponent in range(math.ceil(low), math.floor(high) + 1):
        out.append(f'<line class="grid" x1="{left}" x2="{width - right}" y1="{y(10**exponent):.1f}" y2="{y(10**exponent):.1f}"/>'
                   f'<text class="soft" x="{left - 8}" y="{y(10**exponent) + 4:.1f}" text-anchor="end">{10**exponent:g} s</text>')
    taken = []
    for (backend, resolution), points in sorted(lines.items(), key=lambda item: y(item[1][-1][1])):
        dash = ' stroke-dasharray="6 4"' if resolution == max(r for _, r in lines) else ""
        path = " ".join(f"{x(n):.1f},{y(t):.1f}" for n, t in points)
        out.append(f'<polyline class="{backend}" stroke-width="2.2"{dash} points="{path}"/>')
        out += [f'<circle class="t-{backend}" cx="{x(n):.1f}" cy="{y(t):.1f}" r="3"/>' for n, t in points]
        n, t = points[-1]
        label_y = y(t) + 4
        while any(abs(label_y - other) < 16 and abs(x(n) - at) < 110 for other, at in taken):
            label_y += 4
        taken.append((label_y, x(n)))
        out.append(f'<text class="t-{backend}" x="{x(n) + 8:.1f}" y="{label_y:.1f}">{backend}, {resolution}²</text>')
    out.append(f'<text class="soft" x="{(left + width - right) / 2}" y="{height - 14}" text-anchor="middle">samples per pixel</text>')
    return "\n".join([*out, "</svg>"]) + "\n"
