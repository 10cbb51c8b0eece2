#!/usr/bin/env python3
"""The program from outside: what people type, what they see, which files and which exit code they get.

    test_cli.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Where no light transport is needed the backend is `fake` (tests/fake_plugins), which renders a pattern that
depends on seed, pixel and sample as a real one does, and goes wrong on demand (CRT_FAKE_FAULT). Tests that
need light use the first real backend that can run here and are skipped when there is none. Python's standard
library only.
"""

import json
import os
import re
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

EMPTY = """\
crt: 1
film: {resolution: [8, 4], color_space: xyz}
sampler: {samples: 4}
environment: {radiance: 1}
"""

DARK = """\
crt: 1
film: {resolution: [8, 4]}
sampler: {samples: 4}
materials: {white: {type: diffuse, reflectance: 0.8}}
objects:
  - name: wall
    mesh: {positions: [[-2, -2, 2], [2, -2, 2], [2, 2, 2], [-2, 2, 2]], faces: [[0, 1, 2, 3]]}
    material: white
"""


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


class Help(CliTest):
    def test_help_teaches(self):
        text = self.crt("--help").stdout
        for word in (
            "render",
            "compare",
            "merge",
            "info",
            "plugins",
            "schema",
            "--backend",
            "--resume",
            "Examples:",
            "Exit codes:",
        ):
            self.assertIn(word, text)
        self.assertLess(max(map(len, text.splitlines())), 120)

    def test_every_command_has_help(self):
        for command in ("render", "compare", "merge", "develop", "info", "plugins", "schema"):
            self.assertIn(f"{command}", self.crt(command, "--help").stdout.splitlines()[0])

    def test_version(self):
        self.assertRegex(self.crt("--version").stdout, r"^crt \d+\.\d+\.\d+\n$")

    def test_help_and_version_open_no_library(self):
        for flag in ("--help", "--version"):
            run = self.crt(flag, LD_DEBUG="files", LC_ALL="C")
            self.assertNotIn("crt_backend", run.stderr)
            self.assertNotIn("OpenImageIO", run.stderr)

    def test_no_arguments(self):
        self.assert_one_error(self.crt(expect=2), "--help")

    def test_schema(self):
        self.assertEqual(
            json.loads(self.crt("schema").stdout)["$schema"], "http://json-schema.org/draft-07/schema#"
        )
        self.assertIn("## camera", self.crt("schema", "--markdown").stdout)


class WrongCommandLine(CliTest):
    def test_did_you_mean(self):
        self.assert_one_error(
            self.crt("scene.yaml", "--bakend", "fake", expect=2), "'--bakend'", "did you mean '--backend'?"
        )
        self.assert_one_error(
            self.crt("--smaples", "0:4", "scene.yaml", expect=2), "did you mean '--samples'?"
        )
        self.assert_one_error(self.crt("comapre", "a.exr", "b.exr", expect=2), "did you mean 'compare'?")
        self.assert_one_error(
            self.crt("compare", "a.exr", "b.exr", "--tolerence", "1", expect=2),
            "did you mean '--tolerance'?",
        )
        self.assert_one_error(self.crt("scene.yaml", "--kernel", "fulll", expect=2), "did you mean 'full'?")

    def test_values_that_make_no_sense(self):
        for option, value in (
            ("--spp", "0"),
            ("--spp", "many"),
            ("--time", "soon"),
            ("--time", "1h30"),
            ("--samples", "5:5"),
            ("--samples", "5"),
            ("--crop", "1,2,3"),
            ("--crop", "0,0,1000,4"),
            ("--chunk", "-1"),
            ("--seed", "1.5"),
            ("--set", "film.resolution"),
            ("--checkpoint-every", "0s"),
            ("-o", "image.jpeg"),
        ):
            with self.subTest(option=option, value=value):
                run = self.crt(
                    "scene.yaml",
                    "-b",
                    "fake",
                    f"{option}={value}" if option.startswith("--") else f"{option}{value}",
                    expect=2,
                )
                self.assert_one_error(run, value)

    def test_a_missing_value(self):
        self.assert_one_error(self.crt("scene.yaml", "--spp", expect=2), "--spp needs a value")

    def test_samples_and_spp_exclude_each_other(self):
        self.assert_one_error(
            self.crt("scene.yaml", "--spp", "4", "--samples", "0:4", expect=2), "--samples"
        )

    def test_two_scenes(self):
        self.assert_one_error(self.crt("scene.yaml", "other.yaml", expect=2), "'other.yaml'")

    def test_the_same_output_twice(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-o", "./a.pfm", expect=2), "a.pfm"
        )


class WrongScene(CliTest):
    def test_absent(self):
        self.assert_one_error(self.crt("nowhere.yaml", expect=3), "nowhere.yaml")

    def test_unknown_key(self):
        self.write("bad.yaml", SCENE.replace("reflectance: 0.7", "reflectence: 0.7"))
        run = self.crt("bad.yaml", "-b", "fake", expect=3)
        self.assert_one_error(run, "did you mean 'reflectance'?")
        self.assertRegex(run.stderr, r"(?m)^bad\.yaml:7:\d+: error: ")

    def test_wrong_override(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "--set", "film.resolution=[0,4]", expect=3),
            "film.resolution",
        )


class Backends(CliTest):
    def test_unknown(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "cuta", expect=4), "'cuta'", "did you mean 'cuda'?", FAKE_DIR
        )

    def test_broken_plugins(self):
        for name, word in (
            ("missing_library", "libcrt_absent.so.1"),
            ("no_symbol", "crt_backend_v1"),
            ("wrong_layout", "rebuild"),
            ("wrong_abi", "rebuild"),
            ("small_table", "bytes"),
        ):
            with self.subTest(plugin=name):
                self.assert_one_error(self.crt("scene.yaml", "-b", name, expect=4), name, word)

    def test_no_device(self):
        self.assert_one_error(self.crt("scene.yaml", "-b", "no_device", expect=4), "no_device", "driver")

    def test_unknown_device(self):
        self.assert_one_error(self.crt("scene.yaml", "-b", "fake", "-d", "quantum", expect=4), "quantum")

    def test_a_path_is_a_backend(self):
        self.crt("scene.yaml", "-b", os.path.join(FAKE_DIR, "crt_backend_fake.so"), "-o", "a.pfm")

    def test_environment_variable_and_precedence(self):
        self.crt("scene.yaml", "-o", "a.pfm", CRT_BACKEND="fake")
        self.crt("scene.yaml", "-o", "a.pfm", "-b", "fake", CRT_BACKEND="nonsense")
        self.assertEqual(self.report("a.report.json")["backend"]["name"], "fake")

    def test_device_by_name(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-d", "second")
        self.assertEqual(self.report("a.report.json")["backend"]["device"], "second pattern")

    def test_plugins_lists_all(self):
        text = self.crt("plugins").stdout
        for word in ("cuda", "embree", "opencl", "second pattern", "cannot run", "libcrt_absent.so.1"):
            self.assertIn(word, text)

    def test_exception_in_a_plugin_is_an_internal_error(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "throws_in_render", "-o", "a.pfm", expect=1), "broke the contract"
        )


