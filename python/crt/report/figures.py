"""The figures of one scene of a convergence run."""

import itertools
import math

from . import plots, text
from .plots import FRAME, INK, MUTED, PAPER

def values_of(points, key):
    """(point, estimate) of those of `points` whose estimate at `key` is known."""
    return [(point, point[key]) for point in points if point[key] and text.known(point[key]["value"])]


def end(bound, otherwise):
    return bound if text.known(bound) else otherwise


def percent_tick(value):
    return plots.without_zeros(text.percent(value, 4))


def signed_percent_tick(value):
    return ("+" if value > 0 else "") + percent_tick(value)


def number_tick(value):
    return plots.without_zeros(text.number(value, 4))


def seconds_tick(value):
    return "0" if value == 0 else plots.without_zeros(text.seconds(value, 4))


def samples_tick(value):
    return text.count(round(value))


class Drawing:
    """A plot of one scene: its axes, and what goes below them as a legend."""

    def __init__(self, scene, name, title, caption, description, height=3.3):
        self.drawn = plots.Figure(f"{scene['slug']}-{name}", title, caption, f"{title}, {scene['name']}. "
                                  f"{description}")
        self.subjects = scene["subjects"]
        self.figure, self.axes = plots.canvas(height)
        self.axes.spines[["top", "right"]].set_visible(False)

    def label(self, subject, more=""):
        return "\n".join(wrapped(subject["label"] + more, 52))

    def legend(self, handles):
        lines = sum(1 + handle.get_label().count("\n") for handle in handles)
        plots.legend_below(self.figure, handles, lines)

    def finish(self):
        for axis in (self.axes.xaxis, self.axes.yaxis):
            plots.spread_labels(self.figure, axis)
        return plots.finish(self.figure, self.drawn)


def wrapped(label, width):
    """Lines of at most this number of letters, broken at blanks."""
    lines = [""]
    for word in label.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + word
    return lines


def line_style(subject):
    return {"color": plots.series(subject["colour"]), "marker": plots.MARKERS[subject["marker"] % 4],
            "linestyle": plots.DASHES[subject["marker"] % 4], "markersize": 5.2, "markeredgewidth": 0.8,
            "markeredgecolor": PAPER}


# ---------------------------------------------------------------------------------------- error over an axis


def error_plot(drawing, axis_value, label_more=lambda subject: ""):
    """Curves with bands on logarithmic axes. Errors hidden by the reference's own noise have no place there.
    Returns whether there is a point."""
    axes, handles, seen = drawing.axes, [], []
    axes.set_xscale("log")
    axes.set_yscale("log")
    for subject in drawing.subjects:
        points = values_of(subject["points"], "relative_rmse")
        points = [(point, e) for point, e in points if e["value"] > 0]
        if not points:
            continue
        x = [axis_value(point) for point, _ in points]
        y = [e["value"] for _, e in points]
        handles += axes.plot(x, y, label=drawing.label(subject, label_more(subject)), **line_style(subject))
        low = [end(e["low"], e["value"]) for _, e in points]
        high = [end(e["high"], e["value"]) for _, e in points]
        low = [max(bound, value / 10) for bound, value in zip(low, y)]
        axes.fill_between(x, low, high, color=plots.series(subject["colour"]), alpha=0.17, linewidth=0)
        if subject["floor"]:
            axes.axhline(subject["floor"], color=plots.series(subject["colour"]), linestyle=(0, (7, 4)),
                         linewidth=1.2)
        seen += zip(x, low, high)
    if seen:
        frame_log(axes, seen)
        guide(axes)
    drawing.legend(handles)
    return bool(seen)


def frame_log(axes, seen):
    """Room around what is seen, (x, low, high) of every point; ticks."""
    xs, lows, highs = zip(*seen)
    left, right = widened(min(xs), max(xs), 1.15)
    bottom, top = widened(min(lows), max(highs), 1.2)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    plots.set_ticks(axes.yaxis, plots.log_ticks(bottom, top), percent_tick)


def widened(low, high, factor):
    return low / factor, high * factor


def guide(axes):
    """A dotted line of slope −½ through the upper right: what independent samples have."""
    (left, right), (_, top) = axes.get_xlim(), axes.get_ylim()
    x0 = left ** 0.55 * right ** 0.45
    axes.plot([x0, right * 100], [top, top * math.sqrt(x0 / (right * 100))], color=MUTED, linewidth=1.1,
              linestyle=(0, (1, 2)), scalex=False, scaley=False)
    x1 = x0 ** 0.75 * right ** 0.25
    axes.annotate("slope −½", (x1, top * math.sqrt(x0 / x1)), color=MUTED, fontsize=9.5, xytext=(4, 2),
                  textcoords="offset points")


