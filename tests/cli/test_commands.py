#!/usr/bin/env python3
"""The results of the table of commands (help, manual page, completion), named data, and standard streams.

    test_commands.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]
"""

import json
import os
import re
import shutil
import subprocess
import unittest

import harness
from harness import CliTest, read_bytes

BASH, ZSH, FISH, GROFF = (shutil.which(name) for name in ("bash", "zsh", "fish", "groff"))
COMMANDS = (
    "render info compare merge develop converge reference verify plugins warm data schema version help "
    "completion".split()
)


def long_options(text):
    """Options that a page of --help lists, at the beginning of their lines."""
    return sorted(set(re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text, re.M)))


class Help(CliTest):
    def test_help_of_a_command_by_both_ways(self):
        for command in COMMANDS:
            self.assertEqual(self.crt("help", command).stdout, self.crt(command, "--help").stdout)
        self.assertEqual(self.crt("help").stdout, self.crt("--help").stdout)
        self.assert_one_error(self.crt("help", "comapre", expect=2), "did you mean 'compare'?")

    def test_every_command_is_on_the_first_page(self):
        page = self.crt("--help").stdout
        for command in COMMANDS:
            self.assertRegex(page, rf"(?m)^  {command} ")

    def test_the_manual_page_has_every_option(self):
        page = self.crt("help", "--man").stdout
        self.assertTrue(page.startswith(".TH CRT 1 "))
        plain = page.replace("\\-", "-")
        for command in COMMANDS:
            section = plain[plain.index(f".SS \\fBcrt {command}\\fR") :]
            section = section[: section.find("\n.SS ", 1)] if "\n.SS " in section[1:] else section
            for option in set(long_options(self.crt(command, "--help").stdout)) - {"--help"}:
                self.assertIn(f"\\fB{option}\\fR", section, command)

    @unittest.skipUnless(GROFF, "no groff")
    def test_the_manual_page_is_good_roff(self):
        page = self.crt("help", "--man").stdout
        run = subprocess.run(
            [GROFF, "-man", "-Tutf8", "-ww", "-k"], input=page, capture_output=True, text=True, check=True
        )
        self.assertEqual(run.stderr, "")
        plain = re.sub(r"\x1b\[[0-9;]*m", "", run.stdout)
        self.assertIn("--target-error", plain)
        self.assertIn("crt scene.yaml --resume --spp 4096", plain)


