#!/usr/bin/env python3
"""The program from outside: what people type, what they see, and which exit code they get.

    test_cli.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os
import re
import shutil
import subprocess

import harness
from harness import CliTest, SCENE

class Help(CliTest):
    def test_help_teaches(self):
        text = self.crt("--help").stdout
        for word in (
            "render",
            "compare",
            "merge",
            "info",
            "plugins",
            "schema",
            "--backend",
            "--resume",
            "Examples:",
            "Exit codes:",
        ):
            self.assertIn(word, text)

    def test_every_command_has_help(self):
        commands = re.findall(r"^  ([a-z]+)  ", self.crt("--help").stdout, re.MULTILINE)
        self.assertGreater(len(commands), 15)
        for command in commands:
            text = self.crt(command, "--help").stdout
            self.assertIn(f"{command}", text.splitlines()[0])
            self.assertLess(max(map(len, text.splitlines())), 110)

    def test_version(self):
        self.assertRegex(self.crt("--version").stdout, r"^crt \d+\.\d+\.\d+\n$")

    def test_help_and_version_open_no_library(self):
        for flag in ("--help", "--version"):
            run = self.crt(flag, LD_DEBUG="files", LC_ALL="C")
            self.assertNotIn("crt_backend", run.stderr)
            self.assertNotIn("OpenImageIO", run.stderr)

    def test_no_arguments(self):
        self.assert_one_error(self.crt(expect=2), "--help")

    def test_schema(self):
        self.assertEqual(
            json.loads(self.crt("schema").stdout)["$schema"], "http://json-schema.org/draft-07/schema#"
        )
        self.assertIn("## camera", self.crt("schema", "--markdown").stdout)


class WrongCommandLine(CliTest):
    def test_did_you_mean(self):
        self.assert_one_error(
            self.crt("scene.yaml", "--bakend", "fake", expect=2), "'--bakend'", "did you mean '--backend'?"
        )
        self.assert_one_error(
            self.crt("--smaples", "0:4", "scene.yaml", expect=2), "did you mean '--samples'?"
        )
        self.assert_one_error(self.crt("comapre", "a.exr", "b.exr", expect=2), "did you mean 'compare'?")
        self.assert_one_error(
            self.crt("compare", "a.exr", "b.exr", "--tolerence", "1", expect=2),
            "did you mean '--tolerance'?",
        )
        self.assert_one_error(self.crt("scene.yaml", "--kernel", "fulll", expect=2), "did you mean 'full'?")

    def test_values_that_make_no_sense(self):
        for option, value in (
            ("--spp", "0"),
            ("--spp", "many"),
            ("--time", "soon"),
            ("--time", "1h30"),
            ("--samples", "5:5"),
            ("--samples", "5"),
            ("--crop", "1,2,3"),
            ("--crop", "0,0,1000,4"),
            ("--chunk", "-1"),
            ("--seed", "1.5"),
            ("--set", "film.resolution"),
            ("--checkpoint-every", "0s"),
            ("-o", "image.gif"),
        ):
            with self.subTest(option=option, value=value):
                run = self.crt(
                    "scene.yaml",
                    "-b",
                    "fake",
                    f"{option}={value}" if option.startswith("--") else f"{option}{value}",
                    expect=2,
                )
                self.assert_one_error(run, value)

    def test_a_missing_value(self):
        self.assert_one_error(self.crt("scene.yaml", "--spp", expect=2), "--spp needs a value")

    def test_samples_and_spp_exclude_each_other(self):
        self.assert_one_error(
            self.crt("scene.yaml", "--spp", "4", "--samples", "0:4", expect=2), "--samples"
        )

    def test_two_scenes(self):
        self.assert_one_error(self.crt("scene.yaml", "other.yaml", expect=2), "'other.yaml'")

    def test_the_same_output_twice(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-o", "./a.pfm", expect=2), "a.pfm"
        )


class WrongScene(CliTest):
    def test_absent(self):
        self.assert_one_error(self.crt("nowhere.yaml", expect=3), "nowhere.yaml")

    def test_unknown_key(self):
        self.write("bad.yaml", SCENE.replace("reflectance: 0.7", "reflectence: 0.7"))
        run = self.crt("bad.yaml", "-b", "fake", expect=3)
        self.assert_one_error(run, "did you mean 'reflectance'?")
        self.assertRegex(run.stderr, r"(?m)^bad\.yaml:7:\d+: error: ")

    def test_wrong_override(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "fake", "--set", "film.resolution=[0,4]", expect=3),
            "film.resolution",
        )


class Backends(CliTest):
    def test_unknown(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "cuta", expect=4), "'cuta'", "did you mean 'cuda'?",
            harness.FAKE_DIR
        )

    def test_broken_plugins(self):
        for name, word in (
            ("missing_library", "libcrt_absent.so.1"),
            ("no_symbol", "crt_backend_v1"),
            ("wrong_layout", "rebuild"),
            ("wrong_abi", "rebuild"),
            ("small_table", "bytes"),
        ):
            with self.subTest(plugin=name):
                self.assert_one_error(self.crt("scene.yaml", "-b", name, expect=4), name, word)

    def test_no_device(self):
        self.assert_one_error(self.crt("scene.yaml", "-b", "no_device", expect=4), "no_device", "driver")

    def test_unknown_device(self):
        self.assert_one_error(self.crt("scene.yaml", "-b", "fake", "-d", "quantum", expect=4), "quantum")

    def test_a_path_is_a_backend(self):
        self.crt("scene.yaml", "-b", os.path.join(harness.FAKE_DIR, "crt_backend_fake.so"), "-o", "a.pfm")

    def test_environment_variable_and_precedence(self):
        self.crt("scene.yaml", "-o", "a.pfm", CRT_BACKEND="fake")
        self.crt("scene.yaml", "-o", "a.pfm", "-b", "fake", CRT_BACKEND="nonsense")
        self.assertEqual(self.report("a.report.json")["backend"]["name"], "fake")

    def test_device_by_name(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm", "-d", "second")
        self.assertEqual(self.report("a.report.json")["backend"]["device"], "second pattern")

    def test_plugins_lists_all(self):
        text = self.crt("plugins").stdout
        for word in ("cuda", "embree", "opencl", "second pattern", "cannot run", "libcrt_absent.so.1"):
            self.assertIn(word, text)

    def test_exception_in_a_plugin_is_an_internal_error(self):
        self.assert_one_error(
            self.crt("scene.yaml", "-b", "throws_in_render", "-o", "a.pfm", expect=1), "broke the contract"
        )


class Info(CliTest):
    def test_scene(self):
        text = self.crt("info", "scene.yaml").stdout
        for word in (
            "A lamp over a floor",
            "24 x 16",
            "2 objects, 4 triangles",
            "floor (diffuse)",
            "1 emitting triangle or parallelogram",
            "a loop over all",
            "area-light",
            "left out",
            "scene hash",
        ):
            self.assertIn(word, text)

    def test_film_and_image(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.crtfilm", "-o", "a.exr")
        self.assertIn("16 per pixel: 0-16", self.crt("info", "a.crtfilm").stdout)
        text = self.crt("info", "a.exr").stdout
        for word in ("24 x 16", "R, G, B", "crt/sceneHash", "fake"):
            self.assertIn(word, text)

    def test_every_aov_of_a_scene_is_in_its_exr(self):
        channels = {
            "albedo": "Albedo.R, Albedo.G, Albedo.B",
            "normal": "Ns.X, Ns.Y, Ns.Z",
            "depth": "Z",
            "primitive": "id.primitive",
            "variance": "OwnVariance.Y, Variance.Y",
            "samples": "sampleCount",
            "error": "HalfWidth95.Y, OwnVariance.Y, StdError.Y",
            "color_error": "StdError.R, StdError.G, StdError.B",
        }
        schema = json.loads(self.crt("schema").stdout)
        listed = re.findall(r'"aovs".*?"enum": (\[.*?\])', json.dumps(schema))
        self.assertEqual(json.loads(listed[0]), list(channels))
        for aov, names in channels.items():
            self.write("aov.yaml", SCENE + f"outputs: [{{file: {aov}.exr, aovs: [{aov}]}}]\n")
            self.crt("aov.yaml", "-b", "fake", "--spp", "64")
            text = self.crt("info", f"{aov}.exr").stdout
            self.assertRegex(text, rf"(?m)^ *(channels|integers) +(.*, )?{re.escape(names)}$")

    def test_the_hash_is_that_of_the_report(self):
        self.crt("scene.yaml", "-b", "fake", "-o", "a.pfm")
        self.assertIn(self.report("a.report.json")["scene"]["hash"], self.crt("info", "scene.yaml").stdout)

    def test_a_scene_needs_no_backend_and_no_image_library(self):
        # Libraries make a start slow; the dynamic linker tells which are opened.
        def libraries(*arguments):
            return self.crt(*arguments, LD_DEBUG="files").stderr
        # The trace would show every library that is opened.
        self.assertIn("crt_backend_fake.so", libraries("scene.yaml", "-b", "fake", "-o", "a.exr"))
        self.assertIn("libOpenImageIO", libraries("info", "a.exr"))
        opened = libraries("info", "scene.yaml")
        self.assertIn("libc.so", opened)
        for library in ("crt_backend_", "crt_image", "OpenImageIO", "libcuda", "libOpenCL", "libembree"):
            self.assertNotIn(library, opened)

    def test_scenes_that_come_with_crt(self):
        scene = os.path.join(harness.CONFIG_DIR, "cornell_box.yaml")
        if not os.path.exists(scene):
            self.skipTest("no configs/cornell_box.yaml")
        self.assertIn("emitting triangle", self.crt("info", scene).stdout)


class Verify(CliTest):
    def test_a_case_of_a_slower_level_is_announced(self):
        verify = self.start("verify", "-b", "example", "--case", "energy-balance")
        try:
            self.assertIn("1 of 1 cases is of level merge; crt runs it at the size of level commit",
                          verify.stdout.readline())
        finally:
            verify.kill()
            verify.communicate()

    def test_wrong_physics_is_named(self):
        run = self.crt("verify", "-b", "without_cosine", "--case", "square-light", "-o", "out", expect=7)
        self.assertIn("one of the two cosines is missing", run.stdout)
        with open(os.path.join(self.directory, "out", "verify.json"), encoding="utf-8") as file:
            self.assertFalse(json.load(file)["passed"])
        self.assertIn("out/verify.json has every figure", run.stdout)
        self.assertFalse(os.path.exists(os.path.join(self.directory, "out", "verify.html")))

    def test_the_page_is_made_by_the_python_that_is_named(self):
        """The interpreter here is a script: of a page only its command is asked, which libraries is not."""
        self.write("python", "#!/bin/sh\necho \"$@\" > \"$3/verify.html\"\n")
        os.chmod(self.path("python"), 0o755)
        arguments = ["verify", "-b", "example", "--case", "furnace", "-o", "out"]
        run = self.crt(*arguments, CRT_PYTHON=self.path("python"))
        self.assertIn("out/verify.html and out/verify.json have every figure", run.stdout)
        with open(self.path("out/verify.html"), encoding="utf-8") as file:
            first, program, folder = file.read().split()
        self.assertEqual((first, folder), ("-B", os.path.realpath(self.path("out"))))
        self.assertTrue(os.path.exists(os.path.join(program, "__main__.py")))

    def test_a_program_of_pages_that_others_could_have_written_is_not_run(self):
        """In a copy of the tree, which its tests may change."""
        tree = os.path.dirname(os.path.dirname(os.path.realpath(harness.CRT)))
        os.makedirs(self.path("tree/bin"))
        for program in ("crt", "crt_conformance"):
            shutil.copy(os.path.join(tree, "bin", program), self.path("tree/bin"))
        report = self.path("tree/share/crt/report")
        shutil.copytree(os.path.join(tree, "share", "crt", "report"), report)
        for folder, _, files in os.walk(self.path("tree")):
            for name in [".", *files]:
                path = os.path.join(folder, name)
                os.chmod(path, os.stat(path).st_mode & ~0o022)
        self.write("python", "#!/bin/sh\ntouch ran\necho page > \"$3/verify.html\"\n")
        os.chmod(self.path("python"), 0o755)

        def verify():
            arguments = ["verify", "-b", "example", "--case", "furnace", "-o", "out"]
            return subprocess.run(
                [self.path("tree/bin/crt"), *arguments],
                cwd=self.directory,
                env=harness.environment(CRT_PYTHON=self.path("python")),
                capture_output=True,
                text=True,
            )
        for path in (report, os.path.join(report, "__main__.py")):
            mode = os.stat(path).st_mode
            os.chmod(path, mode | 0o022)
            run = verify()
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("is refused: everyone can write to", run.stdout)
            self.assertFalse(os.path.exists(self.path("ran")))
            os.chmod(path, mode)
        verify()
        self.assertTrue(os.path.exists(self.path("ran")))

    def test_the_suite_is_a_program_beside_crt(self):
        os.mkdir(self.path("bin"))
        shutil.copy(harness.CRT, self.path("bin/crt"))

        def run():
            return subprocess.run(
                [self.path("bin/crt"), "verify", "--list"],
                env=harness.environment(),
                capture_output=True,
                text=True,
            )
        alone = run()
        self.assertEqual(alone.returncode, 2)
        self.assert_one_error(alone, f"there is no '{os.path.realpath(self.path('bin/crt_conformance'))}'")
        self.write("bin/crt_conformance", "#!/bin/sh\necho \"$@\"; exit 7\n")
        os.chmod(self.path("bin/crt_conformance"), 0o755)
        beside = run()
        self.assertEqual((beside.stdout, beside.returncode), ("verify --list\n", 7))
        os.chmod(self.path("bin/crt_conformance"), 0o777)
        self.assert_one_error(run(), "everyone can write to")

    def test_without_a_page_its_command_is_said_and_the_answer_is_the_same(self):
        for python, why in (("/nowhere/python", "cannot start '/nowhere/python': No such file or directory"),
                            ("false", "'false' ended with code 1"),
                            ("", "because CRT_PYTHON is empty")):
            run = self.crt("verify", "-b", "example", "--case", "furnace", "-o", "out", CRT_PYTHON=python)
            self.assertRegex(run.stdout, f"no page was made[,:] {why}; this command makes it: ")
            self.assertRegex(run.stdout, "this command makes it: .*share/crt/report out\n")

    def test_right_physics_passes(self):
        run = self.crt("verify", "-b", "example", "--case", "furnace,square-light")
        self.assertIn("2 pass", run.stdout)

    def test_case_misspelt(self):
        self.assert_one_error(self.crt("verify", "--case", "furnance", expect=2), "furnace")

    def test_list_names_cases(self):
        self.assertIn("square-light", self.crt("verify", "--list").stdout)

    def test_parts_of_verify_are_all_of_it(self):
        def cases(*part):
            text = self.crt("verify", "--list", "--level", "merge", *part).stdout
            return re.findall(r"^ *([A-Z]\d\d) ", text, re.MULTILINE)
        whole, parts = cases(), [cases("--part", f"{i}/3") for i in (1, 2, 3)]
        self.assertGreater(len(whole), 200)
        self.assertEqual(sorted(sum(parts, [])), whole)
        self.assertLessEqual(max(map(len, parts)) - min(map(len, parts)), 1)
        for word in ("0/3", "4/3", "2", "1/0", "a/b", "1/3x", "-1/3", ""):
            self.assert_one_error(self.crt("verify", "--list", f"--part={word}", expect=2), "--part")


if __name__ == "__main__":
    harness.main(__doc__)
