"""OBJ files of other people: which render, which are refused and why, and what crt made of their materials.

    bench/run meshes FOLDER…    every *.obj below each folder, small, with a grey fallback material and a
    camera fitted to its bounds

Times nothing. A file that has a face with an area must render, unless a face names a vertex that is not
there: otherwise it ends with code 1.
"""

import math
import pathlib
import re
import struct
import subprocess

from .results import Results

RESOLUTION = 64
SECONDS_AT_MOST = 120
BACKENDS = ["embree", "opencl", "cuda"]

SCENE = """crt: 1
title: {title}
camera: {{position: [{position}], target: [{target}], fov: 40}}
film: {{resolution: [{resolution}, {resolution}]}}
materials: {{grey: {{type: diffuse, reflectance: 0.5}}}}
objects: [{{obj: {obj}, material: grey}}]
environment: {{radiance: 1}}
"""


def bounds(text):
    """Of all vertices that are numbers: (least, most) of x, y, z; of a unit cube where there is none."""
    least, most = [math.inf] * 3, [-math.inf] * 3
    for line in text.splitlines():
        words = line.split()
        if len(words) < 4 or words[0] != "v":
            continue
        try:
            point = [float(w) for w in words[1:4]]
        except ValueError:
            continue
        if all(map(math.isfinite, point)):
            least = [min(a, b) for a, b in zip(least, point)]
            most = [max(a, b) for a, b in zip(most, point)]
    return (least, most) if math.isfinite(least[0]) else ([0.0] * 3, [1.0] * 3)


def fitted_scene(obj, text):
    """A camera in front, above and to the right, so far away that the sphere around the bounds fits into
    its view."""
    least, most = bounds(text)
    centre = [(a + b) / 2 for a, b in zip(least, most)]
    radius = max(math.dist(least, most) / 2, 1e-6)
    direction = [0.5, 0.4, 0.77]
    distance = 1.05 * radius / math.sin(math.radians(20)) / math.hypot(*direction)
    position = [c + distance * d for c, d in zip(centre, direction)]

    def numbers(values):
        return ", ".join(f"{v:.9g}" for v in values)

    def quoted(value):
        return "'" + value.replace("'", "''") + "'"

    return SCENE.format(
        title=quoted(obj.name),
        obj=quoted(str(obj)),
        position=numbers(position),
        target=numbers(centre),
        resolution=RESOLUTION,
    )


def pixels(path):
    """The floats of a PFM."""
    data = path.read_bytes()
    header = re.match(rb"PF\n\d+ \d+\n-[0-9.]+\n", data)
    return struct.unpack(f"<{(len(data) - header.end()) // 4}f", data[header.end():])


def face_count(text):
    return len(re.findall(r"^\s*fo?[ \t]", text, re.MULTILINE))


class File:
    """The result of crt for one OBJ: its exit code, its error, its warnings, and the share of pixels in
    which
    the mesh is seen."""

    def __init__(self, program, backend, folder, path):
        self.name = str(path.relative_to(folder))
        text = path.read_text(errors="replace")
        self.faces = face_count(text)
        scene = program.scratch / "mesh.yaml"
        scene.write_text(fitted_scene(path.resolve(), text))
        self.seen = self.finite = None
        done = self.crt(program, backend, scene, program.scratch / "mesh.pfm", "path")
        self.code = done.returncode
        said = done.stderr.replace(str(path.resolve()), path.name).replace(f"{path.resolve().parent}/", "")
        self.warnings = [
            line.split(": ", 2)[2] for line in said.splitlines() if line.startswith("crt: warning: ")
        ]
        errors = re.findall(
            r"error: (.*)", said
        )  # The last is the one with a place; the first says that the scene cannot be rendered.
        self.error = errors[-1] if errors else said.strip()[-200:]
        self.materials = next(
            (
                m[1]
                for line in said.splitlines()
                if (m := re.search(r"\.obj: (\d+ materials?: .*)", line, re.IGNORECASE))
            ),
            "",
        )
        if self.code == 0:
            self.finite = all(map(math.isfinite, pixels(program.scratch / "mesh.pfm")))
            normals = program.scratch / "normals.pfm"
            self.crt(program, backend, scene, normals, "normals")
            values = pixels(normals)
            self.seen = sum(any(values[i:i + 3]) for i in range(0, len(values), 3)) / (len(values) / 3)

    @staticmethod
    def crt(program, backend, scene, image, integrator):
        command = [
            str(program.crt),
            "render",
            str(scene),
            "--backend",
            backend,
            "--spp",
            "4",
            "-o",
            str(image),
            "--set",
            f"integrator.type={integrator}",
        ]
        try:
            return subprocess.run(
                command,
                cwd=program.repository,
                env=program.environment,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=SECONDS_AT_MOST,
            )
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess(command, 124, "", f"not done after {SECONDS_AT_MOST} s")


def cell(text):
    return text.replace("|", "\\|").replace("<", "&lt;")


