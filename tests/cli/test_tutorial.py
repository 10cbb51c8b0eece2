#!/usr/bin/env python3
"""docs/tutorial.md keeps its promise: the files on the page are scenes, each shows something, and every
command on the page works.

    test_tutorial.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import pathlib
import re
import shlex

import harness
from harness import LightTest, read_bytes

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/tutorial.md"
README = PAGE.parents[1] / "README.md"
FILE = re.compile(r"^```\w+\n# (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^    crt (.*)$", re.MULTILINE)
SMALL = ("--set", "film.resolution=[48, 32]")
DARKEST, BRIGHTEST = 40, 200  # Means of 8-bit values between which a picture is neither dark nor washed out.
FEWEST_LEVELS = 32            # Different values in a picture that shows something.


def pixels(path):
    """The bytes of a PPM."""
    return re.fullmatch(rb"P6\s+\d+ \d+\s+255\s(.*)", read_bytes(path), re.DOTALL)[1]


class Tutorial(LightTest):
    def setUp(self):
        super().setUp()
        text = PAGE.read_text("utf-8")
        self.files = dict(FILE.findall(text))
        self.commands = [shlex.split(line) for line in COMMAND.findall(text)]
        for name, content in self.files.items():
            self.write(name, f"# {name}\n{content}")

    def test_the_first_scene_has_twelve_lines(self):
        scene = self.files["ball.yaml"]
        self.assertEqual(len(scene.splitlines()), 12)
        self.assertIn(scene, README.read_text("utf-8"))

    def test_scenes_show_something(self):
        scenes = [name for name in self.files if name.endswith(".yaml")]
        self.assertGreaterEqual(len(scenes), 4)
        for name in scenes:
            with self.subTest(name):
                run = self.crt(name, "-b", self.backend, "--spp", "16", *SMALL, "-o", "a.ppm", "--overwrite")
                self.assertNotIn("warning", run.stderr)
                values = pixels(self.path("a.ppm"))
                self.assertEqual(len(values), 48 * 32 * 3)
                mean = sum(values) / len(values)
                self.assertTrue(DARKEST < mean < BRIGHTEST, f"{name}: the mean of its values is {mean:.0f}")
                self.assertGreater(len(set(values)), FEWEST_LEVELS)

    def test_commands_work(self):
        self.assertGreaterEqual(len(self.commands), 8)
        made = set()
        for words in self.commands:
            with self.subTest(" ".join(words)):
                output = words[words.index("-o") + 1]
                self.assertNotIn(output, made, "a command on the page overwrites the picture of another")
                made.add(output)
                self.crt(*words, "-b", self.backend, *SMALL)
                self.assertTrue(pathlib.Path(self.path(output)).stat().st_size > 0)

    def test_every_scene_is_rendered_by_a_command(self):
        rendered = {words[0] for words in self.commands}
        self.assertEqual({name for name in self.files if name.endswith(".yaml")} - rendered, set())


if __name__ == "__main__":
    harness.main(__doc__)
