#!/usr/bin/env python3
"""First experiences of a new user: versions, names from other programs, images that are overexposed or
black, exposures, units, light that no path finds, and scenes of other renderers.

    test_first_steps.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import math
import os
import re
import stat
import struct

import harness
from harness import LIT, SCENE, CliTest, LightTest, read_pfm
from image_headers import exr_header, png_texts

WHITE_CD_M2 = 72983.5  # Of a pixel with Y = 1.

# A floor of reflectance 0.5, below a lamp of 800 lm, seen straight on; lengths times the factor.
BULB = """\
crt: 1
camera: {{position: [0, {0}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 1}}
film: {{resolution: [1, 1]}}
integrator: {{max_depth: 1}}
materials: {{grey: {{type: diffuse, reflectance: 0.5}}}}
lights: [{{name: bulb, type: point, position: [0, {1}, 0], luminous_flux_lm: 800}}]
objects:
  - rectangle: {{size: [{1}, {1}]}}
    material: grey
    transform: [{{rotate: {{axis: [1, 0, 0], angle_deg: -90}}}}]
"""
BULB_Y = 800 / (4 * math.pi) / 2 ** 2 * 0.5 / math.pi / WHITE_CD_M2

# A ball on a floor below a lamp: the first field is the ball's material, the second the lamp.
BALL = """\
crt: 1
camera: {{position: [0, 1, -4], target: [0, 0.5, 0], fov: 40}}
film: {{resolution: [24, 16]}}
materials:
  grey: {{type: diffuse, reflectance: 0.5}}
  it: {{{0}}}
lights: [{{{1}}}]
objects:
  - {{sphere: {{radius: 0.5}}, material: it, transform: [{{translate: [0, 0.5, 0]}}]}}
  - rectangle: {{size: [4, 4]}}
    material: grey
    transform: [{{rotate: {{axis: [1, 0, 0], angle_deg: -90}}}}]
"""
GLASS = "type: dielectric, ior: 1.5"
MIRROR = "type: mirror, reflectance: 1"
GREY = "type: diffuse, reflectance: 0.5"
POINT = "type: point, position: [0, 2, 0], radiant_intensity: 1"
SPOT = "type: spot, position: [0, 2, 0], direction: [0, -1, 0], cone_angle_deg: 60, radiant_intensity: 1"
SUN = "type: sun, direction: [0, -1, 0], radiance: 1"
NOT_FOUND = "light of point lights that smooth glass refracts or reflects"
ERROR = r"error [\d.]+ % \([\d.]+-[\d.]+\) expected; this image: at most [\d.]+ %"


class Names(CliTest):
    def test_the_version_by_every_way(self):
        version = self.crt("--version").stdout
        self.assertRegex(version, r"^crt \d+\.\d+\.\d+\n$")
        self.assertEqual(self.crt("version").stdout, version)
        self.assertRegex(self.crt("--help").stdout, r"(?m)^  --version  ")

    def test_a_backend_that_there_is_not(self):
        run = self.crt("scene.yaml", "-b", "cpu", expect=4)
        self.assert_one_error(run, "backends are", "cuda", "embree", "opencl", "fake")

    def test_files_of_other_programs(self):
        programs = {"a.blend": "Blender", "a.FBX": "FBX", "a.usdz": "USD", "a.dae": "COLLADA"}
        read = ".yaml, .glb, .gltf, .obj, .ply and .stl"
        for name, program in programs.items():
            self.write(name, "")
            self.assert_one_error(self.crt(name, expect=3), program, read)

    def test_a_folder_that_takes_no_files(self):
        run = self.crt("scene.yaml", "-b", "fake", "-o", "/proc/x.png", expect=6)
        self.assert_one_error(run, "the folder '/proc' does not allow new files")

    def test_what_a_kernel_leaves_out_is_listed_on_demand(self):
        short, long = self.crt("info", "scene.yaml").stdout, self.crt("info", "-v", "scene.yaml").stdout
        self.assertRegex(short, r"left out +\d+ features of the kernel; --verbose lists them\n")
        self.assertGreater(len(long.splitlines()), len(short.splitlines()) + 10)

    def test_an_argument_is_named_once(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "square.exr", "--set", "film.resolution=[8, 8]")
        run = self.crt("scene.yaml", "-b", "fake", "--set", "environment.image=square.exr", expect=3)
        self.assertEqual(run.stderr.count("--set environment.image"), 1, run.stderr)
        self.assertNotIn(":0:0", run.stderr)
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--set",
                       "camera={position: [0, 1, -4], focal_length: 1, sensor: [1, 1]}")
        self.assertIn("--set camera: sensor and resolution", run.stderr)

    def test_eight_bits_hold_no_sun(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "sky.png", "--set", "film.resolution=[16, 8]")
        with open(self.path("sky.pfm"), "wb") as file:
            file.write(b"PF\n2 1\n-1\n" + struct.pack("<6f", *[1] * 6))
        for name, warned in (("sky.png", True), ("sky.pfm", False)):
            run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--set", f"environment.image={name}")
            self.assertEqual("the sun or lamps" in run.stderr, warned, run.stderr)


class Exposure(CliTest):
    def setUp(self):
        super().setUp()
        self.write("lit.yaml", LIT)

    def test_a_picture_that_is_too_bright_says_by_how_much(self):
        def render(stops):
            exposure = f"film.exposure_ev={stops}"
            return self.crt("lit.yaml", "-b", "fake", "-o", "a.png", "--set", exposure).stderr

        said = re.search(r"warning: 'a.png': .* reduce film.exposure_ev by about ([\d.]+) stops", render(6))
        self.assertTrue(said)
        self.assertNotIn("overexposed", render(6 - float(said[1])))
        self.assertIn("overexposed", render(6 - float(said[1]) + 1))

    def test_auto_is_an_exposure_that_can_be_written_down(self):
        run = self.crt("lit.yaml", "-b", "fake", "-o", "a.ppm", "-o", "a.pfm", "-o", "a.crtfilm", "--expose",
                       "auto", "--set", "film.exposure_ev=9")
        exposure = re.search(r"--set film\.exposure_ev=(-?[\d.]+) gives the same picture", run.stderr)[1]
        _, _, values = read_pfm(self.path("a.pfm"))  # Radiance, whatever the exposure.
        luminances = [0.2126 * r + 0.7152 * g + 0.0722 * b
                      for r, g, b in zip(values[0::3], values[1::3], values[2::3])]
        mean = sum(luminances) / len(luminances)
        logs = [math.log2(y) for y in luminances if y > mean / 1000]
        self.assertAlmostEqual(float(exposure), math.log2(0.18) - sum(logs) / len(logs), delta=0.011)
        self.crt("lit.yaml", "-b", "fake", "-o", "b.ppm", "--set", "film.exposure_ev=" + exposure)
        self.assertEqual(self.bytes("a.ppm"), self.bytes("b.ppm"))
        # The film stores it, and develop chooses the same.
        self.assertIn(f"exposure {float(exposure):+g} EV", self.crt("info", "a.crtfilm").stdout)
        self.crt("develop", "a.crtfilm", "-o", "c.ppm", "--expose", "auto", "--set", "film.exposure_ev=1")
        self.assertEqual(self.bytes("a.ppm"), self.bytes("c.ppm"))

    def test_auto_is_refused_of_views_and_of_other_words(self):
        self.assert_one_error(self.crt("lit.yaml", "-b", "fake", "--expose", "auto", "--set",
                                       "integrator.type=normals", expect=2), "integrator.type path")
        self.assert_one_error(self.crt("lit.yaml", "-b", "fake", "--expose", "more", expect=2), "auto")

    def bytes(self, name):
        return harness.read_bytes(self.path(name))


class Units(LightTest):
    def render(self, text, *options):
        self.write("bulb.yaml", text)
        run = self.crt("bulb.yaml", "-b", self.backend, "--spp", "4096", "-o", "a.pfm", "-o", "a.png",
                       "--set", "film.color_space=xyz", *options)
        return read_pfm(self.path("a.pfm"))[2][1], run.stderr

    def test_a_bulb_in_millimetres_is_as_bright_as_in_metres(self):
        in_metres, said = self.render(BULB.format(1, 2))
        self.assertAlmostEqual(in_metres / BULB_Y, 1, delta=1e-3)
        self.assertNotIn("unit: mm", said)
        in_millimetres, said = self.render("crt: 1\nunit: mm\n" + BULB.format(1000, 2000)[7:])
        self.assertAlmostEqual(in_millimetres / in_metres, 1, delta=1e-5)
        self.assertNotIn("unit: mm", said)

    def test_a_black_picture_names_the_unit(self):
        dark, said = self.render(BULB.format(1000, 2000))
        self.assertAlmostEqual(dark / BULB_Y, 1e-6, delta=1e-8)
        self.assertIn("a scene unit is a metre", said)
        self.assertIn("write 'unit: mm'", said)
        # Not if the scene states that size.
        self.assertNotIn("unit: mm", self.render(BULB.format(1000, 2000), "--set", "unit=m")[1])
        self.assertNotIn("unit: mm", self.render(BULB.format(1000, 2000), "--set", "film.exposure_ev=25")[1])

    def test_radians_make_a_black_picture(self):
        self.write("narrow.yaml", SCENE.replace("fov: 40", "fov: 0.7").replace("target: [0, 0.5, 0]",
                                                                            "target: [0, 9, 0]"))
        run = self.crt("narrow.yaml", "-b", self.backend, "-o", "a.pfm")
        self.assertIn("'fov' is in degrees, and the camera sees 0.7 of them", run.stderr)


class MissingLight(CliTest):
    """No path finds the light of a lamp without a size that a glass ball passes on. crt derives this from
    the scene, so the fake backend renders it here."""

    def render(self, material, light=POINT, *options):
        self.write("ball.yaml", BALL.format(material, light))
        return self.crt("ball.yaml", "-b", "fake", "--spp", "16", "-o", "a.exr", "-o", "a.png", "-o",
                        "a.crtfilm", *options).stderr

    def warnings(self, said):
        return [line for line in said.splitlines() if line.startswith("crt: warning:")]

    def test_a_warning_names_the_light_and_the_surface(self):
        for material, light, lacks in (
            (GLASS, POINT, NOT_FOUND),
            (MIRROR, POINT, "light of point lights that mirrors and smooth metals reflect"),
            (GLASS, SPOT, "light of spot lights that smooth glass refracts or reflects"),
        ):
            with self.subTest(lacks=lacks):
                warnings = self.warnings(self.render(material, light))
                self.assertEqual(len(warnings), 1, warnings)
                self.assertIn(f"the image lacks {lacks}: ", warnings[0])
                self.assertIn("the stated error does not include it; use an emitting sphere", warnings[0])

    def test_a_warning_of_a_small_depth_names_the_setting(self):
        for depth, warned in ((2, True), (3, False)):
            said = self.render(GLASS, SUN, "--set", f"integrator.max_depth={depth}")
            self.assertEqual("surfaces behind a glass body" in said, warned, said)
            self.assertEqual("; raise 'max_depth'" in said, warned, said)

    def test_the_report_lists_it(self):
        self.render(GLASS)
        self.assertEqual(self.report("a.report.json")["missing_light"], [NOT_FOUND])

    def test_images_keep_it(self):
        self.render(GLASS)
        self.assertEqual(exr_header(self.path("a.exr"))["crt/missingLight"], ("string", NOT_FOUND))
        self.assertEqual(png_texts(self.path("a.png"))["crt/missingLight"], NOT_FOUND)
        self.assertRegex(self.crt("info", "a.exr").stdout, f"(?m)^  crt/missingLight +{NOT_FOUND}$")

    def test_films_keep_it_and_give_it_to_their_images(self):
        self.render(GLASS)
        self.assertRegex(self.crt("info", "a.crtfilm").stdout, f"(?m)^  missing +{NOT_FOUND}$")
        self.crt("ball.yaml", "-b", "fake", "--samples", "16:32", "-o", "b.crtfilm")
        self.crt("merge", "a.crtfilm", "b.crtfilm", "-o", "c.crtfilm")
        self.assertRegex(self.crt("info", "c.crtfilm").stdout, f"(?m)^  missing +{NOT_FOUND}$")
        os.remove(self.path("ball.yaml"))
        for film in ("a", "c"):
            self.crt("develop", f"{film}.crtfilm", "-o", "d.exr")
            self.assertEqual(exr_header(self.path("d.exr"))["crt/missingLight"], ("string", NOT_FOUND))

    def test_it_is_added_to_each_error_that_is_printed(self):
        said = self.render(GLASS)
        self.assertRegex(said, rf"(?m)^crt: info: 16 samples per pixel, .*, {ERROR} \+ missing light$")
        developed = self.crt("develop", "a.crtfilm", "-o", "b.exr").stderr
        self.assertRegex(developed, rf"(?m)16 samples per pixel, {ERROR} \+ missing light$")
        info = self.crt("info", "a.crtfilm").stdout
        self.assertRegex(info, rf"(?m)^  error +{ERROR[6:]} \+ missing light$")

    def test_of_the_same_scene_without_glass_there_is_none(self):
        said = self.render(GREY)
        self.assertEqual(self.warnings(said), [])
        self.assertEqual(self.report("a.report.json")["missing_light"], [])
        developed = self.crt("develop", "a.crtfilm", "-o", "b.exr").stderr
        info = "".join(self.crt("info", file).stdout for file in ("a.exr", "b.exr", "a.crtfilm"))
        for name in ("a.exr", "b.exr"):
            self.assertNotIn("crt/missingLight", exr_header(self.path(name)))
        self.assertNotIn("crt/missingLight", png_texts(self.path("a.png")))
        self.assertNotIn("issing", said + developed + info)
        self.assertNotIn("lacks", said)
        for line in (said, developed):
            self.assertRegex(line, f"(?m){ERROR}$")


class OtherRenderers(CliTest):
    """With a Python that writes down how it is called: the package is tested in python/tests."""

    def setUp(self):
        super().setUp()
        self.write("other.xml", "<scene/>")

    def python(self, looks):
        """An interpreter whose first call, which looks for the package, ends with this code."""
        path = self.path("python")
        with open(path, "w", encoding="utf-8") as file:
            file.write(f'#!/bin/sh\nif [ $# = 2 ]; then exit {looks}; fi\n'
                       'shift 2\nprintf "%s\\n" "$CRT_PROGRAM" "$@"\nexit 3\n')
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def test_the_package_gets_the_command_line(self):
        python = self.python(looks=0)
        for command in ([], ["render"], ["view"], ["info"]):
            words = [*command, "other.xml", "--set", "film.resolution=[8, 8]"]
            run = self.crt(*words, expect=3, CRT_PYTHON=python)
            implied = [] if command else ["render"]
            self.assertEqual(run.stdout.splitlines(), [os.path.realpath(harness.CRT), *implied, *words])
        # The scene goes to the front, where the package looks, and values of options are no scenes.
        run = self.crt("--spp", "2", "other.xml", "-q", expect=3, CRT_PYTHON=python)
        self.assertEqual(run.stdout.splitlines()[1:], ["render", "other.xml", "--spp", "2", "-q"])
        run = self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "--report", "other.xml", CRT_PYTHON=python)
        self.assertEqual(run.stdout, "")
        # The program checks the command line first.
        self.assertEqual(self.crt("other.xml", "--ssp", "3", expect=2, CRT_PYTHON=python).stdout, "")

    def test_without_the_package_there_is_a_hint(self):
        for python in ("", self.python(looks=1), "/nowhere/python"):
            run = self.crt("other.xml", expect=3, CRT_PYTHON=python)
            self.assert_one_error(run, "a scene of Mitsuba", "python3 -m crt import other.xml")

    def test_a_module_that_the_package_needs_is_named(self):
        os.makedirs(self.path("package/crt"))
        self.write("package/crt/__init__.py", "import a_module_that_there_is_not\n")
        self.write("package/crt/foreign_scenes.py", "")
        run = self.crt("other.xml", expect=3, CRT_PYTHON="python3", PYTHONPATH=self.path("package"))
        self.assert_one_error(run, "needs the module 'a_module_that_there_is_not'", "CRT_PYTHON")
        self.assertNotIn("Traceback", run.stderr)

    def test_what_lies_in_the_working_directory_is_not_run(self):
        os.makedirs(self.path("crt/importers"))
        for name in ("crt/__init__.py", "crt/__main__.py", "importlib.py"):
            self.write(name, "open('ran', 'w').close()\n")
        self.crt("other.xml", expect=3, CRT_PYTHON="python3", PYTHONPATH=None)
        self.assertFalse(os.path.exists(self.path("ran")))


if __name__ == "__main__":
    harness.main(__doc__)
