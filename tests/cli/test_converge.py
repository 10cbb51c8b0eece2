#!/usr/bin/env python3
"""`crt converge`, `crt reference` and --target-error from outside, with the first real backend; skipped by
name when there is none.

test_converge.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os

import harness
from harness import LightTest
from image_headers import png_pixels

SMALL = ["--set", "film.resolution=[16,16]", "--set", "sampler.type=independent"]

# A panel with holes over a floor in squares, before a sky: noise everywhere, and edges in it.
PANEL = """\
crt: 1
camera: {position: [0.5, 1.4, 3.5], target: [0, 0.6, 0], fov: 45}
film: {resolution: [64, 64]}
materials:
  floor: {type: diffuse, reflectance: {checker: [0.2, 0.7], scale: 6}}
  leaf: {type: diffuse, reflectance: 0.5}
  holes: {type: two_sided, front: leaf, back: leaf, opacity: {checker: [0, 1], scale: 4}}
objects:
  - material: floor
    rectangle: {size: [6, 6]}
    transform: [{rotate: {axis: [1, 0, 0], angle_deg: -90}}]
  - {material: holes, rectangle: {size: [1.2, 1.2]}, transform: [{translate: [-0.5, 0.6, 0]}]}
  - material: leaf
    sphere: {radius: 0.15}
    emission: {radiance: 10}
    transform: [{translate: [0, 2.5, 1]}]
