"""Scenes of pbrt and Mitsuba as crt renders them, next to the reference images that come with them.

Files that a copy of a repository lacks may have stand-ins (a grey texture, a small mesh), so that the rest
renders. FOLDER/stand-ins.txt lists them, one path a line; scenes above them are not compared."""

import functools
import json
import math
import pathlib
import re
import subprocess
import sys

SIDE = 128  # Pixels of the longer side.
SAMPLES = 64
SECONDS_AT_MOST = 300
BLACK, WHITE = 0.002, 0.9  # Mean of the encoded picture; share of it that is white.
CLOSE = 0.05  # Of the reference's mean: scenes that differ by more are listed with the cause.
STAND_INS = "stand-ins.txt"
CAUSES = pathlib.Path(__file__).parents[1] / "foreign_scenes.tsv"


def scenes(folder):
    """Scene files below the folder; not those that others include."""
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in (".pbrt", ".xml") or not path.is_file():
            continue
        text = path.read_text(errors="replace")
        is_mitsuba = re.search(r"<scene\b", text) and re.search(r"<(sensor|camera|include)\b", text)
        if "WorldBegin" in text or is_mitsuba:
            yield path


@functools.cache
def stand_ins(folder):
    """Paths below the folder of files that stand in for missing ones."""
    listed = folder / STAND_INS
    return [folder / line for line in listed.read_text().splitlines()] if listed.is_file() else []


@functools.cache
def causes():
    """The causes of differences that no loss of the import names, by the ends of paths."""
    rows = [line.split("\t") for line in CAUSES.read_text().splitlines() if not line.startswith("#")]
    return dict(rows)


def reference(path):
    """The image that comes with a scene: NAME.exr, TungstenRender.exr, refs/NAME_ref_spectral.exr."""
    stem = re.sub(r"_(path|direct|volpath|volpathmis|ptracer)$", "", path.stem)
    for other in (path.with_suffix(".exr"), path.with_name("TungstenRender.exr"),
                  path.parent / "refs" / f"{stem}_ref_spectral.exr"):
        if other.is_file():
            return other
    return None


class Scene:
    """One scene in crt: what import and render say, and how bright it is compared with its reference."""

    def __init__(self, program, backend, folder, path):
        self.name = str(path.relative_to(folder))
        self.ratio = self.black = self.white = None
        self.stand_ins = [file.name for file in stand_ins(folder) if path.parent in file.parents]
        self.losses, self.notes, self.warnings, self.error = [], [], [], None
        made = program.scratch / "scene.yaml"
        done = self.run(program, [sys.executable, "-m", "crt", "import", path, "-o", made, "--overwrite"])
        said = done.stderr.replace(f"{path.parent}/", "")
        if done.returncode:
            self.verdict, self.error = f"import ends with {done.returncode}", last_error(said)
            return
        self.losses = re.findall(r"^crt: warning: the picture changes a lot: (.*)", said, re.MULTILINE)
        self.notes = [note for note in re.findall(r"^crt: not imported: (.*)", said, re.MULTILINE)
                      if "integrator" not in note]
        image, shown = program.scratch / "scene.pfm", program.scratch / "scene.ppm"
        width, height = size_of(made)
        scale = SIDE / max(width, height)
        resolution = [max(1, round(side * scale)) for side in (width, height)]
        done = self.run(program, [program.crt, made, "--backend", backend, "--spp", SAMPLES, "-o", image,
                                  "-o", shown, "--set", f"film.resolution={resolution}",
                                  "--set", "film.crop=null"])
        if done.returncode:
            self.verdict, self.error = f"render ends with {done.returncode}", last_error(done.stderr)
            return
        self.warnings = re.findall(r"^crt: warning: (.*)", done.stderr, re.MULTILINE)
        self.verdict = "renders"
        self.judge(program, path, image, shown)

    def run(self, program, command):
        environment = program.environment | {"PYTHONPATH": str(program.build / "python"),
                                             "CRT_PROGRAM": str(program.crt)}
        try:
            return subprocess.run(list(map(str, command)), cwd=program.scratch, env=environment,
                                  capture_output=True, text=True, errors="replace", timeout=SECONDS_AT_MOST)
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess(command, 124, "", f"error: no end in {SECONDS_AT_MOST} s")

    def judge(self, program, path, image, shown):
        """By a Python that has the package of this build, and NumPy."""
        with_it = reference(path)
        done = self.run(program, [sys.executable, "-c", JUDGE, image, shown, with_it or ""])
        if done.returncode:
            self.verdict, self.error = "no judgement", done.stderr.strip()[-200:]
            return
        found = json.loads(done.stdout)
        self.ratio, self.black, self.white = found["ratio"], found["mean"] < BLACK, found["white"] > WHITE

    def says_why(self):
        """Does a warning name a cause where the picture is black or white?"""
        return not (self.black or self.white) or bool(self.losses or self.warnings)

    def holds(self):
        refused = self.verdict.endswith("with 3") and bool(self.error)
        return refused or self.verdict == "renders" and self.says_why()

    def is_compared(self):
        return self.ratio is not None and math.isfinite(self.ratio) and not self.stand_ins

    def is_close(self):
        return self.is_compared() and abs(self.ratio - 1) <= CLOSE

    def why(self):
        """The causes of a difference from the reference, in one text."""
        losses = [re.sub(r"^[^ ]+:\d+: ", "", loss) for loss in self.losses or self.notes]
        cause = next((cause for end, cause in causes().items() if self.name.endswith(end)), None)
        return "; ".join(filter(None, [self.error, cause, *losses]))


