"""A mesh that is stored once and placed many times: memory, time to the first picture, rays against those of
the same triangles written out, and whether backends agree."""

import random

from .program import Spread, significant
from .results import Results

MESH = "conifer.obj"  # 70,000 triangles, of crt-meshgen


def text(places, side, share, size):
    """Trees in random places of a square, turned and scaled; always the same ones."""
    number = random.Random(1)
    rows = "".join(
        f"      - [{{scale: {number.uniform(20, 36):.4f}}}, {{rotate: {{axis: [0, 1, 0], angle_deg: "
        f"{number.uniform(0, 360):.2f}}}}}, {{translate: [{number.uniform(-side, side):.3f}, 0, "
        f"{number.uniform(-side, side):.3f}]}}]\n"
        for _ in range(places)
    )
    return f"""crt: 1
title: {places} trees
camera: {{position: [0, {0.35 * side:.3f}, {-1.5 * side:.3f}], target: [0, 0, {-0.2 * side:.3f}], fov: 50}}
film: {{resolution: [{size}, {size}]}}
integrator: {{max_depth: 4, roulette: false}}
materials:
  needles: {{type: diffuse, reflectance: 0.3}}
  ground: {{type: diffuse, reflectance: 0.5}}
lights: [{{type: sun, direction: [0.4, -1, 0.3], illuminance_lx: 80000}}]
environment: {{radiance: 20}}
objects:
  - {{name: ground, rectangle: {{size: [{4 * side:.3f}, {4 * side:.3f}]}}, material: ground,
     transform: [{{rotate: {{axis: [1, 0, 0], angle_deg: -90}}}}]}}
  - name: tree
    obj: {MESH}
    material: needles
    normals: flat
    share: {share}
    transforms:
{rows}"""


def written(program, name, *arguments):
    path = program.scratch / name
    path.write_text(text(*arguments))
    return path


def megabytes(run, key):
    return run.value("memory", key) / 1e6


def measure(program, arguments):
    tiny = arguments.tiny
    runs = 1 if tiny else 3
    results = Results(program, arguments, "instances", "One mesh in many places")
    usable, absent = program.backends(["embree", "opencl", "cuda"])
    data = {}

    many = 100 if tiny else 10000
    results.heading("Ten thousand trees" if not tiny else "Some trees")
    results.paragraph(
        f"{many:,} places of a mesh of 70,000 triangles (`share: always`), 64 × 64 pixels, 1 sample, whole "
        f"process, kernels from the cache: median of {runs}, in brackets the least and the most."
    )
    scene = written(program, "many.yaml", many, 400, "always", 64)
    one = {
        share: written(program, f"one-{share}.yaml", 1, 400, share, 64) for share in ("always", "never")
    }
    rows = []
    for backend in usable:
        done = program.interleaved({"many": lambda b=backend: program.render(scene, b, ["--spp", 1])}, runs)
        single = {share: program.render(path, backend, ["--spp", 1]) for share, path in one.items()}
        scene_bytes = done["many"][0].value("memory", "scene_bytes")
        bytes_more = scene_bytes - single["always"].value("memory", "scene_bytes")
        seconds = Spread(r.seconds for r in done["many"])
        data[backend] = {
            "seconds": seconds.json(),
            "scene_bytes": scene_bytes,
            "one_copy_bytes": single["never"].value("memory", "scene_bytes"),
            "host_peak_bytes": done["many"][0].value("memory", "host_peak_bytes"),
        }
        rows.append(
            [
                backend,
                seconds.text(),
                f"{megabytes(done['many'][0], 'scene_bytes'):.1f}",
                f"{megabytes(single['never'], 'scene_bytes'):.1f}",
                f"{bytes_more / (many - 1):.0f}",
                f"{megabytes(done['many'][0], 'host_peak_bytes'):.0f}",
            ]
        )
        print(rows[-1], flush=True)
    results.table(
        ["backend", "s", "scene, MB", "one tree written out, MB", "bytes an instance", "host peak, MB"],
        rows,
    )

    results.claim(
        f"{many:,} instances of a mesh cost a few megabytes",
        f"A mesh of 70,000 triangles in {many:,} places, 64 × 64 pixels, 1 sample, whole process, kernels "
        f"from "
        f"the cache: median of {runs}, with the least and the most.",
        ["backend", "s", "scene, MB", "one tree written out, MB", "bytes an instance", "host peak, MB"],
        rows,
    )

    few, size, samples = (9, 64, 4) if tiny else (81, 256, 16)
    results.heading("Against the same triangles written out")
    results.paragraph(
        f"{few} places, {size} × {size} pixels, {samples} samples, seconds of rendering alone. The images "
        "differ by rounding of corners: RMSE of luminance over its mean."
    )
    scenes = {s: written(program, f"{s}.yaml", few, 40, s, size) for s in ("always", "never")}
    # Written out the scene is far larger than its file.
    environment = {**program.environment, "CRT_SCENE_MEMORY": "20GB"}
    rows, films = [], {}
    for backend in usable:
        kept = program.interleaved(
            {
                share: lambda b=backend, share=share: program.render(
                    scenes[share],
                    b,
                    ["--spp", samples],
                    outputs=[program.scratch / f"{b}-{share}.pfm"],
                    environment=environment,
                )
                for share in scenes
            },
            runs,
        )
        films[backend] = program.scratch / f"{backend}-always.pfm"
        seconds = {share: Spread(r.value("seconds", "render") for r in done) for share, done in kept.items()}
        differ = program.compare(films[backend], program.scratch / f"{backend}-never.pfm")
        rows.append(
            [
                backend,
                seconds["always"].text(),
                seconds["never"].text(),
                significant(seconds["always"].median / seconds["never"].median),
                f"{megabytes(kept['always'][0], 'scene_bytes'):.0f}",
                f"{megabytes(kept['never'][0], 'scene_bytes'):.0f}",
                f"{100 * differ['metrics']['rmse_over_mean']:.2f} %",
            ]
        )
        data[backend]["against"] = {share: s.json() for share, s in seconds.items()}
        print(rows[-1], flush=True)
    results.table(
        ["backend", "shared, s", "written out, s", "ratio", "scene, MB", "written out, MB", "RMSE"], rows
    )
    results.claim(
        "Instances against the same triangles written out",
        f"{few} places, {size} × {size} pixels, {samples} samples, seconds of rendering alone. The images "
        f"differ "
        "by the rounding of corners: RMSE of luminance over its mean.",
        ["backend", "instances, s", "written out, s", "ratio", "instances, MB", "written out, MB", "RMSE"],
        rows,
        name="instances-written-out",
    )
    first = next(iter(films))
    for backend in films:
        if backend != first:
            same = program.compare(films[first], films[backend])
            results.paragraph(
                f"{first} and {backend}, shared: {same['differing_pixels']} of {size * size} pixels differ."
            )
            data[backend]["different_pixels"] = same["differing_pixels"]
    results.not_measured(absent)
    results.data = data
    results.write()
