#!/usr/bin/env python3
"""Inputs and faults that must not be able to harm crt, each with its outcome. Always the same
demand: an exit code of the documented ones and the right one, a message that says why, no crash, no hang, no
memory that the input does not account for, and every file that was there still there.

    test_hostile.py CRT FAKE_PLUGIN_DIR [--write docs/results/robustness.md] [--only TEXT] [--slower FACTOR]

The inputs are made here. Python's standard library only.

Over 450 lines: one list of inputs.
"""

import argparse
import concurrent.futures
import hashlib
import os
import pathlib
import resource
import shutil
import signal
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import threading
import time
import zlib

import harness
import hostile_models
import hostile_values
import hostile_work

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))
sys.dont_write_bytecode = True
from crtbench import section  # noqa: E402

SECONDS = 10            # Of processor time; longer is a hang.
WAIT_SECONDS = 600      # In all: waiting for a pipe takes no processor time. Only ends hangs.
MEMORY_BYTES = 2 << 30  # More is an input that eats memory: none here has 10 MB.

ROOT = os.geteuid() == 0

HEAD = "crt: 1\nfilm: {resolution: [8, 8]}\nsampler: {samples: 2}\n"
MATERIALS = "materials: {m: {type: diffuse, reflectance: 0.5}}\n"
TRIANGLE = "mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}"
LIT = "emission: {radiance: 1}"
GOOD = HEAD + MATERIALS + f"objects: [{{{TRIANGLE}, material: m, {LIT}}}]\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


class Case:
    """One line of the table: what is asked, and what must happen."""

    def __init__(
        self,
        group,
        asked,
        arguments,
        codes,
        words=(),
        prepare=None,
        env=None,
        changed=(),
        made=(),
        after=None,
        **how,
    ):
        self.group, self.asked, self.arguments = group, asked, arguments
        self.codes = codes if isinstance(codes, tuple) else (codes,)
        self.words = (words,) if isinstance(words, str) else words  # All of a tuple, any of a set.
        self.prepare, self.env = prepare, env or {}
        self.changed = set(changed)  # Files that were there and may differ afterwards.
        self.made = tuple(made)      # Files that must be there afterwards.
        self.after = after           # Asked of the folder afterwards; says what is wrong, or nothing.
        self.how = how  # stdout, stderr, stdin: where to; limits; send: a signal after rendering has begun.


class Folder:
    """The folder of one case."""

    def __init__(self, path):
        self.path = path

    def __truediv__(self, name):
        return os.path.join(self.path, name)

    def write(self, name, data):
        path = self / name
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
        return path

    def state(self):
        """Every file, folder and link below, with what it holds."""
        found = {}
        for folder, folders, files in os.walk(self.path):
            for name in folders + files:
                path = os.path.join(folder, name)
                status = os.lstat(path)
                if stat.S_ISREG(status.st_mode):
                    # Sparse files of a terabyte are known by their size.
                    with open(path, "rb") as file:
                        content = hashlib.sha1(file.read(1 << 24)).hexdigest()
                    found[os.path.relpath(path, self.path)] = (status.st_size, content)
                elif stat.S_ISLNK(status.st_mode):
                    found[os.path.relpath(path, self.path)] = ("link", os.readlink(path))
                else:
                    found[os.path.relpath(path, self.path)] = stat.S_IFMT(status.st_mode)
        return found


CASES = []


def case(*arguments, **options):
    CASES.append(Case(*arguments, **options))


# -----------------------------------------------------------------------------------------------------------
# scenes

