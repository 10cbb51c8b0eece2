"""Models and scenes of other people: which render, which are refused and why, and what crt leaves out.

    bench/run assets FOLDER…    every model and every scene of pbrt or Mitsuba below each folder, small

Times nothing. A model must render, with every pixel finite and not all alike or black, or be refused with
code 3 and a sentence; anything else (a crash, a hang, an empty picture, a copy of the program's memory
beyond --memory) ends with code 1. --pictures keeps the images and a sheet of them.
"""

import math
import pathlib
import re
import resource
import struct
import subprocess
import zlib

from . import foreign_scenes
from .meshes import cell, pixels
from .results import Results

RESOLUTION = 96
SAMPLES = 16
SECONDS_AT_MOST = 120
MEMORY_AT_MOST = 8 << 30  # Of addresses, so that a model that asks for all there is fails by itself.
BACKENDS = ["embree", "opencl", "cuda"]
EXTENSIONS = (".glb", ".gltf", ".obj", ".ply")
SHEET_COLUMNS = 10
SHOWN = 12  # Sentences of a section in docs/results.


class Model:
    """The result of crt for one file: exit code, error, warnings, and True if its picture shows
    something."""

    def __init__(self, program, backend, folder, path):
        self.name = str(path.relative_to(folder))
        self.bytes = path.stat().st_size
        image, shown = program.scratch / "model.pfm", program.scratch / "model.ppm"
        for file in (image, shown):
            file.unlink(missing_ok=True)
        done = run(program, [path.resolve(), "--backend", backend, "--spp", SAMPLES, "-o", image, "-o",
                             shown, "--set", f"film.resolution=[{RESOLUTION},{RESOLUTION}]"])
        self.code = done.returncode
        said = done.stderr.replace(str(path.resolve()), path.name).replace(f"{path.resolve().parent}/", "")
        self.warnings = [m[1] for line in said.splitlines() if (m := re.match(r"crt: warning: (.*)", line))]
        errors = re.findall(r"error: (.*)", said)
        self.error = errors[-1] if errors else said.strip()[-200:]
        values = pixels(image) if self.code == 0 else ()
        self.finite = all(map(math.isfinite, values))
        self.varied = len(set(values)) > 3
        self.picture = shown.read_bytes() if self.code == 0 else None
        self.black = self.picture is not None and mean_of(self.picture) < foreign_scenes.BLACK

    def renders(self):
        return self.code == 0 and self.finite and self.varied and not self.black

    def refused(self):
        return self.code == 3 and len(self.error) > 10

    def verdict(self):
        if self.renders():
            return "renders"
        if self.refused():
            return "refused"
        if self.code == 0:
            return "not finite" if not self.finite else "black" if self.black else "one colour"
        return f"code {self.code}"


def run(program, arguments):
    command = [str(program.crt), *map(str, arguments)]

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_AT_MOST, MEMORY_AT_MOST))

    try:
        return subprocess.run(command, cwd=program.scratch, env=program.environment, capture_output=True,
                              text=True, errors="replace", timeout=SECONDS_AT_MOST, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 124, "", f"not done after {SECONDS_AT_MOST} s")


def mean_of(picture):
    """The mean of the values of a PPM of 8 bits; white is 1."""
    values = picture[-3 * RESOLUTION * RESOLUTION:]
    return sum(values) / (255 * len(values))


def sheet(models):
    """The pictures beside each other, as PNG, in the order of the page."""
    shown = [m for m in models if m.picture]
    rows = -(-len(shown) // SHEET_COLUMNS)
    width = SHEET_COLUMNS * RESOLUTION
    lines = [bytearray(b"\x00" + b"\xff" * (3 * width)) for _ in range(rows * RESOLUTION)]
    for i, model in enumerate(shown):
        header = re.match(rb"P6\s+(\d+) (\d+)\s255\s", model.picture)
        x = 1 + 3 * RESOLUTION * (i % SHEET_COLUMNS)
        for y in range(RESOLUTION):
            start = header.end() + 3 * RESOLUTION * y
            lines[i // SHEET_COLUMNS * RESOLUTION + y][x:x + 3 * RESOLUTION] = model.picture[
                start:start + 3 * RESOLUTION
            ]

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", struct.pack(">IIBBBBB", width, rows * RESOLUTION, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"".join(lines), 9)) + chunk(b"IEND", b""))


def options(parser):
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER",
                        help="looked through for models and scenes; named REPOSITORY@COMMIT")
    parser.add_argument("--note", help="a paragraph for the page, about what is in the folders")
    parser.add_argument("--pictures", type=pathlib.Path, metavar="FOLDER",
                        help="keeps the images, and a sheet of them")


