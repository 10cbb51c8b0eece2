#!/usr/bin/env python3
"""check_pip.py finds every way to tell a user to install crt from PyPI, and nothing else."""

import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(__file__).with_name("check_pip.py")
PROJECT = """[project]
# A comment.
name = "crt-renderer"

[project.optional-dependencies]
report = ["jinja2"]
"""
GOOD = """pip install . ; pip install '.[report]' ; pip install jinja2 matplotlib
The package crt. pip install nvidia-cuda-crt ; pip install crtools ; venv/bin/pip install .
crt converge; pip install '.[report]'    # in a clone
python -m crt report; crt[0]; python -m pip install matplotlib; then crt converge
"""
WRONG = ("pip install crt", "pip install 'crt[report]'",
         "`pip install\n'crt[report]'`", "pip3 install -U crt",
         "pip install crt-renderer", "pip install matplotlib crt", 'pip install "crt==0.1"',
         "needs crt[report].",
         "python -m pip install --upgrade 'crt-renderer[report]'")


def check(project, text):
    with tempfile.TemporaryDirectory() as name:
        pathlib.Path(name, "pyproject.toml").write_text(project)
        pathlib.Path(name, "a.md").write_text("# A\n" + text)
        return subprocess.run([sys.executable, CHECK, name], capture_output=True, text=True)


def main():
    failed = 0
    done = check(PROJECT, GOOD)
    if done.returncode:
        failed += 1
        print("good lines are called wrong:", done.stdout, done.stderr)
    for text in WRONG:
        done = check(PROJECT, text)
        if done.returncode != 1 or "a.md:2: " not in done.stdout:
            failed += 1
            print(f"{text!r}: not found:", done.stdout, done.stderr)
    done = check(PROJECT.replace("crt-renderer", "crt"), GOOD)
    if done.returncode != 1 or "pyproject.toml" not in done.stdout:
        failed += 1
        print("a distribution called crt: not found:", done.stdout, done.stderr)
    print(f"{2 + len(WRONG)} cases, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
