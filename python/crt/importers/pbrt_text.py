"""Tokens and parameters of pbrt's scene files."""

import re

import numpy as np

from .losses import Place, refuse, suggestion
from .meshes import Damaged, read_bytes

TOKEN = re.compile(r'\s+|#[^\n]*|("(?:[^"\\\n]|\\.)*")|([\[\]])|([^\s"\[\]#]+)|(")')
ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}
# Types of parameters: how many numbers make a value; None of those that are no numbers.
TYPES = {"float": 1, "integer": 1, "point2": 2, "vector2": 2, "point3": 3, "vector3": 3, "normal3": 3,
         "point": 3, "vector": 3, "normal": 3, "rgb": 3, "color": 3, "blackbody": 1, "spectrum": None,
         "bool": None, "string": None, "texture": None, "xyz": 3}


def only(values, place, what):
    """The value of a list that has no other."""
    if len(values) != 1:
        refuse(place, f"{what}, not {len(values)}")
    return values[0]


class Text:
    """The tokens of a file, one after the other: (text, quoted?, offset)."""

    def __init__(self, path):
        self.path, self.position, self.kept = path, 0, None
        try:
            self.text = read_bytes(path).decode("utf-8-sig", "replace")
        except Damaged as error:
            refuse(Place(str(path), 1), f"this is not a scene: {error}")
        self._line, self._start = 1, 0  # Of the last place that was asked for.

    def place(self, offset):
        if offset < self._start:
            self._line, self._start = 1, 0
        self._line += self.text.count("\n", self._start, offset)
        self._start = offset
        return Place(str(self.path), self._line, offset - self.text.rfind("\n", 0, offset))

    def next(self):
        """None at the end."""
        if self.kept:
            token, self.kept = self.kept, None
            return token
        while self.position < len(self.text):
            found = TOKEN.match(self.text, self.position)
            self.position = found.end()
            if found[4]:
                refuse(self.place(found.start()), "a text in quotes has no end on its line")
            if found[1]:
                word = re.sub(r"\\(.)", lambda m: ESCAPES.get(m[1], m[1]), found[1][1:-1])
                return word, True, found.start()
            if found.lastindex:
                return found[0], False, found.start()
        return None

    def peek(self):
        self.kept = self.next()
        return self.kept

    def string(self, directive):
        token = self.next()
        if token is None or not token[1]:
            refuse(self.place(token[2] if token else len(self.text)), f"{directive} takes a text in quotes"
                   + ("" if token is None else f", not '{token[0]}'"))
        return token[0]

    def numbers(self, directive, count):
        """With or without brackets."""
        found = []
        while len(found) < count:
            token = self.next()
            if token is not None and not token[1] and token[0] in "[]":
                continue
            try:
                found.append(float(token[0]))
            except (TypeError, ValueError):
                refuse(self.place(token[2] if token else len(self.text)),
                       f"{directive} takes {count} numbers"
                       + (", but the file ends" if token is None else f", not '{token[0]}'"))
            if not np.isfinite(found[-1]):
                refuse(self.place(token[2]), f"{directive} takes finite numbers, not '{token[0]}'")
        token = self.peek()
        if token and token[0] == "]" and not token[1]:
            self.next()
        return found

    def values(self):
        """The value after the name of a parameter: a list of texts, or an array of numbers."""
        token = self.next()
        if token is None:
            refuse(self.place(len(self.text)), "a parameter has no value: the file ends")
        if token[1] or token[0] != "[":
            return self.converted([token])
        end = self.text.find("]", self.position)
        between = self.text[self.position:end] if end >= 0 else ""
        if end >= 0 and '"' not in between and "#" not in between and "[" not in between:
            try:
                made = np.array(between.split(), float)
            except ValueError:
                pass
            else:
                self.position = end + 1
                if not np.isfinite(made).all():
                    refuse(self.place(token[2]), "a number of this list is not finite")
                return made
        found = []
        while (inner := self.next()) is not None and (inner[1] or inner[0] != "]"):
            found.append(inner)
        if inner is None:
            refuse(self.place(token[2]), "a list has no end: ']' is missing")
        return self.converted(found)

    def converted(self, tokens):
        if all(token[1] or token[0] in ("true", "false") for token in tokens):
            return [token[0] for token in tokens]
        for token in tokens:
            try:
                if token[1] or not np.isfinite(float(token[0])):
                    raise ValueError
            except ValueError:
                refuse(self.place(token[2]), f"this is not a finite number: '{token[0]}'")
        return np.array([float(token[0]) for token in tokens])

    def parameters(self, kind, name, place):
        made = Parameters(kind, name, place)
        while (token := self.peek()) is not None and token[1]:
            self.next()
            where = self.place(token[2])
            words = token[0].split()
            if len(words) != 2:
                refuse(where, f"a parameter is \"TYPE NAME\", not \"{token[0]}\"")
            if words[0] not in TYPES:
                refuse(where, f"there is no type '{words[0]}' of parameters" + suggestion(words[0], TYPES))
            self.checked(made, words, self.values(), where)
        return made

    @staticmethod
    def checked(made, words, values, where):
        count = TYPES[words[0]]
        if count and not isinstance(values, np.ndarray):
            if len(values):
                refuse(where, f"'{words[1]}' is of type '{words[0]}' and takes numbers, not '{values[0]}'")
            values = np.zeros(0)
        if count and len(values) % count:
            refuse(where, f"'{words[1]}' is of type '{words[0]}': {count} numbers each, not {len(values)}")
        if words[0] in ("string", "texture", "bool") and isinstance(values, np.ndarray):
            refuse(where, f"'{words[1]}' is of type '{words[0]}' and takes text, not numbers")
        made.values[words[1]] = (words[0], values, where)
        made.left.add(words[1])