def measure(program, arguments):
    backend = program.backends(BACKENDS)[0][0]
    results = Results(program, arguments, "assets", "Models and scenes of other people")
    results.paragraph(
        f"Every glTF, GLB, OBJ and PLY file below each folder as `crt MODEL` renders it, {RESOLUTION} × "
        f"{RESOLUTION} pixels, {SAMPLES} samples, on `{backend}`, within {SECONDS_AT_MOST} s and "
        f"{MEMORY_AT_MOST >> 30} GiB of addresses. A file renders when crt ends with code 0, all pixels are "
        "finite and the picture is neither black nor of one colour; it is refused when crt ends with code 3 "
        "and says why. Nothing of these files is part of crt."
    )
    if arguments.note:
        results.paragraph(arguments.note)
    corpora, scenes = {}, []
    for folder in map(pathlib.Path.resolve, arguments.folders):
        for path in foreign_scenes.scenes(folder):
            scene = foreign_scenes.Scene(program, backend, folder, path)
            scenes.append((folder.name, scene))
            print(f"{folder.name} {scene.name}: {scene.verdict} {scene.ratio or ''} {scene.error or ''}",
                  flush=True)
        # Models next to a scene are parts of that scene.
        of_scenes = {path.parent for path in foreign_scenes.scenes(folder)}
        paths = sorted(p for p in folder.rglob("*") if p.suffix.lower() in EXTENSIONS and p.is_file()
                       and not of_scenes & set(p.parents))
        corpora[folder.name] = []
        for path in paths:
            model = Model(program, backend, folder, path)
            corpora[folder.name].append(model)
            print(f"{folder.name} {model.name}: {model.verdict()}"
                  + ("" if model.renders() else f": {model.error}"), flush=True)
    everything = [m for models in corpora.values() for m in models]

    results.table(
        ["repository@commit", "files", "render", "refused", "anything else"],
        [[name, len(models), *counts(models)] for name, models in corpora.items()]
        + [["together", len(everything), *counts(everything)]],
    )
    named = [(name, m) for name, models in corpora.items() for m in models]
    results.heading("Not rendered")
    results.paragraph("Those that are alike but for numbers (N) and names (…); the JSON has each file.")
    rows = grouped((name, m, m.verdict(), m.error) for name, m in named if not m.renders())
    results.table(["files", "for example", "verdict", "what crt says"], rows)
    results.heading("Not as in the file")
    rows = grouped((name, m, "", part) for name, m in named if m.renders()
                   for part in {part for w in m.warnings for part in parts(w)})
    results.table(["files", "for example", "what crt says"], [[row[0], row[1], row[3]] for row in rows])
    claims(results, arguments, backend, corpora)
    if scenes:
        claim_scenes(results, scenes)
    results.data = {
        name: [{"file": m.name, "verdict": m.verdict()}
               | ({"error": m.error} if not m.renders() else {"warnings": m.warnings} if m.warnings else {})
               for m in models]
        for name, models in corpora.items()
    }
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
        (arguments.pictures / "assets.png").write_bytes(sheet(everything))
        for name, m in named:
            if m.picture:
                picture = arguments.pictures / f"{name}_{re.sub('[^A-Za-z0-9.]+', '_', m.name)}.ppm"
                picture.write_bytes(m.picture)
    results.shown = {shown: folder.name for folder in arguments.folders
                     for shown in (str(folder), f"{folder}/")}
    results.shown[str(arguments.pictures)] = "PICTURES"
    results.command(f"crt MODEL --backend {backend} --spp {SAMPLES} -o IMAGE.pfm")
    results.write()
    fine = all(m.renders() or m.refused() for m in everything) and all(s.holds() for _, s in scenes)
    return 0 if fine else 1


