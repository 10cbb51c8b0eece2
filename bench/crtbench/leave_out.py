"""Measures the gain of leaving features out: the kernel that has just what the scene needs against the one
that has everything, and against the same kernel with one feature more, for every feature. The one feature
more comes through
CRT_KERNEL_DIR: a copy of the kernel texts in which every kernel has it."""

import concurrent.futures
import os

from .nvrtc import variants
from .program import Failure, Program, Spread, feature_bits, significant
from .results import Results

SCENES = ["cornell_box", "cornell_dragon", "cornell_glass"]
BACKENDS = ["cuda", "opencl", "embree"]
NO_AOVS = "outputs.0.aovs=[]"   # AOVs are a feature among others.
ROWS_OF_WAVES = {"AOV", "LIGHT_TREE"}   # Features for which the host keeps more of a path between kernels.


def chosen_bits(program, names):
    """Those of the features that were asked for, or all."""
    bits = feature_bits(program.repository)
    if unknown := set(names or []) - {name for _, name, _ in bits}:
        raise Failure(f"there is no feature {sorted(unknown)[0]}; core/kernel/dialect/features.h lists them")
    return [b for b in bits if not names or b[1] in names]


def compile_ahead(program, backend, kernels, settings):
    """Puts the backend's kernels of (scene, environment) into the program's cache, by all processors: one by
    one, compiling would take much longer than what is timed."""

    def compile_one(kernel):
        scene, environment = kernel
        apart = Program(program.repository, program.build, program.busy_share)   # Reports are files.
        apart.environment["CRT_CACHE_DIR"] = program.environment["CRT_CACHE_DIR"]
        tiny = ["film.resolution=[8,8]", *settings[1:]]
        waiting = ["--spp", 1, "--kernel", "lean-only"]
        apart.render(scene, backend, waiting, settings=tiny, environment=environment)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as workers:
        list(workers.map(compile_one, kernels))


def gain(more, lean):
    """Cost of `more` over `lean`, run by run."""
    return Spread(m / l for m, l in zip(more, lean))


def options(parser):
    parser.add_argument("--scenes", nargs="*", help="only these scenes, by name without .yaml")
    parser.add_argument("--quick", action="store_true", help="three runs, and no registers from NVRTC")
    parser.add_argument(
        "--features", nargs="+", metavar="NAME",
        help="only these of core/kernel/dialect/features.h, such as THIN_FILM",
    )
    parser.add_argument(
        "--backends", nargs="+", choices=BACKENDS, default=BACKENDS, metavar="NAME", help="only these"
    )


