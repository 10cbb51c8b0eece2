"""Many lamps under a ceiling: what the tree of lights costs and gains (docs/decisions/0026).

    bench/run lamps NAME=CRT... [--lamps 1000] [--place room] [--rounds 5] [--samples 64] [--backend embree]

Renders, with each of the programs given and in turn, a room (6 x 6 x 2.5) or a hall (24 x 24 x 2.5)
under a grid of lamps that have the power of one together, and the same triangles with one lamp alone.
Prints the error that the render states, the processor seconds of its sampling (one thread), and error
times the square root of seconds: of two programs' the quotient is the gain at equal time.
"""
import json
import math
import pathlib
import resource
import statistics
import subprocess
import tempfile


def quad(name, corners, material, emission=""):
    return (f"  - {{name: {name}, mesh: {{positions: {corners}, faces: [[0, 1, 2, 3]]}}, "
            f"material: {material}{emission}}}")


def scene(place, lamps, alone, samples):
    side, height = (24.0 if place == "hall" else 6.0), 2.5
    columns = math.ceil(math.sqrt(lamps))
    pitch = side / columns
    half = 0.2 * pitch
    power = 100.0
    walls = [("floor", [[0, 0, 0], [0, 0, side], [side, 0, side], [side, 0, 0]]),
             ("ceiling", [[0, height, 0], [side, height, 0], [side, height, side], [0, height, side]]),
             ("left", [[0, 0, 0], [0, height, 0], [0, height, side], [0, 0, side]]),
             ("right", [[side, 0, 0], [side, 0, side], [side, height, side], [side, height, 0]]),
             ("back", [[0, 0, side], [0, height, side], [side, height, side], [side, 0, side]]),
             ("front", [[0, 0, 0], [side, 0, 0], [side, height, 0], [0, height, 0]])]
    objects = [quad(name, corners, "wall") for name, corners in walls]
    # One lamp alone: in the middle, the size of the others, as bright as all of them.
    only = (columns // 2) * columns + columns // 2
    for i in range(lamps):
        x, z, y = (i % columns + 0.5) * pitch, (i // columns + 0.5) * pitch, height - 0.02
        corners = [[round(a, 6), y, round(b, 6)] for a, b in
                   ((x - half, z - half), (x + half, z - half), (x + half, z + half), (x - half, z + half))]
        share = 1.0 if alone else 1.0 / lamps
        shines = not alone or i == only
        radiance = power * share / (math.pi * 4 * half * half)
        objects.append(quad(f"lamp{i}", corners, "black",
                            f", emission: {{radiance: {radiance:.9g}}}" if shines else ""))
    # Floor and walls: no lamp of the room is in the picture.
    middle = side / 2
    return (f"crt: 1\ncamera: {{position: [{middle}, 1.25, 0.3], target: [{middle}, 0.75, 6], fov: 28}}\n"
            "film: {resolution: [128, 56], filter: box}\n"
            "integrator: {type: path, max_depth: 4, nee: true}\n"
            f"sampler: {{type: sobol, seed: 0, samples: {samples}}}\n"
            "materials:\n  wall: {type: diffuse, reflectance: 0.6}\n"
            "  black: {type: diffuse, reflectance: 0}\n"
            "objects:\n" + "\n".join(objects) + "\noutputs: [{file: out.pfm}]\n")


def render(crt, path, backend):
    """The error that the render states, and the processor seconds of the program."""
    image = path.with_name("out.pfm")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [crt, path, "--backend", backend, "--threads", "1", "-o", image, "--overwrite"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    report = json.loads(path.with_name("out.report.json").read_text())
    error = report["error"]  # Nothing is known of the error of one sample.
    return (error or {}).get("relative_rmse"), seconds


def sampling(crt, place, lamps, alone, samples, backend, folder):
    """Without what it takes to start and to compile the scene, which one sample shows."""
    path = folder / "scene.yaml"
    seconds = {}
    for n in (1, samples):
        path.write_text(scene(place, lamps, alone, n))
        error, seconds[n] = render(crt, path, backend)
    return error, (seconds[samples] - seconds[1]) * samples / (samples - 1)


def options(parser):
    parser.add_argument("programs", nargs="+", metavar="NAME=CRT")
    parser.add_argument("--lamps", type=int, default=1000)
    parser.add_argument("--place", choices=("room", "hall"), default="room")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--backend", default="embree")


def alone(asked):
    programs = dict(p.split("=", 1) for p in asked.programs)
    runs = {(p, what): [] for p in programs for what in ("all", "one")}
    with tempfile.TemporaryDirectory() as name:
        for turn in range(asked.rounds + 1):
            for program, what in runs:
                found = sampling(programs[program], asked.place, asked.lamps, what == "one", asked.samples,
                                 asked.backend, pathlib.Path(name))
                if turn > 0:  # The first round warms up.
                    runs[program, what].append(found)
    print(f"{asked.lamps} lamps, {asked.place}, {asked.backend}, {asked.samples} samples, "
          f"{asked.rounds} rounds")
    product = {}
    for (program, what), found in runs.items():
        seconds = [s for _, s in found]
        error, median = found[0][0], statistics.median(seconds)
        if error is None:
            raise SystemExit(f"{program}, {what}: the render does not know its error; take more --samples")
        product[program, what] = error * math.sqrt(median)
        print(f"  {program:10} {what}: error {100 * error:.2f} %, {median:.3f} s ({min(seconds):.3f} to "
              f"{max(seconds):.3f}), error * sqrt(s) {100 * product[program, what]:.3f}")
    for program in programs:
        ratio = product[program, "all"] / product[program, "one"]
        print(f"  {program:10} all over one, error at equal time: {ratio:.2f}")