environment: {radiance: 0.3}
"""


def z_values(path):
    """Absolute values of the pixels of a z map: white is 0, and the darkest channel of the ends is 0. Values
    beyond 4 read as 4."""
    pixels = [row[i:i + 3] for row in png_pixels(path) for i in range(0, len(row), 3)]
    return [4 * (1 - min(pixel) / 0xf7) for pixel in pixels]


class Converging(LightTest):
    def summary(self, folder):
        with open(self.path(f"{folder}/summary.json"), encoding="utf-8") as file:
            return json.load(file)

    def rows(self, folder):
        with open(self.path(f"{folder}/results.jsonl"), encoding="utf-8") as file:
            return [json.loads(line) for line in file]

    def converge(self, *arguments, folder="out", expect=0, time="2s", spp="8"):
        return self.crt("converge", *arguments, "--backends", self.backend, "--time", time, "--max-spp", spp,
                        "-o", folder, expect=expect)

    def make_reference(self, spp):
        self.crt("reference", "scene.yaml", "-o", "ref.exr", "--spp", str(spp), "--same-estimator",
                 "-b", self.backend, *SMALL)

    def test_a_run_writes_its_files_and_keeps_to_its_time(self):
        # A slow machine, or a sanitizer, may not reach all in the shortest time.
        for seconds in ("3s", "10s", "60s"):
            folder = f"out_{seconds}"
            run = self.crt(
                "converge",
                "scene.yaml",
                "--backends",
                f"{self.backend},nosuch",
                "--time",
                seconds,
                "--max-spp",
                "64",
                "-o",
                folder,
                *SMALL,
            )
            for name in ("results.jsonl", "results.csv", "summary.json", "manifest.json"):
                self.assertTrue(os.path.getsize(self.path(f"{folder}/{name}")) > 0, name)
            rows = self.rows(folder)
            reached = sorted({row["samples_per_pixel"] for row in rows})
            self.assertEqual(reached, [1, 2, 4, 8, 16, 32, 64][:len(reached)])
            if len(reached) == 7:
                break
        self.assertEqual(len(reached), 7)
        self.assertGreaterEqual(len({row["replicate"] for row in rows}), 16)
        self.assertEqual(len({row["seed"] for row in rows}), len({row["replicate"] for row in rows}))
        summary = self.summary(folder)
        told = [finding["text"] for finding in summary["scenes"][0]["findings"]]
        self.assertTrue([text for text in told if "nosuch was left out" in text], told)
        # Without a page its command is said.
        self.assertFalse(os.path.exists(self.path(f"{folder}/report.html")))
        self.assertRegex(run.stderr, f"warning: no page was made.*share/crt/report {folder}\n")
        with open(self.path(f"{folder}/manifest.json"), encoding="utf-8") as file:
            listed = [entry["name"] for entry in json.load(file)["files"]]
        maps = [picture["file"] for of in summary["scenes"][0]["maps"]["configurations"]
                for picture in of["pictures"]]
        self.assertEqual(sorted(listed), sorted(["results.jsonl", "results.csv", "summary.json", *maps]))
        self.assertGreaterEqual(len(maps), 4)

    def test_a_reference_judges_its_own_scene_only(self):
        self.make_reference(4096)
        judged = ["scene.yaml", *SMALL, "--reference"]
        self.converge(*judged, "ref.exr", spp="16")
        run = self.converge(*judged, "ref.exr", "--set", "camera.fov=20", folder="other", expect=2)
        self.assert_one_error(run, "another scene")
        # A luminance that it has not fails: exit code 7.
        self.converge(*judged, "12345", folder="wrong", spp="16", expect=7)

    def test_an_earlier_run_is_not_overwritten_but_resumed(self):
        self.converge("scene.yaml", *SMALL)
        first = {(row["replicate"], row["samples_per_pixel"]): row["image_mean"] for row in self.rows("out")}
        self.assert_one_error(self.converge("scene.yaml", *SMALL, expect=2), "--resume")
        self.converge("scene.yaml", *SMALL, "--resume")
        both = {(row["replicate"], row["samples_per_pixel"]): row["image_mean"] for row in self.rows("out")}
        for key, value in first.items():
            self.assertEqual(both[key], value)

    def test_resume_refuses_what_is_not_the_same_experiment(self):
        self.converge("scene.yaml", *SMALL)
        cases = [
            ("the size", ["--set", "film.resolution=[32,32]", "--set", "sampler.type=independent"]),
            ("the size", ["--set", "film.resolution=[4,4]", "--set", "sampler.type=independent"]),
            ("the maximum depth", [*SMALL, "--set", "integrator.max_depth=2"]),
            ("the sampler", ["--set", "film.resolution=[16,16]"]),
            ("the seed", [*SMALL, "--set", "sampler.seed=77"]),
            ("light sampling", [*SMALL, "--set", "integrator.nee=false"]),
            ("the colour", [*SMALL, "--set", "film.exposure_ev=1", "--set", "film.apply_to_float=true"]),
            ("the colour", [*SMALL, "--set", "film.color_space=acescg"]),
            ("the camera", [*SMALL, "--set", "camera.fov=20"]),
            (
                "the geometry of scene, %s differs (4 triangles in 2 objects in both)" % self.backend,
                [*SMALL, "--set", "objects.0.mesh.positions.0.0=-1"],
            ),
            (
                "the materials of scene, %s differs" % self.backend,
                [*SMALL, "--set", "materials.floor.reflectance=0.2"],
            ),
            ("the reference", [*SMALL, "--reference", "0.5"]),
            ("the number of threads", [*SMALL, "-t", "1"]),
            ("it has no", [*SMALL, "--vary", "roulette=true,false"]),
        ]
        before = self.rows("out")
        for what, changed in cases:
            with self.subTest(what=what, changed=changed):
                run = self.converge("scene.yaml", *changed, "--resume", expect=2)
                self.assert_one_error(run, "a different experiment", what)
        self.assertEqual(self.rows("out"), before)
        # The measured quantity is scene radiance, independent of the display.
        self.converge(
            "scene.yaml", *SMALL, "--set", "film.exposure_ev=1", "--set", "film.white_balance=A", "--resume"
        )

    def test_resume_refuses_what_it_cannot_read(self):
        self.converge("scene.yaml", *SMALL)
        replicates = self.path("out/replicates")
        name = os.path.join(replicates, sorted(os.listdir(replicates))[0])
        with open(name, "r+b") as file:
            file.truncate(os.path.getsize(name) - 4)
        run = self.converge("scene.yaml", *SMALL, "--resume", expect=2)
        self.assert_one_error(run, "is not a replicate of this run")
        os.remove(name)
        os.remove(self.path("out/experiment.json"))
        self.assert_one_error(self.converge("scene.yaml", *SMALL, "--resume", expect=2), "experiment.json")

    def test_a_resumed_run_says_of_the_same_rows_what_the_first_said(self):
        # A slow machine may not reach enough looks for a fit in the shorter time.
        for seconds in ("3s", "30s"):
            folder = f"out_{seconds}"
            self.converge("scene.yaml", *SMALL, "--replicates", "4", folder=folder, time=seconds, spp="64")
            first = self.summary(folder)
            if "error" in first["fits"][0]:
                break
        self.converge("scene.yaml", *SMALL, "--replicates", "4", "--resume", folder=folder, time="0.01s",
                      spp="64")
        again = self.summary(folder)
        fit, fit_again = first["fits"][0], again["fits"][0]
        self.assertIn("error", fit)
        for name in ("verdict", "verdict_reason", "error", "slope_against_samples", "relative_mean_bias_rgb",
                     "points"):
            self.assertEqual(fit_again[name], fit[name], name)
        configuration, configuration_again = first["configurations"][0], again["configurations"][0]
        for name in ("width", "height", "image_tests", "scene_hash", "kept", "left_out"):
            self.assertEqual(configuration_again[name], configuration[name], name)
        self.assertEqual(again["configurations"][0]["width"], 16)
        self.assertIsNotNone(again["configurations"][0]["image_tests"]["smallest_tile_p"])

    def test_scenes_of_one_file_name_are_kept_apart_and_repeats_refused(self):
        for folder, fov in (("a", 20), ("b", 60)):
            os.makedirs(self.path(folder))
            with open(self.path("scene.yaml"), encoding="utf-8") as file:
                text = file.read()
            with open(self.path(f"{folder}/scene.yaml"), "w", encoding="utf-8") as file:
                file.write(text)
        self.converge("a/scene.yaml", "b/scene.yaml", *SMALL)
        self.assertEqual({fit["scene"] for fit in self.summary("out")["fits"]}, {"a/scene", "b/scene"})
        rows = self.rows("out")
        keys = [(row["scene"], row["replicate"], row["samples_per_pixel"]) for row in rows
                if row["between_replicates_mse"] is None]
        self.assertEqual(len(keys), len(set(keys)))
        self.assert_one_error(self.converge("scene.yaml", "./scene.yaml", folder="c", expect=2), "twice")
        twice = f"{self.backend},{self.backend}"
        run = self.crt("converge", "scene.yaml", "--backends", twice, "-o", "d", expect=2)
        self.assert_one_error(run, "--backends", "twice")
        run = self.converge("scene.yaml", "--vary", "nee=true,true", folder="e", expect=2)
        self.assert_one_error(run, "--vary nee", "twice")

    def test_a_reference_of_other_colours_is_refused(self):
        self.make_reference(64)
        for changed in ("film.exposure_ev=1", "film.color_space=acescg",
                        "film.white_balance={illuminant: A}"):
            with self.subTest(changed=changed):
                run = self.converge(
                    "scene.yaml",
                    "--reference",
                    "ref.exr",
                    "--set",
                    changed,
                    "--set",
                    "film.apply_to_float=true",
                    *SMALL,
                    folder="o" + changed[5:8],
                    expect=2,
                )
                self.assert_one_error(run, "a reference with other colour settings")
        self.converge(
            "scene.yaml", "--reference", "ref.exr", "--set", "film.exposure_ev=1", *SMALL, folder="same"
        )

    def test_a_reference_of_another_scene_says_what_differs(self):
        self.make_reference(64)
        for change, words in (
            ("film.resolution=[8,8]", "the resolution is 16 × 16, not 8 × 8"),
            ("integrator.max_depth=3", "max_depth is 16, not 3"),
            ("camera.fov=20", "the camera is at"),
            ("materials.floor.reflectance=0.2", "the materials differ"),
        ):
            with self.subTest(change=change):
                run = self.converge(
                    "scene.yaml", "--reference", "ref.exr", *SMALL, "--set", change, folder="o", expect=2
                )
                self.assert_one_error(run, "a reference for another scene", words)
                self.assertNotIn("the seed", run.stderr)

    def test_a_variant_that_shows_another_image_is_not_held_against_the_reference(self):
        depths = ["--set", "integrator.max_depth=4", "--vary", "depth=1,4"]
        self.converge("scene.yaml", *SMALL, *depths)
        fits = {fit["variant"]: fit for fit in self.summary("out")["fits"]}
        self.assertIsNone(fits["depth=1"]["relative_mean_bias_rgb"])
        self.assertEqual(fits["depth=1"]["verdict"], "INCONCLUSIVE")
        self.assertIsNotNone(fits["depth=4"]["relative_mean_bias_rgb"])
        notes = self.summary("out")["notes"]
        self.assertTrue(any("'depth=1' shows another image" in note for note in notes), notes)

    def test_variants_that_choose_lights_in_other_ways_are_measured_against_the_reference(self):
        self.converge("scene.yaml", *SMALL, "--set", "environment={radiance: 0.3}",
                      "--vary", "integrator.mis=true,false",
                      "--vary", "environment.light_sampling=true,false")
        summary = self.summary("out")
        fits = {fit["variant"]: fit for fit in summary["fits"]}
        self.assertEqual(set(fits), {f"integrator.mis={mis} environment.light_sampling={sampled}"
                                     for mis in ("true", "false") for sampled in ("true", "false")})
        # Equal hashes would be the same content, whatever the comparison ignores.
        self.assertEqual(len({of["scene_hash"] for of in summary["configurations"]}), 4)
        for variant, fit in fits.items():
            self.assertIsNotNone(fit["relative_mean_bias_rgb"], variant)
            self.assertEqual(fit["error_source"], "reference", variant)
        self.assertFalse([note for note in summary["notes"] if "another image" in note], summary["notes"])

    def test_few_pixels_of_a_right_image_reach_the_ends_of_the_z_map(self):
        """A pixel's own standard error has one degree of freedom: of normal errors divided by it 16 % lie
        beyond 4 (Student), and of this scene, with the variance of the reference, 5.7 to 8.0 %. Errors
        divided by a standard error of 7 × 7 pixels have a mean square near 1; of normal ones 0.02 % lie
        beyond 4 (49 degrees of freedom). Noisy pixels beside quiet ones raise this: 467 seeds of this
        scene had 0.29 % with a standard deviation of 0.08 %, and squares, cut at 16, of 0.88 with 0.03.
        The bounds are eight of these away, so any seed passes; the map's depends on the time."""
        self.write("panel.yaml", PANEL)
        self.crt("reference", "panel.yaml", "-o", "ref.exr", "--spp", "512", "--same-estimator",
                 "-b", self.backend)
        # A slow machine may not reach 16 samples in the shorter time.
        for seconds in ("2s", "10s", "60s"):
            self.converge("panel.yaml", "--resolution", "0", "--reference", "ref.exr", spp="16",
                          time=seconds, folder=f"out_{seconds}")
            maps = self.summary(f"out_{seconds}")["scenes"][0]["maps"]["configurations"][0]
            if maps["samples_per_pixel"] == 16:
                break
        self.assertEqual(maps["samples_per_pixel"], 16)
        file, = [picture["file"] for picture in maps["pictures"] if picture["title"] == "z"]
        z = z_values(self.path(f"out_{seconds}/{file}"))
        self.assertEqual(len(z), 64 * 64)
        self.assertLess(sum(value == 4 for value in z), 0.01 * len(z))
        self.assertAlmostEqual(sum(value * value for value in z) / len(z), 0.9, delta=0.3)

    def test_without_a_reference_one_is_made_within_the_time(self):
        run = self.converge("scene.yaml", *SMALL, time="4s", spp="64")
        self.assertIn("no reference was given", run.stderr)
        summary = self.summary("out")
        reference = summary["references"][0]
        self.assertEqual(reference["kind"], "independent")
        self.assertTrue(os.path.exists(self.path("out/reference-scene.exr")))
        self.assertEqual(summary["fits"][0]["error_source"], "reference")
        self.assertTrue(any("of the 4.0 s of --time on "
                            "one" in note for note in summary["notes"]), summary["notes"])

    def test_void_rows_fail_in_text_and_exit_code(self):
        run = self.crt(
            "converge",
            "scene.yaml",
            "--backends",
            "fake",
            "--reference",
            "0.5",
            "--time",
            "2s",
            "--max-spp",
            "64",
            "-o",
            "out",
            "--set",
            "film.resolution=[8,8]",
            expect=7,
            CRT_FAKE_FAULT="nan",
        )
        self.assertIn("FAIL", run.stderr)
        self.assertIn("void", run.stderr)
        self.assertEqual(self.summary("out")["fits"][0]["verdict"], "FAIL")

    def test_maps_are_of_the_samples_that_all_have_and_of_their_own_replicate(self):
        """The fake backend takes its time with every look, the real one does not: pictures of the real one
        are made of fewer samples than it reached, and must be those of its last replicate then."""
        size = ["--set", "film.resolution=[16,96]"]
        self.crt("converge", "scene.yaml", "--backends", f"{self.backend},fake", "--reference", "5",
                 "--time", "6s", "--max-spp", "64", "--replicates", "4", "-o", "out", *size, expect=7,
                 CRT_FAKE_FAULT="slow")
        maps = {of["backend"]: of for of in self.summary("out")["scenes"][0]["maps"]["configurations"]}
        samples = maps["fake"]["samples_per_pixel"]
        self.assertEqual(maps[self.backend]["samples_per_pixel"], samples)
        rows = [row for row in self.rows("out") if row["backend"] == self.backend]
        self.assertLess(samples, max(row["samples_per_pixel"] for row in rows))
        seed = max(rows, key=lambda row: row["replicate"])["seed"]
        self.crt("scene.yaml", "-b", self.backend, "--spp", str(samples), "-o", "own.png", *size,
                 "--set", f"sampler.seed={seed}")
        shown = maps[self.backend]["pictures"][0]["file"]
        self.assertEqual(png_pixels(self.path(f"out/{shown}")), png_pixels(self.path("own.png")))

    def test_start_up_is_not_charged_to_whoever_is_first(self):
        self.crt("converge", "scene.yaml", "--backends", "fake", "--reference", "5",
                 "--vary", "roulette=true,false", "--time", "6s", "--max-spp", "8", "-o", "out",
                 "--set", "film.resolution=[8,8]", expect=7, CRT_FAKE_FIRST_START_MS="700")
        starts = {row["variant"]: row["seconds_before_first_sample"] for row in self.rows("out")}
        self.assertEqual(len(starts), 2)
        self.assertLess(max(starts.values()), 0.5, starts)

    def test_start_up_is_measured_for_every_replicate(self):
        self.crt("converge", "scene.yaml", "--backends", "fake", "--reference", "5", "--time",
        "6s", "--max-spp",
                 "8", "-o", "out", "--set", "film.resolution=[8,8]", expect=7)
        starts = {row["replicate"]: row["seconds_before_first_sample"] for row in self.rows("out")}
        self.assertGreaterEqual(len(starts), 2)
        # Two of hundreds may agree to the last digit.
        self.assertGreater(len(set(starts.values())), len(starts) / 2, starts)

    def test_a_resumed_run_keeps_all_commands_and_the_seconds_of_all(self):
        run = ["converge", "scene.yaml", "--backends", "fake", "--reference", "5", "--max-spp",
        "8", "-o", "out",
               "--set", "film.resolution=[8,8]"]
        self.crt(*run, "--time", "3s", expect=7)
        first = self.summary("out")["environment"]
        self.crt(*run, "--time", "4s", "--resume", expect=7)
        both = self.summary("out")["environment"]
        self.assertEqual(both["commands"][:1], first["commands"])
        self.assertIn("4s", both["commands"][1])
        self.assertEqual(len(both["commands"]), 2)
        self.assertGreater(both["spent_seconds"], first["spent_seconds"])
        self.assertEqual(both["started"], first["started"])

    def test_rows_of_two_processors_do_not_mix(self):
        run = ["converge", "scene.yaml", "--backends", "fake", "--reference", "5", "--max-spp",
        "8", "-o", "out",
               "--set", "film.resolution=[8,8]", "--time", "3s"]
        self.crt(*run, expect=7)
        with open(self.path("out/experiment.json")) as file:
            experiment = json.load(file)
        experiment["properties"][0]["values"]["the processor"] = "another one"
        with open(self.path("out/experiment.json"), "w") as file:
            json.dump(experiment, file)
        result = self.crt(*run, "--resume", expect=2)
        self.assertIn("the processor of the run was another one", result.stderr)

    def test_vary_takes_combinations_and_names_what_it_does_not_know(self):
        self.crt(
            "converge",
            "scene.yaml",
            "--backends",
            self.backend,
            "--vary",
            "sampler=sobol,independent",
            "--vary",
            "nee=true,false",
            "--time",
            "3s",
            "--max-spp",
            "4",
            "-o",
            "out",
            "--set",
            "film.resolution=[8,8]",
        )
        self.assertEqual(
            {row["variant"] for row in self.rows("out")},
            {f"sampler={s} nee={n}" for s in ("sobol", "independent") for n in ("true", "false")},
        )
        self.assert_one_error(
            self.crt("converge", "scene.yaml", "--vary", "smapler=sobol", expect=2), "did you mean 'sampler'"
        )

    def test_target_error_stops_when_it_is_reached(self):
        self.crt("scene.yaml", "-b", self.backend, "--target-error", "2%", "-o", "a.pfm", *SMALL)
        report = self.report("a.report.json")
        self.assertEqual(report["stop"]["reason"], "target error")
        self.assertLessEqual(report["error"]["half_width_95"], 0.025)
        samples = report["samples"]["per_pixel"]
        self.assertEqual(samples & (samples - 1), 0)
        self.assert_one_error(
            self.crt(
                "scene.yaml",
                "-b",
                self.backend,
                "--target-error",
                "2%",
                "--set",
                "sampler.replicates=1",
                expect=2,
            ),
            "replicates",
        )
        self.assert_one_error(
            self.crt("scene.yaml", "--target-error", "200%", expect=2), "an error such as 1%"
        )


if __name__ == "__main__":
    harness.main(__doc__)
