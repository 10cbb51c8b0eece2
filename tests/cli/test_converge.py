#!/usr/bin/env python3
"""`crt converge`, `crt reference` and --target-error from outside, with the first real backend; skipped by name when there is none.

    test_converge.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os
import sys
import unittest

import test_cli
from test_cli import CliTest, first_real_backend

SMALL = ["--set", "film.resolution=[16,16]", "--set", "sampler.type=independent"]


class Converging(CliTest):
    def setUp(self):
        super().setUp()
        self.backend = first_real_backend()
        if self.backend is None:
            self.skipTest("no real backend can run here")

    def summary(self, folder):
        with open(self.path(f"{folder}/summary.json"), encoding="utf-8") as file:
            return json.load(file)

    def rows(self, folder):
        with open(self.path(f"{folder}/results.jsonl"), encoding="utf-8") as file:
            return [json.loads(line) for line in file]

    def test_a_run_writes_its_files_and_keeps_to_its_time(self):
        self.crt("converge", "scene.yaml", "--backends", f"{self.backend},nosuch", "--time", "3s", "--max-spp", "64", "-o", "out", *SMALL)
        for name in ("report.html", "results.jsonl", "results.csv", "summary.json", "manifest.json"):
            self.assertTrue(os.path.getsize(self.path(f"out/{name}")) > 0, name)
        rows = self.rows("out")
        self.assertEqual({row["samples_per_pixel"] for row in rows}, {1, 2, 4, 8, 16, 32, 64})
        self.assertGreaterEqual(len({row["replicate"] for row in rows}), 16)
        self.assertEqual(len({row["seed"] for row in rows}), len({row["replicate"] for row in rows}))
        with open(self.path("out/report.html"), encoding="utf-8") as file:
            self.assertIn("nosuch", file.read())  # What was left out is said.

    def test_a_reference_judges_its_own_scene_only(self):
        self.crt("reference", "scene.yaml", "-o", "ref.exr", "--spp", "4096", "--same-estimator", "-b", self.backend, *SMALL)
        self.crt("converge", "scene.yaml", "--backends", self.backend, "--reference", "ref.exr", "--time", "2s", "--max-spp", "16", "-o", "out", *SMALL)
        run = self.crt("converge", "scene.yaml", "--backends", self.backend, "--reference", "ref.exr", "--time", "2s", "-o", "other", *SMALL,
                       "--set", "camera.fov=20", expect=2)
        self.assert_one_error(run, "another scene")
        # A luminance that it has not fails: exit code 7.
        self.crt("converge", "scene.yaml", "--backends", self.backend, "--reference", "12345", "--time", "2s", "--max-spp", "16", "-o", "wrong", *SMALL,
                 expect=7)

    def test_an_earlier_run_is_not_overwritten_but_resumed(self):
        arguments = ["converge", "scene.yaml", "--backends", self.backend, "--time", "2s", "--max-spp", "8", "-o", "out", *SMALL]
        self.crt(*arguments)
        first = {(row["replicate"], row["samples_per_pixel"]): row["image_mean"] for row in self.rows("out")}
        self.assert_one_error(self.crt(*arguments, expect=2), "--resume")
        self.crt(*arguments, "--resume")
        both = {(row["replicate"], row["samples_per_pixel"]): row["image_mean"] for row in self.rows("out")}
        for key, value in first.items():
            self.assertEqual(both[key], value)

    def test_vary_takes_combinations_and_names_what_it_does_not_know(self):
        self.crt("converge", "scene.yaml", "--backends", self.backend, "--vary", "sampler=sobol,independent", "--vary", "nee=true,false", "--time", "3s",
                 "--max-spp", "4", "-o", "out", "--set", "film.resolution=[8,8]")
        self.assertEqual({row["variant"] for row in self.rows("out")},
                         {f"sampler={s} nee={n}" for s in ("sobol", "independent") for n in ("true", "false")})
        self.assert_one_error(self.crt("converge", "scene.yaml", "--vary", "smapler=sobol", expect=2), "did you mean 'sampler'")

    def test_target_error_stops_when_it_is_reached(self):
        self.crt("scene.yaml", "-b", self.backend, "--target-error", "2%", "-o", "a.pfm", *SMALL)
        report = self.report("a.report.json")
        self.assertEqual(report["stop"]["reason"], "target error")
        self.assertLessEqual(report["error"]["half_width_95"], 0.025)
        samples = report["samples"]["per_pixel"]
        self.assertEqual(samples & (samples - 1), 0)
        self.assert_one_error(self.crt("scene.yaml", "-b", self.backend, "--target-error", "2%", "--set", "sampler.replicates=1", expect=2), "replicates")
        self.assert_one_error(self.crt("scene.yaml", "--target-error", "200%", expect=2), "an error such as 1%")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    test_cli.CRT, test_cli.CONFIG_DIR, test_cli.FAKE_DIR = map(os.path.abspath, sys.argv[1:4])
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