def error_against_time(scene, targets):
    drawing = Drawing(scene, "work-precision", "Error against time",
                      "Lower and further left is better. Each marker is a power of two of samples; bands "
                      "hold 95 %. Ticks above the time axis are start-up times; a dashed level is a floor "
                      "that the error will not fall below, a thin one a target.",
                      "Relative root mean square error over the seconds a user waits, both logarithmic, "
                      "with 95 % bands.", 3.5)
    axes = drawing.axes
    if not error_plot(drawing, lambda point: point["seconds"]["value"]):
        return None
    starts = [(s, s["start"]) for s in drawing.subjects if text.known(s["start"]) and s["start"] > 0]
    left, right = axes.get_xlim()
    left = min([left] + [start / 1.1 for _, start in starts if start > left / 30])
    axes.set_xlim(left, right)
    for subject, start in starts:
        axes.plot([start, start], [0, 0.05], color=plots.series(subject["colour"]), linewidth=2.2,
                  transform=axes.get_xaxis_transform(), scalex=False, scaley=False)
    for target in targets:
        if axes.get_ylim()[0] < target < axes.get_ylim()[1]:
            axes.axhline(target, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
            axes.annotate(percent_tick(target), (0.99, target), xycoords=("axes fraction", "data"),
                          xytext=(0, 2), textcoords="offset points", ha="right", color=MUTED, fontsize=9.5)
    axes.set_xlabel("seconds, start-up included")
    axes.set_ylabel("relative RMSE")
    plots.set_ticks(axes.xaxis, plots.log_ticks(*axes.get_xlim()), seconds_tick)
    return drawing.finish()


def error_against_samples(scene):
    drawing = Drawing(scene, "samples", "Error against samples",
                      "The cost of a sample left out. In brackets the slope; independent samples have "
                      "−½.",
                      "Relative root mean square error over samples per pixel, both logarithmic, with "
                      "95 % bands.")

    def slope(subject):
        estimate = subject["fit"].get("slope_against_samples")
        return f" ({text.value_and_bounds(estimate, 'number', 2)[0]})" if estimate else ""

    if not error_plot(drawing, lambda point: point["samples_per_pixel"], slope):
        return None
    drawing.axes.set_xlabel("samples per pixel")
    drawing.axes.set_ylabel("relative RMSE")
    plots.set_ticks(drawing.axes.xaxis, plots.power_ticks(*drawing.axes.get_xlim()), samples_tick)
    return drawing.finish()


# ------------------------------------------------------------------------------------------------- intervals


def interval_plot(drawing, key):
    """Intervals over samples, series side by side. Returns the estimates."""
    axes, handles, found, samples = drawing.axes, [], [], set()
    axes.set_xscale("log")
    shown = [(s, values_of(s["points"], key)) for s in drawing.subjects]
    shown = [(subject, points) for subject, points in shown if points]
    for place, (subject, points) in enumerate(shown):
        shift = 2.0 ** (0.55 * ((place + 0.5) / len(shown) - 0.5))
        x = [point["samples_per_pixel"] * shift for point, _ in points]
        style = line_style(subject) | {"linestyle": "none"}
        handles += axes.plot(x, [e["value"] for _, e in points], label=drawing.label(subject), zorder=3,
                             **style)
        axes.vlines(x, [end(e["low"], e["value"]) for _, e in points],
                    [end(e["high"], e["value"]) for _, e in points], color=style["color"], linewidth=1.6)
        found += [e for _, e in points]
        samples |= {point["samples_per_pixel"] for point, _ in points}
    if found:
        axes.set_xlim(*widened(min(samples), max(samples), 1.5))
        axes.set_xlabel("samples per pixel")
        plots.set_ticks(axes.xaxis, plots.power_ticks(min(samples), max(samples)), samples_tick)
    drawing.legend(handles)
    return found


def calibration(scene):
    drawing = Drawing(scene, "calibration", "Can the image's own error estimate be trusted?",
                      "1 is right; below 1, images understate their error. Whiskers hold 95 %.",
                      "The error that images state, divided by their actual error, over samples per pixel, "
                      "with 95 % intervals. 1 is right.")
    found = [e for e in interval_plot(drawing, "predicted_over_actual_error") if e["value"] > 0]
    if not found:
        return None
    farthest = math.log(1.25)
    for e in found:
        ends = [abs(math.log(bound)) for bound in (e["low"], e["high"]) if text.known(bound) and bound > 0]
        farthest = max(farthest, abs(math.log(e["value"])), *(min(value, 1.5) for value in ends), 0)
    bottom, top = math.exp(-1.05 * farthest), math.exp(1.05 * farthest)
    drawing.axes.set_yscale("log")
    drawing.axes.set_ylim(bottom, top)
    drawing.axes.axhline(1, color=INK, linewidth=1)
    drawing.axes.set_ylabel("predicted / actual relative RMSE")
    plots.set_ticks(drawing.axes.yaxis, plots.log_ticks(bottom, top), number_tick)
    return drawing.finish()


def margins(axes_line, margin):
    axes_line(0, color=INK, linewidth=1)
    for edge in (margin, -margin):
        axes_line(edge, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)))


