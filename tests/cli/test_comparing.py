#!/usr/bin/env python3
"""`crt compare` from outside.

    test_comparing.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os
import re
import shutil
import struct

import harness
from harness import CliTest, SCENE

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
            "A does not state its colour space; crt assumes that of B: ACEScg",
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
        self.assertIn("Variance.Y, %s degrees of freedom per pixel" % degrees, text)
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
        self.assertIn("samples were NaN or infinite", text)

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


if __name__ == "__main__":
    harness.main(__doc__)
