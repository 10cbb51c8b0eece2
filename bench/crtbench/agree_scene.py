"""A scene of crt as Mitsuba 3 loads it: the same triangles, materials, lights, camera and depth. Spectra are
numbers, {rgb: …, space: linear} and tables, written out or named data that are files; what has no
counterpart is refused, so that nothing is compared that was not translated."""

import dataclasses
import math
import re

import mitsuba as mi
import numpy as np

from . import scene_file
from .program import Failure

NEVER = 1_000_000  # The depth from which Mitsuba plays roulette.


def refuse_all_but(what, given, known):
    if unknown := set(given) - set(known):
        raise Failure(f"{what}: {', '.join(sorted(unknown))} cannot be translated for Mitsuba")


SEEN_NM = (360, 830)  # Wavelengths that both programs render.


def table(nm, value, outside="zero"):
    """Linear between, and outside 0 or the value at that end."""
    if outside == "clamp":
        nm = [min(SEEN_NM[0], nm[0]) - 1, *nm, max(SEEN_NM[1], nm[-1]) + 1]
        value = [value[0], *value, value[-1]]
    return {
        "type": "irregular",
        "wavelengths": ", ".join(map(str, nm)),
        "values": ", ".join(map(str, value)),
    }


def spectrum(given):
    if isinstance(given, (int, float)):
        return {"type": "uniform", "value": float(given)}
    if "table" in given:
        refuse_all_but("a table", given, {"table", "outside"})
        return table(given["table"]["nm"], given["table"]["value"], given.get("outside", "zero"))
    refuse_all_but("a spectrum", given, {"rgb", "space"})
    if given.get("space") != "linear":
        raise Failure("an RGB colour without 'space: linear' cannot be translated for Mitsuba")
    return {"type": "rgb", "value": given["rgb"]}


def uv_transform(given):
    """Scale, then rotation about (0, 0), then offset."""
    scale = given.get("scale", 1)
    u, v = scale if isinstance(scale, list) else (scale, scale)
    offset = given.get("offset", [0, 0])
    turn = mi.ScalarTransform4f().rotate([0, 0, 1], given.get("rotation_deg", 0))
    return (
        mi.ScalarTransform4f().translate([*offset, 0]) @ turn @ mi.ScalarTransform4f().scale([u, v, 1])
    )


def texture(given, folder):
    """A spectrum, or a map of one of the forms of a texture."""
    placed = {"scale", "rotation_deg", "offset"}
    if isinstance(given, dict) and "texture" in given:
        refuse_all_but("a texture", given, {"texture", *placed})
        return {
            "type": "bitmap",
            "filename": str(folder / given["texture"]),
            # Mitsuba's v goes down the image.
            "to_uv": mi.ScalarTransform4f().translate([0, 1, 0])
            @ mi.ScalarTransform4f().scale([1, -1, 1])
            @ uv_transform(given),
        }
    if isinstance(given, dict) and "checker" in given:
        refuse_all_but("a checker", given, {"checker", *placed})
        one, other = given["checker"]
        # Mitsuba's squares have a side of one half.
        half = mi.ScalarTransform4f().scale([0.5, 0.5, 1])
        return {
            "type": "checkerboard",
            "color0": spectrum(one),
            "color1": spectrum(other),
            "to_uv": half @ uv_transform(given),
        }
    return spectrum(given)


def number(given, folder):
    """A number, or a texture of numbers."""
    made = texture(given, folder)
    if made["type"] == "checkerboard":  # Mitsuba has its numbers in the other order than its colours.
        made["color0"], made["color1"] = made["color1"], made["color0"]
    return made | {"raw": True} if made["type"] == "bitmap" else made


def alpha(roughness):
    """Width of GGX."""
    return roughness**2


def two_sided(*bsdfs):
    """As crt has opaque materials: one for both sides, or one for each."""
    return {"type": "twosided", **{f"bsdf{number}": bsdf for number, bsdf in enumerate(bsdfs)}}


def diffuse(given, folder):
    refuse_all_but("a diffuse material", given, {"type", "reflectance"})
    return two_sided({"type": "diffuse", "reflectance": texture(given["reflectance"], folder)})


def rough_conductor(given, folder):
    refuse_all_but("a rough conductor", given, {"type", "eta", "k", "roughness"})
    return two_sided(
        {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha": alpha(given["roughness"]),
            "eta": spectrum(given["eta"]),
            "k": spectrum(given["k"]),
        }
    )


