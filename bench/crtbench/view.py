"""Measures `crt view`: the time from its start to the first picture and to the first whole one;
pictures a second while the image converges, and while a hand turns the camera.

    bench/run view                                  the Cornell box at 1280 x 720 by the best backend
    bench/run view --backend embree --threads 2 --seconds 20 configs/cornell_dragon.yaml

Pictures are fetched as a page fetches them, one after another; no browser takes part.
"""

import json
import os
import pathlib
import struct
import subprocess
import threading
import time
import urllib.parse
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]


class View:
    def __init__(self, arguments):
        options = ["--set", f"film.resolution=[{arguments.size.replace('x', ',')}]", "--spp", "1000000"]
        for name in ("backend", "device", "threads"):
            if getattr(arguments, name):
                options += ["--" + name, getattr(arguments, name)]
        self.started = time.monotonic()
        self.process = subprocess.Popen(
            [arguments.crt, "view", arguments.scene, "--no-open", "-q", *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        address = urllib.parse.urlsplit(self.process.stdout.readline().strip())
        self.base = f"http://{address.netloc}"
        self.token = urllib.parse.parse_qs(address.query)["token"][0]
        self.version = self.picture = 0

    def url(self, path, **query):
        return f"{self.base}{path}?" + urllib.parse.urlencode({**query, "token": self.token})

    def change(self, **wish):
        body = json.dumps(wish).encode()
        request = urllib.request.Request(self.url("/change"), body, method="POST")
        with urllib.request.urlopen(request) as reply:
            reply.read()

    def next_picture(self, until=float("inf")):
        """The status with the next picture; nothing after that time."""
        while time.monotonic() < until:
            newer = self.url("/sight", after=self.version, picture=self.picture)
            with urllib.request.urlopen(newer) as reply:
                content = reply.read()
            (length,) = struct.unpack_from("<I", content)
            status = json.loads(content[4:4 + length])
            if status["scene_error"] or status["render_error"]:
                raise SystemExit(status["scene_error"] or status["render_error"])
            self.version = status["version"]
            if len(content) > 4 + length:
                self.picture = status["picture"]["number"]
                return status
        return None


def count_pictures(view, seconds):
    """Pictures a second, their divisors, and the last status."""
    start = time.monotonic()
    divisors, last = [], None
    while status := view.next_picture(start + seconds):
        divisors.append(status["picture"]["divisor"])
        last = status
    return len(divisors) / (time.monotonic() - start), divisors, last


def turn(view, seconds):
    """Turns the camera 60 times a second, as a hand does."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        before = time.monotonic()
        view.change(orbit=[0.01, 0])
        time.sleep(max(0, 1 / 60 - (time.monotonic() - before)))


def options(parser):
    parser.add_argument("scene", nargs="?", default=str(ROOT / "configs" / "cornell_box.yaml"))
    parser.add_argument("--crt", default=str(ROOT / "build" / "release" / "bin" / "crt"))
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--backend")
    parser.add_argument("--device")
    parser.add_argument("--threads")
    parser.add_argument("--seconds", type=float, default=10, help="of each of the two counts (10)")


def alone(arguments):
    view = View(arguments)
    try:
        print(f"address printed after {time.monotonic() - view.started:.2f} s")
        status = view.next_picture()
        divisor = status["picture"]["divisor"]
        print(f"first picture after {time.monotonic() - view.started:.2f} s, at 1/{divisor}")
        while status["picture"]["divisor"] > 1:
            status = view.next_picture()
        print(f"whole picture after {time.monotonic() - view.started:.2f} s")
        rate, _, last = count_pictures(view, arguments.seconds)
        print(f"converging: {rate:.1f} pictures/s at {arguments.size}, {last['samples']} samples per pixel, "
              f"{last['paths_per_second'] / 1e6:.2f} Mpaths/s, {last['backend']} on {last['device']}"
              if last else "converging: no picture in this time")
        hand = threading.Thread(target=turn, args=(view, arguments.seconds))
        hand.start()
        rate, divisors, _ = count_pictures(view, arguments.seconds)
        hand.join()
        sizes = ", ".join(f"1/{d}: {divisors.count(d)}" for d in sorted(set(divisors)))
        print(f"turning: {rate:.1f} pictures/s; pictures by size: {sizes}")
    finally:
        view.process.terminate()
        view.process.wait()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
