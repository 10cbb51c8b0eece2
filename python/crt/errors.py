"""The exceptions of crt."""

import enum


class Kind(enum.IntEnum):
    """Cause of an error; the values are the exit codes of the program crt."""

    INTERNAL = 1
    USAGE = 2
    SCENE = 3
    BACKEND = 4
    DEVICE = 5
    OUTPUT = 6


class Error(Exception):
    """The message; of a scene with several errors, all of them, each with file, line and column.

    `kind` is a Kind. `file`, `line` and `column` are the place of the first error; `file` is None where
    there is no place, `line` and `column` count from 1 and are None where they are not known.
    """

    def __init__(self, sentence, kind=Kind.INTERNAL, file="", line=0, column=0):
        super().__init__(sentence)
        self.kind = Kind(kind)
        self.file = file or None
        self.line = line or None
        self.column = column or None

    def __reduce__(self):
        return type(self), (str(self), self.kind, self.file or "", self.line or 0, self.column or 0)


class MissingKey(Error, KeyError):
    """A key that a scene does not have. A KeyError, too."""

    __str__ = Exception.__str__  # A KeyError puts its sentence into quotes.


class RenderFailed(Error):
    """The device failed after the first samples; `film` is what was rendered before."""

    def __init__(self, sentence, kind, file, line, column, film):
        super().__init__(sentence, kind, file, line, column)
        self.film = film

    def __reduce__(self):
        made, arguments = super().__reduce__()
        return made, (*arguments, self.film)
