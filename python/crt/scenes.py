"""Scenes: their keys, and the ways to make one."""

import collections.abc
import contextlib
import difflib
import json
import os
import pathlib

from . import scene_sources, writing
from .arrays import plain
from .errors import Error, Kind, MissingKey


class Scene:
    """A scene, and keys of it that have other values than its text gives.

    `scene["film.resolution"] = [320, 200]` sets a key as `crt render --set` does (docs/scene.md has the
    keys); a value is anything that YAML has: numbers, strings, booleans, None, lists, dicts, NumPy scalars
    and arrays of numbers. `scene["film.resolution"]` is the value that holds now, and `del` forgets the one
    that was set. `in`, `keys()` and `get()` work as for a dict. A key that neither the text nor you have set
    is missing: its default is in docs/scene.md. Values are copies: change one by setting its key.

    crt reads the scene, and raises its errors, when you first render it or ask for anything, and again after
    a key was set.

`copy()`, copy.copy and copy.deepcopy give a separate scene. A scene pickles: of a file its path, for
    machines that share the file; of text or a dict all of it. Files that the text names are looked up where
    it is unpickled.
    """

    def __init__(self, source, overrides=None):
        self._source = source
        self._overrides = {}
        self._native = self._content = None
        for key, value in (overrides or {}).items():
            self[key] = value

    def __setitem__(self, key, value):
        self._overrides[text_key(key)] = json.dumps(plain(value), ensure_ascii=False)
        self._native = self._content = None

    def __delitem__(self, key):
        """Forgets a value that was set; the scene's own holds again. Raises KeyError where none was."""
        del self._overrides[key]
        self._native = self._content = None

    def __getitem__(self, key):
        """The value of a key, such as "camera.position" or "objects.0.material". Raises crt.MissingKey."""
        return fresh(value_at(self._tree(), text_key(key)))

    def __contains__(self, key):
        try:
            value_at(self._tree(), key)
        except (MissingKey, TypeError):
            return False
        return True

    def get(self, key, default=None):
        """The value of a key, or `default` where the scene does not have it."""
        return self[key] if key in self else default

    def keys(self):
        """The sections of the scene: "camera", "film", …"""
        return list(self._tree())

    def __iter__(self):
        return iter(self.keys())

    def to_dict(self):
        """The scene as crt.scene takes it: with all that it includes, with the values that were set, with
        absolute paths of files, and with the arrays of a scene that was made of some."""
        return fresh(self._tree())

    def to_yaml(self):
        """The same as the text of a scene file; meshes of arrays are written out. Raises crt.Error of kind
        USAGE where a texture is an array: save writes it to a file."""
        return writing.to_text(self._tree(), ())

    def save(self, path, *, overwrite=False):
        """Writes the same as a scene file, and larger arrays to the folder NAME.meshes beside it. Files that
        lie in the folder of `path`, or below it, are named relative to it. Raises crt.Error of kind USAGE
        where the file exists, unless `overwrite`; of kind OUTPUT where it cannot be written."""
        folder = os.path.join(os.path.dirname(os.path.abspath(path)), "")
        named = {os.path.abspath(file) for file in self.files_read}
        below = {file for file in named if file.startswith(folder)}
        writing.to_file(with_paths(self._tree(), below), (), path, overwrite)

    def _tree(self):
        if self._content is None:
            self._content = self._source.content(list(self._overrides.items()))
        return self._content

    @property
    def overrides(self):
        """Keys that were set, and their values as YAML. A copy."""
        return dict(self._overrides)

    @property
    def native(self):
        """The scene as libcrt has read it. Raises crt.Error with every error of the text."""
        if self._native is None:
            self._native = self._source.read(list(self._overrides.items()))
        return self._native

    def copy(self):
        """Another scene of the same text and values, to be changed apart."""
        other = made_again(self._source, self._overrides)
        other._native, other._content = self._native, self._content
        return other

    __copy__ = copy

    def __reduce__(self):
        return made_again, (self._source, self._overrides)

    @contextlib.contextmanager
    def arguments(self):
        """A context manager: meanwhile these arguments show the scene to the program crt. A scene that is
        no file is one meanwhile, beside the files that it names."""
        with self._source.file() as path:
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
        changed = f", with {', '.join(self._overrides)} set" if self._overrides else ""
        try:
            native = self.native
        except (Error, ValueError) as error:
            first = str(error).partition("\n")[0]
            return f"<crt.Scene of {self._source}{changed}, which has errors: {first}>"
        return (f"<crt.Scene {native.title!r} of {self._source}{changed}: {native.width} x {native.height} "
                f"pixels, {native.samples} samples a pixel>")


