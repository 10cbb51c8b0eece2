#!/usr/bin/env python3
"""Writes configs/shared/forest_places.yaml: where the plants of configs/forest.yaml stand.

    scripts/place_forest.py [BUILD_DIR]      its meshes must be built; by default build/release

The ground is share/crt/meshes/terrain.ply of the build, as large as EXTENT says. The same bytes every time.
"""

import bisect
import math
import pathlib
import random
import struct
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
EXTENT = 160.0  # metres, as forest.yaml scales the ground
CAMERA = (-0.5, -74.0)  # x and z
VIEW = (3.0, 34.0)  # the way it looks
GLADE_Z = -50.0
HALF_VIEW_DEG = 37.5
HEAD = """\
# Where the plants of forest.yaml stand: written by scripts/place_forest.py, not by hand.
crt: 1
objects:
"""


class Ground:
    """The heights of terrain.ply, linear between."""

    def __init__(self, path):
        head, body = path.read_bytes().split(b"end_header\n", 1)
        count = int(head.split(b"element vertex ")[1].split()[0])
        self.side = math.isqrt(count)
        self.heights = [struct.unpack_from("<3f", body, 27 * i)[1] for i in range(count)]

    def height(self, x, z):
        u, v = ((t / EXTENT + 0.5) * (self.side - 1) for t in (x, z))
        i, j = (min(max(int(t), 0), self.side - 2) for t in (u, v))
        near, far = (self.heights[k * self.side + i:][:2] for k in (j, j + 1))
        u, v = u - i, v - j
        return EXTENT * ((1 - v) * ((1 - u) * near[0] + u * near[1]) + v * ((1 - u) * far[0] + u * far[1]))


def trail(z):
    """Its x, as configs/meshgen/terrain.cpp has it."""
    t = z / EXTENT + 0.5
    return EXTENT * (0.022 * math.sin(math.radians(1000 * t)) + 0.03 * t * t)


def is_in_glade(x, z, margin):
    """Open ground before the camera."""
    return ((x - trail(GLADE_Z)) / (15 + margin)) ** 2 + ((z - GLADE_Z) / (27 + margin)) ** 2 < 1


def is_near_view(x, z, margin):
    """True if it is visible, or less than `margin` metres beside what is."""
    dx, dz = x - CAMERA[0], z - CAMERA[1]
    size = math.hypot(*VIEW)
    ahead, beside = (dx * VIEW[0] + dz * VIEW[1]) / size, (dx * VIEW[1] - dz * VIEW[0]) / size
    return abs(beside) < max(ahead, 0) * math.tan(math.radians(HALF_VIEW_DEG)) + margin


class Wood:
    """Places that keep apart."""

    def __init__(self):
        self.places = []  # (z, x, radius), by z

    def is_free(self, x, z, radius):
        first = bisect.bisect_left(self.places, (z - 2 * 8,))
        for pz, px, pr in self.places[first:]:
            if pz > z + 2 * 8:
                return True
            if math.hypot(px - x, pz - z) < radius + pr:
                return False
        return True

    def add(self, x, z, radius):
        bisect.insort(self.places, (z, x, radius))


def placed(rng, ground, wood, tries, near, far, margin, trail_distance, radius, size, sink, glade=None):
    """A line each for those of `tries` random places that are free."""
    lines = []
    for _ in range(tries):
        z = rng.uniform(near, far)
        x = rng.uniform(-0.49, 0.49) * EXTENT
        scale, angle, own = size(rng), rng.randrange(360), radius(rng)
        if not is_near_view(x, z, margin) or abs(x - trail(z)) < trail_distance:
            continue
        if glade is not None and is_in_glade(x, z, glade) or not wood.is_free(x, z, own):
            continue
        wood.add(x, z, own)
        y = ground.height(x, z) - sink * scale
        steps = (f"{{scale: {scale:.2f}}}, {{rotate: {{axis: [0, 1, 0], angle_deg: {angle}}}}}, "
                 f"{{translate: [{x:.2f}, {y:.2f}, {z:.2f}]}}")
        lines.append((z, f"      - [{steps}]"))
    return [line for _, line in sorted(lines)]


def object_of(name, mesh, leaves, lines):
    bark = {"fern": "bark: {material: stems}, ", "grass": ""}.get(mesh, "bark: {material: bark}, ")
    parts = f"{{{bark}leaves: {{material: {leaves}}}}}"
    keys = f"  - name: {name}\n    obj: {mesh}.obj\n    parts: {parts}\n    share: always\n    transforms:\n"
    return keys + "\n".join(lines) + "\n"


def main():
    build = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/release"
    ground = Ground(build / "share/crt/meshes/terrain.ply")
    rng, wood = random.Random(5), Wood()
    tall = lambda r: r.uniform(1.5, 2.3)
    common = dict(rng=rng, ground=ground, wood=wood)
    # Radii keep plants apart; sizes are heights, of which `sink` is below ground; `glade` is how far beyond
    # the glade's edge it begins, all in metres.
    firs = placed(**common, tries=480, near=-84, far=45, margin=9, trail_distance=4.5, radius=tall,
                  size=lambda r: r.uniform(13, 25), sink=0.004, glade=1)
    beeches = placed(**common, tries=560, near=-84, far=45, margin=9, trail_distance=4.5, radius=tall,
                     size=lambda r: r.uniform(12, 19), sink=0.004, glade=0)
    birches = placed(**common, tries=560, near=-84, far=45, margin=9, trail_distance=3.5, radius=tall,
                     size=lambda r: r.uniform(7, 12), sink=0.004, glade=-3)
    bushes = placed(**common, tries=420, near=-66, far=20, margin=2, trail_distance=3.4,
                    radius=lambda r: r.uniform(0.5, 1.0), size=lambda r: r.uniform(1.2, 3.0), sink=0.31,
                    glade=-4)
    seedlings = placed(**common, tries=350, near=-66, far=20, margin=2, trail_distance=3.2,
                       radius=lambda r: r.uniform(0.5, 0.9), size=lambda r: r.uniform(1.0, 5.0), sink=0.04,
                       glade=-5)
    ferns = placed(**common, tries=1500, near=-70, far=-10, margin=1, trail_distance=1.7,
                   radius=lambda r: r.uniform(0.2, 0.5), size=lambda r: r.uniform(0.25, 0.65), sink=0.02)
    # Ferns and bushes stand in the grass.
    turf = placed(**{**common, "wood": Wood()}, tries=11000, near=-72, far=-22, margin=1, trail_distance=1.9,
                  radius=lambda r: r.uniform(0.36, 0.5), size=lambda r: r.uniform(0.22, 0.40), sink=0.1)
    objects = [
        ("firs", "conifer", "needles", firs + seedlings),
        ("beeches", "broadleaf", "leaves", beeches + bushes),
        ("birches", "broadleaf", "pale leaves", birches),
        ("ferns", "fern", "fronds", ferns),
        ("turf", "grass", "grass", turf),
    ]
    text = HEAD + "".join(object_of(*row) for row in objects)
    (ROOT / "configs/shared/forest_places.yaml").write_text(text)
    print(", ".join(f"{len(lines)} {name}" for name, _, _, lines in objects))


if __name__ == "__main__":
    main()
