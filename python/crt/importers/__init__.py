"""Scenes of Mitsuba 3 (XML) and pbrt-v4 as scenes of crt. docs/import.md says what becomes of what."""

import dataclasses
import os
import pathlib

from ..errors import Error, Kind
from ..scenes import Scene, scene
from ..writing import relative
from .losses import absence, reading, refuse_infinite

ENDINGS = (".xml", ".pbrt", ".pbrt.gz")


@dataclasses.dataclass
class Imported:
    """A scene of another program: `scene` is a crt.Scene, `content` a dict with the keys of a scene file, in
    which meshes are arrays and files pathlib.Path, and `losses` a list of what crt has not, each kind of it
    once (Loss: what, instead, first, count). `files_read` are the names of the files read."""

    scene: Scene
    content: dict
    losses: list
    files_read: list


def is_foreign(path):
    """Is it, by its name, a scene that import_scene reads?"""
    return os.fspath(path).lower().endswith(ENDINGS)


def import_scene(path, parameters=None):
    """A scene of Mitsuba 3 (.xml) or pbrt-v4 (.pbrt, .pbrt.gz) as an Imported.

    `parameters` is a dict of values for the $names of Mitsuba's scenes. Unsupported features are listed,
    with the nearest that crt has in their place; nothing that is listed is an error. Errors are crt.Error of
    kind SCENE with file, line and column: what is no scene, files that are not there, and numbers that make
    none. A parameter that the scene does not use is an error of kind USAGE.
    """
    path = pathlib.Path(path)
    if not is_foreign(path):
        raise Error(f"'{path}' is not a Mitsuba (.xml) or pbrt (.pbrt, .pbrt.gz) scene", Kind.USAGE)
    if not path.is_file():
        raise Error(absence(path), Kind.SCENE)
    if path.suffix.lower() == ".xml":
        from . import mitsuba as reader
    else:
        from . import pbrt as reader
    with reading(path) as files:
        made = reader.read(path, {str(k): str(v) for k, v in (parameters or {}).items()})
        content = made.content()
        refuse_infinite(content)
    beside = relative(content, path.parent)
    return Imported(scene(beside, directory=path.parent, name=path.name), content, made.losses.list(),
                    sorted(files))