def bias(scene, margin):
    drawing = Drawing(scene, "bias", "Bias of the image mean over samples",
                      f"95 of 100 whiskers hold 0 when there is no bias. Dashed: the margin of "
                      f"±{percent_tick(margin)}. Those of few samples are cut off at the frame.",
                      "Image mean over that of the reference, minus 1, over samples per pixel, with 95 % "
                      "intervals. All intervals should hold 0.")
    if not interval_plot(drawing, "relative_mean_bias"):
        return None
    extent = 1.5 * margin
    for subject in drawing.subjects:
        for _, e in values_of(subject["points"], "relative_mean_bias")[-1:]:
            extent = max(extent, *(1.3 * abs(end(bound, 0)) for bound in (e["low"], e["high"])))
    drawing.axes.set_ylim(-extent, extent)
    margins(drawing.axes.axhline, margin)
    drawing.axes.set_ylabel("image mean / reference − 1")
    plots.set_ticks(drawing.axes.yaxis, plots.linear_ticks(-extent, extent), signed_percent_tick)
    return drawing.finish()


# ------------------------------------------------------------------------------------------------------ bars


def bar_canvas(scene, name, title, caption, description, rows):
    drawn = plots.Figure(f"{scene['slug']}-{name}", title, caption,
                         f"{title}, {scene['name']}. {description}")
    figure, axes = plots.canvas(0.5 * rows + 0.9)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.grid(False, axis="y")
    axes.set_ylim(rows - 0.5, -0.62)
    axes.set_yticks([])
    return drawn, figure, axes


def bar_label(axes, row, label, value):
    """Above the bar: the configuration left, its value right, so that neither needs room beside it."""
    above = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "fontsize": 9.8,
             "bbox": {"facecolor": PAPER, "edgecolor": "none", "pad": 0.5}}
    axes.annotate(shortened(label, 40), (0, row - 0.18), xytext=(0, 2), **above)
    axes.annotate(value, (1, row - 0.18), xytext=(0, 2), ha="right", color=MUTED, **above)


def shortened(label, letters):
    return label if len(label) <= letters else label[: letters - 1] + "…"


def finish_bars(drawn, figure, axes, label, tick):
    axes.set_xlim(left=0)
    plots.set_ticks(axes.xaxis, plots.linear_ticks(0, axes.get_xlim()[1]), tick)
    axes.set_xlabel(label)
    plots.spread_labels(figure, axes.xaxis)
    return plots.finish(figure, drawn)


def efficiency(scene):
    subjects = [s for s in scene["subjects"]
                if text.known((s["fit"].get("efficiency_per_second") or {}).get("value"))]
    if not subjects:
        return None
    subjects.sort(key=lambda s: -s["fit"]["efficiency_per_second"]["value"])
    drawn, figure, axes = bar_canvas(
        scene, "efficiency", "Efficiency",
        "Longer is better: twice the efficiency needs half the render time for the same error. e is the "
        "least error that all configurations of the scene have reached, N the samples that it took, c the "
        "seconds of one. Start-up is excluded; whiskers hold 95 %.",
        "One over squared error times render seconds, start-up excluded, at the least error that all "
        "reached, with 95 % intervals. More is better.", len(subjects))
    for row, subject in enumerate(subjects):
        e = subject["fit"]["efficiency_per_second"]
        axes.barh(row, e["value"], height=0.34, color=plots.series(subject["colour"]))
        if text.known(e["low"]) and text.known(e["high"]):
            axes.plot([e["low"], e["high"]], [row, row], color=INK, linewidth=1.2, marker="|", markersize=7)
        value, interval = text.value_and_bounds(e, "number")
        bound = "≥ " if subject["fit"]["common_error"]["at_first_point"] else ""
        bar_label(axes, row, subject["label"], f"{bound}{value} ({interval}) /s")
    return finish_bars(drawn, figure, axes, "efficiency 1/(e²·N·c), 1/s", number_tick)


