#!/usr/bin/env python3
"""Faults of a GPU: too little memory for film, scene or kernels, a lost device, and a cache of kernels that
is damaged, owned by another user, on a full disk or in use by several processes. Always the same
demand: the bits of an undisturbed render, or one sentence and the exit code of docs/architecture.md.

    test_gpu_faults.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Tests that mount a small disk need root and are skipped by name without it. Python's standard library only.
"""

import glob
import os
import random
import shutil
import subprocess
import time
import unittest

import harness
from harness import CliTest, can_mount, read_bytes


class FakeGpuTest(CliTest):
    """The real CUDA backend on the driver of tests/cuda_on_host, whose devices have one GB each and fail on
    demand, with a compiler that takes no time."""

    SIZE = ["--set", "film.resolution=[160,120]"]
    SPP = 8

    def setUp(self):
        super().setUp()
        build = os.path.dirname(os.path.dirname(harness.FAKE_DIR.rstrip("/")))
        driver, compiler = (os.path.join(build, "tests", name) for name in ("fake_cuda", "fake_nvrtc"))
        plugins = os.path.join(build, "lib", "crt")
        if not os.path.exists(os.path.join(driver, "libcuda.so.1")) or not os.path.exists(
            os.path.join(plugins, "crt_backend_cuda.so")
        ):
            self.skipTest("built without the CUDA backend")
        self.gpu = {
            "LD_LIBRARY_PATH": f"{compiler}:{driver}",
            "CRT_BACKEND_PATH": plugins,
            "CRT_CACHE_DIR": self.path("cache"),
            "CRT_FAKE_NVRTC_SECONDS": "0",
        }
        self.addCleanup(self.remove_cache)

    def remove_cache(self):
        """A compiler that a failed render has left behind may still be writing into it."""
        for _ in range(100):
            shutil.rmtree(self.path("cache"), ignore_errors=True)
            time.sleep(0.02)
            if not os.path.exists(self.path("cache")):
                return

    def render(self, image, *arguments, spp=SPP, expect=0, scene="scene.yaml", **changes):
        return self.crt(
            scene, "-b", "cuda", "-o", image, "--spp", str(spp), *arguments, expect=expect,
            **{**self.gpu, **changes}
        )

    def memory(self, image):
        return self.report(image.replace(".pfm", ".report.json"))["memory"]

    def assert_same(self, image, expected):
        self.assertEqual(read_bytes(self.path(image)), read_bytes(self.path(expected)), image)


class LostGpu(FakeGpuTest):
    def test_a_launch_that_fails(self):
        run = self.render("a.pfm", "--checkpoint", "c.crtfilm", CRT_FAKE_CUDA="launch", expect=5)
        self.assert_one_error(run, "CUDA_ERROR_LAUNCH_FAILED")
        self.assertFalse(os.path.exists(self.path("a.pfm")))

    def test_what_was_read_before_it_was_lost_is_saved(self):
        self.render("whole.pfm", spp=40)
        run = self.render(
            "a.pfm", "--chunk", "4", "--checkpoint", "c.crtfilm", "--checkpoint-every", "1ms", spp=40,
            CRT_FAKE_CUDA_LOST="0:9", expect=5,
        )
        self.assert_one_error(run, "CUDA_ERROR_LAUNCH_FAILED")
        self.assertEqual(self.report("a.report.json")["stop"]["reason"], "failed")
        saved = self.report("a.report.json")["samples"]["per_pixel"]
        self.assertTrue(0 < saved < 40, saved)
        self.render("a.pfm", "--resume", "c.crtfilm", spp=40)
        self.assertEqual(self.report("a.report.json")["samples"]["resumed"], saved)
        self.assert_same("a.pfm", "whole.pfm")

    def test_of_two_the_other_renders_what_was_lost(self):
        self.render("whole.pfm", spp=40)
        for lost in ("0", "1"):
            run = self.render(
                "a.pfm", "--device", "all", "--chunk", "4", spp=40, CRT_FAKE_CUDA_DEVICES="2",
                CRT_FAKE_CUDA_LOST=f"{lost}:7",
            )
            self.assertIn(f"device {lost} 'Fake GPU' is dropped; the other devices continue", run.stderr)
            self.assertIn("CUDA_ERROR_LAUNCH_FAILED", run.stderr)
            self.assert_same("a.pfm", "whole.pfm")
            devices = {d["device"]: d for d in self.report("a.report.json")["devices"]}
            self.assertIn("CUDA_ERROR_LAUNCH_FAILED", devices[lost]["failure"])
            self.assertEqual(sum(d["samples"] for d in devices.values()), 40)

    def test_when_both_are_lost_what_was_read_is_saved(self):
        self.render("whole.pfm", spp=40)
        run = self.render(
            "a.pfm", "--device", "all", "--chunk", "4", "--checkpoint", "c.crtfilm",
            "--checkpoint-every", "1ms", spp=40, expect=5, CRT_FAKE_CUDA_DEVICES="2",
            CRT_FAKE_CUDA_LOST="0:9,1:5",
        )
        self.assert_one_error(run, "CUDA_ERROR_LAUNCH_FAILED")
        saved = self.report("a.report.json")["samples"]["per_pixel"]
        self.assertTrue(0 < saved < 40, saved)
        self.render("a.pfm", "--resume", "c.crtfilm", spp=40)
        self.assert_same("a.pfm", "whole.pfm")


