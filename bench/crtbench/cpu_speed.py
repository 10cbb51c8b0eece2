"""Paths and rays per second on the processor, all threads: the Cornell box at 1440 × 1440 with independent
samples and no roulette, and a mesh of 100,000 triangles at 400 × 400 with Sobol samples. With and without
what it costs to begin."""

from .program import Failure, Spread, significant
from .results import Results

BOX, MESH = "cornell_box", "cornell_dragon"
# Measured with pbrt-v4 on a 2-core EPYC virtual machine with AVX-512 (g++ 12 -O3 -march=native, 2 threads);
# not run here.
PBRT = {
    BOX: {
        "mpaths_per_second": 0.50,
        "mrays_per_second": 3.1,
        "setting": "SimplePath, independent sampler, 1440 × 1440",
    },
    MESH: {
        "mpaths_per_second": 0.34,
        "setting": "Path, ZSobol sampler, a mesh of 99,938 triangles, 400 × 400",
    },
}


def measure(program, arguments):
    scale = 10 if arguments.tiny else 1
    runs = 2 if arguments.tiny else 5
    settings = {
        BOX: (
            [
                f"film.resolution=[{1440 // scale},{1440 // scale}]",
                "integrator.max_depth=5",
                "integrator.roulette=false",
                "sampler.type=independent",
                "outputs.0.aovs=[]",
            ],
            8,
        ),
        MESH: (
            [
                f"film.resolution=[{400 // scale},{400 // scale}]",
                "integrator.max_depth=5",
                "sampler.type=sobol",
                "outputs.0.aovs=[]",
            ],
            64,
        ),
    }
    settings = {
        scene: s for scene, s in settings.items() if not arguments.scenes or scene in arguments.scenes
    }
    if not settings:
        raise Failure(f"the scenes of this measurement are {BOX} and {MESH}")
    usable, absent = program.backends(["embree", "opencl"])
    results = Results(program, arguments, "cpu-speed", "Speed on the processor")
    rows, data = [], {}
    for scene, (changes, spp) in settings.items():
        cases = {b: (lambda b=b: program.render(scene, b, ["--spp", spp], settings=changes)) for b in usable}
        kept = program.interleaved(cases, runs)
        data[scene] = {}
        for backend, done in kept.items():
            paths = Spread(r.value("speed", "mpaths_per_second") for r in done)
            rays = Spread(r.value("speed", "mrays_per_second") for r in done)
            whole = Spread(r.value("rays", "paths") * 1e-6 / r.seconds for r in done)
            wall = Spread(r.seconds for r in done)
            data[scene][backend] = {
                "spp": spp,
                "settings": changes,
                "mpaths_per_second": paths.json(),
                "mrays_per_second": rays.json(),
                "mpaths_per_second_whole_process": whole.json(),
                "process_seconds": wall.json(),
                "render_seconds": Spread(r.value("seconds", "render") for r in done).json(),
                "kernel": done[0].value("backend", "kernel"),
                "rays_per_path": (done[0].value("rays", "closest") + done[0].value("rays", "shadow"))
                / done[0].value("rays", "paths"),
            }
            rows.append(
                [
                    scene,
                    backend,
                    paths.text(),
                    rays.text(),
                    significant(data[scene][backend]["rays_per_path"]),
                    whole.text(),
                    wall.text(),
                ]
            )
            print(rows[-1], flush=True)
    results.paragraph(
        f"Median of {runs} interleaved runs, in brackets the slowest and the fastest of them. A path is one "
        f"sample of one pixel; rays are "
        "those of the path and those to the light. The whole process includes starting, reading and "
        "compiling the scene, taking the "
        "kernel from the cache and writing a PFM."
    )
    results.table(
        [
            "scene",
            "backend",
            "Mpaths/s",
            "Mrays/s",
            "rays per path",
            "Mpaths/s, whole process",
            "s, whole process",
        ],
        rows,
    )
    results.paragraph(
        "Path tracing with light sampling and MIS, at most 5 scattering events, box filter, no AOVs, all "
        "threads. "
        f"`{BOX}`: 1440 × 1440, 8 samples per pixel, independent sampler, "
        f"no roulette. `{MESH}`: 400 × 400, "
        f"64 samples per pixel, Sobol "
        "sampler, roulette as in the scene."
    )
    results.claim(
        "Paths per second on a processor",
        "Light sampling and MIS, at most 5 scattering events, box filter, no AOVs, all threads. "
        f"`{BOX}`: 1440 × 1440, 8 samples, independent sampler, no roulette. `{MESH}`: 400 × 400, 64 "
        f"Sobol "
        f"samples. Median of {runs} interleaved runs, with the slowest and the fastest. The last column "
        "includes the start, the scene, the kernel and a PFM.",
        ["scene", "backend", "million paths/s", "million rays/s", "rays per path",
         "million paths/s, whole process"],
        [row[:6] for row in rows],
    )
    results.heading("For orientation: pbrt-v4")
    results.paragraph(
        "Not run here: measured with pbrt-v4 on another virtual machine with 2 cores (EPYC with AVX-512, "
        "g++ "
        "12 -O3 -march=native, 2 threads). "
        "The same box and the same number of scattering events; other code for everything else, and another "
        "processor, so that the ratio "
        "says what class of speed this is and no more."
    )
    results.table(
        ["scene", "pbrt-v4", "Mpaths/s", "Mrays/s"],
        [
            [
                scene,
                PBRT[scene]["setting"],
                PBRT[scene]["mpaths_per_second"],
                PBRT[scene].get("mrays_per_second", "not known"),
            ]
            for scene in settings
        ],
    )
    results.not_measured(absent)
    for scene, (changes, spp) in settings.items():
        results.command(
            f"crt render configs/{scene}.yaml --backend BACKEND --spp {spp} "
            + " ".join(f"--set '{c}'" for c in changes)
            + " -o unseen.pfm"
        )
    results.data = {"scenes": data, "pbrt_v4_elsewhere": PBRT}
    results.write()
