"""Does the error that an image states of itself hold? 100 renders of each scene that differ in nothing but
the seed, and the real error beside what each of them states: at powers of two, one more, and numbers that a
time limit or Ctrl-C might leave, and for a merge of two unequal ranges of samples. The real error is the
spread between the seeds. Then what replicates cost against one sequence, and what `--target-error 5%` stops
at. Times nothing: it may run on a busy machine. --rows takes what error_calibration printed on another
machine, with "mode", "scene", "side", "sampler" and "machine" added to each line.
"""

import json
import math
import pathlib

from .program import Failure
from .results import Results, processor

SCENES = {"box": "configs/cornell_box.yaml", "room": "bench/scenes/room.yaml", "prism": "configs/prism.yaml",
          "hidden lamp": "bench/scenes/hidden_lamp.yaml", "caustic": "bench/scenes/caustic.yaml"}
SAMPLERS = ("sobol", "independent")
SEEDS, PRICE_SEEDS, TARGET, MOST = 100, 32, 0.05, 32768
# What is asked: mode, side of the image in pixels, sampler.
ASKED = [
    ("stated", 128, "sobol"),
    ("stated", 64, "sobol"),
    ("stated", 64, "independent"),
    ("price", 64, "sobol"),
    ("stop", 64, "sobol"),
    ("stop", 64, "independent"),
]


def rows_of(program, backend, mode, scene, side, sampler, tiny):
    seeds = (4 if tiny else PRICE_SEEDS) if mode == "price" else 4 if tiny else SEEDS
    words = [mode, backend, program.repository / SCENES[scene], side, sampler, seeds]
    if mode == "stop":
        words += [TARGET, 512 if tiny else MOST]
    paths = {
        "CRT_BACKEND_PATH": f"{program.build / 'lib' / 'crt'}",
        "CRT_MESH_PATH": f"{program.build / 'share' / 'crt' / 'meshes'}",
    }
    output = program.start(
        words, program=program.build / "bin" / "error_calibration", environment=paths
    ).output
    return [{**json.loads(line), "mode": mode, "scene": scene, "side": side, "sampler": sampler,
             "machine": f"{backend} on {processor()}"} for line in output.splitlines()]


def share(part, of):
    return f"{part / of:.0%}" if of else "–"


def stated_table(results, rows):
    table = []
    for scene in SCENES:
        for r in (r for r in rows if r["scene"] == scene):
            table.append(
                [
                    scene,
                    r["samples"],
                    f"{r['true']:.2%}",
                    f"{r['ratio_of_all']:.3f}",
                    f"{r['known']} of {r['seeds']}",
                    f"{r['ratio']:.3f}" if r["known"] else "–",
                    share(r["covered"], r["known"]),
                    share(r["within_half_width"], r["known"]),
                    f"{r['degrees_of_freedom']:.0f}",
                ]
            )
    results.table(
        [
            "scene",
            "samples",
            "real error",
            "stated : real, all",
            "known",
            "stated : real",
            "covered",
            "within the half-width",
            "degrees of freedom",
        ],
        table,
    )


def summary(results, rows):
    asked = [r for r in rows if r["known"] >= r["seeds"] / 2]
    outside = [r for r in asked if not 0.9 <= r["ratio"] <= 1.1]
    covered = sum(r["covered"] for r in asked) / sum(r["known"] for r in asked)
    low = [r for r in asked if r["covered"] / r["known"] < 0.89]
    text = (
        f"Of {len(asked)} rows in which half of the images or more know their error, {len(outside)} have a "
        f"mean ratio outside 0.9 to "
        f"1.1; their intervals cover the real error {covered:.1%} of the time. With 100 seeds 95 % appears "
        f"as 89 % or less in one row "
        f"of a hundred; here in {len(low)}"
    )
    results.paragraph(
        text
        + (
            ": "
            + "; ".join(
                f"{r['scene']}, {r['side']}², {r['sampler']}, {r['samples']} "
                f"({share(r['covered'], r['known'])})"
                for r in low
            )
            if low
            else ""
        )
        + "."
    )


def price_table(results, rows):
    table = []
    for scene in SCENES:
        of = [r for r in rows if r["scene"] == scene]
        cells = []
        for r in of:
            ratio = r["replicates"] / r["one_sequence"]
            cells.append(
                f"{ratio:.2f} ± {ratio * math.hypot(r['replicates_error'], r['one_sequence_error']):.2f}"
            )
        table.append([scene, *cells])
    results.table(["scene", *(str(r["samples"]) for r in of)], table)


