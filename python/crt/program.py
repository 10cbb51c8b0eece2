"""The program `crt` that lies beside this package: what libcrt does not do is asked of it."""

import os
import pathlib
import re
import signal
import subprocess

from .errors import Error, Kind
from .messages import LOGGER

LEVELS = ("error", "warning", "info", "debug")


def path():
    """The path of the program: in a wheel in the package, in a build tree beside it. CRT_PROGRAM names
    another. Raises crt.Error of kind USAGE where there is none."""
    here = pathlib.Path(__file__).parent
    named = os.environ.get("CRT_PROGRAM")
    for place in [pathlib.Path(named)] if named else [here / "_tree/bin/crt", here.parents[1] / "bin/crt"]:
        if os.access(place, os.X_OK):
            return place
    raise Error(f"the program crt is missing: {place}", Kind.USAGE)


def file_argument(path):
    """The name of a file as an argument: one that begins with "-" would be an option."""
    name = os.fspath(path)
    return f"./{name}" if name.startswith("-") else name


def run(arguments, *, answers=(0,)):
    """Runs `crt ARGUMENTS` and returns its exit code and what it printed. Codes beside `answers` raise
crt.Error with the program's own sentences. Its messages go to the logger `crt`. Ctrl-C ends
    it as it does in a terminal, and is raised once it has written what it has."""
    process = subprocess.Popen([path(), *map(str, arguments)], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8",
                               errors="replace", start_new_session=True)
    try:
        printed, said = process.communicate()
    except BaseException:
        process.send_signal(signal.SIGINT)
        process.communicate()
        raise
    errors = tell_lines(said)
    if process.returncode not in answers:
        kind = Kind(process.returncode) if process.returncode in set(Kind) else Kind.INTERNAL
        sentence = "\n".join(errors) or f"crt ended with code {process.returncode}"
        raise Error(sentence, kind, *place_in(sentence))
    return process.returncode, printed


def place_in(sentence):
    """File, line and column of the first error that has them, as crt.Error takes them."""
    found = re.search(r"^(.+?):(\d+):(\d+): error: ", sentence, re.MULTILINE)
    return (found[1], int(found[2]), int(found[3])) if found else ("", 0, 0)


def tell_lines(said):
    """Lines of stderr to the logger; returns the sentences of errors."""
    errors = []
    for line in said.splitlines():
        level, _, text = line.removeprefix("crt: ").partition(": ")
        if line.startswith("crt: error: "):
            errors.append(text)
        elif line.startswith("crt: ") and level in LEVELS:
            getattr(LOGGER, level)("%s", text)
        elif errors:
            errors[-1] += "\n" + line
    return errors
