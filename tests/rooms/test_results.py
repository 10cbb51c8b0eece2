#!/usr/bin/env python3
"""Pages of docs/results: the commands that measure find their sections, and each claim names its command,
commit and date."""

import pathlib
import re
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))
sys.dont_write_bytecode = True
from crtbench import section  # noqa: E402

MARK = re.compile(r"<!-- (/?)results: (\S+) -->")
SOURCE = re.compile(r"`[^`]+`, commit `[0-9a-f]{7,10}\+?`, \d{4}-\d\d-\d\d\.")
BY_PARTS = "paper.md"  # Its first table names the commit of each part.


class Pages(unittest.TestCase):
    def setUp(self):
        self.pages = {page.name: page.read_text("utf-8") for page in section.PAGES.glob("*.md")}

    def test_they_are_few(self):
        self.assertLessEqual(len(self.pages), 8)

    def test_the_first_page_is_short(self):
        self.assertLessEqual(len((ROOT / "README.md").read_text("utf-8").splitlines()), 160)

    def test_marks_come_in_pairs_and_names_once(self):
        names = []
        for page, text in self.pages.items():
            marks = MARK.findall(text)
            self.assertEqual([name for end, name in marks[0::2]], [name for end, name in marks[1::2]], page)
            self.assertEqual([end for end, _ in marks], ["", "/"] * (len(marks) // 2), page)
            names += [name for end, name in marks if not end]
        self.assertEqual(len(names), len(set(names)))

    def test_each_claim_has_its_source_and_one_table(self):
        for page, text in self.pages.items():
            if page in (BY_PARTS, "README.md"):
                continue
            for claim in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
                title, *lines = claim.split("\n")
                with self.subTest(f"{page}: {title}"):
                    self.assertRegex(" ".join(lines), SOURCE)
                    self.assertEqual(sum(line.startswith("|---") for line in lines), 1)


class Sections(unittest.TestCase):
    def test_one_section_is_replaced(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "page.md"
            page.write_text("# A\n\n<!-- results: a -->\nold\n<!-- /results: a -->\n\n"
                            "<!-- results: b -->\nother\n<!-- /results: b -->\n")
            source = section.source("x", "0123456", "2026-01-01", "A machine")
            lines = section.section("Claim", source, "Text.", ["a", "b"], [[1, 2]])
            self.assertEqual(section.page_of("a", pathlib.Path(folder)), page)
            section.replace(page, "a", lines)
            self.assertEqual(page.read_text(), "# A\n\n<!-- results: a -->\n## Claim\n\n`x`, commit "
                             "`0123456`, 2026-01-01. A machine.\n\nText.\n\n"
                             "| a | b |\n|---|---|\n| 1 | 2 |\n"
                             "<!-- /results: a -->\n\n<!-- results: b -->\nother\n<!-- /results: b -->\n")
            with self.assertRaisesRegex(ValueError, "no section"):
                section.replace(page, "c", lines)
            self.assertIsNone(section.page_of("c", pathlib.Path(folder)))


if __name__ == "__main__":
    unittest.main()
