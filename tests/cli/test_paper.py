#!/usr/bin/env python3
"""bench/run paper makes its page of rows that were measured elsewhere: nothing is timed here."""

import importlib.util
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
from xml.etree import ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = None  # From the command line.

MACHINE = {"part": "machine", "cpu": "A processor", "threads": 16, "os": "A system", "date": "a day",
           "commit": "0123456789", "quick": False, "busy": 0.05, "parts": ["table1", "table2"],
           "devices": {"cuda": ["0: A GPU"]}}
TIMES = [{"part": "figure2", "backend": "cuda", "resolution": r, "spp": n, "repeat": 0,
          "render": n * r * r / 1e9, "others": 0} for r in (100, 200) for n in (1, 2, 4, 8)]


def row(part, seconds, **values):
    return {"part": part, "seconds": seconds, "right": True, **values}


def rows_of_sums(n, device):
    return [
        row("sum", [2e-3], where="cpu", method="one thread", time="call", n=n),
        *(row("sum", [9.0, device, device / 9], where="gpu", method=m, time="device", n=n)
          for m in ("own", "cub")),
    ]


class Page(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="crt-test-paper-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def make(self, rows, code=0, name="rows.jsonl", environment=()):
        file = self.folder / name
        file.write_text(rows if isinstance(rows, str) else "".join(json.dumps(r) + "\n" for r in rows))
        run = subprocess.run(
            [sys.executable, ROOT / "bench" / "run", "paper", "--no-build", "--build", BUILD, "--rows", file,
             "--results", self.folder / "results"],
            capture_output=True, text=True, env={**os.environ, "LC_ALL": "C.UTF-8", **dict(environment)})
        self.assertEqual(run.returncode, code, run.stderr)
        page = self.folder / "results" / "paper.md"
        return " ".join(page.read_text().split()) if page.exists() else run.stderr

    def test_rates_and_shares_are_those_of_the_medians(self):
        copy = row("copy", [8e-4], where="gpu", method="cudaMemcpy", time="device", n=1e8, bytes=8e8)
        page = self.make([MACHINE, copy, *rows_of_sums(1e8, 2e-4)])
        self.assertIn("cudaMemcpy 1000 GB/s", page)
        self.assertIn("ours reads 2000 GB/s, 200% of the faster copy", page)
        self.assertIn("| 100,000,000 | not known | not known | 2 ms | – | 200 µs | 200 µs |", page)
        self.assertNotIn("Disturbed", page)
        self.assertNotIn("mean nothing", page)

    def test_what_is_not_there_is_said_with_the_command(self):
        absent = {"part": "absent", "of": "table1", "what": "paper_gpu", "reason": "no GPU"}
        page = self.make([MACHINE, absent])
        self.assertIn("Not measured: table1, `paper_gpu`: no GPU. The command, where it can run: "
                      "`bench/run paper --parts table1`.", page)
        self.assertIn("Not measured: figure3", page)
        # Another machine's rows have it.
        there = {"part": "run", "of": "table1", "what": "paper_gpu", "complete": True, "others": 0}
        self.assertNotIn("no GPU", self.make([MACHINE, absent, there]))

    def test_streams_and_layouts(self):
        points = {"mesh": "dragon", "triangles": 100000, "where": "gpu"}
        page = self.make([
            MACHINE,
            row("box", [4e-3], method="one stream", layout="aos, wide", time="upload", **points),
            row("box", [2e-3], method="four streams", layout="aos, wide", time="upload", **points),
            *(row("box", [s], method="there", layout=layout, time="device", **points)
              for s, layout in ((3e-5, "aos"), (1e-5, "aos, wide"), (2e-5, "soa"), (1e-5, "soa, wide"))),
        ])
        self.assertIn("| 4 ms | 2 ms | 2 |", page)
        self.assertIn("take 1.5 times as long as structures of arrays with loads of 4 bytes", page)

    def test_the_papers_rates_stand_beside_ours(self):
        render = {"of": "table3", "scene": "cornell_dragon", "triangles": 100018, "backend": "cuda",
                  "size": 100, "spp": 100, "others": 0.5}
        page = self.make([MACHINE, *(row("render", [s], accelerator=kind, **render)
                                     for kind, s in (("none", 4), ("aabb", 2), ("bvh", 0.01)))])
        self.assertIn("| 7140 (0.14 Mpaths/s) | cuda | 4000 | 2000 | 10 | 2 | 400 |", page)
        self.assertIn("**Disturbed:** in 3 of 3", page)

    def test_pictures_are_files_beside_the_page(self):
        (self.folder / "a.ppm").write_bytes(b"P6\n720 720\n255\n" + bytes([255, 0, 128]) * 720**2)
        picture = row("picture", [2.0], of="figure3", scene="cornell_box", backend="cuda", size=720,
                      spp=1000, process_seconds=3, others=0, file="a.ppm")
        page = self.make([MACHINE, picture])
        self.assertIn("| cornell_box | 720² | 1,000 | not known | 10.8 s | cuda | 2 s | 259 |", page)
        png = (self.folder / "results" / "paper-cornell_box.png").read_bytes()
        self.assertEqual(struct.unpack(">II", png[16:24]), (360, 360))

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib draws the chart")
    def test_curves_are_a_chart_with_names_as_text(self):
        page = self.make([MACHINE, *TIMES])
        self.assertIn("twice the width and height costs 4 times as much", page)
        file = self.folder / "results" / "paper.svg"
        chart = file.read_text()
        title = ElementTree.fromstring(chart).find("{http://www.w3.org/2000/svg}title")
        self.assertEqual(title.text, "Render seconds against samples per pixel, Cornell box")
        for name in ("cuda, 100²", "cuda, 200²", "samples per pixel"):
            self.assertIn(f">{name}</text>", chart)
        self.assertIn("prefers-color-scheme: dark", chart)
        self.make([MACHINE, *TIMES])
        self.assertEqual(file.read_text(), chart)

    def test_without_what_draws_there_is_no_half_of_a_page(self):
        (self.folder / "matplotlib.py").write_text("raise ImportError")
        said = self.make([MACHINE, *TIMES], code=1, environment={"PYTHONPATH": str(self.folder)})
        self.assertIn("this Python has none", said)
        self.assertIn("-m pip install matplotlib", said)
        self.assertFalse((self.folder / "results").exists())

    def test_a_wrong_result_is_an_error(self):
        page = self.make([MACHINE, {**rows_of_sums(5000, 1e-5)[0], "right": False}], code=1)
        self.assertIn("**Wrong:** 1 results", page)

    def test_what_is_no_row_is_refused(self):
        self.assertIn("line 2, is no JSON", self.make(json.dumps(MACHINE) + "\n{", code=1))
        self.assertIn("has no part", self.make("{}\n", code=1))


if __name__ == "__main__":
    BUILD = sys.argv.pop(1)
    unittest.main()
