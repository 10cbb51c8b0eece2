"""What the tests of the program from outside share: the program, a folder of its own for each test, and how
to run it there.

Each of them is started as

    test_NAME.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

CRT = CONFIG_DIR = FAKE_DIR = None  # From the command line.

SCENE = """\
crt: 1
title: A lamp over a floor
camera: {position: [0, 1, -4], target: [0, 0.5, 0], fov: 40}
film: {resolution: [24, 16]}
sampler: {samples: 16}
materials:
  floor: {type: diffuse, reflectance: 0.7}
  black: {type: diffuse, reflectance: 0}
objects:
  - name: floor
    mesh: {positions: [[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], faces: [[0, 1, 2, 3]]}
    material: floor
  - name: lamp
    mesh: {positions: [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]}
    material: black
    emission: {radiance: {blackbody: 4000, scale: 5}}
"""

LIT = SCENE.replace("radiance: {blackbody: 4000, scale: 5}", "radiance: glow").replace(
    "materials:", "spectra: {glow: {blackbody: 4000, scale: 5}}\nmaterials:")


def environment(**changes):
    env = {k: v for k, v in os.environ.items() if not k.startswith("CRT_")}
    env["CRT_BACKEND_PATH"] = FAKE_DIR
    # Addresses compiled in by a sanitizer build need no help from here; a cache in the home of whoever runs
    # the tests does no good.
    env["CRT_CACHE_DIR"] = os.path.join(tempfile.gettempdir(), f"crt-test-cache-{os.getuid()}")
    env.update(changes)
    return env


def default_signals():
    """A test run in the background of a shell script has SIGINT ignored, and crt would rightly inherit
    that."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def read_pfm(path):
    with open(path, "rb") as file:
        kind, size, scale = file.readline().split(), file.readline().split(), float(file.readline())
        width, height = map(int, size)
        channels = 3 if kind == [b"PF"] else 1
        values = struct.unpack(("<" if scale < 0 else ">") + f"{width * height * channels}f", file.read())
    return width, height, values


def read_bytes(path):
    with open(path, "rb") as file:
        return file.read()


def first_real_backend():
    """The first backend installed beside the program that has a device."""
    name = None
    listing = subprocess.run(
        [CRT, "plugins"], env=environment(CRT_BACKEND_PATH=""), capture_output=True, text=True
    ).stdout
    for line in listing.splitlines():
        if not line.startswith(" "):
            name = line.split()[0]
        elif line.split()[0] == "device":
            return name
    return None


class CliTest(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp(prefix="crt-cli-")
        self.addCleanup(shutil.rmtree, self.directory)
        self.write("scene.yaml", SCENE)

    def path(self, name):
        return os.path.join(self.directory, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def crt(self, *arguments, expect=0, fault=None, **changes):
        if fault:
            changes["CRT_FAKE_FAULT"] = fault
        run = subprocess.run(
            [CRT, *arguments],
            cwd=self.directory,
            env=environment(**changes),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
        )
        self.assertEqual(run.returncode, expect, f"crt {' '.join(arguments)}\n{run.stdout}{run.stderr}")
        return run

    def start(self, *arguments, fault=None):
        changes = {"CRT_FAKE_FAULT": fault} if fault else {}
        process = subprocess.Popen(
            [CRT, *arguments],
            cwd=self.directory,
            env=environment(**changes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=default_signals,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def wait_for_rendering(self, process):
        """The line that names the device is the last before the first sample."""
        line = process.stderr.readline()
        self.assertIn("fake on pattern", line)
        time.sleep(0.15)
        self.assertIsNone(process.poll(), "the render was over before the test could look at it")

    def report(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return json.load(file)

    def assert_one_error(self, run, *words):
        errors = [line for line in run.stderr.splitlines() if line.startswith("crt: error:")]
        self.assertEqual(len(errors), 1, run.stderr)
        for word in words:
            self.assertIn(word, run.stderr)


def main(documentation):
    """Runs the tests of the calling program; `documentation` is what it says when it is called wrongly."""
    global CRT, CONFIG_DIR, FAKE_DIR
    if len(sys.argv) < 4:
        sys.exit(documentation)
    CRT, CONFIG_DIR, FAKE_DIR = map(os.path.abspath, sys.argv[1:4])
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
