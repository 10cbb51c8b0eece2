#!/usr/bin/env python3
"""`crt view` as its pages see it: the picture and what changes it, files that change, errors, and access
control. tests/view/test_page.py tests the page in a browser.

    test_view.py CRT CONFIG_DIR FAKE_PLUGIN_DIR [unittest arguments]

Over 450 lines: one program, seen from its pages.
"""

import os
import select
import signal
import socket
import struct
import threading
import time
import urllib.error

import harness
from harness import CliTest, LightTest, LIT, SCENE
from view_client import TOKEN, View, is_done, ppm_pixels, without_alpha

LENS = LIT.replace("fov: 40", "fov: 40, aperture_radius: 0.05")
SPECTRAL = LIT.replace("resolution: [24, 16]",
                       "resolution: [24, 16], spectral: {from_nm: 400, to_nm: 700, bins: 3}")


class Picture(CliTest):
    def test_the_picture_is_that_of_render(self):
        view = View(self, "-b", "fake", "--spp", "7")
        status, pixels = view.wait_until_done()
        self.crt("render", "scene.yaml", "-b", "fake", "--spp", "7", "-o", "a.ppm")
        self.assertEqual((status["width"], status["height"], status["samples"]), (24, 16, 7))
        self.assertEqual(without_alpha(pixels), ppm_pixels(self.path("a.ppm")))
        self.assertEqual(set(pixels[3::4]), {255})

    def test_exposure_and_white_need_no_sample(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", "fake")
        before, _ = view.wait_until_done()
        view.change(exposure_ev=1.5, white="glow")
        status, pixels = view.wait(lambda s: is_newer(s, before))
        self.assertEqual(status["seconds"], before["seconds"])
        self.crt("render", "scene.yaml", "-b", "fake", "-o", "a.ppm", "--set", "film.exposure_ev=1.5",
                 "--set", "film.white_balance=glow")
        self.assertEqual(without_alpha(pixels), ppm_pixels(self.path("a.ppm")))

    def test_a_film_of_other_samples_and_a_pause(self):
        view = View(self, "-b", "fake")
        view.wait_until_done()
        view.change(paused=True, samples=40)
        status, _ = view.wait(lambda s: s["paused"])
        self.assertEqual((status["samples"], status["samples_wanted"]), (16, 40))
        view.change(paused=False)
        self.assertEqual(view.wait_until_done()[0]["samples"], 40)

    def test_a_crop_window_is_shown_alone(self):
        view = View(self, "-b", "fake", "--crop", "3,2,20,13")
        status, pixels = view.wait_until_done()
        self.crt("render", "scene.yaml", "-b", "fake", "--crop", "3,2,20,13", "-o", "a.ppm")
        self.assertEqual((status["width"], status["height"]), (17, 11))
        self.assertEqual(without_alpha(pixels), ppm_pixels(self.path("a.ppm")))

    def test_what_cannot_be_changed_is_refused_and_changes_nothing(self):
        view = View(self, "-b", "fake")
        before, _ = view.wait_until_done()
        for wish, words in (({"white": "glwo"}, "no light 'glwo'"), ({"plane": "depht"}, "no plane"),
                            ({"focus": [0.5, 0.5], "exposure_ev": 3}, "pinhole"), ({"dolly": 0}, "dolly")):
            with self.assertRaises(urllib.error.HTTPError) as refused:
                view.change(**wish)
            with refused.exception as reply:
                self.assertEqual(reply.code, 400)
                self.assertIn(words, reply.read().decode())
        after, _ = view.state()
        for key in ("white", "plane", "exposure_ev", "camera"):
            self.assertEqual(after[key], before[key])

    def test_another_backend_takes_over(self):
        view = View(self, "-b", "fake")
        view.wait_until_done()
        view.change(backend="fake_biased")
        view.wait(lambda s: s["backend"] == "fake_biased")
        view.change(backend="nowhere")
        status, _ = view.wait(lambda s: s["render_error"])
        self.assertIn("nowhere", status["render_error"])
        view.change(backend="fake")
        status, _ = view.wait(lambda s: s["backend"] == "fake" and not s["render_error"])
        self.assertIn("fake", [b["name"] for b in view.json("/devices")])

    def test_a_device_that_fails_says_so_and_the_view_lives(self):
        view = View(self, "-b", "fake", fault="device")
        status, _ = view.wait(lambda s: s["render_error"])
        self.assertIn("fake", status["render_error"])
        self.assertIsNone(view.process.poll())


class Camera(LightTest):
    def assert_rendered(self, status, pixels):
        """The picture is that of the scene with the camera that the status tells, with 4 samples."""
        sets = [f"camera.{key}={status['camera'][key]}" for key in ("position", "target", "up")]
        self.crt("render", "scene.yaml", "-b", self.backend, "--spp", "4", "-o", "a.ppm",
                 *(word for change in sets for word in ("--set", change)), CRT_BACKEND_PATH="")
        self.assertEqual(without_alpha(pixels), ppm_pixels(self.path("a.ppm")))

    def test_a_moved_camera_is_that_of_a_scene_with_it(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend, "--spp", "4")
        first, before = view.wait_until_done()
        view.change(orbit=[0.6, 0.2], pan=[0.1, 0.05], dolly=0.8)
        status, pixels = view.wait(lambda s: is_done(s) and is_newer(s, first))
        self.assertNotEqual(pixels, before)
        self.assert_rendered(status, pixels)
        view.change(reset_camera=True)
        _, again = view.wait(lambda s: is_done(s) and is_newer(s, status))
        self.assertEqual(again, before)

    def test_a_mesh_that_changes_is_another_tree(self):
        mesh = "v -1 0.2 0\nv 1 0.2 0\nv 0 1.2 0\nf 1 3 2\n"
        self.write("sheet.obj", mesh)
        self.write("scene.yaml", LIT + "  - {name: sheet, obj: sheet.obj, material: floor}\n"
                   "integrator: {accelerator: bvh}\n")
        view = View(self, "-b", self.backend, "--spp", "4")
        first, _ = view.wait_until_done()
        view.change(orbit=[-0.4, 0.1])
        moved, pixels = view.wait(lambda s: is_done(s) and is_newer(s, first))
        self.assert_rendered(moved, pixels)
        # As many bytes as before: only the positions differ.
        self.write("sheet.obj", mesh.replace("v 0 1.2 0", "v 0 0.5 -1"))
        other, pixels = view.wait(lambda s: is_done(s) and is_newer(s, moved))
        self.assertTrue(other["camera_moved"])
        self.assert_rendered(other, pixels)

    def test_a_click_focuses_the_lens(self):
        self.write("scene.yaml", LENS)
        view = View(self, "-b", self.backend)
        view.wait_until_done()
        view.change(focus=[0.5, 0.75])
        status, _ = view.wait(lambda s: s["camera_moved"])
        # The floor, seen from one unit above it: y = 1 - t sin(…) = 0 along the ray through that pixel.
        distance = status["camera"]["focus_distance"]
        self.assertTrue(2.0 < distance < 4.2, distance)
        self.assertIn("focus_distance", status["camera_yaml"])

    def test_a_pixel_tells_its_value_and_its_surface(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend)
        view.wait_until_done()
        floor = view.json("/pixel", x=12, y=12)
        self.assertEqual((floor["object"], floor["material"], floor["samples"]), ("floor", "floor", 16))
        self.assertTrue(all(value > 0 for value in floor["xyz"]), floor)
        self.assertAlmostEqual(floor["xyz"][1], sum(w * v for w, v in zip(
            (0.2126, 0.7152, 0.0722), floor["rgb"])), delta=1e-3 * floor["xyz"][1])
        self.assertNotIn("object", view.json("/pixel", x=0, y=0))
        self.assertNotIn("spectrum", floor)
        with self.assertRaises(urllib.error.HTTPError) as refused:
            view.json("/pixel", x=24, y=0)
        with refused.exception as reply:
            self.assertEqual(reply.code, 400)

    def test_a_spectral_film_tells_spectra(self):
        self.write("scene.yaml", SPECTRAL)
        view = View(self, "-b", self.backend)
        view.wait_until_done()
        spectrum = view.json("/pixel", x=12, y=12)["spectrum"]
        self.assertEqual(spectrum["wavelengths_nm"], [450, 550, 650])
        # A lamp of 4000 K is redder than blue.
        self.assertLess(spectrum["radiance"][0], spectrum["radiance"][2])

    def test_planes_are_shown(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend)
        _, image = view.wait_until_done()
        pictures = [image]
        for plane in ("error", "albedo", "normal", "depth", "primitive"):
            view.change(plane=plane)
            _, pixels = view.wait(lambda s: s["picture"]["plane"] == plane and is_done(s), plane)
            pictures.append(pixels)
        self.assertEqual(len(set(pictures)), len(pictures))
        # Albedo 0.7 of the floor, in sRGB; nothing above the horizon.
        albedo = pictures[2]
        at = 4 * (12 * 24 + 12)
        self.assertAlmostEqual(albedo[at], 218, delta=4)
        self.assertEqual(tuple(albedo[:3]), (0, 0, 0))

    def test_the_image_is_saved_as_exr(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend, "--spp", "8")
        view.wait_until_done()
        with open(self.path("saved.exr"), "wb") as file:
            file.write(view.get("/image.exr"))
        self.crt("render", "scene.yaml", "-b", self.backend, "--spp", "8", "-o", "a.exr",
                 CRT_BACKEND_PATH="")
        self.crt("compare", "saved.exr", "a.exr", "--tolerance", "0")

    def test_errors_are_known_and_belong_to_the_render(self):
        self.write("scene.yaml", LIT)
        view = View(self, "-b", self.backend, "--spp", "256")
        status, _ = view.wait(lambda s: s["errors"] and s["errors"][-1][1] == 256)
        seconds, samples, error, lower, upper = status["errors"][-1]
        self.assertTrue(0 < lower < error < upper < 1, status["errors"][-1])


class Files(CliTest):
    def test_an_edit_is_read_and_an_error_keeps_the_picture(self):
        view = View(self, "-b", "fake")
        status, before = view.wait_until_done()
        self.assertEqual(status["title"], "A lamp over a floor")
        self.write("scene.yaml", SCENE.replace("fov: 40", "fov: forty"))
        status, pixels = view.wait(lambda s: s["scene_error"])
        self.assertIn("scene.yaml:3:58: error: ", status["scene_error"])
        self.assertEqual(pixels, before)
        self.write("scene.yaml", SCENE.replace("A lamp", "Another lamp").replace("[24, 16]", "[12, 8]"))
        status, _ = view.wait(lambda s: s["width"] == 12 and not s["scene_error"])
        self.assertEqual(status["title"], "Another lamp over a floor")

    def test_a_mesh_that_changes_is_read_again(self):
        self.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.write("scene.yaml", SCENE + "  - {name: sheet, obj: sheet.obj, material: floor}\n")
        view = View(self, "-b", "fake")
        view.wait_until_done()
        self.write("sheet.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n")
        status, _ = view.wait(lambda s: s["scene_error"])
        self.assertIn("sheet.obj", status["scene_error"])
        self.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n")
        view.wait(lambda s: not s["scene_error"])

    def test_a_scene_that_is_wrong_at_the_start_heals(self):
        self.write("scene.yaml", "crt: 1\nfilm: {resolutoin: [4, 4]}\n")
        view = View(self, "-b", "fake")
        status, pixels = view.wait(lambda s: s["scene_error"])
        self.assertIn("scene.yaml:2:8: error: ", status["scene_error"])
        self.assertEqual((pixels, status["width"]), (b"", 0))
        self.write("scene.yaml", SCENE)
        view.wait_until_done()

    def test_a_moved_camera_survives_an_edit_that_leaves_the_camera_alone(self):
        view = View(self, "-b", "fake")
        view.wait_until_done()
        view.change(orbit=[0.5, 0])
        moved, _ = view.wait(lambda s: s["camera_moved"])
        self.write("scene.yaml", SCENE.replace("A lamp", "Its lamp"))
        status, _ = view.wait(lambda s: s["title"] == "Its lamp over a floor")
        self.assertEqual(status["camera"], moved["camera"])
        self.write("scene.yaml", SCENE.replace("position: [0, 1, -4]", "position: [0, 1, -3]"))
        status, _ = view.wait(lambda s: s["camera"]["position"] == [0, 1, -3])
        self.assertFalse(status["camera_moved"])


class Access(CliTest):
    def test_only_the_page_that_knows_the_token_is_answered(self):
        view = View(self, "-b", "fake")
        self.assertEqual(view.refused(), 200)
        self.assertEqual(view.refused(token=""), 403)
        self.assertEqual(view.refused(token=TOKEN[:-1] + "x"), 403)
        self.assertEqual(view.refused(Host="evil.example"), 403)
        self.assertEqual(view.refused(Host=f"evil.example:{view.port}"), 403)
        self.assertEqual(view.refused(Origin="http://evil.example"), 403)
        self.assertEqual(view.refused(Origin=view.base), 200)

    def test_it_listens_to_this_machine_alone(self):
        view = View(self, "-b", "fake")
        with open("/proc/net/tcp", encoding="ascii") as file:
            listening = [line.split()[1] for line in file if line.split()[3] == "0A"]
        self.assertEqual([a for a in listening if a.endswith(f":{view.port:04X}")],
                         [f"0100007F:{view.port:04X}"])

    def test_garbage_and_silence_do_no_harm(self):
        view = View(self, "-b", "fake")
        silent = [socket.create_connection(("127.0.0.1", view.port)) for _ in range(8)]
        for text in (b"\0\1\2\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"POST /change HTTP/1.1\r\nHost: x\r\n"
                     b"Content-Length: 99999999\r\n\r\n", b"GET /" + b"x" * 100000 + b" HTTP/1.1\r\n\r\n"):
            with socket.create_connection(("127.0.0.1", view.port)) as connection:
                try:
                    connection.sendall(text)
                except ConnectionError:
                    pass
        view.wait_until_done()
        for connection in silent:
            connection.close()

    def test_silent_connections_do_not_lock_users_out(self):
        """Requests with the token are answered during the run, and not after its end."""
        for limit, most in ((None, 256), (64, 8)):
            view = View(self, "-b", "fake", most_descriptors=limit)
            view.wait_until_done()
            before, threads = harness.processor_seconds(view.process), self.threads_of(view)
            silent = [socket.create_connection(("127.0.0.1", view.port), 30) for _ in range(500)]
            for _ in range(5):
                view.state()
            # The server has room for this number: the oldest gave way to those that came later.
            self.assertIn(sum(is_open(connection) for connection in silent), range(most // 2, most + 1))
            self.assertTrue(is_open(silent[-1]))
            # Those that only connect cost no threads, and nothing while they are silent.
            self.assertLess(self.threads_of(view), threads + 4)
            self.assertLess(harness.processor_seconds(view.process) - before, 3)
            for connection in silent:
                connection.close()
            view.state()
            self.assertIsNone(view.process.poll())
            view.process.kill()

    def test_it_outlives_a_lack_of_threads(self):
        if why := harness.why_root_must_stay():
            self.skipTest(why)
        view = View(self, "-b", "fake", without_root=True)
        view.wait_until_done()
        harness.allow_new_threads(view.process, False)
        self.begin_requests(view, 1)
        harness.allow_new_threads(view.process, True)
        self.wait_for_an_answer(view)

    def test_it_outlives_a_lack_of_memory(self):
        view = View(self, "-b", "fake")
        view.wait_until_done()
        # Less than the stack of a thread. Those of threads that have ended are used again.
        if not harness.allow_memory(view.process, 1 << 20):
            self.skipTest("no sanitizer runs within a limit of address space")
        self.begin_requests(view, 40)
        self.wait_for_an_answer(view)

    def begin_requests(self, view, count):
        """Until the server closes one, because it cannot start a thread for it."""
        begun = [socket.create_connection(("127.0.0.1", view.port), 30) for _ in range(count)]
        for connection in begun:
            connection.sendall(b"GET ")
        closed, _, _ = select.select(begun, [], [], harness.PATIENCE_SECONDS)
        self.assertTrue(closed)
        for connection in begun:
            connection.close()

    def wait_for_an_answer(self, view):
        """Requests are closed without one until the threads of those before them have ended."""
        end = time.monotonic() + harness.PATIENCE_SECONDS
        while True:
            try:
                return view.state()
            except OSError as error:
                self.assertIsNone(view.process.poll(), error)
                self.assertLess(time.monotonic(), end)
                time.sleep(0.02)

    def test_the_token_is_in_no_argument(self):
        """Every user of the machine can read those of xdg-open and of the browser."""
        self.write("xdg-open", "#!/bin/sh\nprintf '%s\\n' \"$@\" > part\nmv part arguments\n")
        os.chmod(self.path("xdg-open"), 0o755)
        os.mkdir(self.path("run"), 0o700)
        process = self.start("view", "scene.yaml", "-b", "fake", DISPLAY=":99",
                             PATH=f"{self.directory}:{os.environ['PATH']}", XDG_RUNTIME_DIR=self.path("run"))
        address = process.stdout.readline().strip()
        token = address.split("token=")[1]
        self.assertIn("the view is in the browser", process.stderr.readline())
        end = time.monotonic() + harness.PATIENCE_SECONDS
        while not os.path.exists(self.path("arguments")):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.01)
        arguments = harness.read_bytes(self.path("arguments")).decode().split()
        self.assertNotIn(token, " ".join(arguments))
        self.assertEqual(len(arguments), 1)
        page = arguments[0].removeprefix("file://")
        # The page leads to the view, and other users cannot read it.
        self.assertIn(address, harness.read_bytes(page).decode())
        self.assertEqual(os.stat(os.path.dirname(page)).st_mode & 0o077, 0)
        self.assertEqual(os.path.dirname(os.path.dirname(page)), self.path("run"))

    def threads_of(self, view):
        with open(f"/proc/{view.process.pid}/status", encoding="ascii", errors="replace") as file:
            return int(next(line for line in file if line.startswith("Threads:")).split()[1])

    def test_a_camera_goes_no_farther_than_directions_are_exact(self):
        view = View(self, "-b", "fake")
        view.wait_until_done()
        for factor in (0.01, 100):
            with self.assertRaises(urllib.error.HTTPError) as refused:
                for _ in range(200):
                    view.change(dolly=factor)
            with refused.exception as reply:
                self.assertIn("no farther", reply.read().decode())
            view.change(orbit=[1, 1])
            self.assertNotIn(None, view.state()[0]["camera"]["position"])
            view.change(reset_camera=True)

    def test_a_port_that_is_taken_is_named(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = str(taken.getsockname()[1])
            run = self.crt("view", "scene.yaml", "-b", "fake", "--no-open", "--port", port, expect=2)
        self.assert_one_error(run, f"port {port}", "in use")

    def test_what_is_no_option_is_refused(self):
        for arguments, words in ((["--prot", "1"], "--port"), (["--port", "65536"], "65535"),
                                 (["--token", "short"], "16"), (["--tev", "here:"], "HOST:PORT")):
            run = self.crt("view", "scene.yaml", *arguments, expect=2)
            self.assert_one_error(run, words)
        self.assert_one_error(self.crt("view", "-", expect=2), "file")


class End(CliTest):
    def end(self, view, number):
        view.process.send_signal(number)
        self.assertEqual(view.process.wait(harness.PATIENCE_SECONDS), 0)
        said = view.process.stderr.read()
        for word in ("error", "warning", "terminate", "abort"):
            self.assertNotIn(word, said)

    def test_ctrl_c_ends_it_with_a_page_waiting(self):
        view = View(self, "-b", "fake")
        status, _ = view.wait_until_done()
        waiting = threading.Thread(target=self.wait_in_vain, args=(view, status["version"]))
        waiting.start()
        time.sleep(0.2)
        self.end(view, signal.SIGINT)
        waiting.join()

    def wait_in_vain(self, view, version):
        try:
            view.state(version)
        except OSError:
            pass

    def test_ctrl_c_ends_a_chunk_and_a_scene_that_take_long(self):
        view = View(self, "-b", "fake", "--set", "film.resolution=[400,300]", "--spp", "100000",
                    fault="slow")
        view.wait(lambda s: s.get("picture"))
        self.end(view, signal.SIGTERM)
        view = View(self, "-b", "fake", CRT_FAKE_SCENE_SECONDS="20")
        time.sleep(0.3)
        self.end(view, signal.SIGINT)


class Tev(CliTest):
    def receive(self, listener, packets):
        connection, _ = listener.accept()
        with connection, connection.makefile("rb") as stream:
            while length := stream.read(4):
                packets.append(stream.read(struct.unpack("<I", length)[0] - 4))

    def test_the_image_reaches_tev(self):
        packets = []
        with socket.create_server(("127.0.0.1", 0)) as listener:
            receiver = threading.Thread(target=self.receive, args=(listener, packets))
            receiver.start()
            view = View(self, "-b", "fake", "--spp", "4", "--tev", f"127.0.0.1:{listener.getsockname()[1]}")
            view.wait_until_done()
            view.wait(lambda s: "shows 'scene.yaml'" in s["tev"])
            time.sleep(0.5)
            view.process.terminate()
            receiver.join(20)
        self.assertEqual(packets[0], b"\x04\0scene.yaml\0" + struct.pack("<3i", 24, 16, 3) + b"R\0G\0B\0")
        values = packets[-1][-4 * 24 * 16 * 3:]
        self.crt("render", "scene.yaml", "-b", "fake", "--spp", "4", "-o", "a.pfm")
        width, height, expected = harness.read_pfm(self.path("a.pfm"))
        sent = struct.unpack(f"<{width * height * 3}f", values)
        # PFM has the bottom row first.
        rows = [expected[i:i + 3 * width] for i in range(0, len(expected), 3 * width)]
        self.assertEqual(sent, tuple(v for row in reversed(rows) for v in row))

    def test_a_tev_that_is_not_there_is_told(self):
        with socket.socket() as nobody:
            nobody.bind(("127.0.0.1", 0))
            view = View(self, "-b", "fake", "--tev", f"127.0.0.1:{nobody.getsockname()[1]}")
            status, _ = view.wait(lambda s: s["tev"])
        self.assertIn("cannot be reached", status["tev"])


def is_open(connection):
    """True if the other end has neither closed it nor sent anything."""
    connection.setblocking(False)
    try:
        connection.recv(1)
        return False
    except BlockingIOError:
        return True
    except ConnectionError:
        return False


def is_newer(status, than):
    """True if its picture was made after the other's."""
    return status["picture"]["number"] > than["picture"]["number"]


if __name__ == "__main__":
    harness.main(__doc__)
