"""Draws figures: matplotlib, its colours exchanged for the page's, so that they follow light, dark and
print; ticks that never collide; SVG with text as text."""

import dataclasses
import io
import math
import re

import matplotlib
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import FixedFormatter, FixedLocator, MaxNLocator, NullFormatter, NullLocator

# Colours that matplotlib draws with, the page's name for each, and what files of their own have. The series
# are Okabe and Ito's (2008), distinct for all common kinds of colour vision.
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#3b3b3b")
INK, MUTED, GRID, FRAME, PAPER = "#a00010", "#a00011", "#a00012", "#a00013", "#a00014"
GOOD, BAD, WARN = "#a00015", "#a00016", "#a00017"
COLOURS = {INK: ("ink", "#1b1b1f"), MUTED: ("muted", "#5c5f66"), GRID: ("grid", "#e3e5e8"),
           FRAME: ("frame", "#a9adb4"), PAPER: ("paper", "#ffffff"), GOOD: ("good", "#00704f"),
           BAD: ("bad", "#b3261e"), WARN: ("warn", "#8a5a00")}
COLOURS.update({f"#a0000{i}": (f"c{i}", colour) for i, colour in enumerate(SERIES)})
MARKERS = ("o", "s", "D", "^")
DASHES = ("-", (0, (4, 2)), (0, (1.2, 1.2)), (0, (6, 2, 1.5, 2)))

STYLE = {"svg.fonttype": "none", "svg.hashsalt": "crt", "font.family": "DejaVu Sans", "font.size": 10.5,
         "axes.titlesize": 10.5, "axes.labelsize": 10.5, "xtick.labelsize": 10, "ytick.labelsize": 10,
         "legend.fontsize": 10, "text.color": INK, "axes.labelcolor": INK, "xtick.color": FRAME,
         "ytick.color": FRAME, "xtick.labelcolor": MUTED, "ytick.labelcolor": MUTED, "axes.edgecolor": FRAME,
         "axes.facecolor": "none", "figure.facecolor": "none", "savefig.facecolor": "none",
         "grid.color": GRID, "axes.grid": True, "axes.axisbelow": True, "grid.linewidth": 0.8,
         "lines.linewidth": 1.6, "legend.frameon": False, "axes.unicode_minus": True, "path.simplify": False}
LEGEND_LINE = 0.215  # Inches.
WIDTH = 5.0  # Inches of 72 units; text of 10 units stays legible where a page is as narrow as a phone.


@dataclasses.dataclass
class Figure:
    """A drawn figure: `svg` for a page, `file` as a separate file."""

    name: str     # Letters, digits and '-'; of the page's figures each has another.
    title: str
    caption: str
    description: str  # A description, for readers who cannot see it.
    svg: str = ""
    file: str = ""


def series(place):
    """The colour to draw series number `place` with."""
    return f"#a0000{place % len(SERIES)}"


def canvas(height, width=WIDTH):
    """(figure, axes) of this size in inches. In style()."""
    figure = Canvas(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()


def legend_below(figure, handles, lines, columns=1):
    """A legend of this number of lines below the axes, for which the figure grows."""
    height, own = figure.get_figheight(), LEGEND_LINE * lines
    figure.set_figheight(height + own)
    figure.get_layout_engine().set(rect=(0, own / (height + own), 1, height / (height + own)))
    if handles:
        figure.legend(handles=handles, loc="lower left", ncols=columns, alignment="left", handlelength=2.6,
                      borderaxespad=0.1, labelspacing=0.35)


def style():
    return matplotlib.rc_context(STYLE)


def finish(figure, drawn):
    """Puts what matplotlib drew into a Figure, as SVG for the page and as a file. Returns it."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    whole = text.getvalue()
    svg = whole[whole.index("<svg"):]
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<g id=\"[^\"]*\">", "<g>", svg)
    # Names are unique in a page, where other figures are, too.
    svg = re.sub(r"\bid=\"", f"id=\"{drawn.name}-", svg)
    svg = re.sub(r"url\(#", f"url(#{drawn.name}-", svg)
    svg = re.sub(r"xlink:href=\"#", f"href=\"#{drawn.name}-", svg)
    svg = re.sub(r"\s*<style.*?</style>", "", svg, count=1, flags=re.DOTALL)
    viewbox = re.search(r"viewBox=\"[^\"]*\"", svg)[0]
    body = svg[svg.index(">") + 1:]
    drawn.svg = (f"<svg class=\"plot\" {viewbox} role=\"img\" aria-labelledby=\"{drawn.name}-title\">"
                 f"<title id=\"{drawn.name}-title\">{escaped(drawn.description)}</title>"
                 + recoloured(body, lambda name, _: f"var(--{name})"))
    drawn.file = recoloured(whole, lambda _, light: light)
    return drawn


def escaped(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def recoloured(svg, exchange):
    return re.sub(r"#a000[01][0-9]", lambda found: exchange(*COLOURS[found[0]]), svg)


# ---------------------------------------------------------------------------------------------------- ticks

MANTISSAS = ((1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8), (1, 1.5, 2, 3, 5, 7), (1, 2, 5), (1, 3), (1,))


def log_ticks(low, high, most=6):
    """Values between `low` and `high` (both above 0) to label on a logarithmic axis: three at least and
    `most` at most, as round as can be."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))

    def inside(mantissas, step=1):
        values = [m * 10.0**e for e in range(first, last + 1, step) for m in mantissas]
        return [value for value in values if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]

    step = 1
    while len(inside((1,), step)) > most:
        step += 1
    if step > 1:
        return inside((1,), step)
    for mantissas in MANTISSAS:
        found = inside(mantissas)
        if 3 <= len(found) <= most:
            return found
    # Hardly wider than a point: as on a linear axis, which it nearly is.
    return linear_ticks(low, high, most)


def linear_ticks(low, high, most=6):
    """`most` round values at most between `low` and `high`, evenly spaced from 0 on."""
    for intervals in range(most, 0, -1):
        ticks = [float(value) for value in MaxNLocator(intervals, steps=[1, 2, 5, 10]).tick_values(low, high)
                 if low <= value <= high]
        if len(ticks) <= most:
            break
    return ticks


def power_ticks(low, high, most=7):
    """Powers of two between `low` and `high`, every second or third where they are many."""
    first, last = math.ceil(math.log2(low) - 1e-9), math.floor(math.log2(high) + 1e-9)
    step = 1 + max(0, last - first) // most
    return [2.0**exponent for exponent in range(first, last + 1, step)]


def without_zeros(text):
    """"1.5 s" of "1.50 s": a tick is exact."""
    return re.sub(r"(\.\d*?)0+(?=\D|$)", lambda found: found[1].rstrip("."), text, count=1)


def set_ticks(axis, ticks, text):
    """Labels an axis at `ticks`; of labels that would touch, every second one stays."""
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FixedFormatter([text(tick) for tick in ticks]))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def spread_labels(figure, axis):
    """Thins the labels of an axis until none touches another. To be called when all else is drawn."""
    while len(axis.get_major_locator()()) > 2:
        figure.draw_without_rendering()
        if not touching(axis):
            return
        ticks = axis.get_major_locator()()
        texts = axis.get_major_formatter().seq
        axis.set_major_locator(FixedLocator(ticks[::2]))
        axis.set_major_formatter(FixedFormatter(texts[::2]))


def touching(axis):
    """True if two labels of a drawn axis overlap, or have no room of 3 units between them."""
    boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label.get_text()]
    return any(a.padded(3).overlaps(b) for a, b in zip(boxes, boxes[1:]))
