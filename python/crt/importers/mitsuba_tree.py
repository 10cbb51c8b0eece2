"""Mitsuba's XML as a tree of plugins with their parameters, each with its place: defaults and $parameters,
includes, references and aliases, and the names of versions before 2 as later versions have them."""

import pathlib
import re
import xml.parsers.expat

import numpy as np

from ..errors import Error, Kind
from . import matrices
from .losses import FILE_COST, Place, at, names_file, present, refuse, step, suggestion

PLUGINS = {"scene", "shape", "bsdf", "emitter", "texture", "sensor", "film", "sampler", "integrator",
           "medium", "phase", "rfilter", "volume", "subsurface"}
OLDER = {"camera": "sensor", "luminaire": "emitter"}
VALUES = {"float", "integer", "boolean", "string", "vector", "point", "rgb", "srgb", "spectrum", "blackbody",
          "transform", "animation"}
OTHERS = {"default", "include", "ref", "alias", "path"}
DEPTH = 32  # Files within files, and elements within elements.


class Element:
    def __init__(self, tag, attributes, place):
        self.tag, self.attributes, self.place = tag, attributes, place
        self.children = []


def elements(path, name):
    """The root element of a file. Raises crt.Error with its place where it is no XML."""
    parser = xml.parsers.expat.ParserCreate()
    stack = [Element("", {}, Place(name, 1))]

    def here():
        return Place(name, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def begin(tag, attributes):
        if len(stack) > 4 * DEPTH:
            refuse(here(), f"elements are nested more than {4 * DEPTH} deep")
        element = Element(tag, attributes, here())
        stack[-1].children.append(element)
        stack.append(element)

    def no_entities(entity, *_):
        refuse(here(), f"a scene declares no entities, but this one does: '{entity}'")

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.EntityDeclHandler = no_entities
    try:
        parser.Parse(path.read_bytes(), True)
    except xml.parsers.expat.ExpatError as error:
        sentence = xml.parsers.expat.ErrorString(error.code)
        refuse(Place(name, error.lineno, error.offset + 1), f"this is not XML: {sentence}")
    return stack[0].children[0]


class Plugin:
    """A plugin: its tag, type and id, its parameters by name, and the plugins within it. Parameters that
    were asked for are no longer `left`."""

    def __init__(self, tag, kind, place, name=""):
        self.tag, self.kind, self.place, self.id = tag, kind, place, name
        self.values = {}   # By name: value, tag, place.
        self.parts = []    # Name and plugin.
        self.left = set()
        self.asked, self.listed = set(), set()

    def set(self, name, value, tag, place):
        self.values[name] = (value, tag, place)
        self.left.add(name)

    def has(self, *names):
        self.asked.update(names)
        return any(name in self.values or self.part(name) for name in names)

    def get(self, name, default=None):
        """The value of a parameter; a number is a float."""
        self.left.discard(name)
        self.asked.add(name)
        return self.values[name][0] if name in self.values else default

    def part(self, name):
        """The plugin that is the value of a parameter, or None."""
        self.asked.add(name)
        return next((part for known, part in self.parts if known == name), None)

    def all(self, tag):
        return [part for _, part in self.parts if part.tag == tag]

    def one(self, tag):
        found = self.all(tag)
        return found[0] if found else None

    def number(self, name, default):
        """A number where nothing else will do."""
        value = self.get(name, default)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
        refuse(self.values[name][2], f"'{name}' of {self.tag} '{self.kind}' is a number")

    def triple(self, name, default):
        """Three numbers: of a point or a vector."""
        value = self.get(name, default)
        if value is default or (isinstance(value, list) and len(value) == 3):
            return value
        refuse(self.values[name][2], f"'{name}' of {self.tag} '{self.kind}' is three numbers")

    def text(self, name, default):
        value = self.get(name, default)
        if isinstance(value, str):
            return value
        refuse(self.values[name][2], f"'{name}' of {self.tag} '{self.kind}' is a text")

    def place_of(self, name):
        """The place of a parameter; that of the plugin where the parameter is not there."""
        return self.values[name][2] if name in self.values else \
            next((part.place for known, part in self.parts if known == name), self.place)

    def older(self):
        """Names such as toWorld of parameters that the import asked for as to_world."""
        names = {*self.left, *(name for name, _ in self.parts)}
        return {name for name in names if name != snake(name) and snake(name) in self.asked}

    def unused(self, losses, harmless=()):
        """Lists parameters that nothing asked for."""
        older = self.older()
        for name in sorted(self.left - older - set(harmless)):
            losses.add(self.place_of(name), f"'{name}' of {self}")
        for name in sorted(older - self.listed):
            losses.add(self.place_of(name), f"'{name}' of {self}; did you mean '{snake(name)}'?", large=True)
        self.listed |= older
        self.left.clear()

    def transform(self, name="to_world"):
        value = self.get(name)
        return value if isinstance(value, np.ndarray) and value.shape == (4, 4) else matrices.identity()

    def __str__(self):
        return f"{self.tag} '{self.kind}'"


def snake(name):
    """intIOR → int_ior, toWorld → to_world, as Mitsuba does for scenes before version 2."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


class Reader:
    """Reads a file and those that it includes into one Plugin, the scene."""

    def __init__(self, path, parameters):
        self.path = path
        self.parameters, self.given = dict(parameters), set(parameters)
        self.used = set()
        self.folders = [path.parent]
        self.ids = {}
        self.aliases = {}
        self.references = []
        self.version = (3, 0)

    def read(self):
        root = self.root(self.path)
        scene = Plugin("scene", "scene", root.place)
        self.fill(scene, root, [self.path.resolve()])
        for plugin, number, name, element in self.references:
            plugin.parts[number] = (name, self.named(element))
        refuse_circles(scene, [], set())
        for name in sorted(self.given - self.used):
            raise Error(f"no value in '{self.path}' uses the parameter '${name}'"
                        + suggestion(name, self.used), Kind.USAGE)
        return scene

    def root(self, path):
        root = elements(path, str(path))
        if root.tag != "scene":
            refuse(root.place, f"a scene of Mitsuba begins with <scene>, not with <{root.tag}>")
        if "version" in root.attributes:
            words = re.findall(r"\d+", root.attributes["version"])
            self.version = tuple(map(int, words[:2])) or (3, 0)
        return root

    def attribute(self, element, name, default=None):
        """With its $parameters replaced. Refused where there is none and no default."""
        if name not in element.attributes:
            if default is None:
                refuse(element.place, f"<{element.tag}> has no '{name}'"
                                      + suggestion(name, element.attributes))
            return default

        def value(found):
            if found[1] not in self.parameters:
                refuse(element.place, f"the parameter '${found[1]}' has no value: give it a <default>, or "
                       f"-D {found[1]}=VALUE" + suggestion(found[1], self.parameters))
            self.used.add(found[1])
            return self.parameters[found[1]]
        return re.sub(r"\$([A-Za-z_][A-Za-z0-9_]*)", value, element.attributes[name])

    def file(self, place, name):
        """The path of a file that a scene names, as it is looked up. It need not be there."""
        name = name.replace("\\", "/")
        for folder in [place_folder(place), *self.folders]:
            if (folder / name).exists():
                return folder / name
        return place_folder(place) / name

    def fill(self, plugin, element, trail):
        for child in element.children:
            at(child.place)
            tag = OLDER.get(child.tag, child.tag)
            if tag in PLUGINS or (tag == "spectrum" and "type" in child.attributes):
                self.plugin(plugin, child, "texture" if tag == "spectrum" else tag, trail)
            elif tag in VALUES:
                self.value(plugin, child, tag)
            elif tag in OTHERS:
                self.other(tag)(plugin, child, trail)
            else:
                refuse(child.place, f"<{child.tag}> is unknown within {plugin}"
                       + suggestion(child.tag, PLUGINS | VALUES | OTHERS))
        return plugin

    def plugin(self, parent, element, tag, trail):
        kind = self.attribute(element, "type", "scene" if tag == "scene" else None)
        made = Plugin(tag, kind, element.place, self.attribute(element, "id", ""))
        self.fill(made, element, trail)
        if self.version < (2, 0):
            upgrade(made)
        if made.id:
            if made.id in self.ids:
                refuse(element.place, f"the id '{made.id}' is given twice, first at "
                                      f"{self.ids[made.id].place}")
            self.ids[made.id] = made
        parent.parts.append((self.name_of(element), made))

    def name_of(self, element):
        name = self.attribute(element, "name", "")
        return snake(name) if self.version < (2, 0) else name

    # Elements next to plugins and values.

    def other(self, tag):
        return self.search_path if tag == "path" else getattr(self, tag)

    def default(self, plugin, element, trail):
        self.parameters.setdefault(self.attribute(element, "name"), self.attribute(element, "value"))

    def alias(self, plugin, element, trail):
        self.aliases[self.attribute(element, "as")] = self.attribute(element, "id")

    def search_path(self, plugin, element, trail):
        self.folders.append(self.file(element.place, self.attribute(element, "value")))

    def ref(self, plugin, element, trail):
        # The referenced element may come later.
        name = self.name_of(element)
        element.attributes["id"] = self.attribute(element, "id")
        self.references.append((plugin, len(plugin.parts), name, element))
        plugin.parts.append((name, element))

    def named(self, element):
        name = element.attributes["id"]
        for _ in range(DEPTH):
            if name in self.ids:
                return self.ids[name]
            name = self.aliases.get(name, name)
        refuse(element.place, f"there is no '{name}'" + suggestion(name, self.ids | self.aliases))

    def include(self, plugin, element, trail):
        step(element.place, FILE_COST)
        path = present(self.file(element.place, self.attribute(element, "filename")), element.place)
        if path.resolve() in trail:
            refuse(element.place, f"'{path}' includes itself")
        if len(trail) >= DEPTH:
            refuse(element.place, f"files are included more than {DEPTH} deep")
        version = self.version
        self.fill(plugin, self.root(path), [*trail, path.resolve()])
        self.version = version

    # Values.

    def value(self, plugin, element, tag):
        name = self.name_of(element)
        if tag in ("transform", "animation"):
            value = self.transform(element)
        elif tag == "boolean":
            value = self.attribute(element, "value")
            if value not in ("true", "false"):
                refuse(element.place, f"a boolean is true or false, not '{value}'")
            value = value == "true"
        elif tag == "string":
            value = self.attribute(element, "value")
        elif tag in ("float", "integer"):
            value, = self.floats(element, "value", (1,))
        elif tag in ("vector", "point"):
            value = self.triple(element, 0.0)
        else:
            value = self.spectrum(element, tag)
        if not name:
            refuse(element.place, f"<{tag}> has no 'name'")
        plugin.set(name, value, tag, element.place)
        if name == "filename" and tag == "string":
            names_file(lambda: self.file(element.place, value), element.place)

    def floats(self, element, name, counts, default=None):
        text = self.attribute(element, name, default)
        try:
            found = [float(word) for word in text.replace(",", " ").split()]
        except ValueError:
            found = []
        if len(found) not in counts or not np.isfinite(found).all():
            wanted = " or ".join(map(str, counts))
            refuse(element.place, f"'{name}' of <{element.tag}> is {wanted} finite "
                                  f"number{'s' * (counts != (1,))}, not '{text}'")
        return found

    def triple(self, element, default):
        if "value" in element.attributes:
            found = self.floats(element, "value", (1, 3))
            return found * 3 if len(found) == 1 else found
        return [self.floats(element, axis, (1,), str(default))[0] for axis in "xyz"]

    def spectrum(self, element, tag):
        """A number; [r, g, b], linear; {"nm", "values"}; {"file", "place"}; or {"kelvin", "scale"}."""
        if tag == "blackbody":
            kelvin = self.attribute(element, "temperature").strip().rstrip("kK")
            scale = self.floats(element, "scale", (1,), "1")[0]
            try:
                if 0 < float(kelvin) < np.inf:
                    return {"kelvin": float(kelvin), "scale": scale}
            except ValueError:
                pass
            refuse(element.place, f"a temperature is a number in kelvin, not '{kelvin}'")
        if tag == "spectrum" and "filename" in element.attributes:
            return {"file": self.file(element.place, self.attribute(element, "filename")),
                    "place": element.place}
        text = self.attribute(element, "value")
        if ":" in text:
            return self.pairs(element, text)
        if tag in ("rgb", "srgb"):
            return self.rgb(element, text, tag)
        found = self.floats(element, "value", (1, 3))
        return found if len(found) == 3 else found[0]

    def pairs(self, element, text):
        pairs = [pair.split(":") for pair in text.replace(",", " ").split()]
        try:
            nm, values = zip(*((float(a), float(b)) for a, b in pairs))
        except ValueError:
            refuse(element.place, f"a spectrum is pairs of wavelength:value, not '{text}'")
        if not np.isfinite([*nm, *values]).all() or min(nm) <= 0:
            refuse(element.place, f"wavelengths and values are finite, not '{text}'")
        return {"nm": list(nm), "values": list(values)}

    def rgb(self, element, text, tag):
        encoded = tag == "srgb"
        if re.fullmatch(r"#[0-9a-fA-F]{6}", text.strip()):
            digits, encoded = text.strip()[1:], True
            found = [int(digits[i:i + 2], 16) / 255 for i in (0, 2, 4)]
        else:
            found = self.floats(element, "value", (1, 3))
            found = found * 3 if len(found) == 1 else found
        if encoded:
            found = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in found]
        return found

    def transform(self, element):
        made = matrices.identity()
        for part in element.children:
            tag = part.tag.lower()
            if tag == "transform":  # Of an animation: the first.
                return self.transform(part)
            if tag not in ("translate", "scale", "rotate", "lookat", "matrix"):
                refuse(part.place, f"<{part.tag}> is unknown within a transform"
                       + suggestion(part.tag, ["translate", "scale", "rotate", "lookat", "matrix"]))
            made = getattr(self, "step_" + tag)(part) @ made
        return made

    def step_translate(self, step):
        return matrices.translation(*self.triple(step, 0.0))

    def step_scale(self, step):
        return matrices.scaling(*self.triple(step, 1.0))

    def step_rotate(self, step):
        return matrices.rotation(self.triple(step, 0.0), self.floats(step, "angle", (1,))[0])

    def step_lookat(self, step):
        origin, target = self.floats(step, "origin", (3,)), self.floats(step, "target", (3,))
        up = self.floats(step, "up", (3,), "0 0 0")
        if not np.any(up):
            up = [0, 0, 1] if abs(np.subtract(target, origin)[0]) + abs(target[1] - origin[1]) > 0 \
                else [0, 1, 0]
        made = matrices.frame(origin, target, up, left_handed=False)
        if made is None:
            refuse(step.place, "'origin', 'target' and 'up' lie on one line, which fixes no view")
        return made

    def step_matrix(self, step):
        found = self.floats(step, "value", (9, 16))
        if len(found) == 16:
            return np.array(found).reshape(4, 4)
        made = matrices.identity()
        made[:3, :3] = np.array(found).reshape(3, 3)
        return made


def place_folder(place):
    return pathlib.Path(place.file).parent


def refuse_circles(plugin, within, without):
    """Refuses a plugin that contains itself. `without`: ids of plugins known to contain no circle."""
    if any(plugin is outer for outer in within):
        refuse(plugin.place, f"{plugin} '{plugin.id}' contains itself")
    if id(plugin) in without:
        return
    for _, part in plugin.parts:
        refuse_circles(part, [*within, plugin], without)
    without.add(id(plugin))


def upgrade(plugin):
    """Names of versions before 2 that are more than another spelling."""
    if plugin.kind == "diffuse" and "diffuse_reflectance" in plugin.values:
        plugin.set("reflectance", *plugin.values.pop("diffuse_reflectance"))
        plugin.left.discard("diffuse_reflectance")
    names = ("uoffset", "voffset", "uscale", "vscale")
    if any(name in plugin.values for name in names):
        u, v, su, sv = (plugin.number(name, default) for name, default in zip(names, (0, 0, 1, 1)))
        made = matrices.scaling(su, sv, 1) @ matrices.translation(u, v, 0)
        place = next(plugin.values[name][2] for name in names if name in plugin.values)
        plugin.set("to_uv", made, "transform", place)
