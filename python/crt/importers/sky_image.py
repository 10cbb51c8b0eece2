"""Environment images in crt's layout: longitudes by latitudes, the zenith y at the top, the middle -z."""

import math

import numpy as np


def directions(rows):
    """Of the pixels of crt's image of `rows` rows: (rows, 2 rows, 3)."""
    theta = (np.arange(rows) + 0.5)[:, None] * math.pi / rows
    phi = (np.arange(2 * rows) + 0.5)[None, :] * math.pi / rows
    return np.stack([-np.sin(phi) * np.sin(theta), np.cos(theta) * np.ones_like(phi),
                     np.cos(phi) * np.sin(theta)], -1)


def about_y(matrix):
    """The angle in degrees of a turn about y, counter-clockwise seen from above; None for what is more than
    such a turn."""
    linear = matrix[:3, :3]
    angle = math.atan2(linear[0, 2], linear[2, 2])
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    return math.degrees(angle) if np.allclose(linear, turn, atol=1e-6) else None


def local(matrix, mirrored, rows):
    """Directions of crt's pixels as the other program's image sees them."""
    world = directions(rows)
    if mirrored:
        world = world * [-1, 1, 1]
    linear = matrix[:3, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
    found = world @ np.linalg.inv(linear).T
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def looked_up(pixels, u, v, wrap_u):
    """Bilinear, from 0 to 1 in both; `wrap_u`: columns go around."""
    height, width = pixels.shape[:2]
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[..., None], (y - y0)[..., None]
    def column(c):
        return c % width if wrap_u else np.clip(c, 0, width - 1)

    def row(r):
        return np.clip(r, 0, height - 1)
    upper = pixels[row(y0), column(x0)] * (1 - fx) + pixels[row(y0), column(x0 + 1)] * fx
    lower = pixels[row(y0 + 1), column(x0)] * (1 - fx) + pixels[row(y0 + 1), column(x0 + 1)] * fx
    return (upper * (1 - fy) + lower * fy).astype(np.float32)


def turned(pixels, matrix, mirrored):
    """Mitsuba's image, under its transform, in crt's layout."""
    d = local(matrix, mirrored, min(pixels.shape[0], 2048))
    u = np.arctan2(d[..., 0], -d[..., 2]) / (2 * math.pi) % 1
    return looked_up(pixels, u, np.arccos(np.clip(d[..., 1], -1, 1)) / math.pi, True)


def unfolded(pixels, matrix, mirrored):
    """pbrt's image, a square that is folded to a sphere (Clarberg 2008), under its transform, in crt's
    layout."""
    d = local(matrix, mirrored, min(max(pixels.shape[0] // 2, 2), 2048))
    x, y, z = np.abs(d[..., 0]), np.abs(d[..., 1]), np.abs(d[..., 2])
    radius = np.sqrt(np.clip(1 - z, 0, 1))
    phi = np.arctan2(y, x) * 2 / math.pi
    v = phi * radius
    u = radius - v
    below = d[..., 2] < 0
    u, v = np.where(below, 1 - v, u), np.where(below, 1 - u, v)
    u, v = np.copysign(u, d[..., 0]), np.copysign(v, d[..., 1])
    return looked_up(pixels, (u + 1) / 2, (v + 1) / 2, False)
