#!/usr/bin/env python3
"""Lines of sources, scripts, scenes, data and patches end before byte 110, as tools that count bytes see
them, and a program of more than 450 lines says why it is one file; exit code 1 names those that do not.
Tables in Markdown are what they are.
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = (".github", "bench", "cmake", "configs", "core", "data", "docs", "plugins", "python", "scripts",
           "tests", "verify")
KINDS = {".c", ".cl", ".cmake", ".cpp", ".csv", ".cu", ".h", ".in", ".json", ".map", ".mutant", ".patch",
         ".py", ".supp", ".txt", ".yaml", ".yml"}
BYTES = 109
PROGRAMS = {".c", ".cl", ".cpp", ".cu", ".h", ".py", ""}
LINES = 450
REASON = "Over 450 lines: "


def is_source(path):
    # Scripts have no ending.
    return path.is_file() and (path.suffix in KINDS or not path.suffix) and "__pycache__" not in path.parts


def main():
    files = [f for folder in FOLDERS for f in sorted((ROOT / folder).rglob("*")) if is_source(f)]
    files += [f for f in sorted(ROOT.iterdir()) if is_source(f)]
    long = unexplained = 0
    for file in files:
        # "+", "-" or a blank, before the line of the source.
        marker = {".patch": 1, ".mutant": 2}.get(file.suffix, 0)
        lines = file.read_text(errors="replace").splitlines()
        if file.suffix in PROGRAMS and len(lines) > LINES and not any(REASON in line for line in lines[:25]):
            print(f"{file.relative_to(ROOT)}: {len(lines)} lines, and no line '{REASON}…'")
            unexplained += 1
        for number, line in enumerate(lines, 1):
            size = len(line.encode())
            if size > BYTES + marker:
                print(f"{file.relative_to(ROOT)}:{number}: {size} bytes")
                long += 1
    print(f"{len(files)} files, {long} lines too long, {unexplained} files too long without a reason")
    return 1 if long or unexplained or not files else 0


if __name__ == "__main__":
    sys.exit(main())
