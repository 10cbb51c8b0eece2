"""The cost and the gain of robustness: the watertight triangle test against Möller and Trumbore's, offsets
by each triangle's error bound against one fixed epsilon. The alternatives are patches of the kernel's texts
in bench/alternatives, which OpenCL compiles at run time (CRT_KERNEL_DIR).
"""

import shutil

from . import stability
from .program import Failure, Spread
from .results import Results

ALTERNATIVES = {
    "moeller_trumbore": "Möller–Trumbore",
    "fixed_epsilon": "fixed epsilon, 1e-4 of the scene",
    "small_epsilon": "fixed epsilon, 1e-6 of the scene",
}
SCENES = {"cornell_figure": 16, "cornell_dragon": 8}


def measure(program, arguments):
    if "opencl" not in program.backends(["opencl"])[0]:
        raise Failure("the alternatives are compiled by the OpenCL backend, which has no device here")
    size, runs = (32, 2) if arguments.tiny else (250, 5)
    environments = {"crt": {}} | {
        name: {"CRT_KERNEL_DIR": str(folder)} for name, folder in kernels(program).items()
    }
    results = Results(program, arguments, "robustness", "What robustness costs, and what it buys")
    data = {"seconds": {}, "ratio": {}, "wrong": {}}

    results.heading("Time")
    results.paragraph(
        f"OpenCL, {size} × {size} pixels, {', '.join(f'{s} {n}' for s, n in SCENES.items())} samples per "
        f"pixel, the tree of both scenes the same. Render seconds, median of {runs} interleaved "
        "runs, in brackets the least and the most; ratios are taken run by run."
    )
    rows = []
    for scene, spp in SCENES.items():
        def render(environment, scene=scene, spp=spp):
            return program.render(
                scene,
                "opencl",
                ["--spp", spp],
                settings=[f"film.resolution=[{size},{size}]", "outputs.0.aovs=[]"],
                environment=environment,
            )

        kept = program.interleaved({name: lambda e=e: render(e) for name, e in environments.items()}, runs)
        seconds = {name: [r.value("seconds", "render") for r in done] for name, done in kept.items()}
        data["seconds"][scene] = {name: Spread(s).json() for name, s in seconds.items()}
        cells = [Spread(seconds["crt"]).text()]
        for name in ALTERNATIVES:
            ratio = Spread(c / a for c, a in zip(seconds["crt"], seconds[name]))
            data["ratio"].setdefault(scene, {})[name] = ratio.json()
            cells += [Spread(seconds[name]).text(), ratio.text()]
        rows.append([scene, *cells])
        print(rows[-1], flush=True)
    results.table(
        [
            "scene",
            "s, crt",
            *(text for title in ALTERNATIVES.values() for text in (f"s, {title}", "crt : it")),
        ],
        rows,
    )

    results.heading("What each gets wrong")
    results.paragraph(
        "Rays of three sweeps of `bench/run stability`: how many slip through a closed mesh, meet the "
        "triangle "
        "that they leave, or step over a layer."
    )
    for sweep, rays in (("misses", 2e4), ("offset-safety", 4e4), ("offset-tightness", 4e3)):
        points = {
            name: stability.run(program, "opencl", sweep, rays / (50 if arguments.tiny else 1), environment)
            for name, environment in environments.items()
        }
        data["wrong"][sweep] = points
        text, head, rows = stability.TABLES[sweep]({ALTERNATIVES.get(n, n): p for n, p in points.items()})
        results.paragraph(text)
        results.table(head, rows)
    results.claim(
        "What the watertight test and exact offsets cost and gain",
        f"OpenCL, {size} × {size} pixels, median of {runs} interleaved runs; the tree is the same. The "
        f"sweeps "
        "of [limits](limits.md) give the other columns: rays through vertices and edges of a closed sheet, "
        "rays "
        "that meet the triangle that they leave, and the smallest gap between two layers of a scene 100 "
        "times "
        "their size at which no ray skips the second.",
        ["triangle test and offset", *(f"time, `{scene}`" for scene in SCENES), "through vertices and edges",
         "own triangle met", "smallest gap : size"],
        [summary(name, data) for name in environments],
    )
    results.command(
        "CRT_KERNEL_DIR=SCRATCH/moeller_trumbore/core/kernel crt render configs/cornell_dragon.yaml "
        "--backend opencl --spp 8 -o unseen.pfm"
    )
    results.data = data
    results.write()


def summary(name, data):
    """One row of the claim: relative times, rates of wrong rays, the smallest gap that is right."""
    def rate(points):
        return f"{sum(p['failures'] for p in points) / sum(p['rays'] for p in points):.2g}"

    wrong = {sweep: points[name] for sweep, points in data["wrong"].items()}
    times = [
        f"{1 / data['ratio'][scene][name]['median']:.2f}" if name in ALTERNATIVES else "1"
        for scene in SCENES
    ]
    gaps = [p["gap"] for p in wrong["offset-tightness"] if p["extent"] == 100 and p["failures"] == 0]
    return [ALTERNATIVES.get(name, "crt"), *times,
            rate([p for p in wrong["misses"] if p["aim"] != "faces"]), rate(wrong["offset-safety"]),
            f"{min(gaps):g}" if gaps else "–"]


def kernels(program):
    """{name of an alternative: CRT_KERNEL_DIR}"""
    folder = program.repository / "bench" / "alternatives"
    patched = {
        name: program.patched_kernel(folder / f"{name}.patch")
        for name in ("moeller_trumbore", "fixed_epsilon")
    }
    small = program.scratch / "small_epsilon"  # The same patch with another number.
    shutil.copytree(patched["fixed_epsilon"], small)
    surface, before, after = small / "surface.h", "CRT_FIXED_EPSILON 1e-4f", "CRT_FIXED_EPSILON 1e-6f"
    text = surface.read_text()
    if text.count(before) != 1:
        raise Failure(f"fixed_epsilon.patch does not put '{before}' into surface.h any more")
    surface.write_text(text.replace(before, after))
    return {**patched, "small_epsilon": small}
