"""BSDFs of Mitsuba as materials of crt."""

import dataclasses
import math

import numpy as np

from . import spectra
from .images import powered
from .losses import step, suggestion
from .mitsuba_values import Values
from .draft import BLACK

INDICES = {"vacuum": 1.0, "helium": 1.000036, "hydrogen": 1.000132, "air": 1.000277,
           "carbon dioxide": 1.00045, "water": 1.333, "acetone": 1.36, "ethanol": 1.361,
           "carbon tetrachloride": 1.461, "glycerol": 1.4729, "benzene": 1.501, "silicone oil": 1.52045,
           "bromine": 1.661, "water ice": 1.31, "fused quartz": 1.458, "pyrex": 1.47, "acrylic glass": 1.49,
           "polypropylene": 1.49, "bk7": 1.5046, "sodium chloride": 1.544, "amber": 1.55, "pet": 1.575,
           "diamond": 2.419}
# Of GGX, 1 / (1 + t²) of the projected facets lean by more than t widths; of Beckmann's, exp(-t²).
ROUGH_METAL = ("light that a rough metal loses between its facets",
               "none is lost: up to 10 % brighter where the metal is very rough")
WIDER = "GGX of the same width (20 % of its facets lean by more than two widths, of Beckmann's 2 %)"
YELLOW, RED = {"CuZn", "Au", "TiN"}, {"Cu", "Cu2O", "CuO"}


@dataclasses.dataclass
class Surface:
    """A material: its keys without opacity. `clear`: light passes; `both`: its sides look the same."""

    content: dict
    clear: bool = False
    both: bool = False
    opacity: object = 1.0
    name: str = ""


def inner_reflectance(eta):
    """Of light that comes from below a surface of index `eta` evenly from all sides, what it sends back."""
    cos = (np.arange(4000) + 0.5) / 4000
    sin2 = eta**2 * (1 - cos**2)
    out = np.sqrt(np.clip(1 - sin2, 0, 1))
    s, p = (eta * cos - out) / (eta * cos + out), (cos - eta * out) / (cos + eta * out)
    return float((np.where(sin2 >= 1, 1, (s**2 + p**2) / 2) * 2 * cos).mean())


