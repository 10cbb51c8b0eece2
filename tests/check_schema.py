#!/usr/bin/env python3
"""Checks every scene of a folder against the JSON Schema that the program prints.

    check_schema.py CRT_PROGRAM CONFIG_DIR

The schema is for editors; this keeps it from refusing what the program accepts. A few broken scenes make
sure that it refuses anything at all. Needs python3-jsonschema and python3-yaml.
"""

import json
import pathlib
import re
import subprocess
import sys

import jsonschema
import yaml


class SceneLoader(yaml.SafeLoader):
    """YAML as crt reads it: the only booleans are true and false, and 1e3 is a number (PyYAML follows YAML
    1.1)."""

    yaml_implicit_resolvers = {}


SceneLoader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"^(true|false)$"), list("tf"))
SceneLoader.add_implicit_resolver(
    "tag:yaml.org,2002:null", re.compile(r"^(~|null|Null|NULL|)$"), ["~", "n", "N", ""]
)
SceneLoader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^[-+]?(0|[1-9][0-9]*)$"), list("-+0123456789")
)
SceneLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$"),
    list("-+.0123456789"),
)

BROKEN = {
    "unknown key": "{crt: 1, flim: {}}",
    "no version": "{title: x}",
    "other version": "{crt: 2}",
    "range": "{crt: 1, camera: {fov: 180}}",
    "type": "{crt: 1, integrator: {nee: yes}}",
    "choice": "{crt: 1, integrator: {type: pth}}",
    "list length": "{crt: 1, film: {resolution: [1]}}",
    "exclusive keys": "{crt: 1, camera: {fov: 1, focal_length: 1, sensor: [1, 1]}}",
    "companion key": "{crt: 1, camera: {focal_length: 1}}",
    "material": "{crt: 1, materials: {m: {type: diffuse, ior: 1}}}",
    "reflectance": "{crt: 1, materials: {m: {type: diffuse, reflectance: 2}}}",
    "spectrum": "{crt: 1, environment: {radiance: {rgb: [1, 1, 1], glass: SF10}}}",
    "spectrum name": "{crt: 1, spectra: {0.5: 1}}",
    "mesh and obj": "{crt: 1, objects: [{obj: a.obj, mesh: {positions: [], faces: []}}]}",
}
FINE = {
    "smallest": "{crt: 1}",
    "spectra": "{crt: 1, spectra: {a: 1e3, b: a, c: {table: {nm: [360, 830], value: [1, 2]}, outside: zero, "
               "scale: 2}}}",
    "nulls": "{crt: 1, environment: null, film: {crop: null, white_balance: null}}",
    "filter": "{crt: 1, film: {filter: {type: gaussian, sigma: 0.5}, white_balance: D65}}",
    "placements": "{crt: 1, objects: [{obj: a.obj, transforms: [[], [{scale: 2}, {scale: [1, 2, 3]}]]}]}",
}


def problems(validator, text):
    scene = yaml.load(text, Loader=SceneLoader)
    # JSON's keys are strings; names such as 1 are strings to crt too.
    scene = json.loads(json.dumps(scene))
    return sorted(validator.iter_errors(scene), key=lambda e: [str(p) for p in e.absolute_path])


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    schema = json.loads(
        subprocess.run([program, "schema"], check=True, capture_output=True, text=True).stdout
    )
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)

    failures = 0
    for name, text in BROKEN.items():
        if not problems(validator, text):
            print(f"the schema accepts a scene with a wrong {name}: {text}")
            failures += 1
    for name, text in FINE.items():
        for problem in problems(validator, text):
            print(f"the schema refuses a good scene ({name}): {problem.message}")
            failures += 1

    scenes = sorted(folder.glob("**/*.yaml"))
    for path in scenes:
        for problem in problems(validator, path.read_text(encoding="utf-8")):
            place = ".".join(str(p) for p in problem.absolute_path) or "the scene"
            print(f"{path}: {place}: {problem.message}")
            failures += 1
    if not scenes:
        print(f"there is no scene in {folder}")
        failures += 1
    print(f"{len(scenes)} scenes checked, {failures} problems")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