def conductor(given, folder):
    refuse_all_but("a conductor", given, {"type", "eta", "k"})
    return two_sided({"type": "conductor", "eta": spectrum(given["eta"]), "k": spectrum(given["k"])})


def mirror(given, folder):
    refuse_all_but("a mirror", given, {"type", "reflectance"})
    reflectance = texture(given["reflectance"], folder)
    return two_sided({"type": "conductor", "material": "none", "specular_reflectance": reflectance})


def dielectric(given, folder):
    refuse_all_but("a dielectric", given, {"type", "ior"})
    return {"type": "dielectric", "int_ior": float(given["ior"]), "ext_ior": 1.0}


def rough_dielectric(given, folder):
    refuse_all_but("a rough dielectric", given, {"type", "ior", "roughness"})
    return {
        "type": "roughdielectric",
        "distribution": "ggx",
        "alpha": alpha(given["roughness"]),
        "int_ior": float(given["ior"]),
        "ext_ior": 1.0,
    }


def thin_dielectric(given, folder):
    refuse_all_but("a thin dielectric", given, {"type", "ior"})
    return {"type": "thindielectric", "int_ior": float(given["ior"]), "ext_ior": 1.0}


def plastic(given, folder):
    refuse_all_but("a plastic", given, {"type", "ior", "roughness", "reflectance"})
    made = {
        "type": "plastic",
        "diffuse_reflectance": texture(given["reflectance"], folder),
        "int_ior": float(given.get("ior", 1.5)),
        "ext_ior": 1.0,
        "nonlinear": True,
    }
    if given.get("roughness", 0) > 0:
        made |= {"type": "roughplastic", "distribution": "ggx", "alpha": alpha(given["roughness"])}
    return two_sided(made)


def mix(given, folder, materials):
    refuse_all_but("a mix", given, {"type", "materials", "amount"})
    first, second = (plain(materials[name], folder, materials) for name in given["materials"])
    amount = number(given.get("amount", 0.5), folder)
    return {"type": "blendbsdf", "weight": amount, "a": first, "b": second}


def sides(given, folder, materials):
    refuse_all_but("a two-sided material", given, {"type", "front", "back"})
    front, back = (plain(materials[given[side]], folder, materials) for side in ("front", "back"))
    return two_sided(front, back)


COMPOSED = {"mix": mix, "two_sided": sides}
MATERIALS = {
    "diffuse": diffuse,
    "conductor": conductor,
    "mirror": mirror,
    "rough_conductor": rough_conductor,
    "dielectric": dielectric,
    "rough_dielectric": rough_dielectric,
    "thin_dielectric": thin_dielectric,
    "plastic": plastic,
}


def mapped(given, inner, folder):
    """With the normal map, which Mitsuba reads as it is."""
    refuse_all_but("a normal map", given, {"texture", "scale", "offset"})
    image = texture(given, folder) | {"raw": True}
    return {"type": "normalmap", "normalmap": image, "bsdf": inner}


def plain(given, folder, materials):
    """Of one side, without opacity: as a part of another takes it."""
    if given["type"] in COMPOSED:
        return COMPOSED[given["type"]](given, folder, materials)
    if given["type"] not in MATERIALS:
        raise Failure(f"the material '{given['type']}' cannot be translated for Mitsuba")
    made = MATERIALS[given["type"]](
        {key: value for key, value in given.items() if key != "normal_map"}, folder
    )
    inner = made["bsdf0"] if made["type"] == "twosided" else made
    return mapped(given["normal_map"], inner, folder) if "normal_map" in given else inner


def material(given, folder, materials):
    """Both sides of opaque ones, and how much of it is there."""
    made = plain({key: value for key, value in given.items() if key != "opacity"}, folder, materials)
    if not made["type"].endswith("dielectric") and made["type"] != "twosided":
        made = two_sided(made)
    if "opacity" in given:
        made = {"type": "mask", "opacity": number(given["opacity"], folder), "bsdf": made}
    return made


