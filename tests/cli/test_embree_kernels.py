#!/usr/bin/env python3
"""Lean kernels of the Embree backend: compiled by the machine's compiler, cached, and left out where that
does not work. The image is the same each time (docs/decisions/0088-lean-kernels-on-processors.md).

    test_embree_kernels.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import glob
import os
import shutil
import signal
import tempfile
import time
import unittest

import harness
from harness import CliTest, read_bytes


# The last argument of a compiler is the library that it makes.
LAST = "for last; do :; done"


class LeanKernels(CliTest):
    LEAN = ["--kernel", "lean-only"]

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if "embree" not in harness.real_backends():
            raise unittest.SkipTest("no Embree backend")
        if shutil.which("c++") is None:
            raise unittest.SkipTest("no compiler")
        cls.kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.kept.cleanup)

    def setUp(self):
        super().setUp()
        # Plastic is not in the small kernels that are compiled ahead, which are used on any processor.
        self.write("scene.yaml", harness.SCENE.replace("{type: diffuse, reflectance: 0.7}",
                                                       "{type: plastic, reflectance: 0.7, roughness: 0.3}"))
        self.render("full.pfm", "--kernel", "full")

    def render(self, name, *options, **changes):
        changes.setdefault("CRT_CACHE_DIR", self.path("cache"))
        return self.crt("scene.yaml", "-b", "embree", "-o", name, "--overwrite", *options,
                        CRT_BACKEND_PATH="", **changes)

    def script(self, name, body):
        self.write(name, f"#!/bin/sh\n{body}\n")
        os.chmod(self.path(name), 0o700)
        return self.path(name)

    def quick_compiler(self):
        """A compiler that gives what the real one made of this kernel when it was first asked."""
        library = os.path.join(self.kept.name, "kernel.so")
        compile_and_keep = f'{LAST}; c++ "$@" && cp "$last" {library}'
        return self.script("quick", f'if [ -e {library} ]; then {LAST}; cp {library} "$last"; else '
                                    f"{compile_and_keep}; fi")

    def assert_same(self, name, other="full.pfm"):
        self.assertEqual(read_bytes(self.path(name)), read_bytes(self.path(other)))

    def backend(self, name):
        return self.report(name.replace(".pfm", ".report.json"))["backend"]

    def assert_precompiled(self, name):
        self.assert_same(name)
        self.assertRegex(self.backend(name)["kernel"], r"^precompiled, ")
        self.assertNotIn("lean", self.backend(name)["kernel"])

    def test_compiled_once_and_then_taken_from_the_cache(self):
        compiler = self.quick_compiler()
        self.render("a.pfm", *self.LEAN, CRT_CXX=compiler, TMPDIR=self.directory)
        self.assert_same("a.pfm")
        first = self.backend("a.pfm")
        self.assertRegex(first["kernel"], r"^lean, (g|clang)\+\+ \d")
        self.assertGreater(self.report("a.report.json")["seconds"]["kernel_compile"], 0)
        self.assertFalse(first["kernel_from_cache"])
        self.assertEqual(glob.glob(self.path("crt-kernel-*")), [], "the compiler's folder was left")
        # Any render uses the cached kernel.
        self.render("b.pfm", CRT_CXX=compiler)
        self.assert_same("b.pfm")
        second = self.backend("b.pfm")
        self.assertEqual(second["kernel"], first["kernel"])
        self.assertTrue(second["kernel_from_cache"])
        self.assertEqual(self.report("b.report.json")["seconds"]["kernel_compile"], 0)
        self.assertEqual(second["kernel_features"], first["kernel_features"])
        self.assertNotEqual(second["kernel_features"], self.backend("full.pfm")["kernel_features"])
        (kernel,) = glob.glob(self.path("cache/*.crtkernel"))
        whole = read_bytes(kernel)
        for damaged in (whole[:-1], b"", whole[:-3] + bytes([whole[-3] ^ 1]) + whole[-2:]):
            with open(kernel, "wb") as file:
                file.write(damaged)
            self.render("c.pfm", CRT_CXX=compiler)
            self.assert_precompiled("c.pfm")

    def test_a_cached_kernel_of_another_compiler_is_not_used(self):
        compiler = self.quick_compiler()
        self.render("a.pfm", *self.LEAN, CRT_CXX=compiler)
        os.utime(compiler, (1, 1))
        self.render("b.pfm", CRT_CXX=compiler)
        self.assert_precompiled("b.pfm")

    def test_without_a_compiler(self):
        run = self.render("a.pfm", *self.LEAN, CRT_CXX="/nowhere/c++")
        self.assert_precompiled("a.pfm")
        self.assertNotIn("warning", run.stderr)
        self.render("b.pfm", *self.LEAN, PATH=self.path("."))
        self.assert_precompiled("b.pfm")

    def test_a_compiler_that_is_broken(self):
        for body, words in (
            ("echo 'kernel.cpp:7: error: no' >&2; exit 1", "kernel.cpp:7: error: no"),
            ("exit 1", "it said nothing"),
            ("kill -11 $$", "signal 11"),
            ("exit 0", "it has made no library"),
            (f'{LAST}; echo garbage > "$last"', "cannot be loaded"),
        ):
            with self.subTest(body):
                run = self.render("a.pfm", *self.LEAN, CRT_CXX=self.script("broken", body),
                                  CRT_CACHE_DIR=self.path("other"))
                self.assert_precompiled("a.pfm")
                self.assertIn("rendering with the precompiled kernel", run.stderr)
                self.assertIn(words, run.stderr)

    def test_a_compiler_that_others_could_have_written_is_not_run(self):
        path = self.script("theirs", f"touch {self.path('it-ran')}; exit 1")
        os.chmod(path, 0o777)
        run = self.render("a.pfm", *self.LEAN, CRT_CXX=path)
        self.assert_precompiled("a.pfm")
        self.assertIn("refused", run.stderr)
        self.assertFalse(os.path.exists(self.path("it-ran")))

    def test_a_plain_scene_gains_from_avx_512_alone(self):
        self.write("scene.yaml", harness.SCENE)
        self.render("full.pfm", "--kernel", "full")
        counted = self.script("counted", f'touch {self.path("it-ran")}; exec c++ "$@"')
        self.render("a.pfm", CRT_CXX=counted)
        self.assert_precompiled("a.pfm")
        self.assertIn("box", self.backend("a.pfm")["kernel"])
        self.assertFalse(os.path.exists(self.path("it-ran")))
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            has_avx512 = "avx512vl" in file.read()
        self.render("b.pfm", *self.LEAN, CRT_CXX=counted)
        self.assert_same("b.pfm")
        self.assertEqual(os.path.exists(self.path("it-ran")), has_avx512)
        self.assertEqual("lean" in self.backend("b.pfm")["kernel"], has_avx512)

    def test_other_kernel_texts_are_compiled_where_a_kernel_for_the_scene_is_there(self):
        self.write("scene.yaml", harness.SCENE)
        self.render("full.pfm", "--kernel", "full")
        texts = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "core", "kernel")
        shutil.copytree(texts, self.path("kernel"))
        with open(self.path("kernel/lights/light.h"), "a", encoding="utf-8") as header:
            header.write("#error other texts\n")
        run = self.render("a.pfm", *self.LEAN, CRT_KERNEL_DIR=self.path("kernel"))
        self.assertIn("#error other texts", run.stderr)
        self.assert_precompiled("a.pfm")

    def test_a_short_render_starts_no_compiler(self):
        self.render("a.pfm", CRT_CXX=self.script("counted", f"touch {self.path('it-ran')}; exit 1"))
        self.assert_precompiled("a.pfm")
        self.assertFalse(os.path.exists(self.path("it-ran")))

    def test_a_render_goes_over_to_its_lean_kernel(self):
        """In the middle of an image, and the compiler outlives a render that ends before it."""
        options = ["--set", "film.resolution=[96,64]", "--time", "900s", "--spp", "100000000"]
        process = self.start("scene.yaml", "-b", "embree", "-o", "a.pfm", *options, CRT_BACKEND_PATH="",
                             CRT_CACHE_DIR=self.path("cache"), CRT_COMPILE_AFTER="0",
                             CRT_CXX=self.quick_compiler())
        deadline = time.monotonic() + harness.PATIENCE_SECONDS
        while not glob.glob(self.path("cache/*.crtkernel")) and time.monotonic() < deadline:
            self.assertIsNone(process.poll())
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=harness.PATIENCE_SECONDS)
        report = self.report("a.report.json")
        self.assertRegex(report["backend"]["kernel"], r"^precompiled, .*, then lean, ")
        samples = str(report["samples"]["per_pixel"])
        self.render("full.pfm", "--kernel", "full", *options[:2], "--spp", samples)
        self.assert_same("a.pfm")

    def test_a_render_does_not_wait_for_its_compiler(self):
        slow = self.script("slow", f"while [ ! -e {self.path('go')} ]; do sleep 0.05; done; "
                                   f"{self.quick_compiler()} \"$@\"")
        self.render("a.pfm", "--spp", "256", CRT_COMPILE_AFTER="0", CRT_CXX=slow)
        self.assertNotIn("lean", self.backend("a.pfm")["kernel"])
        self.assertEqual(glob.glob(self.path("cache/*.crtkernel")), [])
        self.write("go", "")
        deadline = time.monotonic() + harness.PATIENCE_SECONDS
        while not glob.glob(self.path("cache/*.crtkernel")) and time.monotonic() < deadline:
            time.sleep(0.05)
        self.render("b.pfm", CRT_CXX=slow)
        self.assertTrue(self.backend("b.pfm")["kernel_from_cache"])
        self.assert_same("b.pfm")


if __name__ == "__main__":
    harness.main(__doc__)
