"""Sources of scenes: files, text, and dicts with NumPy arrays in them."""

import contextlib
import json
import os
import pathlib
import shutil
import tempfile
import weakref

from . import _crt
from .arrays import Arrays, plain
from .messages import tell


class File:
    """A scene file or a model."""

    def __init__(self, path):
        self.path = os.fspath(path)

    def read(self, overrides):
        """The scene as libcrt has it."""
        return _crt.Scene.from_file(self.path, overrides, tell)

    def content(self, overrides):
        """The scene with all that it includes and with the overrides, as a dict; files have absolute
        paths."""
        return json.loads(_crt.Scene.compose_file(self.path, overrides, say_nothing))

    def file(self):
        """A context manager for the path of a file that has this scene meanwhile."""
        return contextlib.nullcontext(self.path)

    def __reduce__(self):
        return File, (os.path.abspath(self.path),)

    def __str__(self):
        return self.path


class Text:
    """YAML text, or a dict. Larger arrays of a dict are files in a folder, which goes with this object."""

    def __init__(self, source, directory, name):
        self.source, self.directory, self.name = source, os.fspath(directory), name
        self.folder = Folder()
        self.arrays = None  # Of the text that was made last.

    def text(self):
        if isinstance(self.source, str):
            return self.source
        self.arrays = Arrays(self.folder.path)
        return json.dumps(plain(self.arrays.written(self.source)))

    def read(self, overrides):
        return _crt.Scene.from_text(self.text(), overrides, self.name, self.directory, tell)

    def content(self, overrides):
        made = json.loads(_crt.Scene.compose_text(self.text(), overrides, self.name, self.directory,
                                                  say_nothing))
        return self.arrays.restored(made) if self.arrays is not None else made

    @contextlib.contextmanager
    def file(self):
        with tempfile.NamedTemporaryFile("w", dir=self.directory, prefix=f".{self.name}-", suffix=".yaml",
                                         encoding="utf-8") as written:
            written.write(self.text())
            written.flush()
            yield written.name

    def __reduce__(self):
        return Text, (self.source, os.path.abspath(self.directory), self.name)

    def __str__(self):
        return "a dict" if self.arrays is not None or not isinstance(self.source, str) else "text"


def say_nothing(_level, _text):
    """Messages about a scene appear when it is read for a render."""


class Folder:
    """A temporary folder, which goes with this object or with the interpreter. Textures are read from it
    when the scene is rendered."""

    def __init__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="crt-arrays-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)
