"""Reads the files of a run and checks their format."""

import base64
import dataclasses
import json
import pathlib

# File: kind of run, its format, and the page made of it.
KINDS = {"summary.json": ("converge", "crt converge summary 1", "report.html"),
         "verify.json": ("verify", "crt verify 1", "verify.html")}
PNG = b"\x89PNG\r\n\x1a\n"


class Refused(Exception):
    """A folder of which no page can be made, in a sentence."""


@dataclasses.dataclass
class Run:
    """One run: `kind` is "converge" or "verify", `data` the JSON of `path`."""

    kind: str
    path: pathlib.Path
    page_name: str
    data: dict

    def picture(self, name):
        """A PNG of the run as a data URI. Raises Refused."""
        path = self.path.parent / name
        if pathlib.PurePath(name).name != name:
            raise Refused(f"'{self.path}' names a picture outside its folder: '{name}'")
        try:
            bytes_of = path.read_bytes()
        except OSError as failed:
            raise Refused(f"cannot read '{path}': {failed.strerror}") from None
        if not bytes_of.startswith(PNG):
            raise Refused(f"'{path}' is not a PNG picture")
        return "data:image/png;base64," + base64.b64encode(bytes_of).decode("ascii")


def read(folder):
    """The runs in a folder, one or two. Raises Refused."""
    folder = pathlib.Path(folder)
    if not folder.is_dir():
        raise Refused(f"'{folder}' is not a folder")
    runs = [read_file(folder / name) for name in KINDS if (folder / name).exists()]
    if not runs:
        raise Refused(f"'{folder}' holds no run of crt: it has neither summary.json of "
                      "'crt converge -o DIR' nor verify.json of 'crt verify -o DIR'")
    return runs


def read_file(path):
    kind, known, page_name = KINDS[path.name]
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as failed:
        raise Refused(f"cannot read '{path}': {failed.strerror}") from None
    except json.JSONDecodeError as wrong:
        raise Refused(f"{path}:{wrong.lineno}:{wrong.colno}: this is not JSON: {wrong.msg}") from None
    except (UnicodeDecodeError, RecursionError) as wrong:
        raise Refused(f"'{path}' is not JSON: {wrong}") from None
    found = data.get("format") if isinstance(data, dict) else None
    if found != known:
        raise Refused(f"'{path}' has the format {json.dumps(found)}; this crt reads {json.dumps(known)}: "
                      f"run 'crt {kind}' again")
    return Run(kind, path, page_name, data)
