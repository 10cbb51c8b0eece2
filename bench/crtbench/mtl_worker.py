"""One OBJ with its MTL in Mitsuba 3, by a reading of both files that shares nothing with crt: every face
flat and diffuse with Kd, an area light where Ke is not black, numbers taken as linear sRGB, nothing else
read. Runs under a Python that has mitsuba and numpy.

    mtl_worker.py VARIANT OBJ MTL SAMPLES SEED IMAGE.npy VIEW

VIEW is JSON: position, target, fov, size, max_depth; also environment, the radiance of light from
everywhere, and picture, the name of a PNG. The image is CIE Y."""

import collections
import json
import math
import pathlib
import sys
import tempfile


def name_of(line):
    """The text after the first word: names may hold spaces."""
    return line.split(None, 1)[1].strip()


def statements(path):
    """{name of a material: {keyword: [number, …]}}; keywords with other arguments have no numbers."""
    found, current = {}, None
    for line in path.read_text(errors="replace").splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["newmtl"]:
            current = found.setdefault(name_of(line), {})
        elif words and current is not None:
            try:
                current[words[0]] = [float(w) for w in words[1:]]
            except ValueError:
                current[words[0]] = []
    return found


def materials(path):
    """{name: {"Kd": [r, g, b], "Ke": …}}"""
    return {
        name: {key: numbers[:3] for key, numbers in said.items() if key in ("Kd", "Ke")}
        for name, said in statements(path).items()
    }


def not_diffuse(said):
    """The reason why a material is not opaque and diffuse, or nothing. A white Tf filters no light and is
    written for
    opaque surfaces (3ds Max, Maya); `illum 4` is what Maya writes for all surfaces."""

    def first(keyword, unstated):
        return (said.get(keyword) or [unstated])[0]

    if first("Ni", 1) > 1 and first("d", 1 - first("Tr", 0)) < 1:
        return "light passes (d, Tr)"
    if first("Ni", 1) > 1 and said.get("Tf", [1, 1, 1]) not in ([1, 1, 1], [0, 0, 0]):
        return "light passes (Tf)"
    if first("Ni", 1) > 1 and first("illum", 2) in (6, 7, 9):
        return "light passes (illum)"
    if first("Pm", 0) > 0:
        return "a metal (Pm)"
    if first("illum", 2) in (3, 5, 8):
        return "a mirror (illum)"
    if not any(said.get("Ke", [])) and len(said.get("Kd", [])) != 3:
        return "no Kd"
    return None


def faces_by_material(path):
    """(vertices, {material: [[index from 0, …]]}), coordinates as text. The material is None before the
    first usemtl."""
    vertices, faces, material = [], collections.defaultdict(list), None
    for line in path.read_text(errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["usemtl"]:
            material = name_of(line)
        elif words[:1] == ["f"]:
            corners = [int(w.split("/")[0]) for w in words[1:]]
            faces[material].append([c - 1 if c > 0 else len(vertices) + c for c in corners])
    return vertices, faces


def split(polygon):
    """Polygons that Mitsuba reads, which has triangles and quadrangles: others as fans."""
    if len(polygon) <= 4:
        return [polygon]
    return [[polygon[0], polygon[i], polygon[i + 1]] for i in range(1, len(polygon) - 1)]


def part_of_obj(vertices, polygons):
    """An OBJ of these faces alone."""
    pieces = [piece for polygon in polygons for piece in split(polygon)]
    return "".join(f"v {' '.join(v)}\n" for v in vertices) + "".join(
        f"f {' '.join(str(c + 1) for c in piece)}\n" for piece in pieces
    )


def main():
    variant, obj, mtl, samples, seed, image, view = sys.argv[1:]
    view = json.loads(view)
    import mitsuba as mi
    import numpy as np
    mi.set_variant(variant)
    distance = math.dist(view["position"], view["target"])
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": view["max_depth"] + 1, "rr_depth": 1_000_000},
        "sensor": {
            "type": "perspective",
            "fov": view["fov"],
            "near_clip": min(0.01, distance / 1000),
            "far_clip": max(10_000, distance * 1000),
            "to_world": mi.ScalarTransform4f().look_at(
                origin=view["position"], target=view["target"], up=[0, 1, 0]
            ),
            "film": {
                "type": "hdrfilm",
                "width": view["size"],
                "height": view["size"],
                "pixel_format": "xyz",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent", "sample_count": int(samples)},
        },
    }
    if "environment" in view:
        scene["environment"] = {
            "type": "constant", "radiance": {"type": "rgb", "value": [view["environment"]] * 3}
        }
    found = materials(pathlib.Path(mtl))
    vertices, faces = faces_by_material(pathlib.Path(obj))
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, polygons) in enumerate(faces.items()):
            part = pathlib.Path(folder) / f"{number}.obj"
            part.write_text(part_of_obj(vertices, polygons))
            shape = {
                "type": "obj",
                "filename": str(part),
                "face_normals": True,
                "bsdf": {
                    "type": "twosided",
                    "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": found[name]["Kd"]}},
                },
            }
            if any(found[name].get("Ke", [])):
                shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": found[name]["Ke"]}}
            scene[f"part{number}"] = shape
        loaded = mi.load_dict(scene)
    rendered = np.array(mi.render(loaded, spp=int(samples), seed=int(seed)))
    np.save(image, rendered[:, :, 1])
    if "picture" in view:
        bitmap = mi.Bitmap(rendered, mi.Bitmap.PixelFormat.XYZ)
        bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True).write(view["picture"])
    print(json.dumps({"mitsuba": mi.__version__}))


if __name__ == "__main__":
    main()
