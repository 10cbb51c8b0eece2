"""Sources of scenes: files, text, and dicts with NumPy arrays in them."""

import contextlib
import fcntl
import functools
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
        self.folder = None if isinstance(source, str) else Folder()
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


NAME, LOCK = "crt-arrays-", "lock"


class Folder:
    """A temporary folder, which goes with this object or with the interpreter. Textures are read from it
    when the scene is rendered."""

    def __init__(self):
        place = tempfile.gettempdir(), os.getpid()
        self.shared = _shared.get(place) or _shared.setdefault(place, SharedFolder(place[0]))
        self.path = pathlib.Path(tempfile.mkdtemp(dir=self.shared.path))
        weakref.finalize(self, remove, self.path, os.getpid())


class SharedFolder:
    """The folder of all folders of a process, which goes with the last of them. A file in it is locked
    meanwhile: the kernel unlocks it when the process ends in any way, and the next process that makes such
    a folder removes this one. One file for all of them, because a process can open few files."""

    def __init__(self, parent):
        remove_abandoned(parent)
        # Locked before it has the name by which other processes find it.
        hidden = tempfile.mkdtemp(prefix=f".{NAME}", dir=parent)
        lock = locked(os.path.join(hidden, LOCK))
        self.path = pathlib.Path(parent, os.path.basename(hidden)[1:])
        os.rename(hidden, self.path)
        weakref.finalize(self, remove, self.path, os.getpid(), lock)


_shared = weakref.WeakValueDictionary()  # By the folder that it is in, and the process.


def locked(path):
    """The descriptor of a new file that is locked. None, and no file, where the file system has no locks:
    without the file, no other process removes the folder."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        os.unlink(path)
        return None
    return descriptor


def remove(path, owner, lock=None):
    """Removes a folder of this process. A process that was forked from its owner leaves it alone."""
    if os.getpid() == owner:
        shutil.rmtree(path, ignore_errors=True)
    if lock is not None:
        os.close(lock)


@functools.cache  # Once in each process: the folder of everyone may hold many files.
def remove_abandoned(parent):
    """Removes folders of arrays whose process was killed."""
    names = ()
    with contextlib.suppress(OSError):  # A folder that can be written to may not be readable.
        names = [name for name in os.listdir(parent) if name.startswith(NAME)]
    for name in names:
        path = os.path.join(parent, name)
        with contextlib.suppress(OSError):  # Another process may remove it at the same time.
            if is_abandoned(path):
                shutil.rmtree(path)


def is_abandoned(path):
    """True if the folder belongs to this user, is no link, and has a lock file that no process locks: on
    this machine or, where the file system shares locks, on another. Process numbers would not tell: they
    are used again, and differ in containers. Raises OSError where there is no such file."""
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if os.fstat(folder).st_uid != os.geteuid():
            return False
        descriptor = os.open(LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)
    finally:
        os.close(folder)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)
