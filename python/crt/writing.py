"""Scenes as YAML files, with the meshes and images that they name in a folder beside them."""

import json
import os
import pathlib
import re
import shutil
import tempfile

from .arrays import Arrays, plain
from .errors import Error, Kind

PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
# Words of YAML that are no text unless in quotes.
WORDS = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}
WIDTH = 100


def text_of(value):
    """YAML in flow style, on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{text_of(key)}: {text_of(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(text_of, value)) + "]"
    if isinstance(value, str):
        is_plain = PLAIN.fullmatch(value) and value.lower() not in WORDS
        return value if is_plain else json.dumps(value, ensure_ascii=False)
    if isinstance(value, float):
        return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
    return json.dumps(value)


def wrapped(text, indent):
    """Lines of at most WIDTH characters where flow style has a gap to break at."""
    lines, line = [], ""
    for part in re.findall(r'(?:"(?:[^"\\]|\\.)*"|[^" ])+ ?', text):
        if line and len(line) + len(part) > WIDTH - indent:
            lines.append(line.rstrip())
            line = ""
        line += part
    return ("\n" + " " * indent).join([*lines, line])


def yaml(content, remarks=()):
    """The text of a scene file. `remarks` are lines of comments after its first key."""
    lines = [f"crt: {content['crt']}", *(f"# {remark}" for remark in remarks)]
    for key, value in content.items():
        if key == "crt":
            continue
        if isinstance(value, dict) and key == "materials":
            lines += [f"{key}:", *(f"  {text_of(name)}: {wrapped(text_of(inner), 4)}"
                                   for name, inner in value.items())]
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            lines += [f"{key}:", *(f"  - {wrapped(text_of(inner), 4)}" for inner in value)]
        else:
            lines.append(f"{key}: {wrapped(text_of(value), 2)}")
    return "\n".join(lines) + "\n"


def relative(value, folder):
    """A copy of `value` with paths as texts: relative to `folder`."""
    if isinstance(value, pathlib.Path):
        # Of real paths: ".." behind a symbolic link leads elsewhere.
        return os.path.relpath(os.path.realpath(value), os.path.realpath(folder))
    if isinstance(value, dict):
        return {key: relative(inner, folder) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [relative(inner, folder) for inner in value]
    return value


def renamed(value, before, after):
    """A copy of `value` in which names of files in the folder `before` are names in `after`."""
    if isinstance(value, dict):
        return {key: renamed(inner, before, after) for key, inner in value.items()}
    if isinstance(value, list):
        return [renamed(inner, before, after) for inner in value]
    if isinstance(value, str) and value.startswith(before + os.sep):
        return after + "/" + value[len(before) + 1:]
    return value


def has_image(value):
    """Does `value` hold an image as an array?"""
    if isinstance(value, dict):
        return any(key in ("texture", "image") and hasattr(inner, "dtype") or has_image(inner)
                   for key, inner in value.items())
    return isinstance(value, list) and any(map(has_image, value))


def to_text(content, remarks):
    """The scene with its meshes written out, for where there is no folder to put files into."""
    content = relative(content, pathlib.Path.cwd())
    if has_image(content):
        raise Error("the scene holds images, which crt reads from separate files: write the scene to a "
                    "file (crt import: -o FILE; Python: scene.save)", Kind.USAGE)
    return yaml(plain(content), remarks)


def refuse_over_inputs(path, beside, inputs):
    """Raises crt.Error where the scene would replace one of the files `inputs`, or its folder one in it."""
    for name in inputs:
        if path.exists() and os.path.exists(name) and os.path.samefile(path, name):
            same = os.fspath(path) == name
            raise Error(f"the output '{path}' would replace " + ("an input file" if same else
                        f"the input '{name}': they are the same file"), Kind.USAGE)
        if beside.resolve() in pathlib.Path(name).resolve().parents:
            raise Error(f"the folder '{beside}' of the output would replace the input '{name}'", Kind.USAGE)


def to_file(content, remarks, path, overwrite, inputs=()):
    """Writes the scene, and larger meshes and images to the folder NAME.meshes beside it. Each appears
    complete or not at all. Raises crt.Error of kind USAGE where there is something already, or where one of
    the files `inputs` would be replaced; of kind OUTPUT where it cannot be written."""
    path = pathlib.Path(path)
    beside = path.with_name(path.stem + ".meshes")
    refuse_over_inputs(path, beside, inputs)
    for there in (path, beside):
        if there.exists() and not overwrite:
            raise Error(f"'{there}' exists and may have been edited by hand; --overwrite (Python: "
                        "overwrite=True) replaces it", Kind.USAGE)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=path.parent) as folder:
            files, scene = pathlib.Path(folder, "files"), pathlib.Path(folder, "scene")
            files.mkdir()
            # Arrays tells meshes apart by their identity: no copies of them before.
            written = relative(Arrays(files).written(content), path.parent)
            written = renamed(plain(written), str(files), beside.name)
            scene.write_text(yaml(written, remarks), encoding="utf-8")
            if beside.exists():
                shutil.move(beside, pathlib.Path(folder, "before"))
            if any(files.iterdir()):
                os.replace(files, beside)
            os.replace(scene, path)
    except OSError as error:
        raise Error(f"'{path}' cannot be written: {error.strerror or error}", Kind.OUTPUT) from None