class Completion(CliTest):
    def setUp(self):
        super().setUp()
        self.script = self.crt("completion", "bash").stdout
        for name in ("b.exr", "two words.yaml", "notes.txt", "film.crtfilm"):
            self.write(name, "")
        os.mkdir(self.path("folder"))

    def bash(self, *words):
        """The completions of bash at the end of these words."""
        program = self.script + (
            'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _crt; printf "%s\\n" "${COMPREPLY[@]}"'
        )
        run = subprocess.run(
            [BASH, "-c", program, "bash", "crt", *words],
            cwd=self.directory,
            env={**harness.environment(), "PATH": os.path.dirname(harness.CRT) + ":" + os.environ["PATH"]},
            capture_output=True,
            text=True,
            timeout=harness.PATIENCE_SECONDS,
        )
        # compopt works only while bash completes.
        self.assertEqual(run.stderr, "")
        return sorted(line for line in run.stdout.split("\n") if line)

    def test_no_such_shell(self):
        self.assert_one_error(self.crt("completion", "bsh", expect=2), "did you mean 'bash'?")

    @unittest.skipUnless(BASH, "no bash")
    def test_bash_offers_commands_and_scenes(self):
        offered = self.bash("")
        for word in (*COMMANDS, "scene.yaml", "two words.yaml", "folder"):
            self.assertIn(word, offered)
        self.assertNotIn("b.exr", offered)
        self.assertEqual(self.bash("conv"), ["converge"])

    @unittest.skipUnless(BASH, "no bash")
    def test_bash_offers_every_option_of_a_command(self):
        for command in COMMANDS:
            offered = self.bash(command, "--")
            self.assertEqual(
                [word for word in offered if word.startswith("--")],
                sorted(set(long_options(self.crt(command, "--help").stdout)) | {"--help"}),
                command,
            )
        # The word render may be left out.
        self.assertEqual(self.bash("scene.yaml", "--target"), ["--target-error"])

    @unittest.skipUnless(BASH, "no bash")
    def test_bash_offers_values(self):
        self.assertEqual(self.bash("scene.yaml", "--kernel", ""), ["full", "lean", "lean-only"])
        self.assertEqual(self.bash("scene.yaml", "--kernel", "=", "f"), ["full"])
        self.assertEqual(self.bash("verify", "--backend", "em"), ["embree"])
        self.assertEqual(self.bash("scene.yaml", "-o", ""), ["b.exr", "film.crtfilm", "folder"])
        self.assertEqual(self.bash("develop", ""), ["film.crtfilm", "folder"])
        self.assertEqual(self.bash("scene.yaml", "--spp", ""), [])
        self.assertEqual(self.bash("verify", "-o", ""), ["folder"])
        self.assertEqual(self.bash("help", "ref"), ["reference"])
        self.assertEqual(self.bash("data", "cornell/w"), ["cornell/white"])
        self.assertEqual(self.bash("scene.yaml", "--set", "film.reso"), ["film.resolution="])
        self.assertIn("camera.position=", self.bash("scene.yaml", "--set", ""))
        self.assertNotIn("camera.position=", self.bash("develop", "--set", ""))

    @unittest.skipUnless(BASH, "no bash")
    def test_bash_takes_the_script(self):
        run = subprocess.run(
            [BASH, "-c", self.script + "complete -p crt"], capture_output=True, text=True, check=True
        )
        self.assertEqual(run.stdout, "complete -F _crt crt\n")
        self.assertEqual(run.stderr, "")

    @unittest.skipUnless(ZSH, "no zsh")
    def test_zsh_takes_the_script(self):
        self.write("_crt", self.crt("completion", "zsh").stdout)
        run = subprocess.run([ZSH, "-n", self.path("_crt")], capture_output=True, text=True)
        self.assertEqual((run.returncode, run.stderr), (0, ""))

    @unittest.skipUnless(FISH, "no fish")
    def test_fish_takes_the_script(self):
        self.write("crt.fish", self.crt("completion", "fish").stdout)
        run = subprocess.run([FISH, "-n", self.path("crt.fish")], capture_output=True, text=True)
        self.assertEqual((run.returncode, run.stderr), (0, ""))

    def test_zsh_and_fish_know_every_option(self):
        zsh, fish = (self.crt("completion", shell).stdout for shell in ("zsh", "fish"))
        for command in COMMANDS:
            mine = zsh[zsh.index(f"        {command})\n") :]
            mine = mine[: mine.index("            ;;")]
            rows = "\n".join(
                line for line in fish.splitlines() if f"'__crt_command_is {command}'" in line
            )
            for option in long_options(self.crt(command, "--help").stdout):
                self.assertRegex(mine, rf"{option}[\[}}']", command)
                self.assertRegex(rows, rf" -l {option[2:]} ", command)


