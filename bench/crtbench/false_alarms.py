"""Counts wrong statements of `crt converge` where the truth is known by construction. The rows are not
rendered: they are progressive means of normal samples, pixel by pixel, of known variance, bias and cost,
against a reference that is exact or has eight noisy folds; they go through the same analysis and the same
sentences as rows of renders. Nothing is timed: it may run on a busy machine."""

import json
import math

from .program import Failure
from .results import Results

REPEATS = 4000


def measure(program, arguments):
    binary = program.build / "bin" / "false_alarms"
    if not binary.exists():
        raise Failure("there is no false_alarms in the build: it needs -DCRT_TESTS=ON")
    repeats = REPEATS // 100 if arguments.tiny else REPEATS
    rows = [json.loads(line) for line in program.start([repeats], program=binary).output.splitlines()]
    results = Results(program, arguments, "false-alarms", "How often crt converge is wrong")
    results.paragraph(__doc__.replace("\n", " "))
    results.paragraph(
        f"{repeats} repeats of each situation, 64 pixels, 16 replicates of 1 to 256 samples (relative RMSE "
        f"0.9 % at the "
        "end) unless it says otherwise. *Stated*: the part that may be wrong. A part above what is stated "
        "by "
        "more than "
        "three standard errors of the counting is **bold**. Intervals of the *squared bias* are wide by "
        "intent: around 0 the jackknife is too careful, and Fisher's F covers what it misses. *FAIL of a "
        "correct backend*, *a bias floor without a bias* and *PASS of a biased backend* are claimed at "
        "99.9 %. Intervals that have no bounds, because an error hides in the reference's noise, are not "
        "asked."
    )
    for situation in dict.fromkeys(row["situation"] for row in rows):
        results.heading(situation[0].upper() + situation[1:])
        results.table(["statement", "asked", "wrong", "part", "stated"],
                      [cells(row) for row in rows if row["situation"] == situation])
    worse = [row for row in rows if excess(row)]
    results.heading("More often wrong than stated")
    if worse:
        results.table(
            ["situation", "statement", "part", "stated"],
            [[row["situation"], row["statement"], share(row), f"{row['stated']:.1%}"] for row in worse],
        )
    else:
        results.paragraph("None.")
    results.claim(
        "How often `crt converge` is wrong where the truth is known",
        f"Each situation is simulated {repeats} times: progressive means of samples, pixel by pixel, of "
        "known variance, bias and cost, go through the same analysis as renders. Samples are normal, or "
        "rare bright paths (*fireflies*). *Stated* is the share of statements that may be wrong. The last "
        "column lists the situations that exceed it by more than three standard errors, with the number of "
        f'statements. crt often makes none: "100.00% of 1" means that one of the {repeats:,} repeats made a '
        "statement, and it was wrong.",
        ["statement", "situations", "least wrong", "most wrong", "stated", "more often wrong than stated"],
        [
            by_statement([row for row in rows if row["statement"] == statement])
            for statement in dict.fromkeys(row["statement"] for row in rows)
        ],
    )
    results.data = {"repeats": repeats, "rows": rows}
    results.command(f"{program.build}/bin/false_alarms {repeats}")
    results.write()


def by_statement(rows):
    """One line for all situations in which a statement is made."""
    shares = [row["wrong"] / row["asked"] for row in rows]
    worse = ", ".join(f"{row['situation']} ({share(row)} of {row['asked']})" for row in rows if excess(row))
    return [rows[0]["statement"], len(rows), f"{min(shares):.2%}", f"{max(shares):.2%}",
            f"{rows[0]['stated']:.1%}", worse or "none"]


def excess(row):
    """True if it was wrong more often than chance would have it."""
    p = row["stated"]
    return row["wrong"] > row["asked"] * p + 3 * math.sqrt(row["asked"] * p * (1 - p))


def share(row):
    return f"{row['wrong'] / row['asked']:.2%}"


def cells(row):
    part = share(row)
    part = f"**{part}**" if excess(row) else part
    return [row["statement"], row["asked"], row["wrong"], part, f"{row['stated']:.1%}"]
