"""Meshes of shapes that crt has not as they are: stretched spheres, parts of disks, patches."""

import numpy as np

SEGMENTS = 96  # Around a full circle: the outline is within 0.06 % of the radius.


def grid(columns, rows):
    """Faces of a net of (rows + 1) × (columns + 1) vertices, row by row."""
    corner = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    return np.stack([corner, corner + 1, corner + columns + 2, corner + columns + 1], -1).reshape(-1, 4)


def net(u, v):
    u, v = np.meshgrid(u, v)
    return u.reshape(-1), v.reshape(-1)


def triangles(mesh):
    """The mesh with its quads as triangles and without those of no area, which poles have."""
    faces = np.concatenate([mesh["faces"][:, [0, 1, 2]], mesh["faces"][:, [0, 2, 3]]])
    corners = mesh["positions"][faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return mesh | {"faces": faces[area > 1e-12 * area.max()]}


def sphere(radius, low=-1.0, high=1.0, phi_max=360.0):
    """From the height `low` to `high`, both in radii; normals point outwards."""
    columns = max(3, round(SEGMENTS * phi_max / 360))
    u, v = net(np.linspace(0, 1, columns + 1), np.linspace(0, 1, SEGMENTS // 2 + 1))
    theta = np.arccos(low) + v * (np.arccos(high) - np.arccos(low))
    phi = np.radians(phi_max) * u
    normals = np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)], -1)
    return triangles({"positions": radius * normals, "faces": grid(columns, SEGMENTS // 2),
                      "normals": normals, "uvs": np.stack([u, v], -1)})


def cylinder(radius, low, high, phi_max=360.0):
    """Without ends; normals point outwards."""
    columns = max(3, round(SEGMENTS * phi_max / 360))
    u, v = net(np.linspace(0, 1, columns + 1), np.array([0.0, 1.0]))
    phi = np.radians(phi_max) * u
    normals = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], -1)
    positions = radius * normals + np.outer(low + v * (high - low), [0, 0, 1])
    return triangles({"positions": positions, "faces": grid(columns, 1), "normals": normals,
                      "uvs": np.stack([u, v], -1)})


def disk(radius, inner=0.0, phi_max=360.0, height=0.0):
    """A ring, seen from z; of texture coordinates u goes around and v inwards."""
    columns = max(3, round(SEGMENTS * phi_max / 360))
    u, v = net(np.linspace(0, 1, columns + 1), np.array([0.0, 1.0]))
    phi = np.radians(phi_max) * u
    away = inner + v * (radius - inner)
    positions = np.stack([away * np.cos(phi), away * np.sin(phi), np.full_like(phi, height)], -1)
    faces = grid(columns, 1)[:, ::-1]
    return triangles({"positions": positions, "faces": np.ascontiguousarray(faces),
                      "uvs": np.stack([u, 1 - v], -1)})


def rectangle(low=-1.0, high=1.0):
    corners = np.array([[low, low, 0], [high, low, 0], [high, high, 0], [low, high, 0]], float)
    return {"positions": corners, "faces": np.array([[0, 1, 2, 3]]),
            "uvs": np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)}


def cube():
    """From -1 to 1; each side has all of a texture."""
    square = rectangle()["positions"] + [0, 0, 1]
    turns = [np.eye(3), np.diag([1, -1, -1]), np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
             np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
             np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])]
    return {"positions": np.concatenate([square @ np.array(turn, float).T for turn in turns]),
            "faces": np.arange(24).reshape(6, 4), "uvs": np.tile(rectangle()["uvs"], (6, 1))}


def flipped(mesh):
    """The same surface with its front at the back."""
    made = mesh | {"faces": np.ascontiguousarray(np.asarray(mesh["faces"])[:, ::-1])}
    if mesh.get("normals") is not None:
        made["normals"] = -np.asarray(mesh["normals"])
    return made


def area(mesh, matrix):
    """In the world."""
    positions = np.asarray(mesh["positions"], float) @ matrix[:3, :3].T
    faces = np.asarray(mesh["faces"])
    fans = [faces[:, [0, i, i + 1]] for i in range(1, faces.shape[1] - 1)]
    corners = positions[np.concatenate(fans)]
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                                axis=1).sum() / 2)