class Rendering(CliTest):
    def test_the_word_render_is_implied(self):
        self.crt("--backend", "fake", "scene.yaml", "-o", "a.pfm")
        self.crt("render", "scene.yaml", "--backend", "fake", "-o", "b.pfm")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    def test_default_outputs(self):
        self.crt("scene.yaml", "-b", "fake")
        for name in ("scene.exr", "scene.png", "scene.report.json"):
            self.assertTrue(os.path.exists(self.path(name)), name)
        self.assertFalse(os.path.exists(self.path("scene.crtfilm")))

    def test_outputs_of_the_scene(self):
        self.write("with.yaml", SCENE + "outputs:\n  - {file: beside.pfm}\n  - {file: beside.ppm}\n")
        self.crt("with.yaml", "-b", "fake")
        self.assertTrue(os.path.exists(self.path("beside.ppm")))
        self.crt("with.yaml", "-b", "fake", "-o", "other.pfm", "--report", "none")
        self.assertTrue(os.path.exists(self.path("other.pfm")))
        self.assertFalse(os.path.exists(self.path("other.report.json")))

    def test_how_it_is_cut_does_not_show(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        reference = read_bytes(self.path("a.pfm"))
        for options in (
            ["--chunk", "1"],
            ["--chunk", "7"],
            ["--tile", "3"],
            ["--kernel", "full"],
            ["-t", "1"],
            ["--no-cache"],
        ):
            with self.subTest(options=options):
                self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", *options)
                self.assertEqual(read_bytes(self.path("b.pfm")), reference)

    def test_crop_cuts_a_window_out_of_the_same_image(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", "--crop", "4,2,10,5")
        width, height, whole = read_pfm(self.path("a.pfm"))
        crop_width, crop_height, part = read_pfm(self.path("b.pfm"))
        self.assertEqual((crop_width, crop_height), (6, 3))
        for y in range(2, 5):  # PFM rows go from the bottom up.
            row = 3 * (width * (height - 1 - y) + 4)
            crop_row = 3 * crop_width * (crop_height - 1 - (y - 2))
            self.assertEqual(part[crop_row:crop_row + 18], whole[row:row + 18])

    def test_seed_is_the_scenes_seed(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--seed", "7")
        self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", "--set", "sampler.seed=7")
        self.crt("scene.yaml", "-b", "fake", "-o", "c.pfm")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))
        self.assertNotEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("c.pfm")))

    def test_time_alone_replaces_the_number_of_samples(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--time", "300ms")
        report = self.report("a.report.json")
        self.assertEqual(report["stop"]["reason"], "time")
        self.assertGreater(report["samples"]["per_pixel"], 16)
        self.assertLess(report["seconds"]["sampling"], 2)

    def test_time_and_samples_whichever_comes_first(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--time", "1h", "--spp", "3")
        self.assertEqual(self.report("a.report.json")["samples"]["per_pixel"], 3)

    def test_invalid_samples_are_counted_and_said(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", fault="nan")
        self.assertIn("warning", run.stderr)
        report = self.report("a.report.json")
        self.assertGreater(report["samples"]["invalid"], 0)
        self.assertGreater(report["warnings"], 0)

    def test_quiet_says_nothing(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-q")
        self.assertEqual(run.stdout + run.stderr, "")

    def test_report(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        report = self.report("a.report.json")
        expected = {
            "crt": ["version", "command", "finished"],
            "host": ["cpu", "os", "threads"],
            "backend": [
                "name",
                "version",
                "build",
                "path",
                "device",
                "driver",
                "kernel",
                "kernel_features",
                "kernel_from_cache",
                "registers",
                "spill_bytes",
            ],
            "scene": [
                "file",
                "title",
                "hash",
                "files_read",
                "width",
                "height",
                "objects",
                "triangles",
                "emitters",
                "nodes",
                "images",
                "seed",
            ],
            "features": ["mask", "kept", "left_out"],
            "seconds": [
                "parse",
                "build",
                "compile",
                "open",
                "prepare",
                "kernel_compile",
                "cache",
                "upload",
                "render",
                "sampling",
                "write",
                "other",
                "total",
            ],
            "samples": ["target", "per_pixel", "resumed", "rendered", "ranges", "chunks", "invalid"],
            "rays": ["paths", "closest", "shadow"],
            "speed": ["mpaths_per_second", "mrays_per_second"],
            "memory": ["scene_bytes", "texel_bytes", "host_peak_bytes", "device_peak_bytes"],
            "error": [
                "knowledge",
                "mean_luminance",
                "degrees_of_freedom",
                "relative_rmse",
                "relative_rmse_95",
                "half_width_95",
                "mean_luminance_standard_error",
                "mean_luminance_95",
                "to_target",
            ],
            "stop": ["reason", "signal", "failure", "exit_code"],
        }
        for section, keys in expected.items():
            self.assertEqual(list(report[section]), keys, section)
        self.assertEqual(report["samples"]["ranges"], [[0, 16]])
        self.assertEqual(report["rays"]["paths"], 16 * 24 * 16)
        self.assertEqual(report["outputs"], ["a.pfm"])
        self.assertEqual(report["stop"]["reason"], "samples")
        self.assertRegex(report["scene"]["hash"], r"^[0-9a-f]{32}$")
        self.assertIn("area-light", report["features"]["kept"])
        self.assertTrue(all(entry["why"] for entry in report["features"]["left_out"]))
        self.assertGreater(report["memory"]["host_peak_bytes"], 1 << 20)

    def test_a_pfm_render_maps_no_image_library(self):
        process = self.start(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--chunk", "1", "--spp", "100", fault="slow"
        )
        self.wait_for_rendering(process)
        with open(f"/proc/{process.pid}/maps", encoding="utf-8") as file:
            maps = file.read()
        self.assertIn("crt_backend_fake.so", maps)
        for library in ("OpenImageIO", "OpenEXR", "libpng", "libembree", "libOpenCL", "libcuda"):
            self.assertNotIn(library, maps)

    def test_progress_on_a_pipe_is_a_line_in_ten_seconds(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--time", "11s", fault="slow")
        self.assertNotIn("\r", run.stderr)
        self.assertNotIn("\x1b", run.stderr)
        lines = [line for line in run.stderr.splitlines() if re.search(r"\d+ %.*spp.*paths/s.*left", line)]
        self.assertEqual(len(lines), 1, run.stderr)


class Outputs(CliTest):
    def test_no_folder_is_made_of_a_typing_error(self):
        os.mkdir(self.path("out"))
        for option in (
            ["-o", "oit/a.pfm"],
            ["-o", "a.pfm", "--report", "oit/r.json"],
            ["-o", "a.pfm", "--checkpoint", "oit/a.crtfilm"],
        ):
            self.assert_one_error(
                self.crt("scene.yaml", "-b", "nonsense", *option, expect=6),
                "no folder 'oit'",
                "did you mean 'out'?",
            )
        self.crt("scene.yaml", "-b", "fake", "-o", "out/a.pfm", "-o", "out/a.crtfilm")
        self.assert_one_error(
            self.crt("develop", "out/a.crtfilm", "-o", "oit/a.pfm", expect=6), "did you mean 'out'?"
        )
        self.assert_one_error(
            self.crt("merge", "out/a.crtfilm", "-o", "oit/a.pfm", expect=6), "did you mean 'out'?"
        )
        self.assert_one_error(
            self.crt("compare", "out/a.pfm", "out/a.pfm", "--diff", "oit/d.pfm", expect=6),
            "did you mean 'out'?",
        )
        self.assert_one_error(
            self.crt("reference", "scene.yaml", "-o", "oit/r.exr", expect=6), "did you mean 'out'?"
        )
        self.assert_one_error(
            self.crt("converge", "scene.yaml", "--backends", "fake", "-o", "oit/c", expect=6),
            "did you mean 'out'?",
        )
        self.assert_one_error(
            self.crt("verify", "--backend", "fake", "--case", "A01", "-o", "oit/v", expect=6),
            "did you mean 'out'?",
        )
        self.assertFalse(os.path.exists(self.path("oit")))
        self.write("with.yaml", SCENE + "outputs:\n  - {file: sub/beside.pfm}\n")
        self.assert_one_error(
            self.crt("with.yaml", "-b", "nonsense", expect=6), "no folder 'sub'", "mkdir -p 'sub'"
        )

    def test_unwritable_is_found_before_anything_is_opened(self):
        # A backend that does not exist would be exit code 4: the output is looked at earlier.
        for arguments in (
            ["-o", "/nowhere/at/all/a.pfm"],
            ["-o", "scene.yaml/a.pfm"],
            ["-o", "a.pfm", "--report", "/nowhere/at/all/r.json"],
            ["-o", "a.pfm", "--checkpoint", "/nowhere/at/all/c.crtfilm"],
        ):
            with self.subTest(arguments=arguments):
                begin = time.monotonic()
                self.assert_one_error(self.crt("scene.yaml", "-b", "nonsense", *arguments, expect=6))
                self.assertLess(time.monotonic() - begin, 1)

    def test_an_output_that_becomes_unwritable_costs_no_samples(self):
        os.mkdir(self.path("out"))
        process = self.start(
            "scene.yaml",
            "-b",
            "fake",
            "-o",
            "kept.pfm",
            "-o",
            "out/a.pfm",
            "--chunk",
            "1",
            "--spp",
            "30",
            fault="slow",
        )
        self.wait_for_rendering(process)
        shutil.rmtree(self.path("out"))
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 6, messages)
        self.assertTrue(os.path.exists(self.path("kept.pfm")))
        self.crt(
            "scene.yaml", "-b", "fake", "-o", "kept.pfm", "--spp", "30", "--resume", "--report", "r.json"
        )
        self.assertEqual(self.report("r.json")["samples"]["resumed"], 30)


class StoppingAndGoingOn(CliTest):
    def interrupt(self, number, code):
        self.crt("scene.yaml", "-b", "fake", "--spp", "64", "-o", "whole.pfm")
        process = self.start(
            "scene.yaml", "-b", "fake", "--spp", "64", "-o", "part.pfm", "--chunk", "1", fault="slow"
        )
        self.wait_for_rendering(process)
        process.send_signal(number)
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, messages)
        report = self.report("part.report.json")
        self.assertEqual(report["stop"]["reason"], "interrupted")
        self.assertEqual(report["stop"]["exit_code"], code)
        self.assertTrue(0 < report["samples"]["per_pixel"] < 64, report["samples"])
        self.assertTrue(os.path.exists(self.path("part.pfm")))
        self.assertTrue(os.path.exists(self.path("part.crtfilm")))
        self.assertIn("--resume", messages)
        self.crt("scene.yaml", "-b", "fake", "--spp", "64", "-o", "part.pfm", "--resume")
        self.assertEqual(
            self.report("part.report.json")["samples"]["resumed"], report["samples"]["per_pixel"]
        )
        self.assertEqual(read_bytes(self.path("part.pfm")), read_bytes(self.path("whole.pfm")))

    def test_ctrl_c_then_resume_gives_the_same_bits(self):
        self.interrupt(signal.SIGINT, 130)

    def test_kill_then_resume_gives_the_same_bits(self):
        self.interrupt(signal.SIGTERM, 143)

    def test_a_signal_delivered_twice_at_once_is_one(self):
        # timeout(1) signals its child and then the whole process group.
        process = self.start(
            "scene.yaml", "-b", "fake", "--spp", "64", "-o", "part.pfm", "--chunk", "1", fault="slow"
        )
        self.wait_for_rendering(process)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 143)
        self.assertTrue(os.path.exists(self.path("part.crtfilm")))

    def test_the_second_signal_leaves_at_once(self):
        # 4000 rows of 2 ms: one chunk takes eight seconds.
        process = self.start(
            "scene.yaml", "-b", "fake", "--set", "film.resolution=[1,4000]", "-o", "part.pfm", fault="slow"
        )
        self.wait_for_rendering(process)
        process.send_signal(signal.SIGINT)
        time.sleep(0.5)
        self.assertIsNone(process.poll())
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertLess(time.monotonic() - begin, 2)
        self.assertFalse(os.path.exists(self.path("part.pfm")))

    def test_resume_raises_the_target(self):
        self.crt("scene.yaml", "-b", "fake", "--spp", "40", "-o", "whole.pfm")
        self.crt("scene.yaml", "-b", "fake", "--spp", "10", "-o", "a.pfm", "--checkpoint", "c.crtfilm")
        self.crt(
            "scene.yaml", "-b", "fake", "--spp", "25", "-o", "a.pfm", "--resume", "c.crtfilm"
        )  # Keeps c.crtfilm up to date.
        self.crt("--resume", "c.crtfilm", "scene.yaml", "-b", "fake", "--spp", "40", "-o", "a.pfm")
        self.assertEqual(self.report("a.report.json")["samples"]["resumed"], 25)
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("whole.pfm")))

    def test_resume_does_not_swallow_the_scene(self):
        self.crt("--resume", "scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.assertTrue(os.path.exists(self.path("a.crtfilm")))

    def test_a_complete_checkpoint_needs_no_backend(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--checkpoint", "c.crtfilm")
        self.crt("scene.yaml", "-b", "nonsense", "-o", "b.pfm", "--resume", "c.crtfilm")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    def test_checkpoints_are_written_on_the_way(self):
        process = self.start(
            "scene.yaml",
            "-b",
            "fake",
            "-o",
            "a.pfm",
            "--checkpoint",
            "c.crtfilm",
            "--checkpoint-every",
            "50ms",
            "--chunk",
            "1",
            "--spp",
            "100",
            fault="slow",
        )
        self.wait_for_rendering(process)
        time.sleep(0.5)
        process.kill()  # As a power cut would.
        process.communicate()
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "100", "--resume", "c.crtfilm")
        self.assertGreater(self.report("a.report.json")["samples"]["resumed"], 0)
        self.crt("scene.yaml", "-b", "fake", "-o", "b.pfm", "--spp", "100")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    def test_a_checkpoint_of_another_scene_is_refused(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--checkpoint", "c.crtfilm")
        for change in (["--seed", "1"], ["--set", "camera.fov=41"], ["--crop", "0,0,8,8"]):
            with self.subTest(change=change):
                run = self.crt(
                    "scene.yaml",
                    "-b",
                    "fake",
                    "-o",
                    "a.pfm",
                    "--resume",
                    "c.crtfilm",
                    "--spp",
                    "32",
                    *change,
                    expect=2,
                )
                self.assert_one_error(run, "c.crtfilm")
        # The number of samples is not part of what is seen.
        self.crt(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--resume", "c.crtfilm", "--set", "sampler.samples=32"
        )

    def test_a_damaged_or_absent_checkpoint_is_refused(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "--resume", "none.crtfilm", expect=2), "none.crtfilm"
        )
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "--resume", "n" * 300 + ".crtfilm", expect=2), "nnn.crtfilm"
        )
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--checkpoint", "c.crtfilm")
        with open(self.path("c.crtfilm"), "r+b") as file:
            file.truncate(os.path.getsize(self.path("c.crtfilm")) // 2)
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "--resume", "c.crtfilm", expect=2), "c.crtfilm"
        )

    def test_samples_that_are_there_already_are_refused(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--samples", "0:8", "--checkpoint", "c.crtfilm")
        run = self.crt(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--samples", "4:12", "--resume", "c.crtfilm", expect=2
        )
        self.assert_one_error(run, "overlap")

    def test_gaps_are_filled(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "whole.pfm", "--spp", "24")
        self.crt("scene.yaml", "-b", "fake", "-o", "c.crtfilm", "--samples", "8:16")
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--resume", "c.crtfilm", "--spp", "24")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("whole.pfm")))


class DeviceFailures(CliTest):
    def test_out_of_memory_with_nothing_rendered(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", fault="oom", expect=5)
        self.assert_one_error(run, "memory")
        self.assertFalse(os.path.exists(self.path("a.pfm")))
        self.assertEqual(self.report("a.report.json")["stop"]["reason"], "failed")

    def test_what_was_there_is_saved(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "whole.pfm", "--spp", "32")
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "8", "--checkpoint", "a.crtfilm")
        os.remove(self.path("a.pfm"))
        run = self.crt(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "32", "--resume", fault="device", expect=5
        )
        self.assert_one_error(run, "fell off the bus")
        report = self.report("a.report.json")
        self.assertEqual((report["stop"]["reason"], report["stop"]["exit_code"]), ("failed", 5))
        self.assertIn("fell off the bus", report["stop"]["failure"])
        self.assertTrue(os.path.exists(self.path("a.pfm")))
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "32", "--resume")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("whole.pfm")))


