#!/usr/bin/env python3
"""Outside events and the program: killed at any moment, disks that fill up or turn read-only,
backends that hang or lie, and storms of signals. Always the same demand: what was saved
stays, and the exit code and one sentence say what happened (docs/architecture.md).

    test_faults.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Tests that mount a small disk need root and are skipped by name without it. Python's standard library only.

Over 450 lines: one demand, made of one fault after another.
"""

import glob
import os
import random
import re
import signal
import subprocess
import time
import unittest

import harness
from harness import CliTest, can_mount, read_bytes


class KilledAtAnyMoment(CliTest):
    """kill -9 while checkpoints are written as fast as the disk takes them."""

    ROUNDS = 25
    # Large enough that writing it is most of what the program does: 1 MB a checkpoint.
    BIG = [
        "--set",
        "film.resolution=[128,128]",
        "--chunk",
        "1",
        "--spp",
        "100000",
        "--checkpoint",
        "c.crtfilm",
        "--checkpoint-every",
        "1ms",
    ]

    def test_the_checkpoint_is_the_old_or_the_new_one(self):
        random.seed(1)
        resumed_before, while_writing = 0, 0
        for round_number in range(self.ROUNDS):
            resume = ["--resume", "c.crtfilm"] if round_number else []
            before = self.identity("c.crtfilm")
            process = self.start("scene.yaml", "-b", "fake", "-o", "a.pfm", *resume, *self.BIG)
            self.assertIn("fake on pattern", self.line_with(process, "fake on pattern"))
            # Every other round has time for a checkpoint, however slow the machine or the build; the others
            # may die before their first.
            if round_number % 2 == 0:
                self.wait_until(lambda: self.identity("c.crtfilm") != before)
            time.sleep(random.uniform(0.0, 0.25))
            process.kill()
            process.communicate()
            leftovers = glob.glob(self.path("c.crtfilm.*.tmp"))
            while_writing += bool(leftovers)
            for name in leftovers:
                os.remove(name)
            # A complete run of no further sample reads the whole file, checksum included.
            resumed = self.resumed_samples("c.crtfilm", 1, "--set", "film.resolution=[128,128]")
            self.assertGreaterEqual(resumed, resumed_before, "samples that were saved are gone")
            resumed_before = resumed
        self.assertGreater(resumed_before, self.ROUNDS // 2)
        self.assertGreater(while_writing, 0, "no kill came while a file was being written")

    def identity(self, name):
        """Of the file that has this name now, or None."""
        try:
            status = os.stat(self.path(name))
        except FileNotFoundError:
            return None
        return status.st_ino, status.st_mtime_ns

    def wait_until(self, condition, seconds=harness.PATIENCE_SECONDS):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.001)

    def line_with(self, process, words):
        for line in process.stderr:
            if words in line:
                return line
        return ""


class TwoPrograms(CliTest):
    """Both go on from one film, the slower one to fewer samples."""

    def test_the_larger_film_stays(self):
        self.save_samples(2, "c.crtfilm")
        slow = self.start("scene.yaml", "-b", "fake", "-o", "a.pfm", "--chunk", "1", "--spp", "40",
                          "--resume", "c.crtfilm", "--checkpoint-every", "1h", fault="slow")
        # It has looked at the film when it has said what it goes on from.
        line = slow.stderr.readline()
        while "resuming" not in line:
            self.assertTrue(line, "it ended")
            line = slow.stderr.readline()
        slow.send_signal(signal.SIGSTOP)  # However slow this machine is, the other is done before.
        self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", "--spp", "100", "--resume", "c.crtfilm")
        larger = self.samples_in("c.crtfilm")
        self.assertGreaterEqual(larger, 100)
        slow.send_signal(signal.SIGCONT)
        slow.communicate()
        self.assertEqual(slow.returncode, 0)
        self.assertEqual(self.samples_in("c.crtfilm"), larger)
        self.assertEqual(self.samples_in("c.partial.crtfilm"), 40)

    def samples_in(self, film):
        return int(re.search(r"samples +(\d+) per pixel", self.crt("info", film).stdout)[1])


