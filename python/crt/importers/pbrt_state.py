"""The directives of pbrt's scene files, carried out: what stands in a scene, each with its transform."""

import dataclasses
import pathlib

import numpy as np

from . import matrices
from .losses import FILE_COST, at, names_file, present, refuse, step, suggestion
from .pbrt_text import Text

DEPTH = 32
DIRECTIVES = ("Accelerator ActiveTransform AreaLightSource Attribute AttributeBegin AttributeEnd Camera "
              "ColorSpace ConcatTransform CoordSysTransform CoordinateSystem Film Identity Import Include "
              "Integrator LightSource LookAt MakeNamedMaterial MakeNamedMedium Material MediumInterface "
              "NamedMaterial ObjectBegin ObjectEnd ObjectInstance Option PixelFilter ReverseOrientation "
              "Rotate Sampler Scale Shape Texture Transform TransformBegin TransformEnd TransformTimes "
              "Translate WorldBegin WorldEnd").split()
OF_CATEGORY = ("shape", "light", "material", "medium", "texture")


@dataclasses.dataclass
class Graphics:
    """The state that AttributeBegin saves and AttributeEnd restores."""

    matrix: np.ndarray = dataclasses.field(default_factory=matrices.identity)
    at_start: bool = True
    reverse: bool = False
    material: object = None
    area_light: object = None
    inside: str = ""
    outside: str = ""
    color_space: str = "srgb"
    defaults: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass
class Item:
    """A shape or light and the state that it stood in."""

    parameters: object
    graphics: Graphics