def claims(results, arguments, backend, corpora):
    """The sections of docs/results: files by repository, refusals and losses, the most frequent ones."""
    everything = [m for models in corpora.values() for m in models]
    named = [(name, m) for name, models in corpora.items() for m in models]
    results.claim(
        f"{sum(m.renders() for m in everything)} of {len(everything)} public models render",
        [f"Every glTF, GLB, OBJ and PLY below each folder by `crt MODEL`, {RESOLUTION} × {RESOLUTION} "
         f"pixels, {SAMPLES} "
         f"samples, on `{backend}`. A file renders when crt ends with code 0, all pixels are finite and "
         f"they are "
         "not all of one colour; it is refused when crt ends with code 3 and says why. These files are not "
         "part "
         "of crt.",
         *([arguments.note] if arguments.note else [])],
        ["repository@commit", "files", "render", "refused", "other"],
        [[name, len(models), *counts(models)]
         for name, models in [*corpora.items(), ("together", everything)]],
    )
    refused = grouped((name, m, m.verdict(), m.error) for name, m in named if not m.renders())
    results.claim(
        "Why crt refuses models",
        f"The {SHOWN} most frequent sentences of {len(refused)}; N stands for numbers, … for names.",
        ["files", "what crt says"],
        [[row[0], row[3]] for row in refused[:SHOWN]],
        name="assets-refused",
    )
    lost = grouped((name, m, "", part) for name, m in named if m.renders()
                   for part in {part for w in m.warnings for part in parts(w)})
    results.claim(
        "What crt leaves out of models",
        f"The {SHOWN} most frequent sentences of {len(lost)} about models that render.",
        ["files", "what crt says"],
        [[row[0], row[3]] for row in lost[:SHOWN]],
        name="assets-lost",
    )


def claim_scenes(results, scenes):
    how = (f"Each after `crt import`, {foreign_scenes.SIDE} pixels on the longer side, "
           f"{foreign_scenes.SAMPLES} samples. ")
    rows = foreign_scenes.by_repository(scenes)
    total = ["together", *(sum(row[k] for row in rows) for k in range(1, 6))]
    results.claim(
        f"{total[2]} of {total[1]} public scenes of pbrt and Mitsuba render",
        how + "*Stand-ins*: scenes some of whose files this copy of the repository lacks and others "
        "replace; they are not compared. *Compared*: the mean luminance with that of the reference image "
        f"that comes with the scene. *Close*: within {foreign_scenes.CLOSE:.0%}.",
        ["repository@commit", "scenes", "render", "stand-ins", "compared", "close"], [*rows, total],
        name="assets-scenes")
    results.claim(
        "Scenes that are refused or differ, and why",
        how + "*Ratio*: the mean luminance over that of the reference. A picture is black when its mean is "
        f"below {foreign_scenes.BLACK:g} of white, and white when more than {foreign_scenes.WHITE:.0%} of "
        "its values are.",
        ["scene", "crt", "ratio", "why"],
        [[cell(str(c)) for c in row] for row in foreign_scenes.exceptions(scenes)],
        name="assets-scenes-why")


def counts(models):
    renders = sum(m.renders() for m in models)
    refused = sum(m.refused() for m in models)
    return [renders, refused, len(models) - renders - refused]


def parts(warning):
    """The entries of one warning, without the name of the file."""
    listed = warning.split(": not in the scene as in the file: ")
    return listed[1].split("; ") if len(listed) == 2 else [warning]


def grouped(said):
    """Rows of (files, the first of them, verdict, sentence), the most frequent first."""
    groups = {}
    for name, model, verdict, sentence in said:
        file = re.escape(pathlib.PurePath(model.name).name)
        sentence = re.sub(rf"^({file}|[^ :]+\.(mtl|gltf))(:\d+)*: ", "", sentence)
        sentence = re.sub(r"^(/[A-Za-z]+(/\w+)*): ", "", sentence)
        sentence = re.sub(r"'[^']*\.\w+'", "'…'", sentence) if "image" in sentence else sentence
        sentence = re.sub(r"(?<![\w.])\d[\d.]*(e-?\d+)?(?![\w.])", "N", sentence)
        groups.setdefault((verdict, sentence), []).append(f"{name}/{model.name}")
    rows = [[len(files), files[0], verdict, cell(sentence)]
            for (verdict, sentence), files in groups.items()]
    return sorted(rows, key=lambda row: (-row[0], row[3]))
