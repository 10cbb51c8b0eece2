"""A scene of crt as Mitsuba 3 loads it: the same triangles, materials, lights, camera and depth. Spectra are
numbers, {rgb: …, space: linear} and tables, written out or named data that are files; what has no
counterpart is refused, so that nothing is compared that was not translated."""

import dataclasses
import math
import re

import mitsuba as mi
import numpy as np

from . import scene_file
from .agree_materials import material, refuse_all_but, spectrum, table
from .program import Failure

NEVER = 1_000_000  # The depth from which Mitsuba plays roulette.


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
    """The measurement of a spectral film: the name of crt's channel, and a sensor's response in Mitsuba."""

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


# Keys without a meaning for a renderer of radiance: files, display settings, and the search for hits.
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
    """The scene's note on differences of the models: the text of its comment "# differs: …", or None."""
    text = re.search(r"^# differs: (.*(?:\n#   .*)*)$", file.read_text(), re.MULTILINE)
    return " ".join(text[1].replace("\n#", " ").split()) if text else None


def title(file):
    return str(scene_file.load(file)["title"])