class State:
    """After read(): `camera`, `film` and so on are Parameters or None, `shapes`, `lights` Items, `objects`
    lists of shapes by name, `instances` names with matrices."""

    def __init__(self, losses):
        self.losses = losses
        self.graphics = Graphics()
        self.stack = []
        self.systems = {"world": matrices.identity()}
        self.settings = {}
        self.camera_matrix = matrices.identity()
        self.shapes, self.lights = [], []
        self.objects, self.instances = {}, []
        self.object = None
        self.materials, self.textures, self.media = {}, {}, {}
        self.version_3 = False

    def read(self, path, trail=()):
        text = Text(path)
        trail = (*trail, path.resolve())
        depth = len(self.stack)
        while (token := text.next()) is not None:
            word, quoted, offset = token
            if quoted or word not in DIRECTIVES:
                refuse(text.place(offset), f"there is no directive '{word}'" + suggestion(word, DIRECTIVES))
            place = text.place(offset)
            at(place)
            if word in ("Include", "Import"):
                self.include(text, word, place, trail)
            else:
                getattr(self, "do_" + word)(text, place)
        if len(self.stack) > depth:
            kind, where, _ = self.stack[-1]
            refuse(where, f"{kind}Begin without {kind}End")

    def include(self, text, word, place, trail):
        step(place, FILE_COST)
        name = text.string(word)
        path = present(self.file(place, name), place)
        if path.resolve() in trail:
            refuse(place, f"'{path}' includes itself")
        if len(trail) >= DEPTH:
            refuse(place, f"files are included more than {DEPTH} deep")
        before = dataclasses.replace(self.graphics) if word == "Import" else None
        self.read(path, trail)
        if before is not None:
            self.graphics = before

    def file(self, place, name):
        """Names are relative to the first file's folder."""
        return self.folder / name.replace("\\", "/")

    @property
    def folder(self):
        return self._folder

    def of(self, path):
        """Reads a scene: `path` is its first file."""
        self._folder = pathlib.Path(path).parent
        self.read(pathlib.Path(path))
        return self

    # Transforms.

    def concat(self, matrix):
        if self.graphics.at_start:
            self.graphics.matrix = self.graphics.matrix @ matrix

    def do_Identity(self, text, place):
        if self.graphics.at_start:
            self.graphics.matrix = matrices.identity()

    def do_Translate(self, text, place):
        self.concat(matrices.translation(*text.numbers("Translate", 3)))

    def do_Scale(self, text, place):
        self.concat(matrices.scaling(*text.numbers("Scale", 3)))

    def do_Rotate(self, text, place):
        angle, *axis = text.numbers("Rotate", 4)
        self.concat(matrices.rotation(axis, angle))

    def do_LookAt(self, text, place):
        found = text.numbers("LookAt", 9)
        made = matrices.frame(found[:3], found[3:6], found[6:], left_handed=True)
        if made is None:
            refuse(place, "the eye, the point that it looks at and up lie on one line, which fixes no view")
        self.concat(np.linalg.inv(made))

    def do_Transform(self, text, place):
        made = np.array(text.numbers("Transform", 16)).reshape(4, 4).T
        if self.graphics.at_start:
            self.graphics.matrix = made

    def do_ConcatTransform(self, text, place):
        self.concat(np.array(text.numbers("ConcatTransform", 16)).reshape(4, 4).T)

    def do_CoordinateSystem(self, text, place):
        self.systems[text.string("CoordinateSystem")] = self.graphics.matrix

    def do_CoordSysTransform(self, text, place):
        name = text.string("CoordSysTransform")
        if name not in self.systems:
            refuse(place, f"there is no coordinate system '{name}'" + suggestion(name, self.systems))
        if self.graphics.at_start:
            self.graphics.matrix = self.systems[name]

    def do_ActiveTransform(self, text, place):
        token = text.next()
        which = token[0] if token else ""
        if which not in ("All", "StartTime", "EndTime"):
            refuse(place, f"ActiveTransform takes All, StartTime or EndTime, not '{which}'")
        if which == "EndTime":
            self.losses.add(place, "motion", "objects at their initial places")
        self.graphics.at_start = which != "EndTime"

    def do_TransformTimes(self, text, place):
        text.numbers("TransformTimes", 2)

    # The state that is saved and restored.

    def begin(self, kind, place):
        if len(self.stack) > 10000:
            refuse(place, "blocks are nested more than 10000 deep")
        self.stack.append((kind, place, dataclasses.replace(self.graphics)))

    def end(self, kind, place):
        if not self.stack or self.stack[-1][0] != kind:
            refuse(place, f"{kind}End without {kind}Begin" + (
                f": {self.stack[-1][0]}Begin at {self.stack[-1][1]} has no end" if self.stack else ""))
        self.graphics = self.stack.pop()[2]

    def do_AttributeBegin(self, text, place):
        self.begin("Attribute", place)

    def do_AttributeEnd(self, text, place):
        self.end("Attribute", place)

    def do_TransformBegin(self, text, place):
        self.begin("Transform", place)

    def do_TransformEnd(self, text, place):
        now = self.graphics
        self.end("Transform", place)
        before = self.graphics
        self.graphics = dataclasses.replace(now, matrix=before.matrix, at_start=before.at_start)

    def do_ReverseOrientation(self, text, place):
        self.graphics.reverse = not self.graphics.reverse

    def do_Attribute(self, text, place):
        category = text.string("Attribute")
        if category not in OF_CATEGORY:
            refuse(place, f"there are no attributes of '{category}'" + suggestion(category, OF_CATEGORY))
        found = text.parameters("attribute", category, place)
        self.graphics.defaults = self.graphics.defaults | {
            category: self.graphics.defaults.get(category, {}) | found.values}

    def do_ColorSpace(self, text, place):
        self.graphics.color_space = text.string("ColorSpace")

    # The film, the sampler and the integrator.

    def setting(self, text, place, directive):
        self.settings[directive] = text.parameters(directive.lower(), text.string(directive), place)
        self.settings[directive].color_space = self.graphics.color_space

    def do_Film(self, text, place):
        self.setting(text, place, "Film")
        if self.settings["Film"].name == "image":
            self.is_version_3(place)

    def do_Sampler(self, text, place):
        self.setting(text, place, "Sampler")

    def do_Integrator(self, text, place):
        self.setting(text, place, "Integrator")

    def do_PixelFilter(self, text, place):
        self.setting(text, place, "PixelFilter")

    def do_Accelerator(self, text, place):
        self.setting(text, place, "Accelerator")

    def do_Camera(self, text, place):
        self.setting(text, place, "Camera")
        if abs(np.linalg.det(self.graphics.matrix)) < 1e-300:
            refuse(place, "the camera's transform cannot be inverted")
        self.camera_matrix = np.linalg.inv(self.graphics.matrix)
        self.systems["camera"] = self.camera_matrix

    def do_Option(self, text, place):
        name = text.string("Option")
        text.values()
        if "displacement" in name:
            self.losses.add(place, f"the option '{name}'")

    def do_WorldBegin(self, text, place):
        self.graphics = dataclasses.replace(self.graphics, matrix=matrices.identity(), at_start=True)
        self.systems["world"] = matrices.identity()

    def do_WorldEnd(self, text, place):
        self.is_version_3(place)

    def is_version_3(self, place):
        """Says once that the scene is of pbrt-v3."""
        if not self.version_3:
            self.losses.add(place, "a scene of pbrt-v3", "it is read as one of pbrt-v4; 'pbrt --upgrade' of "
                            "pbrt-v4 converts it", large=True)
        self.version_3 = True

    # The objects of the scene.

    def described(self, text, place, kind, directive, category):
        made = text.parameters(kind, text.string(directive), place)
        for name in ("filename", "normalmap"):
            if made.values.get(name, ("",))[0] == "string" and made.values[name][1]:
                self.names(made.values[name])
        made.inherit(self.graphics.defaults.get(category, {}))
        made.color_space = self.graphics.color_space
        return made

    def item(self, parameters):
        return Item(parameters, dataclasses.replace(self.graphics))

    def names(self, value):
        _, texts, place = value
        names_file(lambda: self.file(place, texts[0]), place)

    def do_Shape(self, text, place):
        found = self.item(self.described(text, place, "shape", "Shape", "shape"))
        (self.shapes if self.object is None else self.objects[self.object]).append(found)

    def do_LightSource(self, text, place):
        self.lights.append(self.item(self.described(text, place, "light", "LightSource", "light")))

    def do_AreaLightSource(self, text, place):
        self.graphics.area_light = self.described(text, place, "area light", "AreaLightSource", "light")

    def do_Material(self, text, place):
        self.graphics.material = self.described(text, place, "material", "Material", "material")

    def do_NamedMaterial(self, text, place):
        self.graphics.material = (text.string("NamedMaterial"), place)

    def named(self, text, place, kind, default):
        """A material or medium that later statements name: its name, and what it is."""
        name = text.string(f"MakeNamed{kind.capitalize()}")
        made = text.parameters(kind, "", place)
        made.inherit(self.graphics.defaults.get(kind, {}))
        made.color_space = self.graphics.color_space
        made.name = made.string("type", default)
        return name, made

    def do_MakeNamedMaterial(self, text, place):
        name, made = self.named(text, place, "material", "diffuse")
        self.materials[name] = made

    def do_MakeNamedMedium(self, text, place):
        name, made = self.named(text, place, "medium", "homogeneous")
        self.media[name] = made

    def do_MediumInterface(self, text, place):
        self.graphics.inside = self.graphics.outside = text.string("MediumInterface")
        token = text.peek()
        if token and token[1]:
            self.graphics.outside = text.next()[0]
        if self.graphics.outside:
            self.losses.add(place, f"the medium '{self.graphics.outside}' outside of shapes", "empty space",
                            large=True)

    def do_Texture(self, text, place):
        name, kind = text.string("Texture"), text.string("Texture")
        if kind not in ("float", "spectrum", "color"):
            refuse(place, f"a texture is of type 'float' or 'spectrum', not '{kind}'")
        made = self.described(text, place, "texture", "Texture", "texture")
        self.textures["float" if kind == "float" else "spectrum", name] = made

    def do_ObjectBegin(self, text, place):
        name = text.string("ObjectBegin")
        if self.object is not None:
            refuse(place, f"an object within the object '{self.object}'")
        self.begin("Object", place)
        self.object = name
        self.objects[name] = []

    def do_ObjectEnd(self, text, place):
        self.end("Object", place)
        self.object = None

    def do_ObjectInstance(self, text, place):
        name = text.string("ObjectInstance")
        if self.object is not None:
            refuse(place, f"an instance within the object '{self.object}'")
        self.instances.append((name, self.graphics.matrix, place))


