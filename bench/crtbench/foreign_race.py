"""Scenes in files of Mitsuba in `race`: Mitsuba renders the file, crt what it imports of it. Both get the
same depth, film and filter, no roulette and no media, which crt does not have."""

import os
import subprocess
import sys
import xml.etree.ElementTree as xml

import mitsuba as mi

from . import contestants as named
from .agree_scene import NEVER
from .program import Failure


def element(parent, kind, **attributes):
    return xml.SubElement(parent, kind, attributes)


def resolution(film, defaults, height):
    """As wide as the film's shape makes it."""
    sides = {}
    for side in ("width", "height"):
        value = film.find(f"integer[@name='{side}']").get("value")
        sides[side] = int(defaults.get(value.lstrip("$"), value))
    return round(height * sides["width"] / sides["height"]), height


def prepared(file, target, sampler, height, depth):
    """Writes the scene with our settings and files by their whole names. Returns the resolution."""
    root = xml.parse(file).getroot()
    defaults = {e.get("name"): e.get("value") for e in root.findall("default")}
    for name in root.iter("string"):
        if name.get("name") == "filename":
            name.set("value", str((file.parent / name.get("value")).resolve()))
    for parent in list(root.iter()):
        for film in parent.findall("film"):
            width, height = resolution(film, defaults, height)
            film.clear()
            film.set("type", "hdrfilm")
            element(film, "integer", name="width", value=str(width))
            element(film, "integer", name="height", value=str(height))
            element(film, "string", name="pixel_format", value="xyz")
            element(film, "string", name="component_format", value="float32")
            element(film, "rfilter", type="box")
        for medium in parent.findall("medium"):
            parent.remove(medium)
        for old in parent.findall("sampler"):
            old.clear()
            old.set("type", sampler)
            element(old, "integer", name="sample_count", value="16")
    integrator = root.find("integrator")
    integrator.clear()
    integrator.set("type", "path")
    # Mitsuba's depth counts the emitter, max_depth of crt does not.
    element(integrator, "integer", name="max_depth", value=str(depth + 1))
    element(integrator, "integer", name="rr_depth", value=str(NEVER))
    xml.ElementTree(root).write(target)
    return width, height


def imported(program, file):
    """The scene as crt's importer writes it. Its messages are shown: they say what is different."""
    scene = file.with_suffix(".yaml")
    done = subprocess.run(
        [sys.executable, "-m", "crt", "import", str(file), "-o", str(scene)],
        env={**os.environ, "PYTHONPATH": str(program.build / "python")},
        capture_output=True,
        text=True,
    )
    print(done.stderr.strip(), flush=True)
    if done.returncode != 0:
        raise Failure(f"crt cannot import {file.name}: {done.stderr.strip()[-500:]}")
    return scene


class Crt(named.Crt):
    """crt with the imported scene."""

    def __init__(self, *arguments, resolution, depth):
        super().__init__(*arguments)
        self.resolution, self.depth = resolution, depth

    def settings(self):
        return [
            f"film.resolution=[{self.resolution[0]},{self.resolution[1]}]",
            "film.filter=box",
            f"integrator.max_depth={self.depth}",
            "integrator.roulette=false",
        ]


class Mitsuba(named.Mitsuba):
    """Mitsuba with its own file."""

    def load(self, program, file, size):
        return mi.load_file(str(file))


def contestants(program, file, arguments):
    theirs = []
    for sampler in arguments.samplers:
        target = program.scratch / f"{name(file).replace('/', '_')}_{sampler}.xml"
        shape = prepared(file, target, sampler, arguments.size, arguments.depth)
        theirs += [Mitsuba(program, target, v, sampler, arguments.size) for v in arguments.variants]
    scene = imported(program, target)
    ours = [
        Crt(program, scene, backend, replicates, arguments.size, resolution=shape, depth=arguments.depth)
        for backend in arguments.backends
        for replicates in arguments.replicates
    ]
    return {"crt": ours, "Mitsuba": theirs}


def name(file):
    """Many files are called scene.xml."""
    return f"{file.resolve().parent.name}/{file.stem}"
