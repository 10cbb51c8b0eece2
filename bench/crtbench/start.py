"""The cost of starting: processes that only look, libraries that a render maps, and kernels compiled, cached
and cold."""

import os
import re
import shutil
import subprocess
import time

from .nvrtc import find, parsed, variants
from .program import Spread, significant
from .results import Results


def mapped_libraries(program, arguments):
    """Names of all shared objects that one crt process had mapped at any time we looked, which is all the
    time."""
    seen = set()
    process = subprocess.Popen(
        [str(program.crt), *map(str, arguments)],
        cwd=program.repository,
        env=program.environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    maps = f"/proc/{process.pid}/maps"
    while process.poll() is None:
        try:
            with open(maps) as file:
                seen |= {
                    os.path.basename(m) for m in re.findall(r"(/\S+\.so[.\d]*)$", file.read(), re.MULTILINE)
                }
        except OSError:
            break  # It ended while we looked.
        time.sleep(0.001)
    process.wait()
    return sorted(seen)


STAGES = ["parse", "build", "compile", "open", "prepare", "sampling", "write", "other", "total"]


def first_image(program, results, arguments, runs):
    """Where the time of a small job on a GPU goes, kernels cached."""
    results.heading("A first image on a GPU")
    results.paragraph(
        "256 × 256 pixels with 1 sample, kernels cached; ms, medians, the process with the least and the "
        "most. The stages are those of the report (docs/architecture.md, Film); what the process takes "
        "beyond their total is its start and its end, in which the driver takes its context apart."
    )
    scenes = program.scenes(arguments.scenes or ["cornell_box", "cornell_dragon", "cornell_glass"])
    kept = program.interleaved(
        {
            scene: lambda scene=scene: program.render(
                scene, "cuda", ["--spp", 1, "--kernel", "lean-only"], settings=["film.resolution=[256,256]"]
            )
            for scene in scenes
        },
        runs,
    )
    found, rows = {}, []
    for scene, done in kept.items():
        whole = Spread(r.seconds for r in done)
        stages = {stage: Spread(r.value("seconds", stage) for r in done) for stage in STAGES}
        found[scene] = {"process": whole.json(), **{name: s.json() for name, s in stages.items()}}
        rows.append([scene, whole.text(scale=1e3)] + [f"{s.median * 1e3:.3g}" for s in stages.values()])
    results.table(["scene", "process"] + STAGES, rows)
    return found


def measure(program, arguments):
    runs = 3 if arguments.tiny else 20
    kernel_runs = 2 if arguments.tiny else 5
    results = Results(program, arguments, "start", "What it costs to begin")

    # Processes that only look.
    processes = program.interleaved(
        {
            "crt --version": lambda: program.start(["--version"]),
            "crt info configs/cornell_box.yaml": lambda: program.start(["info", "configs/cornell_box.yaml"]),
            "crt info configs/cornell_dragon.yaml": lambda: program.start(
                ["info", "configs/cornell_dragon.yaml"]
            ),
        },
        runs,
    )
    seconds = {name: Spread(r.seconds for r in done) for name, done in processes.items()}
    results.heading("Processes that only look")
    results.paragraph(
        f"Wall time of the process, median of {runs} interleaved runs, in brackets the least and the most."
    )
    results.table(["command", "ms"], [[f"`{name}`", s.text(scale=1e3)] for name, s in seconds.items()])

    # Libraries.
    small = ["--set", "film.resolution=[128,128]", "--spp", 64, "--quiet", "--report", "none"]
    usable, absent = program.backends(["embree", "opencl"])
    libraries, rows = {}, []
    for backend in usable:
        for kind in ("pfm", "exr"):
            found = mapped_libraries(
                program,
                [
                    "render",
                    "configs/cornell_box.yaml",
                    "--backend",
                    backend,
                    *small,
                    "-o",
                    program.scratch / f"maps.{kind}",
                ],
            )
            libraries[f"{backend}, {kind}"] = found
            rows.append(
                [
                    backend,
                    kind.upper(),
                    len(found),
                    "yes" if any("OpenImageIO" in f for f in found) else "no",
                    "yes" if any("embree" in f for f in found) else "no",
                    "yes" if any(re.match(r"libOpenCL|libpocl", f) for f in found) else "no",
                ]
            )
    results.heading("Libraries")
    results.paragraph(
        "Shared objects in `/proc/PID/maps` of a small render, looked at every millisecond until it ends. "
        "Image codecs are opened when an image "
        "needs them, and of the backends only the one that was asked for; OpenImageIO brings libOpenCL "
        "along."
    )
    results.table(["backend", "output", "shared objects", "OpenImageIO", "Embree", "OpenCL"], rows)

    # OpenCL kernels.
    results.heading("OpenCL kernels")
    results.paragraph(
        "A render of 64 × 64 pixels with 1 sample. Cold: neither crt's cache nor PoCL's has anything. "
        "Cached "
        "by crt: PoCL's cache is empty. Cached: "
        f"both are as the run before left them. Median of {kernel_runs} interleaved runs, in brackets the "
        f"least and the most."
    )
    opencl_rows, kernels = [], {}
    for scene in (
        program.scenes(arguments.scenes or ["cornell_box", "cornell_dragon", "cornell_glass"])
        if "opencl" in usable
        else []
    ):
        def compile_kernel(forget, scene=scene):
            for name in forget:
                shutil.rmtree(program.scratch / name, ignore_errors=True)
            return program.render(scene, "opencl", ["--spp", 1], settings=["film.resolution=[64,64]"])
        kept = program.interleaved(
            {
                "cold": lambda: compile_kernel(["cache", "pocl"]),
                "cached by crt": lambda: compile_kernel(["pocl"]),
                "cached": lambda: compile_kernel([]),
            },
            kernel_runs,
        )
        kernels[scene] = {}
        for name, done in kept.items():
            took = {
                key: Spread(r.value("seconds", key) for r in done)
                for key in ("kernel_compile", "cache", "total")
            }
            whole = Spread(r.seconds for r in done)
            kernels[scene][name] = {**{key: s.json() for key, s in took.items()}, "process": whole.json()}
            opencl_rows.append(
                [
                    scene,
                    name,
                    took["kernel_compile"].text(scale=1e3),
                    took["cache"].text(scale=1e3),
                    whole.text(scale=1e3),
                ]
            )
            print(opencl_rows[-1], flush=True)
    results.table(["scene", "", "ms to compile", "ms for the cache", "ms, whole process"], opencl_rows)

    # A first image on a GPU.
    gpu, gpu_absent = program.backends(["cuda"])
    first_images = first_image(program, results, arguments, runs) if gpu else {}

    # NVRTC.
    results.heading("CUDA kernels with NVRTC")
    nvrtc = {}
    compiler, found = variants(program, [])
    if found is None:
        results.paragraph(f"Not measured: {compiler}.")
    else:
        tool = find(program)
        scenes = [program.scene_file(scene) for scene in program.scenes(arguments.scenes)]
        kept = program.interleaved(
            {"nvrtc": lambda: program.start(scenes, program=tool, codes=(0, 1))},
            1 if arguments.tiny else kernel_runs,
        )["nvrtc"]
        samples = {}
        for run in kept:
            for v in parsed(run.output)[1]:
                samples.setdefault((v["kernel"], v["mask"], v["name"]), []).append(v)
        rows = []
        for (kernel, mask, title), all_runs in samples.items():
            ms = Spread(v["ms"] for v in all_runs)
            first = all_runs[0]
            nvrtc[f"{kernel} {mask}"] = {**first, "ms": ms.json()}
            rows.append(
                [
                    title,
                    f"`{kernel}`",
                    f"`{mask}`",
                    ms.text(),
                    first["registers"],
                    first["stack"],
                    first["spill"],
                    significant(first["cubin_kb"]),
                ]
            )
        results.paragraph(
            f"{compiler}: each variant compiled from the text to a CUBIN, nothing cached. Needs no GPU. "
            f"Median of {len(kept)} runs, in brackets the "
            "least and the most."
        )
        results.table(
            ["variant", "kernel", "mask", "ms", "registers", "stack, bytes", "spilled, bytes", "CUBIN, kB"],
            rows,
        )
    results.claim(
        "Start-up time",
        "Wall time of the whole process: median, least and most. Renders have 64 × 64 pixels (OpenCL) and "
        "256 × 256 pixels (CUDA) with one sample. *Cold*: no cache of kernels exists.",
        ["process", "ms"],
        [
            *([f"`{name}`", s.text(scale=1e3)] for name, s in seconds.items()),
            *([f"{scene} on OpenCL, {state}", ms] for scene, state, *_, ms in opencl_rows),
            *([f"{scene} on CUDA, kernels cached", significant(found["process"]["median"] * 1e3)]
              for scene, found in first_images.items()),
        ],
    )
    results.not_measured({**absent, **gpu_absent})
    results.command(
        "crt render configs/SCENE.yaml --backend opencl --set 'film.resolution=[64,64]' --spp 1 -o "
        "unseen.pfm   # CRT_CACHE_DIR, POCL_CACHE_DIR fresh"
    )
    results.command("nvrtc_variants configs/*.yaml")
    results.data = {
        "process_seconds": {name: s.json() for name, s in seconds.items()},
        "libraries": libraries,
        "opencl_kernels": kernels,
        "first_images": first_images,
        "nvrtc": {"compiler": compiler, "variants": nvrtc},
    }
    results.write()