def scene_cases():
    """Texts that make a careless reader crash, hang or fill memory. The words and the place of each plain
    refusal are checked by tests/unit_scene_refused.cpp."""

    def scene(asked, text, codes=3, words=(), files=None, arguments=("info", "scene.yaml"), **options):
        def prepare(folder):
            folder.write("scene.yaml", text)
            for name, data in (files or {}).items():
                folder.write(name, data)
        case("scene", asked, list(arguments), codes, words, prepare, **options)

    def key(asked, line, words=(), codes=3, **options):
        scene(asked, HEAD + line + "\n", codes, words, **options)

    def shape(asked, mesh, words=(), codes=3, extra="", **options):
        scene(
            asked,
            HEAD + MATERIALS + f"objects: [{{mesh: {mesh}, material: m{extra}}}]\n",
            codes,
            words,
            **options,
        )

    def spectrum(asked, text, words=(), codes=3, **options):
        scene(
            asked,
            HEAD
            + f"materials: {{m: {{type: diffuse, reflectance: {text}}}}}\nobjects: [{{{TRIANGLE}, material: "
              f"m}}]\n",
            codes,
            words,
            **options,
        )

    scene("a byte-order mark alone", "\ufeff", words="there is nothing in this file")
    scene("an overlong UTF-8 sequence", b"crt: 1\ntitle: \xc0\xaf\n", words="byte 0xc0")
    scene(
        "64 kB of noise",
        bytes(hashlib.sha512(str(i).encode()).digest()[0] for i in range(65536)),
        words="is not text",
    )
    scene("an escape sequence for terminals", "crt: 1\ntitle: \x1b[2J\n", words="byte 0x1b")
    scene("an open quote", HEAD + 'title: "no end', words="not valid YAML")
    scene(
        "a billion laughs",
        HEAD
        + "spectra:\n  a0: &a0 [1,1,1,1,1,1,1,1,1,1]\n"
        + "".join(f"  a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)),
        words=("aliases", "CRT_SCENE_MEMORY="),
    )
    scene("brackets 10,000 deep", HEAD + "objects: " + "[" * 10000, words="deep")
    scene("maps 10,000 deep", HEAD + "camera: " + "{a: " * 10000, words="deep")
    scene("a line of a megabyte", HEAD + "title: " + "x" * 1000000 + "\n", 0)
    scene("a key of a megabyte", HEAD + "x" * 1000000 + ": 1\n", words={"unknown key", "not valid YAML"})
    scene("50,000 unknown keys", HEAD + "".join(f"k{i}: 1\n" for i in range(50000)), words="more errors")
    scene("a number", "42\n", words="expected a map")
    key("a number that is none", "camera: {fov: nan}", "NaN")
    for text, word in (
        ("{type: rough_dielectric, ior: 1.5, roughness: 1.5}", "'roughness'"),
        ("{type: rough_dielectric, ior: 1.5, roughness: -0.1}", "'roughness'"),
        ("{type: rough_dielectric, ior: 1.5, roughness: nan}", "NaN"),
        ("{type: rough_dielectric, ior: 1e9, roughness: 0.5}", "'ior'"),
        ("{type: dielectric, ior: 1.5, absorption: {table: {nm: [360, 830], value: [1, -1]}}}",
         "'absorption'"),
        ("{type: dielectric, ior: 1.5, absorption: 1e300}", "'absorption'"),
        ("{type: thin_dielectric, ior: 0}", "'ior'"),
        ("{type: plastic, reflectance: 2}", "'reflectance'"),
        ("{type: mirror, reflectance: 1, opacity: 1.5}", "'opacity'"),
        ("{type: mirror, reflectance: 1, opacity: nan}", "NaN"),
        ("{type: mirror, reflectance: 1, opacity: {texture: /nowhere.png}}", "/nowhere.png"),
        ("{type: dielectric, ior: 1.5, absorption: 1, opacity: 0.5}", "closed"),
        ("{type: mix, materials: [m, m]}", "made of itself"),
        ("{type: mix, materials: [m]}", "two materials, not 1"),
        ("{type: mix, materials: m}", "expected a list"),
        ("{type: mix, materials: [nothing, m]}", "no material 'nothing'"),
        ("{type: mix, materials: [m, m], amount: -1}", "'amount'"),
        ("{type: two_sided, front: m, back: m}", "made of itself"),
        ("{type: two_sided, front: m}", "'back' is missing"),
        ("{type: mirror, reflectance: 1, normal_map: {texture: /nowhere.png}}", "/nowhere.png"),
        ("{type: mirror, reflectance: 1, normal_map: {strength: 2}}", "'texture' is missing"),
        ("{type: mirror, reflectance: 1, normal_map: {texture: a.png, strength: -1}}", "'strength'"),
        ("{type: mirror, reflectance: 1, normal_map: a.png}", "expected"),
        ("{type: plastic, reflectance: 0.5, ior: 0}", "'ior'"),
        ("{type: dielectric, ior: 1.5, thin_film: {thickness_nm: -1, ior: 1.3}}", "'thickness_nm'"),
        ("{type: dielectric, ior: 1.5, thin_film: {thickness_nm: 1e9, ior: 1.3}}", "'thickness_nm'"),
        ("{type: dielectric, ior: 1.5, thin_film: {thickness_nm: 300, ior: 0}}", "'ior'"),
        ("{type: dielectric, ior: 1.5, thin_film: 300}", "expected a map"),
        ("{type: openpbr, coat_weight: nan}", "NaN"),
        ("{type: openpbr, coat_weight: 1, coat_ior: 1e3}", "an index of 1 to 10"),
        ("{type: openpbr, coat_weight: 1, coat_color: -1}", "'coat_color'"),
        ("{type: openpbr, coat_weight: 1, coat_darkening: .inf}", "'coat_darkening'"),
        ("{type: openpbr, coat_weight: 1, transmission_weight: 1e-9}", "opaque"),
        ("{type: openpbr, emission_luminance: .inf}", "'emission_luminance'"),
        ("{type: openpbr, fuzz_roughness: 1.01}", "'fuzz_roughness'"),
        ("{type: diffuse, reflectance: 1, roughness: -0.1}", "'roughness'"),
        ("{type: openpbr, base_metalness: 2}", "'base_metalness'"),
        ("{type: openpbr, base_color: {texture: /nowhere.png}}", "/nowhere.png"),
        ("{type: openpbr, specular_weight: 1e300}", "must be 1 to 10"),
        ("{type: rough_conductor, metal: Al, roughness: 1, roughness_anisotropy: 1.01}",
         "'roughness_anisotropy'"),
        ("{type: rough_conductor, metal: Al, roughness: 1, anisotropy_rotation_deg: .inf}",
         "'anisotropy_rotation_deg'"),
    ):
        key(f"the material {text}", f"materials: {{m: {text}}}", word)
    for text in (
        "{type: rough_dielectric, ior: 1.0000001, roughness: 1}",
        "{type: rough_dielectric, ior: 1000, roughness: 1}",
        "{type: rough_dielectric, ior: 0.001, roughness: 0.04}",
        "{type: dielectric, ior: 1.5, absorption: 1e25}",
        "{type: plastic, reflectance: 1, ior: 10, roughness: 1}",
        "{type: rough_dielectric, ior: 0.001, roughness: 1, thin_film: {thickness_nm: 20000, ior: 10}}",
        "{type: dielectric, ior: 1000, thin_film: {thickness_nm: 1e-30, ior: 0.1}}",
        "{type: rough_conductor, eta: 1, k: 0, roughness: 1, thin_film: {thickness_nm: 99, ior: 1}}",
        "{type: openpbr, transmission_weight: 1, transmission_dispersion_scale: 1}",
        "{type: openpbr, base_metalness: 1, base_color: 0, specular_color: 0, specular_roughness: 1}",
        "{type: openpbr, fuzz_weight: 1, fuzz_roughness: 0, fuzz_color: 0, base_diffuse_roughness: 1e-6}",
        "{type: openpbr, coat_weight: 1, coat_color: 0, coat_ior: 1, coat_roughness: 1}",
        "{type: openpbr, coat_weight: 1, coat_ior: 10, coat_roughness: 1e-300, base_metalness: 1}",
        "{type: openpbr, coat_weight: 1e-300, coat_ior: 1.5, coat_roughness: 0.04, base_color: 0}",
        "{type: openpbr, coat_weight: 1, base_metalness: 1, base_color: 1, specular_roughness: 0}",
        "{type: diffuse, reflectance: 1, roughness: 1e-300}",
        "{type: openpbr, base_diffuse_roughness: 1, specular_ior: 9.5, specular_roughness: 1}",
        "{type: rough_conductor, eta: 1, k: 9, roughness: 0.04, roughness_anisotropy: 1}",
        "{type: rough_dielectric, ior: 1.000001, roughness: 1, roughness_anisotropy: 1}",
    ):
        spectrum_of = f"materials: {{m: {text}}}\nobjects: [{{{TRIANGLE}, material: m}}]\n"
        scene(f"the material {text}", HEAD + spectrum_of, 0)
    for size, word in (
        ("[-8, 8]", "must be"),
        ("[8]", "a list of 2"),
        ("[8, 8, 8]", "a list of 2"),
        ("[1e9, 1]", "must be"),
        ("[8.5, 8]", "whole"),
    ):
        scene(f"a film of {size}", f"crt: 1\nfilm: {{resolution: {size}}}\n", words=word)
    scene(
        "a film of 40000 × 40000 pixels, rendered",
        "crt: 1\nfilm: {resolution: [40000, 40000]}\nenvironment: {radiance: 1}\n",
        5,
        "memory",
        arguments=("scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "1"),
        limits={resource.RLIMIT_AS: 4 << 30},
    )
    crop = "[5, 0, 4, 8]"
    scene(f"a crop of {crop}", f"crt: 1\nfilm: {{resolution: [8, 8], crop: {crop}}}\n", words="window")
    key("a field of view of -10", "camera: {fov: -10}", "fov")
    key("a camera at 1e300", "camera: {position: [1e300, 0, 0]}", codes=(0, 3))
    for name, value in (
        ("samples", -1),
        ("samples", "1e30"),
        ("replicates", 3),
        ("type", "halton"),
    ):
        scene(
            f"sampler.{name}: {value}",
            f"crt: 1\nsampler: {{{name}: {value}}}\n",
            words={"must be", "are not available", "whole number", "expected"},
        )
    key("objects that are no list", "objects: 7", "expected a list")
    key("an object that is no map", "objects: [7]", "expected a map")
    shape("a mesh without faces", "{positions: [[0,0,0]]}", "'faces' is missing")
    shape(
        "an index of 2^40",
        "{positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,1099511627776]]}",
        {"must be", "there are only"},
    )
    shape("an index of 1.5", "{positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,1.5]]}", "whole")
    shape("a face without area", "{positions: [[0,0,0],[1,0,0],[2,0,0]], faces: [[0,1,2]]}", codes=(0, 3))
    shape(
        "coordinates of 1e308",
        "{positions: [[1e308,0,0],[-1e308,0,0],[0,1e308,0]], faces: [[0,1,2]]}",
        codes=(0, 3),
    )
    shape(
        "coordinates of 1e-308",
        "{positions: [[1e-308,0,0],[0,0,0],[0,1e-308,0]], faces: [[0,1,2]]}",
        codes=(0, 3),
    )
    shape(
        "a normal of no length",
        "{positions: [[0,0,0],[1,0,0],[0,1,0]], normals: [[0,0,0],[0,0,1],[0,0,1]], faces: [[0,1,2]]}",
        "length 0",
    )
    scene("a spectrum that is itself", HEAD + "spectra: {a: a}\n", words="defined by itself")
    scene("spectra in a circle", HEAD + "spectra: {a: b, b: c, c: a}\n", words="defined by itself")
    for text, word in (
        ("{rgb: [1, 1]}", "3 numbers"),
        ("{rgb: [nan, 0, 0]}", "NaN"),
        ("{table: {nm: [], value: []}}", "a list"),
        ("{blackbody: -5}", "must be"),
        ("{blackbody: 1e300}", "must be"),
        ("{glass: sand}", "expected"),
        ("{}", "empty map"),
        ("{ref: nobody}", "there is no spectrum"),
    ):
        spectrum(f"a reflectance of {text}", text, word)
    for text in ("1e26", "1e38", "1e308", "{blackbody: 6000, scale: 1e30}"):
        scene(
            f"a radiance of {text}",
            HEAD + f"environment: {{radiance: {text}}}\n",
            words="must be 0 to 1e+25",
        )
    scene(
        "no light but one of radiance 1e-50",
        HEAD + "environment: {radiance: 1e-50}\n",
        words="the smallest value in single precision is 1e-25",
    )
    for text, words in (
        ("spectral: 7", "expected a map"),
        ("spectral: {}", "'from_nm' is missing"),
        ("spectral: {from_nm: 400, to_nm: 700, bins: 1e9}", "1 to 1024"),
        ("spectral: {from_nm: 400, to_nm: 700, bins: 2.5}", "whole number"),
        ("spectral: {from_nm: nan, to_nm: 700, bins: 3}", "NaN"),
        ("spectral: {from_nm: 700, to_nm: 400, bins: 3}", "exchange 'from_nm' and 'to_nm'"),
        ("spectral: {from_nm: 500, to_nm: 500.05, bins: 1}", "narrower than 0.1 nm"),
        ("responses: {a: 0}", "0 at all wavelengths"),
        ("responses: {a: -1}", "must be"),
        ("responses: {a: {file: missing.csv}}", "missing.csv"),
        ("responses: {'../a': 1}", "letters, digits"),
        ("responses: 3", "expected a map"),
    ):
        film = HEAD.replace("resolution: [8, 8]", "resolution: [8, 8], " + text)
        scene(f"film: {{{text}}}", GOOD.replace(HEAD, film), words=words)
    bulb = "{type: point, position: [0, 0, 1], power_w: 1}"
    for text, words in (
        ("7", "expected a list"),
        ("[7]", "expected a map"),
        ("[{}]", "'type' is missing"),
        ("[{type: laser}]", "expected one of"),
        ("[{type: point, position: [0, 0, 1]}]", "needs radiant_intensity or"),
        ("[{type: point, position: [0, 0, nan], power_w: 1}]", "NaN"),
        ("[{type: point, position: [0, 0, 1], power_w: -1}]", "must be 0 or more"),
        ("[{type: point, position: [0, 0, 1], power_w: 1e300}]", "the largest value in single precision is"),
        ("[{type: point, position: [0, 0, 1], power_w: 1, spectrum: 0}]", "no light that 'power_w'"),
        ("[{type: spot, position: [0, 0, 1], power_w: 1}]", "needs direction or target"),
        ("[{type: spot, position: [0, 0, 1], power_w: 1, target: [0, 0, 1]}]", "where the light is"),
        ("[{type: directional, direction: [0, 0, 0], irradiance: 1}]", "length 0"),
        ("[{type: sun, direction: [0, -1, 0], radiance: 1, angular_diameter_deg: 400}]", "must be"),
        (f"[{bulb}]\nintegrator: {{nee: false}}", "only light sampling finds light 0"),
    ):
        scene(f"lights: {text}".replace("\n", ", "), GOOD + f"lights: {text}\n", words=words)
    ies = "IESNA91\nTILT=NONE\n1 1 1 2 1 1 1 0 0 0\n1 1 1\n0 90\n0\n2 1\n"
    for asked, data, words in (
        ("an empty IES file", "", "the line 'TILT=' is missing"),
        ("an IES file that is a picture", "\x89PNG" * 99, "the line 'TILT=' is missing"),
        ("an IES file cut short", ies[:-4], ("lamp.ies:6", "the file ends where")),
        ("an IES file of a thousand million values", ies.replace("2 1 1 1", "9999 9999 1 1"), "too short"),
        ("an IES file with a negative count", ies.replace("2 1 1 1", "-2 1 1 1"), "whole number"),
        ("an IES file of type B", ies.replace("2 1 1 1", "2 1 2 1"), "type B"),
        ("an IES file with angles that fall", ies.replace("0 90", "90 0"), ("lamp.ies:5", "must increase")),
        ("an IES file with an infinite candela", ies.replace("2 1\n", "2 inf\n"), "found 'inf'"),
        ("an IES file without light", ies.replace("0\n2 1\n", "0\n0 0\n"), "no light in any direction"),
    ):
        scene(
            asked,
            GOOD + "lights: [{type: ies, position: [0, 0, 1], file: lamp.ies}]\n",
            words=words,
            files={"lamp.ies": data.encode("latin-1")},
        )
    for light, words in (
        ("{type: ies, position: [0, 0, 1]}", "'file' is missing"),
        ("{type: ies, position: [0, 0, 1], file: missing.ies}", "missing.ies"),
        ("{type: ies, position: [0, 0, 1], file: .}", "directory"),
        ("{type: beam, position: [0, 0, 1], direction: [0, 0, -1], irradiance: 1}", "needs radius or size"),
        ("{type: beam, position: [0, 0, 1], direction: [0, 0, -1], radius: 1e30, irradiance: 1}", "wide"),
        ("{type: beam, position: [0, 0, 1], direction: [0, 0, -1], size: [1, 0], power_w: 1}", "above 0"),
        ("{type: beam, position: [0, 0, 1], direction: [0, 0, 0], radius: 1, power_w: 1}", "length 0"),
    ):
        scene(f"lights: [{light}]", GOOD + f"lights: [{light}]\n", words=words)
    scene(
        "a light at 1e30 scene units",
        GOOD + f"lights: [{bulb.replace('[0, 0, 1]', '[1e30, 0, 0]')}]\n",
        words="too far from the scene for single precision",
    )

    def pfm(width, height, *values):
        return f"PF\n{width} {height}\n-1.0\n".encode() + struct.pack(f"<{len(values)}f", *values)

    def around(asked, data, words, name="sky.pfm"):
        scene(asked, GOOD + f"environment: {{image: {name}}}\n", words=words, files={name: data})

    one = [1.0] * 6
    around("a sky with a negative texel", pfm(2, 1, *one[:5], -1.0), ("not negative", "pixel (1, 0)"))
    around("a sky with a NaN", pfm(2, 1, *one[:5], float("nan")), ("is a number", "pixel (1, 0)"))
    around("a sky with an infinite texel", pfm(2, 1, *one[:5], float("inf")), "light is finite")
    around("a sky that is too bright", pfm(2, 1, *one[:5], 1e30), "radiance goes up to 1e+25")
    around("a square sky", pfm(2, 2, *(one * 2)), "twice as wide as high")
    around("a sky cut short", pfm(200, 100, *one), "sky.pfm")
    around("a sky of 10^12 texels", pfm(2000000, 1000000, *one), "sky.pfm")
    around("a sky that is text", b"no image\n", "sky.pfm")
    around("an empty sky", b"", "sky.exr", "sky.exr")
    around("an EXR cut short", b"v/1\x01\x02\0\0\0channels\0", "sky.exr", "sky.exr")
    for text, words in (
        ("{}", "needs radiance or image or sky"),
        ("{image: none.exr}", "cannot find"),
        ("{radiance: 1, rotation_deg: 3}", "exclude each other"),
        ("{sky: {type: 0, zenith_luminance_cd_m2: 1, direction: [0, -1, 0]}}", "must be 1 to 15"),
        ("{sky: {type: 1, zenith_luminance_cd_m2: 1, direction: [0, 1, 0]}}", "below the horizon"),
        ("{sky: {type: 1, zenith_luminance_cd_m2: 1}}", "needs direction or date"),
        ("{sky: {type: 1, zenith_luminance_cd_m2: 1, direction: [0, -1, 0], rows: 1e9}}", "must be"),
        ("{sky: {type: 1, zenith_luminance_cd_m2: 1e40, direction: [0, -1, 0]}}", "radiance goes up to"),
    ):
        scene(f"environment: {text}", GOOD + f"environment: {text}\n", words=words)
    placement = "[{translate: [1, 2, 3]}]"
    scene(
        "10,000 moved placements behind 1,000 aliases (44 kB)",
        HEAD
        + MATERIALS
        + f"objects:\n- &o {{{TRIANGLE}, material: m, transforms: [&p {placement}{', *p' * 9999}]}}\n"
        + "- *o\n" * 1000,
        words=("values behind aliases, which need", "CRT_SCENE_MEMORY="),
    )
    placement = "[]"  # A single value, so that there may be more of them.
    scene(
        "10,000 placements behind 1,000 aliases",
        HEAD
        + MATERIALS
        + f"objects:\n- &o {{{TRIANGLE}, material: m, transforms: [&p {placement}{', *p' * 9999}]}}\n"
        + "- *o\n" * 1000,
        words=("placements, which need", "CRT_SCENE_MEMORY="),
    )
    scene(
        "the same behind 500, allowed but for its triangles",
        HEAD
        + MATERIALS
        + f"objects:\n- &o {{{TRIANGLE}, material: m, transforms: [&p {placement}{', *p' * 9999}]}}\n"
        + "- *o\n" * 500,
        words=("triangles, which need", "CRT_SCENE_MEMORY="),
    )
    scene(
        "a face of 5,000 corners behind 20,000 aliases (167 kB)",
        HEAD
        + MATERIALS
        + "objects: [{material: m, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [&f ["
        + ",".join(["0,1,2"] * 1700)
        + "]"
        + ", *f" * 20000
        + "]}}]\n",
        words="CRT_SCENE_MEMORY=",
    )
    scene(
        "a hundred thousand spectra and materials",
        HEAD
        + "spectra:\n"
        + "".join(f"  s{i}: {i % 100 / 100}\n" for i in range(100000))
        + "materials:\n"
        + "".join(f"  m{i}: {{type: diffuse, reflectance: s{i}}}\n" for i in range(100000))
        + f"objects: [{{{TRIANGLE}, material: m7}}]\n",
        0,
    )
    scene(
        "ten thousand names misspelt among ten thousand",
        HEAD
        + "spectra:\n"
        + "".join(f"  spectrum{i}: 1\n" for i in range(10000))
        + "materials:\n"
        + "".join(f"  m{i}: {{type: diffuse, reflectance: spektrum{i}}}\n" for i in range(10000)),
        words=("there is no spectrum", "more errors"),
    )
    scene(
        "40,000 triangles on one spot",
        HEAD
        + MATERIALS
        + "objects: [{material: m, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: ["
        + ",".join(["[0,1,2]"] * 40000)
        + "]}}]\n",
        0,
    )
    scene(
        "40,000 lamps on one spot",
        HEAD
        + MATERIALS
        + "objects: [{material: m, emission: {radiance: 1}, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], "
          "faces: ["
        + ",".join(["[0,1,2]"] * 40000)
        + "]}}]\n",
        0,
    )
    for count in (65, 20000):
        chain = "".join(f"  s{i}: s{i - 1}\n" for i in range(1, count))
        for first, words in (("0.5", "in a chain of references to other "
                                     "spectra"), (f"s{count - 1}", ("spectr",))):
            scene(
                f"a chain of {count} spectra that begins with {first}",
                HEAD + f"spectra:\n  s0: {first}\n{chain}"
                + f"materials: {{m: {{type: diffuse, reflectance: s{count - 1}}}}}\n"
                + f"objects: [{{{TRIANGLE}, material: m}}]\n",
                words=words,
            )
    for asked, change, words in (
        ("a camera beyond single precision", "camera.position=[0,1,-4e37]", "too far"),
        ("a camera far beyond it", "camera.position=[1e38,1e38,-1e38]", "too far"),
        ("a lens beyond it", "camera.aperture_radius=1e38", "aperture"),
        ("a focus beyond it", "camera={position: [0,0,4], aperture_radius: 0.1, focus_distance: 1e39}",
         "focus"),
    ):
        scene(asked, GOOD, words=words,
              arguments=["scene.yaml", "-b", "fake", "--set", change, "-o", "a.pfm"])
    scene(
        "depths beyond single precision",
        GOOD.replace("[1,0,0],[0,1,0]", "[1e39,0,0],[0,1e39,0]")
        + "camera: {position: [0, 0, 4e39]}\noutputs: [{file: a.exr, aovs: [depth]}]\n",
        words="too large for single precision",
        arguments=("scene.yaml", "-b", "fake"),
    )
    scene("a path of 50,000 parts", GOOD, words="64 parts",
          arguments=["info", "scene.yaml", "--set", "a." * 50000 + "b=1"])
    scene(
        "20,000 outputs", HEAD + "outputs:\n" + "".join(f"- {{file: o{i}.pfm}}\n" for i in range(20000)), 0
    )

    for asked, name in (
        ("a folder", "folder"),
        ("a named pipe", "pipe"),
        ("/dev/zero", "/dev/zero"),
        ("/dev/urandom", "/dev/urandom"),
        ("/dev/full", "/dev/full"),
        ("a socket", "socket"),
        ("a sparse terabyte", "sparse"),
        ("nothing", "none.yaml"),
        ("a link to itself", "loop"),
        ("a name of 300 letters", "n" * 300),
        ("a file as a folder", "scene.yaml/x"),
    ):
        words = {
            "folder": "this is a directory",
            "pipe": "write '-' for standard input",
            "sparse": "the most for a file of this kind",
        }.get(name, ())
        case("scene", f"{asked} in place of the scene", ["info", name], 3, words, endless_files)
    case(
        "scene", "an endless standard input", ["info", "-"], 3, "more than 256 MiB", None, stdin="/dev/zero"
    )
    case("scene", "an empty standard input", ["info", "-"], 3, "there is nothing in this file", None)


def endless_files(folder):
    """A file of every kind that is none to read."""
    folder.write("scene.yaml", GOOD)
    os.mkdir(folder / "folder")
    os.mkfifo(folder / "pipe")
    os.symlink("loop", folder / "loop")
    os.symlink("/dev/zero", folder / "zero")
    os.symlink("/dev/urandom", folder / "noise")
    with open(folder / "sparse", "wb") as file:
        file.truncate(1 << 40)
    listener = socket.socket(socket.AF_UNIX)
    here = os.open(".", os.O_RDONLY)
    listener.bind(folder / "socket")
    listener.close()
    os.close(here)


# -----------------------------------------------------------------------------------------------------------
# meshes

def mesh_cases():
    def mesh(asked, text, codes=3, words=(), files=None, material="m", **options):
        def prepare(folder):
            folder.write(
                "scene.yaml", HEAD + MATERIALS + f"objects: [{{obj: mesh.obj, material: {material}}}]\n"
            )
            folder.write("mesh.obj", text)
            for name, data in (files or {}).items():
                folder.write(name, data)
        case("mesh", asked, ["info", "scene.yaml"], codes, words, prepare, **options)

    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    mesh("an empty OBJ", "", words="no faces")
    mesh("an OBJ without faces", corners, words="no faces")
    for face in (
        "f 0 1 2",
        "f 1 2 4",
        "f 1 2 -9",
        "f 1 2",
        "f 1.5 2 3",
        "f a b c",
        "f 1 2 99999999999999999999",
        "f 1/1/1/1 2 3",
        "f 1//9 2 3",
        "f 1 2 3 /",
    ):
        mesh(
            f"the face '{face}'",
            corners + face + "\n",
            (0, 3) if "//9" in face or face.endswith("/") or face.startswith("f 1/1/1/1") else 3,
        )
    for vertex in ("v 1 2", "v", "v nan 0 0", "v 1e999 0 0", "v inf 0 0", "v 1,5 0 0", "v a b c"):
        mesh(f"the vertex '{vertex}'", vertex + "\n" + OBJ, (0, 3))
    mesh("a normal of -1.#IND00", corners + "vn -1.#IND00 0 0\nf 1//1 2//1 3//1\n", (0, 3))
    mesh("a normal out of range", corners + "vn 0 0 1\nf 1//1 2//1 3//7\n", (0, 3))
    mesh("NULs", b"\0" * 4096, 3)
    mesh("a PNG", b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 16, 3)
    mesh("a PLY", "ply\nformat ascii 1.0\nelement vertex 3\n", 3)
    mesh("a GLB", b"glTF\x02\0\0\0" + b"\0" * 100, 3)
    mesh("a gzip file", b"\x1f\x8b\x08" + bytes(range(256)), 3)
    mesh("a line of a megabyte", corners + "#" + "x" * 1000000 + "\nf 1 2 3\n", 0)
    mesh("a megabyte of backslashes", corners + "\\" * 1000000 + "\n", (0, 3))
    mesh("300,000 joined lines", corners + "f 1 2 3 \\\n" + "\\\n" * 300000 + "\n", (0, 3))
    mesh("a face of 500,000 corners on three points", corners + "f" + " 1 2 3" * 166000 + "\n", (0, 3))
    mesh("100,000 groups", "".join(f"g g{i}\n" for i in range(100000)) + OBJ, 0)
    mesh("coordinates of 1e308", "v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\nf 1 2 3\n", (0, 3))
    mesh("lines that end in CR", OBJ.replace("\n", "\r"), 0)
    mesh("40,000 triangles on one spot", corners + "f 1 2 3\n" * 40000, 0)
    mesh(
        "a star of 40,000 corners",
        "".join(
            f"v {(1 if i % 2 else .5) * ((i / 20000) if i < 20000 else 2 - i / 20000):.6f} {i % 2} "
            f"{(i * 7919 % 40000) / 4e7:.7f}\n"
            for i in range(40000)
        )
        + "f "
        + " ".join(str(i + 1) for i in range(40000))
        + "\n",
        (0, 3),
    )
    for name, what in (
        ("folder", "a folder"),
        ("pipe", "a named pipe"),
        ("/dev/zero", "/dev/zero"),
        ("/dev/urandom", "/dev/urandom"),
        ("zero", "a link to /dev/zero"),
        ("sparse", "a sparse terabyte"),
        ("none.obj", "nothing"),
        ("loop", "a link to itself"),
        ("socket", "a socket"),
    ):
        def prepare(folder, name=name):
            endless_files(folder)
            folder.write("scene.yaml", HEAD + MATERIALS + f"objects: [{{obj: '{name}', material: m}}]\n")
        case("mesh", f"{what} in place of an OBJ", ["info", "scene.yaml"], 3, (), prepare)

    def mtl(asked, text, codes=(0, 3), words=(), **options):
        mesh(
            asked,
            "mtllib a.mtl\n" + corners + "usemtl a\nf 1 2 3\n",
            codes,
            words,
            files={"a.mtl": text},
            material="from_mtl",
            **options,
        )

    for line in (
        "Kd nan 0 0",
        "Kd 1",
        "Kd -1 -1 -1",
        "Kd 1e999 0 0",
        "Kd a b c",
        "Ni 0",
        "Ni nan",
        "d -3",
        "d 7",
        "illum 99",
        "Ns -1",
        "map_Kd " + "x" * 100000,
        "Tf 1",
        "crt_reflectance none.spd",
        "crt_reflectance a.mtl",
    ):
        mtl(f"the MTL line '{line[:40]}'", f"newmtl a\n{line}\n")
    mtl(
        "an MTL whose light is 1e30",
        "newmtl a\nKe 1e30 1e30 1e30\n",
        3,
        "the largest value in single precision is 1e+25",
    )
    mtl("an MTL of noise", bytes(range(256)) * 256)
    mtl("a newmtl without a name", "newmtl\nKd 1 1 1\n")
    mtl(
        "50,000 materials",
        "".join(f"newmtl a{i}\nKd 1 1 1\n" for i in range(50000)) + "newmtl a\nKd 1 1 1\n",
        0,
    )
    mesh("an OBJ that is its own MTL", "mtllib mesh.obj\n" + OBJ, (0, 3), material="from_mtl")
    mesh("a material that no MTL has", "usemtl x\n" + OBJ, (0, 3), material="from_mtl")
    for name in ("folder", "pipe", "/dev/zero", "zero", "sparse", "none.mtl"):
        def prepare(folder, name=name):
            endless_files(folder)
            folder.write("scene.yaml", HEAD + MATERIALS + "objects: [{obj: mesh.obj}]\n")
            folder.write("mesh.obj", f"mtllib {name}\n" + corners + "usemtl a\nf 1 2 3\n")
        case("mesh", f"{name} in place of an MTL", ["info", "scene.yaml"], (0, 3), (), prepare)


def model_cases():
    hostile_models.gltf_cases(case)
    hostile_models.glb_cases(case)
    hostile_models.ply_cases(
        case,
        lambda name: HEAD + MATERIALS + f"objects: [{{ply: '{name}', material: m}}]\n",
        endless_files,
    )
    hostile_work.model_cases(case)


def spectrum_cases():
    for asked, text in (
        ("empty", ""),
        ("a header alone", "nm,value\n"),
        ("words", "red\ngreen\n"),
        ("one column", "400\n500\n"),
        ("three columns", "400 1 2\n"),
        ("falling wavelengths", "500 1\n400 1\n"),
        ("NaN", "400 nan\n500 1\n"),
        ("infinity", "400 1e999\n"),
        ("noise", bytes(range(128, 256)) * 100),
        ("NULs", b"\0" * 10000),
        ("a value of 1e300", "400 1e300\n700 1e300\n"),
        ("micrometres", "0.4 0.1\n0.7 0.9\n"),
        ("metres", "4e-7 0.1\n7e-7 0.9\n"),
        ("one wavelength of 10 MB", "400 1" + " " * 10000000),
    ):
        def prepare(folder, text=text):
            folder.write(
                "scene.yaml",
                HEAD
                + f"materials: {{m: {{type: diffuse, reflectance: {{file: s.spd, outside: "
                  f"clamp}}}}}}\nobjects: [{{{TRIANGLE}, material: m}}]\n",
            )
            folder.write("s.spd", text)
        case(
            "spectrum",
            f"a spectrum file: {asked}",
            ["info", "scene.yaml"],
            (0, 3) if "10 MB" in asked else 3,
            (),
            prepare,
        )
    for name in ("folder", "pipe", "/dev/zero", "noise", "sparse"):
        def prepare(folder, name=name):
            endless_files(folder)
            folder.write(
                "scene.yaml",
                HEAD
                + f"materials: {{m: {{type: diffuse, reflectance: {{file: '{name}', outside: "
                  f"clamp}}}}}}\nobjects: [{{{TRIANGLE}, material: m}}]\n",
            )
        case("spectrum", f"{name} in place of a spectrum", ["info", "scene.yaml"], 3, (), prepare)
    hostile_work.spectrum_cases(case)


# -----------------------------------------------------------------------------------------------------------
# textures

def texture_cases(samples):
    def texture(asked, name, data, words=(), codes=3, more="", mesh="uvs: [[0,0],[1,0],[0,1]], "):
        def prepare(folder):
            triangle = TRIANGLE.replace("{", "{" + mesh, 1)
            folder.write(
                "scene.yaml",
                HEAD
                + f"materials: {{m: {{type: diffuse, reflectance: {{texture: {name}{more}}}}}}}\n"
                  f"objects: [{{{triangle}, material: m}}]\n",
            )
            if data is not None:
                folder.write(name, data)
        case("texture", asked, ["info", "scene.yaml"], codes, words, prepare)

    with open(os.path.join(os.path.dirname(__file__), "../fuzz/corpus/texels/rgb.jpg"), "rb") as file:
        jpeg = file.read()
    texture("a good PNG", "a.png", png(8, 8), codes=0)
    texture("a good JPEG", "a.jpg", jpeg, codes=0)
    texture("an EXR", "a.exr", samples["exr"], codes=0)
    texture("no file", "a.png", None, ("scene.yaml:4:", "cannot find 'a.png'"))
    texture("an empty file", "a.png", b"", "it is not a PNG, JPEG")
    texture("text", "a.png", "not an image\n" * 100, "it is not a PNG, JPEG")
    texture("noise", "a.jpg", b"\xff\xd8\xff" + bytes(range(256)) * 10, "a.jpg")
    texture("a TIFF", "a.tif", b"II*\0" + b"\0" * 100, "it is not a PNG, JPEG")
    texture("a mesh without texture coordinates", "a.png", png(8, 8), "no texture coordinates", mesh="")
    texture("an unknown wrap", "a.png", png(8, 8), "did you mean 'repeat'", more=", wrap: repaet")
    texture("a scale beyond all digits", "a.png", png(8, 8), "1000000", more=", scale: 1e300")
    texture("texture coordinates of NaN", "a.png", png(8, 8), "nan", mesh="uvs: [[0,0],[1,nan],[0,1]], ")
    texture("too few texture coordinates", "a.png", png(8, 8), "2 uvs for 3", mesh="uvs: [[0,0],[1,0]], ")
    texture("a PNG of 60000 x 60000 in 100 bytes", "a.png", png(60000, 60000, b"\0" * 1000), "pixels")
    texture("a PNG cut in the middle", "a.png", png(64, 64)[:80], "a.png")
    texture("a PNG whose rows end early", "a.png", png(64, 64, b"\0" * 5000), "a.png")
    black = hostile_work.black_png(16384, 16384)
    texture("16384 x 16384 black texels in 260 KB", "a.png", black, "CRT_SCENE_MEMORY")
    for cut in (20, len(jpeg) // 2, len(jpeg) - 20):
        texture(f"a JPEG cut after {cut} bytes", "a.jpg", jpeg[:cut], "a.jpg")
    frame = jpeg.index(b"\xff\xc0") + 5
    texture(
        "a JPEG of 30000 x 30000 in 800 bytes",
        "a.jpg",
        jpeg[:frame] + struct.pack(">HH", 30000, 30000) + jpeg[frame + 4:],
        "pixels",
    )
    texture("a JPEG without a height", "a.jpg", jpeg[:frame] + b"\0\0" + jpeg[frame + 2:], "a.jpg")
    hostile_models.tga_cases(texture)
    hostile_work.texture_cases(texture, png)
    for name in ("folder", "pipe", "/dev/zero", "noise", "sparse"):
        def prepare(folder, name=name):
            endless_files(folder)
            folder.write(
                "scene.yaml",
                HEAD + f"materials: {{m: {{type: diffuse, reflectance: {{texture: '{name}'}}}}}}\n",
            )
        case("texture", f"{name} in place of a texture", ["info", "scene.yaml"], 3, (), prepare)


# -----------------------------------------------------------------------------------------------------------
# films and images

def png(width, height, rows=None, color=2):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    data = zlib.compress(
        rows if rows is not None else b"".join(b"\0" + b"\x80" * (3 * width) for _ in range(height))
    )
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0))
        + chunk(b"IDAT", data)
        + chunk(b"IEND", b"")
    )


