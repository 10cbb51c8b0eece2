"""`python -m crt`: the program, with the commands that are written in Python."""

import subprocess
import sys


def run(*arguments):
    return subprocess.run([sys.executable, "-m", "crt", *arguments], capture_output=True, text=True,
                          timeout=900)


def test_what_is_not_written_in_python_is_the_program(program):
    done = run("--version")
    assert (done.returncode, done.stdout) == (0, program("--version"))
    done = run("nosuch.yaml")
    assert done.returncode == 3 and "nosuch.yaml" in done.stderr


def test_without_its_program_it_says_so(monkeypatch):
    monkeypatch.setenv("CRT_PROGRAM", "/nowhere/crt")
    done = run("a.yaml")
    assert done.returncode == 2 and "/nowhere/crt" in done.stderr
