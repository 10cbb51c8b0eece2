"""LuxCore as a contestant of `race`: the process that renders, with the module pyluxcore."""

import time

import numpy as np
import pyluxcore

from . import peer_process
from .optics import mirrored, under_coat

# From LuxCore's frame of an environment, where z is up, to Mitsuba's, where y is.
UPRIGHT = np.array([[0.0, 1, 0], [0, 0, 1], [-1, 0, 0]])
NEVER = 1_000_000   # The depth from which LuxCore plays roulette.
WAIT_S, WAIT_SHARE = 0.001, 0.01   # Between looks at the number of samples: of the time until then.


class Properties:
    """Lines of a scene, as `scene.materials.NAME.type = matte`."""

    def __init__(self):
        self.made = pyluxcore.Properties()
        self.count = 0

    def add(self, group, **values):
        """The name of the new thing. Dots of keys are written as two underscores."""
        self.count += 1
        name = f"{group}{self.count}"
        for key, value in values.items():
            key = f"scene.{group}.{name}.{key.replace('__', '.')}"
            self.made.Set(pyluxcore.Property(key, [value] if not isinstance(value, list) else value))
        return name


def coloured(to, given):
    """A colour, or the name of a texture."""
    if isinstance(given, list):
        return given
    if given["type"] == "checkerboard":
        one, other = given["color0"], given["color1"]
        return to.add(
            "textures", type="checkerboard2d", texture1=one, texture2=other,
            mapping__type="uvmapping2d", mapping__uvscale=[2.0, 2.0],
        )
    # Down the image.
    return to.add(
        "textures", type="imagemap", file=given["filename"], gamma=1.0 if given.get("raw") else 2.2,
        mapping__type="uvmapping2d", mapping__uvscale=[1.0, -1.0], mapping__uvdelta=[0.0, 1.0],
    )


def plastic(to, given, roughness):
    """A glossy layer over a base, which is what crt's layer sends out on the whole."""
    reflectance, ior = given["diffuse_reflectance"], given["int_ior"]
    if isinstance(reflectance, dict):
        base = reflectance | {key: under_coat(reflectance[key], ior) for key in ("color0", "color1")}
        base = coloured(to, base)
    else:
        base = under_coat(reflectance, ior)
    return {"type": "glossy2", "kd": base, "ks": [1.0, 1.0, 1.0], "index": ior, **roughness}


def material(to, given):
    """The name of the material."""
    kind, alpha = given["type"], max(given.get("alpha", 0.0), 1e-4)
    roughness = {"uroughness": alpha, "vroughness": alpha}
    if kind == "normalmap":
        image = coloured(to, given["normalmap"])
        bent = to.add("textures", type="normalmap", texture=image)
        inner = material(to, given["bsdf"])
        to.made.Set(pyluxcore.Property(f"scene.materials.{inner}.bumptex", [bent]))
        return inner
    if kind == "blendbsdf":
        a, b = material(to, given["a"]), material(to, given["b"])
        return to.add("materials", type="mix", amount=given["weight"][0], material1=a, material2=b)
    if kind == "diffuse":
        return to.add("materials", type="matte", kd=coloured(to, given["reflectance"]))
    if kind == "conductor":
        return to.add("materials", type="mirror", kr=mirrored(given["eta"], given["k"]))
    if kind == "roughconductor":
        fresnel = to.add("textures", type="fresnelconst", n=given["eta"], k=given["k"])
        return to.add("materials", type="metal2", fresnel=fresnel, **roughness)
    clear = {"kr": [1.0, 1.0, 1.0], "kt": [1.0, 1.0, 1.0]}
    if kind in ("dielectric", "thindielectric"):
        name = "glass" if kind == "dielectric" else "archglass"
        return to.add("materials", type=name, interiorior=given["int_ior"], **clear)
    if kind == "roughdielectric":
        return to.add("materials", type="roughglass", interiorior=given["int_ior"], **clear, **roughness)
    if kind in ("plastic", "roughplastic"):
        return to.add("materials", **plastic(to, given, roughness))
    raise peer_process.Untranslated(f"LuxCore has no {kind}")