class Waves(FakeGpuTest):
    """A scene that is rendered by separate kernels for tracing and shading. The least memory is that of
    film, scene and counters: what a render without waves takes, as an image without sample slices shows."""

    def setUp(self):
        super().setUp()
        self.write("waves.yaml", harness.SCENE.replace(
            "  black:", "  foil: {type: rough_conductor, metal: Au, roughness: 0.3}\n  black:"
        ).replace("material: floor\n", "material: foil\n", 1))

    def render(self, image, *arguments, **more):
        return super().render(image, *self.SIZE, *arguments, scene="waves.yaml", **more)

    def test_the_kernels_are_those_of_waves(self):
        self.render("whole.pfm", "--kernel", "full")
        self.assertEqual(self.report("whole.report.json")["backend"]["kernel"], "precompiled")
        self.render("a.pfm", "--kernel", "lean-only")
        # Tracing, diffuse, metal; nothing shines from outside.
        self.assertIn("3 kernels", self.report("a.report.json")["backend"]["kernel"])
        self.assert_same("a.pfm", "whole.pfm")

    def test_a_render_goes_over_to_waves(self):
        self.render("whole.pfm", "--kernel", "full", spp=64)
        self.render("a.pfm", "--chunk", "1", spp=64, CRT_FAKE_NVRTC_SECONDS="0.05")
        self.assert_same("a.pfm", "whole.pfm")

    def test_waves_of_a_part_of_the_pixels(self):
        self.render("whole.pfm", "--kernel", "full")
        self.render("a.pfm", "--kernel", "lean-only")
        full, waves = (self.memory(image)["device_peak_bytes"] for image in ("whole.pfm", "a.pfm"))
        self.assertGreater(waves, 2 * full)
        for share in (0.5, 0.25):
            room = full + int(share * (waves - full))
            self.render("b.pfm", "--kernel", "lean-only", CRT_FAKE_CUDA_MEMORY=str(room))
            self.assertLess(self.memory("b.pfm")["device_peak_bytes"], room)
            self.assert_same("b.pfm", "whole.pfm")

    def test_no_room_for_waves(self):
        self.render("whole.pfm", "--kernel", "full", spp=1)
        full = self.memory("whole.pfm")["device_peak_bytes"]
        run = self.render("a.pfm", "--kernel", "lean-only", spp=1, CRT_FAKE_CUDA_MEMORY=str(full + 4096))
        self.assertIn("the paths of a wave needs", run.stderr)
        self.assertIn("continuing with the precompiled kernel", run.stderr)
        self.assertEqual(self.memory("a.pfm")["film_bands"], 1)
        self.assert_same("a.pfm", "whole.pfm")

    def test_a_device_lost_in_a_wave(self):
        self.render("whole.pfm", "--kernel", "full", spp=40)
        run = self.render(
            "a.pfm", "--device", "all", "--chunk", "4", "--kernel", "lean-only", spp=40,
            CRT_FAKE_CUDA_DEVICES="2", CRT_FAKE_CUDA_LOST="1:50",
        )
        self.assertIn("device 1 'Fake GPU' is dropped; the other devices continue", run.stderr)
        self.assert_same("a.pfm", "whole.pfm")

    def test_a_compiler_that_fails(self):
        self.render("whole.pfm", "--kernel", "full")
        for failure in ("fail", "crash"):
            run = self.render("a.pfm", "--kernel", "lean-only", CRT_FAKE_NVRTC_SECONDS=failure)
            self.assertIn("using the precompiled kernel with all features", run.stderr)
            self.assert_same("a.pfm", "whole.pfm")


