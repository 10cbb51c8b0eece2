"""The scene that an importer builds up: crt's YAML as a dict, in which meshes are arrays and files are
paths."""

import dataclasses
import math
import pickle
import re

import numpy as np

from . import matrices, shapes
from .losses import Losses, refuse

MIRROR = matrices.scaling(-1, 1, 1)
# Names that YAML and crt would read as something else.
NO_NAMES = {"true", "false", "null", "yes", "no", "on", "off", "y", "n", "nan", "inf", "from_mtl"}
BLACK = {"type": "diffuse", "reflectance": 0}


@dataclasses.dataclass
class Thing:
    """An object: `geometry` are its keys of crt without a placement, `placements` matrices (4, 4)."""

    name: str
    geometry: dict
    placements: list
    material: str
    emission: dict | None = None


class Draft:
    """The scene that importers add to. `mirrored`: the other program's image is that of the mirrored world,
    which crt
    gets then: x is -x."""

    def __init__(self, path):
        self.path = path
        self.losses = Losses()
        self.film = {"resolution": [512, 512]}
        self.integrator = {}
        self.sampler = {}
        self.camera = {}
        self.materials = {}
        self.material_names = {}
        self.next_numbers = {}
        self.things = []
        self.lights = []
        self.environment = None
        self.mirrored = False

    def material(self, wanted, content):
        """The name of a material of this content: `wanted` where that is free."""
        base = re.sub(r"[^A-Za-z0-9_.-]+", "_", wanted or content["type"]).strip("_")
        if not base[:1].isalpha() or base.lower() in NO_NAMES:
            base = f"material_{base}".rstrip("_")
        # The content as bytes finds in one step whether the material is there under another number.
        key = (base, pickle.dumps(content))
        if key not in self.material_names:
            name, number = base, self.next_numbers.get(base, 2)
            while name in self.materials:
                name, number = f"{base}_{number}", number + 1
            self.next_numbers[base] = number
            self.materials[name] = content
            self.material_names[key] = name
        return self.material_names[key]

    def look(self, place, matrix, image_right, tangent_scale=1):
        """The camera's keys of place and direction. `matrix` leads from the camera, y up and z forward, to
        the world; the image's right is +x or -x of it, by the sign of `image_right`."""
        if not matrices.is_usable(matrix):
            self.losses.add(place, "a camera whose transform cannot be inverted", "a camera at the origin")
            matrix = matrices.identity()
        right, up, forward = image_right * matrix[:3, 0], matrix[:3, 1], matrix[:3, 2]
        self.mirrored = bool(np.dot(right, np.cross(forward, up)) < 0)
        sizes = np.linalg.norm(matrix[:3, :3], axis=0)
        if not np.allclose(sizes, sizes[0], rtol=1e-4):
            self.losses.add(place, "a camera whose transform stretches", "the same camera, not stretched")
        self.camera |= {"position": matrix[:3, 3], "target": matrix[:3, 3] + forward / sizes[2],
                        "up": up / sizes[1]}

    def add(self, place, thing):
        """An object, unless its transforms flatten it."""
        usable = [matrix for matrix in thing.placements if matrices.is_usable(matrix)]
        if len(usable) < len(thing.placements):
            self.losses.add(place, "a shape whose transform cannot be inverted")
        if usable:
            thing.placements = usable
            self.things.append(thing)

    def content(self):
        """All of it as a dict with the keys of a scene file."""
        mirror = MIRROR if self.mirrored else matrices.identity()
        made = {"crt": 1, "title": self.path.name, "camera": placed(self.camera, mirror),
                "film": self.film}
        made |= {key: value for key, value in (("integrator", self.integrator), ("sampler", self.sampler))
                 if value}
        made |= {"materials": self.materials, "objects": [], "lights": []}
        names = {}
        for thing in self.things:
            number = names[thing.name] = names.get(thing.name, 0) + 1
            made["objects"].append(object_of(thing, thing.name if number == 1 else f"{thing.name}_{number}",
                                             mirror))
        made["lights"] = [placed(light, mirror) for light in self.lights]
        if self.environment is not None:
            made["environment"] = {key: placed(inner, mirror) if key == "sky" else inner
                                   for key, inner in self.environment.items()}
        stem = self.path.name.partition(".")[0]
        made["outputs"] = [{"file": f"{stem}.exr"}, {"file": f"{stem}.png"}]
        used = names_used(made["objects"], self.materials)
        made["materials"] = {name: inner for name, inner in self.materials.items() if name in used}
        return {key: value for key, value in made.items() if value or key == "crt"}


