"""The shared parts of the tests of the page of `crt view`: a browser, and a page of a view in it. Needs
Playwright and Chromium; without them exit code 77 says that a test was skipped.
"""

import pathlib
import shutil
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))

from harness import LightTest, LIT, PATIENCE_SECONDS  # noqa: E402
from view_client import View, without_alpha  # noqa: E402

try:
    from playwright.sync_api import sync_playwright
except ImportError:
    print("skipped: the Python package playwright is not installed")
    sys.exit(77)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None:
    print("skipped: there is no Chromium (Debian: chromium)")
    sys.exit(77)

DONE = "view.picture && view.picture.divisor === 1 && view.status.samples === view.status.samples_wanted" \
    " && view.picture.samples === view.status.samples && view.picture.of_this_camera && !sending" \
    " && knowsAllChanges(view.status)"


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
        # A program that is gone is no defect of the page.
        page.on("console", lambda said: said.type == "error" and "Failed to load resource" not in said.text
                and self.errors.append(said.text))
        page.goto(view.address)
        return page

    def tearDown(self):
        self.assertEqual(getattr(self, "errors", []), [])

    def wait(self, page, condition):
        """The test evaluates this, because the page's content policy forbids eval."""
        end = time.monotonic() + PATIENCE_SECONDS
        while not page.evaluate(f"Boolean({condition})"):
            self.assertLess(time.monotonic(), end, condition)
            page.wait_for_timeout(30)

    def hold(self, page, requests):
        """From now on the program hears of none of them; a function ends that."""
        held, holds = [], [True]

        def handle(route):
            if holds:
                held.append(route)
            else:
                route.continue_()

        def release():
            holds.clear()
            for route in held:
                route.continue_()

        page.route(requests, handle)
        return release

    def done_beyond(self, page, number):
        """Waits for a whole picture that was made after that one."""
        self.wait(page, f"{DONE} && view.picture.number > {number}")

    def number(self, page):
        return page.evaluate("view.picture.number")

    def pixels(self, page):
        """The pixels of the canvas, [height][width][3]."""
        return without_alpha(bytes(page.evaluate(
            "Array.from(paper.getImageData(0, 0, canvas.width, canvas.height).data)")))

    def middle(self, page):
        box = page.locator("#canvas").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box