def stop_table(results, rows):
    table = []
    for sampler in SAMPLERS:
        for scene in SCENES:
            of = [r for r in rows if r["scene"] == scene and r["sampler"] == sampler]
            stopped = [r for r in of if r["reached"]]
            right = sum(r["actual"] <= TARGET for r in stopped)
            table.append(
                [
                    scene,
                    sampler,
                    f"{len(stopped)} of {len(of)}",
                    f"{right} of {len(stopped)}" if stopped else "–",
                    f"{max(r['actual'] for r in stopped):.2%}" if stopped else "–",
                    (
                        f"{min(r['samples'] for r in stopped)} to {max(r['samples'] for r in stopped)}"
                        if stopped
                        else "–"
                    ),
                    len(of) - len(stopped) + right,
                ]
            )
    results.table(
        ["scene", "sampler", "stopped", "of them right", "the worst", "samples", "right, or not stopped"],
        table,
    )


def measure(program, arguments):
    scenes = arguments.scenes or list(SCENES)
    if unknown := set(scenes) - set(SCENES):
        raise Failure(f"nothing is known of {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    if arguments.rows:
        rows = [json.loads(line) for line in pathlib.Path(arguments.rows).read_text().splitlines()]
    else:
        if not (program.build / "bin" / "error_calibration").exists():
            raise Failure("there is no error_calibration in the build: it needs -DCRT_TESTS=ON")
        usable, absent = program.backends(["cuda", "embree"])
        if not usable:
            raise Failure(f"neither cuda nor embree can run: {absent}")
        rows = []
        for mode, side, sampler in ASKED:
            for scene in scenes:
                rows += rows_of(
                    program, usable[0], mode, scene, 16 if arguments.tiny else side, sampler, arguments.tiny
                )

    def of(mode, side=None, sampler=None):
        return [
            r
            for r in rows
            if r["mode"] == mode
            and (side is None or r["side"] == side)
            and (sampler is None or r["sampler"] == sampler)
        ]

    results = Results(program, arguments, "calibration", "Does the stated error hold?")
    results.paragraph(__doc__.replace("\n", " "))
    results.paragraph("Rendered by " + "; ".join(sorted({r["machine"] for r in rows})) + ".")
    results.heading("The stated error")
    results.paragraph(
        "*Real error*: relative RMSE of luminance over the pixels. *Stated : real, all*: root mean square "
        "of "
        "what all images "
        "estimate, over the real error: 1 where the estimate is unbiased. *Known*: images that state an "
        "error; the others say "
        "“not yet known”. Of these the mean of stated over real error, "
        "how often the 95 % interval covers "
        "the real error, and "
        "how often the root mean square error that the image has is within its 95 % half-width. *Degrees of "
        "freedom*: mean."
    )
    summary(results, of("stated"))
    for side, sampler in sorted({(r["side"], r["sampler"]) for r in of("stated")}, reverse=True):
        results.heading(f"{side} × {side} pixels, {sampler}")
        stated_table(results, of("stated", side, sampler))
    results.heading("What two replicates cost")
    results.paragraph(
        "RMSE of images with two replicates over that of images with one sequence, by samples per pixel, 64 "
        "× 64 pixels, "
        f"{PRICE_SEEDS} seeds each, ± one standard error. Decision 0007 says why it is what it is at 64 "
        f"samples."
    )
    price_table(results, of("price"))
    results.heading(f"`--target-error {TARGET:.0%}`")
    results.paragraph(
        f"64 × 64 pixels, {SEEDS} seeds; after {MOST} samples per pixel a render gives up. *Right*: its "
        f"root "
        f"mean square error "
        f"against independent renders of {16 * MOST} samples is at most {TARGET:.0%}."
    )
    stop_table(results, of("stop"))
    results.command(
        f"{program.build}/bin/error_calibration stated BACKEND configs/cornell_box.yaml 64 sobol {SEEDS}"
    )
    results.command(
        f"{program.build}/bin/error_calibration price BACKEND configs/cornell_box.yaml 64 sobol "
        f"{PRICE_SEEDS}"
    )
    results.command(
        f"{program.build}/bin/error_calibration stop BACKEND configs/cornell_box.yaml 64 sobol {SEEDS} "
        f"{TARGET} {MOST}"
    )
    results.data = {"rows": [{k: v for k, v in r.items() if k != "rows"} for r in rows]}
    results.write()