class Plugins(CliTest):
    def test_json_says_what_the_list_says(self):
        listed = [line.split()[0] for line in self.crt("plugins").stdout.splitlines() if line[:1] != " "]
        backends = json.loads(self.crt("plugins", "--json").stdout)["backends"]
        self.assertEqual([b["name"] for b in backends], listed)
        by_name = {b["name"]: b for b in backends}
        fake = by_name["fake"]
        self.assertTrue(fake["usable"])
        self.assertIsNone(fake["reason"])
        self.assertGreaterEqual(len(fake["devices"]), 1)
        self.assertEqual(fake["devices"][0]["index"], 0)
        broken = [b for b in backends if not b["usable"]]
        self.assertGreater(len(broken), 5)
        for backend in broken:
            self.assertTrue(backend["reason"])
            self.assertFalse(backend["refused"], backend)

    def test_json_names_what_was_not_opened(self):
        plugin = shutil.copy(os.path.join(harness.FAKE_DIR, "crt_backend_fake.so"), self.directory)
        os.chmod(plugin, 0o777)  # Others could have written it.
        run = self.crt("plugins", "--json", CRT_BACKEND_PATH=self.directory)
        (fake,) = (b for b in json.loads(run.stdout)["backends"] if b["name"] == "fake")
        self.assertTrue(fake["refused"])
        self.assertFalse(fake["usable"])
        self.assertEqual(fake["devices"], [])

    def test_no_library_is_looked_for_in_the_current_folder(self):
        """A folder with a scene from elsewhere may hold one of that name."""
        run = self.crt("plugins", LD_DEBUG="libs", LC_ALL="C")
        tried = re.findall("trying file=(.*)", run.stderr)
        self.assertTrue(tried)
        self.assertEqual([name for name in tried if not name.startswith("/")], [])


class Warm(CliTest):
    def test_says_of_each_scene_what_its_kernel_took(self):
        shutil.copy(self.path("scene.yaml"), self.path("other.yaml"))
        run = self.crt("warm", "scene.yaml", "other.yaml", "-b", "fake")
        lines = sorted(run.stdout.splitlines())
        self.assertEqual([line.split(":")[0] for line in lines], ["other.yaml", "scene.yaml"])
        for line in lines:
            self.assertRegex(line, r": fake on .+, nothing to compile$")
        self.assertEqual(sorted(os.listdir(self.directory)), ["other.yaml", "scene.yaml"])

    def test_a_scene_that_is_not_there(self):
        self.assert_one_error(self.crt("warm", "none.yaml", "-b", "fake", expect=3), "none.yaml")
        self.assert_one_error(self.crt("warm", expect=2), "SCENE")


class Data(CliTest):
    def test_the_list_has_sources(self):
        text = self.crt("data").stdout
        names = re.findall(r"^  (\w+/\S+)", text, re.M)
        for name in ("cornell/white", "glasses/SF10", "illuminants/D65", "metals/Au", "paints/foliage"):
            self.assertIn(name, names)
        self.assertIn("source: Cornell University Program of Computer Graphics", text)
        rows = json.loads(self.crt("data", "--json").stdout)["data"]
        self.assertEqual([row["name"] for row in rows], names)
        for row in rows:
            self.assertGreater(len(row["source"]), 20, row)

    def test_what_is_printed_can_be_read_again(self):
        for name in ("cornell/red", "paints/cyan", "illuminants/F11"):
            text = self.crt("data", name).stdout
            table = json.loads(self.crt("data", name, "--json").stdout)
            (column,) = table["columns"]
            rows = [
                tuple(map(float, line.split(","))) for line in text.splitlines() if line[0] in "0123456789"
            ]
            self.assertEqual(rows, list(zip(table["wavelength_nm"], table["values"][column])))

    def test_data_and_the_file_that_is_printed_are_one_spectrum(self):
        for name in ("cornell/red", "paints/cyan"):
            self.write("table.csv", self.crt("data", name).stdout)
            hashes = []
            for form in (f"{{data: {name}}}", "{file: table.csv, outside: clamp}", "1"):
                self.write(
                    "s.yaml", f"crt: 1\nfilm: {{resolution: [4, 4]}}\nenvironment: {{radiance: {form}}}\n"
                )
                hashes += re.findall(r"scene hash +(\w+)", self.crt("info", "s.yaml").stdout)
            self.assertEqual(hashes[0], hashes[1])
            self.assertNotEqual(hashes[0], hashes[2])

    def test_metals_have_two_columns(self):
        table = json.loads(self.crt("data", "metals/gold", "--json").stdout)
        self.assertEqual(table["columns"], ["n", "k"])
        # Gold at 2.00 eV, 619.92 nm, in the SOPRA data base.
        index = min(range(56), key=lambda i: abs(table["wavelength_nm"][i] - 619.92))
        self.assertAlmostEqual(table["values"]["n"][index], 0.194)
        self.assertAlmostEqual(table["values"]["k"][index], 3.06)

    def test_no_such_data(self):
        self.assert_one_error(self.crt("data", "cornel/white", expect=2), "did you mean 'cornell/white'?")

    def test_an_output_never_replaces_data_or_an_included_file(self):
        os.makedirs(self.path("mine/own"))
        self.write(
            "mine/own/a.exr.csv", "# a\n# source: me\n# quantity: radiance\n# outside: clamp\n400,1\n700,1\n"
        )
        self.write("base.yaml", "crt: 1\nfilm: {resolution: [4, 4]}\n")
        os.symlink("base.yaml", self.path("base.pfm"))
        self.write(
            "s.yaml", "crt: 1\ninclude: base.yaml\nenvironment: {radiance: {data: own/a.exr}}\n"
        )
        os.symlink("mine/own/a.exr.csv", self.path("data.pfm"))
        for output in ("base.pfm", "data.pfm"):
            run = self.crt(
                "s.yaml", "--backend", "fake", "-o", output, CRT_DATA_PATH=self.path("mine"), expect=2
            )
            self.assert_one_error(run, "would replace")
        self.assertEqual(read_bytes(self.path("base.yaml"))[:6], b"crt: 1")