@unittest.skipUnless(can_mount(), "needs root and the right to mount a tmpfs")
class SmallDisk(CliTest):
    """A disk of 192 KiB; the film of 24 x 16 pixels takes 27 KiB, one of 64 x 64 takes 288."""

    def setUp(self):
        super().setUp()
        os.mkdir(self.path("disk"))
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=768k", "crt-test", self.path("disk")], check=True
        )
        self.addCleanup(subprocess.run, ["umount", "-l", self.path("disk")], check=False)

    def fill(self):
        with open(self.path("disk/ballast"), "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(4096))
            except OSError:
                pass

    def test_a_checkpoint_that_does_not_fit_leaves_the_old_one(self):
        self.save_samples(8, "disk/c.crtfilm")
        before = read_bytes(self.path("disk/c.crtfilm"))
        self.fill()
        run = self.crt(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "16", "--resume", "disk/c.crtfilm", expect=6
        )
        self.assert_one_error(run, "disk/c.crtfilm", "No space left")
        self.assertEqual(read_bytes(self.path("disk/c.crtfilm")), before)
        self.assertEqual(glob.glob(self.path("disk/*.tmp")), [])
        # The image, which lies elsewhere, has all samples.
        self.assertEqual(self.report("a.report.json")["samples"]["per_pixel"], 16)
        os.remove(self.path("disk/ballast"))
        self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", "--spp", "16", "--resume", "disk/c.crtfilm")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    def test_an_image_that_does_not_fit_costs_no_samples(self):
        for name in ("disk/a.pfm", "disk/a.ppm", "disk/a.exr", "disk/a.png"):
            with self.subTest(name=name):
                self.crt("scene.yaml", "-b", "fake", "-o", name, "--report", "none")
                before = read_bytes(self.path(name))
                self.fill()
                run = self.crt(
                    "scene.yaml",
                    "-b",
                    "fake",
                    "--seed",
                    "1",
                    "-o",
                    name,
                    "--checkpoint",
                    "kept.crtfilm",
                    "--report",
                    "none",
                    expect=6,
                )
                self.assert_one_error(run, name)
                self.assertEqual(read_bytes(self.path(name)), before)
                self.assertTrue(os.path.exists(self.path("kept.crtfilm")))
                self.assertEqual(glob.glob(self.path("disk/*.tmp")), [])
                for file in (name, "disk/ballast", "kept.crtfilm"):
                    os.remove(self.path(file))

    def test_rendering_goes_on_while_the_disk_is_full(self):
        process = self.start_with_checkpoints("--checkpoint", "disk/c.crtfilm", "--spp", "40")
        self.wait_for_rendering(process)
        self.fill()
        time.sleep(0.4)
        os.remove(self.path("disk/ballast"))
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 0, messages)
        self.assertIn("rendering continues, and crt tries again at the next checkpoint", messages)
        self.assertEqual(self.report("a.report.json")["samples"]["per_pixel"], 40)

    def test_a_read_only_disk_is_found_before_rendering(self):
        subprocess.run(["mount", "-o", "remount,ro", self.path("disk")], check=True)
        for arguments in (
            ["-o", "disk/a.pfm"],
            ["-o", "a.pfm", "--checkpoint", "disk/c.crtfilm"],
            ["-o", "a.pfm", "--report", "disk/r.json"],
        ):
            with self.subTest(arguments=arguments):
                # A backend that does not exist would be exit code 4: the output is looked at earlier.
                self.assert_one_error(
                    self.crt("scene.yaml", "-b", "nonsense", *arguments, expect=6), "Read-only file system"
                )

    def test_a_disk_that_turns_read_only_keeps_what_it_has(self):
        self.save_samples(8, "disk/c.crtfilm")
        process = self.start(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "30", "--resume", "disk/c.crtfilm",
            "--chunk", "1", fault="slow"
        )
        self.wait_for_rendering(process, resumed=True)
        subprocess.run(["mount", "-o", "remount,ro", self.path("disk")], check=True)
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 6, messages)
        self.assertIn("Read-only file system", messages)
        self.assertEqual(self.report("a.report.json")["samples"]["per_pixel"], 30)
        self.assertEqual(self.resumed_samples("disk/c.crtfilm", 30), 8)


