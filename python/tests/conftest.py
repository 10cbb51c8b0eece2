"""Scenes and backends that the tests use."""

import os
import pathlib
import subprocess

import pytest

import crt

BOX = """
crt: 1
film: {resolution: [24, 16]}
camera: {position: [0, 1, 3], target: [0, 0.4, 0], fov: 50}
sampler: {samples: 16}
materials:
  grey: {type: diffuse, reflectance: 0.5}
  red: {type: diffuse, reflectance: {rgb: [0.7, 0.1, 0.1]}}
objects:
  - name: floor
    material: grey
    mesh: {positions: [[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], faces: [[0, 1, 2, 3]]}
  - {name: ball, material: red, sphere: {radius: 0.5}, transform: [{translate: [0, 0.5, 0]}]}
  - name: lamp
    material: grey
    mesh: {positions: [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]}
    emission: {radiance: 4}
"""


def usable():
    return [plugin.name for plugin in crt.plugins()
            if plugin.name in ("embree", "opencl", "cuda") and not plugin.reason]


def pytest_generate_tests(metafunc):
    if "backend" in metafunc.fixturenames:
        metafunc.parametrize("backend", usable())


@pytest.fixture
def box():
    return crt.scene(BOX)


@pytest.fixture
def program():
    """The program crt: called with arguments, it gives what it printed."""
    path = pathlib.Path(os.environ["CRT_PROGRAM"])

    def run(*arguments):
        done = subprocess.run([str(path), *map(str, arguments)], capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
