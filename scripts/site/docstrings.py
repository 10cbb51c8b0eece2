"""An extension of griffe: blocks of `name   what it means` in the docstrings of crt become tables."""

import re

import griffe

COLUMN = re.compile(r"^(\w[\w.]*  +)\S")


def tables(text):
    """A block begins with a line of a word and two blanks or more; what is in its column belongs to it."""
    lines, made, at = text.splitlines(), [], 0
    while at < len(lines):
        found = COLUMN.match(lines[at])
        if not found or (at and lines[at - 1].strip()):
            made.append(lines[at])
            at += 1
            continue
        column, rows = len(found[1]), []
        while at < len(lines) and lines[at].strip():
            name, meaning = lines[at][:column].strip(), lines[at][column:].strip()
            if name:
                rows.append([name, meaning])
            else:
                rows[-1][1] += " " + meaning
            at += 1
        made += ["| | |", "|---|---|"]
        made += [f"| `{name}` | {meaning.replace('|', chr(92) + '|')} |" for name, meaning in rows]
    return "\n".join(made)


class Tables(griffe.Extension):
    def on_object(self, *, obj, **_):
        if obj.docstring:
            obj.docstring.value = tables(obj.docstring.value)