def image_cases(samples):
    def image(asked, name, data, codes=2, words=(), **options):
        case(
            "image", asked, ["info", name], codes, words, lambda folder: folder.write(name, data), **options
        )

    for end in ("exr", "png", "pfm", "ppm"):
        image(f"an empty .{end}", f"a.{end}", b"", words="empty")
        image(f"a .{end} of one byte", f"a.{end}", b"P")
        image(f"a .{end} that is text", f"a.{end}", "not an image\n" * 100)
        image(
            f"a .{end} that is noise",
            f"a.{end}",
            bytes(hashlib.sha1(str(i).encode()).digest()[0] for i in range(5000)),
        )
    for header in (
        b"PF\n-1 4\n-1\n",
        b"PF\n0 4\n-1\n",
        b"PF\n4294967296 1\n-1\n",
        b"PF\n2000000000 2000000000\n-1\n",
        b"PF\n4 4\n0\n",
        b"PF\n4 4\nnan\n",
        b"PF\n4 4\n-1\n",
        b"PF\n# no end",
        b"PF " + b"9" * 100000,
    ):
        image(f"a PFM that begins {header[:24]!r}", "a.pfm", header)
    for header in (
        b"P6\n4 4\n0\n",
        b"P6\n4 4\n99999\n",
        b"P6\n4 4\n255\nxx",
        b"P6\n2147483647 2147483647\n255\n",
    ):
        image(f"a PPM that begins {header[:32]!r}", "a.ppm", header)
    image("a PNG of 2^31 pixels a side in 100 bytes", "a.png", png(2147483647, 2147483647, b"\0"))
    image("a PNG of 60000 x 60000 in 100 bytes", "a.png", png(60000, 60000, b"\0" * 1000))
    image(
        "16384 x 16384 pixels where there are 2 GB of memory",
        "a.png",
        hostile_work.black_png(16384, 16384),
        words="half of what is free",
        limits={resource.RLIMIT_AS: 2 << 30},
    )
    image("a PNG without its end", "a.png", png(8, 8)[:-12])
    image("a PNG cut in the middle", "a.png", png(64, 64)[:80])
    image(
        "a Radiance HDR of 65535 x 65535 pixels in 70 bytes",
        "a.exr",
        b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65535 +X 65535\n" + bytes(12),
        words="a file of its size",
    )
    image("a Radiance HDR of noise", "a.exr", b"#?RADIANCE\n\n-Y 100000 +X 100000\n" + bytes(range(256)))
    for cut in (8, 40, 300):
        image(f"an EXR cut after {cut} bytes", "a.exr", samples["exr"][:cut])
    for at in (4, 20, 60, 120, 200):
        damaged = bytearray(samples["exr"])
        damaged[at:at + 4] = b"\xff\xff\xff\x7f"
        image(f"an EXR with 2^31 - 1 at byte {at}", "a.exr", bytes(damaged), (0, 2))
    for name, what in (
        ("pipe.exr", "a named pipe"),
        ("zero.exr", "a link to /dev/zero"),
        ("folder.exr", "a folder"),
        ("none.exr", "nothing"),
        ("sparse.exr", "a sparse terabyte"),
    ):
        case("image", f"{what} in place of an image", ["info", name], 2, (), odd_files("exr"))
    for name in ("pipe.exr", "zero.exr"):
        case(
            "image",
            f"{name} to compare with",
            ["compare", "a.pfm", name],
            2,
            (),
            odd_files("exr", {"a.pfm": samples["pfm"]}),
        )
        case(
            "image",
            f"{name} as reference",
            ["compare", "a.pfm", "a.pfm", "--reference", name],
            2,
            (),
            odd_files("exr", {"a.pfm": samples["pfm"]}),
        )
    case(
        "image",
        "images of two sizes",
        ["compare", "a.pfm", "b.png"],
        7,
        (),
        lambda folder: (folder.write("a.pfm", samples["pfm"]), folder.write("b.png", png(3, 3))),
    )


