#!/usr/bin/env python3
"""OpenCL's waves on a processor: the schedule of GPUs (docs/decisions/0044-waves-for-opencl.md).

    test_waves.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import os

import harness
from harness import CliTest


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


if __name__ == "__main__":
    harness.main(__doc__)
