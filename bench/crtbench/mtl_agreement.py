"""McGuire's Cornell box with its own MTL, and with the MTLs that Maya and a Sponza in circulation have, in
crt and in Mitsuba 3: is the luminance the same?

Needs mitsuba and numpy (--python). Mitsuba renders a scene made from the same numbers by a reader of its
own (mtl_worker.py), in RGB and in
wavelengths. Times nothing."""

import json
import math
import pathlib
import re
import struct
import subprocess

from .mtl_worker import materials
from .peer_environment import python_with_mitsuba
from .program import Failure
from .results import Results

FOLDER = "bench/scenes/mtl"
FILES = {
    "cornell_original": "McGuire's own",
    "maya": "as Maya writes (`illum 4`, `Ni 1`, white `Tf`)",
    "sponza": "as a Sponza in circulation (`d 0`, `Ni 1`)",
}
SIZE, BLOCK = 128, 16
VIEW = {"position": [0, 1, 3.9], "target": [0, 1, 0], "fov": 40, "size": SIZE, "max_depth": 15}
# Squares of pixels (x, y, width, height) that show one material, away from edges.
PATCHES = {
    "left wall": (8, 40, 10, 40),
    "right wall": (108, 40, 10, 40),
    "back wall": (52, 30, 24, 14),
    "floor": (52, 114, 24, 8),
    "ceiling": (20, 4, 24, 8),
    "tall box": (44, 60, 14, 30),
    "short box": (72, 88, 14, 20),
}


def crt_luminance(program, backend, mtl, samples):
    """CIE Y of every pixel, row by row from the top."""
    scene = (program.repository / FOLDER / "cornell_original.yaml").read_text()
    obj = (program.repository / FOLDER / "cornell_original.obj").read_text()
    folder = program.scratch / mtl
    folder.mkdir(exist_ok=True)
    (folder / "scene.yaml").write_text(scene)
    (folder / "cornell_original.obj").write_text(
        re.sub(r"^mtllib .*$", f"mtllib {mtl}.mtl", obj, flags=re.MULTILINE)
    )
    (folder / f"{mtl}.mtl").write_text((program.repository / FOLDER / f"{mtl}.mtl").read_text())
    image = folder / "image.pfm"
    run = program.render(
        folder / "scene.yaml", backend, ["--spp", samples], [image], ["film.color_space=xyz"]
    )
    data = image.read_bytes()
    header = re.match(rb"PF\n(\d+) (\d+)\n-[0-9.]+\n", data)
    floats = struct.unpack(f"<{SIZE * SIZE * 3}f", data[header.end():])
    rows = [[floats[3 * (y * SIZE + x) + 1] for x in range(SIZE)] for y in range(SIZE)]
    return rows[::-1], run   # PFM begins with the bottom row.


