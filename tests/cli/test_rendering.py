#!/usr/bin/env python3
"""A render from outside: which files come out, what is said, and what goes wrong on the way.

Over 450 lines: one command, whose ends differ in what they leave behind.

    test_rendering.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import os
import re
import shutil
import unittest

import harness
from harness import CliTest, LightTest, SCENE, read_pfm, read_bytes

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


class Rendering(CliTest):
    def test_the_word_render_is_implied(self):
        self.crt("--backend", "fake", "scene.yaml", "-o", "a.pfm")
        self.crt("render", "scene.yaml", "--backend", "fake", "-o", "b.pfm")
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("b.pfm")))

    def test_default_outputs(self):
        written = self.crt("scene.yaml", "-b", "fake").stderr.split("wrote ")[1]
        for name in ("scene.exr", "scene.png", "scene.report.json"):
            self.assertTrue(os.path.exists(self.path(name)), name)
            self.assertIn(name, written)
        self.assertFalse(os.path.exists(self.path("scene.crtfilm")))

    def test_outputs_of_the_scene(self):
        self.write("with.yaml", SCENE + "outputs:\n  - {file: beside.pfm}\n  - {file: beside.ppm}\n")
        self.crt("with.yaml", "-b", "fake")
        self.assertTrue(os.path.exists(self.path("beside.ppm")))
        self.crt("with.yaml", "-b", "fake", "-o", "other.pfm", "--report", "none")
        self.assertTrue(os.path.exists(self.path("other.pfm")))
        self.assertFalse(os.path.exists(self.path("other.report.json")))

    def test_outputs_of_the_scene_stay_in_its_folders_and_replace_images_of_crt_alone(self):
        os.makedirs(self.path("work/sub"))
        os.makedirs(self.path("home"))
        os.symlink(self.path("home"), self.path("work/link"))
        self.write("home/precious.ppm", "precious")
        self.write("work/photo.ppm", "crt did not write")
        with open(self.path("work/photo.png"), "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\nof another program")

        def named(name, **output):
            keys = "".join(f", {key}: {value}" for key, value in output.items())
            self.write("work/of.yaml", SCENE + f"outputs: [{{file: '{name}'{keys}}}]\n")
            return self.path("work/of.yaml")

        for name, words in (
            (self.path("home/precious.ppm"), "outside"),
            ("../home/precious.ppm", "outside"),
            ("sub/../../home/precious.ppm", "outside"),
            ("link/precious.ppm", "outside"),
            (".hidden.ppm", "hidden"),
            (".sub/a.ppm", "hidden"),
            ("photo.ppm", "crt did not write"),
            ("photo.png", "crt did not write"),
        ):
            with self.subTest(name=name):
                scene = named(name)
                self.assert_one_error(self.crt(scene, "-b", "fake", expect=2, folder="work"), words)
        self.assert_one_error(
            self.crt(named("a.sh", format="ppm"), "-b", "fake", expect=2, folder="work"), "does not end in"
        )
        self.assertEqual(read_bytes(self.path("home/precious.ppm")), b"precious")
        # Names of the command line are the user's own, and so is --overwrite.
        self.crt(named("photo.ppm"), "-b", "fake", "--overwrite", folder="work")
        self.crt(named("photo.ppm"), "-b", "fake", folder="work")
        self.crt(named("a.ppm"), "-b", "fake", "-o", self.path("home/precious.ppm"), "--report", "none",
                 folder="work")
        # Absolute names in the scene's own folder, from anywhere.
        self.crt(named(self.path("work/sub/b.exr")), "-b", "fake", folder="home")
        self.crt(named(self.path("work/sub/b.exr")), "-b", "fake", folder="home")
        self.crt(named("sub/c.png"), "-b", "fake", folder="work")
        self.crt(named("sub/c.png"), "-b", "fake", folder="work")

    @unittest.skipUnless(os.getuid() == 0, "plays another user")
    def test_links_of_others_in_folders_of_everyone_are_not_followed(self):
        os.makedirs(self.path("tmp"))
        os.chmod(self.path("tmp"), 0o1777)
        self.write("precious", "precious")
        for name in ("a.pfm", "a.report.json", "a.crtfilm"):
            link = os.path.join(self.path("tmp"), name)
            os.symlink(self.path("precious"), link)
            os.chown(link, 12345, 12345, follow_symlinks=False)
            self.assert_one_error(
                self.crt("scene.yaml", "-b", "fake", "-o", "tmp/a.pfm", "-o", "tmp/a.crtfilm", "--overwrite",
                         expect=6), "link of another user"
            )
            self.assertEqual(read_bytes(self.path("precious")), b"precious")
            os.unlink(link)
        # One's own are.
        os.symlink(self.path("target.pfm"), os.path.join(self.path("tmp"), "a.pfm"))
        self.crt("scene.yaml", "-b", "fake", "-o", "tmp/a.pfm", "--report", "none")
        self.assertTrue(os.path.exists(self.path("target.pfm")))

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
                "shapes",
                "instances",
                "instanced_triangles",
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
            "samples": ["target", "per_pixel", "resumed", "rendered", "ranges", "chunks", "invalid",
                        "dropped_splats"],
            "rays": ["paths", "closest", "shadow"],
            "speed": ["mpaths_per_second", "mrays_per_second"],
            "memory": ["scene_bytes", "texel_bytes", "host_peak_bytes", "device_peak_bytes", "film_bands"],
            "error": [
                "knowledge",
                "mean_luminance",
                "mean_luminance_cd_m2",
                "degrees_of_freedom",
                "relative_rmse",
                "relative_rmse_95",
                "half_width_95",
                "mean_luminance_standard_error",
                "mean_luminance_95",
                "mean_luminance_95_cd_m2",
                "to_target",
            ],
            "stop": ["reason", "signal", "failure", "exit_code"],
        }
        for section, keys in expected.items():
            self.assertEqual(list(report[section]), keys, section)
        for device in report["devices"]:
            self.assertEqual(list(device), ["device", "name", "samples", "seconds", "failure"])
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
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--time", "11s", "--chunk", "1",
                       fault="slow")
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
                self.assert_one_error(self.crt("scene.yaml", "-b", "nonsense", *arguments, expect=6))

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
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 6, messages)
        self.assertTrue(os.path.exists(self.path("kept.pfm")))
        self.crt(
            "scene.yaml", "-b", "fake", "-o", "kept.pfm", "--spp", "30", "--resume", "--report", "r.json"
        )
        self.assertEqual(self.report("r.json")["samples"]["resumed"], 30)


class DeviceFailures(CliTest):
    def test_out_of_memory_with_nothing_rendered(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", fault="oom", expect=5)
        self.assert_one_error(run, "memory")
        self.assertFalse(os.path.exists(self.path("a.pfm")))
        self.assertEqual(self.report("a.report.json")["stop"]["reason"], "failed")

    def test_what_was_there_is_saved(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "whole.pfm", "--spp", "32")
        self.save_samples(8, "a.crtfilm")
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


class SeveralDevices(CliTest):
    """The two devices of `fake`. That films do not show who rendered what: unit_device_group.cpp."""

    def test_all_give_the_image_of_one(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "one.pfm", "--spp", "40")
        for devices in ("all", "0,1", "1,0"):
            self.crt("scene.yaml", "-b", "fake", "-o", "all.pfm", "--spp", "40", "--device", devices)
            self.assertEqual(read_bytes(self.path("one.pfm")), read_bytes(self.path("all.pfm")))
        report = self.report("all.report.json")
        named = [(d["device"], d["name"]) for d in report["devices"]]
        self.assertEqual(named, [("1", "second pattern"), ("0", "pattern")])
        self.assertEqual(sum(d["samples"] for d in report["devices"]), 40)
        self.assertEqual(report["backend"]["device"], "second pattern + pattern")

    def test_one_that_fails_is_dropped_and_said(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "whole.pfm", "--spp", "40")
        run = self.crt(
            "scene.yaml", "-b", "fake", "-o", "a.pfm", "--spp", "40", "--device", "all",
            fault="device", CRT_FAKE_FAULT_DEVICE="1",
        )
        self.assertIn("device 1 'second pattern' is dropped; the other devices continue", run.stderr)
        self.assertIn("fell off the bus", run.stderr)
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("whole.pfm")))
        first, second = self.report("a.report.json")["devices"]
        self.assertEqual((first["samples"], first["failure"], second["samples"]), (40, None, 0))
        self.assertIn("fell off the bus", second["failure"])

    def test_what_is_no_list_of_devices_is_refused(self):
        for devices, sentence in (
            ("0,0", "device 0 is named twice"),
            ("0,7", "there is no device '7'"),
            ("0,", "there is no device ''"),
        ):
            run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--device", devices, expect=2)
            self.assert_one_error(run, sentence)


class Light(LightTest):
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
        self.assertNotIn("illuminates nothing", run.stderr)
        # Turned round, and with the camera below.
        self.write(
            "away.yaml",
            SCENE.replace(
                "[1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]",
                "[1, 2, 1], [-1, 2, 1]], faces: [[3, 2, 1, 0]]",
            ),
        )
        run = self.crt("away.yaml", "-b", self.backend, "-o", "a.pfm", "-o", "a.crtfilm")
        self.assertIn("warning: 'lamp' illuminates nothing", run.stderr)
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
        stops = int(re.search(r"'a.png' is black: .*increase film.exposure_ev by about (\d+) "
                              r"stops", run.stderr).group(1))
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


if __name__ == "__main__":
    harness.main(__doc__)
