"""Blender's Cycles as a contestant of `race`: the process that renders, with Blender as the module bpy."""

import pathlib
import tempfile
import time

import bpy
import mathutils
import numpy as np

from . import peer_process
from .optics import under_coat

# From Mitsuba's frame of an environment, where y is up, to Blender's, where z is.
UPRIGHT = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
NEVER = 1024            # The most that Blender takes for the depth from which it plays roulette.
FRONT = mathutils.Matrix(((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1)))  # It looks to -z.


class Nodes:
    """A tree of shader nodes that grows."""

    def __init__(self, owner):
        owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def add(self, kind, inputs=(), **properties):
        """Inputs by name or number: a value, or the output of a node."""
        node = self.tree.nodes.new("ShaderNode" + kind)
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in dict(inputs).items():
            self.set(node.inputs[name], value)
        return node

    def set(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = [*value, 1.0][: len(socket.default_value)] if isinstance(
                value, (list, tuple)) else value


def coloured(nodes, given):
    """A colour, or the output of a texture."""
    if isinstance(given, list):
        return given
    uvs = nodes.add("UVMap", uv_map="uv").outputs["UV"]
    if given["type"] == "checkerboard":
        # Blender's checker is one of space: at the middle of its cells in the third direction.
        place = nodes.add("Mapping", {"Vector": uvs, "Location": [0, 0, 0.25]}).outputs[0]
        colours = {"Color1": given["color1"], "Color2": given["color0"]}
        return nodes.add("TexChecker", {"Vector": place, "Scale": 2.0, **colours}).outputs["Color"]
    image = bpy.data.images.load(given["filename"], check_existing=True)
    image.colorspace_settings.name = "Non-Color" if given.get("raw") else "sRGB"
    return nodes.add("TexImage", {"Vector": uvs}, image=image).outputs["Color"]


def plastic(nodes, given, roughness):
    """A diffuse base below a dielectric surface; the base is what crt's layer sends out on the whole."""
    reflectance, ior = given["diffuse_reflectance"], given["int_ior"]
    if isinstance(reflectance, dict):
        below = {key: under_coat(reflectance[key], ior) for key in ("color0", "color1")}
        base = coloured(nodes, reflectance | below)
    else:
        base = under_coat(reflectance, ior)
    inputs = {"Base Color": base, "IOR": ior, "Roughness": roughness}
    return nodes.add("BsdfPrincipled", inputs, distribution="MULTI_GGX")


def pane(nodes, ior):
    """Two parallel surfaces with all reflections between them: R = 2 F / (1 + F)."""
    behind = nodes.add("NewGeometry").outputs["Backfacing"]   # The inside, for Blender.
    sign = nodes.add("Math", {0: behind, 1: -2.0, 2: 1.0}, operation="MULTIPLY_ADD").outputs[0]
    outside = nodes.add("Math", {0: ior, 1: sign}, operation="POWER").outputs[0]
    once = nodes.add("Fresnel", {"IOR": outside}).outputs[0]
    above = nodes.add("Math", {0: once, 1: 2.0}, operation="MULTIPLY").outputs[0]
    below = nodes.add("Math", {0: once, 1: 1.0}, operation="ADD").outputs[0]
    share = nodes.add("Math", {0: above, 1: below}, operation="DIVIDE").outputs[0]
    through, back = nodes.add("BsdfTransparent"), nodes.add("BsdfAnisotropic", {"Roughness": 0.0})
    return nodes.add("MixShader", {0: share, 1: through.outputs[0], 2: back.outputs[0]})


def shader(nodes, given):
    """The output of the node that is this material."""
    kind, roughness = given["type"], given.get("alpha", 0.0) ** 0.5
    if kind == "normalmap":
        inner = shader(nodes, given["bsdf"])
        bent = nodes.add("NormalMap", {"Color": coloured(nodes, given["normalmap"])}, uv_map="uv")
        nodes.set(inner.node.inputs["Normal"], bent.outputs[0])
        return inner
    if kind == "blendbsdf":
        a, b = shader(nodes, given["a"]), shader(nodes, given["b"])
        return nodes.add("MixShader", {0: given["weight"][0], 1: a, 2: b}).outputs[0]
    if kind == "diffuse":
        node = nodes.add("BsdfDiffuse", {"Color": coloured(nodes, given["reflectance"])})
    elif kind in ("conductor", "roughconductor"):
        inputs = {"IOR": given["eta"], "Extinction": given["k"], "Roughness": roughness}
        node = nodes.add("BsdfMetallic", inputs, distribution="MULTI_GGX", fresnel_type="PHYSICAL_CONDUCTOR")
    elif kind in ("dielectric", "roughdielectric"):
        inputs = {"Color": [1.0, 1.0, 1.0], "Roughness": roughness, "IOR": given["int_ior"]}
        node = nodes.add("BsdfGlass", inputs, distribution="MULTI_GGX")
    elif kind == "thindielectric":
        node = pane(nodes, given["int_ior"])
    elif kind in ("plastic", "roughplastic"):
        node = plastic(nodes, given, roughness)
    else:
        raise peer_process.Untranslated(f"Cycles has no {kind}")
    return node.outputs[0]


def material(part):
    made = bpy.data.materials.new("material")
    nodes = Nodes(made)
    surface = shader(nodes, part["bsdf"])
    if part["emission"]:
        away = nodes.add("NewGeometry").outputs["Backfacing"]
        front = nodes.add("Math", {0: 1.0, 1: away}, operation="SUBTRACT").outputs[0]
        light = nodes.add("Emission", {"Color": part["emission"], "Strength": front}).outputs[0]
        surface = nodes.add("AddShader", {0: surface, 1: light}).outputs[0]
    made.cycles.emission_sampling = "FRONT" if part["emission"] else "NONE"
    nodes.add("OutputMaterial", {"Surface": surface})
    return made


def add_part(part):
    mesh = bpy.data.meshes.new("part")
    mesh.from_pydata(part["positions"], [], part["faces"], shade_flat=part["normals"] is None)
    if part["normals"] is not None:
        mesh.normals_split_custom_set_from_vertices(part["normals"])
    if part["uvs"] is not None:
        corners = part["uvs"][part["faces"].reshape(-1)]
        mesh.uv_layers.new(name="uv").data.foreach_set("uv", corners.reshape(-1))
    mesh.materials.append(material(part))
    thing = bpy.data.objects.new("part", mesh)
    thing.cycles.shadow_terminator_geometry_offset = 0
    thing.cycles.shadow_terminator_offset = 0
    bpy.context.collection.objects.link(thing)


def add_environment(scene, given):
    world = scene.world = bpy.data.worlds.new("world")
    nodes = Nodes(world)
    inputs = {"Color": [0.0, 0.0, 0.0]}
    if given and given["type"] == "constant":
        inputs = {"Color": given["radiance"]}
    elif given:
        image = bpy.data.images.load(given["filename"])
        image.colorspace_settings.name = "Linear Rec.709"
        turn = UPRIGHT @ np.linalg.inv(given["to_world"][:3, :3])
        angles = mathutils.Matrix(turn.tolist()).to_euler()
        seen = nodes.add("TexCoord").outputs["Generated"]
        seen = nodes.add("Mapping", {"Vector": seen, "Rotation": list(angles)}, vector_type="POINT")
        colour = nodes.add("TexEnvironment", {"Vector": seen.outputs[0]}, image=image)
        inputs = {"Color": colour.outputs[0], "Strength": given["scale"]}
    nodes.add("OutputWorld", {"Surface": nodes.add("Background", inputs).outputs[0]})


class Cycles:
    """A scene in Blender."""

    def __init__(self, described, pattern, light_tree):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        for part in described["parts"]:
            add_part(part)
        add_environment(scene, described["environment"])
        lens = bpy.data.cameras.new("camera")
        lens.sensor_fit, lens.angle = "HORIZONTAL", np.radians(described["fov_deg"])
        lens.clip_start, lens.clip_end = 1e-3, 1e5
        scene.camera = bpy.data.objects.new("camera", lens)
        bpy.context.collection.objects.link(scene.camera)
        scene.camera.matrix_world = mathutils.Matrix(described["camera"].tolist()) @ FRONT
        self.film(described["size"])
        self.integrator(described["depth"], pattern, light_tree)
        bpy.app.handlers.render_stats.append(self.note)

    def film(self, size):
        render = self.scene.render
        render.resolution_x = render.resolution_y = size
        render.resolution_percentage = 100
        render.use_persistent_data = True
        render.threads_mode = "AUTO"
        render.use_compositing = render.use_sequencer = False
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
        self.scene.cycles.pixel_filter_type = "BOX"
        self.scene.cycles.film_exposure = 1

    def integrator(self, depth, pattern, light_tree):
        cycles = self.scene.cycles
        settings = {
            "device": "CPU", "use_adaptive_sampling": False, "use_denoising": False, "use_guiding": False,
            "sample_clamp_direct": 0, "sample_clamp_indirect": 0, "blur_glossy": 0,
            "caustics_reflective": True, "caustics_refractive": True, "light_sampling_threshold": 0,
            "min_light_bounces": NEVER, "min_transparent_bounces": NEVER, "transparent_max_bounces": NEVER,
            "auto_scrambling_distance": False, "sampling_pattern": pattern, "use_light_tree": light_tree,
            "use_fast_gi": False,
        }
        for kind in ("max", "diffuse", "glossy", "transmission"):
            settings[f"{kind}_bounces"] = depth - 1   # Those after the first.
        for name, value in settings.items():
            setattr(cycles, name, value)

    def render(self, samples, seed):
        """(RGB, seconds, samples)"""
        self.scene.cycles.samples, self.scene.cycles.seed = samples, seed
        self.steps = []
        bpy.ops.render.render()
        begin = next(when for when, what in self.steps if "Sample 0/" in what)
        end = next(when for when, what in self.steps if "Finished" in what)
        return self.pixels(), end - begin, samples

    def note(self, what, *_):
        """Blender says what it does: loading the scene, then sample after sample."""
        self.steps.append((time.perf_counter(), str(what)))

    @staticmethod
    def pixels():
        with tempfile.TemporaryDirectory() as folder:
            file = str(pathlib.Path(folder) / "image.exr")
            bpy.data.images["Render Result"].save_render(file)
            image = bpy.data.images.load(file)
            image.colorspace_settings.name = "Non-Color"
            width, height = image.size
            values = np.empty(width * height * image.channels, dtype=np.float32)
            image.pixels.foreach_get(values)
            bpy.data.images.remove(image)
            return values.reshape(height, width, -1)[::-1, :, :3].copy()