class Shortage(CliTest):
    """The host runs out of memory or threads while the first sample is rendered. The limit is set while the
    program is stopped."""

    SAMPLES, COLUMNS, ROWS = 3, 500, 400  # The slow fake sleeps 2 ms in each row.
    SIZE = ["--set", f"film.resolution=[{COLUMNS},{ROWS}]"]
    FILM_BYTES = 72 * COLUMNS * ROWS

    def start_within_a_sample(self, **start):
        """A render that is stopped in its first sample. After each sample a checkpoint is due."""
        for _ in range(100):
            process = self.start(
                "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", str(self.SAMPLES), "--chunk",
                "1", "--checkpoint", "c.crtfilm", "--checkpoint-every", "1ms", *self.SIZE, fault="slow",
                **start
            )
            self.wait_for_rendering(process)
            process.send_signal(signal.SIGSTOP)
            if not glob.glob(self.path("c.crtfilm*")):
                return process
            process.kill()  # On a busy machine the sample may be finished by now.
            process.communicate()
            for name in glob.glob(self.path("c.crtfilm*")):
                os.remove(name)
        self.fail("every first sample ended before the program could be stopped")

    def go_on(self, process):
        """Until its end: the exit code, and the messages."""
        process.send_signal(signal.SIGCONT)
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        return process.returncode, messages

    def kept_samples(self):
        return self.resumed_samples("c.crtfilm", self.SAMPLES, *self.SIZE)

    def test_samples_outlive_the_memory(self):
        # One arena, and blocks that go back to the system at once: the memory left when an allocation
        # fails does not depend on what was freed before.
        allocator = {
            "MALLOC_ARENA_MAX": "1",
            "MALLOC_MMAP_THRESHOLD_": "65536",
            "MALLOC_TRIM_THRESHOLD_": "65536",
        }
        # Too little to read the film from the device, and to copy it for a checkpoint as well.
        for part in (0.3, 0.8):
            with self.subTest(part=part):
                process = self.start_within_a_sample(**allocator)
                if not harness.allow_memory(process, int(part * self.FILM_BYTES)):
                    self.skipTest("no sanitizer runs within a limit of address space")
                code, messages = self.go_on(process)
                self.assertEqual(code, 5, messages)
                self.assertIn("out of memory on the host", messages)
                self.assertGreater(self.kept_samples(), 0, messages)
                os.remove(self.path("c.crtfilm"))

    def test_rendering_goes_on_without_new_threads(self):
        if why := harness.why_root_must_stay():
            self.skipTest(why)
        # LeakSanitizer starts a thread at the end.
        options = os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"
        process = self.start_within_a_sample(without_root=True, ASAN_OPTIONS=options)
        harness.allow_new_threads(process, False)
        code, messages = self.go_on(process)
        self.assertEqual(code, 0, messages)
        self.assertEqual(self.kept_samples(), self.SAMPLES)


class ReadOnlyDirectory(CliTest):
    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_it_is_found_before_rendering(self):
        os.mkdir(self.path("out"), 0o555)
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "nonsense", "-o", "out/a.pfm", expect=6), "Permission denied"
        )