START_STAGES = ("parse", "build", "compile", "upload", "first_sample", "write")


def stacked(scene, name, title, caption, description, parts, bars):
    """`parts`: names; `bars`: (label, seconds of each part)."""
    if not bars:
        return None
    drawn, figure, axes = bar_canvas(scene, name, title, caption, description, len(bars))
    handles = []
    for row, (label, lengths) in enumerate(bars):
        lefts = [0, *itertools.accumulate(lengths)]
        for place, (left, length) in enumerate(zip(lefts, lengths)):
            bar = axes.barh(row, length, left=left, height=0.34, color=plots.series(place + 2),
                            label=parts[place], edgecolor=FRAME, linewidth=0.3)
            if row == 0:
                handles.append(bar)
        bar_label(axes, row, label, text.seconds(lefts[-1]))
    plots.legend_below(figure, handles, math.ceil(len(parts) / 2), 2)
    return finish_bars(drawn, figure, axes, "seconds, wall clock", seconds_tick)


def start_seconds(stages):
    return [stages[name] if text.known(stages[name]) else 0 for name in START_STAGES]


def time_budget(scene):
    device = any(text.known(s["stages"]["render_device"]) for s in scene["subjects"])
    parts = ["all but rendering", "rendering, host and waiting" if device else "rendering"]
    bars = []
    for subject in scene["subjects"]:
        stages = subject["stages"]
        wall = stages["render_wall"] or 0
        on_device = min(stages["render_device"] or 0, wall)
        lengths = [sum(start_seconds(stages)), wall - on_device]
        bars.append((subject["label"], lengths + ([on_device] if device else [])))
    return stacked(scene, "time", "Time by stage",
                   "One replicate, from the scene file to its last sample.",
                   "Wall clock of one replicate to its last sample, stacked.",
                   parts + (["rendering, device"] if device else []), bars)


def start_budget(scene):
    return stacked(scene, "start-up", "Start-up and writing, enlarged",
                   "Costs that do not depend on the number of samples.",
                   "Wall clock before the first sample is there, and of writing the image, stacked.",
                   [name.replace("_", " ") for name in START_STAGES],
                   [(s["label"], start_seconds(s["stages"])) for s in scene["subjects"]])


# -------------------------------------------------------------------------------------------------- verdicts


def verdicts(scene, margin, confidence):
    """Evidence for the verdicts: the bias of each colour's mean, with the verdict's own interval."""
    subjects = [s for s in scene["subjects"] if s["fit"]["relative_mean_bias_rgb"]]
    if not subjects:
        return None
    drawn, figure, axes = bar_canvas(
        scene, "verdict", "Evidence for the verdicts",
        "Bias of the image mean in red, green and blue at the most samples, with intervals of "
        f"{text.percent(confidence)}: PASS needs all within the dashed margin of ±{percent_tick(margin)}; "
        "one wholly outside is a FAIL.",
        "Relative bias of the image mean in red, green and blue, with the interval that decides.",
        len(subjects))
    extent = 1.3 * margin
    for row, subject in enumerate(subjects):
        for channel, e in enumerate(subject["fit"]["relative_mean_bias_rgb"]):
            if not text.known(e["value"]):
                continue
            low, high = end(e["low"], e["value"]), end(e["high"], e["value"])
            y = row + 0.14 * channel - 0.08
            colour = plots.series(subject["colour"])
            axes.plot([low, high], [y, y], color=colour, linewidth=1.7)
            axes.plot([e["value"]], [y], color=colour, marker="osD"[channel], markersize=4.6,
                      markeredgecolor=PAPER, markeredgewidth=0.6)
            extent = max(extent, 1.05 * abs(low), 1.05 * abs(high))
        bar_label(axes, row - 0.1, subject["label"], subject["fit"]["verdict"])
    axes.set_xlim(-extent, extent)
    margins(axes.axvline, margin)
    plots.set_ticks(axes.xaxis, plots.linear_ticks(-extent, extent, 5), signed_percent_tick)
    axes.set_xlabel("image mean / reference − 1;  ● red  ■ green  ◆ blue")
    plots.spread_labels(figure, axes.xaxis)
    return plots.finish(figure, drawn)


def of_scene(scene, options):
    """The Figures of a scene (converge.scene_of) that have something to show, most telling first."""
    with plots.style():
        margin = options["equivalence_margin"]
        drawn = [error_against_time(scene, options["targets"]), error_against_samples(scene),
                 efficiency(scene), verdicts(scene, margin, options["verdict_confidence"]),
                 bias(scene, margin), calibration(scene), time_budget(scene), start_budget(scene)]
    return [figure for figure in drawn if figure]