class Merging(CliTest):
    def test_two_halves_are_the_whole(self):
        self.crt("scene.yaml", "-b", "fake", "--samples", "0:32", "-o", "a.crtfilm")
        self.crt("scene.yaml", "-b", "fake", "--samples", "32:64", "-o", "b.crtfilm")
        self.crt("scene.yaml", "-b", "fake", "--samples", "0:64", "-o", "whole.crtfilm", "-o", "whole.pfm")
        self.crt("merge", "-o", "merged.crtfilm", "b.crtfilm", "a.crtfilm")
        self.crt("merge", "--scene", "scene.yaml", "-o", "merged.pfm", "a.crtfilm", "b.crtfilm")
        self.assertEqual(read_bytes(self.path("merged.pfm")), read_bytes(self.path("whole.pfm")))
        self.assertIn("64 per pixel: 0-64", self.crt("info", "merged.crtfilm").stdout)
        self.crt("compare", "merged.pfm", "whole.pfm")

    def test_overlap_and_other_scenes_are_refused(self):
        self.crt("scene.yaml", "-b", "fake", "--samples", "0:8", "-o", "a.crtfilm")
        self.crt("scene.yaml", "-b", "fake", "--samples", "4:12", "-o", "b.crtfilm")
        self.crt("scene.yaml", "-b", "fake", "--samples", "8:16", "--seed", "3", "-o", "c.crtfilm")
        self.assert_one_error(
            self.crt("merge", "-o", "m.crtfilm", "a.crtfilm", "b.crtfilm", expect=2), "b.crtfilm"
        )
        self.assert_one_error(
            self.crt("merge", "-o", "m.crtfilm", "a.crtfilm", "c.crtfilm", expect=2), "c.crtfilm"
        )
        self.assert_one_error(
            self.crt("merge", "--scene", "scene.yaml", "-o", "m.pfm", "c.crtfilm", expect=2), "c.crtfilm"
        )
        self.crt("merge", "--scene", "scene.yaml", "--seed", "3", "-o", "m.pfm", "c.crtfilm")


