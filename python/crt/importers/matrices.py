"""Transforms as arrays of shape (4, 4), float64; points are columns."""

import math

import numpy as np


def identity():
    return np.eye(4)


def translation(x, y, z):
    made = np.eye(4)
    made[:3, 3] = x, y, z
    return made


def scaling(x, y, z):
    return np.diag([x, y, z, 1.0])


def rotation(axis, degrees):
    """Counter-clockwise when the axis points at the viewer. An axis of length 0 turns nothing."""
    axis = np.asarray(axis, float)
    length = np.linalg.norm(axis)
    made = np.eye(4)
    if length == 0:
        return made
    x, y, z = axis / length
    angle = math.radians(degrees)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    made[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return made


def unit(vector):
    """Of length 1; None where the length is 0 or not finite."""
    vector = np.asarray(vector, float)
    length = np.linalg.norm(vector)
    return vector / length if 0 < length < math.inf else None


def frame(origin, target, up, *, left_handed):
    """From a camera's coordinates, y up and z forward, to the world's. In a right-handed frame x points to
    the left, as in Mitsuba; in a left-handed one to the right, as in pbrt. None where the vectors fix no
    frame."""
    forward = unit(np.subtract(target, origin))
    side = None if forward is None else unit(np.cross(up, forward))
    if side is None:
        return None
    made = np.eye(4)
    made[:3, 0], made[:3, 1], made[:3, 2], made[:3, 3] = side, np.cross(forward, side), forward, origin
    return made


def point(matrix, where):
    return matrix[:3, :3] @ np.asarray(where, float) + matrix[:3, 3]


def vector(matrix, which):
    return matrix[:3, :3] @ np.asarray(which, float)


def is_usable(matrix):
    """Is it finite, affine and invertible?"""
    if not np.isfinite(matrix).all() or np.abs(matrix[3] - [0, 0, 0, 1]).max() > 1e-5:
        return False
    linear = matrix[:3, :3]
    size = np.abs(linear).max()
    return bool(size > 0 and abs(np.linalg.det(linear / size)) > 1e-12)


def uniform_scale(matrix):
    """The factor of a matrix that turns, moves, mirrors and scales but does not stretch, else None."""
    linear = matrix[:3, :3]
    square = linear.T @ linear
    factor = math.sqrt(max(np.trace(square) / 3, 0))
    return factor if np.abs(square - factor**2 * np.eye(3)).max() <= 1e-6 * factor**2 else None


def numbers(array):
    """Rows of numbers as a list, rounded to 12 digits, without -0."""
    return [float(f"{value:.12g}") + 0.0 for value in np.asarray(array, float).reshape(-1)]
