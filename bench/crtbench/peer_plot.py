"""Error against seconds: one line for each contestant, named at its end."""
import math

from . import log_log

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
SMALL = 8.5  # Text of names and notes.


def draw(curves, target, title, x_title):
    """curves: [(contestant, [(seconds, relative error)])], none empty, all positive; relative errors as
    fractions."""
    seconds, errors = zip(*(p for _, points in curves for p in points))
    with log_log.style():
        figure, axes = log_log.canvas()
        axes.set(
            title=title,
            xlabel=x_title,
            ylabel="relative RMSE of luminance",
            xlim=(min(seconds) * 0.8, max(seconds) * 1.1),
            ylim=(min(target, *errors) * 0.85, max(errors) * 1.15),
        )
        draw_guide(axes)
        draw_target(axes, target)
        for contestant, points in curves:
            colour = COLOURS[contestant.renderer, contestant.engine]
            thin = contestant.replicates > 1
            log_log.curve(axes, points, colour, contestant.name, thin, dashed=contestant.roulette)
        log_log.decimal_ticks(axes.xaxis, lambda value: f"{value:g}")
        log_log.decimal_ticks(axes.yaxis, lambda value: f"{100 * value:g} %")
        log_log.name_beside(axes, SMALL)
        return log_log.svg(figure, title, COLOURS.values())


def draw_guide(axes):
    """A line of slope −½ to hold the others against, in the corner that they leave free."""
    (x_low, x_high), (y_low, y_high) = axes.get_xlim(), axes.get_ylim()
    begin, end = (x_low * (x_high / x_low) ** share for share in (0.04, 0.3))
    upper = y_low * (y_high / y_low) ** 0.4
    lower = upper * math.sqrt(begin / end)
    axes.plot([begin, end], [upper, lower], color=log_log.FRAME[0], linestyle=log_log.DOTS)
    note(axes, "slope −½: independent samples", (begin, lower), va="top")


def draw_target(axes, target):
    axes.axhline(target, color=log_log.FRAME[0], linewidth=1.5)
    note(axes, f"target {100 * target:g} %", (axes.get_xlim()[0], target), va="bottom")


def note(axes, text, place, va):
    axes.annotate(
        text,
        place,
        xytext=(5, 3 if va == "bottom" else -3),
        textcoords="offset points",
        va=va,
        color=log_log.SOFT[0],
        fontsize=SMALL,
    )
