"""Fits and drawings on two logarithmic scales: power laws"""

import io
import math
import statistics
import sys

from .program import Failure

# Colours are pairs: on light and on dark. Drawings have the first; svg() exchanges them by their value, so
# that no two pairs may have the first in common.
INK, SOFT = ("#1a1a1a", "#eeeeee"), ("#555555", "#b0b0b0")
GRID, FRAME, PAPER = ("#e2e2e2", "#343434"), ("#999999", "#777777"), ("#ffffff", "#161616")
# The salt makes the names of a chart's parts the same whenever it is drawn.
STYLE = {"svg.fonttype": "none", "svg.hashsalt": "crt", "path.simplify": False,
         "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9.5,
         "text.color": INK[0], "axes.titlecolor": INK[0], "axes.titlesize": 12, "axes.titleweight": "bold",
         "axes.titlelocation": "left", "axes.titlepad": 9, "axes.labelcolor": SOFT[0], "axes.labelsize": 9.5,
         "axes.labelpad": 7, "axes.edgecolor": FRAME[0], "axes.facecolor": "none", "axes.grid": True,
         "axes.axisbelow": True, "grid.color": GRID[0], "figure.facecolor": PAPER[0],
         "xtick.color": FRAME[0], "ytick.color": FRAME[0], "xtick.labelcolor": SOFT[0],
         "ytick.labelcolor": SOFT[0]}
DASHES = (0, (4.5, 3))
DOTS = (0, (1.2, 2.6))
SIZE = (9, 5.6)  # Inches of 72 units, of which text has 9 to 12.
LINE = 1.25  # From one name to the next, in sizes of their text.


class PowerLaw:
    """y = e^offset · x^exponent through points (x, y), all positive and at least two: least squares in the
    logarithms."""

    def __init__(self, points):
        xs, ys = zip(*points)
        self.exponent, self.offset = statistics.linear_regression(
            [math.log(x) for x in xs], [math.log(y) for y in ys]
        )

    def __call__(self, x):
        return math.exp(self.offset + self.exponent * math.log(x))


def library():
    """matplotlib, which nothing but a chart needs. A longer measurement asks for it before."""
    try:
        import matplotlib.figure
        import matplotlib.ticker
    except ImportError:
        raise Failure(
            f"matplotlib draws the charts, and this Python has none: {sys.executable} -m pip install "
            f"matplotlib"
        ) from None
    return matplotlib


def style():
    """In which a chart is made, from canvas() to svg()."""
    return library().rc_context(STYLE)


def canvas():
    """(figure, axes), both axes logarithmic."""
    figure = library().figure.Figure(figsize=SIZE, dpi=72, layout="constrained")
    return figure, figure.add_subplot(xscale="log", yscale="log")


def curve(axes, points, colour, name, thin=False, dashed=False):
    """Points, joined; name_above() or name_beside() writes the name."""
    xs, ys = zip(*points)
    axes.plot(
        xs,
        ys,
        color=colour[0],
        label=name,
        linestyle=DASHES if dashed else "-",
        linewidth=1.1 if thin else 1.9,
        marker="o",
        markersize=3 if thin else 4.8,
        markeredgewidth=0,
    )


def decimal_ticks(axis, text):
    """Ticks at 1, 2 and 5 times powers of ten, or only at the powers where there is no room; `text(value)`
    labels them."""
    ticker = library().ticker
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: text(value)))
    axis.set_minor_locator(ticker.NullLocator())
    axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5), numticks=100))
    axis.get_figure().draw_without_rendering()
    if touching([label.get_window_extent() for label in axis.get_ticklabels() if label.get_text()]):
        axis.set_major_locator(ticker.LogLocator())


def touching(boxes):
    """True if neighbours overlap, or have no room of 3 units between them."""
    return any(a.padded(3).overlaps(b) for a, b in zip(boxes, boxes[1:]))


def name_above(axes):
    """The names of all curves, which rise, left above their last points, higher where they would touch."""
    axes.get_figure().draw_without_rendering()  # Then everything has its place.
    left, placed = axes.get_window_extent().x0 + 3, []
    for line, name in sorted(zip(*axes.get_legend_handles_labels()), key=lambda pair: last(pair[0])[1]):
        label = axes.annotate(
            name,
            last(line),
            xytext=(0, 6),
            textcoords="offset points",
            ha="right",
            color=line.get_color(),
            bbox={"facecolor": PAPER[0], "edgecolor": "none", "pad": 1},
        )
        box = label.get_window_extent()
        aside, above = max(0, left - box.x0), 0
        while any(box.translated(aside, above).overlaps(other) for other in placed):
            above += 1
        label.xyann = (aside, 6 + above)
        placed.append(box.translated(aside, above))


def name_beside(axes, size):
    """Beside the axes the names of all curves, each level with its curve's last point or as near as it gets
    without touching another, and joined with it."""
    figure = axes.get_figure()
    figure.draw_without_rendering()  # Then the axes have their height.
    lines, names = axes.get_legend_handles_labels()
    ends = [last(line) for line in lines]
    wanted = [axes.transAxes.inverted().transform(axes.transData.transform(end))[1] for end in ends]
    heights = spread(wanted, LINE * size / axes.get_window_extent().height)
    for line, name, end, height in zip(lines, names, ends, heights):
        axes.annotate(
            name,
            end,
            xytext=(1.02, height),
            textcoords="axes fraction",
            va="center",
            color=line.get_color(),
            fontsize=size,
            arrowprops={"arrowstyle": "-", "color": line.get_color(), "linewidth": 0.5, "alpha": 0.6,
                        "relpos": (0, 0.5), "shrinkA": 2, "shrinkB": 4},
        )


def last(line):
    return line.get_xydata()[-1]


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


def svg(figure, title, colours):
    """The chart as text. `colours`: the pairs of its curves; `title` is for those who do not see it."""
    text = io.StringIO()
    figure.savefig(
        text,
        format="svg",
        metadata={"Title": title, "Date": None, "Creator": None, "Format": None, "Type": None},
    )
    # Viewers that know no such rule show what is for light.
    dark = "\n".join(
        f'[style*="{part}: {light}"]{{{part}:{night} !important}}'
        for light, night in (INK, SOFT, GRID, FRAME, PAPER, *colours)
        for part in ("fill", "stroke")
    )
    rule = f"@media (prefers-color-scheme: dark){{\n{dark}}}"
    return text.getvalue().replace("<svg ", '<svg role="img" ', 1).replace("</style>", f"{rule}</style>", 1)