def shape(mesh):
    """Flat triangles without common vertices; polygons as fans from their first corner, as crt splits
    them."""
    refuse_all_but("a mesh", mesh, {"positions", "faces", "uvs"})
    positions = np.array(mesh["positions"], dtype=np.float64)
    corners = np.array(
        [
            [face[0], face[i], face[i + 1]]
            for face in mesh.get("faces", [list(range(len(positions)))])
            for i in range(1, len(face) - 1)
        ]
    ).reshape(-1)
    made = mi.Mesh("mesh", len(corners), len(corners) // 3, has_vertex_texcoords="uvs" in mesh)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = positions[corners].astype(np.float32).reshape(-1)
    if "uvs" in mesh:
        parameters["vertex_texcoords"] = np.array(mesh["uvs"], dtype=np.float32)[corners].reshape(-1)
    parameters["faces"] = np.arange(len(corners), dtype=np.uint32)
    parameters.update()
    return made


def write_shape(mesh, path):
    """As a file: a mesh takes its material and emitter only where it is loaded."""
    shape(mesh).write_ply(str(path))
    return {"type": "ply", "filename": str(path), "face_normals": True}


def to_world(steps):
    """One step after the other."""
    made = mi.ScalarTransform4f()
    for step in steps:
        refuse_all_but("a step of a transform", step, {"scale", "rotate", "translate"})
        if "scale" in step:
            made = mi.ScalarTransform4f().scale(step["scale"]) @ made
        elif "rotate" in step:
            turn = step["rotate"]
            made = mi.ScalarTransform4f().rotate(turn["axis"], turn["angle_deg"]) @ made
        else:
            made = mi.ScalarTransform4f().translate(step["translate"]) @ made
    return made


def loaded_shape(thing, folder, meshes):
    """An OBJ file with its own normals, from the first of the folders that has it."""
    file = next((f / thing["obj"] for f in (folder, meshes) if f and (f / thing["obj"]).exists()), None)
    if file is None:
        raise Failure(f"'{thing['obj']}' is in none of the folders of meshes")
    return {
        "type": "obj",
        "filename": str(file),
        "to_world": to_world(thing.get("transform", [])),
    }


def environment_image(file):
    """Its name, if the scene has one."""
    return (scene_file.load(file).get("environment") or {}).get("image")


def environment(given, folder):
    if "image" in given:
        refuse_all_but("an environment image", given, {"image", "scale", "rotation_deg", "light_sampling"})
        # The middle of crt's image is towards -z, of Mitsuba's towards +z.
        turn = mi.ScalarTransform4f().rotate([0, 1, 0], 180 + given.get("rotation_deg", 0))
        return {
            "type": "envmap",
            "filename": str(folder / given["image"]),
            "scale": float(given.get("scale", 1)),
            "to_world": turn,
        }
    refuse_all_but("an environment", given, {"radiance", "light_sampling"})
    return {"type": "constant", "radiance": spectrum(given["radiance"])}


def point(given):
    refuse_all_but("a point light", given, {"type", "position", "radiant_intensity"})
    return {
        "type": "point",
        "position": given["position"],
        "intensity": spectrum(given["radiant_intensity"]),
    }


def spot(given):
    known = {"type", "position", "target", "cone_angle_deg", "penumbra_deg", "radiant_intensity"}
    refuse_all_but("a spot", given, known)
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(
            origin=given["position"], target=given["target"], up=[0, 1, 0]
        ),
        "intensity": spectrum(given["radiant_intensity"]),
        "cutoff_angle": given["cone_angle_deg"],
        "beam_width": given["cone_angle_deg"] - given["penumbra_deg"],
    }


def directional(given):
    refuse_all_but("a directional light", given, {"type", "direction", "irradiance"})
    return {
        "type": "directional",
        "direction": given["direction"],
        "irradiance": spectrum(given["irradiance"]),
    }


LIGHTS = {"point": point, "spot": spot, "directional": directional}


def light(given):
    if given["type"] not in LIGHTS:
        raise Failure(f"the light '{given['type']}' cannot be translated for Mitsuba")
    return LIGHTS[given["type"]](given)


@dataclasses.dataclass
class Band:
    """What a spectral film measures: the name of crt's channel, and a sensor's answer in Mitsuba."""

    channel: str
    nm: list
    answer: list

    @property
    def integral(self):
        """Mitsuba's channels are integrals, crt's are means."""
        return float(np.trapezoid(self.answer, self.nm))


def bands(file):
    """Bins, then responses; none of a film of colours."""
    film = scene_file.load(file)["film"]
    found = []
    if spectral := film.get("spectral"):
        width = (spectral["to_nm"] - spectral["from_nm"]) / spectral["bins"]
        for number in range(spectral["bins"]):
            first = spectral["from_nm"] + number * width
            middle = f"{first + width / 2:.6f}".replace(".", ",")
            found.append(Band(f"S0.{middle}nm", [first, first + width], [1, 1]))
    for name, given in film.get("responses", {}).items():
        refuse_all_but("a response", given, {"table", "outside"})
        if given.get("outside") != "zero":
            raise Failure("a response without 'outside: zero' cannot be translated for Mitsuba")
        found.append(Band(f"Response.{name}", given["table"]["nm"], given["table"]["value"]))
    return found