LIT = SCENE.replace("radiance: {blackbody: 4000, scale: 5}", "radiance: glow").replace(
    "materials:", "spectra: {glow: {blackbody: 4000, scale: 5}}\nmaterials:")
WITH_AOVS = (
    LIT
    + "outputs: [{file: scene.exr, aovs: [albedo, normal, depth, primitive, variance, samples, error]}]\n"
)


# A film of format 2, which held no record.
OLD_FILM = """
89435254460d0a1a0200000078000000c000000000000000a07c53a2d2fe44e401000000010000000400000000000000
303132333435363738396162636465663031323334353637383961626364656605000000010000000200000000000000
03000000000000000500000000000000302e312e30000000000000000000f83f00000000000000000000000000000000
000000000000000000000000000000000000000000000000000000000000000000000000000000000200000000000000
"""


class Developing(CliTest):
    """What a film says of its scene is enough to make every image of it again."""

    def setUp(self):
        super().setUp()
        self.write("lit.yaml", WITH_AOVS)

    def crt(self, *arguments, **others):
        others.setdefault("SOURCE_DATE_EPOCH", "1700000000")
        return super().crt(*arguments, **others)

    def render_film(self, *options):
        self.crt("lit.yaml", "-b", "fake", "--spp", "64", "-o", "a.crtfilm", *options)
        os.rename(self.path("lit.yaml"), self.path("away.yaml"))  # The film is all there is.

    def assert_same_files(self, *names):
        for name in names:
            self.assertEqual(read_bytes(self.path("r" + name)), read_bytes(self.path("d" + name)), name)

    def test_every_file_is_that_of_a_render_with_these_settings(self):
        self.render_film()
        files = [".exr", ".png", ".pfm", ".ppm"]
        for changes in (
            [],
            ["film.exposure_ev=1.3"],
            ["film.white_balance=glow"],
            ["film.white_balance=D50"],
            ["film.white_balance={blackbody: 3000}", "film.exposure_ev=-2"],
            ["film.color_space=acescg"],
            ["film.color_space=xyz", "film.white_balance=A"],
            ["film.apply_to_float=true", "film.exposure_ev=2", "film.white_balance=glow"],
            ["film.white_balance=A", "film.white_balance=glow"],
            ["film.white_balance=glow", "film.white_balance=null"],
        ):
            with self.subTest(changes=changes):
                sets = [word for change in changes for word in ("--set", change)]
                self.crt(
                    "away.yaml",
                    "-b",
                    "fake",
                    "--spp",
                    "64",
                    *sets,
                    *[w for f in files for w in ("-o", "r" + f)],
                )
                self.crt(
                    "develop",
                    "a.crtfilm",
                    *sets,
                    *[w for f in files for w in ("-o", "d" + f)],
                    CRT_BACKEND_PATH="/nowhere",
                )
                self.assert_same_files(*files)
        self.assertIn("StdError.Y", self.crt("info", "d.exr").stdout)

    def test_films_that_were_interrupted_resumed_or_merged(self):
        self.crt("lit.yaml", "-b", "fake", "--samples", "0:24", "-o", "a.crtfilm")
        self.crt("lit.yaml", "-b", "fake", "--samples", "24:64", "-o", "b.crtfilm")
        self.crt(
            "lit.yaml", "-b", "fake", "--spp", "64", "-o", "r.pfm", "-o", "r.png", "--resume", "a.crtfilm"
        )
        self.crt("lit.yaml", "-b", "fake", "--samples", "0:24", "-o", "a.crtfilm", "--overwrite")
        self.crt("develop", "b.crtfilm", "a.crtfilm", "-o", "d.pfm")
        self.assert_same_files(".pfm")
        self.crt("merge", "b.crtfilm", "a.crtfilm", "-o", "m.crtfilm", "-o", "d.pfm")
        self.assert_same_files(".pfm")
        self.crt("develop", "m.crtfilm", "-o", "d.pfm")
        self.assert_same_files(".pfm")

    def test_crop_is_the_window_of_a_cropped_render(self):
        self.crt(
            "lit.yaml",
            "-b",
            "fake",
            "--spp",
            "64",
            "-o",
            "r.exr",
            "-o",
            "r.pfm",
            "-o",
            "r.crtfilm",
            "--crop",
            "4,2,10,5",
        )
        self.render_film()
        for crop in (["--crop", "4,2,10,5"], ["--set", "film.crop=[4, 2, 10, 5]"]):
            self.crt("develop", "a.crtfilm", "-o", "d.exr", "-o", "d.pfm", *crop)
            self.assert_same_files(".pfm")
            self.crt("compare", "--all-channels", "r.exr", "d.exr")
        # A film that is itself a window, in pixels of the whole.
        self.crt("develop", "r.crtfilm", "-o", "r.pfm", "--crop", "5,3,8,5")
        self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--crop", "5,3,8,5")
        self.assert_same_files(".pfm")
        self.assert_one_error(
            self.crt("develop", "r.crtfilm", "-o", "d.pfm", "--crop", "0,0,8,5", expect=2),
            "4,2,10,5",
            "24 × 16",
        )
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--crop", "0,0,25,5", expect=2), "0,0,25,5"
        )

    def test_other_aovs_than_the_scenes(self):
        self.render_film("--set", "outputs.0.aovs=[depth]")
        self.crt("develop", "a.crtfilm", "-o", "d.exr")
        self.assertRegex(self.crt("info", "d.exr").stdout, r"channels +R, G, B, Z\n")
        self.crt("develop", "a.crtfilm", "-o", "d.exr", "--aovs", "error,samples")
        self.assertRegex(
            self.crt("info", "d.exr").stdout, r"channels +R, G, B, StdError.Y\n *integers +sampleCount\n"
        )
        self.crt("develop", "a.crtfilm", "-o", "d.exr", "--aovs", "none")
        self.assertRegex(self.crt("info", "d.exr").stdout, r"channels +R, G, B\n")
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.exr", "--aovs", "normal", expect=2),
            "normal",
            "rendered without",
        )
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.exr", "--aovs", "eror", expect=2),
            "did you mean 'error'?",
        )
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.png", "--aovs", "error", expect=2), "only .exr"
        )

    def test_what_needs_a_render_and_what_is_no_key(self):
        self.render_film()
        for key in (
            "sampler.samples=4",
            "sampler.seed=4",
            "camera.fov=30",
            "film.filter=gaussian",
            "film.resolution=[8,8]",
            "integrator.max_depth=3",
            "materials.floor.reflectance=0",
            "spectra.glow=1",
            "objects.0.name=x",
            "film={}",
        ):
            with self.subTest(key=key):
                run = self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--set", key, expect=2)
                self.assert_one_error(run, "needs a render", key.split("=")[0])
        for key, hint in (
            ("film.exposure_eb=1", "film.exposure_ev"),
            ("exposure_ev=1", "film.exposure_ev"),
            ("camra.fov=1", "there is no key"),
        ):
            self.assert_one_error(
                self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--set", key, expect=2), hint
            )
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--set", "film.white_balance=glwo", expect=2),
            "did you mean 'glow'?",
        )
        self.assert_one_error(
            self.crt("develop", "a.crtfilm", "-o", "d.pfm", "--set", "film.exposure_ev=much", expect=3),
            "expected a number",
        )
        self.assert_one_error(self.crt("develop", "a.crtfilm", "-o", "d.crtfilm", expect=2), "crt merge")
        self.assert_one_error(self.crt("develop", "away.yaml", "-o", "d.pfm", expect=2), "not a crt film")
        self.assertFalse(os.path.exists(self.path("d.pfm")))

    def test_a_film_without_a_record_asks_for_its_scene(self):
        self.render_film()
        with open(self.path("a.crtfilm"), "rb") as file:
            self.assertIn(b'"exposure_ev"', file.read(4096))
        # Of the format before records; one pixel.
        with open(self.path("old.crtfilm"), "wb") as file:
            file.write(bytes.fromhex(OLD_FILM))
        self.assertIn("1 x 1 pixels", self.crt("info", "old.crtfilm").stdout)
        for command in ("develop", "merge"):
            self.assert_one_error(self.crt(command, "old.crtfilm", "-o", "d.pfm", expect=2), "--scene")
        self.crt("merge", "old.crtfilm", "-o", "m.crtfilm")

    def test_a_wrong_date_is_refused_before_the_render(self):
        self.assert_one_error(
            self.crt("lit.yaml", "-b", "nonsense", "-o", "a.pfm", expect=2, SOURCE_DATE_EPOCH="today"),
            "SOURCE_DATE_EPOCH",
        )


