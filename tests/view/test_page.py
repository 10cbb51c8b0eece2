#!/usr/bin/env python3
"""The page of `crt view` in a browser: what hands do to it, what it shows, and what it says when something
is wrong. Needs Playwright and Chromium; without them exit code 77 says that it was skipped.

    test_page.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import pathlib
import re
import shutil
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))

import harness  # noqa: E402
from harness import LightTest, LIT  # noqa: E402
from view_client import View, ppm_pixels, without_alpha  # noqa: E402

try:
    from playwright.sync_api import sync_playwright
except ImportError:
    print("skipped: the Python package playwright is not installed")
    sys.exit(77)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None:
    print("skipped: there is no Chromium (Debian: chromium)")
    sys.exit(77)

PATIENCE_SECONDS = 900  # Only ends hangs: the machine may have much else to do.
DONE = "view.picture && view.picture.divisor === 1 && view.status.samples === view.status.samples_wanted" \
    " && view.picture.samples === view.status.samples && view.picture.of_this_camera && !sending"
LENS = LIT.replace("fov: 40", "fov: 40, aperture_radius: 0.05")


class PageTest(LightTest):
    @classmethod
    def setUpClass(cls):
        cls.playwright = sync_playwright().start()
        cls.addClassCleanup(cls.playwright.stop)
        # In a container root has no other way.
        cls.browser = cls.playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        cls.addClassCleanup(cls.browser.close)

    def setUp(self):
        super().setUp()
        self.write("scene.yaml", LIT)

    def open(self, *arguments, width=1280, height=800, **context):
        self.view = View(self, "-b", self.backend, *arguments)
        return self.page_of(self.view, width, height, **context)

    def page_of(self, view, width=1280, height=800, **context):
        context = self.browser.new_context(viewport={"width": width, "height": height}, **context)
        self.addCleanup(context.close)
        page = context.new_page()
        page.set_default_timeout(1000 * PATIENCE_SECONDS)
        self.errors = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(view.address)
        return page

    def tearDown(self):
        self.assertEqual(getattr(self, "errors", []), [])

    def wait(self, page, condition):
        """Asked from here: the page's own rules let nobody evaluate text in it."""
        end = time.monotonic() + PATIENCE_SECONDS
        while not page.evaluate(f"Boolean({condition})"):
            self.assertLess(time.monotonic(), end, condition)
            page.wait_for_timeout(30)

    def done_beyond(self, page, number):
        """Waits for a whole picture that was made after that one."""
        self.wait(page, f"{DONE} && view.picture.number > {number}")

    def number(self, page):
        return page.evaluate("view.picture.number")

    def pixels(self, page):
        """What the canvas holds, [height][width][3]."""
        return without_alpha(bytes(page.evaluate(
            "Array.from(paper.getImageData(0, 0, canvas.width, canvas.height).data)")))

    def middle(self, page):
        box = page.locator("#canvas").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box


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
        self.assertIn("scene units", page.locator("#legend").text_content())
        self.assertRegex(page.locator("#error").text_content(), r"^[0-9.]+ %$")

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
        page.get_by_role("button", name="As in the scene").click()
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
        self.assertEqual(download.value.suggested_filename, "scene.exr")
        self.assertEqual(harness.read_bytes(download.value.path())[:4], b"\x76\x2f\x31\x01")
        page.keyboard.press("ArrowLeft")
        self.wait(page, "view.status.camera_moved")


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
        self.assertIn("does not answer", page.locator("#notes").inner_text())
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
