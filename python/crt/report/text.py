"""Numbers for people: few digits, units always, and the interval beside the value, as the program writes
them in its findings (core/judge/converge/quantity_text.h)."""

import math

DASH = "–"
NARROW_SPACE = "\u202f"
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
UNITS_OF_SECONDS = ((0.9995e-3, 1e-6, " µs"), (0.9995, 1e-3, " ms"), (299.5, 1, " s"), (5970, 60, " min"),
                    (math.inf, 3600, " h"))


def known(value):
    """True if `value` is a finite number; null in JSON is not."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def number(value, digits=3):
    """`digits` significant ones, without exponent from 10⁻⁴ to 10⁶; a dash for what is not known."""
    if not known(value):
        return DASH
    if value == 0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")
    magnitude = math.floor(math.log10(abs(rounded)) + 1e-9)
    if magnitude < -4 or magnitude >= 6:
        text = f"{rounded / 10.0**magnitude:.{digits - 1}f}·10{str(magnitude).translate(SUPERSCRIPTS)}"
    else:
        text = f"{rounded:.{max(0, digits - 1 - magnitude)}f}"
    return text.replace("-", "−")


def percent(value, digits=3):
    return number(100 * value, digits) + " %" if known(value) else DASH


def unit_of_seconds(value):
    """(size, name) of the unit that suits this number of seconds best."""
    return next((size, name) for below, size, name in UNITS_OF_SECONDS if abs(value) < below)


def seconds(value, digits=3):
    if not known(value):
        return DASH
    size, name = unit_of_seconds(value)
    return number(value / size, digits) + name


def count(value):
    """"65 536", with narrow no-break spaces from 10 000 on."""
    if not known(value):
        return DASH
    return f"{value:,}".replace(",", NARROW_SPACE) if value >= 10000 else str(value)


def bounds(estimate, size=1, digits=3, unit=""):
    """The interval alone: "2.35–2.47", or "−1 to 2" where it reaches below 0."""
    low, high = estimate["low"], estimate["high"]
    if not (known(low) and known(high)):
        return "no interval" if known(estimate["value"]) else ""
    between = " to " if low < 0 else DASH
    return number(low / size, digits) + between + number(high / size, digits) + unit


def value_and_bounds(estimate, kind, digits=3):
    """(value, interval) of an estimate as texts in one unit; `kind` is "seconds", "percent" or "number".
An unknown value is a dash without interval."""
    value = estimate["value"] if estimate else None
    if not known(value):
        return DASH, ""
    size, unit = {"seconds": unit_of_seconds(value), "percent": (0.01, " %"), "number": (1, "")}[kind]
    return number(value / size, digits) + unit, bounds(estimate, size, digits, unit)


def error(estimate, digits=3):
    """(value, interval) of a relative error: "below 0.31 %" where its interval reaches 0, because the
    reference's own noise hides it."""
    if estimate and known(estimate["value"]) and known(estimate["high"]) and not (estimate["low"] or 0) > 0:
        return "below " + percent(estimate["high"], digits), ""
    return value_and_bounds(estimate, "percent", digits)


def plural(number_of, what):
    return f"{number_of} {what}{'' if number_of == 1 else 's'}"


def to_decimals_of(value, width):
    """`value` with digits down to the second of `width`: those that an uncertainty so large leaves a
    meaning. Nine digits where it has no width."""
    if not known(value):
        return DASH
    if value == 0 or not (known(width) and width > 0):
        return f"{value:.9g}".replace("-", "−")
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(width)) + 2
    return f"{value:#.{min(max(digits, 1), 9)}g}".rstrip(".").replace("-", "−")


def measured(value, interval):
    """(value, interval) of a figure of `crt verify`: "0.239460", "[0.239410, 0.239510]"."""
    if interval is None or not all(map(known, interval)):
        return (f"{value:.9g}".replace("-", "−"), "") if known(value) else ("", "")
    width = (interval[1] - interval[0]) / 2
    low, high = (to_decimals_of(bound, width) for bound in interval)
    return to_decimals_of(value, width), f"[{low}, {high}]"
