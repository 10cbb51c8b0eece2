"""A scene of crt for renderers of three colours, which run in other processes: the scene that agree_scene
makes for Mitsuba, as numbers, names and arrays alone. Every spectrum becomes linear sRGB of the same
luminance."""

import mitsuba as mi
import numpy as np

from . import agree_scene
from .program import Failure

XYZ_TO_RGB = np.array([[3.2404542, -1.5371385, -0.4985314],
                       [-0.9692660, 1.8760108, 0.0415560],
                       [0.0556434, -0.2040259, 1.0572252]])
SAMPLES_NM = np.arange(360.0, 831.0)
PRIMARIES_NM = [611.4, 549.1, 464.3]   # Of sRGB: where an index of refraction is taken.
LIGHT, INDEX = {"radiance", "intensity", "irradiance"}, {"eta", "k"}
UV_FLIP = np.array([[1.0, 0, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])


def rgb_of(value):
    """Linear sRGB of a spectrum at SAMPLES_NM; one that is 1 everywhere has luminance 1."""
    matching = np.array(mi.cie1931_xyz(mi.Float(SAMPLES_NM))).reshape(3, -1)
    return XYZ_TO_RGB @ (matching @ value) / matching[1].sum()


def colour(key, given):
    """Of a light as it is seen, of a surface under white light, of an index at the primaries."""
    if given["type"] == "rgb":
        return list(map(float, given["value"]))
    if given["type"] == "uniform":
        nm, value = [0, 1e4], [given["value"]] * 2
    else:
        nm, value = ([float(v) for v in given[name].split(", ")] for name in ("wavelengths", "values"))
    if key in INDEX:
        return [float(v) for v in np.interp(PRIMARIES_NM, nm, value)]
    seen = rgb_of(np.interp(SAMPLES_NM, nm, value, left=0, right=0))
    if key not in LIGHT:
        seen = seen / rgb_of(np.ones_like(SAMPLES_NM))
    return [float(v) for v in np.maximum(seen, 0)]


def plain(key, value):
    """The same without objects of Mitsuba."""
    if isinstance(value, mi.ScalarTransform4f):
        return np.array(value.matrix, dtype=np.float64)
    if isinstance(value, dict):
        if value.get("type") in ("uniform", "irregular", "rgb"):
            return colour(key, value)
        return {name: plain(name, inner) for name, inner in value.items()}
    return value


def one_sided(bsdf):
    """Without `twosided`, which surfaces of these renderers are."""
    if "bsdf1" in bsdf:
        raise Failure("a material of two sides")
    return bsdf["bsdf0"] if bsdf["type"] == "twosided" else bsdf


def placements(bsdf):
    """The transforms of texture coordinates in a material, upwards in the image."""
    for value in bsdf.values():
        if isinstance(value, dict):
            yield from placements(value)
    if "to_uv" in bsdf:
        yield UV_FLIP @ bsdf["to_uv"] if bsdf["type"] == "bitmap" else bsdf["to_uv"]


def part(given):
    """The triangles of a shape in the world, its material and what it emits. Texture coordinates are as the
    textures take them."""
    shape = mi.load_dict({k: v for k, v in given.items() if k not in ("bsdf", "emitter")})
    arrays = mi.traverse(shape)

    def rows(name, width):
        found = np.array(arrays[name] if name in arrays else [], dtype=np.float32)
        return found.reshape(-1, width) if found.size else None

    bsdf = one_sided(plain("bsdf", given["bsdf"]))
    uvs, placed = rows("vertex_texcoords", 2), list(placements(bsdf))
    if placed and uvs is not None:
        if any(not np.allclose(other, placed[0]) for other in placed):
            raise Failure("a material whose textures are placed differently")
        uvs = uvs @ placed[0][:2, :2].T.astype(np.float32) + placed[0][:2, 3].astype(np.float32)
    return {
        "positions": rows("vertex_positions", 3),
        "normals": None if given.get("face_normals") else rows("vertex_normals", 3),
        "uvs": uvs,
        "faces": np.array(arrays["faces"], dtype=np.int32).reshape(-1, 3),
        "bsdf": bsdf,
        "emission": colour("radiance", given["emitter"]["radiance"]) if "emitter" in given else None,
    }


def describe(file, folder, meshes, size):
    """Camera, depth, environment and parts; square, `size` pixels a side."""
    given = agree_scene.translate(file, folder, 1, meshes=meshes)
    if any(name.startswith("light") for name in given):
        raise Failure("a light that is no surface")
    return {
        "size": size,
        "fov_deg": given["sensor"]["fov"],
        "camera": plain("to_world", given["sensor"]["to_world"]),
        "depth": given["integrator"]["max_depth"] - 1,   # Scattering events.
        "environment": plain("environment", given.get("environment")),
        "parts": [part(thing) for name, thing in given.items() if name.startswith("object")],
    }


def luminance(rgb):
    return rgb[:, :, :3].astype(np.float64) @ np.linalg.inv(XYZ_TO_RGB)[1]
