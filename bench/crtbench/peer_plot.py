"""Error against seconds: one line for each contestant, named at its end."""
from .log_log import Chart, ticks

# Okabe and Ito's palette, which the colour-blind can tell apart, darkened or lightened for 4.5:1 against
# its ground.
COLOURS = {
    ("crt", "embree"): ("#0067a5", "#56b4e9"),
    ("crt", "opencl"): ("#00785a", "#2fc39b"),
    ("crt", "cuda"): ("#5a5a00", "#f0e442"),
    ("Mitsuba", "llvm_ad"): ("#b34700", "#ff9455"),
    ("Mitsuba", "scalar"): ("#a04878", "#e39cc4"),
    ("Mitsuba", "cuda_ad"): ("#7a4fbf", "#b79cf0"),
}
MANTISSAS = (1, 2, 5)
LABEL_GAP = 17


def spread(wanted, gap):
    """Heights as near as a label can get to where it belongs without touching its neighbour."""
    order = sorted(range(len(wanted)), key=lambda i: wanted[i])
    placed = [wanted[i] for i in order]
    for _ in range(200):
        for i in range(1, len(placed)):
            overlap = gap - (placed[i] - placed[i - 1])
            if overlap > 0:
                placed[i - 1] -= overlap / 2
                placed[i] += overlap / 2
    result = [0.0] * len(wanted)
    for rank, i in enumerate(order):
        result[i] = placed[rank]
    return result


def draw(curves, target, title, x_title):
    """curves: [(contestant, [(seconds, relative error)])], none empty, all positive; relative errors as
    fractions."""
    seconds, errors = zip(*(p for _, points in curves for p in points))
    chart = Chart(
        (900, 560),
        (70, 250, 54, 60),
        (min(seconds) * 0.8, max(seconds) * 1.1),
        (min(target, *errors) * 0.85, max(errors) * 1.15),
        COLOURS,
    )
    chart.draw(f'<text class="ink" x="{chart.left}" y="28" font-size="16" font-weight="600">{title}</text>')
    for tick in ticks(*chart.x_range, MANTISSAS):
        chart.x_tick(tick, f"{tick:g}")
    for tick in ticks(*chart.y_range, MANTISSAS):
        chart.y_tick(tick, f"{100 * tick:g} %")
    chart.draw(
        f'<rect class="frame" x="{chart.left}" y="{chart.top}" width="{chart.right - chart.left}" '
        f'height="{chart.bottom - chart.top}"/>'
    )
    draw_guide(chart)
    chart.draw(
        f'<line class="frame" x1="{chart.left}" x2="{chart.right}" y1="{chart.y(target):.1f}" '
        f'y2="{chart.y(target):.1f}" stroke-width="1.5"/>'
    )
    heights = spread([chart.y(points[-1][1]) for _, points in curves], LABEL_GAP)
    for (contestant, points), height in zip(curves, heights):
        thin = contestant.replicates > 1
        kind = (contestant.renderer, contestant.engine)
        chart.curve(kind, points, 1.3 if thin else 2.4, 2.2 if thin else 3.4, dashed=contestant.roulette)
        x, y = chart.x(points[-1][0]), chart.y(points[-1][1])
        chart.draw(
            f'<line class="l{list(COLOURS).index(kind)}" stroke-width="0.6" opacity="0.6" x1="{x + 5:.1f}" '
            f'y1="{y:.1f}" x2="{chart.right + 6}" y2="{height:.1f}"/>'
        )
        chart.label(kind, chart.right + 10, height + 4, contestant.name, 12)
    chart.x_title(x_title)
    chart.draw(
        f'<text class="soft" transform="translate(18 {(chart.top + chart.bottom) / 2}) rotate(-90)" '
        f'text-anchor="middle">relative RMSE of luminance</text>'
    )
    return chart.svg(title)


def draw_guide(chart):
    """A line of slope −½ to hold the others against, in the corner that they leave free."""
    (x_low, x_high), (y_low, y_high) = chart.x_range, chart.y_range
    begin, end = (x_low * (x_high / x_low) ** share for share in (0.04, 0.3))
    upper = y_low * (y_high / y_low) ** 0.4
    lower = upper * (begin / end) ** 0.5
    chart.draw(
        f'<line class="guide" x1="{chart.x(begin):.1f}" y1="{chart.y(upper):.1f}" x2="{chart.x(end):.1f}" '
        f'y2="{chart.y(lower):.1f}"/>'
        f'<text class="soft" x="{chart.x(begin):.1f}" y="{chart.y(lower) + 16:.1f}" font-size="12">slope '
        f'−½: '
        f'independent samples</text>'
    )
