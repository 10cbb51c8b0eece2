"""What is drawn and fitted on two logarithmic scales: power laws through points, and a chart as an SVG of
its own, with colours for light and for dark."""

import math
import statistics

INK = (
    ".ink{fill:#1a1a1a}.soft{fill:#555}.grid{stroke:#e2e2e2}.frame{stroke:#999;fill:none}"
    ".ground{fill:#fff}.guide{stroke:#888;stroke-dasharray:2 5}"
)
INK_ON_DARK = (
    ".ink{fill:#eee}.soft{fill:#b0b0b0}.grid{stroke:#343434}.frame{stroke:#777}"
    ".ground{fill:#161616}.guide{stroke:#888}"
)


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


def ticks(low, high, mantissas=(1,)):
    """Mantissa times power of ten, within [low, high]."""
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [m * 10.0**e for e in exponents for m in mantissas if low <= m * 10.0**e <= high]


class Chart:
    """`size`: width and height; `margins`: left, right, top, bottom; ranges: least and most; `colours`:
        {kind of line: (on light, on dark)}."""

    def __init__(self, size, margins, x_range, y_range, colours):
        self.width, self.height = size
        left, right, top, bottom = margins
        self.left, self.right, self.top, self.bottom = left, self.width - right, top, self.height - bottom
        self.x_range, self.y_range, self.colours = x_range, y_range, colours
        self.shapes = []

    def x(self, value):
        low, high = self.x_range
        return self.left + (self.right - self.left) * math.log(value / low) / math.log(high / low)

    def y(self, value):
        low, high = self.y_range
        return self.bottom - (self.bottom - self.top) * math.log(value / low) / math.log(high / low)

    def draw(self, shape):
        self.shapes.append(shape)

    def x_tick(self, value, text):
        self.draw(
            f'<line class="grid" x1="{self.x(value):.1f}" x2="{self.x(value):.1f}" y1="{self.top}" '
            f'y2="{self.bottom}"/>'
            f'<text class="soft" x="{self.x(value):.1f}" y="{self.bottom + 18}" '
            f'text-anchor="middle">{text}</text>'
        )

    def y_tick(self, value, text):
        self.draw(
            f'<line class="grid" x1="{self.left}" x2="{self.right}" y1="{self.y(value):.1f}" '
            f'y2="{self.y(value):.1f}"/>'
            f'<text class="soft" x="{self.left - 8}" y="{self.y(value) + 4:.1f}" '
            f'text-anchor="end">{text}</text>'
        )

    def x_title(self, text):
        self.draw(
            f'<text class="soft" x="{(self.left + self.right) / 2}" y="{self.height - 15}" '
            f'text-anchor="middle">{text}</text>'
        )

    def curve(self, kind, points, width, radius, dashed):
        """Points, joined; `kind` is one of the colours."""
        number = list(self.colours).index(kind)
        path = " ".join(f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in points)
        dash = ' stroke-dasharray="6 4"' if dashed else ""
        self.draw(f'<polyline class="l{number}" stroke-width="{width}"{dash} points="{path}"/>')
        for a, b in points:
            self.draw(f'<circle class="t{number}" cx="{self.x(a):.1f}" cy="{self.y(b):.1f}" r="{radius}"/>')

    def label(self, kind, x, y, text, size=13):
        """Text in the colour of its line, at a place in the picture's own units."""
        self.draw(
            f'<text class="t{list(self.colours).index(kind)}" x="{x:.1f}" y="{y:.1f}" '
            f'font-size="{size}">{text}</text>'
        )

    def svg(self, title):
        style, dark = [INK], [INK_ON_DARK]
        for number, (light, night) in enumerate(self.colours.values()):
            style.append(f".l{number}{{stroke:{light};fill:none}}.t{number}{{fill:{light}}}")
            dark.append(f".l{number}{{stroke:{night}}}.t{number}{{fill:{night}}}")
        head = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
            f'font-family="system-ui, sans-serif" font-size="13" role="img">',
            f"<title>{title}</title>",
            f"<style>{''.join(style)}@media (prefers-color-scheme: dark){{{''.join(dark)}}}</style>",
            f'<rect class="ground" width="{self.width}" height="{self.height}"/>',
        ]
        return "\n".join([*head, *self.shapes, "</svg>"]) + "\n"
