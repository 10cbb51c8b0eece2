#!/usr/bin/env python3
"""Programs in Python name nothing that is not defined and import nothing that they do not use, by pyflakes:
most of bench/ runs in no test, and Python itself finds such a name only when it gets there. Exit code 1 says
what is wrong; 77, that pyflakes is not installed.
"""

import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("bench", "core", "plugins", "python", "scripts", "tests")


def is_python(path):
    if not path.is_file() or "__pycache__" in path.parts:
        return False
    if path.suffix:
        return path.suffix == ".py"
    with path.open("rb") as file:
        return file.readline().rstrip().endswith(b"python3")


def main():
    pyflakes = shutil.which("pyflakes3")
    if pyflakes is None:
        print("pyflakes3 is not installed; scripts/setup does that")
        return 77
    programs = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if is_python(path))
    done = subprocess.run([pyflakes, *map(str, programs)])
    print(f"{len(programs)} programs")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
