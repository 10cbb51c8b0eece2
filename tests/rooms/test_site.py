#!/usr/bin/env python3
"""The programs that make the site (scripts/site), as far as they need no library: links are rewritten, lists
get their blank line, and errors in the HTML are found."""

import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/site"))
sys.dont_write_bytecode = True
import check_site  # noqa: E402
import make  # noqa: E402
import stage  # noqa: E402


class Stage(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.site = stage.Stage(pathlib.Path(folder.name))

    def page(self, source, text):
        page = self.site.add(ROOT / source, text)
        return (self.site.docs / page).read_text("utf-8")

    def test_links_are_those_of_the_page(self):
        for source, target, expected in (
                ("README.md", "docs/scene.md#film", "scene.md#film"),
                ("README.md", "docs/results", "results/index.md"),
                ("docs/error.md", "../README.md", "index.md"),
                ("docs/decisions/0015-libcrt.md", "../python.md", "../python.md"),
                ("docs/results/README.md", "../decisions/", "../decisions/index.md"),
                ("docs/notebooks/5_same_bits.ipynb", "../scene.md", "../scene.md"),
                ("docs/tour.md", "../core/film/film.h", "source/core/film/film.h.md"),
                ("docs/tour.md", "../core/film", "source/core/film/index.md"),
                ("docs/tour.md", "#rooms", "#rooms"), ("docs/tour.md", "https://a.org", "https://a.org")):
            self.assertEqual(self.page(source, f"[a]({target})\n"), f"[a]({expected})\n")

    def test_code_stays(self):
        text = "`[a](../README.md)` [b](../README.md)\n\n```\n[c](../README.md)\n```\n"
        expected = text.replace("[b](../README.md)", "[b](index.md)")
        self.assertEqual(self.page("docs/error.md", text), expected)

    def test_a_link_that_leads_nowhere_ends_it(self):
        with self.assertRaisesRegex(SystemExit, "docs/error.md: nowhere.md"):
            self.page("docs/error.md", "[a](nowhere.md)\n")

    def test_what_is_linked_is_shown(self):
        self.page("docs/tour.md", "[a](../core/film) [b](../pyproject.toml)\n")
        self.site.show_sources()
        folder = (self.site.docs / "source/core/film/index.md").read_text()
        self.assertIn("[`film.cpp`](film.cpp.md)", folder)
        self.assertIn((ROOT / "core/film/film.cpp").read_text().rstrip(),
                      (self.site.docs / "source/core/film/film.cpp.md").read_text())
        self.assertIn("```toml", (self.site.docs / "source/pyproject.toml.md").read_text())

    def test_lists_get_a_blank_line(self):
        self.assertEqual(list(stage.spaced(["It has", "- a", "- b", "  of", "- c", "", "1. d", "2. e"])),
                         ["It has", "", "- a", "- b", "  of", "- c", "", "1. d", "2. e"])
        code = ["```", "x", "- y", "```"]
        self.assertEqual(list(stage.spaced(code)), code)


class Navigation(unittest.TestCase):
    def test_every_page_of_the_manual_is_in_it(self):
        with tempfile.TemporaryDirectory() as folder:
            site = stage.Stage(pathlib.Path(folder))
            pages = set(leaves(make.navigation(site, [])))
            expected = {site.page_of(file) for file in [ROOT / name for name in stage.PAGES]
                        + sorted((ROOT / "docs").glob("*.md"))
                        + sorted((ROOT / "docs/results").glob("*.md"))}
        self.assertEqual(expected - pages, set())

    def test_every_decision_is_listed_with_its_status(self):
        decisions = sorted((ROOT / "docs/decisions").glob("*.md"))
        index = make.decision_index(decisions)
        for file in decisions:
            self.assertRegex(index, rf"\| \[{file.stem[:4]}\]\({file.name}\) \| .+ \| (accept|replac)ed")


def leaves(tree):
    """The texts in lists and in values of dicts."""
    if isinstance(tree, str):
        yield tree
    else:
        for inner in tree.values() if isinstance(tree, dict) else tree:
            yield from leaves(inner)


class Site(unittest.TestCase):
    GOOD = ("<link rel='canonical' href='https://a.org/x'><a href='b.html#x'></a><a href='#y'></a>"
            "<a href='https://a.org'></a><p id='y'></p><img src='p.png'>")

    def wrong(self, more, sheet="", lacks=None):
        with tempfile.TemporaryDirectory() as name:
            site = pathlib.Path(name).resolve()
            (site / "a.html").write_text(self.GOOD + more)
            (site / "b.html").write_text("<a name='x'></a>")
            (site / "p.png").write_text("")
            (site / "s.css").write_text(sheet)
            for name in check_site.SEARCH:
                if name != lacks:
                    (site / name).parent.mkdir(exist_ok=True)
                    (site / name).write_text("")
            return check_site.check(site)[0]

    def test_what_is_right(self):
        self.assertEqual(self.wrong(""), [])

    def test_what_is_wrong(self):
        for more in ("<a href='c.html'></a>", "<a href='b.html#z'></a>", "<a href='#z'></a>",
                     "<img src='q.png'>", "<img src='//a.org/p.png'>",
                     "<script src='https://a.org/s.js'></script>",
                     "<link rel='stylesheet' href='https://fonts.org/f.css'>"):
            self.assertEqual(len(self.wrong(more)), 1, more)
        for sheet in ("a { background: url('https://a.org/p.png') }", "@import 'x.css';"):
            self.assertEqual(len(self.wrong("", sheet)), 1, sheet)
        for name in check_site.SEARCH:
            self.assertEqual(len(self.wrong("", lacks=name)), 1, name)


if __name__ == "__main__":
    unittest.main()