def film_cases(samples):
    film = samples["crtfilm"]

    def check(asked, data, codes=2, words=(), **options):
        for command, arguments in (
            ("", ["info", "a.crtfilm"]),
            (", developed", ["develop", "a.crtfilm", "-o", "a.exr"]),
        ):
            case(
                "film",
                asked + command,
                arguments,
                codes,
                words,
                lambda folder: folder.write("a.crtfilm", data),
                **options,
            )

    check("an empty film", b"", words="is empty")
    check("a film of text", "film\n" * 100, words="first bytes differ")
    for cut in (1, 8, 50, 96, len(film) // 2, len(film) - 1):
        check(f"a film cut after {cut} bytes", film[:cut])
    for at in (8, 12, 16, 24, 32, 36, 40, 44, 50, 80, 84, 88, 100, len(film) // 2, len(film) - 3):
        damaged = bytearray(film)
        damaged[at] ^= 0x41
        check(f"a film with byte {at} changed", bytes(damaged))
    for at in (32, 36, 40, 80, 84):
        damaged = bytearray(film)
        damaged[at:at + 4] = b"\xff\xff\xff\xff"
        check(f"a film with 2^32 - 1 at byte {at}", bytes(damaged))
    check("a film with more behind its end", film + b"more")
    for name, what in (
        ("pipe.crtfilm", "a named pipe"),
        ("zero.crtfilm", "a link to /dev/zero"),
        ("folder.crtfilm", "a folder"),
        ("none.crtfilm", "nothing"),
        ("sparse.crtfilm", "a sparse terabyte"),
    ):
        case("film", f"{what} in place of a film", ["info", name], 2, (), odd_files("crtfilm"))
        case(
            "film",
            f"{what} to merge",
            ["merge", name, name, "-o", "out.crtfilm"],
            2,
            (),
            odd_files("crtfilm"),
        )
        case("film", f"{what} to develop", ["develop", name, "-o", "a.png"], 2, (), odd_files("crtfilm"))
    case(
        "film",
        "a film merged with itself",
        ["merge", "a.crtfilm", "a.crtfilm", "-o", "b.crtfilm"],
        2,
        "cannot be merged",
        lambda folder: folder.write("a.crtfilm", film),
    )
    case(
        "film",
        "a film of another scene, resumed",
        ["scene.yaml", "-b", "fake", "-o", "a.pfm", "--seed", "9", "--resume", "a.crtfilm"],
        2,
        "another scene",
        lambda folder: (folder.write("scene.yaml", GOOD), folder.write("a.crtfilm", film)),
    )
    case(
        "film",
        "an image, resumed",
        ["scene.yaml", "-b", "fake", "-o", "b.pfm", "--resume=a.pfm"],
        2,
        "is not a crt film",
        lambda folder: (folder.write("scene.yaml", GOOD), folder.write("a.pfm", samples["pfm"])),
    )


def odd_files(extension, more=None):
    def prepare(folder):
        os.mkfifo(folder / f"pipe.{extension}")
        os.symlink("/dev/zero", folder / f"zero.{extension}")
        os.mkdir(folder / f"folder.{extension}")
        with open(folder / f"sparse.{extension}", "wb") as file:
            file.truncate(1 << 40)
        for name, data in (more or {}).items():
            folder.write(name, data)
    return prepare


# ------------------------------------------------------------------------------------------------- command
# line, environment

RENDER = ["scene.yaml", "-b", "fake", "-o", "a.pfm", "--report", "none"]


def good(folder):
    folder.write("scene.yaml", GOOD)


def argument_cases(samples):
    def words_of(asked, arguments, codes=2, words=(), **options):
        case("arguments", asked, arguments, codes, words, good, **options)

    hostile_work.argument_cases(words_of)
    words_of("nothing", [])
    words_of("an option that is none", ["--nonsense"])
    words_of("an empty word", [""], (2, 3))
    words_of("a command that is none", ["explode", "scene.yaml"])
    words_of("two scenes", ["scene.yaml", "scene.yaml", "-b", "fake"])
    for option, values in (
        ("--spp", ("0", "-1", "many", "1e99", "99999999999999999999", "")),
        ("--time", ("0", "-1s", "soon", "1e999s")),
        ("--target-error", ("0", "200%", "nan")),
        ("--samples", ("5:5", "9:1", ":", "x", "0:99999999999999999999")),
        ("--crop", ("0,0,9,9", "1,2,3", "4,4,2,2")),
        (
            "--set",
            (
                "film",
                "=1",
                "film.resolution",
                "film.nonsense=1",
                "film.resolution=[0,0]",
                "film.resolution=[",
                "a.b.c.d=1",
                "objects.9.name=x",
            ),
        ),
        ("--seed", ("-1", "1.5", "x")),
        ("--threads", ("-1", "99999999")),
        ("--tile", ("0", "x")),
        ("--chunk", ("0", "-1")),
        ("--kernel", ("huge",)),
        ("--device", ("99", "no-such-device")),
        ("--checkpoint-every", ("0s", "never")),
    ):
        for value in values:
            words_of(f"{option} '{value}'", [*RENDER, f"{option}={value}"], (2, 3, 4))
    for name in (
        "a.docx",
        "a",
        "",
        "/dev/null",
        "/dev/full",
        "/proc/self/x.pfm",
        "missing/missing/a.pfm",
        "scene.yaml/a.pfm",
        "x" * 300 + ".pfm",
        "folder.pfm",
    ):
        for command, arguments in (
            ("", ["scene.yaml", "-b", "fake", "--report", "none"]),
            (" of develop", ["develop", "a.crtfilm"]),
        ):
            case(
                "arguments",
                f"an output{command} '{name[:30]}'",
                [*arguments, "-o", name],
                (2, 6),
                (),
                lambda folder: (
                    good(folder),
                    folder.write("a.crtfilm", samples["crtfilm"]),
                    os.mkdir(folder / "folder.pfm"),
                ),
            )
    for option, values in (
        ("--crop", ("0,0,9,9", "1,2,3", "4,4,2,2")),
        ("--aovs", ("nonsense", "")),
        (
            "--set",
            (
                "film",
                "=1",
                "film.exposure_ev=1e999",
                "film.exposure_ev=",
                "film.white_balance=[",
                "film.color_space=nonsense",
                "film.resolution=[9,9]",
                "film.crop=[0,0,9,9]",
                "a.b.c.d=1",
            ),
        ),
    ):
        for value in values:
            case(
                "arguments",
                f"develop {option} '{value}'",
                ["develop", "a.crtfilm", "-o", "a.exr", f"{option}={value}"],
                (2, 3),
                (),
                lambda folder: folder.write("a.crtfilm", samples["crtfilm"]),
            )
    for backend in ("nonsense", "/etc/passwd", "../fake", "", "x" * 5000, "/dev/zero", "/dev/null", "."):
        words_of(
            f"the backend '{backend[:20]}'", ["scene.yaml", "-o", "a.pfm", f"--backend={backend}"], (2, 4)
        )
    words_of("an argument of 100,000 letters", [*RENDER, "--" + "x" * 100000])
    words_of("an argument that is no UTF-8", [*RENDER, b"--\xff\xfe"])
    words_of("an argument with an escape sequence", [*RENDER, "--\x1b[2J"])
    words_of(
        "2,000 outputs",
        ["scene.yaml", "-b", "fake", "--report", "none"] + [f"-oo{i}.docx" for i in range(2000)],
    )
    words_of("info of nothing", ["info"])
    words_of("merge of nothing", ["merge", "-o", "a.crtfilm"])
    words_of("merge to nowhere", ["merge", "a.crtfilm"])
    words_of("develop of nothing", ["develop", "-o", "a.png"])
    words_of("develop to nowhere", ["develop", "a.crtfilm"])
    words_of("compare of one", ["compare", "a.pfm"])
    words_of("a level that is none", ["verify", "--level", "hourly"])
    words_of("a case that is none", ["verify", "--case", "Z99"])
    words_of("plugins from nowhere", ["verify", "--plugin-path", "/nowhere", "--case", "A01"])
    words_of("converge without a scene", ["converge"])
    words_of("a reference that is no EXR", ["reference", "scene.yaml", "-o", "a.png", "-b", "fake"])


def environment_cases():

    def with_variable(
        asked, codes, words=(), prepare=good, arguments=RENDER, changed=(), made=("a.pfm",), **env
    ):
        case(
            "environment",
            asked,
            arguments,
            codes,
            words,
            prepare,
            env=env,
            changed=changed,
            made=made if codes == 0 else (),
        )

    with_variable("CRT_CACHE_DIR=/dev/null", 0, CRT_CACHE_DIR="/dev/null")
    with_variable("CRT_CACHE_DIR is a file", 0, CRT_CACHE_DIR="scene.yaml")
    with_variable("CRT_CACHE_DIR in a file", 0, CRT_CACHE_DIR="scene.yaml/x/y")
    with_variable("no HOME and no cache", 0, CRT_CACHE_DIR=None, HOME=None, XDG_CACHE_HOME=None)
    with_variable("HOME=/nonexistent", 0, CRT_CACHE_DIR=None, HOME="/nonexistent/deep", XDG_CACHE_HOME=None)
    with_variable("LANG=xx_YY.nonsense", 0, LANG="xx_YY.nonsense", LC_ALL="xx_YY.nonsense")
    with_variable("TERM=nonsense", 0, TERM="nonsense")
    def rough_glass(folder):
        folder.write(
            "scene.yaml",
            HEAD
            + "materials: {m: {type: rough_dielectric, ior: 1.5, roughness: 0.3}}\n"
            + f"objects: [{{{TRIANGLE}, material: m, {LIT}}}]\n",
        )

    hostile_work.environment_cases(with_variable, rough_glass)
    with_variable("CRT_SCENE_MEMORY=lots", 2, "CRT_SCENE_MEMORY", CRT_SCENE_MEMORY="lots")
    with_variable("CRT_SCENE_MEMORY=-1GB", 2, "CRT_SCENE_MEMORY", CRT_SCENE_MEMORY="-1GB")
    with_variable("CRT_BACKEND=nonsense", 4, arguments=["scene.yaml", "-o", "a.pfm"], CRT_BACKEND="nonsense")
    with_variable("CRT_DEVICE=nonsense", (2, 4), CRT_DEVICE="nonsense")
    with_variable(
        "CRT_BACKEND_PATH of 1,000 folders that are not there",
        0,
        CRT_BACKEND_PATH=":".join(f"/none/{i}" for i in range(1000)) + ":FAKE",
    )
    with_variable(
        "CRT_MESH_PATH of colons",
        3,
        "cannot find",
        prepare=lambda folder: folder.write(
            "scene.yaml", HEAD + MATERIALS + "objects: [{obj: none.obj, material: m}]\n"
        ),
        CRT_MESH_PATH=":::::/:::",
    )

    def shared_cache(folder):
        good(folder)
        os.mkdir(folder / "cache")
        os.chmod(folder / "cache", 0o777)
    with_variable(
        "a cache folder that everyone can write to",
        0,
        "so every process makes its own: everyone can write",
        shared_cache,
        CRT_CACHE_DIR="cache",
    )

    def plugin(asked, change, codes, words=(), arguments=("scene.yaml", "-b", "planted", "-o", "a.pfm")):
        def prepare(folder):
            good(folder)
            os.mkdir(folder / "plugins", 0o755)
            shutil.copy(os.path.join(FAKE, "crt_backend_fake.so"), folder / "plugins/crt_backend_planted.so")
            os.chmod(folder / "plugins/crt_backend_planted.so", 0o755)
            change(folder, folder / "plugins/crt_backend_planted.so")
        case("plugins", asked, list(arguments), codes, words, prepare, env={"CRT_BACKEND_PATH": "plugins"})

    def replaced(data):
        def change(_, path):
            os.remove(path)
            with open(path, "wb") as file:
                file.write(data)
        return change

    def as_pipe(_, path):
        os.remove(path)
        os.mkfifo(path, 0o600)

    def as_folder(_, path):
        os.remove(path)
        os.mkdir(path)

    plugin("a plugin that is whole", lambda *_: None, 0)
    plugin(
        "a plugin that everyone can write to",
        lambda _, path: os.chmod(path, 0o777),
        4,
        "is refused: everyone can write to",
    )
    plugin(
        "a plugin in a folder that everyone can write to",
        lambda folder, _: os.chmod(folder / "plugins", 0o777),
        4,
        "is refused: everyone can write to",
    )
    plugin(
        "the same, listed",
        lambda folder, _: os.chmod(folder / "plugins", 0o777),
        0,
        "refused",
        arguments=("plugins",),
    )
    plugin("a plugin in a sticky folder", lambda folder, _: os.chmod(folder / "plugins", 0o1777), 0)
    if ROOT:
        plugin(
            "another user's plugin",
            lambda _, path: os.chown(path, 65534, 65534),
            4,
            "belongs to another user",
        )
        plugin(
            "a plugin in another user's folder",
            lambda folder, _: os.chown(folder / "plugins", 65534, 65534),
            4,
            "belongs to another user",
        )
    plugin("a text as plugin", replaced(b"text\n"), 4, "cannot be opened")
    plugin("an empty plugin", replaced(b""), 4, "cannot be opened")
    plugin(
        "noise with the mark of a library",
        replaced(b"\x7fELF" + bytes(range(256)) * 40),
        4,
        "cannot be opened",
    )
    plugin("a pipe as plugin", as_pipe, 4, "is not a regular file")
    plugin("a folder as plugin", as_folder, 4, "is not a regular file")
    plugin("half a plugin", lambda _, path: os.truncate(path, loaded_bytes(path) // 2), 4)
    for name in (
        "no_symbol",
        "no_table",
        "small_table",
        "wrong_abi",
        "wrong_bits",
        "wrong_layout",
        "no_device",
        "missing_library",
        "throws_in_entry",
        "throws_in_probe",
    ):
        case("plugins", f"the plugin '{name}'", ["scene.yaml", "-b", name, "-o", "a.pfm"], 4, (), good)


# -----------------------------------------------------------------------------------------------------------
# faults

def loaded_bytes(path):
    """Of an ELF library: what lies behind it in the file, symbols for debuggers say, is not needed to run
    it."""
    with open(path, "rb") as file:
        data = file.read()
    table, = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    headers = [struct.unpack_from("<IIQQQQ", data, table + i * size) for i in range(count)]
    return max(
        offset + bytes_in_file for kind, _, offset, _, _, bytes_in_file in headers if kind == 1
    )  # PT_LOAD


def fault_cases(samples):
    commands = {
        "--help": ["--help"],
        "--version": ["--version"],
        "schema": ["schema"],
        "schema --markdown": ["schema", "--markdown"],
        "verify --list": ["verify", "--list"],
        "verify --markdown": ["verify", "--markdown"],
        "plugins": ["plugins"],
        "info of a scene": ["info", "scene.yaml"],
        "info of a film": ["info", "a.crtfilm"],
        "info of an image": ["info", "a.pfm"],
        "compare": ["compare", "a.pfm", "a.pfm"],
        "compare --json": ["compare", "a.pfm", "a.pfm", "--json"],
    }

    def files(folder):
        good(folder)
        folder.write("a.crtfilm", samples["crtfilm"])
        folder.write("a.pfm", samples["pfm"])

    for name, arguments in commands.items():
        case(
            "fault",
            f"{name} on a full disk",
            arguments,
            6,
            "cannot write to standard output: No space left",
            files,
            stdout="/dev/full",
        )
    for name in ("schema", "plugins", "info of a scene"):
        case(
            "fault",
            f"{name} without standard output",
            commands[name],
            6,
            "cannot write to standard output",
            files,
            stdout="closed",
        )
        case("fault", f"{name} to a reader that is gone", commands[name], 0, (), files, stdout="broken")
    case(
        "fault",
        "compare of two that differ, to a reader that is gone",
        ["compare", "a.pfm", "b.png"],
        7,
        (),
        lambda folder: (files(folder), folder.write("b.png", png(3, 3))),
        stdout="broken",
    )
    case(
        "fault",
        "develop --help on a full disk",
        ["develop", "--help"],
        6,
        "cannot write to standard output: No space left",
        files,
        stdout="/dev/full",
    )
    for place in ("/dev/full", "closed", "broken"):
        case(
            "fault",
            f"develop whose messages go to {place}",
            ["develop", "a.crtfilm", "-o", "d.exr", "-o", "d.png"],
            0,
            (),
            files,
            stdout=place,
            stderr=place,
            made=("d.exr", "d.png"),
        )
    for place in ("/dev/full", "closed", "broken"):
        case(
            "fault",
            f"a render whose messages go to {place}",
            ["scene.yaml", "-v", "-b", "fake", "-o", "a.pfm", "--spp", "50", "--chunk", "1"],
            0,
            (),
            good,
            stderr=place,
            made=("a.pfm", "a.report.json"),
        )
    case(
        "fault",
        "a render without standard streams",
        RENDER,
        0,
        (),
        good,
        stdin="closed",
        stdout="closed",
        stderr="closed",
        made=("a.pfm",),
        after=lambda folder: (
            "" if open(folder / "a.pfm", "rb").read(2) == b"PF" else "the image begins with something else"
        ),
    )
    case(
        "fault",
        "an error without standard streams",
        ["none.yaml"],
        3,
        (),
        good,
        stdin="closed",
        stdout="closed",
        stderr="closed",
    )

    def limited(asked, arguments, codes, limits, words=(), **options):
        case("fault", asked, arguments, codes, words, options.pop("prepare", good), limits=limits, **options)

    limited(
        "a limit of 1 kB on files (SIGXFSZ)",
        [*RENDER, "--set", "film.resolution=[64,64]"],
        6,
        {resource.RLIMIT_FSIZE: 1024},
        "File too large",
    )
    limited(
        "a limit of 60 kB on files: the image fits, the film does not",
        [
            *RENDER,
            "--set",
            "film.resolution=[64,64]",
            "--set",
            "sampler.replicates=16",
            "--checkpoint",
            "c.crtfilm",
            "--spp",
            "64",
        ],
        6,
        {resource.RLIMIT_FSIZE: 60000},
        "File too large",
        made=("a.pfm",),
    )
    limited(
        "a second of processor time (SIGXCPU)",
        [*RENDER, "--set", "film.resolution=[512,512]", "--spp", "1000000"],
        152,
        {resource.RLIMIT_CPU: 1},
        "SIGXCPU",
        made=("a.pfm", "a.crtfilm"),
    )
    limited(
        "develop with a limit of 100 bytes on files",
        ["develop", "a.crtfilm", "-o", "d.pfm"],
        6,
        {resource.RLIMIT_FSIZE: 100},
        "File too large",
        prepare=files,
    )
    limited("eight open files", RENDER, (0, 1, 4, 5, 6), {resource.RLIMIT_NOFILE: 8})
    limited(
        "200 MB of address space",
        [*RENDER, "--set", "film.resolution=[4096,4096]"],
        5,
        {resource.RLIMIT_AS: 200 << 20},
        "memory",
    )
    limited("a stack of 256 kB", RENDER, 0, {resource.RLIMIT_STACK: 256 << 10}, made=("a.pfm",))
    limited(
        "a stack of 256 kB and brackets 10,000 deep",
        ["info", "scene.yaml"],
        3,
        {resource.RLIMIT_STACK: 256 << 10},
        prepare=lambda folder: folder.write("scene.yaml", HEAD + "objects: " + "[" * 10000),
    )
    limited(
        "no core file and no message queue",
        RENDER,
        0,
        {resource.RLIMIT_CORE: 0, resource.RLIMIT_MSGQUEUE: 0},
        made=("a.pfm",),
    )

    slow = ["scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "100000", "--chunk", "1"]
    for number, code in (
        (signal.SIGINT, 130),
        (signal.SIGTERM, 143),
        (signal.SIGHUP, 129),
        (signal.SIGXCPU, 152),
    ):
        case(
            "fault",
            f"{number.name} while rendering",
            slow,
            code,
            (),
            good,
            env={"CRT_FAKE_FAULT": "slow"},
            send=(number,),
            made=("a.pfm", "a.crtfilm", "a.report.json"),
        )
    case(
        "fault",
        "SIGPIPE, SIGXFSZ and then SIGINT while rendering",
        slow,
        130,
        (),
        good,
        env={"CRT_FAKE_FAULT": "slow"},
        send=(signal.SIGPIPE, signal.SIGXFSZ, signal.SIGINT),
        made=("a.pfm", "a.crtfilm"),
    )
    case(
        "fault",
        "SIGXCPU again and again",
        slow,
        152,
        (),
        good,
        env={"CRT_FAKE_FAULT": "slow"},
        send=(signal.SIGXCPU,) * 5,
        made=("a.pfm", "a.crtfilm"),
    )
    for fault, code in (("device", 5), ("oom", 5), ("nan_film", 1), ("count_film", 1)):
        case(
            "fault",
            f"a backend with the fault '{fault}'",
            RENDER,
            code,
            (),
            good,
            env={"CRT_FAKE_FAULT": fault},
        )

    def model(folder):
        folder.write(
            "scene.yaml",
            HEAD
            + "materials: {m: {type: diffuse, reflectance: {file: s.spd, outside: clamp}}}\nobjects: [{obj: "
              "mesh.obj, material: m}, {obj: own.obj}]\n",
        )
        folder.write("mesh.obj", OBJ)
        folder.write("own.obj", "mtllib own.mtl\nusemtl a\n" + OBJ)
        folder.write("own.mtl", "newmtl a\nKd 1 1 1\n")
        folder.write("s.spd", "400 0.5\n700 0.5\n")
        os.link(folder / "mesh.obj", folder / "hard.pfm")
        os.symlink("own.mtl", folder / "soft.crtfilm")
    for option, name in (
        ("--report", "scene.yaml"),
        ("--checkpoint", "mesh.obj"),
        ("--report", "own.mtl"),
        ("--report", "s.spd"),
        ("-o", "hard.pfm"),
        ("-o", "soft.crtfilm"),
        ("--checkpoint", "soft.crtfilm"),
        ("--report", "../" + "FOLDER" + "/scene.yaml"),
    ):
        case(
            "fault",
            f"{option} {name.replace('FOLDER', '…')} over an input",
            ["scene.yaml", "-b", "fake", *([] if option == "-o" else ["-o", "a.pfm"]), option, name],
            2,
            (
                "would replace the input"
                if name not in ("scene.yaml", "own.mtl", "s.spd", "mesh.obj")
                else "would replace"
            ),
            model,
        )
    case(
        "fault",
        "a report over the image",
        ["scene.yaml", "-b", "fake", "-o", "a.pfm", "--report", "a.pfm"],
        2,
        "two outputs",
        good,
    )
    case(
        "fault", "a merge over a part", ["merge", "a.crtfilm", "-o", "a.crtfilm"], 2, "would replace", files
    )
    def film_by_other_names(folder):
        files(folder)
        os.link(folder / "a.crtfilm", folder / "hard.exr")
        os.symlink("a.crtfilm", folder / "soft.png")
        os.symlink(folder.path, folder / "here")
        folder.write("film.pfm", samples["crtfilm"])
    for film, image in (
        ("film.pfm", "film.pfm"),
        ("a.crtfilm", "hard.exr"),
        ("a.crtfilm", "soft.png"),
        ("film.pfm", "here/film.pfm"),
    ):
        case(
            "fault",
            f"develop: {film} to {image}, the same file",
            ["develop", film, "-o", image],
            2,
            "would replace",
            film_by_other_names,
        )
    case(
        "fault",
        "develop to two names of one file",
        ["develop", "a.crtfilm", "-o", "d.png", "-o", "here/d.png"],
        2,
        "are the same file",
        film_by_other_names,
    )
    case(
        "fault",
        "a difference image over an image",
        ["compare", "a.pfm", "a.pfm", "--diff", "a.pfm"],
        2,
        "would replace",
        files,
    )
    film = ["scene.yaml", "-b", "fake", "-o", "b.pfm", "--report", "none"]
    case(
        "fault",
        "--checkpoint over a film of more samples",
        [*film, "--spp", "1", "--checkpoint", "a.crtfilm"],
        2,
        ("--resume", "--overwrite"),
        files,
    )
    case(
        "fault",
        "-o over a film of more samples",
        ["scene.yaml", "-b", "fake", "-o", "a.crtfilm", "--spp", "1", "--report", "none"],
        2,
        ("--resume", "--overwrite"),
        files,
    )
    case(
        "fault",
        "the same with --overwrite",
        [*film, "--spp", "1", "--checkpoint", "a.crtfilm", "--overwrite"],
        0,
        (),
        files,
        changed=("a.crtfilm",),
        made=("b.pfm",),
    )
    case(
        "fault",
        "--checkpoint over a file that is no film",
        [*film, "--checkpoint", "notes.txt"],
        2,
        "--overwrite",
        lambda folder: (good(folder), folder.write("notes.txt", "notes\n")),
    )
    case(
        "fault",
        "Ctrl-C beside a film of more samples",
        ["scene.yaml", "-b", "fake", "-o", "a.exr", "-o", "a.pfm", "--spp", "100000", "--chunk", "1"],
        130,
        "a.partial.crtfilm",
        lambda folder: (good(folder), folder.write("a.crtfilm", large_film(samples))),
        env={"CRT_FAKE_FAULT": "slow"},
        send=(signal.SIGINT,),
        made=("a.partial.crtfilm", "a.pfm"),
    )

    def links(folder):
        good(folder)
        os.mkdir(folder / "store")
        os.symlink("store/image.pfm", folder / "a.pfm")
        os.symlink("absent/image.pfm", folder / "lost.pfm")
    case(
        "fault",
        "an output link to a file that is not there yet",
        RENDER,
        0,
        (),
        links,
        made=("store/image.pfm",),
    )
    case(
        "fault",
        "an output link into a folder that is not there",
        ["scene.yaml", "-b", "fake", "-o", "lost.pfm", "--report", "none"],
        6,
        "does not exist",
        links,
    )
    case(
        "fault",
        "an output link to itself",
        ["scene.yaml", "-b", "fake", "-o", "loop.pfm", "--report", "none"],
        6,
        "leads to itself",
        lambda folder: (good(folder), os.symlink("loop.pfm", folder / "loop.pfm")),
    )


def large_film(samples):
    return samples["large"]


# -----------------------------------------------------------------------------------------------------------
# running

def descriptor_for(place, read_side):
    """The file on which a standard stream is opened; None is closed."""
    if place == "closed":
        return None
    if place == "broken":  # A pipe whose reader has gone.
        reader, writer = os.pipe()
        os.close(reader)
        return writer
    return os.open(place, os.O_RDONLY if read_side else os.O_WRONLY)


PREPARED = threading.Lock()  # A child must not inherit what another thread has just opened for its own.


def start(case_, folder, env):
    streams = [case_.how.get("stdin", "/dev/null"), case_.how.get("stdout"), case_.how.get("stderr")]
    with PREPARED:
        captured = [None, None, None]
        child = []
        for number, place in enumerate(streams):
            if place is None:
                captured[number] = tempfile.TemporaryFile()
                child.append(captured[number].fileno())
            else:
                child.append(descriptor_for(place, number == 0))

        def prepare():
            harness.default_signals(signal.SIGPIPE, signal.SIGXFSZ, signal.SIGXCPU)
            for what, limit in case_.how.get("limits", {}).items():
                # Only the soft limit of processor time: the hard one kills.
                hard = 30 * SLOWER if what == resource.RLIMIT_CPU else limit
                resource.setrlimit(what, (limit, int(hard)))
            for number, descriptor in enumerate(child):
                if descriptor is None:
                    os.close(number)

        arguments = [os.fsencode(word) if isinstance(word, str) else word for word in case_.arguments]
        arguments = [
            word.replace(b"FOLDER", os.fsencode(os.path.basename(folder.path))) for word in arguments
        ]
        process = subprocess.Popen(
            [os.fsencode(CRT), *arguments],
            cwd=folder.path,
            env=env,
            stdin=child[0] if child[0] is not None else subprocess.DEVNULL,
            stdout=child[1] if child[1] is not None else subprocess.DEVNULL,
            stderr=child[2] if child[2] is not None else subprocess.DEVNULL,
            preexec_fn=prepare,
        )
        for number, descriptor in enumerate(child):
            if descriptor is not None and captured[number] is None:
                os.close(descriptor)
    return process, captured


def environment(case_):
    changes = {name: value and value.replace("FAKE", FAKE) for name, value in case_.env.items()}
    return harness.environment(**{"CRT_CACHE_DIR": os.path.join(WORK, "cache"), **changes})


def text_of(captured):
    text = b""
    for stream in captured[1:]:
        if stream is not None:
            stream.seek(0)
            text += stream.read(1 << 22)
            stream.close()
    return text.decode("utf-8", "replace")


def run(case_, number):
    """The outcome, and the errors in it."""
    folder = Folder(os.path.join(WORK, f"case{number}"))
    os.mkdir(folder.path, 0o755)
    if case_.prepare:
        case_.prepare(folder)
    before = folder.state()
    started = time.monotonic()
    process, captured = start(case_, folder, environment(case_))
    done = threading.Event()
    hung = []

    def watch():
        if not done.wait(WAIT_SECONDS * SLOWER):
            hung.append(True)
            process.kill()
    watcher = threading.Thread(target=watch)
    watcher.start()
    if case_.how.get("send"):
        wait_for_rendering(captured[2], process)
        for sent in case_.how["send"]:
            if process.poll() is None:
                process.send_signal(sent)
            time.sleep(0.02)
    _, status, usage = os.wait4(process.pid, 0) if process.returncode is None else (0, None, None)
    if status is not None:
        process.returncode = os.waitstatus_to_exitcode(status)
    done.set()
    watcher.join()
    seconds = time.monotonic() - started
    memory = usage.ru_maxrss * 1024 if usage else 0
    text = text_of(captured)
    code = process.returncode

    wrong = []
    if hung:
        wrong.append(f"still running after {WAIT_SECONDS * SLOWER:g} s")
    elif code < 0:
        wrong.append(f"ended by {signal.Signals(-code).name}")
    elif code not in case_.codes:
        wrong.append(f"exit code {code}, expected {' or '.join(map(str, case_.codes))}")
    if usage and usage.ru_utime + usage.ru_stime > SECONDS * SLOWER:
        wrong.append(f"took {usage.ru_utime + usage.ru_stime:.1f} s of processor time")
    if memory > MEMORY_BYTES * SLOWER:
        wrong.append(f"took {memory / 1e9:.1f} GB")
    if case_.words and captured[2] is not None and not says(case_.words, text):
        wrong.append(f"says nothing of {case_.words}")
    if (
        code not in (0, 7)
        and captured[2] is not None
        and "crt: error:" not in text
        and "crt: info: stopped by" not in text
    ):
        wrong.append("gives no reason")
    if any((c < " " and c not in "\n\t") or "\x7f" <= c < "\xa0" for c in text):
        wrong.append("prints control characters")
    if "internal error" in text and 1 not in case_.codes:
        wrong.append("calls it an internal error")
    after = folder.state()
    for name, content in before.items():
        if name not in case_.changed and after.get(name) != content:
            wrong.append(f"{name} is {'changed' if name in after else 'gone'}")
    wrong += [f"left {name}" for name in after if name.endswith(".tmp")]
    wrong += [f"{name} is missing" for name in case_.made if not os.path.exists(folder / name)]
    if case_.after and not wrong and case_.after(folder):
        wrong.append(case_.after(folder))
    shutil.rmtree(folder.path)
    return {
        "case": case_,
        "code": code,
        "seconds": seconds,
        "processor": usage.ru_utime + usage.ru_stime if usage else 0,
        "memory": memory,
        "text": text,
        "wrong": wrong,
    }


def says(words, text):
    return (
        any(word in text for word in words)
        if isinstance(words, set)
        else all(word in text for word in words)
    )


def wait_for_rendering(stream, process):
    """The line that names the device is the last before the first sample."""
    end = time.monotonic() + WAIT_SECONDS
    while time.monotonic() < end and process.poll() is None:
        if b"fake on pattern" in os.pread(stream.fileno(), 1 << 16, 0):
            time.sleep(0.15)
            return
        time.sleep(0.01)


def make_samples():
    """Files that a crt has written, to be damaged."""
    folder = Folder(os.path.join(WORK, "samples"))
    os.mkdir(folder.path)
    folder.write("scene.yaml", GOOD)
    env = environment(Case("", "", [], 0))
    outputs = ["-o", "a.exr", "-o", "a.pfm", "-o", "a.crtfilm", "--report", "none"]
    subprocess.run([CRT, "scene.yaml", "-b", "fake", *outputs, "-q"], cwd=folder.path, env=env, check=True)
    subprocess.run(
        [CRT, "scene.yaml", "-b", "fake", "-o", "large.crtfilm", "--spp", "90000", "--report", "none", "-q"],
        cwd=folder.path,
        env=env,
        check=True,
    )
    samples = {name: open(folder / f"a.{name}", "rb").read() for name in ("exr", "pfm", "crtfilm")}
    samples["large"] = open(folder / "large.crtfilm", "rb").read()
    shutil.rmtree(folder.path)
    return samples


def sentence(result):
    """The first line that says what happened, behind one that leads to a list of errors."""
    if result["case"].how.get("stderr") or result["code"] == 0:
        return ""
    lines = [line for line in result["text"].splitlines() if "error:" in line and not line.endswith(":")]
    lines = lines or [line for line in result["text"].splitlines() if "stopped by" in line]
    text = lines[0].replace("crt: error: ", "").replace("crt: info: ", "") if lines else ""
    text = (
        text.replace(WORK, "…")
        .replace(FAKE, "…")
        .replace(os.path.dirname(os.path.dirname(CRT)), "…")
        .replace("|", "\\|")
    )
    return text if len(text) <= 160 else text[:159] + "…"


def summary(results):
    """The section of a page: a row for each kind of input."""
    faults = sum(r["case"].group == "fault" for r in results)
    rows = []
    for group in dict.fromkeys(r["case"].group for r in results):
        of_group = [r for r in results if r["case"].group == group]
        codes = sorted(dict.fromkeys(r["code"] for r in of_group))
        said = next((r for r in of_group if r["code"] and "\x1b" not in r["case"].asked), of_group[0])
        rows.append([
            group,
            len(of_group),
            ", ".join(f"{code}: {sum(r['code'] == code for r in of_group)}" for code in codes),
            said["case"].asked.replace("|", "\\|"),
            sentence(said),
        ])
    return section.section(
        f"{len(results) - faults} hostile inputs and {faults} faults end with the right exit code",
        section.source("tests/cli/test_hostile.py CRT FAKE_PLUGIN_DIR --write PAGE", section.commit(),
                       section.today(), f"{os.cpu_count()} processors"),
        "The test makes every input, and demands of each run the exit code of its list, no crash, no hang "
        "(10 s of "
        "processor time), less than 2 GB of memory, every existing file unchanged, and no temporary file "
        "left. It is "
        "part of `scripts/test`. [Exit codes](../architecture.md#exit-codes) says what the codes mean.",
        ["kind", "cases", "exit code: cases", "for example", "crt says"],
        rows,
    )


def main():
    global CRT, FAKE, WORK, SLOWER
    parser = argparse.ArgumentParser()
    parser.add_argument("crt")
    parser.add_argument("fake")
    parser.add_argument("--write", metavar="PAGE", help="whose section 'hostile' shall be replaced")
    parser.add_argument("--only", default="")
    parser.add_argument("--slower", type=float, default=1)
    options = parser.parse_args()
    CRT, FAKE, SLOWER = os.path.abspath(options.crt), os.path.abspath(options.fake), options.slower
    harness.FAKE_DIR = FAKE
    WORK = tempfile.mkdtemp(prefix="crt-hostile-")
    os.chmod(WORK, 0o755)
    try:
        samples = make_samples()
        scene_cases()
        hostile_work.material_cases(case)
        hostile_work.light_cases(case)
        hostile_work.large_scene_cases(case)
        hostile_values.add(case)
        hostile_work.name_cases(case, good, os.path.join(FAKE, "crt_backend_fake.so"))
        mesh_cases()
        model_cases()
        spectrum_cases()
        texture_cases(samples)
        image_cases(samples)
        film_cases(samples)
        argument_cases(samples)
        environment_cases()
        fault_cases(samples)
        chosen = [c for c in CASES if options.only in f"{c.group}: {c.asked}"]
        if SLOWER > 1:  # AddressSanitizer reserves 16 TB of address space.
            for c in [c for c in chosen if resource.RLIMIT_AS in c.how.get("limits", {})]:
                print(f"SKIPPED {c.group}: {c.asked}: no sanitizer runs within it")
                chosen.remove(c)
        with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
            results = list(pool.map(run, chosen, range(len(chosen))))
    finally:
        shutil.rmtree(WORK, ignore_errors=True)
    if not results:
        print(f"no case that can be asked here is called '{options.only}'")
        return 1
    failed = [r for r in results if r["wrong"]]
    for r in failed:
        words = " ".join(w if isinstance(w, str) else repr(w) for w in r["case"].arguments)
        print(
            f"FAILED {r['case'].group}: {r['case'].asked}\n  crt {words[:200]}\n  {'; '.join(r['wrong'])}\n "
            f" "
            f"{sentence(r) or r['text'][:300]}"
        )
    slowest = max(results, key=lambda r: r["processor"])
    largest = max(results, key=lambda r: r["memory"])
    print(
        f"{len(results)} cases, {len(failed)} failed; slowest {slowest['processor']:.1f} s of processor "
        f"time "
        f"({slowest['case'].asked}), largest {largest['memory'] / 1e6:.0f} MB ({largest['case'].asked})"
    )
    if options.write and not failed:
        section.replace(pathlib.Path(options.write), "hostile", summary(results))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
