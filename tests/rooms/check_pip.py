#!/usr/bin/env python3
"""Nothing in this repository tells a user to install `crt` from PyPI, where that name belongs to another
project, nor the name of this distribution, which is not there. Exit code 1 names the lines.

    tests/rooms/check_pip.py [FOLDER]      another tree than this one
"""

import pathlib
import re
import sys

sys.dont_write_bytecode = True
from check_links import known_files  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
NAME = re.compile(r'^\[project\]\n(?:#.*\n)*name = "([^"]+)"', re.MULTILINE)
EXTRAS = re.compile(r"^\[project\.optional-dependencies\]\n((?:.+\n)*)", re.MULTILINE)
TAKEN = "crt"  # by another project on PyPI


def patterns(pyproject):
    """The forbidden texts: `pip install` of one of the names, after options and other packages, where a
    line may end after `install`; and a name with an extra, wherever it stands."""
    name = NAME.search(pyproject)[1]
    extras = "|".join(re.findall(r"^(\w+) =", EXTRAS.search(pyproject)[1], re.MULTILINE))
    names = f"(?:{TAKEN}|{re.escape(name)})"
    more = r"(?:[-\w.,=<>\[\]'\"]+[ \t]+)*?"
    return name, [re.compile(rf"pip3?\s+install[\s#/*]+{more}['\"]?{names}(?![-\w/.])"),
                  re.compile(rf"\b{names}\\?\[(?:{extras})\b")]


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT).resolve()
    name, wrong = patterns((root / "pyproject.toml").read_text("utf-8"))
    found = 0
    if name == TAKEN:
        print(f"pyproject.toml: the distribution is called {name}, as another project on PyPI")
        found += 1
    files = [file for file in sorted(known_files(root)) if not file.name.endswith("_pip.py")]
    for file in files:
        text = file.read_bytes().decode("utf-8", "replace")
        for match in (match for pattern in wrong for match in pattern.finditer(text)):
            line = text.count("\n", 0, match.start()) + 1
            print(f"{file.relative_to(root)}:{line}: {' '.join(match[0].split())}")
            found += 1
    print(f"{len(files)} files, {found} that name a package on PyPI that is not this one")
    return 1 if found or not files else 0


if __name__ == "__main__":
    sys.exit(main())
