"""Where things stand in the files of other programs, what an import leaves out, and how it refuses."""

import contextlib
import contextvars
import dataclasses
import difflib
import re

import numpy as np

from ..errors import Error, Kind


@dataclasses.dataclass(frozen=True)
class Place:
    """A file, and the line and column in it, which count from 1."""

    file: str
    line: int
    column: int = 1

    def __str__(self):
        return f"{self.file}:{self.line}"


def present(path, place):
    """The path, which counts as a file that the import reads. Raises crt.Error at the place that names it,
    where there is no file; the error lists every other file that the scene names and that is missing."""
    if path.is_file():
        reads(path)
        return path
    reading = _reading.get()
    others = {}
    for resolve, where in reading.named if reading else ():
        other = resolve()
        if not other.is_file() and other != path:
            others.setdefault(str(other), where)
    lines = [f"'{other}' ({where})" for other, where in list(others.items())[:MOST_MISSING]]
    more = len(others) - len(lines)
    refuse(place, f"the file {absence(path)}"
           + (f"; these files are missing too: {', '.join(lines)}" if lines else "")
           + (f" and {more} more" if more > 0 else ""))


def absence(path):
    """The end of a sentence about a path that is not that of a file."""
    return f"'{path}' is a folder" if path.is_dir() else f"'{path}' does not exist"


def reads(path):
    """Records that the import reads a file."""
    reading = _reading.get()
    if reading is not None:
        reading.files.add(str(path))


def names_file(resolve, place):
    """Records that the scene names a file at `place`; `resolve()` returns its path once all is parsed."""
    reading = _reading.get()
    if reading is not None and len(reading.named) < MOST_STEPS:
        reading.named.append((resolve, place))


def refuse(place, sentence):
    """Raises crt.Error of kind SCENE that begins with file, line and column."""
    raise Error(f"{place.file}:{place.line}:{place.column}: error: {printable(sentence)}", Kind.SCENE,
                place.file, place.line, place.column)


MOST_STEPS, FILE_COST = 200_000, 20
MOST_MISSING = 20  # Missing files that one error lists.


class _Reading:
    """The state of an import: the place that it reads, the number of steps so far, the files that the scene
    names, and those that the import reads."""

    def __init__(self, place):
        self.place, self.steps, self.named, self.files = place, 0, [], {place.file}


_reading = contextvars.ContextVar("crt_importers_reading", default=None)


def at(place):
    """Sets the current place, which errors without a place of their own report."""
    reading = _reading.get()
    if reading is not None:
        reading.place = place


def step(place, cost=1):
    """Counts the evaluation of a material or texture, or, at a higher cost, of a file. Raises crt.Error at
    `place` above MOST_STEPS: references that double at each level would otherwise never end."""
    at(place)
    reading = _reading.get()
    if reading is None:
        return
    reading.steps += cost
    if reading.steps > MOST_STEPS:
        refuse(place, "references double at each level: this scene evaluates more than "
                      f"{MOST_STEPS:,} materials and textures, or {MOST_STEPS // FILE_COST:,} files")


@contextlib.contextmanager
def reading(path):
    """A context in which every exception becomes a crt.Error of kind SCENE with file, line and column. Its
    value is a set to which the import adds the files that it reads."""
    token = _reading.set(_Reading(Place(str(path), 1)))
    try:
        with np.errstate(all="ignore"):  # Numbers that are not finite are refused in the end.
            yield _reading.get().files
    except Error:
        raise
    except RecursionError:
        refuse(_reading.get().place, "elements are nested too deep")
    except MemoryError:
        refuse(_reading.get().place, "there is not enough memory for this")
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        refuse(_reading.get().place, f"this cannot be read: {printable(words)[:300]}")
    finally:
        _reading.reset(token)


def refuse_infinite(content, name="the scene"):
    """Raises crt.Error if a number or an array of the scene is not finite."""
    if isinstance(content, dict):
        for key, inner in content.items():
            refuse_infinite(inner, f"'{key}' of {name}" if name.count("' of ") < 3 else name)
    elif isinstance(content, list):
        for inner in content:
            refuse_infinite(inner, name)
    elif isinstance(content, (float, np.ndarray)) and not np.isfinite(content).all():
        refuse(_reading.get().place, f"{name} is not finite")


def printable(text):
    """The text with control characters written as \\xNN, so that names from files are safe in terminals."""
    return re.sub(r"[\x00-\x08\x0a-\x1f\x7f-\x9f]", lambda found: f"\\x{ord(found[0]):02x}", text)


def suggestion(name, known):
    """"; did you mean 'x'?" where one of `known` is close to `name`, else nothing."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f"; did you mean '{close[0]}'?" if close else ""


@dataclasses.dataclass
class Loss:
    """A feature of a scene that crt does not have: `what` it is, what crt uses `instead`, the `first` place
    of it, how often (`count`) it occurs, and whether the picture changes a lot without it (`large`)."""

    what: str
    instead: str
    first: Place
    count: int = 1
    large: bool = False

    def __str__(self):
        times = f" ({self.count} times)" if self.count > 1 else ""
        return printable(f"{self.first}: {self.what}{times}: {self.instead}")


class Losses:
    """Each kind of loss once, with its count and its first place: first those that change the picture a lot,
    then the others, both in the order of the file."""

    def __init__(self):
        self._all = {}

    def add(self, place, what, instead="left out", large=False):
        if (what, instead) in self._all:
            self._all[what, instead].count += 1
        else:
            self._all[what, instead] = Loss(what, instead, place, large=large)

    def list(self):
        return sorted(self._all.values(), key=lambda loss: not loss.large)