class FloatFiles(CliTest):
    """EXR and PFM hold the radiance of the scene; exposure and white balance are for the screen."""

    def test_exposure_and_white_balance_go_where_they_belong(self):
        self.write("lit.yaml", WITH_AOVS)
        changes = ["--set", "film.exposure_ev=1", "--set", "film.white_balance=glow"]
        render = ["lit.yaml", "-b", "fake", "--spp", "64", "--report", "none"]
        self.crt(*render, "-o", "plain.pfm", "-o", "plain.exr", "-o", "plain.ppm")
        self.crt(*render, "-o", "a.pfm", "-o", "a.exr", "-o", "a.ppm", *changes)
        self.assertEqual(read_bytes(self.path("plain.pfm")), read_bytes(self.path("a.pfm")))
        self.crt("compare", "--all-channels", "plain.exr", "a.exr")
        self.assertNotEqual(read_bytes(self.path("plain.ppm")), read_bytes(self.path("a.ppm")))
        info = self.crt("info", "a.exr").stdout
        for line in (
            r"crt/exposure +0\n",
            r"crt/whiteBalance +none\n",
            r"crt/displayExposure +1\n",
            r"crt/displayWhiteBalance +0\.3",
        ):
            self.assertRegex(info, line)
        self.crt(
            *render,
            "-o",
            "b.pfm",
            "-o",
            "b.exr",
            "-o",
            "b.ppm",
            *changes,
            "--set",
            "film.apply_to_float=true",
        )
        self.assertNotEqual(read_bytes(self.path("plain.pfm")), read_bytes(self.path("b.pfm")))
        self.assertEqual(read_bytes(self.path("a.ppm")), read_bytes(self.path("b.ppm")))
        info = self.crt("info", "b.exr").stdout
        self.assertRegex(info, r"crt/exposure +1\n")
        self.assertNotIn("displayExposure", info)
        self.assertIn("differ in exposure", self.crt("compare", "a.exr", "b.exr", expect=7).stdout)

    def test_exposure_doubles_error_and_image_alike(self):
        self.write("lit.yaml", WITH_AOVS)
        render = [
            "lit.yaml",
            "-b",
            "fake",
            "--spp",
            "64",
            "--report",
            "none",
            "--set",
            "film.apply_to_float=true",
        ]
        for ev in "0", "1":
            self.crt(*render, "-o", ev + ".exr", "--set", "film.exposure_ev=" + ev)
            self.crt(*render, "-o", ev + "_other.exr", "--set", "film.exposure_ev=" + ev, "--seed", "5")
        # What noise compare sees does not depend on the exposure of both.
        seen = [
            json.loads(self.crt("compare", e + ".exr", e + "_other.exr", "--json", expect=7).stdout)
            for e in "01"
        ]
        self.assertEqual(2 * seen[0]["metrics"]["rmse"], seen[1]["metrics"]["rmse"])
        self.assertEqual(seen[0]["metrics"]["relative_rmse"], seen[1]["metrics"]["relative_rmse"])
        for what in ("rms_z", "tiles", "pixels"):
            self.assertEqual(seen[0]["noise"][what], seen[1]["noise"][what], what)


