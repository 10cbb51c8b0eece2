#!/usr/bin/env python3
"""crt sequence from outside: files and values by frame, resuming, pictures in a pipe.

    test_sequence.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import os
import signal
import subprocess

import harness
from harness import CliTest, LightTest, read_bytes, read_pfm


class Sequences(CliTest):
    def sequence(self, frames, *more, **how):
        return self.crt("sequence", "scene.yaml", "--frames", frames, "--spp", "2", "-b", "fake", *more,
                        **how)

    def test_each_frame_is_the_render_with_its_values(self):
        self.sequence("1:6:2", "-o", "f-##.pfm", "--set", "sampler.seed=10*frame", "--set",
                      "camera.position=[frame/2, 1, -4]")
        for frame in (1, 3, 5):
            self.crt("scene.yaml", "--spp", "2", "-b", "fake", "-o", "alone.pfm", "--seed", str(10 * frame),
                     "--set", f"camera.position=[{frame / 2}, 1, -4]", "--overwrite")
            self.assertEqual(read_bytes(self.path(f"f-0{frame}.pfm")), read_bytes(self.path("alone.pfm")))
        self.assertEqual(sorted(name for name in os.listdir(self.directory) if name.endswith(".pfm")),
                         ["alone.pfm", "f-01.pfm", "f-03.pfm", "f-05.pfm"])
        self.assertIn("camera.position=[1.5, 1, -4]", self.report("f-03.report.json")["crt"]["request"])

    def test_outputs_of_the_scene_get_the_number_too(self):
        with open(self.path("scene.yaml"), encoding="utf-8") as file:
            text = file.read()
        self.write("scene.yaml", text + "outputs: [{file: a.exr, aovs: [albedo]}, {file: a.png}]\n")
        self.sequence("7:8")
        for name in ("a.0007.exr", "a.0007.png", "a.0007.report.json"):
            self.assertTrue(os.path.exists(self.path(name)), name)

    def test_pictures_go_through_a_pipe(self):
        run = subprocess.run([harness.CRT, "sequence", "scene.yaml", "--frames", "0:3", "--spp", "1", "-b",
                              "fake", "-o", "-"], cwd=self.directory, env=harness.environment(),
                             capture_output=True, timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(run.stdout.count(b"P6"), 3)
        self.assertEqual(len(run.stdout) % 3, 0)

    def seconds_of(self, *names):
        return [os.stat(self.path(name)).st_mtime_ns for name in names]

    def test_resuming_renders_what_is_missing_or_has_changed(self):
        frames = [f"a.000{frame}.pfm" for frame in range(3)]
        with_values = ("-o", "a.pfm", "--set", "sampler.seed=frame", "--resume")
        self.sequence("0:2", *with_values)
        first = self.seconds_of(*frames[:2])
        run = self.sequence("0:3", *with_values)
        self.assertIn("2 of 3 frames were done before", run.stderr)
        self.assertEqual(self.seconds_of(*frames[:2]), first)
        os.remove(self.path(frames[1]))  # A picture that is gone is rendered again.
        run = self.sequence("0:3", *with_values)
        self.assertIn("2 of 3 frames were done before", run.stderr)
        # Other values, other samples, another scene: all are rendered again.
        self.sequence("0:3", "-o", "a.pfm", "--set", "sampler.seed=frame+1", "--resume")
        run = self.sequence("0:3", *with_values)
        self.assertNotIn("done before", run.stderr)
        run = self.crt("sequence", "scene.yaml", "--frames", "0:3", "--spp", "3", "-b", "fake", *with_values)
        self.assertNotIn("done before", run.stderr)
        later = os.stat(self.path("a.0002.report.json")).st_mtime + 10
        os.utime(self.path("scene.yaml"), (later, later))
        run = self.crt("sequence", "scene.yaml", "--frames", "0:3", "--spp", "3", "-b", "fake", *with_values)
        self.assertNotIn("done before", run.stderr)

    def test_a_stopped_frame_goes_on(self):
        what = ("sequence", "scene.yaml", "--frames", "3:5", "-b", "fake", "--spp", "64", "-o", "a.pfm",
                "--resume")
        process = self.start(*what, "--chunk", "1", fault="slow")
        self.assertIn("frame 3, 1 of 2", process.stderr.readline())
        self.wait_for_rendering(process)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
        self.assertEqual(process.returncode, 130, messages)
        self.assertIn("stopped in frame 3", messages)
        run = self.crt(*what)
        self.assertIn("resuming", run.stderr)
        report = self.report("a.0003.report.json")
        self.assertGreater(report["samples"]["resumed"], 0)
        self.assertEqual(report["samples"]["per_pixel"], 64)
        self.crt("scene.yaml", "-b", "fake", "--spp", "64", "-o", "whole.pfm")
        self.assertEqual(read_bytes(self.path("a.0003.pfm")), read_bytes(self.path("whole.pfm")))

    def test_what_is_wrong_is_said(self):
        self.assert_one_error(self.sequence("5:5", expect=2), "--frames", "0:24")
        self.assert_one_error(self.sequence("0:2", "--set", "sampler.seed=frame frame", expect=2), "'frame'")
        self.assert_one_error(self.sequence("0:2", "--set", "film.nothing=frame", expect=3), "nothing")
        self.assert_one_error(self.crt("sequence", "-", "--frames", "0:2", expect=2), "standard input")
        self.assert_one_error(self.sequence("0:2", "-o", "-", "--resume", expect=2), "standard output")
        self.crt("sequence", "scene.yaml", expect=2)


class Light(LightTest):
    def test_a_frame_of_a_lean_sequence_is_that_of_a_render(self):
        self.crt("sequence", "scene.yaml", "--frames", "0:3", "--spp", "4", "-b", self.backend,
                 "-o", "f.pfm", "--set", "objects.lamp.emission.radiance={blackbody: 3000, scale: 1+frame}")
        self.crt("scene.yaml", "--spp", "4", "-b", self.backend, "-o", "alone.pfm",
                 "--set", "objects.1.emission.radiance={blackbody: 3000, scale: 3}")
        self.assertEqual(read_bytes(self.path("f.0002.pfm")), read_bytes(self.path("alone.pfm")))
        brightness = [sum(read_pfm(self.path(f"f.000{frame}.pfm"))[2]) for frame in range(3)]
        self.assertAlmostEqual(brightness[2] / brightness[0], 3, delta=0.01)


if __name__ == "__main__":
    harness.main(__doc__)
