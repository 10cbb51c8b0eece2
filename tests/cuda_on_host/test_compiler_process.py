#!/usr/bin/env python3
"""A render does not wait for its compiler: the CUDA plugin with a driver and an NVRTC that are fakes.

    test_compiler_process.py CRT SCENE FAKE_CUDA_DIR FAKE_NVRTC_DIR [unittest arguments]

Nothing here measures time. The fake compiler takes as long as a test says, and the test looks at what was
there first.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

CRT = SCENE = FAKE_CUDA = FAKE_NVRTC = None  # From the command line.


class CompilerProcess(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.cache = self.folder / "cache"

    def render(self, compiler, *options, resolution=32):
        environment = dict(os.environ, CRT_FAKE_NVRTC_SECONDS=compiler, CRT_CACHE_DIR=str(self.cache),
                           LD_LIBRARY_PATH=f"{FAKE_NVRTC}:{FAKE_CUDA}")
        # Pipes: a process left behind that held one open would keep this waiting.
        run = subprocess.run(
            [
                CRT,
                SCENE,
                "-b",
                "cuda",
                "-o",
                "a.pfm",
                "--set",
                f"film.resolution=[{resolution},{resolution}]",
                *options,
            ],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        return run, json.loads((self.folder / "a.report.json").read_text())["backend"]

    def kernels(self):
        return list(self.cache.glob("*.crtkernel"))

    def warm(self, compiler, **more):
        environment = dict(os.environ, CRT_FAKE_NVRTC_SECONDS=compiler, CRT_CACHE_DIR=str(self.cache),
                           LD_LIBRARY_PATH=f"{FAKE_NVRTC}:{FAKE_CUDA}", **more)
        return subprocess.run(
            [CRT, "warm", SCENE, "-b", "cuda"],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )

    def compilers(self):
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                environment = (process / "environ").read_bytes().split(b"\0")
                if (
                    os.readlink(process / "exe").endswith("/crt_nvrtc")
                    and b"CRT_CACHE_DIR=" + os.fsencode(self.cache) in environment
                ):
                    found.append(process.name)
            except OSError:
                pass  # Ended meanwhile, or another user's.
        return found

    def test_a_render_ends_while_the_compiler_works_and_the_next_one_has_the_kernel(self):
        _, backend = self.render("4", "--spp", "1")
        self.assertEqual(backend["kernel"], "precompiled")
        self.assertEqual(
            self.kernels(),
            [],
            "the render waited for the compiler, or the machine is so slow that this tells nothing",
        )
        self.assertEqual(len(self.compilers()), 1)
        deadline = time.monotonic() + 100
        while not self.kernels() and time.monotonic() < deadline:
            time.sleep(0.1)
        self.assertEqual(len(self.kernels()), 1, "what was begun is finished for the next run")
        _, backend = self.render("4", "--spp", "1")
        self.assertEqual(backend["kernel"], "NVRTC 13.0 sm_90")
        self.assertTrue(backend["kernel_from_cache"])

    def test_what_was_compiled_ahead_is_there(self):
        run = self.warm("2")
        self.assertRegex(run.stdout, r"NVRTC 13.0 sm_90, compiled in \d+\.\d s\n$", run.stderr)
        self.assertEqual(len(self.kernels()), 1, "it ended before its compiler")
        _, backend = self.render("100", "--spp", "1")
        self.assertEqual(backend["kernel"], "NVRTC 13.0 sm_90")
        self.assertTrue(backend["kernel_from_cache"])
        self.assertRegex(self.warm("100").stdout, r"NVRTC 13.0 sm_90, from the cache\n$")

    def test_what_cannot_be_compiled_ahead_is_told(self):
        run = self.warm("fail")
        self.assertIn("told by the fake compiler", run.stderr)
        self.assertRegex(run.stdout, r": precompiled, nothing to compile\n$")
        self.assertEqual(self.kernels(), [])

    def test_a_compiler_that_others_could_have_written_is_not_run(self):
        plugins, compiler = self.copied_plugin()
        os.chmod(compiler, 0o777)
        run = self.warm("0", CRT_BACKEND_PATH=str(plugins))
        self.assertIn("everyone can write to", run.stderr)
        self.assertRegex(run.stdout, r": precompiled, nothing to compile\n$")
        self.assertEqual(self.kernels(), [])
        os.chmod(compiler, 0o755)
        run = self.warm("0", CRT_BACKEND_PATH=str(plugins))
        self.assertRegex(run.stdout, r"NVRTC 13.0 sm_90, compiled in \d+\.\d s\n$", run.stderr)

    def copied_plugin(self):
        """The folder of a copy of the CUDA plugin, and the copy of the program that compiles for it."""
        folder = self.folder / "backends"
        folder.mkdir()
        folder.chmod(0o755)
        for name in ("crt_backend_cuda.so", "crt_nvrtc"):
            shutil.copy(pathlib.Path(CRT).resolve().parent.parent / "lib/crt" / name, folder)
            (folder / name).chmod(0o755)
        return folder, folder / "crt_nvrtc"

    def test_without_a_cache_nothing_is_left_behind(self):
        _, backend = self.render("100", "--spp", "1", "--no-cache")
        self.assertEqual(backend["kernel"], "precompiled")
        deadline = time.monotonic() + 50
        while self.compilers() and time.monotonic() < deadline:
            time.sleep(0.1)
        self.assertEqual(self.compilers(), [])

    def test_a_long_render_goes_over_to_the_lean_kernel(self):
        run, backend = self.render("0", "--time", "3", "--spp", "1000000")
        self.assertEqual(backend["kernel"], "precompiled, then NVRTC 13.0 sm_90", run.stderr)

    def test_what_the_compiler_refuses_is_told_and_costs_nothing(self):
        run, backend = self.render("fail", "--time", "3", "--spp", "1000000")
        self.assertEqual(backend["kernel"], "precompiled")
        self.assertIn(
            "continuing with the precompiled kernel: NVRTC 13.0 cannot compile the kernel", run.stderr
        )
        self.assertIn("told by the fake compiler", run.stderr)

    def test_a_compiler_that_crashes_costs_nothing(self):
        run, backend = self.render("crash", "--time", "3", "--spp", "1000000")
        self.assertEqual(backend["kernel"], "precompiled")
        self.assertIn("the compiler process was ended by signal 6", run.stderr)


if __name__ == "__main__":
    CRT, SCENE, FAKE_CUDA, FAKE_NVRTC = map(os.path.abspath, sys.argv[1:5])
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]], verbosity=2)
