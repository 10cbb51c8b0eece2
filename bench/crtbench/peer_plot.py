"""Error against seconds as an SVG of its own: log-log, labels at the lines' ends, colours for light and for dark."""
import math

WIDTH, HEIGHT = 900, 560
LEFT, RIGHT, TOP, BOTTOM = 70, 250, 54, 60
# Okabe and Ito's palette, which the colour-blind can tell apart, darkened or lightened for 4.5:1 against its ground.
COLOURS = {"crt embree": ("#0067a5", "#56b4e9"), "crt opencl": ("#00785a", "#2fc39b"), "crt cuda": ("#5a5a00", "#f0e442"),
           "Mitsuba llvm_ad": ("#b34700", "#ff9455"), "Mitsuba scalar": ("#a04878", "#e39cc4"), "Mitsuba cuda_ad": ("#7a4fbf", "#b79cf0")}


def colour_of(name):
    return next((i for i, key in enumerate(COLOURS) if name.startswith(key)), 0)


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


def decades(low, high):
    return range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)


def number(value):
    return f"{value:g}"


def draw(lines, target, title, x_label):
    """lines: {name: [(seconds, relative error)]}; relative errors as fractions."""
    points = [p for line in lines.values() for p in line]
    x_low, x_high = min(p[0] for p in points) * 0.8, max(p[0] for p in points) * 1.1
    y_low, y_high = min([target, *(p[1] for p in points)]) * 0.85, max(p[1] for p in points) * 1.15

    def x(value):
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(value / x_low) / math.log(x_high / x_low)

    def y(value):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * math.log(value / y_low) / math.log(y_high / y_low)

    style = [".ink{fill:#1a1a1a}.soft{fill:#555}.grid{stroke:#e2e2e2}.frame{stroke:#999;fill:none}.ground{fill:#fff}.guide{stroke:#888;stroke-dasharray:2 5}"]
    dark = [".ink{fill:#eee}.soft{fill:#b0b0b0}.grid{stroke:#343434}.frame{stroke:#777}.ground{fill:#161616}.guide{stroke:#888}"]
    for i, (light, night) in enumerate(COLOURS.values()):
        style.append(f".l{i}{{stroke:{light};fill:none}}.t{i}{{fill:{light}}}")
        dark.append(f".l{i}{{stroke:{night}}}.t{i}{{fill:{night}}}")
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="system-ui, sans-serif" font-size="13" role="img">',
           f"<title>{title}</title>",
           f"<style>{''.join(style)}@media (prefers-color-scheme: dark){{{''.join(dark)}}}</style>",
           f'<rect class="ground" width="{WIDTH}" height="{HEIGHT}"/>',
           f'<text class="ink" x="{LEFT}" y="28" font-size="16" font-weight="600">{title}</text>']
    ticks = [m * 10.0**e for e in decades(x_low, x_high) for m in (1, 2, 5) if x_low <= m * 10.0**e <= x_high]
    for tick in ticks:
        out.append(f'<line class="grid" x1="{x(tick):.1f}" x2="{x(tick):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
                   f'<text class="soft" x="{x(tick):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{number(tick)}</text>')
    for tick in [m * 10.0**e for e in decades(y_low, y_high) for m in (1, 2, 5) if y_low <= m * 10.0**e <= y_high]:
        out.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(tick):.1f}" y2="{y(tick):.1f}"/>'
                   f'<text class="soft" x="{LEFT - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{number(100 * tick)} %</text>')
    out.append(f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}"/>')
    # A line of slope −½ to hold the others against, in the corner that they leave free.
    x0, x1 = x_low * (x_high / x_low) ** 0.04, x_low * (x_high / x_low) ** 0.3
    y0 = y_low * (y_high / y_low) ** 0.4
    out.append(f'<line class="guide" x1="{x(x0):.1f}" y1="{y(y0):.1f}" x2="{x(x1):.1f}" y2="{y(y0 * math.sqrt(x0 / x1)):.1f}"/>'
               f'<text class="soft" x="{x(x0):.1f}" y="{y(y0 * math.sqrt(x0 / x1)) + 16:.1f}" font-size="12">slope −½: independent samples</text>')
    out.append(f'<line class="frame" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(target):.1f}" y2="{y(target):.1f}" stroke-width="1.5"/>')
    names = list(lines)
    ends = spread([y(lines[n][-1][1]) for n in names], 17)
    for name, label_y in zip(names, ends):
        kind, dash = colour_of(name), ' stroke-dasharray="6 4"' if "roulette" in name else ""
        path = " ".join(f"{x(s):.1f},{y(e):.1f}" for s, e in lines[name])
        thin = "16 sequences" in name
        out.append(f'<polyline class="l{kind}" stroke-width="{1.3 if thin else 2.4}"{dash} points="{path}"/>')
        out += [f'<circle class="t{kind}" cx="{x(s):.1f}" cy="{y(e):.1f}" r="{2.2 if thin else 3.4}"/>' for s, e in lines[name]]
        s, e = lines[name][-1]
        out.append(f'<line class="l{kind}" stroke-width="0.6" opacity="0.6" x1="{x(s) + 5:.1f}" y1="{y(e):.1f}" x2="{WIDTH - RIGHT + 6}" y2="{label_y:.1f}"/>'
                   f'<text class="t{kind}" x="{WIDTH - RIGHT + 10}" y="{label_y + 4:.1f}" font-size="12">{name}</text>')
    out.append(f'<text class="soft" x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 16}" text-anchor="middle">{x_label}</text>')
    out.append(f'<text class="soft" transform="translate(18 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">relative RMSE of luminance</text>')
    return "\n".join([*out, "</svg>"]) + "\n"
