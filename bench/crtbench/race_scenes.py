"""The scenes of `race` and `mitsuba-speed`, and the files of them that no repository holds."""

import math

import mitsuba as mi
import numpy as np

from .agree import write_normals, write_picture, write_sky
from .program import Failure

RACE, SPEED = "bench/scenes/race", "bench/scenes/mitsuba_speed"
SUN_CONTRAST = 1e4


def write_sun(path):
    """A grey sky over dark ground, and a sun of 1.4 degrees, SUN_CONTRAST times as bright as the sky."""
    v, u = (np.mgrid[0:512, 0:1024] + 0.5) / 1024
    rgb = np.where(v < 0.25, 1.0, 0.1)[:, :, None] * np.array([0.8, 0.9, 1.0])
    sun = (u - 0.62) ** 2 + (v - 0.13) ** 2 < 0.002**2
    rgb[sun] = SUN_CONTRAST * np.array([1.0, 0.95, 0.9])
    mi.Bitmap(rgb.astype(np.float32)).write(str(path))


def write_ball(path, segments=64, rings=32):
    """A sphere of radius 1 with its normals, 2 · segments · (rings - 1) triangles."""
    lines = []
    for ring in range(rings + 1):
        polar = math.pi * ring / rings
        for segment in range(segments):
            around = 2 * math.pi * segment / segments
            place = (math.sin(polar) * math.cos(around), math.cos(polar), math.sin(polar) * math.sin(around))
            text = " ".join(f"{x:.9g}" for x in place)
            lines += [f"v {text}", f"vn {text}"]

    def corner(ring, segment):
        number = 1 + ring * segments + segment % segments
        return f"{number}//{number}"

    for ring in range(rings):
        for segment in range(segments):
            a, b = corner(ring, segment), corner(ring, segment + 1)
            c, d = corner(ring + 1, segment + 1), corner(ring + 1, segment)
            if ring > 0:
                lines.append(f"f {a} {b} {c}")
            if ring < rings - 1:
                lines.append(f"f {a} {c} {d}")
    path.write_text("\n".join(lines) + "\n")


def write_inputs(folder):
    write_picture(folder / "picture.png")
    write_normals(folder / "normals.png")
    write_sky(folder / "sky.exr")
    write_sun(folder / "sun.exr")
    write_ball(folder / "smooth_ball.obj")


def files_of(program, folders, only):
    """Those of the folders, or only some by name."""
    files = [f for folder in folders for f in sorted((program.repository / folder).glob("*.yaml"))]
    if unknown := set(only or []) - {f.stem for f in files}:
        raise Failure(f"there is no scene {sorted(unknown)[0]} in {' or '.join(folders)}")
    return [f for f in files if not only or f.stem in only]
