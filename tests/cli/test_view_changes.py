#!/usr/bin/env python3
"""`crt view` as its pages see it: what they change, in which order it counts, and what they show and save.

    test_view_changes.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import threading
import urllib.error

import harness
from harness import CliTest, LightTest, LIT
from image_headers import png_pixels, png_texts
from view_client import View, is_done, without_alpha

UNIT_CD_M2 = 683.002 * 106.8569171  # lm/W, and the integral of the CIE 1931 observer's y, nm.


class Order(CliTest):
    """Pages number their changes: none is lost, none counts twice, and none overtakes another."""

    def view_of_scene(self):
        view = View(self, "-b", "fake")
        self.before, _ = view.wait_until_done()
        return view

    def refused(self, view, *arguments, **query):
        with self.assertRaises(urllib.error.HTTPError) as refused:
            view.changes(*arguments, **query)
        with refused.exception as reply:
            self.assertEqual(reply.code, 400)
            return reply.read().decode()

    def test_steps_of_many_pages_add_up(self):
        view = self.view_of_scene()

        def press(page):
            for number in range(1, 11):
                view.changes([{"exposure_step": 0.25}], page=page, first=number)

        pages = [threading.Thread(target=press, args=(f"page{i}",)) for i in range(6)]
        for page in pages:
            page.start()
        for page in pages:
            page.join()
        self.assertEqual(view.state()[0]["exposure_ev"], self.before["exposure_ev"] + 15)

    def test_what_is_sent_again_counts_once(self):
        view = self.view_of_scene()
        step = {"exposure_step": 1}
        view.changes([step, step], page="a", first=1)
        view.changes([step, step, step], page="a", first=1)
        view.changes([step], page="b", first=1)
        self.assertEqual(view.state()[0]["exposure_ev"], 4)
        view.changes([step], page="a", first=4)
        self.assertEqual(view.state()[0]["exposure_ev"], 5)

    def test_changes_are_made_in_their_order(self):
        view = self.view_of_scene()
        view.changes([{"orbit": [1, 0.2]}, {"zoom": 2}, {"reset_camera": True}])
        self.assertFalse(view.state()[0]["camera_moved"])
        view.changes([{"reset_camera": True}, {"orbit": [1, 0.2]}])
        self.assertTrue(view.state()[0]["camera_moved"])
        view.changes([{"toggle_paused": True}] * 3)
        self.assertTrue(view.state()[0]["paused"])
        view.changes([{"exposure_step": 2}, {"exposure_ev": 1}, {"exposure_step": 0.5}])
        self.assertEqual(view.state()[0]["exposure_ev"], 1.5)

    def test_a_refused_change_takes_no_other_with_it(self):
        view = self.view_of_scene()
        said = self.refused(view, [{"exposure_step": 1}, {"dolly": 0}, {"focus": [0.5, 0.5]},
                                   {"exposure_step": 1}], page="a", first=1)
        self.assertIn("dolly", said)
        self.assertIn("pinhole", said)
        self.assertEqual(view.state()[0]["exposure_ev"], 2)
        self.assertIn("list", self.refused(view, "none"))

    def test_the_reply_names_the_status_that_knows_of_the_change(self):
        view = self.view_of_scene()
        version = view.changes([{"exposure_step": 1}])["version"]
        self.assertGreater(version, self.before["version"])
        self.assertGreaterEqual(view.state()[0]["version"], version)


class Angle(LightTest):
    def test_a_field_of_view_is_that_of_a_scene_with_it(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend, "--spp", "4")
        first, before = view.wait_until_done()
        self.assertAlmostEqual(first["camera"]["fov_deg"], 40)
        self.assertNotIn("fov", first["camera_yaml"])
        view.change(fov_deg=25)
        status, pixels = view.wait(lambda s: is_done(s) and s["camera_moved"])
        self.assertIn("fov: 25 ", status["camera_yaml"])
        self.crt("render", "scene.yaml", "-b", self.backend, "--spp", "4", "-o", "a.png", "--set",
                 "camera.fov=25", CRT_BACKEND_PATH="")
        self.assertEqual(without_alpha(pixels), b"".join(png_pixels(self.path("a.png"))))
        view.change(reset_camera=True)
        _, again = view.wait(lambda s: is_done(s) and not s["camera_moved"])
        self.assertEqual(again, before)


class Shown(LightTest):
    def setUp(self):
        super().setUp()
        self.write("scene.yaml", LIT)
        self.view = View(self, "-b", self.backend, "--spp", "32")
        self.view.wait_until_done()

    def shown(self, plane):
        self.view.change(plane=plane)
        return self.view.wait(lambda s: s["picture"]["plane"] == plane and is_done(s), plane)

    def saved_png(self):
        name, content = self.view.download("/image.png")
        with open(self.path(name), "wb") as file:
            file.write(content)
        return name

    def test_a_pixel_has_units(self):
        floor = self.view.json("/pixel", x=12, y=12)
        self.assertEqual(floor["unit"], "W·m⁻²·sr⁻¹·nm⁻¹")
        self.assertAlmostEqual(floor["luminance_cd_m2"] / (UNIT_CD_M2 * floor["xyz"][1]), 1, 6)
        # 32 samples: the error is some per cent of the value.
        part = floor["luminance_error_cd_m2"] / floor["luminance_cd_m2"]
        self.assertTrue(0 < part < 1, part)

    def test_a_pixel_belongs_to_the_run_of_a_picture(self):
        run = self.view.state()[0]["picture"]["run"]
        self.assertEqual(self.view.json("/pixel", x=12, y=12)["run"], run)
        self.view.change(orbit=[0.5, 0])
        status, _ = self.view.wait(lambda s: is_done(s) and s["camera_moved"])
        self.assertGreater(status["picture"]["run"], run)
        self.assertEqual(self.view.json("/pixel", x=12, y=12)["run"], status["picture"]["run"])

    def test_false_colours_have_scales(self):
        units = {"error": ["%"], "albedo": [""], "normal": [""] * 3, "depth": ["scene units"]}
        for plane in ("image", "error", "albedo", "normal", "depth", "primitive"):
            status, _ = self.shown(plane)
            scales = status["picture"]["scales"]
            self.assertEqual([scale["unit"] for scale in scales], units.get(plane, []))
            for scale in scales:
                self.assertLess(scale["low"], scale["high"])
                self.assertGreater(len(set(scale["colours"])), 8)

    def test_the_scale_of_depths_is_that_of_the_picture(self):
        status, pixels = self.shown("depth")
        scale, = status["picture"]["scales"]
        looked_at = 0
        for y in range(16):
            depth = self.view.json("/pixel", x=12, y=y)["depth"]
            if not scale["low"] <= depth <= scale["high"]:
                continue
            part = (depth - scale["low"]) / (scale["high"] - scale["low"])
            step = part * (len(scale["colours"]) - 1)
            colours = [int(scale["colours"][i][1:3], 16) for i in (int(step), min(int(step) + 1, 32))]
            self.assertAlmostEqual(pixels[4 * (24 * y + 12)],
                                   colours[0] + (step % 1) * (colours[1] - colours[0]), delta=1.5)
            looked_at += 1
        self.assertGreater(looked_at, 3)

    def test_the_image_is_saved_with_the_exposure_and_white_of_the_view(self):
        self.view.change(exposure_step=1.5, white="glow")
        self.assertEqual(self.saved_png(), "scene_32spp.png")
        self.crt("render", "scene.yaml", "-b", self.backend, "--spp", "32", "-o", "a.png", "--set",
                 "film.exposure_ev=1.5", "--set", "film.white_balance=glow", CRT_BACKEND_PATH="")
        self.assertEqual(png_pixels(self.path("scene_32spp.png")), png_pixels(self.path("a.png")))
        saved, rendered = (png_texts(self.path(name)) for name in ("scene_32spp.png", "a.png"))
        for key in ("Description", "crt/seed", "crt/complete"):
            self.assertEqual(saved[key], rendered[key])

    def test_planes_are_saved_as_they_are_shown(self):
        for plane in ("error", "albedo", "normal", "depth", "primitive"):
            _, pixels = self.shown(plane)
            name = self.saved_png()
            self.assertEqual(name, f"scene_32spp_{plane}.png")
            self.assertEqual(b"".join(png_pixels(self.path(name))), without_alpha(pixels))
        self.assertIn("logarithmic", png_texts(self.path("scene_32spp_error.png"))["crt/scale"])


if __name__ == "__main__":
    harness.main(__doc__)