JUDGE = """
import json, pathlib, sys
import numpy as np
from crt.importers.images import pixels
image, shown, reference = sys.argv[1:]
weights = np.array([0.2126, 0.7152, 0.0722])
luminance = pixels(pathlib.Path(image)) @ weights
data = open(shown, "rb").read().split(None, 4)
bytes_ = np.frombuffer(data[4][-int(data[1]) * int(data[2]) * 3:], np.uint8) / 255
ratio = None
if reference:
    other = pixels(pathlib.Path(reference))
    if other is not None:
        ratio = float(luminance.mean() / max((other @ weights).mean(), 1e-30))
print(json.dumps({"mean": float(bytes_.mean()), "white": float((bytes_ == 1).mean()), "ratio": ratio}))
"""


def size_of(scene):
    found = re.search(r"resolution: \[(\d+), (\d+)\]", scene.read_text())
    return (int(found[1]), int(found[2])) if found else (512, 512)


def last_error(said):
    errors = re.findall(r"error: (.*)", said)
    return errors[-1] if errors else said.strip()[-200:]


def by_repository(found):
    """Rows: scenes, how many render, are compared with a reference, and are close to it."""
    rows = []
    for name in dict.fromkeys(name for name, _ in found):
        of_it = [scene for other, scene in found if other == name]
        rows.append([name, len(of_it), sum(s.verdict == "renders" for s in of_it),
                     sum(bool(s.stand_ins) for s in of_it), sum(s.is_compared() for s in of_it),
                     sum(s.is_close() for s in of_it)])
    return rows


def exceptions(found):
    """Rows of what is refused, black, white, or not close to its reference: name, what crt does, its
    brightness over the reference's, and why."""
    rows = []
    for name, scene in found:
        seen = "black" if scene.black else "white" if scene.white else ""
        if scene.verdict == "renders" and not seen and (scene.is_close() or not scene.is_compared()):
            continue
        ratio = f"{scene.ratio:.3f}" if scene.is_compared() else ""
        rows.append([f"{name.partition('+')[2].partition('@')[0]}/{scene.name}",
                     scene.verdict + (f", {seen}" if seen else ""), ratio, scene.why()])
    return rows
