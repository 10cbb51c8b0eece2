"""The measurements of bench/paper: rows, a JSON object each, from which crtbench/paper_page.py makes a page.
A row's `part` says what it is of; `absent` is what could not be measured, with the reason."""

import datetime
import json
import os
import subprocess

from . import accelerators, figure2
from .program import Failure, significant
from .results import operating_system, processor_name

PARTS = {
    "table1": "sums",
    "table2": "boxes of meshes",
    "table3": "loop, boxes, BVH",
    "figure2": "time against samples",
    "figure3": "the pictures",
    "remarks": "a table that all threads read",
}
# The parts of paper_host and paper_gpu that belong to a part of the paper.
WORK = {
    "table1": {"paper_host": ["sum"], "paper_gpu": ["copy", "sum"]},
    "table2": {"paper_host": ["boxes"], "paper_gpu": ["boxes"]},
    "remarks": {"paper_host": ["table"], "paper_gpu": ["table"]},
}
# As the paper renders: five scattering events, no roulette.
SETTINGS = ["integrator.max_depth=5", "integrator.roulette=false"]
TABLE3_SCENES = ["cornell_box", "cornell_sphere", "cornell_figure", "cornell_dragon"]
# Scene, samples, and what makes a picture of it that is seen as an eye used to the lamp would.
FIGURE3 = {
    "cornell_box": (16384, ["film.white_balance=lamp", "film.exposure_ev=1"]),
    "cornell_dragon": (1024, []),
}


class Rows:
    """Collected, and written one by one if there is a file: what was measured before a fault is kept."""

    def __init__(self, file):
        self.all, self.file = [], file
        if file:
            file.write_text("")

    def add(self, part, **values):
        row = {"part": part, **values}
        self.all.append(row)
        if self.file:
            with self.file.open("a") as out:
                out.write(json.dumps(row, ensure_ascii=False) + "\n")
        shown = {k: v for k, v in row.items() if k != "seconds"}
        print(json.dumps(shown, ensure_ascii=False), flush=True)


def read_rows(file):
    rows = []
    for number, line in enumerate(file.read_text().splitlines(), 1):
        try:
            row = json.loads(line)
        except json.JSONDecodeError as error:
            raise Failure(f"{file}, line {number}, is no JSON: {error}") from error
        if not isinstance(row, dict) or "part" not in row:
            raise Failure(f"{file}, line {number}, is no row of bench/paper: it has no part")
        rows.append(row)
    return rows


def measure(program, arguments, folder):
    rows = Rows(arguments.write_rows)
    # A disturbed run is not made again: the page says that it was one.
    program.busy_share = float("inf")
    describe(program, arguments, rows)
    for part in arguments.parts:
        for name, words in WORK.get(part, {}).items():
            work(program, arguments, rows, part, name, words)
    usable, absent = program.backends(arguments.backends)
    for name, reason in absent.items():
        for part in ("table3", "figure2", "figure3"):
            if part in arguments.parts:
                rows.add("absent", of=part, what=name, reason=program.plain(reason))
    renders = {"table3": table3, "figure2": time_against_samples, "figure3": pictures}
    for part, function in renders.items():
        if part in arguments.parts and usable:
            function(program, arguments, rows, usable, folder)
    program.timed = 0   # So that the page does not speak of repeated runs.
    return rows.all


def describe(program, arguments, rows):
    """The machine and what is on it."""
    statuses = program.plugin_statuses()
    commit = subprocess.run(
        ["git", "-C", str(program.repository), "rev-parse", "HEAD"], capture_output=True, text=True
    ).stdout.strip()
    rows.add(
        "machine",
        cpu=processor_name(),
        threads=len(os.sched_getaffinity(0)),
        os=operating_system(),
        date=datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        commit=commit or None,
        quick=arguments.tiny,
        busy=None if arguments.busy == float("inf") else arguments.busy,
        parts=arguments.parts,
        devices={b: statuses.get(b, {}).get("devices", []) for b in arguments.backends},
    )


