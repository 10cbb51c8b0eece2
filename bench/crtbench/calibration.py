"""Does the error that an image states of itself hold? Renders of fifteen scenes that differ in nothing but
the seed, and the real error beside what each of them states: at numbers of samples from 16 to 1,024 that are
powers of two, and such as a time limit or Ctrl-C might leave, and for a merge of two unequal ranges of
samples. The real error is the spread between the seeds. Then what `--target-error` would have
stopped at, and
what replicates cost against one sequence. Times nothing: it may run on a busy machine. --rows takes what
error_calibration printed on another machine, with "mode", "scene", "side", "sampler" and "machine" added to
each line.
"""

import json
import math
import pathlib

from .calibration_scenes import MADE
from .program import Failure
from .results import Results, processor

SCENES = {
    "box": "configs/cornell_box.yaml",
    "room": "bench/scenes/room.yaml",
    "prism": "configs/prism.yaml",
    "hidden lamp": "bench/scenes/hidden_lamp.yaml",
    "caustic": "bench/scenes/caustic.yaml",
    **{name: f"bench/scenes/calibration/{file}.yaml" for name, file in {
        "glossy under a point": "glossy", "measured lamps": "ies", "cutouts": "cutouts", "soap": "soap",
        "bright spot": "spot", "saturated spectra": "saturated", "frosted lamp": "frosted", "panes": "panes",
    }.items()},
    **dict.fromkeys(MADE),
}
# Rare paths carry much of their light.
HEAVY = ("caustic", "glossy under a point", "measured lamps", "soap")
PRICED = ("box", "room", "prism", "hidden lamp", "caustic")
SEEDS, PRICE_SEEDS = 40, 16
# The configuration: mode, side of the image in pixels, sampler.
ASKED = [("stated", 48, "sobol"), ("stated", 48, "independent"), ("price", 48, "sobol")]


def file_of(program, scene):
    """A scene's file; what is too long to keep is written now."""
    if SCENES[scene]:
        return program.repository / SCENES[scene]
    path = program.scratch / f"{scene.replace(' ', '_')}.yaml"
    path.write_text(MADE[scene]())
    return path


def rows_of(program, backend, mode, scene, side, sampler, tiny):
    seeds = 4 if tiny else PRICE_SEEDS if mode == "price" else SEEDS
    paths = {
        "CRT_BACKEND_PATH": f"{program.build / 'lib' / 'crt'}",
        "CRT_MESH_PATH": f"{program.build / 'share' / 'crt' / 'meshes'}",
    }
    output = program.start(
        [mode, backend, file_of(program, scene), side, sampler, seeds],
        program=program.build / "bin" / "error_calibration",
        environment=paths,
    ).output
    return [{**json.loads(line), "mode": mode, "scene": scene, "side": side, "sampler": sampler,
             "machine": f"{backend} on {processor()}"} for line in output.splitlines()]


def share(part, of):
    return f"{part / of:.0%}" if of else "–"


def stated_table(results, rows):
    table = []
    for scene in SCENES:
        for r in (r for r in rows if r["scene"] == scene and "samples" in r):
            table.append(
                [
                    scene,
                    r["samples"],
                    f"{r['true']:.2%}",
                    f"{r['ratio_of_all']:.2f}",
                    f"{r['known']} of {r['seeds']}",
                    f"{r['ratio']:.2f}" if r["known"] else "–",
                    share(r["covered"], r["known"]),
                    share(r["within_half_width"], r["known"]),
                    share(r["mean_covered"], r["known"]),
                    f"{r['degrees_of_freedom']:.0f}",
                    f"{r['pixel_z']:.2f}",
                    f"{r['pixels_within']:.0%}",
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
            "expected error covered",
            "own error within the half-width",
            "mean covered",
            "degrees of freedom",
            "pixels' z",
            "within 1.96",
        ],
        table,
    )