class LittleGpuMemory(FakeGpuTest):
    """160 x 120 pixels: a film of 1.4 MB."""

    def test_a_film_that_does_not_fit_is_rendered_in_bands(self):
        self.render("whole.pfm", *self.SIZE)
        self.assertEqual(self.memory("whole.pfm")["film_bands"], 1)
        for devices in ("1", "2"):
            for memory in (1_000_000, 400_000):
                run = self.render(
                    "a.pfm", *self.SIZE, "--device", "all", CRT_FAKE_CUDA_DEVICES=devices,
                    CRT_FAKE_CUDA_MEMORY=str(memory), CRT_FAKE_CUDA_PEAK=self.path("peak"),
                )
                self.assertRegex(
                    run.stderr,
                    r"the film needs 1\.4 MB, but 'Fake GPU' has only \d\.\d MB of its 1073.7 MB free; "
                    r"so it is rendered in \d+ bands of \d+ rows"
                )
                self.assert_same("a.pfm", "whole.pfm")
                bands = self.memory("a.pfm")["film_bands"]
                self.assertGreater(bands, 1)
                self.assertLess(int(read_bytes(self.path("peak"))), int(devices) * memory)
                report = self.report("a.report.json")
                self.assertEqual(report["rays"]["paths"], 160 * 120 * self.SPP)
                self.assertEqual(
                    report["rays"]["closest"], self.report("whole.report.json")["rays"]["closest"]
                )

    def test_stopped_resumed_and_saved_in_bands(self):
        self.render("whole.pfm", *self.SIZE)
        little = {"CRT_FAKE_CUDA_MEMORY": "1000000"}
        self.render(
            "a.pfm", *self.SIZE, "--chunk", "1", "--checkpoint", "c.crtfilm",
            "--checkpoint-every", "1ms", spp=3, **little
        )
        self.assertGreater(self.memory("a.pfm")["film_bands"], 1)
        self.render("a.pfm", *self.SIZE, "--resume", "c.crtfilm", **little)
        self.assertEqual(self.report("a.report.json")["samples"]["resumed"], 3)
        self.assert_same("a.pfm", "whole.pfm")
        # A film that was begun in bands goes on without them.
        self.render("a.pfm", *self.SIZE, "--checkpoint", "d.crtfilm", spp=5, **little)
        self.render("a.pfm", *self.SIZE, "--resume", "d.crtfilm")
        self.assert_same("a.pfm", "whole.pfm")

    def test_a_device_lost_in_a_band(self):
        self.render("whole.pfm", *self.SIZE)
        little = {"CRT_FAKE_CUDA_MEMORY": "1000000"}
        run = self.render(
            "a.pfm", *self.SIZE, "--chunk", "1", "--checkpoint", "c.crtfilm", CRT_FAKE_CUDA_LOST="0:12",
            expect=5, **little
        )
        self.assert_one_error(run, "CUDA_ERROR_LAUNCH_FAILED")
        saved = self.report("a.report.json")["samples"]["per_pixel"]
        self.assertTrue(0 < saved < self.SPP, saved)
        self.render("a.pfm", *self.SIZE, "--resume", "c.crtfilm", **little)
        self.assert_same("a.pfm", "whole.pfm")
        run = self.render(
            "a.pfm", *self.SIZE, "--device", "all", CRT_FAKE_CUDA_DEVICES="2", CRT_FAKE_CUDA_LOST="1:2",
            **little
        )
        self.assertIn("device 1 'Fake GPU' is dropped", run.stderr)
        self.assert_same("a.pfm", "whole.pfm")

    def test_a_film_that_leaves_no_room_for_kernels(self):
        self.render("whole.pfm", *self.SIZE)
        film = 160 * 120 * (16 * 4 + 8)
        run = self.render(
            "a.pfm", *self.SIZE, CRT_FAKE_CUDA_MEMORY=str(self.memory("whole.pfm")["device_peak_bytes"]),
            CRT_FAKE_CUDA_LAUNCH_MEMORY=str(film // 4),
        )
        self.assertIn("CUDA_ERROR_OUT_OF_MEMORY", run.stderr)
        self.assertGreater(self.memory("a.pfm")["film_bands"], 1)
        self.assert_same("a.pfm", "whole.pfm")
        # Nothing is left at all: no number of bands helps.
        run = self.render(
            "b.pfm", *self.SIZE, CRT_FAKE_CUDA_MEMORY="3000000", CRT_FAKE_CUDA_LAUNCH_MEMORY="3000000",
            expect=5,
        )
        self.assert_one_error(run, "CUDA_ERROR_OUT_OF_MEMORY")
        self.assertFalse(os.path.exists(self.path("b.pfm")))

    def test_a_scene_that_does_not_fit(self):
        dragon = os.path.join(harness.CONFIG_DIR, "cornell_dragon.yaml")
        for devices in ("1", "2"):
            run = self.render(
                "a.pfm", "--device", "all", scene=dragon, CRT_FAKE_CUDA_MEMORY="3000000",
                CRT_FAKE_CUDA_DEVICES=devices, expect=5,
            )
            self.assert_one_error(run, "the scene needs", "MB, but 'Fake GPU' has only", "of its 1073.7 MB")
            self.assertFalse(os.path.exists(self.path("a.pfm")))

    def test_slices_for_which_others_have_taken_the_memory(self):
        self.render("whole.pfm", spp=64)
        self.assertGreater(self.memory("whole.pfm")["device_peak_bytes"], 100_000)
        run = self.render(
            "a.pfm", "-v", spp=64, CRT_FAKE_CUDA="overtaken", CRT_FAKE_CUDA_MEMORY="100000",
        )
        self.assertIn("continuing without slices", run.stderr)
        self.assertEqual(self.memory("a.pfm")["film_bands"], 1)
        self.assert_same("a.pfm", "whole.pfm")

    def test_memory_does_not_grow_with_samples(self):
        """By the driver's own count; a pixel's slices are 1/16 of the device at most (film_slices.h)."""
        peaks = {}
        for samples in (1, 4096, 200_000):
            self.render(
                "a.pfm", "--set", "film.resolution=[2,2]", "--chunk", "4096", spp=samples,
                CRT_FAKE_CUDA_PEAK=self.path("peak"),
            )
            peaks[samples] = int(read_bytes(self.path("peak")))
        self.assertEqual(peaks[4096], peaks[200_000])
        self.assertLessEqual(peaks[4096], peaks[1] + (1 << 30) // 16)
        self.assertLess(peaks[1], 100_000)


class LittleOpenClMemory(CliTest):
    def test_a_film_that_does_not_fit_is_rendered_in_bands(self):
        devices = self.crt("plugins", CRT_BACKEND_PATH="").stdout.partition("\nopencl ")[2]
        if "PoCL" not in devices:
            self.skipTest("only PoCL is told how much memory it has")
        # Four channels of 2100 x 2100 pixels are 282 MB, and of 1 GB one buffer may have a quarter.
        big = ["--set", "film.resolution=[2100,2100]", "--set", "integrator.max_depth=1"]
        self.write("empty.yaml", "crt: 1\nenvironment: {radiance: 1}\n")
        for name, limit in (("whole", None), ("a", "1")):
            run = self.crt(
                "empty.yaml", "-b", "opencl", "-o", f"{name}.pfm", "--spp", "1", *big,
                CRT_BACKEND_PATH="", POCL_MEMORY_LIMIT=limit,
            )
        self.assertIn("the film needs 282.2 MB", run.stderr)
        self.assertEqual(self.report("a.report.json")["memory"]["film_bands"], 2)
        self.assertEqual(self.report("whole.report.json")["memory"]["film_bands"], 1)
        self.assertEqual(read_bytes(self.path("a.pfm")), read_bytes(self.path("whole.pfm")))


class KernelCaches(FakeGpuTest):
    """The cached kernels are gone, damaged or foreign: kernels are compiled again, and nothing else
    differs."""

    LEAN = ["--kernel", "lean-only"]

    def setUp(self):
        super().setUp()
        self.render("whole.pfm", *self.LEAN)

    def kernels(self, suffix="crtkernel"):
        return glob.glob(self.path(f"cache/*.{suffix}"))

    def assert_rendered(self, *words, from_cache=False, **changes):
        run = self.render("a.pfm", *self.LEAN, **changes)
        self.assert_same("a.pfm", "whole.pfm")
        self.assertEqual(self.report("a.report.json")["backend"]["kernel_from_cache"], from_cache)
        for word in words:
            self.assertIn(word, run.stderr)
        return run

    def test_a_damaged_kernel_is_compiled_again(self):
        (kernel,) = self.kernels()
        whole = read_bytes(kernel)
        damages = {
            "truncated": whole[:-1],
            "header alone": whole[:40],
            "empty": b"",
            "garbage": bytes(random.Random(1).randbytes(len(whole))),
            "a bit": whole[:-3] + bytes([whole[-3] ^ 1]) + whole[-2:],
        }
        for name, content in damages.items():
            with self.subTest(name):
                with open(kernel, "wb") as file:
                    file.write(content)
                self.assert_rendered()
                self.assertEqual(self.kernels(), [kernel])
                self.assertEqual(read_bytes(kernel), whole, "it was not replaced")
                self.assert_rendered(from_cache=True)

    @unittest.skipIf(os.geteuid() == 0, "root may read anything")
    def test_a_kernel_that_cannot_be_read(self):
        (kernel,) = self.kernels()
        os.chmod(kernel, 0)
        self.assert_rendered()

    def test_something_else_in_its_place(self):
        (kernel,) = self.kernels()
        for make in (os.mkdir, os.mkfifo, lambda name: os.symlink("/dev/zero", name)):
            os.remove(kernel)
            make(kernel)
            self.assert_rendered()
            if os.path.isdir(kernel):
                os.rmdir(kernel)
                open(kernel, "wb").close()

    @unittest.skipUnless(os.geteuid() == 0, "only root can give files away")
    def test_what_another_user_owns_is_not_run(self):
        (kernel,) = self.kernels()
        os.chown(kernel, 65534, 65534)
        self.assert_rendered("a cached kernel is refused", "belongs to another user")
        self.assert_rendered(from_cache=True)
        os.chown(self.path("cache"), 65534, 65534)
        self.assert_rendered("crt keeps no kernels and no tables of materials")

    def test_what_others_may_write_to_is_not_run(self):
        (kernel,) = self.kernels()
        os.chmod(kernel, 0o666)
        self.assert_rendered("a cached kernel is refused")
        self.assert_rendered(from_cache=True)
        os.chmod(self.path("cache"), 0o777)
        self.assert_rendered("crt keeps no kernels and no tables of materials")

    def test_no_folder_can_be_made(self):
        self.write("file", "")
        for folder in ("file/cache", "/proc/nowhere", "/dev/null"):
            self.assert_rendered(CRT_CACHE_DIR=self.path(folder))

    @unittest.skipUnless(can_mount(), "needs root and the right to mount a tmpfs")
    def test_a_disk_that_is_full_or_read_only(self):
        disk = self.path("disk")
        os.mkdir(disk)
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k,mode=700", "crt-test", disk], check=True)
        self.addCleanup(subprocess.run, ["umount", "-l", disk], check=False)
        with open(os.path.join(disk, "ballast"), "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(4096))
            except OSError:
                pass
        self.assert_rendered(CRT_CACHE_DIR=disk)
        self.assertEqual(os.listdir(disk), ["ballast"])
        os.remove(os.path.join(disk, "ballast"))
        self.assert_rendered(CRT_CACHE_DIR=disk)
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        # No cache at all, as what is in it could not be marked as used.
        self.assert_rendered(CRT_CACHE_DIR=disk)

    def test_several_processes_at_once(self):
        """All begin with an empty cache and need the same kernel: one compiles it, and the others wait."""
        for round_number in range(3):
            folder = self.path(f"shared{round_number}")
            processes = [
                subprocess.Popen(
                    [harness.CRT, "scene.yaml", "-b", "cuda", "-o", f"{i}.pfm", "--spp", str(self.SPP),
                     *self.LEAN],
                    cwd=self.directory,
                    env=harness.environment(
                        **{**self.gpu, "CRT_CACHE_DIR": folder, "CRT_FAKE_NVRTC_SECONDS": "0.3"}
                    ),
                    stdin=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                )
                for i in range(4)
            ]
            for i, process in enumerate(processes):
                _, messages = process.communicate(timeout=harness.PATIENCE_SECONDS)
                self.assertEqual(process.returncode, 0, messages)
                self.assertNotIn("warning", messages)
                self.assert_same(f"{i}.pfm", "whole.pfm")
            self.assertEqual(len(os.listdir(folder)), 1, os.listdir(folder))
            compiled = [self.report(f"{i}.report.json")["seconds"]["kernel_compile"] > 0 for i in range(4)]
            self.assertEqual(sum(compiled), 1, compiled)
            self.assert_rendered(from_cache=True, CRT_CACHE_DIR=folder)


if __name__ == "__main__":
    harness.main(__doc__)
