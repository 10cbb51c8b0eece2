#!/usr/bin/env python3
"""What people wait for: loading and building say how far they are and can be stopped, times add up, nothing
is built that is never read, and checkpoints are small and written beside the render.

    test_waiting.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

No test measures time: slow work is as slow as a test says (CRT_FAKE_SCENE_SECONDS), or larger than any
machine reads at once.
"""

import glob
import json
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

CRT = CONFIG_DIR = FAKE_DIR = None  # From the command line.

EMPTY = """\
crt: 1
camera: {position: [0.5, 1, -1.5], target: [0.5, 0, 0.5], fov: 40}
film: {resolution: [24, 16]}
sampler: {samples: 8}
environment: {radiance: 1}
"""

MESH = EMPTY + """\
materials: {white: {type: diffuse, reflectance: 0.7}}
objects: [{name: sheet, obj: sheet.obj, material: white}]
"""
SUMMARY = "samples per pixel"


def environment(**changes):
    env = {k: v for k, v in os.environ.items() if not k.startswith("CRT_")}
    env["CRT_BACKEND_PATH"] = FAKE_DIR
    env["CRT_CACHE_DIR"] = os.path.join(tempfile.gettempdir(), f"crt-test-cache-{os.getuid()}")
    env["TERM"] = "xterm"
    env.update(changes)
    return env


def default_signals():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def write_grid(path, side):
    """A wavy sheet of 2 side² triangles."""
    with open(path, "w", encoding="ascii") as file:
        for y in range(side + 1):
            file.write(
                "".join(
                    f"v {x / side:.6f} {(x * 7 + y * 3) % 5 / side:.6f} {y / side:.6f}\n"
                    for x in range(side + 1)
                )
            )
        for y in range(side):
            first = y * (side + 1) + 1
            file.write(
                "".join(
                    f"f {first + x} {first + x + 1} {first + x + side + 2} {first + x + side + 1}\n"
                    for x in range(side)
                )
            )


