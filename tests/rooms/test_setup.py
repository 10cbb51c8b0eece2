#!/usr/bin/env python3
"""scripts/setup installs what the programs need that the installed crt runs with the system's Python: every
library that they import and that Python itself does not have."""

import ast
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "python/crt/report"


def imports(file):
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.partition(".")[0]


def main():
    setup = (ROOT / "scripts/setup").read_text("utf-8")
    listed = re.search(r"^PACKAGES=\((.*?)^\)", setup, re.MULTILINE | re.DOTALL)[1]
    packages = {word for line in listed.splitlines() for word in line.partition("#")[0].split()}
    imported = {name for file in sorted(PAGES.glob("*.py")) for name in imports(file)}
    needed = imported - sys.stdlib_module_names
    missing = sorted(name for name in needed if f"python3-{name}" not in packages)
    for name in missing:
        print(f"python/crt/report imports {name}, and PACKAGES in scripts/setup lacks python3-{name}")
    print(f"{len(needed)} libraries, {len(missing)} missing")
    return 1 if missing or not needed else 0


if __name__ == "__main__":
    sys.exit(main())
