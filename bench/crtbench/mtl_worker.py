"""One OBJ with its MTL in Mitsuba 3, by a reading of both files that shares nothing with crt: every face
diffuse with Kd, an area light where Ke is not
black, numbers taken as linear sRGB, nothing else read. Runs under a Python that has mitsuba and numpy.

    mtl_worker.py VARIANT OBJ MTL SAMPLES SEED IMAGE.npy \
        '{"position": …, "target": …, "fov": …, "size": …, "max_depth": …}'

The image is CIE Y."""

import collections
import json
import pathlib
import sys
import tempfile


def materials(path):
    """{name: {"Kd": [r, g, b], "Ke": …}}"""
    found, current = {}, None
    for line in path.read_text().splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["newmtl"]:
            current = found.setdefault(words[1], {})
        elif words[:1] and words[0] in ("Kd", "Ke"):
            current[words[0]] = [float(w) for w in words[1:4]]
    return found


def faces_by_material(path):
    """(vertices, {material: [[index from 0, …]]})"""
    vertices, faces, material = [], collections.defaultdict(list), None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["usemtl"]:
            material = words[1]
        elif words[:1] == ["f"]:
            corners = [int(w.split("/")[0]) for w in words[1:]]
            faces[material].append([c - 1 if c > 0 else len(vertices) + c for c in corners])
    return vertices, faces


def main():
    variant, obj, mtl, samples, seed, image, view = sys.argv[1:]
    view = json.loads(view)
    import mitsuba as mi
    import numpy as np
    mi.set_variant(variant)
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": view["max_depth"] + 1, "rr_depth": 1_000_000},
        "sensor": {
            "type": "perspective",
            "fov": view["fov"],
            "near_clip": 0.01,
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
    found = materials(pathlib.Path(mtl))
    vertices, faces = faces_by_material(pathlib.Path(obj))
    with tempfile.TemporaryDirectory() as folder:
        for name, polygons in faces.items():
            part = pathlib.Path(folder) / f"{name}.obj"
            part.write_text(
                "".join(f"v {' '.join(v)}\n" for v in vertices)
                + "".join(f"f {' '.join(str(c + 1) for c in p)}\n" for p in polygons)
            )
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
            scene[name] = shape
        loaded = mi.load_dict(scene)
    np.save(image, np.array(mi.render(loaded, spp=int(samples), seed=int(seed)))[:, :, 1])
    print(json.dumps({"mitsuba": mi.__version__}))


if __name__ == "__main__":
    main()
