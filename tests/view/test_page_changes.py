#!/usr/bin/env python3
"""The page of `crt view` while things change: no gesture is lost, and no number is one of an earlier view.

    test_page_changes.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import math

from page_test import DONE, PageTest  # The first: it knows where the others are.

import harness
from harness import LIT


class Bursts(PageTest):
    """Input that is faster than the program's replies."""

    def press(self, page, *keys):
        """All of them before the page can hear of any."""
        page.evaluate("keys => { for (const key of keys) canvas.dispatchEvent(new KeyboardEvent("
                      "'keydown', { key, bubbles: true, cancelable: true })); }", list(keys))

    def arrived(self, page):
        self.wait(page, "!sending && knowsAllChanges(view.status)")

    def test_each_of_many_keys_counts(self):
        page = self.open()
        self.wait(page, DONE)
        self.press(page, *["]"] * 6)
        self.arrived(page)
        self.assertAlmostEqual(page.evaluate("view.status.exposure_ev"), 2)
        self.press(page, *["]", "["] * 20, "]", "]", "]")
        self.arrived(page)
        self.assertAlmostEqual(page.evaluate("view.status.exposure_ev"), 3)
        for keys, paused in (("    ", False), (" +  ", True)):
            self.press(page, *keys)
            self.arrived(page)
            self.assertEqual(page.evaluate("view.status.paused"), paused)
        self.press(page, *[","] * 5)
        self.arrived(page)
        expected = 2 * math.degrees(math.atan(math.tan(math.radians(20)) / 1.1 ** 5))
        self.assertAlmostEqual(page.evaluate("view.status.camera.fov_deg"), expected)

    def test_keys_keep_their_order(self):
        page = self.open()
        self.wait(page, DONE)
        self.press(page, "ArrowLeft", "ArrowLeft", "+", "r")
        self.arrived(page)
        self.assertFalse(page.evaluate("view.status.camera_moved"))
        self.press(page, "ArrowLeft", "r", "ArrowUp", "3", "5")
        self.arrived(page)
        self.assertTrue(page.evaluate("view.status.camera_moved"))
        self.assertEqual(page.evaluate("view.status.plane"), "depth")

    def test_a_gesture_beyond_what_one_change_takes_is_several(self):
        page = self.open()
        self.wait(page, DONE)
        release = self.hold(page, "**/change?*")
        self.press(page, "]", *["-"] * 60)
        release()
        self.arrived(page)
        distance = page.evaluate("Math.hypot(...view.status.camera.position.map("
                                 "(v, i) => v - view.status.camera.target[i]))")
        self.assertAlmostEqual(distance / (math.sqrt(16.25) / 0.9 ** 60), 1)

    def test_what_the_connection_loses_is_sent_again_and_counts_once(self):
        page = self.open()
        self.wait(page, DONE)
        lost = []

        def lose(route):
            # Before it reaches the program, and then on its way back.
            lost.append(route)
            if len(lost) == 2:
                route.fetch()
            route.abort()

        page.route("**/change?*", lose, times=2)
        self.press(page, *["]"] * 3)
        self.arrived(page)
        self.assertEqual(len(lost), 2)
        self.assertAlmostEqual(page.evaluate("view.status.exposure_ev"), 1)

    def test_keys_count_while_a_slider_has_the_focus(self):
        page = self.open()
        self.wait(page, DONE)
        page.locator("#exposure").focus()
        for _ in range(3):
            page.keyboard.press("]")
        self.arrived(page)
        self.assertEqual(page.locator("#exposure").input_value(), "1")
        # The slider keeps the user's value until the program has received it.
        release = self.hold(page, "**/change?*")
        for key in ("ArrowRight", "ArrowRight", "ArrowRight"):
            page.keyboard.press(key)
            samples = page.evaluate("view.status.samples_wanted") + 1
            self.view.change(samples=samples)
            self.wait(page, f"view.status.samples_wanted === {samples}")
        release()
        self.arrived(page)
        self.assertAlmostEqual(page.evaluate("view.status.exposure_ev"), 1.3)


class Pixel(PageTest):
    """The numbers of a pixel are never those of another view than the picture's."""

    def clicked(self, page):
        self.wait(page, DONE)
        x, y, box = self.middle(page)
        page.mouse.click(x, y + 0.3 * box["height"])
        self.wait(page, "probe.run !== null")
        return self.cells(page)

    def cells(self, page):
        names = page.locator("#pixel th").all_text_contents()
        return dict(zip(names, page.locator("#pixel td").all_text_contents()))

    def after(self, page, act, condition):
        """The panel before and after it hears of what `act` does."""
        release = self.hold(page, "**/pixel?*")
        act()
        self.wait(page, f"{condition} && {DONE}")
        kept = self.cells(page)
        release()
        self.wait(page, "probe.run === view.picture.run && probe.number === view.picture.number")
        return kept, self.cells(page)

    def assert_forgotten(self, cells):
        self.assertEqual({value for name, value in cells.items() if name != "Pixel"}, {"…"})

    def test_it_follows_the_camera(self):
        page = self.open()
        old = self.clicked(page)
        self.assertEqual(old["Object"], "floor")
        page.locator("#canvas").focus()
        # Half around and far below the floor: the pixel sees something else.
        kept, new = self.after(page, lambda: page.evaluate("change({ orbit: [1, -1] })"),
                               "view.status.camera_moved")
        self.assert_forgotten(kept)
        self.assertNotEqual(new["X Y Z"], old["X Y Z"])
        told = self.view.json("/pixel", x=int(new["Pixel"].split(",")[0]), y=int(new["Pixel"].split(",")[1]))
        self.assertEqual(new.get("Object"), told.get("object"))
        self.assertEqual(new["Samples"], str(told["samples"]))
        self.assertTrue(page.locator("#mark").is_visible())

    def test_it_follows_the_scene_and_more_samples(self):
        page = self.open()
        self.clicked(page)
        edited = LIT.replace("name: floor", "name: rug")
        kept, new = self.after(page, lambda: self.write("scene.yaml", edited), "view.picture.run > 1")
        self.assert_forgotten(kept)
        self.assertEqual(new["Object"], "rug")
        page.evaluate("change({ samples: 64 })")
        self.wait(page, f"view.status.samples === 64 && {DONE} && probe.number === view.picture.number")
        self.assertEqual(self.cells(page)["Samples"], "64")

    def test_a_film_of_another_size_has_no_such_pixel(self):
        page = self.open()
        self.clicked(page)
        self.write("scene.yaml", LIT.replace("resolution: [24, 16]", "resolution: [30, 20]"))
        self.wait(page, f"view.status.width === 30 && {DONE}")
        self.assertEqual(page.locator("#pixel").text_content(), "click on the image")
        self.assertFalse(page.locator("#mark").is_visible())

    def test_its_numbers_have_units(self):
        page = self.open()
        cells = self.clicked(page)
        self.assertTrue(cells["X Y Z"].endswith("W·m⁻²·sr⁻¹·nm⁻¹"), cells)
        y = float(cells["X Y Z"].split()[1])
        luminance, unit = cells["Luminance"].split()
        self.assertEqual(unit, "cd/m²")
        self.assertAlmostEqual(float(luminance) / (683.002 * 106.8569 * y), 1, 2)
        self.assertIn("cd/m²", cells["Standard error"])
        page.keyboard.press("Escape")
        self.assertEqual(page.locator("#pixel").text_content(), "click on the image")


if __name__ == "__main__":
    harness.main(__doc__)