class Include(CliTest):
    def test_errors_name_the_file_and_its_line(self):
        self.write("room.yaml", "crt: 1\nfilm: {resolutoin: [4, 4]}\n")
        self.write("s.yaml", "crt: 1\ninclude: room.yaml\n")
        run = self.crt("s.yaml", expect=3)
        self.assertIn("room.yaml:2:8: error: unknown key 'resolutoin' in film", run.stderr)

    def test_what_cannot_be_included_is_refused_at_once(self):
        os.mkfifo(self.path("pipe.yaml"))
        os.mkdir(self.path("folder.yaml"))
        self.write("picture.yaml", "")
        with open(self.path("picture.yaml"), "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
        for name, words in (
            ("pipe.yaml", "is a pipe"),
            ("folder.yaml", "is a directory"),
            ("/dev/zero", "'/dev/zero' "),
            ("picture.yaml", "is not text"),
            ("s.yaml", "includes itself"),
            ("none/room.yaml", "cannot find 'none/room.yaml'"),
        ):
            self.write("s.yaml", f"crt: 1\ninclude: {name}\n")
            run = self.crt("info", "s.yaml", expect=3)
            self.assertIn(words, run.stderr)

    def test_scenes_that_share_a_room_are_what_they_were_in_one_file(self):
        self.write("room.yaml", harness.SCENE)
        self.write("s.yaml", "crt: 1\ninclude: room.yaml\n")
        for scene in ("scene.yaml", "s.yaml"):
            self.crt(scene, "--backend", "fake", "--report", "none", "-o", scene + ".pfm")
        self.assertEqual(read_bytes(self.path("scene.yaml.pfm")), read_bytes(self.path("s.yaml.pfm")))
        hashes = {
            re.search(r"scene hash +(\w+)", self.crt("info", scene).stdout)[1]
            for scene in ("scene.yaml", "s.yaml")
        }
        self.assertEqual(len(hashes), 1)

    def test_no_shipped_scene_repeats_a_table(self):
        seen = {}
        for folder, _, names in os.walk(harness.CONFIG_DIR):
            for name in names:
                if not name.endswith(".yaml"):
                    continue
                text = read_bytes(os.path.join(folder, name)).decode()
                for table in re.findall(r"value: \[([^]]{40,})\]", text):
                    key = "".join(table.split())
                    self.assertNotIn(key, seen, f"{name} repeats a table of {seen.get(key)}")
                    seen[key] = name


class StandardStreams(CliTest):
    def stream(self, *arguments, stdin=None, expect=0, **options):
        run = subprocess.run(
            [harness.CRT, *arguments],
            cwd=self.directory,
            env=harness.environment(),
            input=stdin,
            stdout=options.pop("stdout", subprocess.PIPE),
            stderr=subprocess.PIPE,
            timeout=harness.PATIENCE_SECONDS,
        )
        self.assertEqual(run.returncode, expect, run.stderr.decode())
        return run

    def test_an_image_on_standard_output_is_that_of_a_file(self):
        before = set(os.listdir(self.directory))
        for output, name in (("-", "a.ppm"), ("-.pfm", "a.pfm"), ("-.ppm", "b.ppm")):
            run = self.stream("scene.yaml", "--backend", "fake", "-o", output)
            self.assertEqual(set(os.listdir(self.directory)), before, "nothing else is written")
            self.crt("scene.yaml", "--backend", "fake", "--report", "none", "-o", name)
            self.assertEqual(run.stdout, read_bytes(self.path(name)))
            os.remove(self.path(name))

    def test_an_image_larger_than_any_buffer_arrives_whole(self):
        large = ("scene.yaml", "--backend", "fake", "--spp", "1", "--set", "film.resolution=[640,480]")
        self.crt(*large, "--report", "none", "-o", "a.pfm")
        self.assertEqual(self.stream(*large, "-o", "-.pfm").stdout, read_bytes(self.path("a.pfm")))

    def test_png_and_exr(self):
        for output, mark in (("-.png", b"\x89PNG"), ("-.exr", b"\x76\x2f\x31\x01")):
            self.assertEqual(
                self.stream("scene.yaml", "--backend", "fake", "-o", output).stdout[:4], mark
            )

    def test_a_scene_on_standard_input(self):
        scene = harness.SCENE.encode()
        run = self.stream("-", "--backend", "fake", "-o", "-.pfm", stdin=scene)
        self.crt("scene.yaml", "--backend", "fake", "--report", "none", "-o", "a.pfm")
        self.assertEqual(run.stdout, read_bytes(self.path("a.pfm")))
        self.assertIn(b"2 objects", self.stream("info", "-", stdin=scene).stdout)
        # The included file lies next to the working directory.
        self.write("room.yaml", harness.SCENE)
        run = self.stream("info", "-", stdin=b"crt: 1\ninclude: room.yaml\n")
        self.assertIn(b"2 objects", run.stdout)

    def test_films_become_images_on_standard_output(self):
        self.crt("scene.yaml", "--backend", "fake", "--report", "none", "-o", "a.crtfilm", "-o", "a.pfm")
        for command in ("develop", "merge"):
            run = self.stream(command, "a.crtfilm", "-o", "-.pfm")
            self.assertEqual(run.stdout, read_bytes(self.path("a.pfm")))

    def test_what_cannot_go_there(self):
        fake = ("scene.yaml", "--backend", "fake")
        self.assert_one_error(self.crt(*fake, "-o", "-", "-o", "-.pfm", expect=2), "standard output")
        self.assert_one_error(self.crt(*fake, "-o", "-.crtfilm", expect=2), "a film must be written to a "
                                                                            "file")
        self.write("a.pfm", "")
        self.assert_one_error(
            self.crt("compare", "a.pfm", "a.pfm", "--diff", "-.pfm", expect=2), "standard output"
        )

    def test_a_terminal_is_refused_before_the_render(self):
        master, slave = os.openpty()
        try:
            run = self.stream("scene.yaml", "--backend", "fake", "-o", "-", stdout=slave, expect=6)
            self.assertIn(b"terminal", run.stderr)
        finally:
            os.close(slave)
            os.close(master)

    def test_a_full_disk_behind_standard_output_is_an_error(self):
        with open("/dev/full", "wb") as full:
            run = self.stream("scene.yaml", "--backend", "fake", "-o", "-", stdout=full, expect=6)
        self.assertIn(b"cannot write to 'standard output'", run.stderr)

    def test_a_render_that_fails_sends_nothing(self):
        self.write("wrong.yaml", "crt: 1\nfilm: {resolution: [0, 4]}\n")
        run = self.stream("wrong.yaml", "--backend", "fake", "-o", "-", expect=3)
        self.assertEqual(run.stdout, b"")


if __name__ == "__main__":
    harness.main(__doc__)