def measure(program, arguments):
    size = 32 if arguments.tiny else 400
    runs = 2 if arguments.tiny else 3 if arguments.quick else 5
    scenes = program.scenes(arguments.scenes or SCENES)
    spp = {scene: 16 if scene == "cornell_box" else 8 for scene in scenes}
    usable, absent = program.backends(arguments.backends)
    if not usable:
        raise Failure("; ".join(f"{backend}: {why}" for backend, why in absent.items()))
    # By which features are timed one by one: a GPU where there is one, with an image that fills it.
    timed = next(b for b in ("cuda", "embree", "opencl") if b in usable)
    if timed == "cuda" and not arguments.tiny:
        size, spp = 1440, {scene: 64 for scene in scenes}
    settings = [f"film.resolution=[{size},{size}]", NO_AOVS]
    results = Results(program, arguments, "leave-out", "What leaving out saves")
    data = {"scenes": {}}
    bits = chosen_bits(program, arguments.features)
    masks = {scene: scene_mask(program, scene, [NO_AOVS]) for scene in scenes}
    file_masks = {scene: scene_mask(program, scene) for scene in scenes}   # With the AOVs of its file.
    all_masks = sorted({*masks.values(), *file_masks.values()})
    # A kernel that is compiled ahead has other flags than one that is compiled for this machine.
    alone = {"CRT_KERNEL_DIR": str(program.kernels_with(0, all_masks))}

    def render(scene, backend, kernel, outputs=(), environment=None):
        return program.render(
            scene,
            backend,
            ["--spp", spp[scene], "--kernel", kernel],
            outputs,
            settings,
            environment=environment,
        )

    def same_image(scene, environment):
        """True if the kernel with the feature more does the same work: it renders the same bits."""
        images = [program.scratch / f"{scene}-{which}.pfm" for which in ("without", "with")]
        if not images[0].exists():
            render(scene, timed, "lean-only", [images[0]], environment=alone)
        render(scene, timed, "lean-only", [images[1]], environment=environment)
        return program.compare(*images)["differing_pixels"] == 0

    # Lean against full.
    rows = []
    for scene in scenes:
        data["scenes"][scene] = {"backends": {}}
        for backend in usable:
            images = {
                kernel: program.scratch / f"{scene}-{backend}-{kernel}.pfm" for kernel in ("lean", "full")
            }
            # Not "lean", which begins with what is there while it compiles.
            asked = {"lean": "lean-only", "full": "full"}
            for kernel, image in images.items():
                render(scene, backend, asked[kernel], [image])
            different = program.compare(images["lean"], images["full"])["differing_pixels"]
            kept = program.interleaved(
                {k: lambda k=k: render(scene, backend, asked[k]) for k in images}, runs
            )
            seconds = {kernel: [r.value("seconds", "render") for r in done] for kernel, done in kept.items()}
            memory = {
                kernel: Spread(r.value("memory", "host_peak_bytes") for r in done)
                for kernel, done in kept.items()
            }
            ratio = gain(seconds["full"], seconds["lean"])
            data["scenes"][scene]["backends"][backend] = {
                "differing_pixels": different,
                "render_seconds": {k: Spread(s).json() for k, s in seconds.items()},
                "full_over_lean": ratio.json(),
                "host_peak_bytes": {k: m.json() for k, m in memory.items()},
                "lean_kernel": kept["lean"][0].value("backend", "kernel"),
                "lean_features": kept["lean"][0].value("backend", "kernel_features"),
            }
            rows.append(
                [
                    scene,
                    backend,
                    "yes" if different == 0 else f"**no**: {different} pixels",
                    Spread(seconds["lean"]).text(),
                    Spread(seconds["full"]).text(),
                    ratio.text(),
                    *(significant(memory[k].median / 1e6) for k in ("lean", "full")),
                ]
            )
            print(rows[-1], flush=True)
    results.heading("Lean and full kernel")
    results.paragraph(
        f"{size} × {size} pixels; {', '.join(f'{s} {spp[s]}' for s in scenes)} samples per pixel. Render "
        f"seconds without start, median of {runs} "
        "interleaved runs, in brackets the least and the most; the ratio is taken run by run. Memory is the "
        "process's peak."
    )
    results.table(
        ["scene", "backend", "same bits", "s, lean", "s, full", "full : lean", "MB, lean", "MB, full"], rows
    )

    results.claim(
        "A kernel for the scene is faster than the full kernel",
        f"{size} × {size} pixels, no AOVs; seconds of rendering, median of {runs} interleaved runs. The "
        f"images "
        "have the same bits.",
        ["scene", "backend", "s, kernel of the scene", "s, full kernel", "full : own"],
        [[scene, backend, *cells[1:4]] for scene, backend, *cells in rows],
    )

    # Registers.
    results.heading("CUDA kernels: registers and sizes")
    compiler, base = ("left out (--quick)", None) if arguments.quick else variants(program, scenes)
    if base is None:
        results.paragraph(f"Not measured: {compiler}.")
    else:
        # Of a scene that is rendered in waves, the kernel that traces.
        whole = [v for v in base if v["kernel"] in ("crt_render", "crt_trace")]
        by_scene = {s: next(v for v in whole if int(v["mask"], 16) == file_masks[s]) for s in scenes}
        full = next(v for v in base if v["name"] == "everything")
        data["nvrtc"] = {"compiler": compiler, "full": full, "scenes": by_scene}
        results.paragraph(
            f"{compiler}, `crt_render` or, of waves, `crt_trace`, with the AOVs of the scene's file."
        )
        results.table(
            ["kernel", "mask", "registers", "stack, bytes", "spilled, bytes", "CUBIN, kB", "ms to compile"],
            [
                [
                    title,
                    f"`{v['mask']}`",
                    v["registers"],
                    v["stack"],
                    v["spill"],
                    significant(v["cubin_kb"]),
                    significant(v["ms"]),
                ]
                for title, v in [*by_scene.items(), ("everything", full)]
            ],
        )

    # Bit by bit.
    results.heading("Each feature alone")
    results.paragraph(
        "The scene's own kernel with one feature more that the scene does not use: what every feature would "
        f"cost those who do not need it. `{timed}`: render "
        f"seconds with the feature : without, median of {runs} interleaved runs, run by run, in brackets "
        f"the "
        f"least and the most. CUDA with "
        "NVRTC: registers, kB of the CUBIN and ms of one compilation more than without."
    )
    rows, data["features"] = [], {}
    extra_variants = {}
    if timed in ("cuda", "embree"):
        compile_ahead(
            program,
            timed,
            [
                (scene, {"CRT_KERNEL_DIR": str(program.kernels_with(1 << bit, all_masks))})
                for bit, _, _ in bits
                for scene in scenes
                if not masks[scene] & 1 << bit
            ],
            settings,
        )
    for bit, name, what in bits:
        entry = {"text": what, "scenes": {}}
        environment = {"CRT_KERNEL_DIR": str(program.kernels_with(1 << bit, all_masks))}
        if base is not None:
            extra_variants[bit] = {
                v["mask"]: v for v in variants(program, scenes, environment, only=True)[1]
            }
        for scene in scenes:
            found = {}
            if masks[scene] & 1 << bit:
                entry["scenes"][scene] = None  # The scene needs it.
                continue
            if timed == "cuda" and name in ROWS_OF_WAVES and in_waves(program, scene):
                found = {"not_measured": "its waves have no rows for it"}
            elif not same_image(scene, environment):
                found = {"not_measured": "**another image**"}
            else:
                kept = program.interleaved(
                    {
                        "lean": lambda: render(scene, timed, "lean-only", environment=alone),
                        "more": lambda: render(scene, timed, "lean-only", environment=environment),
                    },
                    runs,
                )
                ratio = gain(*([r.value("seconds", "render") for r in kept[k]] for k in ("more", "lean")))
                found = {"more_over_lean": ratio.json()}
            if base is not None:
                lean, more = by_scene[scene], extra_variants[bit][by_scene[scene]["mask"]]
                found |= {
                    "registers_more": more["registers"] - lean["registers"],
                    "cubin_kb_more": more["cubin_kb"] - lean["cubin_kb"],
                    "compile_ms_more": more["ms"] - lean["ms"],
                    "spill_more": more["spill"] - lean["spill"],
                }
            entry["scenes"][scene] = found
        data["features"][name] = entry
        rows.append([f"`{name}`: {what}", *(feature_cell(entry["scenes"][scene]) for scene in scenes)])
        print(rows[-1], flush=True)
    results.table(["feature", *scenes], rows)
    results.claim(
        "What one unused feature costs a kernel" + (" on a processor" if timed != "cuda" else ""),
        f"The scene's own kernel with one feature that the scene does not use, over the kernel without it: "
        f"seconds of rendering on `{timed}`, {size} × {size} pixels, no AOVs, median of {runs} interleaved "
        f"runs.",
        ["feature", *scenes],
        [[f"`{name}`", *(feature_cell(entry["scenes"][scene]) for scene in scenes)]
         for name, entry in data["features"].items()],
        name="leave-out-features" if timed == "cuda" else f"leave-out-features-{timed}",
    )
    results.not_measured(absent)
    for scene in scenes:
        results.command(
            f"crt render configs/{scene}.yaml --backend BACKEND --kernel lean-only|full --spp {spp[scene]} "
            + " ".join(f"--set '{c}'" for c in settings)
            + " -o unseen.pfm"
        )
    results.data = data
    results.write()


def in_waves(program, scene):
    """True if CUDA renders the scene by separate kernels for tracing and for each kind of material."""
    return "paths sorted by material" in program.start(["info", program.scene_file(scene)]).output


def scene_mask(program, scene, settings=()):
    run = program.render(scene, "auto", ["--spp", 1], settings=["film.resolution=[8,8]", *settings])
    return int(run.value("features", "mask"), 16)


def feature_cell(found):
    if found is None:
        return "needs it"
    parts = [found["not_measured"]] if "not_measured" in found else []
    if "more_over_lean" in found:
        r = found["more_over_lean"]
        parts.append(f"{r['median']:.3f} ({r['min']:.3f} – {r['max']:.3f})")
    if "registers_more" in found:
        parts.append(f"{found['registers_more']:+d} registers, {found['cubin_kb_more']:+.1f} kB, "
                     f"{found['compile_ms_more']:+.0f} ms")
    return "; ".join(parts)
