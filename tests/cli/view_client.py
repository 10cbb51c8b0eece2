"""A `crt view` that a test starts, and what a page of it would ask."""

import json
import struct
import time
import urllib.error
import urllib.parse
import urllib.request

import harness
from harness import PATIENCE_SECONDS

TOKEN = "0123456789abcdefghij"


class View:
    """Of the scene.yaml of a test, at a free port unless one is given."""

    # The program reads files again that changed so shortly before it read them (file_times.cpp).
    SETTLING_SECONDS = 0.03

    def __init__(self, test, *arguments, port=0, **start):
        time.sleep(self.SETTLING_SECONDS)
        self.process = test.start("view", "scene.yaml", "--no-open", "--port", str(port), "--token", TOKEN,
                                  *arguments, **start)
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise AssertionError(f"no address: {self.process.stderr.read()}")
        self.base = self.address.split("/?")[0]
        self.port = int(self.base.rsplit(":", 1)[1])

    def url(self, path, **query):
        return f"{self.base}{path}?" + urllib.parse.urlencode({**query, "token": TOKEN})

    def get(self, path, **query):
        with urllib.request.urlopen(self.url(path, **query), timeout=PATIENCE_SECONDS) as reply:
            return reply.read()

    def json(self, path, **query):
        return json.loads(self.get(path, **query))

    def state(self, after=0):
        """The status, and the picture's bytes [height][width][4]."""
        reply = self.get("/sight", after=after, picture=0)
        (length,) = struct.unpack_from("<I", reply)
        return json.loads(reply[4:4 + length]), reply[4 + length:]

    def change(self, **wish):
        return self.changes(wish)

    def changes(self, wishes, **query):
        """One change or a list of them; with page= and first=, as a page numbers them."""
        request = urllib.request.Request(self.url("/change", **query), json.dumps(wishes).encode(),
                                         method="POST")
        with urllib.request.urlopen(request, timeout=PATIENCE_SECONDS) as reply:
            return json.loads(reply.read())

    def download(self, path):
        """The name that a browser gives the file, and its bytes."""
        with urllib.request.urlopen(self.url(path), timeout=PATIENCE_SECONDS) as reply:
            name = reply.headers["Content-Disposition"].split('filename="')[1].rstrip('"')
            return name, reply.read()

    def wait(self, condition, what="what was waited for"):
        """The first state whose status is as wanted, and its picture."""
        end = time.monotonic() + PATIENCE_SECONDS
        status, pixels = self.state()
        while not condition(status):
            if time.monotonic() > end:
                raise AssertionError(f"{what} did not come: {status}")
            status, pixels = self.state(status["version"])
        return status, pixels

    def wait_until_done(self):
        return self.wait(is_done, "the last sample")

    def refused(self, **headers):
        """The status with which the page itself is refused."""
        token = headers.pop("token", TOKEN)
        request = urllib.request.Request(f"{self.base}/?token={token}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_SECONDS) as reply:
                return reply.status
        except urllib.error.HTTPError as error:
            with error:
                return error.code


def is_done(status):
    """True if the picture has all samples of the whole film, from the place of the camera."""
    picture = status.get("picture")
    return (bool(picture) and picture["divisor"] == 1 and picture["of_this_camera"]
            and status["samples"] == status["samples_wanted"] and picture["samples"] == status["samples"])


def ppm_pixels(path):
    """[height][width][3] of a PPM that crt wrote."""
    content = harness.read_bytes(path)
    kind, size, most, pixels = content.split(b"\n", 3)
    assert (kind, most) == (b"P6", b"255"), content[:20]
    width, height = map(int, size.split())
    assert len(pixels) == 3 * width * height
    return pixels


def without_alpha(rgba):
    return b"".join(rgba[i:i + 3] for i in range(0, len(rgba), 4))