def summary_table(rows):
    """(head, rows): one line a scene, for all numbers of samples and both samplers."""
    table = []

    def line(name, of):
        looks = [r for r in of if "samples" in r]
        stops = [r for r in of if "target" in r]

        def total(key, of=looks):
            return sum(r[key] for r in of)

        known = total("known")
        table.append(
            [
                name,
                share(known, total("seeds")),
                share(total("covered"), known),
                share(total("within_half_width"), known),
                share(total("mean_covered"), known),
                f"{total('stopped', stops)} of {total('seeds', stops)}",
                f"{total('wrong', stops)} ({share(total('wrong', stops), total('stopped', stops))})",
            ]
        )

    for scene in SCENES:
        if of := [r for r in rows if r["scene"] == scene]:
            line(scene, of)
    line("*rare bright paths*", [r for r in rows if r["scene"] in HEAVY])
    line("*the others*", [r for r in rows if r["scene"] not in HEAVY])
    head = ["scene", "known", "expected error covered", "own error within the half-width", "mean covered",
            "stops", "wrong stops"]
    return head, table


def price_table(results, rows):
    table = []
    for scene in PRICED:
        of = [r for r in rows if r["scene"] == scene]
        if not of:
            continue
        cells = []
        for r in of:
            ratio = r["replicates"] / r["one_sequence"]
            cells.append(
                f"{ratio:.2f} ± {ratio * math.hypot(r['replicates_error'], r['one_sequence_error']):.2f}"
            )
        table.append([scene, *cells])
    results.table(["scene", *(str(r["samples"]) for r in of)], table)


def options(parser):
    parser.add_argument("--scenes", nargs="*", help=f"only these of {', '.join(SCENES)}")
    parser.add_argument("--rows", help="measurements made on another machine, JSON Lines")


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
                if mode == "price" and scene not in PRICED:
                    continue
                rows += rows_of(
                    program, usable[0], mode, scene, 16 if arguments.tiny else side, sampler, arguments.tiny
                )

    def of(mode, sampler=None):
        return [r for r in rows if r["mode"] == mode and (sampler is None or r["sampler"] == sampler)]

    results = Results(program, arguments, "calibration", "Does the stated error hold?")
    results.paragraph(__doc__.replace("\n", " "))
    results.paragraph("Rendered by " + "; ".join(sorted({r["machine"] for r in rows})) + ".")
    results.heading("All scenes")
    text = (
        "*Known*: images that state an error; the others say “not yet known”. Of these: how often "
        "the 95 % "
        "interval covers the *expected error*, which is the root mean square over the seeds; how often the "
        "error that this image has, its *own error*, is within its 95 % half-width; how often the 95 % "
        "interval of the mean luminance covers the mean. *Stops*: of images that look when the number of "
        "samples is a power of two from 64 on, for targets of 0.6 to 1.3 times the real error at 1,024 "
        "samples. *Wrong*: the own error is above the target."
    )
    results.paragraph(text)
    head, table = summary_table(of("stated"))
    results.table(head, table)
    results.machine = "; ".join(sorted({r["machine"] for r in rows}))
    results.claim(
        "The error that an image states holds",
        f"Renders of fifteen scenes that differ in the seed alone; the real error is the spread between "
        f"them. {text}",
        head,
        table,
    )
    for sampler in ("sobol", "independent"):
        if not of("stated", sampler):
            continue
        results.heading(f"Each number of samples, {sampler}")
        results.paragraph(
            "*Real error*: relative RMSE of luminance over the pixels. *Stated : real, all*: root mean "
            "square of what all images estimate, known or not, over the real error: 1 where the estimate is "
            "unbiased. *Pixels' z*: root mean square of the pixels' deviations over their `StdError.Y`, and "
            "how many are *within 1.96* of it (95 % of normal values)."
        )
        stated_table(results, of("stated", sampler))
    if of("price"):
        results.heading("What two replicates cost")
        results.paragraph(
            "RMSE of images with two replicates over that of images with one sequence, by samples "
            "per pixel, "
            f"{PRICE_SEEDS} seeds each, ± one standard error. Decision 0007 says why it is what it "
            f"is at 64 "
            "samples."
        )
        price_table(results, of("price"))
    for mode, seeds in (("stated", SEEDS), ("price", PRICE_SEEDS)):
        results.command(
            f"{program.build}/bin/error_calibration {mode} BACKEND configs/cornell_box.yaml 48 sobol {seeds}"
        )
    results.data = {"rows": rows}
    results.write()
