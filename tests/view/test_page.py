#!/usr/bin/env python3
"""The page of `crt view` in a browser: what hands do to it, what it shows, and what it says when something
is wrong.

    test_page.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import re

from page_test import DONE, PageTest  # The first: it knows where the others are.

import harness
from harness import LIT
from image_headers import png_pixels
from view_client import View, ppm_pixels

LENS = LIT.replace("fov: 40", "fov: 40, aperture_radius: 0.05")


class Picture(PageTest):
    def test_the_canvas_holds_what_render_writes(self):
        page = self.open("--spp", "5", "--set", "film.resolution=[64,40]")
        self.wait(page, DONE)
        self.crt("render", "scene.yaml", "-b", self.backend, "--spp", "5", "-o", "a.ppm", "--set",
                 "film.resolution=[64,40]", CRT_BACKEND_PATH="")
        self.assertEqual(self.pixels(page), ppm_pixels(self.path("a.ppm")))

    def test_exposure_is_developed_and_not_rendered(self):
        page = self.open()
        self.wait(page, DONE)
        before, number = self.pixels(page), self.number(page)
        seconds = page.evaluate("view.status.seconds")
        page.locator("#exposure").fill("2")
        self.wait(page, f"view.picture.number > {number} && view.status.exposure_ev === 2")
        self.assertGreater(sum(self.pixels(page)), sum(before))
        self.assertEqual(page.evaluate("view.status.seconds"), seconds)

    def test_planes_and_the_chart_of_errors(self):
        page = self.open("--spp", "512", "--set", "film.resolution=[96,64]")
        self.wait(page, f"{DONE} && document.querySelector('#chart .line')")
        number = self.number(page)
        page.get_by_role("button", name="depth").click()
        self.done_beyond(page, number)
        self.assertEqual(page.locator("[aria-pressed=true]").text_content(), "depth")
        self.assertIn("distance", page.locator("#legend").text_content())
        self.assertRegex(page.locator("#error").text_content(), r"^[0-9.]+ %$")

    def test_colour_bars_have_numbers_and_units(self):
        page = self.open("--spp", "32")
        self.wait(page, DONE)
        self.assertEqual(page.locator(".scale").count(), 0)
        expected = {"error": ["0.1 %", "1", "10", "100 %"], "albedo": ["0", "0.5", "1"],
                    "normal": ["-1", "0", "1"] * 3, "primitive": []}
        for plane, numbers in expected.items():
            page.get_by_role("button", name=plane).click()
            self.wait(page, f"view.picture.plane === '{plane}' && {DONE}")
            self.assertEqual(page.locator(".ticks span").all_text_contents(), numbers)
        page.get_by_role("button", name="depth").click()
        self.wait(page, f"view.picture.plane === 'depth' && {DONE}")
        scale = page.evaluate("view.picture.scales[0]")
        near, middle, far = page.locator(".ticks span").all_text_contents()
        self.assertEqual((near, far), tuple(f"{scale[end]:.4g} scene units" for end in ("low", "high")))
        self.assertTrue(scale["low"] < float(middle) < scale["high"])
        self.assertIn("linear-gradient", page.locator(".scale i").evaluate("e => e.style.background"))

    def test_the_picture_is_saved_as_it_is_shown(self):
        page = self.open()
        self.wait(page, DONE)
        page.locator("#canvas").focus()
        release = self.hold(page, "**/change?*")
        with page.expect_download() as download:
            page.keyboard.press("]")
            page.keyboard.press("p")
            page.wait_for_timeout(300)
            release()
        self.assertEqual(download.value.suggested_filename, "scene_16spp.png")
        self.wait(page, f"view.status.exposure_ev > 0 && {DONE}")
        self.assertEqual(b"".join(png_pixels(download.value.path())), self.pixels(page))
        page.get_by_role("button", name="depth").click()
        self.wait(page, f"view.picture.plane === 'depth' && {DONE}")
        with page.expect_download() as download:
            page.get_by_role("button", name="Save .png").click()
        self.assertEqual(download.value.suggested_filename, "scene_16spp_depth.png")
        self.assertEqual(b"".join(png_pixels(download.value.path())), self.pixels(page))

    def test_two_tabs_see_one_render(self):
        page = self.open()
        self.wait(page, DONE)
        other = self.page_of(self.view)
        other.locator("#canvas").focus()
        other.keyboard.press("3")
        self.wait(page, "view.picture.plane === 'albedo'")


class Hands(PageTest):
    def drag(self, page, right, down, button="left", modifier=None):
        x, y, _ = self.middle(page)
        if modifier:
            page.keyboard.down(modifier)
        page.mouse.move(x, y)
        page.mouse.down(button=button)
        page.mouse.move(x + right, y + down, steps=4)
        page.mouse.up(button=button)
        if modifier:
            page.keyboard.up(modifier)

    def test_a_drag_turns_the_camera_and_the_picture(self):
        page = self.open()
        self.wait(page, DONE)
        before, number = self.pixels(page), self.number(page)
        camera = page.evaluate("view.status.camera")
        self.drag(page, 120, 40)
        self.wait(page, "view.status.camera_moved")
        self.done_beyond(page, number)
        after = page.evaluate("view.status.camera")
        self.assertEqual(after["target"], camera["target"])
        self.assertGreater(after["position"][1], camera["position"][1])  # Dragged down: seen from above.
        self.assertNotEqual(self.pixels(page), before)
        self.assertIn(f"{after['position'][1]:.7g}", page.locator("#yaml").text_content())
        number = self.number(page)
        page.get_by_role("button", name="Reset to the scene").click()
        self.done_beyond(page, number)
        self.assertEqual(self.pixels(page), before)

    def test_shift_moves_the_target_and_the_wheel_the_distance(self):
        page = self.open()
        self.wait(page, DONE)
        target = page.evaluate("view.status.camera.target")
        self.drag(page, 60, 0, modifier="Shift")
        self.wait(page, f"view.status.camera.target[0] !== {target[0]}")
        distance = ("Math.hypot(...view.status.camera.position.map("
                    "(v, i) => v - view.status.camera.target[i]))")
        before = page.evaluate(distance)
        page.mouse.wheel(0, -300)
        self.wait(page, f"{distance} < {before} * 0.9")

    def test_two_fingers_pinch(self):
        page = self.open(width=390, height=844, has_touch=True)
        self.wait(page, DONE)
        x, y, _ = self.middle(page)
        session = page.context.new_cdp_session(page)
        for kind, half in (("touchStart", 30), ("touchMove", 60), ("touchMove", 90), ("touchEnd", None)):
            at = [] if half is None else [x - half, x + half]
            points = [{"x": each, "y": y, "id": i} for i, each in enumerate(at)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        # Three times as far from each other: a third of the distance.
        self.wait(page, "Math.abs(Math.abs(view.status.camera.position[2]) - 4 / 3) < 0.05")

    def test_a_click_tells_of_the_pixel_and_ctrl_focuses(self):
        self.write("scene.yaml", LENS)
        page = self.open()
        self.wait(page, DONE)
        x, y, box = self.middle(page)
        page.mouse.click(x, y + 0.3 * box["height"])
        page.locator("#pixel table").wait_for()
        self.assertRegex(page.locator("#pixel").inner_text(), r"Object\s+floor")
        self.assertFalse(page.evaluate("view.status.camera_moved"))
        page.keyboard.down("Control")
        page.mouse.click(x, y + 0.3 * box["height"])
        page.keyboard.up("Control")
        self.wait(page, "view.status.camera.focus_distance > 1")

    def test_keys(self):
        page = self.open()
        self.wait(page, DONE)
        page.locator("#canvas").focus()
        page.keyboard.press("Space")
        self.wait(page, "view.status.paused")
        page.keyboard.press("Space")
        self.wait(page, "!view.status.paused")
        page.keyboard.press("?")
        self.assertTrue(page.locator("#help").is_visible())
        page.keyboard.press("Escape")
        self.assertFalse(page.locator("#help").is_visible())
        with page.expect_download() as download:
            page.keyboard.press("s")
        self.assertEqual(download.value.suggested_filename, "scene_16spp.exr")
        self.assertEqual(harness.read_bytes(download.value.path())[:4], b"\x76\x2f\x31\x01")
        page.keyboard.press("ArrowLeft")
        self.wait(page, "view.status.camera_moved")


    def test_the_field_of_view_is_shown_in_degrees_and_changed(self):
        page = self.open()
        self.wait(page, DONE)
        self.assertEqual(page.locator("#fov-number").input_value(), "40")
        page.locator("#canvas").focus()
        page.keyboard.press(",")
        self.wait(page, f"view.status.camera.fov_deg < 39 && {DONE}")
        self.assertEqual(page.locator("#fov-number").input_value(),
                         f"{page.evaluate('view.status.camera.fov_deg'):.4g}")
        page.locator("#fov-number").fill("25")
        page.keyboard.press("Enter")
        self.wait(page, f"view.status.camera.fov_deg === 25 && {DONE}")
        self.assertIn("fov: 25", page.locator("#yaml").text_content())
        page.locator("#fov").fill("60")
        self.wait(page, "Math.abs(view.status.camera.fov_deg - 60) < 1e-9")


class Trouble(PageTest):
    def test_an_edit_is_shown_and_an_error_keeps_the_picture(self):
        page = self.open()
        self.wait(page, DONE)
        before = self.pixels(page)
        self.write("scene.yaml", LIT.replace("fov: 40", "fov: wide"))
        page.get_by_text("scene.yaml:3:58: error:").wait_for()
        self.assertEqual(self.pixels(page), before)
        number = self.number(page)
        self.write("scene.yaml", LIT.replace("reflectance: 0.7", "reflectance: 0.2"))
        self.done_beyond(page, number)
        self.assertLess(sum(self.pixels(page)), sum(before))
        self.assertEqual(page.locator("#notes .bad").count(), 0)

    def test_a_page_that_comes_late_has_nothing_to_complain_of(self):
        self.wait(self.open(), DONE)
        page = self.page_of(self.view)
        self.wait(page, f"{DONE} && document.querySelector('#devices').length > 1")
        self.assertEqual(page.locator("#notes").inner_text(), "")
        self.assertEqual(page.locator("#live").text_content(), "live")

    def test_a_lost_program_is_told_and_found_again(self):
        page = self.open()
        self.wait(page, DONE)
        before = self.pixels(page)
        self.view.process.kill()
        self.view.process.wait()
        self.wait(page, "!view.connected")
        self.assertEqual(page.locator("#live").text_content(), "connection lost")
        self.assertIn("does not respond", page.locator("#notes").inner_text())
        self.assertEqual(self.pixels(page), before)
        self.write("scene.yaml", LIT.replace("reflectance: 0.7", "reflectance: 0.2"))
        View(self, "-b", self.backend, port=self.view.port)
        self.wait(page, f"view.connected && {DONE}")
        self.wait(page, "!document.querySelector('#notes .bad')")
        self.assertEqual(page.locator("#live").text_content(), "live")
        self.assertLess(sum(self.pixels(page)), sum(before))

    def test_names_of_a_scene_are_text_and_no_markup(self):
        self.write("scene.yaml", LIT.replace("title: A lamp over a floor",
                                             "title: '<img src=x onerror=\"window.bad=1\">'"))
        page = self.open()
        self.wait(page, DONE)
        self.assertIn("<img", page.locator("#title").text_content())
        self.assertIsNone(page.evaluate("window.bad ?? null"))


class Width(PageTest):
    def test_nothing_scrolls_sideways(self):
        for width, height in ((390, 844), (320, 640), (1280, 800)):
            page = self.open(width=width, height=height)
            self.wait(page, DONE)
            x, y, box = self.middle(page)
            page.mouse.click(x, y + 0.3 * box["height"])
            page.locator("#pixel table").wait_for()
            self.assertLessEqual(page.evaluate("document.documentElement.scrollWidth"), width)
            self.assertLessEqual(box["x"] + box["width"], width)
            self.assertLess(abs(box["width"] / box["height"] - 24 / 16), 0.02)
            for plane in ("error", "normal", "depth"):
                page.evaluate(f"change({{ plane: '{plane}' }})")
                self.wait(page, f"view.picture.plane === '{plane}' && {DONE}")
                self.assertLessEqual(page.evaluate("document.documentElement.scrollWidth"), width)
                for bar in page.locator(".scale").all():
                    self.assertLessEqual(bar.bounding_box()["x"] + bar.bounding_box()["width"], width)

    def test_a_long_path_in_a_note_keeps_off_its_button(self):
        page = self.open(width=320, height=640)
        self.wait(page, DONE)
        page.evaluate("document.getElementById('notes').append("
                      "note('/' + 'folder_'.repeat(20) + 'scene.yaml:1:1: odd', '', false, true))")
        words = page.locator("#notes > * > div").last
        self.assertLessEqual(words.evaluate("e => e.scrollWidth - e.clientWidth"), 0)

    def test_both_colour_schemes_can_be_read(self):
        for scheme in ("dark", "light"):
            page = self.open(color_scheme=scheme)
            self.wait(page, DONE)
            colours = page.evaluate(
                "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]")
            text, ground = (sum(map(int, re.findall(r"\d+", colour)[:3])) / 765 for colour in colours)
            self.assertGreater(text - ground if scheme == "dark" else ground - text, 0.6)


if __name__ == "__main__":
    harness.main(__doc__)