def add_part(to, scene, number, part):
    def rows(values):
        return None if values is None else [tuple(map(float, row)) for row in values]

    shape = f"mesh{number}"
    faces = [tuple(map(int, face)) for face in part["faces"]]
    scene.DefineMesh(shape, rows(part["positions"]), faces, rows(part["normals"]), rows(part["uvs"]), None,
                     None)
    surface = material(to, part["bsdf"])
    if part["emission"]:
        to.made.Set(pyluxcore.Property(f"scene.materials.{surface}.emission", part["emission"]))
    to.add("objects", shape=shape, material=surface)


def add_environment(to, given):
    if given and given["type"] == "constant":
        to.add("lights", type="constantinfinite", color=given["radiance"],
               visibilitymapcache__enable=False)
    elif given:
        turn = np.eye(4)
        turn[:3, :3] = np.array(given["to_world"])[:3, :3] @ UPRIGHT
        to.add("lights", type="infinite", file=given["filename"], gamma=1.0, gain=[given["scale"]] * 3,
               transformation=[float(v) for v in turn.T.reshape(-1)], visibilitymapcache__enable=False)


class LuxCore:
    """A scene in LuxCore."""

    def __init__(self, described, sampler):
        pyluxcore.Init(lambda text: None)
        self.described, self.sampler = described, sampler
        self.scene = pyluxcore.Scene()
        to = Properties()
        for number, part in enumerate(described["parts"]):
            add_part(to, self.scene, number, part)
        add_environment(to, described["environment"])
        self.add_camera(to.made, described)
        self.scene.Parse(to.made)

    @staticmethod
    def add_camera(to, described):
        frame = described["camera"]
        place, ahead, up = frame[:3, 3], frame[:3, 2], frame[:3, 1]
        pixel = 2 / described["size"]   # LuxCore's picture is one pixel too low.
        for key, value in {
            "type": "perspective", "lookat.orig": place, "lookat.target": place + ahead, "up": up,
            "fieldofview": described["fov_deg"], "autovolume.enable": False,
            "screenwindow": np.array([-1, 1, -1 - pixel, 1 - pixel]),
        }.items():
            value = [float(v) for v in value] if isinstance(value, np.ndarray) else [value]
            to.Set(pyluxcore.Property(f"scene.camera.{key}", value))

    def settings(self, samples, seed):
        depth = self.described["depth"]
        made = pyluxcore.Properties()
        for key, value in {
            "renderengine.type": "PATHCPU", "renderengine.seed": seed,
            "sampler.type": self.sampler,
            "sampler.sobol.adaptive.strength": 0.0, "sampler.random.adaptive.strength": 0.0,
            "lightstrategy.type": "LOG_POWER",
            "path.pathdepth.total": depth, "path.pathdepth.diffuse": depth, "path.pathdepth.glossy": depth,
            "path.pathdepth.specular": depth,
            "path.russianroulette.depth": NEVER, "path.clamping.variance.maxvalue": 0.0,
            "film.width": self.described["size"], "film.height": self.described["size"],
            "film.filter.type": "NONE", "film.noiseestimation.warmup": NEVER,
            "film.outputs.0.type": "RGB", "film.outputs.0.filename": "image.exr",
            "film.imagepipelines.0.0.type": "NOP",
            "batch.haltspp": samples,
        }.items():
            made.Set(pyluxcore.Property(key, [value]))
        return made

    def render(self, samples, seed):
        """(RGB, seconds, samples)"""
        session = pyluxcore.RenderSession(pyluxcore.RenderConfig(self.settings(samples, seed), self.scene))
        session.Start()
        begin = time.perf_counter()
        while not session.HasDone():
            time.sleep(max(WAIT_S, WAIT_SHARE * (time.perf_counter() - begin)))
            session.UpdateStats()
        seconds = time.perf_counter() - begin
        took = session.GetStats().Get("stats.renderengine.pass").GetInt()
        session.Stop()
        size = self.described["size"]
        pixels = np.empty(size * size * 3, dtype=np.float32)
        session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels, 0, True)
        return pixels.reshape(size, size, 3)[::-1].copy(), seconds, took
