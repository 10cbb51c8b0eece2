"""A scene of crt as one map: what it includes merged in, named data that are files as tables. The rules are
those of docs/scene.md, "Shared parts" and "Named data"."""

import csv
import pathlib

import yaml

from .program import Failure


# Of a section, keys that exclude one another: with them go those that belong to them.
EXCLUSIVE = {"environment": [{"radiance"}, {"image", "scale", "rotation_deg", "up"}, {"sky"}]}


def without_excluded(section, below, above):
    """The rest of an included section next to keys of the including one."""
    gone = set()
    for form in EXCLUSIVE.get(section, []):
        if form & above.keys():
            gone |= set().union(*(other for other in EXCLUSIVE[section] if other is not form))
    return {key: value for key, value in below.items() if key not in gone}


def merged(below, above):
    """Sections, spectra and materials key by key, objects one after the other, everything else that of
    `above`."""
    scene = {**below, **above}
    for key in below.keys() & above.keys():
        if isinstance(below[key], dict) and isinstance(above[key], dict):
            scene[key] = {**without_excluded(key, below[key], above[key]), **above[key]}
        elif key in ("objects", "lights"):
            scene[key] = below[key] + above[key]
    return scene


def with_includes(file):
    own = yaml.safe_load(file.read_text())
    names = own.pop("include", [])
    scene = {}
    for name in [names] if isinstance(names, str) else names:
        scene = merged(scene, with_includes(file.parent / name))
    return merged(scene, own)


def named_table(repository, name):
    """The table of a file in data/, in the form that a scene could hold instead."""
    file = repository / "data" / f"{name}.csv"
    if not file.exists():
        raise Failure(f"there is no {file}: only data that are files are translated for other renderers")
    lines = file.read_text().splitlines()
    outside = next(line.split(": ")[1] for line in lines if line.startswith("# outside: "))
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))[1:]
    return {
        "table": {"nm": [float(row[0]) for row in rows], "value": [float(row[1]) for row in rows]},
        "outside": outside,
    }


def load(file):
    file = pathlib.Path(file).resolve()
    scene = with_includes(file)
    repository = pathlib.Path(__file__).resolve().parents[2]
    for name, spectrum in scene.get("spectra", {}).items():
        if isinstance(spectrum, dict) and set(spectrum) == {"data"}:
            scene["spectra"][name] = named_table(repository, spectrum["data"])
    return scene