def work(program, arguments, rows, part, name, words):
    """Runs paper_host or paper_gpu."""
    file = program.build / "bin" / name
    if not file.exists():
        reason = "the build has no nvcc, or no static CUDA run time" if name == "paper_gpu" else "not built"
        rows.add("absent", of=part, what=name, reason=f"{name} is not there: {reason}")
        return
    options = ["--runs", arguments.runs, "--meshes", program.build / "share" / "crt" / "meshes"]
    run = program.start(
        [*words, *options, *(["--quick"] if arguments.tiny else [])], codes=(0, 1), program=file
    )
    printed = [json.loads(line) for line in run.output.splitlines()]
    for row in printed:
        rows.add(row.pop("part"), of=part, **row)
    rows.add("run", of=part, what=name, complete=run.code == 0, others=round(run.others, 4))
    if run.code and not any(row.get("right") is False for row in printed):
        rows.add("absent", of=part, what=name, reason=run.errors.strip().split("\n")[-1])


def on_gpu(program, backend):
    devices = program.plugin_statuses().get(backend, {}).get("devices", [])
    return bool(devices) and (backend == "cuda" or "NVIDIA" in devices[0])


def table3(program, arguments, rows, usable, _folder):
    for scene in TABLE3_SCENES:
        triangles = accelerators.triangles_of(program, scene, usable[0])
        for backend in usable:
            # A GPU needs more paths to be busy for a while.
            factor = 16 if on_gpu(program, backend) else 1
            kept = accelerators.runs_by_kind(
                program, scene, backend, triangles, arguments.runs, arguments.tiny, factor, SETTINGS
            )
            for kind, done in kept.items():
                size, spp = accelerators.size_and_samples(kind, triangles, arguments.tiny, factor)
                rows.add(
                    "render",
                    of="table3",
                    scene=scene,
                    triangles=triangles,
                    backend=backend,
                    accelerator=kind,
                    size=size,
                    spp=spp,
                    others=max(round(r.others, 4) for r in done),
                    seconds=[r.value("seconds", "render") for r in done],
                )


def time_against_samples(program, arguments, rows, usable, _folder):
    resolutions = (72, 144) if arguments.tiny else (1440, 2880)
    longest = 0.2 if arguments.tiny else arguments.longest

    def runs(spp, last):
        """Fewer where one takes seconds: there it is steady, and time is short."""
        if last < 0.5:
            return arguments.runs
        return min(arguments.runs, 3) if last < 2 else 1

    figure2.timings(
        program, usable, resolutions, longest, SETTINGS, runs, keep=lambda row: rows.add("figure2", **row)
    )


def pictures(program, arguments, rows, usable, folder):
    size = 48 if arguments.tiny else 1440
    for scene, (samples, look) in FIGURE3.items():
        spp = samples // 256 if arguments.tiny else samples
        file = folder / f"paper-{scene}.ppm"
        settings = [f"film.resolution=[{size},{size}]", "outputs.0.aovs=[]", *SETTINGS, *look]
        has_picture = False
        for backend in usable:

            def render(count, output, backend=backend, settings=settings, scene=scene):
                return program.render(scene, backend, ["--spp", count], [output], settings)

            few = max(1, spp // 256)
            unseen = program.scratch / "unseen.ppm"
            render(few, unseen)
            program.await_compilers()
            expected = render(few, unseen).value("seconds", "render") * spp / few
            if expected > arguments.longest_picture:
                rows.add(
                    "absent",
                    of="figure3",
                    what=f"{scene}, {backend}",
                    reason=f"by {few} samples it would take about {significant(expected, 2)} s",
                )
                continue
            run = render(spp, unseen if has_picture else file)
            has_picture = True
            rows.add(
                "picture",
                of="figure3",
                scene=scene,
                backend=backend,
                size=size,
                spp=spp,
                mpaths_per_second=run.value("speed", "mpaths_per_second"),
                process_seconds=round(run.seconds, 3),
                others=round(run.others, 4),
                file=file.name,
                seconds=[run.value("seconds", "render")],
            )
