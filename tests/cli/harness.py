"""The shared parts of the tests of the program from outside: the program, a separate folder for each test,
and a way to run it there.

Each of them is started as

    test_NAME.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Where no light transport is needed the backend is `fake` (tests/fake_plugins), which renders a pattern that
depends on seed, pixel and sample as a real one does, and goes wrong on demand (CRT_FAKE_FAULT). Tests that
need light use a real backend that can run here and are skipped when there is none. Python's standard library
only.
"""

import json
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

CRT = CONFIG_DIR = FAKE_DIR = None  # From the command line.
PATIENCE_SECONDS = 900  # Only ends hangs: on a busy machine everything takes many times as long.

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
    """That of a test's crt: this process's without CRT_ variables, with `changes`; None removes one."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("CRT_")}
    env["CRT_BACKEND_PATH"] = FAKE_DIR
    # Addresses compiled in by a sanitizer build need no help from here; a cache in the home of the user who
    # runs the tests is harmful.
    env["CRT_CACHE_DIR"] = os.path.join(tempfile.gettempdir(), f"crt-test-cache-{os.getuid()}")
    env["CRT_PYTHON"] = ""  # Pages need libraries that not every Python has: tests of them ask for one.
    env.update(changes)
    return {name: value for name, value in env.items() if value is not None}


def default_signals(*more):
    """A test run in the background of a shell script has SIGINT ignored, and crt would rightly inherit
    that."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, *more):
        signal.signal(number, signal.SIG_DFL)


def processor_seconds(process):
    """Time that a child has spent on processors."""
    with open(f"/proc/{process.pid}/stat", encoding="ascii", errors="replace") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


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


def real_backends():
    """The names of the backends installed beside the program that have a device."""
    listing = subprocess.run(
        [CRT, "plugins", "--json"], env=environment(CRT_BACKEND_PATH=""), capture_output=True, text=True
    ).stdout
    return [b["name"] for b in json.loads(listing)["backends"] if b["usable"]]


def first_real_backend():
    return next(iter(real_backends()), None)


def can_mount():
    """True if this process may mount a disk, which root in a container may not."""
    if os.geteuid() != 0 or shutil.which("mount") is None:
        return False
    probe = "/tmp/crt-mount-probe"
    os.makedirs(probe, exist_ok=True)
    mounted = (
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=64k", "crt-test", probe], capture_output=True
        ).returncode
        == 0
    )
    if mounted:
        subprocess.run(["umount", probe], capture_output=True)
    os.rmdir(probe)
    return mounted


UNPRIVILEGED_ID = 65534


def drop_root():
    """Leaves root's rights, if any: limits of processes do not bind root. For the child of a fork."""
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(UNPRIVILEGED_ID)
        os.setuid(UNPRIVILEGED_ID)


def why_root_must_stay():
    """The reason why only root can run the program here; empty if other users can."""
    try:
        run = subprocess.run(["test", "-x", CRT, "-a", "-x", FAKE_DIR], preexec_fn=drop_root)
    except (OSError, subprocess.SubprocessError):
        return "root may not become another user here"
    return "" if run.returncode == 0 else "the program is in a folder that other users cannot read"


def allow_new_threads(process, allowed):
    """Lets a running program start threads, or no more. It was started without root's rights."""
    most, hard = resource.getrlimit(resource.RLIMIT_NPROC)

    def limit():
        drop_root()
        resource.prlimit(process.pid, resource.RLIMIT_NPROC, (most if allowed else 1, hard))
    subprocess.run(["true"], preexec_fn=limit, check=True)


def allow_memory(process, more):
    """Lets a running program map `more` bytes in addition to those that it has. False, and no limit, if
    it is built with a sanitizer that reserves terabytes of address space."""
    with open(f"/proc/{process.pid}/statm", encoding="ascii") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    if mapped > 1 << 40:
        return False
    resource.prlimit(process.pid, resource.RLIMIT_AS, (mapped + more, mapped + more))
    return True


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

    def crt(self, *arguments, expect=0, fault=None, folder="", **changes):
        """Runs crt in a folder of the test's and asks for its exit code."""
        if fault:
            changes["CRT_FAKE_FAULT"] = fault
        run = subprocess.run(
            [CRT, *arguments],
            cwd=self.path(folder),
            env=environment(**changes),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_SECONDS,
        )
        self.assertEqual(run.returncode, expect, f"crt {' '.join(arguments)}\n{run.stdout}{run.stderr}")
        return run

    def start(self, *arguments, fault=None, most_descriptors=None, without_root=False, **changes):
        """Starts crt in the folder of the test; `without_root`: as a user who is not root."""
        if fault:
            changes["CRT_FAKE_FAULT"] = fault
        if without_root and os.geteuid() == 0:
            for name in (self.directory, self.path("scene.yaml")):
                os.chown(name, UNPRIVILEGED_ID, UNPRIVILEGED_ID)

        def begin():
            default_signals()
            if without_root:
                drop_root()
            if most_descriptors:
                resource.setrlimit(resource.RLIMIT_NOFILE, (most_descriptors, most_descriptors))

        process = subprocess.Popen(
            [CRT, *arguments],
            cwd=self.directory,
            env=environment(**changes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=begin,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def start_with_checkpoints(self, *arguments, every="50ms"):
        """A slow render that offers a checkpoint after each sample, and saves at most one in `every`."""
        return self.start(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--chunk", "1", "--checkpoint-every", every,
            *arguments, fault="slow"
        )

    def save_samples(self, spp, checkpoint):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", str(spp), "--checkpoint", checkpoint)

    def resumed_samples(self, checkpoint, spp, *arguments):
        """Samples per pixel that a render to `spp` finds in `checkpoint`, which stays as it is. The image is
        b.pfm, the film d.crtfilm."""
        self.crt(
            "scene.yaml", "-b", "fake", "-o", "b.pfm", "--spp", str(spp), "--resume", checkpoint,
            "--checkpoint", "d.crtfilm", *arguments
        )
        return self.report("b.report.json")["samples"]["resumed"]

    def wait_for_rendering(self, process, resumed=False):
        """The line that names the device is the last before the first sample."""
        if resumed:
            self.assertIn("resuming", process.stderr.readline())
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


class LightTest(CliTest):
    """With the first real backend, as self.backend."""

    def setUp(self):
        super().setUp()
        self.backend = first_real_backend()
        if self.backend is None:
            self.skipTest("no real backend can run here")


def take_arguments(documentation, more=0):
    """Reads the three folders and returns the `more` arguments that follow them; what is left is for
    unittest. `documentation` is what a program says that is called wrongly."""
    global CRT, CONFIG_DIR, FAKE_DIR
    if len(sys.argv) < 4 + more:
        sys.exit(documentation)
    CRT, CONFIG_DIR, FAKE_DIR = map(os.path.abspath, sys.argv[1:4])
    taken = sys.argv[4:4 + more]
    del sys.argv[1:4 + more]
    return taken


def main(documentation):
    """Runs the tests of the calling program."""
    take_arguments(documentation)
    unittest.main()