def names_used(objects, materials):
    """Materials that objects have, with those that these are made of."""
    found, left = set(), [thing["material"] for thing in objects]
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            content = materials[name]
            left += [*content.get("materials", []), *(content[k] for k in ("front", "back") if k in content)]
    return found


def object_of(thing, name, mirror):
    made = {"name": name} | thing.geometry | {"material": thing.material}
    places = [mirror @ matrix for matrix in thing.placements]
    if len(places) > 1:
        made["transforms"] = [steps(matrix) for matrix in places]
    elif not np.array_equal(places[0], np.eye(4)):
        made["transform"] = steps(places[0])
    return made | ({"emission": thing.emission} if thing.emission else {})


def half_tangent(fov_deg, place):
    """Of half of a camera's field of view."""
    if not 0 < fov_deg < 180:
        refuse(place, f"a field of view is larger than 0 and smaller than 180 degrees, not {fov_deg:g}")
    return math.tan(math.radians(fov_deg) / 2)


def steps(matrix):
    return [{"matrix": [*matrices.numbers(matrix[:3]), 0.0, 0.0, 0.0, 1.0]}]


def placed(keys, mirror):
    """Places and directions of a camera or a light in crt's world."""
    made = dict(keys)
    for key in ("position", "target"):
        if key in made:
            made[key] = matrices.numbers(matrices.point(mirror, made[key]))
    for key in ("direction", "up"):
        if key in made:
            made[key] = matrices.numbers(matrices.vector(mirror, made[key]))
    return made


def has_texture(content, materials, seen=None):
    """Does a material look at texture coordinates? `seen`: names of materials that do not."""
    seen = set() if seen is None else seen
    if isinstance(content, dict):
        if "texture" in content or "checker" in content:
            return True
        inner_names = [*content.get("materials", ()), *(content[key] for key in ("front", "back")
                                                        if isinstance(content.get(key), str))]
        new = [name for name in inner_names if name not in seen]
        seen.update(new)
        return any(has_texture(inner, materials, seen) for key, inner in content.items()
                   if key not in ("materials", "front", "back")) or any(
            has_texture(materials[name], materials, seen) for name in new)
    return isinstance(content, list) and any(has_texture(inner, materials, seen) for inner in content)


def stretches(placements):
    """Does one of the matrices stretch? crt's spheres, disks and cylinders must not be."""
    return any(matrices.uniform_scale(matrix) is None for matrix in placements)


def meshed(mesh, flip):
    return {"mesh": shapes.flipped(mesh) if flip else mesh}


def ball(radius, stretched, *, flip=False, low=-1.0, high=1.0, phi_max=360.0):
    """The geometry of a sphere, from the height `low` to `high` in radii: a mesh where crt's will not do."""
    if phi_max < 360 or stretched:
        return meshed(shapes.sphere(radius, low, high, phi_max), flip)
    made = {"radius": radius} | ({"from_z": low * radius} if low > -1 else {})
    made |= ({"to_z": high * radius} if high < 1 else {}) | ({"inward": True} if flip else {})
    return {"sphere": made}


def tube(radius, low, high, stretched, *, flip=False, phi_max=360.0):
    """Of a cylinder around z."""
    if phi_max < 360 or stretched:
        return meshed(shapes.cylinder(radius, low, high, phi_max), flip)
    return {"cylinder": {"radius": radius, "from_z": low, "to_z": high} | ({"inward": True} if flip else {})}


def plate(radius, stretched, *, flip=False, inner=0.0, phi_max=360.0, height=0.0):
    """Of a disk seen from z."""
    if flip or phi_max < 360 or inner > 0 or height != 0 or stretched:
        return meshed(shapes.disk(radius, inner, phi_max, height), flip)
    return {"disk": {"radius": radius}}