class Waiting(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp(prefix="crt-waiting-")
        self.addCleanup(shutil.rmtree, self.directory)
        self.write("empty.yaml", EMPTY)

    def path(self, name):
        return os.path.join(self.directory, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def write_mesh_scene(self, side):
        write_grid(self.path("sheet.obj"), side)
        self.write("mesh.yaml", MESH)

    def crt(self, *arguments, expect=0, **changes):
        run = subprocess.run(
            [CRT, *arguments],
            cwd=self.directory,
            env=environment(**changes),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=280,
        )
        self.assertEqual(run.returncode, expect, f"crt {' '.join(arguments)}\n{run.stdout}{run.stderr}")
        return run

    def report(self, name="a.report.json"):
        with open(self.path(name), encoding="utf-8") as file:
            return json.load(file)

    def has_embree(self):
        return "embree" in [s["name"] for s in self.usable()]

    def usable(self):
        listing = subprocess.run(
            [CRT, "plugins"], env=environment(CRT_BACKEND_PATH=""), capture_output=True, text=True
        ).stdout
        found, name = [], None
        for line in listing.splitlines():
            if not line.startswith(" "):
                name = line.split()[0]
            elif line.split()[0] == "device":
                found.append({"name": name})
        return found

    def on_terminal(self, *arguments, until, timeout=120, **changes):
        """What a terminal of 100 columns shows until `until` is there; then Ctrl-C. Returns (text, exit
        status)."""
        pid, terminal = pty.fork()
        if pid == 0:
            default_signals()
            os.chdir(self.directory)
            os.execve(CRT, [CRT, *arguments], environment(COLUMNS="100", **changes))
        shown = b""
        deadline = time.monotonic() + timeout
        while until.encode() not in shown and time.monotonic() < deadline:
            if not select.select([terminal], [], [], 0.5)[0]:
                continue
            try:
                shown += os.read(terminal, 65536)
            except OSError:
                break  # It has ended.
        os.write(terminal, b"\x03")
        status = None
        while status is None and time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.1)[0]:
                try:
                    shown += os.read(terminal, 65536)
                except OSError:
                    pass
            ended, code = os.waitpid(pid, os.WNOHANG)
            status = code if ended else None
        if status is None:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
        os.close(terminal)
        return shown.decode(errors="replace"), status

    # --- E10: something is said
    # -----------------------------------------------------------------------------------------

    def test_a_log_says_what_a_large_mesh_waits_for(self):
        self.write_mesh_scene(1000)
        lines = self.crt("mesh.yaml", "-b", "fake", "-o", "a.pfm").stderr.splitlines()
        report = self.report()
        first = next((i for i, line in enumerate(lines) if SUMMARY in line), len(lines))
        stages = [
            line
            for line in lines[:first]
            if re.search(r"(reading|making triangles of|placing|building|compiling|looking for) ", line)
        ]
        if report["seconds"]["total"] - report["seconds"]["sampling"] - report["seconds"]["write"] > 2:
            self.assertTrue(stages, "\n".join(lines))
        self.assertNotIn("\r", "".join(lines))

    def test_a_log_says_how_far_a_slow_device_is(self):
        lines = self.crt("empty.yaml", "-b", "fake", "-o", "a.pfm", CRT_FAKE_SCENE_SECONDS="4").stderr
        self.assertRegex(lines, r"\d+ %  preparing the scene for fake  0:0\d left")
        # A device that is quick is not worth a line.
        self.assertNotIn("preparing", self.crt("empty.yaml", "-b", "fake", "-o", "a.pfm").stderr)

    def test_quiet_is_quiet(self):
        run = self.crt("empty.yaml", "-b", "fake", "-o", "a.pfm", "--quiet", CRT_FAKE_SCENE_SECONDS="3")
        self.assertEqual(run.stderr, "")

    def test_a_terminal_shows_a_bar_and_ctrl_c_ends_it_at_once(self):
        shown, status = self.on_terminal(
            "empty.yaml",
            "-b",
            "fake",
            "-o",
            "a.pfm",
            until="2 %  preparing the scene for fake",
            CRT_FAKE_SCENE_SECONDS="100",
        )
        self.assertRegex(shown, r"\r\x1b\[K\[=*> *\] +\d+ %  preparing the scene for fake")
        # Nothing is there to be saved: the signal ends the process, as it does any other. The device would
        # take 100 s more.
        self.assertTrue(
            status is not None and os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGINT,
            f"status {status}",
        )
        self.assertEqual(os.listdir(self.directory), ["empty.yaml"])

    # --- E12: nothing is built that is not read, and seconds add up
    # ------------------------------------------------------

    def test_seconds_add_up(self):
        self.write_mesh_scene(200)
        for backend in ["fake", *(["embree"] if self.has_embree() else [])]:
            path = "" if backend == "embree" else FAKE_DIR
            self.crt("mesh.yaml", "-b", backend, "-o", "a.pfm", CRT_BACKEND_PATH=path)
            seconds = self.report()["seconds"]
            stages = ["parse", "build", "compile", "open", "prepare", "sampling", "write", "other"]
            for stage in stages:
                self.assertGreaterEqual(seconds[stage], 0, stage)
            self.assertAlmostEqual(sum(seconds[stage] for stage in stages), seconds["total"], places=6)
            self.assertGreater(seconds["build"], 0)

    def test_a_slow_device_is_counted_once(self):
        self.crt("empty.yaml", "-b", "fake", "-o", "a.pfm", CRT_FAKE_SCENE_SECONDS="0.5")
        seconds = self.report()["seconds"]
        self.assertGreater(seconds["prepare"], 0.5)
        self.assertLess(seconds["other"], 0.4)
        self.assertGreaterEqual(
            seconds["other"], 0
        )  # Counted twice, it would be half a second less than nothing.

    def test_no_bvh_for_a_backend_that_brings_its_own(self):
        if not self.has_embree():
            self.skipTest("embree cannot run here")
        self.write_mesh_scene(30)
        self.crt("mesh.yaml", "-b", "embree", "-o", "a.pfm", CRT_BACKEND_PATH="")
        report = self.report()
        self.assertEqual(report["scene"]["nodes"], 0)
        self.assertIn(
            {"what": "BVH", "why": "the backend builds an acceleration structure of its own"},
            report["features"]["left_out"],
        )
        # From so far away Embree's boxes are too small for what rounding does: then the scene's own BVH is
        # needed.
        far = ["--set", "camera.position=[0,100,-400]", "--set", "camera.fov=0.5"]
        self.crt("mesh.yaml", "-b", "embree", "-o", "far.pfm", *far, CRT_BACKEND_PATH="")
        self.assertGreater(self.report("far.report.json")["scene"]["nodes"], 0)
        # The same films, whoever brings what.
        for name, options in (("a", []), ("far", far)):
            self.crt("mesh.yaml", "-b", "example", "-o", f"{name}_example.pfm", *options)
            self.assertGreater(self.report(f"{name}_example.report.json")["scene"]["nodes"], 0)
            self.assertEqual(
                self.report(f"{name}_example.report.json")["scene"]["hash"],
                self.report(f"{name}.report.json")["scene"]["hash"],
            )
            with open(self.path(f"{name}.pfm"), "rb") as one, open(
                self.path(f"{name}_example.pfm"), "rb"
            ) as other:
                self.assertEqual(one.read(), other.read())

    def test_nothing_is_built_when_nothing_is_missing(self):
        self.write_mesh_scene(30)
        self.crt("mesh.yaml", "-b", "fake", "-o", "a.crtfilm", "-o", "a.pfm")
        self.crt("mesh.yaml", "-b", "no_such_backend", "-o", "b.pfm", "--resume", "a.crtfilm")
        self.assertEqual(self.report("b.report.json")["scene"]["nodes"], 0)
        with open(self.path("a.pfm"), "rb") as one, open(self.path("b.pfm"), "rb") as other:
            self.assertEqual(one.read(), other.read())

    # --- checkpoints
    # ----------------------------------------------------------------------------------------------------

    def test_films_of_the_scenes_take_little_space(self):
        if not self.has_embree():
            self.skipTest("embree cannot run here")
        for scene in sorted(glob.glob(os.path.join(CONFIG_DIR, "*.yaml"))):
            with self.subTest(scene=os.path.basename(scene)):
                self.crt(
                    scene,
                    "-b",
                    "embree",
                    "-o",
                    "a.crtfilm",
                    "--spp",
                    "8",
                    "--set",
                    "film.resolution=[128,128]",
                    CRT_BACKEND_PATH="",
                )
                size = os.path.getsize(self.path("a.crtfilm")) / 128**2
                with open(scene) as file:
                    keeps_the_spectrum = "  spectral:" in file.read()
                if not keeps_the_spectrum:  # which takes as many channels as it has bins
                    self.assertLessEqual(size, 150)
                # Much of a film are bytes that are the same everywhere, and most of the others are alike.
                with open(self.path("a.crtfilm"), "rb") as file:
                    channels = int.from_bytes(file.read(44)[40:44], "little")
                self.assertLess(size, 16 * channels / 4)
                os.remove(self.path("a.crtfilm"))

    def test_a_checkpoint_is_written_while_the_render_goes_on(self):
        # The copy has the samples of its time, and the render ends with all of them.
        process = subprocess.Popen(
            [
                CRT,
                "empty.yaml",
                "-b",
                "fake",
                "-o",
                "a.pfm",
                "--checkpoint",
                "c.crtfilm",
                "--checkpoint-every",
                "0.01s",
                "--spp",
                "40",
                "--chunk",
                "1",
                "-v",
            ],
            cwd=self.directory,
            env=environment(CRT_FAKE_FAULT="slow"),
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=default_signals,
        )
        seen = set()
        while process.poll() is None:
            if os.path.exists(self.path("c.crtfilm")):
                # Whenever it is looked at, it is whole: it is renamed into its place.
                listing = subprocess.run(
                    [CRT, "info", "c.crtfilm"],
                    cwd=self.directory,
                    capture_output=True,
                    text=True,
                    timeout=60,
                )
                self.assertEqual(listing.returncode, 0, listing.stderr)
                seen.add(re.search(r"samples +(\S+)", listing.stdout)[1])
            time.sleep(0.02)
        log = process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.returncode, 0, log)
        self.assertIn("checkpoint: the device waited for", log)
        self.assertGreater(len(seen), 1, log)
        final = subprocess.run(
            [CRT, "info", "c.crtfilm"], cwd=self.directory, capture_output=True, text=True, timeout=60
        ).stdout
        self.assertRegex(final, r"samples +40\b")


if __name__ == "__main__":
    CRT, CONFIG_DIR, FAKE_DIR = map(os.path.abspath, sys.argv[1:4])
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
