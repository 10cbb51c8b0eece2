#!/usr/bin/env python3
"""Waiting times: loading and building report how far they are and can be stopped, times add up, nothing is
built that is never read, and checkpoints are small and written beside the render.

    test_waiting.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

No test measures time: slow work is as slow as a test says (CRT_FAKE_SCENE_SECONDS), or larger than any
machine reads at once.
"""

import glob
import os
import pty
import re
import select
import signal
import subprocess
import time

import harness
from harness import CliTest, read_bytes

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


def has_embree():
    return "embree" in harness.real_backends()


class Waiting(CliTest):

    def setUp(self):
        super().setUp()
        self.write("scene.yaml", EMPTY)

    def write_mesh_scene(self, side):
        write_grid(self.path("sheet.obj"), side)
        self.write("mesh.yaml", MESH)

    def report(self, name="a.report.json"):
        return super().report(name)

    def on_terminal(self, *arguments, until, timeout=harness.PATIENCE_SECONDS, **changes):
        """The output of a terminal of 100 columns until `until` is there; then Ctrl-C. Returns (text, exit
        status)."""
        pid, terminal = pty.fork()
        if pid == 0:
            harness.default_signals()
            os.chdir(self.directory)
            terminal_environment = harness.environment(TERM="xterm", COLUMNS="100", **changes)
            os.execve(harness.CRT, [harness.CRT, *arguments], terminal_environment)
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

    def samples_of(self, film):
        return re.search(r"samples +(\S+)", self.crt("info", film).stdout)[1]

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
        lines = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", CRT_FAKE_SCENE_SECONDS="4").stderr
        self.assertRegex(lines, r"\d+ %  preparing the scene for fake  0:0\d left")
        # A device that is quick is not worth a line.
        self.assertNotIn("preparing", self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm").stderr)

    def test_quiet_is_quiet(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--quiet", CRT_FAKE_SCENE_SECONDS="3")
        self.assertEqual(run.stderr, "")

    def test_a_terminal_shows_a_bar_and_ctrl_c_ends_it_at_once(self):
        shown, status = self.on_terminal(
            "scene.yaml",
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
        self.assertEqual(os.listdir(self.directory), ["scene.yaml"])

    def test_ctrl_c_ends_what_would_take_hours(self):
        backend = harness.first_real_backend()
        if backend is None:
            self.skipTest("no backend has a device")
        long = ["--spp", "100000000"]
        commands = (
            ["render", "scene.yaml", "-b", backend, "-o", "a.pfm", *long],
            ["compare", "--backends", f"{backend},{backend}", "scene.yaml", *long],
            ["converge", "scene.yaml", "--backends", backend, "--time", "9h", "-o", "c"],
            ["reference", "scene.yaml", "-b", backend, "-o", "r.exr", *long],
            # One case, ten million rays at each of four kinds of place.
            ["verify", "-b", backend, "--level", "nightly", "--case", "B04"],
        )
        processes = [
            subprocess.Popen(
                [harness.CRT, *command],
                cwd=self.directory,
                env=harness.environment(CRT_BACKEND_PATH=""),
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                preexec_fn=harness.default_signals,
            )
            for command in commands
        ]
        self.addCleanup(lambda: [process.kill() for process in processes])
        time.sleep(3)
        for command, process in zip(commands, processes):
            self.assertIsNone(process.poll(), f"{command} has ended by itself")
            process.send_signal(signal.SIGINT)
        for command, process in zip(commands, processes):
            try:
                said, _ = process.communicate(timeout=harness.PATIENCE_SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                said, _ = process.communicate()
                self.fail(f"{command} goes on after Ctrl-C:\n{said}")
            self.assertIn(process.returncode, (130, -signal.SIGINT), f"{command}:\n{said}")

    # --- E12: nothing is built that is not read, and seconds add up
    # ------------------------------------------------------

    def test_seconds_add_up(self):
        self.write_mesh_scene(200)
        for backend in ["fake", *(["embree"] if has_embree() else [])]:
            path = "" if backend == "embree" else harness.FAKE_DIR
            self.crt("mesh.yaml", "-b", backend, "-o", "a.pfm", CRT_BACKEND_PATH=path)
            seconds = self.report()["seconds"]
            stages = ["parse", "build", "compile", "open", "prepare", "sampling", "write", "other"]
            for stage in stages:
                self.assertGreaterEqual(seconds[stage], 0, stage)
            self.assertAlmostEqual(sum(seconds[stage] for stage in stages), seconds["total"], places=6)
            self.assertGreater(seconds["build"], 0)

    def test_a_slow_device_is_counted_once(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", CRT_FAKE_SCENE_SECONDS="0.5")
        seconds = self.report()["seconds"]
        self.assertGreater(seconds["prepare"], 0.5)
        # Counted twice, it would be half a second less than nothing.
        self.assertGreaterEqual(seconds["other"], 0)

    def test_no_bvh_for_a_backend_that_brings_its_own(self):
        if not has_embree():
            self.skipTest("embree cannot run here")
        self.write_mesh_scene(30)
        self.crt("mesh.yaml", "-b", "embree", "-o", "a.pfm", CRT_BACKEND_PATH="")
        report = self.report()
        self.assertEqual(report["scene"]["nodes"], 0)
        self.assertIn(
            {"what": "BVH", "why": "the backend builds its own acceleration structure"},
            report["features"]["left_out"],
        )
        # Nor from far away, where boxes have to allow for more rounding (docs/decisions/0045).
        far = ["--set", "camera.position=[0,100,-400]", "--set", "camera.fov=0.5"]
        self.crt("mesh.yaml", "-b", "embree", "-o", "far.pfm", *far, CRT_BACKEND_PATH="")
        self.assertEqual(self.report("far.report.json")["scene"]["nodes"], 0)
        # The same films, whatever the backend brings.
        for name, options in (("a", []), ("far", far)):
            self.crt("mesh.yaml", "-b", "example", "-o", f"{name}_example.pfm", *options)
            self.assertGreater(self.report(f"{name}_example.report.json")["scene"]["nodes"], 0)
            self.assertEqual(
                self.report(f"{name}_example.report.json")["scene"]["hash"],
                self.report(f"{name}.report.json")["scene"]["hash"],
            )
            self.assertEqual(
                read_bytes(self.path(f"{name}.pfm")), read_bytes(self.path(f"{name}_example.pfm"))
            )

    def test_nothing_is_built_when_nothing_is_missing(self):
        self.write_mesh_scene(30)
        self.crt("mesh.yaml", "-b", "fake", "-o", "a.crtfilm", "-o", "a.pfm")
        self.crt("mesh.yaml", "-b", "no_such_backend", "-o", "b.pfm", "--resume", "a.crtfilm")
        self.assertEqual(self.report("b.report.json")["scene"]["nodes"], 0)
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    # --- checkpoints
    # ----------------------------------------------------------------------------------------------------

    def test_films_of_the_scenes_take_little_space(self):
        if not has_embree():
            self.skipTest("embree cannot run here")
        for scene in sorted(glob.glob(os.path.join(harness.CONFIG_DIR, "*.yaml"))):
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
                    "film.resolution=[64,64]",
                    CRT_BACKEND_PATH="",
                )
                size = os.path.getsize(self.path("a.crtfilm")) / 64**2
                with open(scene) as file:
                    keeps_the_spectrum = "  spectral:" in file.read()
                if not keeps_the_spectrum:  # which takes as many channels as it has bins
                    self.assertLessEqual(size, 150)
                # Sums of 8 floats: 24 + 3 digits, and one more for each factor of 2 by which samples of a
                # pixel differ. With a factor of 1,000, as the sun has it beside the sky, 37 of 64 bits.
                with open(self.path("a.crtfilm"), "rb") as file:
                    channels = int.from_bytes(file.read(44)[40:44], "little")
                self.assertLess(size, channels * 37 / 8)
                os.remove(self.path("a.crtfilm"))

    def test_a_checkpoint_is_written_while_the_render_goes_on(self):
        # The copy has the samples of its time, and the render ends with all of them.
        process = self.start_with_checkpoints(
            "--checkpoint", "c.crtfilm", "--spp", "40", "-v", every="0.01s")
        seen = set()
        while process.poll() is None:
            if os.path.exists(self.path("c.crtfilm")):
                # Whenever it is looked at, it is whole: it is renamed into its place.
                seen.add(self.samples_of("c.crtfilm"))
            time.sleep(0.02)
        _, log = process.communicate()
        self.assertEqual(process.returncode, 0, log)
        self.assertIn("checkpoint: the device waited for", log)
        self.assertGreater(len(seen), 1, log)
        self.assertEqual(self.samples_of("c.crtfilm"), "40")


if __name__ == "__main__":
    harness.main(__doc__)