class Parameters:
    """The parameters of a directive: `kind` is the directive's ("shape"), `name` what it names ("sphere").
    Those that were asked for are no longer `left`."""

    def __init__(self, kind, name, place):
        self.kind, self.name, self.place = kind, name, place
        self.values, self.left = {}, set()

    def __str__(self):
        return f"{self.kind} '{self.name}'"

    def inherit(self, others):
        for name, value in others.items():
            if name not in self.values:
                self.values[name] = value

    def has(self, name):
        return name in self.values

    def place_of(self, name):
        """The place of a parameter; that of the directive where the parameter is not there."""
        return self.values[name][2] if name in self.values else self.place

    def raw(self, name):
        """Type, values and place; None where it is not there."""
        self.left.discard(name)
        return self.values.get(name)

    def array(self, name, columns=None, count=None):
        """None where it is not there. `columns` make rows, whose number is free; `count` is all of them."""
        found = self.raw(name)
        if found is None or not isinstance(found[1], np.ndarray):
            return None
        if count and len(found[1]) != count:
            refuse(found[2], f"'{name}' of {self} is {count} numbers, not {len(found[1])}")
        if columns and len(found[1]) % columns:
            refuse(found[2], f"'{name}' has {len(found[1])} numbers, which do not make rows of {columns}")
        return found[1].reshape(-1, columns) if columns else found[1]

    def number(self, name, default):
        found = self.raw(name)
        if found is None:
            return float(default)
        if not isinstance(found[1], np.ndarray):
            refuse(found[2], f"'{name}' of {self} is a number")
        return float(only(found[1], found[2], f"'{name}' of {self} is one number"))

    def string(self, name, default=None):
        found = self.raw(name)
        if found is None:
            return default
        if isinstance(found[1], np.ndarray):
            refuse(found[2], f"'{name}' of {self} is a text")
        return only(found[1], found[2], f"'{name}' of {self} is one text")

    def boolean(self, name, default):
        found = self.string(name, default)
        return found if isinstance(found, bool) else found == "true"

    def point(self, name, default):
        found = self.array(name, count=3)
        return np.array(default, float) if found is None else found