def made_again(source, overrides):
    made = Scene(source)
    made._overrides = dict(overrides)
    return made


def text_key(key):
    if not isinstance(key, str):
        raise TypeError(f"keys are strings like 'film.resolution', not {key!r}")
    return key


def value_at(tree, key):
    """The value of a key with dots in a dict. Raises crt.MissingKey, which names the nearest key."""
    value, rest = tree, text_key(key)
    while True:
        part = rest.partition(".")[0]
        if isinstance(value, dict):  # Names may have dots themselves: the longest that fits is meant.
            part = max((name for name in value if rest == name or rest.startswith(f"{name}.")),
                       key=len, default=part)
            known = part in value
        else:
            known = isinstance(value, list) and part.isdecimal() and int(part) < len(value)
        if not known:
            raise missing(key, key[:len(key) - len(rest)], part, value)
        value = value[part if isinstance(value, dict) else int(part)]
        if rest == part:
            return value
        rest = rest[len(part) + 1:]


def missing(key, before, part, value):
    """The error for `part` of `key`, which `value` lacks; `before` is the way to it."""
    where = f"'{before[:-1]}'" if before else "the scene"
    if isinstance(value, list):
        there = f"{where} is a list of {len(value)}, whose first has the index 0"
    elif not isinstance(value, dict):
        there = f"{where} is {value!r}"
    else:
        near = difflib.get_close_matches(part, value, n=1)
        there = (f"did you mean '{before}{near[0]}'?" if near
                 else f"{where} has {', '.join(value)}" if value else f"{where} is empty")
    return MissingKey(f"the scene does not set '{key}'; {there}", Kind.USAGE)


def fresh(value):
    """A copy of dicts and lists; arrays are shared."""
    if isinstance(value, dict):
        return {key: fresh(inner) for key, inner in value.items()}
    return [fresh(inner) for inner in value] if isinstance(value, list) else value


def with_paths(value, files):
    """A copy of `value` in which those texts that are among `files` are paths. Meshes stay the same objects,
which identifies arrays."""
    if isinstance(value, dict):
        return {key: inner if key == "mesh" else with_paths(inner, files) for key, inner in value.items()}
    if isinstance(value, list):
        return [with_paths(inner, files) for inner in value]
    return pathlib.Path(value) if isinstance(value, str) and value in files else value


def load(path, set=None):
    """The scene in a YAML file, or the scene that crt makes of a model (.glb, .gltf, .obj, .ply).

    `set` is a dict of keys and values (Scene). Errors of the file and of the keys are raised as crt.Error of
    kind SCENE when the scene is first used.
    """
    return Scene(scene_sources.File(path), set)


def scene(source, directory=".", set=None, name="scene"):
    """A scene from a dict or from YAML text.

    A dict has the keys of a scene file. Meshes and textures in it may be arrays: `{"name": "ball", "mesh":
    {"positions": P, "faces": F}}` with P of shape (vertices, 3) and F of shape (faces, 3), and `{"texture":
    T}` with T of shape (height, width) or (height, width, 3), floats and linear, or uint8 and sRGB, top row
    first. `directory` is where files are looked up; `name` stands in messages.
    """
    if not isinstance(source, str) and not isinstance(source, collections.abc.Mapping):
        raise TypeError("a scene is a dict or YAML text, or crt.load(path) for a file, and no "
                        f"{type(source).__name__}")
    return Scene(scene_sources.Text(source, directory, name), set)


def examples_folder():
    """The folder of the scenes that come with crt: in a wheel in the package, in a build tree beside it.
    CRT_CONFIGS names another."""
    here = pathlib.Path(__file__).parent
    named = os.environ.get("CRT_CONFIGS")
    places = [here / "_tree/share/crt/configs", here.parents[1] / "share/crt/configs"]
    for place in [pathlib.Path(named)] if named else places:
        if place.is_dir():
            return place
    raise Error(f"the scenes that come with crt are missing: {place}", Kind.USAGE)


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
        raise Error(f"crt has no example scene '{name}'{meant}", Kind.USAGE)
    return path
