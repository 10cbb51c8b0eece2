"""The command line of `python -m crt report`."""

import argparse
import os
import pathlib
import sys
import tempfile

from .files import Refused, read

USAGE = 2
OUTPUT = 6


def arguments_of(typed):
    parser = argparse.ArgumentParser(
        prog="python -m crt report",
        description="Makes the page of a folder that 'crt converge -o DIR' or 'crt verify -o DIR' has "
                    "written: report.html or verify.html in it. The page is one file without external "
                    "resources. Exit code 2: the folder has no such files, or they are damaged.")
    parser.add_argument("folder", metavar="DIR", type=pathlib.Path, help="the folder of the run")
    parser.add_argument("-o", "--output", metavar="FILE", type=pathlib.Path,
                        help="the page to write, instead of one in DIR")
    parser.add_argument("--figures", metavar="FOLDER", type=pathlib.Path,
                        help="also write every figure there, as separate SVG files")
    return parser.parse_args(typed)


def write_whole(path, text):
    """All of a file or none of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)  # mkstemp makes the file unreadable for other users.
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def page_of(run):
    """(page, figures): the HTML of a run, and its Figures. Raises Refused."""
    try:
        from . import converge, verify
    except ImportError as missing:
        raise Refused(f"pages need the library {missing.name}, which is not installed: "
                      "pip install jinja2 matplotlib (on Debian and Ubuntu: apt install python3-jinja2 "
                      "python3-matplotlib)") from None
    try:
        return {"converge": converge, "verify": verify}[run.kind].page(run)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, ZeroDivisionError) as wrong:
        raise Refused(f"'{run.path}' is damaged, or of another version of crt: "
                      f"{type(wrong).__name__}: {wrong}") from wrong


def make(folder, output=None, figures=None):
    """Writes the pages of a folder and returns their paths: report.html of a convergence run, verify.html of
    a verification. `output` is the path of the page instead; `figures` is a folder that gets every figure as
    SVG. Raises Refused where the folder has no run, or a damaged one, and OSError where nothing can be
    written; then no page was begun."""
    runs = read(folder)
    if output is not None and len(runs) > 1:
        raise Refused(f"'{folder}' holds both a convergence run and a verification, which are two pages: "
                      "leave -o out")
    made = [(output or folder / run.page_name, *page_of(run)) for run in runs]
    for path, html, drawn in made:
        if path.exists() and any(path.samefile(run.path) for run in runs):
            raise Refused(f"'{path}' is an input of the page: choose another file")
        write_whole(path, html)
        for figure in drawn if figures else ():
            write_whole(figures / f"{figure.name}.svg", figure.file)
    return [path for path, _, _ in made]


def main(arguments):
    """Runs the command and returns its exit code."""
    asked = arguments_of(arguments)
    try:
        for path in make(asked.folder, asked.output, asked.figures):
            print(f"wrote {path}")
    except Refused as refused:
        print(f"crt: error: {refused}", file=sys.stderr)
        return USAGE
    except OSError as failed:
        print(f"crt: error: cannot write '{failed.filename}': {failed.strerror}", file=sys.stderr)
        return OUTPUT
    return 0
