"""Scenes: from files, from text, and from dicts with NumPy arrays in them."""

import collections.abc
import contextlib
import difflib
import json
import os
import pathlib
import shutil
import tempfile
import weakref

import numpy as np

from . import _crt
from .arrays import Arrays
from .errors import Error, Kind
from .messages import tell


class Scene:
    """A scene, and keys of it that have other values than its text says.

    `scene["film.resolution"] = [320, 200]` sets a key as `crt render --set` does (docs/scene.md has the
    keys); a value is anything that YAML has: numbers, strings, booleans, None, lists, dicts, NumPy scalars
    and arrays of numbers. The scene is read, and its errors are raised, when it is first rendered or asked
    for anything, and again after a key was set.

    A scene pickles: of a file its path, for machines that share the file, of text or a dict all of it. Files
    that the text names are looked up where it is unpickled.
    """

    def __init__(self, read, file, origin, overrides=None):
        self._read = read
        self._file = file
        self._origin = origin  # The function and its arguments that make this scene again.
        self._overrides = {}
        self._native = None
        for key, value in (overrides or {}).items():
            self[key] = value

    def __setitem__(self, key, value):
        if not isinstance(key, str):
            raise TypeError(f"keys are strings like 'film.resolution', not {key!r}")
        self._overrides[key] = json.dumps(plain(value))
        self._native = None

    def __delitem__(self, key):
        """Forgets a value that was set; the scene's own holds again. Raises KeyError where none was."""
        del self._overrides[key]
        self._native = None

    @property
    def overrides(self):
        """Keys that were set, and their values as YAML. A copy."""
        return dict(self._overrides)

    @property
    def native(self):
        """The scene as libcrt has read it. Raises crt.Error with every error of the text."""
        if self._native is None:
            self._native = self._read(list(self._overrides.items()))
        return self._native

    def copy(self):
        """Another scene of the same text and values, to be changed apart."""
        other = Scene(self._read, self._file, self._origin)
        other._overrides = dict(self._overrides)
        other._native = self._native
        return other

    def __reduce__(self):
        return made_again, (*self._origin, self._overrides)

    @contextlib.contextmanager
    def arguments(self):
        """A context manager: meanwhile these arguments show the scene to the program crt. A scene that is
        no file is one meanwhile, beside the files that it names."""
        with self._file() as path:
            yield [path, *(word for item in self._overrides.items() for word in ("--set", "=".join(item)))]

    @property
    def title(self):
        return self.native.title

    @property
    def width(self):
        """Pixels of the film, or of its crop window where there is one."""
        return self.native.width

    @property
    def height(self):
        """Pixels of the film, or of its crop window where there is one."""
        return self.native.height

    @property
    def samples(self):
        """A pixel, where a render does not say otherwise."""
        return self.native.samples

    @property
    def seed(self):
        return self.native.seed

    @property
    def files_read(self):
        """Paths of the scene file itself and of every file that it names."""
        return self.native.files_read

    def __repr__(self):
        return f"<crt.Scene {self.title!r}, {self.width} x {self.height} pixels>"


def made_again(function, arguments, overrides):
    made = function(*arguments)
    made._overrides = dict(overrides)
    return made


def plain(value):
    """`value` as numbers, strings, lists and dicts, without NumPy."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, collections.abc.Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value


def load(path, set=None):
    """The scene in a YAML file, or the scene that crt makes of a model (.glb, .gltf, .obj, .ply).

    `set` is a dict of keys and values (Scene). Errors of the file and of the keys are raised as crt.Error of
    kind SCENE when the scene is first used.
    """
    where = os.fspath(path)
    return Scene(lambda overrides: _crt.Scene.from_file(where, overrides, tell),
                 lambda: contextlib.nullcontext(where), (load, (os.path.abspath(where),)), set)


def scene(source, directory=".", set=None, name="scene"):
    """A scene from a dict or from YAML text.

    A dict has the keys of a scene file. Meshes and textures in it may be arrays: `{"name": "ball", "mesh":
    {"positions": P, "faces": F}}` with P of shape (vertices, 3) and F of shape (faces, 3), and `{"texture":
    T}` with T of shape (height, width) or (height, width, 3), floats and linear, or uint8 and sRGB, top row
    first. `directory` is where files are looked up; `name` stands in messages.
    """
    folder = Folder()

    def text():
        if isinstance(source, str):
            return source
        return json.dumps(plain(Arrays(folder.path).written(source)))

    def read(overrides):
        return _crt.Scene.from_text(text(), overrides, name, os.fspath(directory), tell)

    @contextlib.contextmanager
    def file():
        with tempfile.NamedTemporaryFile("w", dir=directory, prefix=f".{name}-", suffix=".yaml",
                                         encoding="utf-8") as written:
            written.write(text())
            written.flush()
            yield written.name

    if not isinstance(source, str) and not isinstance(source, collections.abc.Mapping):
        raise TypeError("a scene is a dict or YAML text, or crt.load(path) for a file, and no "
                        f"{type(source).__name__}")

    return Scene(read, file, (again, (source, os.path.abspath(directory), name)), set)


def again(source, directory, name):
    return scene(source, directory, name=name)


def examples_folder():
    """The folder of the scenes that come with crt: in a wheel in the package, in a build tree beside it.
    CRT_CONFIGS names another."""
    here = pathlib.Path(__file__).parent
    named = os.environ.get("CRT_CONFIGS")
    places = [here / "_tree/share/crt/configs", here.parents[1] / "share/crt/configs"]
    for place in [pathlib.Path(named)] if named else places:
        if place.is_dir():
            return place
    raise Error(f"the scenes that come with crt are not where they should be: {place}", Kind.USAGE)


def examples():
    """The names of the scenes that come with crt, sorted."""
    return sorted(path.stem for path in examples_folder().glob("*.yaml"))


def example(name):
    """The pathlib.Path of a scene that comes with crt: `crt.load(crt.example("cornell_box"))`. Raises
    crt.Error of kind USAGE for a name that is none of crt.examples()."""
    path = examples_folder() / f"{name}.yaml"
    known = examples()
    if name not in known:
        near = difflib.get_close_matches(str(name), known, n=1)
        meant = f"; did you mean '{near[0]}'?" if near else f"; there are {', '.join(known)}"
        raise Error(f"no scene '{name}' comes with crt{meant}", Kind.USAGE)
    return path


class Folder:
    """A temporary folder, which goes with this object or with the interpreter. Textures are read from it
    when the scene is rendered."""

    def __init__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="crt-arrays-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)
