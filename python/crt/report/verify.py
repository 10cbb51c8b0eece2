"""The page of `crt verify`: verify.json, laid out, with what failed first."""

import math

from . import pages, plots, text

# As in verify/case.cpp; worst first.
VERDICTS = ("FAIL", "INCONCLUSIVE", "not applicable", "pass")
FAILED = VERDICTS[:2]
LEFT_OF_ALL = 1e-17  # Where a figure stands that is what was expected, bit for bit.


def page(run):
    """(html, figures) of a run."""
    suite = run.data
    cases = [case_of(case) for case in suite["cases"]]
    failed = [case for case in cases if case["failed"]]
    groups = {}
    for case in cases:
        if not case["failed"]:
            groups.setdefault((case["id"][0], case["group"]), []).append(case)
    figures = [figure for figure in [deviations(cases, suite["backend"]["name"])] if figure]
    html = pages.render("verify.html", suite=suite, title=title_of(suite), summary=summary_of(suite, cases),
                        failed=failed, groups=groups, figures=figures,
                        confidence=text.percent(suite["confidence"]))
    return html, figures


def title_of(suite):
    stopped = suite["interrupted"] and len(suite["cases"]) < suite["asked"]
    state = "passed" if suite["passed"] else "interrupted" if stopped else "FAILED"
    return f"crt verify: {state} on {suite['backend']['name']}, level {suite['level']}"


def summary_of(suite, cases):
    """"1 FAIL, 51 pass in 43 s"."""
    verdicts = [case["verdict"] for case in cases]
    parts = [f"{verdicts.count(v)} {v}" for v in VERDICTS if v in verdicts]
    if len(cases) < suite["asked"]:
        parts.append(f"{suite['asked'] - len(cases)} not run")
    return f"{', '.join(parts)} in {text.seconds(suite['seconds'], 2)}"


def style_of(verdict):
    if verdict in FAILED:
        return "fail"
    return "other" if verdict == "not applicable" else "pass"


def case_of(case):
    if case["verdict"] not in VERDICTS:
        raise ValueError(f"{case['id']} has the verdict '{case['verdict']}'")
    outcomes = [outcome_of(outcome) for outcome in case["outcomes"]]
    outcomes.sort(key=lambda outcome: VERDICTS.index(outcome["verdict"]) >= len(FAILED))
    return case | {"outcomes": outcomes, "failed": case["verdict"] in FAILED,
                   "style": style_of(case["verdict"]), "time": text.seconds(case["seconds"], 2)}


def outcome_of(outcome):
    expected, measured = outcome["expected"], outcome["measured"]
    deviation = None
    if text.known(expected) and text.known(measured):
        deviation = abs(measured - expected) / (abs(expected) or 1)
    return outcome | {"expected_text": f"{expected:.9g}".replace("-", "−") if text.known(expected) else "",
                      "measured_cell": text.measured(measured, outcome.get("interval")),
                      "deviation": deviation, "style": style_of(outcome["verdict"]),
                      "note": outcome.get("note", ""), "physics": outcome.get("physics", "")}


def power(tick):
    """"10⁻³" of 0.001."""
    exponent = round(math.log10(tick))
    return "10" + str(exponent).translate(text.SUPERSCRIPTS) if exponent else "1"


def deviations(cases, backend):
    """Deviations of all figures from their expected values, one row per group; None if no case has any."""
    found = {}
    for case in cases:
        known = [(o["deviation"], o["verdict"]) for o in case["outcomes"] if o["deviation"] is not None]
        if known:
            found.setdefault((case["id"][0], case["group"]), []).extend(known)
    groups = list(found)
    if not groups:
        return None
    drawn = plots.Figure(
        "deviations", "Deviations from the expected results",
        "Each mark is one figure's relative deviation from its expected value, regardless of its tolerance; "
        "figures estimated from samples have wide tolerances. Crosses fail, triangles are inconclusive.",
        f"Relative deviations of the figures of {backend} from their expected values, logarithmic, by "
        f"group.")
    with plots.style():
        figure, axes = plots.canvas(0.8 + 0.37 * len(groups))
        axes.set_xscale("log")
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.grid(False, axis="y")
        for row, group in enumerate(groups):
            axes.annotate("  ".join(group), (0, row - 0.25), xycoords=("axes fraction", "data"),
                          fontsize=9.5, color=plots.MUTED)
            for verdict, marker, colour in (("pass", "o", plots.GOOD), ("FAIL", "X", plots.BAD),
                                            ("INCONCLUSIVE", "^", plots.WARN)):
                x = [max(deviation, LEFT_OF_ALL) for deviation, given in found[group] if given == verdict]
                axes.plot(x, [row] * len(x), marker, color=colour, markersize=5 if verdict == "pass" else 8,
                          alpha=0.55 if verdict == "pass" else 1, markeredgewidth=0)
        largest = max(deviation for group in groups for deviation, _ in found[group])
        axes.set_xlim(LEFT_OF_ALL / 2, max(largest * 3, 1))
        axes.set_ylim(len(groups) - 0.7, -0.75)
        axes.set_yticks([])
        exponents = range(-15, math.floor(math.log10(axes.get_xlim()[1])) + 1, 3)
        plots.set_ticks(axes.xaxis, [LEFT_OF_ALL, *(10.0**e for e in exponents)],
                        lambda tick: "exact" if tick == LEFT_OF_ALL else power(tick))
        axes.set_xlabel("relative deviation from the expected value")
        plots.spread_labels(figure, axes.xaxis)
        return plots.finish(figure, drawn)