def options(parser):
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER",
                        help="looked through for *.obj; named REPOSITORY@COMMIT")
    parser.add_argument("--note", help="a paragraph for the page, about what is in the folders")


def measure(program, arguments):
    backend = program.backends(BACKENDS)[0][0]
    results = Results(program, arguments, "meshes", "OBJ files of other people")
    results.paragraph(
        f"Every OBJ below each folder, {RESOLUTION} × {RESOLUTION} pixels, 4 samples, on `{backend}`, with "
        f"`material: grey` for faces that have no "
        "material of their own, a camera fitted to the bounds and light from everywhere. A file renders "
        "when "
        "crt ends with code 0, all "
        "pixels are finite, and the mesh is seen in a second picture of its normals. Nothing of these files "
        "is part of crt."
    )
    if arguments.note:
        results.paragraph(arguments.note)
    corpora = {}
    for folder in arguments.folders:
        paths = sorted(p for p in folder.rglob("*") if p.suffix.lower() == ".obj")
        corpora[folder.name] = []
        for path in paths:
            corpora[folder.name].append(File(program, backend, folder, path))
            f = corpora[folder.name][-1]
            print(
                f"{folder.name} {f.name}: {'renders' if f.code == 0 else f'code {f.code}: {f.error}'}",
                flush=True,
            )

    def renders(f):
        return f.code == 0 and f.finite and f.seen > 0

    everything = [f for files in corpora.values() for f in files]
    results.table(
        [
            "repository@commit",
            "files",
            "render",
            "refused: no face with an area",
            "refused: a face names no vertex",
            "anything else",
        ],
        [
            [name, len(files), sum(map(renders, files)), *refusals(files, renders)]
            for name, files in corpora.items()
        ]
        + [["together", len(everything), sum(map(renders, everything)), *refusals(everything, renders)]],
    )

    results.claim(
        f"{sum(map(renders, everything))} of {len(everything)} public OBJ files render",
        [f"Every OBJ below each folder, {RESOLUTION} × {RESOLUTION} pixels, 4 samples, on `{backend}`. A "
         f"file "
         "renders when crt ends with code 0, all pixels are finite, and its mesh is seen. The others have "
         "no face "
         "with an area, or a face names a vertex that the file lacks. These files are not part of crt.",
         *([arguments.note] if arguments.note else [])],
        ["repository@commit", "files", "render", "no face with an area", "a face names no vertex", "other"],
        [[name, len(files), sum(map(renders, files)), *refusals(files, renders)]
         for name, files in [*corpora.items(), ("together", everything)]],
    )

    results.heading("Not rendered")
    results.table(
        ["file", "lines with faces", "code", "what crt says"],
        [
            [
                f"{name}/{f.name}",
                f.faces,
                f.code,
                cell(f.error if f.code else f"seen in {f.seen:.1%} of the pixels"),
            ]
            for name, files in corpora.items()
            for f in files
            if not renders(f)
        ],
    )

    results.heading("What was decided about materials")
    results.table(
        ["file", "what crt says"],
        [
            [f"{name}/{f.name}", cell(f.materials)]
            for name, files in corpora.items()
            for f in files
            if f.materials
        ],
    )

    results.heading("Other warnings of files that render")
    other = [
        (f"{name}/{f.name}", w)
        for name, files in corpora.items()
        for f in files
        if renders(f)
        for w in f.warnings
        if f.materials not in w or not f.materials
    ]
    results.table(["file", "warning"], [[file, cell(w)] for file, w in other])
    results.data = {
        name: [
            {
                "file": f.name,
                "code": f.code,
                "renders": renders(f),
                "faces": f.faces,
                "seen": f.seen,
                "error": f.error if f.code else "",
                "materials": f.materials,
                "warnings": f.warnings,
            }
            for f in files
        ]
        for name, files in corpora.items()
    }
    results.shown = {str(folder): folder.name for folder in arguments.folders}
    results.command(f"crt render SCENE.yaml --backend {backend} --spp 4 -o IMAGE.pfm")
    results.write()
    return 1 if any(not renders(f) and not expected(f) for f in everything) else 0


def expected(f):
    """A refusal that is right: the file has no face with an area, or one of them names a vertex that is not
    there."""
    return f.code == 3 and (no_area(f) or names_no_vertex(f))


def no_area(f):
    return (
        f.faces == 0
        or re.search(r"no face of this mesh has an area|needs at least three corners", f.error) is not None
    )


def names_no_vertex(f):
    return re.search(r"a face uses vertex|is not a face corner", f.error) is not None


def refusals(files, renders):
    refused = [f for f in files if not renders(f)]
    without_area = sum(f.code == 3 and no_area(f) for f in refused)
    no_vertex = sum(f.code == 3 and not no_area(f) and names_no_vertex(f) for f in refused)
    return [without_area, no_vertex, len(refused) - without_area - no_vertex]