def fov_deg(camera):
    """The full angle, which a square film has in both directions."""
    if "fov" in camera:
        return camera["fov"]
    return 2 * math.degrees(math.atan(camera["sensor"][0] / (2 * camera["focal_length"])))


# What a renderer of radiance has no use for: files, how an image is shown, and how crt finds its hits.
SHOWN = {"filter", "color_space", "white_balance", "exposure_ev"}


def film_of(given, band):
    """Of colours, or of one band."""
    refuse_all_but("the film", given, {"resolution", "spectral", "responses", *SHOWN})
    if given.get("filter", "box") != "box":
        raise Failure("a filter other than the box cannot be translated for Mitsuba here")
    width, height = given["resolution"]
    if width != height:
        raise Failure("a film that is not square cannot be translated: fields of view differ in their axis")
    made = {"width": width, "height": height, "component_format": "float32", "rfilter": {"type": "box"}}
    if band is None:
        return made | {"type": "hdrfilm", "pixel_format": "xyz"}
    return made | {"type": "specfilm", "band": table(band.nm, band.answer)}


def with_named_spectra(value, spectra):
    """The same value, names of spectra in it replaced by what they stand for."""
    if isinstance(value, dict):
        return {
            key: spectra[inner] if key in ("reflectance", "radiance") and isinstance(inner, str)
            else with_named_spectra(inner, spectra)
            for key, inner in value.items()
        }
    if isinstance(value, list):
        return [with_named_spectra(inner, spectra) for inner in value]
    return value


def translate(file, folder, samples, band=None, meshes=None):
    """The dictionary that mi.load_dict takes. Meshes go to `folder`, where images are. `band`: of a spectral
    film, the one that is rendered. `meshes`: where OBJ files are, if objects may be such."""
    given = scene_file.load(file)
    known = "crt title camera film integrator sampler spectra materials objects lights environment outputs"
    refuse_all_but("the scene", given, known.split())
    given = {key: with_named_spectra(value, given.get("spectra", {})) for key, value in given.items()}
    camera, film, integrator = given["camera"], given["film"], given["integrator"]
    refuse_all_but("the camera", camera, {"position", "target", "fov", "up", "sensor", "focal_length"})
    if integrator.get("roulette") is not False:
        raise Failure("a scene without 'roulette: false' cannot be translated: roulettes differ")
    made = {
        "type": "scene",
        # Mitsuba's depth counts the emitter, max_depth of crt does not.
        "integrator": {"type": "path", "max_depth": integrator["max_depth"] + 1, "rr_depth": NEVER},
        "sensor": {
            "type": "perspective",
            "fov": fov_deg(camera),
            "near_clip": 1e-3,
            "far_clip": 1e4,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=camera["position"], target=camera["target"], up=camera.get("up", [0, 1, 0])
            ),
            "film": film_of(film, band),
            "sampler": {"type": "independent", "sample_count": samples},
        },
    }
    if "environment" in given:
        made["environment"] = environment(given["environment"], folder)
    for number, thing in enumerate(given.get("lights", [])):
        made[f"light{number}"] = light(thing)
    for number, thing in enumerate(given["objects"]):
        if "obj" in thing:
            refuse_all_but("an object", thing, {"name", "obj", "transform", "material"})
            part = loaded_shape(thing, folder, meshes)
        else:
            refuse_all_but("an object", thing, {"name", "mesh", "material", "emission"})
            part = write_shape(thing["mesh"], folder / f"{number}.ply")
        part["bsdf"] = material(given["materials"][thing["material"]], folder, given["materials"])
        if "emission" in thing:
            refuse_all_but("an emission", thing["emission"], {"radiance", "two_sided"})
            if thing["emission"].get("two_sided"):
                raise Failure("an emission on both sides cannot be translated for Mitsuba")
            part["emitter"] = {"type": "area", "radiance": spectrum(thing["emission"]["radiance"])}
        made[f"object{number}"] = part
    return made


def difference(file):
    """What the scene says of how the models differ: the text of its comment "# differs: …", or None."""
    text = re.search(r"^# differs: (.*(?:\n#   .*)*)$", file.read_text(), re.MULTILINE)
    return " ".join(text[1].replace("\n#", " ").split()) if text else None


def title(file):
    return str(scene_file.load(file)["title"])