def mitsuba_luminance(program, python, variant, mtl, samples, seed):
    image = program.scratch / f"{variant}.npy"
    folder = program.repository / FOLDER
    done = subprocess.run(
        [
            python,
            pathlib.Path(__file__).with_name("mtl_worker.py"),
            variant,
            folder / "cornell_original.obj",
            folder / f"{mtl}.mtl",
            str(samples),
            str(seed),
            image,
            json.dumps(VIEW),
        ],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise Failure(f"Mitsuba fails: {done.stderr.strip()[-800:]}")
    data = image.read_bytes()
    header = 10 + struct.unpack("<H", data[8:10])[0]
    values = struct.unpack(f"<{SIZE * SIZE}f", data[header:])
    return [list(values[y * SIZE : (y + 1) * SIZE]) for y in range(SIZE)], json.loads(
        done.stdout.splitlines()[-1]
    )["mitsuba"]


class Mitsuba:
    """Renders each reading of an MTL once: files that say the same of Kd and Ke are the same scene."""

    def __init__(self, program, python, samples):
        self.program, self.python, self.samples = program, python, samples
        self.rendered = {}
        self.version = ""

    def luminance(self, variant, mtl):
        read = json.dumps(
            materials(self.program.repository / FOLDER / f"{mtl}.mtl"), sort_keys=True
        ).replace(', "Ke": [0.0, 0.0, 0.0]', "")
        if (variant, read) not in self.rendered:
            self.rendered[variant, read], self.version = mitsuba_luminance(
                self.program, self.python, variant, mtl, self.samples, 1
            )
        return self.rendered[variant, read]


def mean(rows, x, y, width, height):
    return sum(sum(row[x:x + width]) for row in rows[y:y + height]) / (width * height)


def blocks(ours, theirs):
    """Relative difference of each block."""
    differences = []
    for y in range(0, SIZE, BLOCK):
        for x in range(0, SIZE, BLOCK):
            a, b = mean(ours, x, y, BLOCK, BLOCK), mean(theirs, x, y, BLOCK, BLOCK)
            differences.append(a / b - 1 if b > 0 else math.inf if a > 0 else 0.0)
    return differences


def compared(ours, theirs):
    """({name of a patch: relative difference}, the same as text)"""
    differences = {
        "whole image": mean(ours, 0, 0, SIZE, SIZE) / mean(theirs, 0, 0, SIZE, SIZE) - 1,
        **{name: mean(ours, *where) / mean(theirs, *where) - 1 for name, where in PATCHES.items()},
        "worst block": max(blocks(ours, theirs), key=abs),
    }
    return differences, [f"{d:+.2%}" for d in differences.values()]


def measure(program, arguments):
    python = python_with_mitsuba(arguments.python)
    backend = program.backends(["cuda", "embree", "opencl"])[0][0]
    samples = 16 if arguments.tiny else arguments.samples
    variants = {"scalar_rgb": "RGB", "scalar_spectral": "wavelengths"}
    results = Results(program, arguments, "mtl-agreement", "The same MTL in crt and in Mitsuba 3")
    mitsuba = Mitsuba(program, python, samples)
    rows, table = {}, []
    for mtl, title in FILES.items():
        ours, _ = crt_luminance(program, backend, mtl, samples)
        for variant, in_what in variants.items():
            theirs = mitsuba.luminance(variant, mtl)
            rows[f"{mtl} {variant}"], cells = compared(ours, theirs)
            table.append([f"crt, {title}", f"Mitsuba in {in_what}", *cells])
            print(*table[-1], flush=True)
    rows["mitsuba"], cells = compared(
        mitsuba.luminance("scalar_rgb", "cornell_original"),
        mitsuba.luminance("scalar_spectral", "cornell_original"),
    )
    table.append(["Mitsuba in RGB", "Mitsuba in wavelengths", *cells])
    version = mitsuba.version
    results.paragraph(
        f"McGuire's Cornell box (public domain, Cardenas and McGuire 2011; `{FOLDER}`), {SIZE} × {SIZE} "
        f"pixels, {samples} samples, in crt on `{backend}` and in Mitsuba "
        f"{version}, whose scene is made from the same OBJ and MTL by a reader of its own: every face "
        f"diffuse with Kd, an area light with Ke, linear "
        "sRGB. Luminance (CIE Y) of one over that of the other, less one: of the whole image, of patches "
        "that show one material, and the largest of all "
        f"{(SIZE // BLOCK) ** 2} blocks of {BLOCK} × {BLOCK} pixels. Mitsuba in RGB multiplies three "
        f"numbers "
        f"at each reflection, where crt and Mitsuba in wavelengths multiply "
        "spectra that are made from them: the last line is how much that is."
    )
    results.table(["this", "over that", "whole image", *PATCHES, "worst block"], table)
    reference = mitsuba.luminance("scalar_spectral", "cornell_original")
    results.data = {
        "relative_difference": rows,
        "patches": {
            name: {"x_y_width_height": where, "mitsuba_luminance": mean(reference, *where)}
            for name, where in {"whole image": (0, 0, SIZE, SIZE), **PATCHES}.items()
        },
    }
    results.shown = {arguments.python: "PYTHON"}
    results.command(
        f"crt render {FOLDER}/cornell_original.yaml --backend {backend} --spp {samples} -o IMAGE.pfm"
    )
    results.write()
