"""McGuire's Cornell box with its own MTL, and with the MTLs that Maya and a Sponza in circulation have, in
crt and in Mitsuba 3: is the luminance the same?

    bench/run mtl-agreement [FOLDER…]    also every *.obj below each folder, in light from everywhere, with
    a camera fitted to its bounds, or that of --view

Needs mitsuba and numpy (--python). Mitsuba renders a scene made from the same numbers by a reader of its
own (mtl_worker.py), in RGB and in wavelengths. Times nothing."""

import argparse
import json
import math
import pathlib
import re
import struct
import subprocess

from .meshes import bounds
from .mtl_worker import faces_by_material, materials, not_diffuse, statements
from .mitsuba_environment import add_python_option, python_with_mitsuba
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
# Of the models in folders.
MODEL_SIZE, MODEL_DEPTH, MODEL_FOV = 256, 5, 40
MODEL_SCENE = """crt: 1
camera: {{position: {position}, target: {target}, fov: {fov}}}
film: {{resolution: [{size}, {size}]}}
integrator: {{roulette: false, max_depth: {max_depth}}}
environment: {{radiance: {{rgb: [1, 1, 1], space: linear}}}}
objects: [{{obj: {obj}}}]
"""
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
    return scene_luminance(program, backend, folder / "scene.yaml", samples, SIZE)


def scene_luminance(program, backend, scene, samples, size):
    """(CIE Y of every pixel, row by row from the top; the run)"""
    image = program.scratch / "image.pfm"
    run = program.render(scene, backend, ["--spp", samples], [image], ["film.color_space=xyz"])
    data = image.read_bytes()
    header = re.match(rb"PF\n(\d+) (\d+)\n-[0-9.]+\n", data)
    floats = struct.unpack(f"<{size * size * 3}f", data[header.end():])
    rows = [[floats[3 * (y * size + x) + 1] for x in range(size)] for y in range(size)]
    return rows[::-1], run   # PFM begins with the bottom row.


