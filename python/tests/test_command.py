"""`python -m crt`: the program, with the commands that are written in Python."""

import subprocess
import sys


def test_what_is_not_written_in_python_is_the_program(program):
    done = subprocess.run([sys.executable, "-m", "crt", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, program("--version"))
    done = subprocess.run([sys.executable, "-m", "crt", "nosuch.yaml"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 3 and "nosuch.yaml" in done.stderr


def test_without_its_program_it_says_so(monkeypatch):
    monkeypatch.setenv("CRT_PROGRAM", "/nowhere/crt")
    done = subprocess.run([sys.executable, "-m", "crt", "a.yaml"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "/nowhere/crt" in done.stderr
