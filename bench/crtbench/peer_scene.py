"""A scene of crt in terms that other renderers share: triangles per material in their orientation, spectra
on one grid of wavelengths, a field of view.
Reads what the Cornell box uses (tables, constants, quads, diffuse materials, one-sided area lights) and
refuses the rest.
"""

import math

import numpy as np

from . import scene_file
from .program import Failure

GRID_NM = np.arange(
    360.0, 833.0, 4.0
)  # Every node of the box's tables lies on it, so resampling them changes nothing.


def table(spectra, name):
    """A spectrum as {nm, value}, or a number. Values outside its table are clamped, and written out,
    since other renderers take zero there."""
    given = spectra.get(name, name) if isinstance(name, str) else name
    if isinstance(given, (int, float)):
        return float(given)
    if set(given) - {"table", "outside"} or given.get("outside") != "clamp":
        raise Failure(
            f"the spectrum '{name}' is not a table that is clamped outside, and nothing else is translated "
            f"for other renderers"
        )
    nm, value = (np.array(given["table"][key], dtype=np.float64) for key in ("nm", "value"))
    if not np.isin(nm, GRID_NM).all():
        raise Failure(
            f"the table of the spectrum '{name}' has nodes off the grid of 4 nm: resampling would change it"
        )
    return {"nm": GRID_NM.tolist(), "value": np.interp(GRID_NM, nm, value).tolist()}


def triangles(mesh):
    """Corners, shape (triangles, 3, 3): polygons as fans from their first corner, as crt splits them."""
    positions = np.array(mesh["positions"], dtype=np.float64)
    return np.array(
        [
            positions[[face[0], face[i], face[i + 1]]]
            for face in mesh["faces"]
            for i in range(1, len(face) - 1)
        ]
    )


def write_ply(path, corners):
    """Triangles that share no vertex: flat shading needs no normals then."""
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {3 * len(corners)}",
        "property float x",
        "property float y",
        "property float z",
        f"element face {len(corners)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in corners.reshape(-1, 3).tolist()]
    lines += [f"3 {3 * i} {3 * i + 1} {3 * i + 2}" for i in range(len(corners))]
    path.write_text("\n".join(lines) + "\n")


def describe(file, folder, size, max_depth):
    """The scene as Mitsuba's process wants it; meshes go to `folder`."""
    scene = scene_file.load(file)
    camera, spectra = scene["camera"], scene["spectra"]
    parts = {}
    for thing in scene["objects"]:
        material = scene["materials"][thing["material"]]
        if material["type"] != "diffuse" or set(thing) - {"name", "mesh", "material", "emission"}:
            raise Failure(
                f"the object '{thing['name']}' is more than a diffuse mesh, and nothing else is translated "
                f"for other renderers"
            )
        part = parts.setdefault(
            thing["material"], {"corners": [], "reflectance": table(spectra, material["reflectance"])}
        )
        part["corners"].append(triangles(thing["mesh"]))
        if "emission" in thing:
            part["radiance"] = table(spectra, thing["emission"]["radiance"])
    for name, part in parts.items():
        part["ply"] = str(folder / f"{name}.ply")
        write_ply(folder / f"{name}.ply", np.concatenate(part.pop("corners")))
    return {
        "position": camera["position"],
        "target": camera["target"],
        "up": camera["up"],
        "size": size,
        "max_depth": max_depth,
        "fov_degrees": math.degrees(2 * math.atan(camera["sensor"][0] / (2 * camera["focal_length"]))),
        "parts": parts,
    }