class UnsoundBackends(CliTest):
    def test_a_backend_that_hangs_is_left_by_the_second_signal(self):
        self.save_samples(8, "c.crtfilm")
        saved = read_bytes(self.path("c.crtfilm"))
        process = self.start(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "16", "--resume", "c.crtfilm", fault="hang"
        )
        self.wait_for_rendering(process, resumed=True)
        process.send_signal(signal.SIGINT)
        time.sleep(0.5)
        self.assertIsNone(process.poll(), "the first signal waits for the chunk")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(read_bytes(self.path("c.crtfilm")), saved)

    def test_a_film_that_is_no_film_is_refused_and_the_saved_one_kept(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "whole.pfm", "--spp", "16")
        self.save_samples(8, "c.crtfilm")
        for fault, words in (("nan_film", "is not a number"), ("count_film", "instead of")):
            with self.subTest(fault=fault):
                run = self.crt(
                    "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "16", "--resume", "c.crtfilm",
                    fault=fault, expect=1
                )
                self.assert_one_error(run, "broke the contract", words)
                self.assertEqual(self.resumed_samples("c.crtfilm", 16), 8)
                self.assertEqual(read_bytes(self.path("b.pfm")), read_bytes(self.path("whole.pfm")))

    def test_a_backend_that_throws_keeps_what_was_saved(self):
        self.save_samples(8, "c.crtfilm")
        run = self.crt(
            "scene.yaml", "-b", "throws_in_render", "-o", "a.pfm", "--spp", "16", "--resume", "c.crtfilm",
            expect=1
        )
        self.assert_one_error(run, "broke the contract", "throws_in_render")
        self.assertEqual(self.resumed_samples("c.crtfilm", 16), 8)


class Radiance(CliTest):
    """At the ends of what scenes may ask for (core/scene/scene_limits.h) nothing is rounded that is not
    rounded in the middle."""

    def test_powers_of_two_round_nothing(self):
        backend = harness.first_real_backend()
        if backend is None:
            self.skipTest("no backend can render light here")
        glass = "materials:\n  glass: {type: dielectric, ior: 1.5}\n"
        pane = (
            "  - name: pane\n    mesh: {positions: [[-1, 1, -1], [-1, 1, 1], [1, 1.2, 1], [1, 1.2, -1]], "
            "faces: [[0, 1, 2, 3]]}\n    material: glass\n"
        )
        lamp = "emission: {radiance: {blackbody: 4000, scale: 5}}"
        self.assertIn(lamp, harness.SCENE)
        images = {}
        for exponent in (0, 83, -83):
            light = f"emission: {{radiance: {2.0 ** exponent!r}}}"
            self.write(
                "scene.yaml", harness.SCENE.replace("materials:\n", glass).replace(lamp, light) + pane
            )
            self.crt(
                "scene.yaml",
                "-b",
                backend,
                "-o",
                "a.pfm",
                "--spp",
                "64",
                "--report",
                "none",
                CRT_BACKEND_PATH="",
            )
            images[exponent] = harness.read_pfm(self.path("a.pfm"))[2]
        self.assertGreater(max(images[0]), 0)
        for exponent in (83, -83):
            self.assertEqual(images[exponent], tuple(value * 2.0 ** exponent for value in images[0]))


class SignalStorm(CliTest):
    def test_a_burst_is_one_wish_to_stop(self):
        process = self.start(
            "scene.yaml", "-b", "fake", "--spp", "64", "-o", "a.pfm", "--chunk", "1", fault="slow"
        )
        self.wait_for_rendering(process)
        for _ in range(20):
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                process.send_signal(number)
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertIn(process.returncode, (130, 143, 129), messages)
        samples = self.report("a.report.json")["samples"]["per_pixel"]
        self.assertTrue(0 < samples < 64)
        self.crt("scene.yaml", "-b", "fake", "--spp", "64", "-o", "b.pfm", "--resume", "a.crtfilm")
        self.assertEqual(self.report("b.report.json")["samples"]["resumed"], samples)

    def test_a_storm_ends_the_program_and_spares_what_was_saved(self):
        self.save_samples(8, "c.crtfilm")
        process = self.start_with_checkpoints("--resume", "c.crtfilm", "--spp", "100000", every="1ms")
        self.wait_for_rendering(process, resumed=True)
        end = time.monotonic() + 10
        while process.poll() is None and time.monotonic() < end:
            process.send_signal(random.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP)))
        process.communicate(timeout=harness.PATIENCE_SECONDS)
        # By itself, or, when all is done and signals have their usual meaning again, by the last signal; a
        # shell says 128 + n in both cases.
        code = process.returncode if process.returncode >= 0 else 128 - process.returncode
        self.assertIn(code, (130, 143, 129))
        self.assertGreaterEqual(self.resumed_samples("c.crtfilm", 1), 8)


if __name__ == "__main__":
    harness.main(__doc__)