class Comparing(CliTest):
    def test_same_and_different(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-o", "b.pfm")
        self.crt("scene.yaml", "-b", "fake", "--seed", "1", "-o", "c.pfm")
        self.crt("compare", "a.pfm", "b.pfm")
        self.crt("compare", "a.pfm", "c.pfm", expect=7)
        self.crt("compare", "a.pfm", "c.pfm", "--tolerance", "10")
        result = json.loads(
            self.crt("compare", "a.pfm", "c.pfm", "--json", "--diff", "d.pfm", expect=7).stdout
        )
        self.assertFalse(result["same"])
        self.assertTrue(os.path.exists(self.path("d.pfm")))

    def test_json_beside_the_text_and_instead_of_it(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        text = self.crt("compare", "a.pfm", "a.pfm", "--json", "out.json").stdout
        self.assertIn("same bits", text)
        with open(self.path("out.json")) as file:
            self.assertTrue(json.load(file)["same"])
        self.assertTrue(json.loads(self.crt("compare", "--json", "a.pfm", "a.pfm").stdout)["same"])

    def test_the_first_difference_in_ulps(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        shutil.copy(self.path("a.pfm"), self.path("b.pfm"))
        with open(
            self.path("b.pfm"), "r+b"
        ) as file:  # The last float of a PFM belongs to the top row's last pixel: B of 23,0.
            file.seek(-4, os.SEEK_END)
            value = struct.unpack("<i", file.read(4))[0]
            file.seek(-4, os.SEEK_END)
            file.write(struct.pack("<i", value + 3))
        text = self.crt("compare", "a.pfm", "b.pfm", expect=7).stdout
        self.assertRegex(text, r"first difference +pixel 23,0 channel B: .* \(3 ulp\)")
        self.assertRegex(text, r"HDR-FLIP")

    def test_noise_reference_and_z_map(self):
        scene = SCENE + "outputs: [{file: a.exr, aovs: [variance]}]\n"
        with open(self.path("with.yaml"), "w") as file:
            file.write(scene)
        for seed, name in ((1, "a.exr"), (2, "b.exr"), (3, "r.exr")):
            self.crt("with.yaml", "-b", "fake", "--seed", str(seed), "--spp", "256", "-o", name)
        text = self.crt(
            "compare", "a.exr", "b.exr", "--reference", "r.exr", "--map", "z.png", expect=7
        ).stdout
        self.assertIn("may be noise", text)
        self.assertIn("0 of 6 tests differ beyond noise", text)
        self.assertIn("Against the reference R", text)
        with open(self.path("z.png"), "rb") as file:
            self.assertEqual(file.read(4), b"\x89PNG")
        self.crt("with.yaml", "-b", "fake_biased", "--seed", "4", "--spp", "256", "-o", "c.exr")
        self.assertIn("more than noise", self.crt("compare", "c.exr", "b.exr", expect=7).stdout)
        run = self.crt("compare", "a.exr", "a.exr", "--map", "z.png", expect=2)
        self.assert_one_error(run, "seed 1")

    def test_other_exposure_white_balance_and_colour_space_are_refused(self):
        changes = {
            "exposure": "film.exposure_ev=1",
            "white balance": "film.white_balance=A",
            "colour space": "film.color_space=acescg",
        }
        to_floats = ["--set", "film.apply_to_float=true"]
        for ending in ("exr", "png"):
            self.crt("scene.yaml", "-b", "fake", "-o", "a." + ending)
            self.crt("scene.yaml", "-b", "fake", "--seed", "1", "-o", "c." + ending)
            for what, change in changes.items():
                if ending == "png" and what == "colour space":
                    continue  # All PNG files are sRGB.
                self.crt("scene.yaml", "-b", "fake", "--set", change, *to_floats, "-o", "b." + ending)
                text = self.crt(
                    "compare", "a." + ending, "b." + ending, "--tolerance", "1e9", expect=7
                ).stdout
                self.assertIn("different: A and B differ in " + what, text)
                run = self.crt(
                    "compare", "a." + ending, "c." + ending, "--reference", "b." + ending, expect=2
                )
                self.assert_one_error(run, "A and R differ in " + what)
        self.crt("scene.yaml", "-b", "fake", "--set", "film.color_space=acescg", "-o", "b.exr")
        self.assertIn(
            "differ in colour space: sRGB and ACEScg", self.crt("compare", "a.png", "b.exr", expect=7).stdout
        )
        # PFM says nothing of all that: what is supposed is said.
        self.crt("scene.yaml", "-b", "fake", "--set", "film.color_space=acescg", "-o", "b.pfm")
        self.assertIn(
            "A does not say its colour space; it is taken as that of B: ACEScg",
            self.crt("compare", "b.pfm", "b.exr").stdout,
        )

    def test_what_was_asked_for_and_cannot_be_is_an_error(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.crt("scene.yaml", "-b", "fake", "--crop", "0,0,8,8", "-o", "b.pfm")
        for option, file, words in (("--diff", "d.pfm", "a difference image"), ("--map", "z.pfm", "a z map"),
                                    ("--reference", "a.pfm", "errors against a reference")):
            run = self.crt("compare", "a.pfm", "b.pfm", option, file, expect=2)
            self.assertIn("different: the images differ in size", run.stdout)
            self.assert_one_error(run, words)

    def test_an_image_says_how_surely_it_knows_its_error(self):
        with open(self.path("with.yaml"), "w") as file:
            file.write(SCENE + "outputs: [{file: a.exr, aovs: [variance]}]\n")
        self.crt("with.yaml", "-b", "fake", "--spp", "256", "-o", "a.exr")
        self.crt("with.yaml", "-b", "fake", "--spp", "256", "--seed", "2", "-o", "b.exr")
        info = self.crt("info", "a.exr").stdout
        degrees = re.search(r"crt/errorDegreesOfFreedom +(\d+)", info).group(1)
        text = self.crt("compare", "a.exr", "b.exr", expect=7).stdout
        self.assertIn("Variance.Y, %s degrees of freedom a pixel" % degrees, text)
        self.assertNotIn("not stated", text)

    def test_backends_that_agree(self):
        run = self.crt("compare", "--backends", "fake,fake", "scene.yaml", "--spp", "64", "--json", "v.json")
        self.assertIn("fake against fake: PASS", run.stdout)
        self.assertIn("same bits", run.stdout)
        with open(self.path("v.json")) as file:
            verdict = json.load(file)
        self.assertTrue(verdict["passes"])
        self.assertEqual([m["channel"] for m in verdict["backends"][0]["means"]], ["X", "Y", "Z"])

    def test_a_backend_that_is_two_percent_brighter(self):
        text = self.crt(
            "compare", "--backends", "fake_biased,fake", "scene.yaml", "--spp", "64", expect=7
        ).stdout
        self.assertIn("fake_biased against fake: FAIL", text)
        self.assertIn("OTHER BITS", text)
        # Wider means are allowed; tiles are still tested for any difference.
        text = self.crt(
            "compare",
            "--backends",
            "fake_biased,fake",
            "scene.yaml",
            "--spp",
            "64",
            "--delta",
            "3%",
            expect=7,
        ).stdout
        self.assertNotIn("means of channel", text)
        self.assertRegex(text, r"because +\d+ of 18 tile tests differ")

    def test_backends_with_too_few_samples_or_with_nan(self):
        text = self.crt(
            "compare", "--backends", "fake,fake", "scene.yaml", "--spp", "1", "--delta", "0.1%", expect=7
        ).stdout
        self.assertIn("INCONCLUSIVE", text)
        self.assertRegex(text, r"about --spp \d+")
        text = self.crt(
            "compare", "--backends", "fake,fake", "scene.yaml", "--spp", "64", expect=7, CRT_FAKE_FAULT="nan"
        ).stdout
        self.assertIn("INCONCLUSIVE", text)
        self.assertIn("samples were no numbers", text)

    def test_backends_asked_for_wrongly(self):
        self.assert_one_error(self.crt("compare", "--backends", "fake", "scene.yaml", expect=2), "two names")
        self.assert_one_error(
            self.crt("compare", "--backends", "fake,,fake", "scene.yaml", expect=2), "fake,,fake"
        )
        self.assert_one_error(
            self.crt("compare", "--backends", "fake,fake", "scene.yaml", "b.pfm", expect=2), "b.pfm"
        )
        self.assert_one_error(
            self.crt("compare", "--backends", "fake,absent", "scene.yaml", expect=4), "absent"
        )
        self.assert_one_error(self.crt("compare", "a.pfm", "b.pfm", "--spp", "4", expect=2), "--backends")
        self.assert_one_error(self.crt("compare", "a.pfm", expect=2), "--backends")
        self.assert_one_error(self.crt("compare", "a.pfm", "b.pfm", "--seed", "4", expect=2), "--backends")

    def test_other_size_and_absent(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.crt("scene.yaml", "-b", "fake", "--crop", "0,0,8,8", "-o", "b.pfm")
        self.crt("compare", "a.pfm", "b.pfm", expect=7)
        self.assert_one_error(self.crt("compare", "a.pfm", "nowhere.pfm", expect=2), "nowhere.pfm")


class Info(CliTest):
    def test_scene(self):
        text = self.crt("info", "scene.yaml").stdout
        for word in (
            "A lamp over a floor",
            "24 x 16",
            "2 objects, 4 triangles",
            "floor (diffuse)",
            "1 emitting triangle or parallelogram",
            "a loop over all",
            "area-light",
            "left out",
            "scene hash",
        ):
            self.assertIn(word, text)

    def test_film_and_image(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.crtfilm", "-o", "a.exr")
        self.assertIn("16 per pixel: 0-16", self.crt("info", "a.crtfilm").stdout)
        text = self.crt("info", "a.exr").stdout
        for word in ("24 x 16", "R, G, B", "crt/sceneHash", "fake"):
            self.assertIn(word, text)

    def test_every_aov_of_a_scene_is_in_its_exr(self):
        channels = {
            "albedo": "Albedo.R, Albedo.G, Albedo.B",
            "normal": "Ns.X, Ns.Y, Ns.Z",
            "depth": "Z",
            "primitive": "id.primitive",
            "variance": "Variance.Y",
            "samples": "sampleCount",
            "error": "StdError.Y",
        }
        schema = json.loads(self.crt("schema").stdout)
        listed = re.findall(r'"aovs".*?"enum": (\[.*?\])', json.dumps(schema))
        self.assertEqual(json.loads(listed[0]), list(channels))
        for aov, names in channels.items():
            self.write("aov.yaml", SCENE + f"outputs: [{{file: {aov}.exr, aovs: [{aov}]}}]\n")
            self.crt("aov.yaml", "-b", "fake", "--spp", "64")
            text = self.crt("info", f"{aov}.exr").stdout
            self.assertRegex(text, rf"(?m)^ *(channels|integers) +(.*, )?{re.escape(names)}$")

    def test_the_hash_is_that_of_the_report(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.assertIn(self.report("a.report.json")["scene"]["hash"], self.crt("info", "scene.yaml").stdout)

    def test_a_scene_needs_no_backend_and_no_image_library(self):
        # What makes a start slow is libraries; the dynamic linker tells which are opened.
        def libraries(*arguments):
            return self.crt(*arguments, LD_DEBUG="files").stderr
        # What would be opened would be seen.
        self.assertIn("crt_backend_fake.so", libraries("scene.yaml", "-b", "fake", "-o", "a.exr"))
        self.assertIn("libOpenImageIO", libraries("info", "a.exr"))
        opened = libraries("info", "scene.yaml")
        self.assertIn("libc.so", opened)
        for library in ("crt_backend_", "crt_image", "OpenImageIO", "libcuda", "libOpenCL", "libembree"):
            self.assertNotIn(library, opened)

    def test_scenes_that_come_with_crt(self):
        scene = os.path.join(CONFIG_DIR, "cornell_box.yaml")
        if not os.path.exists(scene):
            self.skipTest("no configs/cornell_box.yaml")
        self.assertIn("emitting triangle", self.crt("info", scene).stdout)


class Light(CliTest):
    """With the first real backend."""

    def setUp(self):
        super().setUp()
        self.backend = first_real_backend()
        if self.backend is None:
            self.skipTest("no real backend can run here")

    def test_an_empty_scene_shows_the_background(self):
        self.write("empty.yaml", EMPTY)
        self.crt("empty.yaml", "-b", self.backend, "-o", "a.pfm")
        _, _, values = read_pfm(self.path("a.pfm"))
        luminance = values[1::3]
        self.assertLess(
            max(abs(y - 1) for y in luminance), 0.2
        )  # XYZ of four wavelengths a sample varies from pixel to pixel.
        self.assertLess(abs(sum(luminance) / len(luminance) - 1), 0.05)

    def test_a_scene_without_light_warns_and_is_black(self):
        self.write("dark.yaml", DARK)
        run = self.crt("dark.yaml", "-b", self.backend, "-o", "a.pfm")
        self.assertIn("crt: warning:", run.stderr)
        _, _, values = read_pfm(self.path("a.pfm"))
        self.assertEqual(set(values), {0.0})

    def test_a_black_image_says_what_to_look_at(self):
        run = self.crt("scene.yaml", "-b", self.backend, "-o", "a.pfm", "-o", "a.crtfilm")
        self.assertNotIn("black", run.stderr)
        self.assertNotIn("lights nothing", run.stderr)
        # Turned round, and with the camera below.
        self.write(
            "away.yaml",
            SCENE.replace(
                "[1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]",
                "[1, 2, 1], [-1, 2, 1]], faces: [[3, 2, 1, 0]]",
            ),
        )
        run = self.crt("away.yaml", "-b", self.backend, "-o", "a.pfm", "-o", "a.crtfilm")
        self.assertIn("warning: 'lamp' lights nothing", run.stderr)
        self.assertRegex(
            run.stderr, r"warning: the image is black: no path met a light; 'lamp' may face away"
        )
        self.assertEqual(set(read_pfm(self.path("a.pfm"))[2]), {0.0})
        self.assertIn("warning: the image is black", self.crt("develop", "a.crtfilm", "-o", "b.pfm").stderr)
        self.assertNotIn(
            "black",
            self.crt(
                "away.yaml", "-b", self.backend, "-o", "a.pfm", "--set", "objects.1.emission.two_sided=true"
            ).stderr,
        )
        # Black on the screen alone: there is light, and too little exposure.
        run = self.crt(
            "scene.yaml", "-b", self.backend, "-o", "a.png", "-o", "a.exr", "--set", "film.exposure_ev=-30"
        )
        self.assertNotIn("no path met", run.stderr)
        stops = int(re.search(r"'a.png' is black: .* about (\d+) stops more", run.stderr).group(1))
        self.assertNotIn(
            "black",
            self.crt(
                "scene.yaml", "-b", self.backend, "-o", "a.png", "--set", f"film.exposure_ev={stops - 30}"
            ).stderr,
        )

    def test_a_gpu_that_is_not_there_is_no_news(self):
        if os.path.exists("/dev/nvidiactl"):
            self.skipTest("there is a GPU")
        run = self.crt("scene.yaml", "-o", "a.pfm", CRT_BACKEND_PATH="")
        self.assertNotIn("NVIDIA", run.stderr)
        self.assertNotIn("cuda", run.stderr)
        self.assertIn(
            "crt: debug: backend 'cuda'",
            self.crt("scene.yaml", "-v", "-o", "a.pfm", CRT_BACKEND_PATH="").stderr,
        )

    def test_halves_kernels_and_chunks_give_the_same_bits(self):
        self.crt("scene.yaml", "-b", self.backend, "-o", "whole.pfm")
        reference = read_bytes(self.path("whole.pfm"))
        self.crt(
            "scene.yaml",
            "-b",
            self.backend,
            "-o",
            "full.pfm",
            "--kernel",
            "full",
            "--chunk",
            "3",
            "--tile",
            "8",
        )
        self.assertEqual(read_bytes(self.path("full.pfm")), reference)
        self.crt("scene.yaml", "-b", self.backend, "--samples", "0:5", "-o", "a.crtfilm")
        self.crt("scene.yaml", "-b", self.backend, "--samples", "5:16", "-o", "b.crtfilm")
        self.crt("merge", "--scene", "scene.yaml", "-o", "merged.pfm", "a.crtfilm", "b.crtfilm")
        self.assertEqual(read_bytes(self.path("merged.pfm")), reference)

    def test_more_threads_than_processors(self):
        """Of seven threads all work: a library that allows fewer says so on stderr."""
        run = self.crt("verify", "-b", self.backend, "--case", "splitting", "-q")
        self.assertEqual(run.stderr, "")


class Verify(CliTest):
    def test_wrong_physics_is_named(self):
        run = self.crt("verify", "-b", "without_cosine", "--case", "square-light", "-o", "out", expect=7)
        self.assertIn("one of the two cosines is missing", run.stdout)
        with open(os.path.join(self.directory, "out", "verify.json"), encoding="utf-8") as file:
            self.assertFalse(json.load(file)["passed"])
        with open(os.path.join(self.directory, "out", "verify.html"), encoding="utf-8") as file:
            self.assertIn("one of the two cosines is missing", file.read())

    def test_right_physics_passes(self):
        run = self.crt("verify", "-b", "example", "--case", "furnace,square-light")
        self.assertIn("2 pass", run.stdout)

    def test_case_misspelt(self):
        self.assert_one_error(self.crt("verify", "--case", "furnance", expect=2), "furnace")

    def test_list_names_cases(self):
        self.assertIn("square-light", self.crt("verify", "--list").stdout)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    CRT, CONFIG_DIR, FAKE_DIR = map(os.path.abspath, sys.argv[1:4])
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
