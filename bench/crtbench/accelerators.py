"""Ways to find what a ray hits: a loop over all triangles, a box around every object, a BVH. And from how
many triangles on the BVH is faster than the loop: kBruteForceTriangles in core/compile/accelerator.h."""

import math
import random

from .program import Spread, significant
from .results import Results

SCENES = ["cornell_box", "cornell_sphere", "cornell_figure", "cornell_dragon"]
KINDS = {"none": "loop", "aabb": "object boxes", "bvh": "BVH"}
# The triangles are what a path of a loop costs: this number of tests is enough for a timing.
TESTS = 1e9
COUNTS = [12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512]


def room(triangles):
    """A closed room of 10 triangles with a lamp of 2, open to the camera, and small quads in random places
    up to `triangles`. Always the same ones."""
    number = random.Random(1)
    corners = [
        (-1, -1, -1),
        (1, -1, -1),
        (1, 1, -1),
        (-1, 1, -1),
        (-1, -1, 1),
        (1, -1, 1),
        (1, 1, 1),
        (-1, 1, 1),
    ]
    faces = [(4, 5, 6, 7), (0, 1, 5, 4), (3, 7, 6, 2), (0, 4, 7, 3), (1, 2, 6, 5)]
    quads = []
    for _ in range((triangles - 12) // 2):
        centre = [number.uniform(-0.8, 0.8) for _ in range(3)]
        a, b = ([number.gauss(0, 0.12) for _ in range(3)] for _ in range(2))
        quads.append(
            [
                [c + s * x + t * y for c, x, y in zip(centre, a, b)]
                for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        )

    def points(values):
        return "[" + ", ".join("[" + ", ".join(f"{x:.6f}" for x in v) + "]" for v in values) + "]"

    text = f"""crt: 1
title: {triangles} triangles
camera: {{position: [0, 0, -3.6], target: [0, 0, 0], fov: 38}}
film: {{resolution: [256, 256]}}
integrator: {{max_depth: 5, roulette: false}}
materials:
  grey: {{type: diffuse, reflectance: 0.6}}
objects:
  - mesh: {{positions: {points(corners)}, faces: {[list(f) for f in faces]}}}
    material: grey
  - mesh: {{positions: [[-0.3, 0.99, -0.3], [0.3, 0.99, -0.3], [0.3, 0.99, 0.3], [-0.3, 0.99, 0.3]],
           faces: [[0, 1, 2, 3]]}}
    material: grey
    emission: {{radiance: 5}}
"""
    if quads:
        text += f"""  - mesh:
      positions: {points(p for q in quads for p in q)}
      faces: {[[4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3] for i in range(len(quads))]}
    material: grey
"""
    return text


def size_and_samples(kind, triangles, tiny, work=1):
    """Few enough paths that a loop ends within a minute, enough for a timing where it is fast; `work` times
    as many."""
    if tiny:
        return 16, 1
    most = 400 * 400 * 8 * work
    paths = min(most, TESTS * work / (8 * triangles)) if kind != "bvh" else most
    size = next((s for s in (400, 64) if paths >= s * s), 32)
    return size, max(1, int(paths / (size * size)))


def runs_by_kind(program, scene, backend, triangles, runs, tiny, work=1, settings=()):
    """{kind: [Run]}, interleaved."""
    cases = {}
    for kind in KINDS:
        size, spp = size_and_samples(kind, triangles, tiny, work)
        all_settings = [
            f"film.resolution=[{size},{size}]",
            "outputs.0.aovs=[]",
            f"integrator.accelerator={kind}",
            *settings,
        ]
        cases[kind] = lambda all_settings=all_settings, spp=spp: program.render(
            scene, backend, ["--spp", spp], settings=all_settings
        )
    return program.interleaved(cases, runs)


def triangles_of(program, scene, backend):
    run = program.render(scene, backend, ["--spp", 1], settings=["film.resolution=[8,8]"])
    return run.value("scene", "triangles")


def measure(program, arguments):
    runs = 2 if arguments.tiny else 5
    usable, absent = program.backends(["embree", "opencl", "cuda"])
    results = Results(program, arguments, "accelerators", "Loop, boxes, BVH")

    rows, data = [], {"scenes": {}, "crossover": {}}
    for scene in program.scenes(arguments.scenes or SCENES):
        triangles = triangles_of(program, scene, usable[0])
        entry = data["scenes"][scene] = {"triangles": triangles, "backends": {}}
        for backend in usable:
            kept = runs_by_kind(program, scene, backend, triangles, runs, arguments.tiny)
            speed = {
                kind: Spread(r.value("speed", "mpaths_per_second") for r in done)
                for kind, done in kept.items()
            }
            rays = {
                kind: Spread(r.value("speed", "mrays_per_second") for r in done)
                for kind, done in kept.items()
            }
            entry["backends"][backend] = {
                kind: {
                    "mpaths_per_second": speed[kind].json(),
                    "mrays_per_second": rays[kind].json(),
                    "size_and_samples": size_and_samples(kind, triangles, arguments.tiny),
                }
                for kind in KINDS
            }
            rows.append(
                [
                    scene,
                    triangles,
                    backend,
                    *(f"{speed[k].text()}; {significant(rays[k].median)}" for k in KINDS),
                    significant(speed["aabb"].median / speed["none"].median),
                    significant(speed["bvh"].median / speed["none"].median),
                ]
            )
            print(rows[-1], flush=True)
    results.heading("By scene")
    results.paragraph(
        f"Mpaths/s, median of {runs} interleaved runs, in brackets the slowest and the fastest; then "
        f"Mrays/s. 400 × 400 pixels and up to 8 samples, where the loop "
        "would take minutes fewer, of 64 × 64 or 32 × 32 pixels; depth and roulette as in the scene. Same "
        "image whatever is chosen."
    )
    results.table(
        [
            "scene",
            "triangles",
            "backend",
            *(f"`{k}`: {text}" for k, text in KINDS.items()),
            "boxes : loop",
            "BVH : loop",
        ],
        rows,
    )

    # Crossover.
    counts = COUNTS[:3] if arguments.tiny else COUNTS
    rows = []
    for count in counts:
        path = program.scratch / f"room-{count}.yaml"
        path.write_text(room(count))
        row = [count]
        for backend in usable:
            size, spp = (16, 1) if arguments.tiny else (256, 16)
            kept = program.interleaved(
                {
                    kind: lambda kind=kind: program.render(
                        path,
                        backend,
                        ["--spp", spp],
                        settings=[f"film.resolution=[{size},{size}]", f"integrator.accelerator={kind}"],
                    )
                    for kind in ("none", "bvh")
                },
                runs,
            )
            speed = {
                kind: Spread(r.value("speed", "mpaths_per_second") for r in done)
                for kind, done in kept.items()
            }
            ratio = Spread(
                b / n
                for b, n in zip(
                    *([r.value("speed", "mpaths_per_second") for r in kept[k]] for k in ("bvh", "none"))
                )
            )
            data["crossover"].setdefault(backend, {})[count] = {
                "none": speed["none"].json(),
                "bvh": speed["bvh"].json(),
                "bvh_over_loop": ratio.json(),
            }
            row += [speed["none"].text(), speed["bvh"].text(), significant(ratio.median)]
        rows.append(row)
        print(row, flush=True)
    results.heading("From how many triangles on the BVH wins")
    results.paragraph(
        f"A closed room of 10 triangles with a lamp of 2, and small quads in random places. Mpaths/s, "
        f"median "
        f"of {runs} interleaved runs, in brackets the slowest and the "
        "fastest; 256 × 256 pixels, 16 samples, 5 scattering events, no roulette."
    )
    results.table(
        ["triangles", *(f"{b}, {text}" for b in usable for text in ("loop", "BVH", "BVH : loop"))], rows
    )
    for backend in usable:
        found = crossover({c: v["bvh_over_loop"]["median"] for c, v in data["crossover"][backend].items()})
        data["crossover"][backend]["triangles"] = found
        results.lines.append(
            f"- {backend}: "
            + (
                f"the BVH is faster from about {found:.0f} triangles on."
                if found
                else "no crossing in this range."
            )
        )
    results.lines.append("")
    results.not_measured(absent)
    results.command(
        "crt render configs/SCENE.yaml --backend BACKEND --spp N --set 'film.resolution=[400,400]' --set "
        "'outputs.0.aovs=[]' "
        "--set integrator.accelerator=none|aabb|bvh -o unseen.pfm"
    )
    results.data = data
    results.write()


def crossover(ratios):
    """Where the ratio passes 1 for the last time, between two counts on logarithmic scales."""
    items = sorted(ratios.items())
    for (c0, r0), (c1, r1) in reversed(list(zip(items, items[1:]))):
        if r0 < 1 <= r1:
            share = math.log(1 / r0) / math.log(r1 / r0)
            return math.exp(math.log(c0) + share * (math.log(c1) - math.log(c0)))
    return None
