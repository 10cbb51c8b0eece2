#!/usr/bin/env python3
"""Metadata of image files: colour tags, dates, windows, matrices. Headers are read here, not by the library
that wrote them.

    test_images.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Python's standard library only.
"""


import harness
from image_headers import exr_header, png_chunks, png_texts
from harness import LIT, CliTest


class Headers(CliTest):
    EPOCH = "1700000000"  # 2023-11-14 22:13:20 UTC

    def setUp(self):
        super().setUp()
        self.write("lit.yaml", LIT)

    def render(self, *options):
        self.crt(
            "lit.yaml",
            "-b",
            "fake",
            "--report",
            "none",
            "-o",
            "a.exr",
            "-o",
            "a.png",
            *options,
            SOURCE_DATE_EPOCH=self.EPOCH
        )
        return {name: value for name, (_, value) in exr_header(self.path("a.exr")).items()}, png_texts(
            self.path("a.png")
        )

    def test_each_file_names_the_colour_space_of_its_own_pixels(self):
        for space, interop, red in (
            ("srgb", "lin_rec709_scene", (0.64, 0.33)),
            ("acescg", "lin_ap1_scene", (0.713, 0.293)),
            ("xyz", "lin_ciexyzd65_scene", (1, 0)),
        ):
            exr, png = self.render("--set", "film.color_space=" + space)
            self.assertEqual(exr["colorInteropID"], interop)
            self.assertEqual(tuple(round(v, 6) for v in exr["chromaticities"][:2]), red)
            self.assertEqual(png["colorInteropID"], "srgb_rec709_display")
            self.assertIn("sRGB", [kind for kind, _ in png_chunks(self.path("a.png"))])

    def test_the_luminance_of_white_is_said(self):
        """683.002 lm/W times the integral of the CIE 1931 observer's y, 106.8569 nm."""
        for options, factor in (
            ([], 1),
            (["--set", "film.color_space=acescg"], 1),
            (["--set", "film.color_space=xyz"], 1),
            (["--set", "film.exposure_ev=3"], 1),
            (["--set", "film.exposure_ev=3", "--set", "film.apply_to_float=true"], 8),
            (["--set", "film.white_balance=A", "--set", "film.apply_to_float=true"], 1),
        ):
            exr, _ = self.render(*options)
            self.assertAlmostEqual(exr["whiteLuminance"] * factor, 72983.5, delta=0.5, msg=options)
        self.assertRegex(self.crt("info", "a.exr").stdout, r"whiteLuminance +72983\.\d* cd/m")
        exr, _ = self.render("--set", "integrator.type=normals")
        self.assertNotIn("whiteLuminance", exr)

    def test_the_date_is_that_of_the_last_sample(self):
        exr, _ = self.render()
        self.assertEqual(exr["capDate"], "2023:11:14 22:13:20")
        self.assertEqual(exr["utcOffset"], 0)
        chunks = dict(png_chunks(self.path("a.png")))
        self.assertEqual(chunks["tIME"], bytes([2023 >> 8, 2023 & 255, 11, 14, 22, 13, 20]))
        # A film keeps it: what is written later is not what was rendered later.
        self.render("-o", "a.crtfilm")
        self.crt("develop", "a.crtfilm", "-o", "b.exr", SOURCE_DATE_EPOCH="1800000000")
        self.assertEqual(exr_header(self.path("b.exr"))["capDate"][1], "2023:11:14 22:13:20")
        self.crt(
            "lit.yaml",
            "-b",
            "fake",
            "-o",
            "b.exr",
            "-o",
            "b.crtfilm",
            "--samples",
            "16:20",
            SOURCE_DATE_EPOCH="1800000000",
        )
        self.crt("develop", "b.crtfilm", "a.crtfilm", "-o", "b.exr")
        self.assertEqual(exr_header(self.path("b.exr"))["capDate"][1], "2027:01:15 08:00:00")
        # Without the variable it is now, in UTC.
        self.crt("lit.yaml", "-b", "fake", "--report", "none", "-o", "c.exr")
        self.assertRegex(exr_header(self.path("c.exr"))["capDate"][1], r"^20\d\d:\d\d:\d\d \d\d:\d\d:\d\d$")

    def test_crop_is_the_data_window(self):
        exr, _ = self.render()
        self.assertEqual((exr["dataWindow"], exr["displayWindow"]), ((0, 0, 23, 15), (0, 0, 23, 15)))
        whole_ndc = exr["worldToNDC"]
        exr, _ = self.render("--crop", "4,2,10,5")
        self.assertEqual((exr["dataWindow"], exr["displayWindow"]), ((4, 2, 9, 4), (0, 0, 23, 15)))
        self.assertEqual(exr["worldToNDC"], whole_ndc)  # Of the display window.
        self.assertIn("6 x 3 pixels", self.crt("info", "a.exr").stdout)
        # Other formats have no windows and hold the pixels alone.
        size = dict(png_chunks(self.path("a.png")))["IHDR"][:8]
        self.assertEqual(size, bytes([0, 0, 0, 6, 0, 0, 0, 3]))

    def test_parts_of_a_picture_are_not_compared_with_other_parts(self):
        for name, crop in (("a", "4,2,10,5"), ("b", "5,2,11,5"), ("c", "4,2,10,5")):
            self.crt("lit.yaml", "-b", "fake", "--report", "none", "-o", name + ".exr", "--crop", crop)
        self.crt("compare", "a.exr", "c.exr")
        text = self.crt("compare", "a.exr", "b.exr", expect=7).stdout
        self.assertIn("[4, 10) × [2, 5) of 24 × 16 pixels and [5, 11) × [2, 5) of 24 × 16 pixels", text)

    def test_camera_matrices(self):
        exr, _ = self.render()
        self.assertEqual(exr_header(self.path("a.exr"))["worldToCamera"][0], "m44f")

        def transformed(point, m):
            x, y, z, w = (sum(point[r] * m[4 * r + c] for r in range(3)) + m[12 + c] for c in range(4))
            return x / w, y / w, z / w

        # The camera stands at (0, 1, -4) and looks at (0, 0.5, 0).
        for got, expected in zip(transformed((0, 1, -4), exr["worldToCamera"]), (0, 0, 0)):
            self.assertAlmostEqual(got, expected, places=5)
        for got, expected in zip(transformed((0, 0.5, 0), exr["worldToCamera"]), (0, 0, -(16.25 ** 0.5))):
            self.assertAlmostEqual(got, expected, places=5)
        for got, expected in zip(transformed((0, 0.5, 0), exr["worldToNDC"])[:2], (0.5, 0.5)):
            self.assertAlmostEqual(got, expected, places=5)
        # Right of the view is -x: right = view x up.
        self.assertGreater(transformed((-1, 0.5, 0), exr["worldToNDC"])[0], 0.6)
        self.assertLess(transformed((0, 1.5, 0), exr["worldToNDC"])[1], 0.4)  # Up is towards row 0.

    def test_a_neutral_white_that_was_not_applied_is_said(self):
        exr, _ = self.render("--set", "film.white_balance=A")
        for got, expected in zip(exr["adoptedNeutral"], (0.44758, 0.40745)):  # CIE 15
            self.assertAlmostEqual(got, expected, places=3)
        exr, _ = self.render("--set", "film.white_balance=A", "--set", "film.apply_to_float=true")
        self.assertNotIn("adoptedNeutral", exr)


if __name__ == "__main__":
    harness.main(__doc__)