def mitsuba_luminance(program, python, variant, obj, mtl, view, samples, seed):
    """(CIE Y of every pixel, row by row from the top; Mitsuba's version)"""
    image = program.scratch / f"{variant}.npy"
    done = subprocess.run(
        [
            python,
            pathlib.Path(__file__).with_name("mtl_worker.py"),
            variant,
            obj,
            mtl,
            str(samples),
            str(seed),
            image,
            json.dumps(view),
        ],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise Failure(f"Mitsuba fails: {done.stderr.strip()[-800:]}")
    data, size = image.read_bytes(), view["size"]
    header = 10 + struct.unpack("<H", data[8:10])[0]
    values = struct.unpack(f"<{size * size}f", data[header:])
    return [list(values[y * size : (y + 1) * size]) for y in range(size)], json.loads(
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
            folder = self.program.repository / FOLDER
            self.rendered[variant, read], self.version = mitsuba_luminance(
                self.program,
                self.python,
                variant,
                folder / "cornell_original.obj",
                folder / f"{mtl}.mtl",
                VIEW,
                self.samples,
                1,
            )
        return self.rendered[variant, read]


def mean(rows, x, y, width, height):
    return sum(sum(row[x:x + width]) for row in rows[y:y + height]) / (width * height)


def blocks(ours, theirs):
    """Relative difference of each block."""
    differences = []
    for y in range(0, len(ours), BLOCK):
        for x in range(0, len(ours), BLOCK):
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


def named_view(text):
    """'NAME=X,Y,Z,X,Y,Z,FOV' → (name, seven numbers)"""
    match = re.fullmatch(r"(.+)=([^=]+)", text)
    try:
        values = [float(number) for number in match[2].split(",")] if match else []
    except ValueError:
        values = []
    if len(values) != 7:
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=X,Y,Z,X,Y,Z,FOV")
    return match[1], values


def camera(obj, given):
    """As `--view` gives it, or in front, above and to the right, so far away that all is seen."""
    if obj.stem in given:
        *numbers, fov = given[obj.stem]
        return {"position": numbers[:3], "target": numbers[3:], "fov": fov}
    least, most = bounds(obj.read_text(errors="replace"))
    centre = [(a + b) / 2 for a, b in zip(least, most)]
    direction = [0.5, 0.4, 0.77]
    distance = math.dist(least, most) / 2 / math.sin(math.radians(MODEL_FOV / 2)) / math.hypot(*direction)
    position = [c + distance * d for c, d in zip(centre, direction)]
    return {"position": position, "target": centre, "fov": MODEL_FOV}


def mtl_of(obj):
    """The one MTL of an OBJ, whose materials must all be diffuse by the reading of mtl_worker.py."""
    lines = obj.read_text(errors="replace").splitlines()
    named = {line.split(None, 1)[1].strip() for line in lines if line.startswith("mtllib ")}
    if len(named) != 1 or not (mtl := obj.with_name(named.pop())).exists():
        raise Failure(f"{obj.name} names no one MTL that is beside it")
    said = statements(mtl)
    for name in faces_by_material(obj)[1]:
        if name not in said:
            raise Failure(f"{obj.name} has faces with the material '{name}', which is not in {mtl.name}")
        if why := not_diffuse(said[name]):
            raise Failure(f"{mtl.name}: '{name}' is {why}; only diffuse materials are compared")
    return mtl


def flat_copy(obj, mtl, folder):
    """The OBJ without its normals, and its MTL beside it: only the MTL is compared, and renderers differ in
    what they do where a shading normal and the face disagree."""
    lines = obj.read_text(errors="replace").splitlines()
    (folder / mtl.name).write_bytes(mtl.read_bytes())
    copy = folder / "model.obj"
    copy.write_text("".join(line + "\n" for line in lines if not line.startswith("vn ")))
    return copy


class Model:
    """One OBJ of other people with its MTL: its pictures in crt and in Mitsuba, and how they differ."""

    def __init__(self, program, python, backend, obj, arguments, samples):
        mtl = mtl_of(obj)
        self.view = {**camera(obj, dict(arguments.view)), "size": MODEL_SIZE, "max_depth": MODEL_DEPTH}
        stem, obj = obj.stem, flat_copy(obj, mtl, program.scratch)
        scene = program.scratch / "model.yaml"
        scene.write_text(MODEL_SCENE.format(obj=json.dumps(str(obj), ensure_ascii=False), **self.view))
        ours, run = scene_luminance(program, backend, scene, samples, MODEL_SIZE)
        self.triangles = run.value("scene", "triangles")
        view = {**self.view, "environment": 1}
        if arguments.pictures:
            arguments.pictures.mkdir(parents=True, exist_ok=True)
            picture = arguments.pictures.resolve() / stem
            program.render(scene, backend, ["--spp", samples], [f"{picture}.crt.png"])
            view["picture"] = f"{picture}.mitsuba.png"

        def theirs(variant, seed):
            return mitsuba_luminance(program, python, variant, obj, mtl, view, samples, seed)[0]

        rgb, spectral, again = (
            theirs(*which) for which in (("scalar_rgb", 1), ("scalar_spectral", 1), ("scalar_spectral", 2))
        )
        self.luminance = {
            name: mean(rows, 0, 0, MODEL_SIZE, MODEL_SIZE)
            for name, rows in (("crt", ours), ("rgb", rgb), ("wavelengths", spectral))
        }
        self.differences = {
            "wavelengths": self.luminance["crt"] / self.luminance["wavelengths"] - 1,
            "worst block": max(blocks(ours, spectral), key=abs),
            "worst block of Mitsuba with two seeds": max(blocks(again, spectral), key=abs),
            "RGB": self.luminance["crt"] / self.luminance["rgb"] - 1,
        }

    def cells(self):
        """Of a table."""
        return [
            self.triangles,
            *(f"{self.luminance[name]:.4f}" for name in ("crt", "wavelengths")),
            *(f"{d:+.2%}" for d in self.differences.values()),
        ]


def measure_models(program, arguments, python, backend, results):
    """The OBJs below the folders that were named, if any."""
    samples = 4 if arguments.tiny else arguments.model_samples
    table, results.data["models"] = [], {}
    for folder in arguments.folders:
        for obj in sorted(p.resolve() for p in folder.rglob("*") if p.suffix.lower() == ".obj"):
            model = Model(program, python, backend, obj, arguments, samples)
            name = f"{folder.name}: {obj.relative_to(folder.resolve())}"
            table.append([name, *model.cells()])
            print(*table[-1], flush=True)
            results.data["models"][name] = {
                "view": model.view,
                "triangles": model.triangles,
                "mean_luminance": model.luminance,
                "relative_difference": model.differences,
            }
    if not table:
        return
    results.claim(
        "Public models look the same in crt and Mitsuba 3",
        f"{MODEL_SIZE} × {MODEL_SIZE} pixels, {samples} samples, light of luminance 1 from everywhere; "
        f"only Kd of "
        "the MTL counts on both sides. Mean luminance, and crt over Mitsuba, less one.",
        ["model", "triangles", "crt", "Mitsuba", "crt over Mitsuba", "worst block of 16 × 16",
         "Mitsuba over itself, worst block"],
        [row[:-1] for row in table],
        name="mtl-agreement-models",
    )
    results.heading("Models of other people")
    results.paragraph(
        "OBJ and MTL files from public repositories (repository@commit), none of them part of crt. "
        f"{MODEL_SIZE} × {MODEL_SIZE} pixels, {samples} samples, depth {MODEL_DEPTH}, light of luminance 1 "
        "from everywhere (D65), a camera outside, or one given by `--view`. Mitsuba's side reads the MTL by "
        "itself (`bench/crtbench/mtl_worker.py`): a material is diffuse with Kd unless it says that light "
        "passes or that it is a mirror, and files with such materials are refused. A white `Tf`, `illum 4`, "
        "`Ni 1.5` and `d 1` say no such thing. Importers differ in this: Mitsuba 0.6 makes glass of every "
        "`illum 4`, and Blender, since it reads `Tf`, of every white one. Left out on both sides: normals, "
        "images (the Kd beside a `map_Kd` counts) and highlights (Ks, Ns), which Mitsuba 0.6 reads as a "
        "Phong lobe and Blender as the specular level of its Principled BSDF. Mean luminance (CIE Y) of the "
        "image; crt over Mitsuba, less one, of the image and of the worst of all "
        f"{(MODEL_SIZE // BLOCK) ** 2} blocks of "
        f"{BLOCK} × {BLOCK} pixels; beside it the worst block of Mitsuba over itself with another seed."
    )
    results.table(
        [
            "model",
            "triangles",
            "crt",
            "Mitsuba in wavelengths",
            "crt over Mitsuba",
            "worst block",
            "Mitsuba over itself, worst block",
            "crt over Mitsuba in RGB",
        ],
        table,
    )


def options(parser):
    add_python_option(parser)
    parser.add_argument("--samples", type=int, default=1024, help="per pixel, in both programs (1024)")
    parser.add_argument("folders", nargs="*", type=pathlib.Path, metavar="FOLDER",
                        help="looked through for *.obj with an MTL; named REPOSITORY@COMMIT")
    parser.add_argument("--model-samples", type=int, default=256, help="as --samples, of the models (256)")
    parser.add_argument(
        "--view", action="append", default=[], type=named_view, metavar="NAME=X,Y,Z,X,Y,Z,FOV",
        help="camera of NAME.obj: where it is, what it looks at, degrees",
    )
    parser.add_argument(
        "--pictures", type=pathlib.Path, metavar="FOLDER", help="PNGs of the models by both programs"
    )


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
    results.claim(
        "crt and Mitsuba 3 read an MTL alike",
        f"McGuire's Cornell box (public domain; `{FOLDER}`) with three forms of its MTL, {SIZE} × {SIZE} "
        f"pixels, "
        f"{samples} samples, crt on `{backend}`, Mitsuba {version} in wavelengths. Luminance of crt over "
        f"that of "
        "Mitsuba, less one: of the whole image and of patches that show one material.",
        ["MTL", "whole image", *PATCHES],
        [[row[0].removeprefix("crt, "), *row[2:-1]] for row in table
         if row[0].startswith("crt") and row[1].endswith("wavelengths")],
    )
    reference = mitsuba.luminance("scalar_spectral", "cornell_original")
    results.data = {
        "relative_difference": rows,
        "patches": {
            name: {"x_y_width_height": where, "mitsuba_luminance": mean(reference, *where)}
            for name, where in {"whole image": (0, 0, SIZE, SIZE), **PATCHES}.items()
        },
    }
    measure_models(program, arguments, python, backend, results)
    results.shown = {
        arguments.python: "PYTHON",
        str(arguments.pictures): "PICTURES",
        **{str(folder): folder.name for folder in arguments.folders},
    }
    results.command(
        f"crt render {FOLDER}/cornell_original.yaml --backend {backend} --spp {samples} -o IMAGE.pfm"
    )
    results.write()
