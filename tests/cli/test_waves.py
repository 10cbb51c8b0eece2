#!/usr/bin/env python3
"""OpenCL on a processor: waves, the schedule of GPUs (docs/decisions/0044-waves-for-opencl.md), and the code
that it does not take from others.

    test_waves.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import glob
import os
import time

import harness
from harness import CliTest
from view_client import View


class Waves(CliTest):
    def test_opencl_in_waves_gives_the_same_bits(self):
        """The schedule of GPUs, on a processor: kinds of material, mixes, AOVs, several launches."""
        if "opencl" not in harness.real_backends():
            self.skipTest("opencl has no device")
        for scene in ("materials", "foliage"):
            command = [
                os.path.join(harness.CONFIG_DIR, f"{scene}.yaml"), "-b", "opencl", "--spp", "3",
                "--chunk", "2", "--set", "film.resolution=[37,21]",
            ]
            reports = []
            for name, waves in (("paths", None), ("waves", "1")):
                self.crt(*command, "-o", f"{name}.exr", CRT_BACKEND_PATH="", CRT_OPENCL_WAVES=waves)
                reports.append(self.report(f"{name}.report.json"))
            self.assertNotIn("sorted by material", reports[0]["backend"]["kernel"])
            self.assertIn("sorted by material", reports[1]["backend"]["kernel"])
            self.assertEqual(reports[0]["rays"], reports[1]["rays"])
            compared = self.crt("compare", "--all-channels", "paths.exr", "waves.exr").stdout
            self.assertIn("same bits", compared)

    def test_kernel_texts_of_others_are_refused_with_their_code(self):
        if "opencl" not in harness.real_backends():
            self.skipTest("opencl has no device")
        os.makedirs(self.path("kernels/schedule"))
        os.chmod(self.path("kernels/schedule"), 0o777)
        self.write("kernels/schedule/wavefront.h", "")
        run = self.crt("scene.yaml", "-b", "opencl", "-o", "a.pfm", "-q", "--no-cache", expect=4,
                       CRT_BACKEND_PATH="", CRT_KERNEL_DIR=self.path("kernels"))
        self.assert_one_error(run, "the kernels of CRT_KERNEL_DIR are refused: everyone can write to")


class CacheOfPoCL(CliTest):
    """Without HOME it would be /tmp/pocl, whose owner chooses the kernels that crt runs."""

    def setUp(self):
        super().setUp()
        if "PoCL" not in self.crt("plugins", CRT_BACKEND_PATH="").stdout:
            self.skipTest("there is no PoCL here")

    def test_without_home_it_is_private(self):
        self.assert_private(XDG_CACHE_HOME=None)

    def test_in_a_folder_that_everyone_can_write_to_it_is_private(self):
        os.mkdir(self.path("open"))
        os.chmod(self.path("open"), 0o777)
        self.assert_private(XDG_CACHE_HOME=self.path("open"))
        self.assertEqual(glob.glob(self.path("open/pocl/kcache/*")), [])

    def assert_private(self, **environment):
        os.mkdir(self.path("tmp"))
        view = View(self, "-b", "opencl", "-t", "1", "--spp", "1", HOME=None, POCL_CACHE_DIR=None,
                    TMPDIR=self.path("tmp"), CRT_BACKEND_PATH="", **environment)
        written = []
        while not written:
            status, _ = view.state()
            written = glob.glob(self.path("tmp/crt-pocl-*/*"))
            # PoCL writes there before it compiles.
            ended = status.get("picture") or status["render_error"]
            self.assertTrue(written or not ended, "its cache is somewhere else")
            time.sleep(0.02)
        self.assertEqual(os.stat(os.path.dirname(written[0])).st_mode & 0o777, 0o700)
        view.process.kill()
        view.process.wait()


if __name__ == "__main__":
    harness.main(__doc__)
