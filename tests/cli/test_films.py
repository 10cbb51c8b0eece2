#!/usr/bin/env python3
"""Films from outside: stopped, resumed, merged and developed.

    test_films.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Over 450 lines: one kind of file, from the moment that a render stops to the images made of it.
"""

import json
import os
import signal
import time

import harness
from harness import CliTest, LIT, read_bytes

WITH_AOVS = (
    LIT
    + "outputs: [{file: scene.exr, aovs: [albedo, normal, depth, primitive, variance, samples, error]}]\n"
)


# Each path goes on until its depth is reached, in an hour.
MIRRORS = """crt: 1
camera: {position: [0, 0, 0], target: [0, 0, 1]}
film: {resolution: [16, 16]}
integrator: {max_depth: 1000000000, roulette: false}
materials: {m: {type: mirror, reflectance: 1}}
objects: [{sphere: {radius: 1, inward: true}, material: m}]
lights: [{type: point, position: [0, 0.1, 0], power_w: 1}]
"""

# A film of format 2, which held no record.
OLD_FILM = """
89435254460d0a1a0200000078000000c000000000000000a07c53a2d2fe44e401000000010000000400000000000000
303132333435363738396162636465663031323334353637383961626364656605000000010000000200000000000000
03000000000000000500000000000000302e312e30000000000000000000f83f00000000000000000000000000000000
000000000000000000000000000000000000000000000000000000000000000000000000000000000200000000000000
"""


class StoppingAndGoingOn(CliTest):
    def interrupt(self, number, code):
        self.crt("scene.yaml", "-b", "fake", "--spp", "64", "-o", "whole.pfm")
        process = self.start(
            "scene.yaml", "-b", "fake", "--spp", "64", "-o", "part.pfm", "--chunk", "1", fault="slow"
        )
        self.wait_for_rendering(process)
        process.send_signal(number)
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
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
        process.communicate(timeout=harness.PATIENCE_SECONDS)
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
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 130)
        # At the end of the chunk it would have written the samples so far.
        self.assertFalse(os.path.exists(self.path("part.pfm")))

    def endless(self, *arguments):
        return ["scene.yaml", "-b", "fake", "--chunk", "1", "-o", "part.pfm", *arguments]

    def assert_samples_before_are_kept(self, reason):
        report = self.report("part.report.json")
        self.assertEqual(report["stop"]["reason"], reason)
        self.assertEqual(report["samples"]["per_pixel"], 4)
        self.crt("scene.yaml", "-b", "fake", "--spp", "4", "-o", "whole.pfm")
        self.assertEqual(read_bytes(self.path("part.pfm")), read_bytes(self.path("whole.pfm")))

    def test_after_its_time_a_path_without_end_is_given_up(self):
        run = self.crt(*self.endless("--time", "1s"), fault="endless")
        self.assertIn("the samples in progress are left out", run.stderr)
        self.assert_samples_before_are_kept("time")

    def test_after_ctrl_c_a_path_without_end_is_given_up(self):
        process = self.start(*self.endless(), fault="endless")
        self.wait_for_rendering(process)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, messages)
        self.assertIn("--resume", messages)
        self.assert_samples_before_are_kept("interrupted")

    def test_without_any_sample_there_is_no_image_and_a_reason(self):
        run = self.crt(*self.endless("--samples", "8:16", "--time", "1s"), fault="endless", expect=2)
        self.assert_one_error(run, "not all pixels have a sample", "integrator.max_depth")
        process = self.start(*self.endless("--samples", "8:16"), fault="endless")
        self.wait_for_rendering(process)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, messages)
        self.assertIn("before all pixels had a sample: there is no image", messages)
        self.assertFalse(os.path.exists(self.path("part.pfm")))

    def test_real_backends_end_within_a_path_without_end(self):
        """The GPU's kernels are asked by tests/cuda_on_host and tests of conformance alone."""
        self.write("mirrors.yaml", MIRRORS)
        backends = [name for name in ("embree", "opencl") if name in harness.real_backends()]
        for backend in backends:
            arguments = ["mirrors.yaml", "-b", backend, "-t", "1", "--time", "1s", "-o", "a.pfm"]
            run = self.crt(*arguments, expect=2, CRT_BACKEND_PATH="")
            self.assert_one_error(run, "not all pixels have a sample")
        if not backends:
            self.skipTest("there is neither embree nor opencl")

    def test_resume_raises_the_target(self):
        self.crt("scene.yaml", "-b", "fake", "--spp", "40", "-o", "whole.pfm")
        self.save_samples(10, "c.crtfilm")
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
        process = self.start_with_checkpoints("--checkpoint", "c.crtfilm", "--spp", "100")
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


class Splats(CliTest):
    """Samples that add to other pixels than their own, in files."""

    def setUp(self):
        super().setUp()
        if "embree" not in harness.real_backends():
            self.skipTest("there is no embree")
        self.write("splats.yaml", LIT + "integrator: {type: splat_test}\n")

    def render(self, *arguments):
        return self.crt("splats.yaml", "-b", "embree", *arguments, CRT_BACKEND_PATH="")

    def test_parts_and_resumed_renders_are_the_whole(self):
        self.render("--spp", "24", "-o", "whole.pfm")
        self.assertEqual(self.report("whole.report.json")["samples"]["dropped_splats"], 0)
        self.assertEqual(self.report("whole.report.json")["error"]["knowledge"], "known")
        self.render("--samples", "0:9", "-o", "a.crtfilm")
        self.render("--samples", "9:24", "-o", "b.crtfilm")
        self.crt("merge", "-o", "merged.pfm", "b.crtfilm", "a.crtfilm")
        self.assertEqual(read_bytes(self.path("merged.pfm")), read_bytes(self.path("whole.pfm")))
        self.render("--spp", "24", "-o", "resumed.pfm", "--resume", "a.crtfilm")
        self.assertEqual(read_bytes(self.path("resumed.pfm")), read_bytes(self.path("whole.pfm")))

    def test_without_replicates_the_error_is_unknown(self):
        run = self.render("--spp", "8", "-o", "a.crtfilm", "--set", "sampler.replicates=1")
        self.assertIn("the error of the image is unknown", run.stderr)
        self.assertIsNone(self.report("a.report.json")["error"])
        self.assertIn("without replicates", self.crt("info", "a.crtfilm").stdout)


class Developing(CliTest):
    """A film's record of its scene is enough to make every image of it again."""

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
        files = [".exr", ".png", ".jpg", ".pfm", ".ppm"]
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
            self.crt("info", "d.exr").stdout,
            r"channels +R, G, B, HalfWidth95.Y, OwnVariance.Y, StdError.Y\n *integers +sampleCount\n"
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
                self.assert_one_error(run, "needs a new render", key.split("=")[0])
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
        # The noise that compare sees does not depend on the exposure of both.
        seen = [
            json.loads(self.crt("compare", e + ".exr", e + "_other.exr", "--json", expect=7).stdout)
            for e in "01"
        ]
        self.assertEqual(2 * seen[0]["metrics"]["rmse"], seen[1]["metrics"]["rmse"])
        self.assertEqual(seen[0]["metrics"]["relative_rmse"], seen[1]["metrics"]["relative_rmse"])
        for what in ("rms_z", "tiles", "pixels"):
            self.assertEqual(seen[0]["noise"][what], seen[1]["noise"][what], what)


if __name__ == "__main__":
    harness.main(__doc__)
