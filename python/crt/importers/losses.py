"""Where things stand in the files of other programs, what an import leaves out, and how it refuses."""

import dataclasses
import difflib

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
    """The path. Raises crt.Error at the place that names it, where there is no file."""
    if not path.is_file():
        refuse(place, f"'{path}' is not there")
    return path


def refuse(place, sentence):
    """Raises crt.Error of kind SCENE that begins with file, line and column."""
    raise Error(f"{place.file}:{place.line}:{place.column}: error: {sentence}", Kind.SCENE, place.file,
                place.line, place.column)


def suggestion(name, known):
    """"; did you mean 'x'?" where one of `known` is close to `name`, else nothing."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f"; did you mean '{close[0]}'?" if close else ""


@dataclasses.dataclass
class Loss:
    """What a scene has and crt has not: `what` it is, what is used instead, how often it stands there, and
    where it stands first."""

    what: str
    instead: str
    first: Place
    count: int = 1

    def __str__(self):
        times = f" ({self.count} times)" if self.count > 1 else ""
        return f"{self.first}: {self.what}{times}: {self.instead}"


class Losses:
    """Each kind of loss once, with its count and its first place, in the order in which they were met."""

    def __init__(self):
        self._all = {}

    def add(self, place, what, instead="left out"):
        if (what, instead) in self._all:
            self._all[what, instead].count += 1
        else:
            self._all[what, instead] = Loss(what, instead, place)

    def list(self):
        return list(self._all.values())