class Materials:
    def __init__(self, reader, scene):
        self.reader, self.scene, self.losses = reader, scene, scene.losses
        self.left = []

    def name(self, plugin, **mesh):
        """The name of a material for objects, or None where light passes as if nothing were there. `mesh`:
        what Values takes."""
        if plugin is None:
            return self.finished(Surface({"type": "diffuse", "reflectance": 0.5}, name="default"))
        surface = self.surface(plugin, Values(self.reader, self.losses, **mesh))
        return None if surface is None else self.finished(surface)

    def finished(self, surface):
        content = surface.content
        if not surface.clear and not surface.both:
            front = self.scene.material(f"{surface.name or content['type']}_front", content)
            content = {"type": "two_sided", "front": front, "back": self.scene.material("black", BLACK)}
        if surface.opacity != 1:
            key = "geometry_opacity" if content["type"] == "openpbr" else "opacity"
            content = content | {key: surface.opacity}
        return self.scene.material(surface.name, content)

    def surface(self, plugin, values):
        """None: there is none (`null`)."""
        step(plugin.place)
        make = getattr(self, "of_" + plugin.kind, None)
        if make is None:
            known = [name[3:] for name in dir(self) if name.startswith("of_")]
            self.losses.add(plugin.place, f"bsdf '{plugin.kind}'{suggestion(plugin.kind, known)}",
                            "grey, diffuse", large=True)
            self.scene_ignores(plugin)
            return Surface({"type": "diffuse", "reflectance": 0.5}, both=True, name=plugin.id)
        made = make(plugin, values)
        if made is not None:
            made.name = plugin.id or made.name
        self.left.append(plugin)
        return made

    @staticmethod
    def scene_ignores(plugin):
        plugin.left.clear()

    def nested(self, plugin, values):
        parts = plugin.all("bsdf")
        if not parts:
            self.losses.add(plugin.place, f"a {plugin} without a bsdf in it", "grey, diffuse")
            return [Surface({"type": "diffuse", "reflectance": 0.5})]
        return [self.surface(part, values) for part in parts]

    # Roughness and indices.

    def index(self, plugin, name, default):
        value = plugin.get(name, default)
        if isinstance(value, str):
            if value.lower() not in INDICES:
                self.losses.add(plugin.values[name][2], f"the material '{value}'"
                                + suggestion(value.lower(), INDICES), f"'{default}'")
            return INDICES.get(value.lower(), INDICES[default])
        return plugin.number(name, INDICES[default])

    def ior(self, plugin, inside="bk7"):
        made = self.index(plugin, "int_ior", inside) / max(self.index(plugin, "ext_ior", "air"), 1e-3)
        return float(f"{min(max(made, 1e-3), 1000):.9g}")

    def widths(self, plugin, values):
        """The keys of crt's roughness."""
        if plugin.text("distribution", "beckmann") != "ggx":
            self.losses.add(plugin.place, "microfacets of Beckmann's distribution", WIDER)
        plugin.get("sample_visible")
        if plugin.has("alpha_u", "alpha_v"):
            along, across = (values.number(plugin, name, 0.1) for name in ("alpha_u", "alpha_v"))
            made = along if isinstance(along, dict) else across
            if not isinstance(made, dict):
                return spectra.anisotropic(along, across)
            if along != across:
                self.losses.add(plugin.place, "two textures of roughness", "the first for both")
        else:
            made = values.number(plugin, "alpha", 0.1)
        return {"roughness": self.rooted(plugin, made) if isinstance(made, dict)
                else spectra.roughness(made)}

    def rooted(self, plugin, made):
        """A texture of widths as one of their square roots."""
        roots = powered(made, 0.5)
        if roots is None:
            self.losses.add(plugin.place, f"a texture as 'alpha' of {plugin}", "roughness 0.3")
        return 0.3 if roots is None else roots

    def factor(self, plugin, values, *names):
        """A factor on what glass reflects or lets through: crt's has none."""
        for name in names:
            if plugin.has(name) and values.reflectance(plugin, name, 1.0) != 1:
                self.losses.add(plugin.place, f"'{name}' of {plugin}", "1", large=True)

    def tint(self, plugin, values, name):
        """The key of such a factor on metals, gloss and panes."""
        made = values.reflectance(plugin, name, 1.0) if plugin.has(name) else 1
        return {} if made == 1 else {"tint": made}

    # By the names of Mitsuba.

    def of_diffuse(self, plugin, values):
        return Surface({"type": "diffuse", "reflectance": values.reflectance(plugin, "reflectance")})

    def of_roughdiffuse(self, plugin, values):
        plugin.get("use_fast_approx")
        self.losses.add(plugin.place, "the roughness of bsdf 'roughdiffuse'", "roughness 0.5 of EON")
        plugin.get("alpha")
        return Surface({"type": "diffuse", "reflectance": values.reflectance(plugin, "reflectance"),
                        "roughness": 0.5})

    def metal(self, plugin, values):
        """metal, or eta and k; None for a mirror of reflectance 1."""
        if plugin.has("eta", "k"):
            plugin.get("material")
            eta, k = values.spectrum(plugin, "eta", 0.2), values.spectrum(plugin, "k", 3.0)
            eta, changed = spectra.index_above_0(eta)
            if changed:
                self.losses.add(plugin.place, "an 'eta' of 0 or less", f"{spectra.LEAST_INDEX}")
            outside = self.index(plugin, "ext_eta", "vacuum") if plugin.has("ext_eta") else 1
            return {"eta": spectra.scaled(eta, 1 / outside), "k": spectra.scaled(k, 1 / outside)}
        name = str(plugin.get("material", "none"))
        if name == "none":
            return None
        base = name.partition("_")[0]
        if base in spectra.METAL_COLORS and base not in spectra.METALS:
            self.losses.add(plugin.place, f"the metal '{name}'", spectra.OTHER_DATA)
        elif base not in spectra.METALS:
            base = "Au" if base in YELLOW else "Cu" if base in RED else "Al"
            self.losses.add(plugin.place, f"the metal '{name}'", f"'{base}'")
        return {"metal": base}

    def of_conductor(self, plugin, values):
        metal = self.metal(plugin, values)
        if metal is None:
            color = values.reflectance(plugin, "specular_reflectance", 1.0)
            return Surface({"type": "mirror", "reflectance": color})
        return Surface({"type": "conductor"} | metal | self.tint(plugin, values, "specular_reflectance"))

    def of_roughconductor(self, plugin, values):
        metal = self.metal(plugin, values)
        widths = self.widths(plugin, values)
        if metal is None:
            color = values.reflectance(plugin, "specular_reflectance", 1.0)
            return Surface(rough_mirror(color, widths))
        self.losses.add(plugin.place, *ROUGH_METAL)
        return Surface({"type": "rough_conductor"} | metal | widths |
                       self.tint(plugin, values, "specular_reflectance"))

    def of_dielectric(self, plugin, values):
        self.factor(plugin, values, "specular_reflectance", "specular_transmittance")
        return Surface({"type": "dielectric", "ior": self.ior(plugin)}, clear=True)

    def of_roughdielectric(self, plugin, values):
        self.factor(plugin, values, "specular_reflectance", "specular_transmittance")
        widths = self.widths(plugin, values)
        return Surface({"type": "rough_dielectric", "ior": self.ior(plugin)} | widths, clear=True)

    def of_thindielectric(self, plugin, values):
        self.factor(plugin, values, "specular_reflectance")
        return Surface({"type": "thin_dielectric", "ior": self.ior(plugin)} |
                       self.tint(plugin, values, "specular_transmittance"), clear=True)

    def of_plastic(self, plugin, values):
        ior = self.ior(plugin, "polypropylene")
        color = values.reflectance(plugin, "diffuse_reflectance")
        if not plugin.get("nonlinear", False):
            color = self.linear(plugin, color, ior)
        return Surface({"type": "plastic", "reflectance": color, "ior": min(max(ior, 1), 10)} |
                       self.tint(plugin, values, "specular_reflectance"))

    def linear(self, plugin, color, ior):
        """The reflectance of crt's base, whose colour deepens as light goes to and fro below the coat, that
        gives what Mitsuba's gives without that."""
        inner = inner_reflectance(ior)

        def base(value):
            return value / (1 - inner + inner * value)
        if isinstance(color, (int, float)):
            return base(color)
        if "rgb" in color:
            return color | {"rgb": [base(v) for v in color["rgb"]]}
        if "table" in color:
            return color | {"table": color["table"] | {"value": [base(v) for v in color["table"]["value"]]}}
        self.losses.add(plugin.place, f"'nonlinear: false' of {plugin} with a texture", "deeper colours")
        return color

    def of_roughplastic(self, plugin, values):
        made = self.of_plastic(plugin, values)
        rough = self.widths(plugin, values)["roughness"]
        if isinstance(rough, dict) or rough > 0.3:
            self.losses.add(plugin.place, "the energy loss of a rough coat between its facets",
                            "a coat without energy loss")
        return dataclasses.replace(made, content=made.content | {"roughness": rough})

    def of_pplastic(self, plugin, values):
        plugin.set("nonlinear", True, "boolean", plugin.place)
        self.losses.add(plugin.place, "polarisation of bsdf 'pplastic'", "bsdf 'plastic'")
        return self.of_roughplastic(plugin, values)

    def of_phong(self, plugin, values):
        exponent = values.constant(plugin, "exponent", 30.0)
        plugin.get("specular_reflectance")
        self.losses.add(plugin.place, "bsdf 'phong'", "plastic of the same width")
        color = values.reflectance(plugin, "diffuse_reflectance")
        return Surface({"type": "plastic", "reflectance": color,
                        "roughness": spectra.roughness(math.sqrt(2 / (max(exponent, 0) + 2)))})

    def of_twosided(self, plugin, values):
        parts = [part for part in self.nested(plugin, values) if part is not None]
        if not parts:
            return None
        if len(parts) == 1 or any(part.clear for part in parts):
            return dataclasses.replace(parts[0], both=True)
        names = [self.scene.material(part.name or f"{plugin.id}_{side}", part.content)
                 for part, side in zip(parts, ("front", "back"))]
        return Surface({"type": "two_sided", "front": names[0], "back": names[1]}, both=True,
                       opacity=parts[0].opacity)

    def of_mask(self, plugin, values):
        inner = self.nested(plugin, values)[0]
        opacity = values.number(plugin, "opacity", 0.5)
        if inner is None:
            return None
        if inner.opacity != 1:
            self.losses.add(plugin.place, "a mask of a mask", "the outer mask")
        opacity = opacity if isinstance(opacity, dict) else min(max(opacity, 0.0), 1.0)
        return dataclasses.replace(inner, opacity=opacity)

    def of_null(self, plugin, values):
        return None

    def of_bumpmap(self, plugin, values):
        self.losses.add(plugin.place, "a bump map", "the surface without it")
        self.scene_ignores(plugin)
        return self.nested(plugin, values)[0]

    def of_normalmap(self, plugin, values):
        inner = self.nested(plugin, values)[0]
        part = plugin.part("normalmap")
        image = values.texture(part, numbers=True) if part else None
        if inner is None or not isinstance(image, dict) or "texture" not in image \
                or inner.content["type"] in ("mix", "two_sided"):
            self.losses.add(plugin.place, "a normal map that crt cannot place", "the surface without it")
            return inner
        image = {key: value for key, value in image.items() if key not in ("color_space", "channel")}
        return dataclasses.replace(inner, content=inner.content | {"normal_map": image})

    def of_blendbsdf(self, plugin, values):
        parts = (self.nested(plugin, values) * 2)[:2]
        weight = values.number(plugin, "weight", 0.5)
        weight = weight if isinstance(weight, dict) else min(max(weight, 0.0), 1.0)
        if parts[0] is None:
            return None if parts[1] is None else dataclasses.replace(parts[1], opacity=weight)
        if parts[1] is None:
            return dataclasses.replace(parts[0], opacity=self.rest(plugin, weight))
        if any(part.opacity != 1 for part in parts):
            self.losses.add(plugin.place, "a mask within bsdf 'blendbsdf'", "without the mask")
        names = [self.scene.material(part.name or f"{plugin.id}_{number}", part.content)
                 for number, part in enumerate(parts)]
        return Surface({"type": "mix", "materials": names, "amount": weight},
                       clear=any(part.clear for part in parts), both=all(part.both for part in parts))

    def rest(self, plugin, weight):
        if not isinstance(weight, dict):
            return 1 - weight
        self.losses.add(plugin.place, "a texture that blends to bsdf 'null'", "half of the surface")
        return 0.5

    def of_mixturebsdf(self, plugin, values):
        self.losses.add(plugin.place, "bsdf 'mixturebsdf'", "its first bsdf")
        self.scene_ignores(plugin)
        return self.nested(plugin, values)[0]

    def of_coating(self, plugin, values):
        self.losses.add(plugin.place, f"the coat of {plugin}", "what lies below")
        self.scene_ignores(plugin)
        return self.nested(plugin, values)[0]

    of_roughcoating = of_coating

    def of_principled(self, plugin, values):
        aspect = math.sqrt(1 - 0.9 * min(max(values.constant(plugin, "anisotropic", 0.0), 0), 1))
        rough = values.number(plugin, "roughness", 0.5)
        made = {"type": "openpbr", "base_color": values.reflectance(plugin, "base_color")}
        bounded = rough if isinstance(rough, dict) else min(max(rough, 0.0), 1.0)
        made["specular_roughness"] = bounded
        if plugin.has("eta"):
            made["specular_ior"] = values.constant(plugin, "eta", 1.5)
        elif plugin.has("specular"):
            root = math.sqrt(0.08 * min(max(values.constant(plugin, "specular", 0.5), 0), 1))
            made["specular_ior"] = 2 / (1 - root) - 1
        for name, key in (("metallic", "base_metalness"), ("spec_trans", "transmission_weight"),
                          ("clearcoat", "coat_weight")):
            if plugin.has(name):
                weight = values.number(plugin, name, 0.0)
                made[key] = weight if isinstance(weight, dict) else min(max(weight, 0.0), 1.0)
        clear = bool(made.get("transmission_weight", 0) != 0)
        pure = 1 in (made.get("base_metalness", 0), made.get("transmission_weight", 0))
        if aspect != 1 and (isinstance(rough, dict) or not pure):
            self.losses.add(plugin.place, "'anisotropic' on a material other than pure metal or glass", "0")
        elif aspect != 1:
            made |= renamed_widths(spectra.anisotropic(bounded**2 / aspect, bounded**2 * aspect))
        if made.get("coat_weight"):
            self.losses.add(plugin.place, "'clearcoat' of bsdf 'principled'",
                            "a coat of a quarter of that weight")
            weight = made["coat_weight"]
            made["coat_weight"] = 0.25 if isinstance(weight, dict) else 0.25 * min(max(weight, 0), 1)
            made |= {"coat_ior": 1.5, "coat_darkening": 0}
            gloss = min(max(values.constant(plugin, "clearcoat_gloss", 0.0), 0), 1)
            made["coat_roughness"] = spectra.roughness(0.1 - 0.099 * gloss)
        if clear and made.pop("coat_weight", 0):
            made = {key: value for key, value in made.items() if not key.startswith("coat_")}
        for name in ("spec_tint", "sheen", "sheen_tint", "flatness"):
            if plugin.has(name) and values.number(plugin, name, 0.0) != 0:
                self.losses.add(plugin.place, f"'{name}' of bsdf 'principled'", "0")
        for name in ("diffuse_reflectance_sampling_rate", "main_specular_sampling_rate",
                     "clearcoat_sampling_rate"):
            plugin.get(name)
        return Surface(made, clear=clear)

    def of_principledthin(self, plugin, values):
        made = self.of_principled(plugin, values)
        content = made.content | {"geometry_thin_walled": True}
        passed = values.number(plugin, "diff_trans", 0.0) if plugin.has("diff_trans") else 0
        if isinstance(passed, dict):
            self.losses.add(plugin.place, "a texture of 'diff_trans'", "half of the light on each side")
            passed = 1
        if passed > 0:
            content |= {"subsurface_weight": 1, "subsurface_color": content["base_color"],
                        "subsurface_scatter_anisotropy": min(passed, 2) - 1}
        if content.get("transmission_weight", 0) != 0 and content["specular_roughness"] != 0:
            self.losses.add(plugin.place, "the roughness of bsdf 'principledthin' with 'spec_trans'",
                            "a smooth pane")
            content["specular_roughness"] = 0
        return Surface(content, clear=True, both=True)


def rough_mirror(color, widths):
    """A metal that reflects `color` straight on."""
    return {"type": "openpbr", "base_metalness": 1, "base_color": color} | renamed_widths(widths)


def renamed_widths(widths):
    """The keys of roughness as OpenPBR has them."""
    return {key if key.startswith("anisotropy") else "specular_" + key: value
            for key, value in widths.items()}
