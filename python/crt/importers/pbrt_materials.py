"""Materials of pbrt as materials of crt."""

import pathlib

import numpy as np

from . import spectra
from .images import powered
from .losses import present, refuse, step, suggestion
from .mitsuba_materials import ROUGH_METAL, renamed_widths, rough_mirror

GREY = {"type": "diffuse", "reflectance": 0.5}
OF_VERSION_3 = {"disney", "fourier", "glass", "kdsubsurface", "matte", "metal", "mirror", "plastic",
                "substrate", "translucent", "uber"}
COPPER = {"metal": "Cu"}


class Materials:
    def __init__(self, state, scene, values):
        self.state, self.scene, self.losses, self.values = state, scene, scene.losses, values
        self.made = {}

    def name(self, material, opacity, inside):
        """The name of a material for objects, or None for an interface. `material`: Parameters, or a name
        with its place, or None. `opacity`: of the shape. `inside`: the name of a medium."""
        content, wanted = self.content(material)
        if content is None:
            return None
        if opacity != 1:
            key = "geometry_opacity" if content["type"] == "openpbr" else "opacity"
            content = content | {key: opacity}
        return self.scene.material(wanted, self.absorbing(content, inside))

    def content(self, material):
        if material is None:
            return GREY, "default"
        if isinstance(material, tuple):
            wanted, place = material
            if wanted == "" or wanted not in self.state.materials:
                refuse(place, f"there is no material '{wanted}'" + suggestion(wanted, self.state.materials))
            found = self.state.materials[wanted]
        else:
            found, wanted = material, material.name
        if id(found) not in self.made:
            self.made[id(found)] = None  # A mix of itself is left out.
            self.made[id(found)] = self.of(found)
        return self.made[id(found)], wanted

    def of(self, found):
        step(found.place)
        kind = found.name or "interface"
        make = getattr(self, "of_" + kind, None)
        if make is None:
            if kind in OF_VERSION_3:
                self.state.is_version_3(found.place)
            known = [name[3:] for name in dir(self) if name.startswith("of_")]
            self.losses.add(found.place, f"{found}{suggestion(kind, known)}", "grey, diffuse", large=True)
            found.left.clear()
            return GREY
        made = make(found)
        if made is not None and found.has("normalmap"):
            made = self.mapped(found, made)
        if found.has("displacement"):
            found.raw("displacement")
            self.losses.add(found.values["displacement"][2], "a bump map ('displacement')",
                            "the surface without it")
        for left in sorted(found.left - {"maxdepth", "nsamples", "type"}):
            self.losses.add(found.values[left][2], f"'{left}' of {found}")
        return made

    def mapped(self, found, made):
        path = present(self.state.file(found.place, found.string("normalmap")), found.values["normalmap"][2])
        if made["type"] == "mix":
            self.losses.add(found.place, "the normal map of a mix", "the surface without it")
            return made
        return made | {"normal_map": {"texture": pathlib.Path(path)}}

    def absorbing(self, content, inside):
        """Glass with the absorption of the medium within it."""
        medium = self.state.media.get(inside)
        glass = content["type"] in ("dielectric", "rough_dielectric")
        if medium is None or not glass or "opacity" in content:  # crt wants such a body closed.
            return content
        scatters = not medium.has("sigma_s") or np.any(medium.raw("sigma_s")[1] != 0)
        if medium.name != "homogeneous" or medium.has("preset") or scatters:
            return content
        absorbed = self.values.unbounded(medium, "sigma_a", 1.0)
        return content | {"absorption": spectra.scaled(absorbed, medium.number("scale", 1))}

    # Roughness: pbrt's `roughness` is the square of GGX's width unless `remaproughness` is false.

    def widths(self, found, prefix=""):
        remap = found.boolean("remaproughness", True)
        along = self.values.number(found, prefix + "roughness", 0.0)
        across = along
        if found.has(prefix + "uroughness") or found.has(prefix + "vroughness"):
            along, across = (self.values.number(found, prefix + name, along)
                             for name in ("uroughness", "vroughness"))
        if isinstance(along, dict) or isinstance(across, dict):
            if along != across:
                self.losses.add(found.place, "two textures of roughness", "the first for both")
            made = along if isinstance(along, dict) else across
            return {"roughness": self.powered(found, made, 0.25 if remap else 0.5)}
        along, across = ((max(v, 0) ** 0.5 if remap else max(v, 0)) for v in (along, across))
        if min(along, across) == 0 or along == across:
            return {"roughness": spectra.roughness(max(along, across))}
        return spectra.anisotropic(along, across)

    def powered(self, found, made, power):
        """A texture with its values to a power."""
        powers = powered(made, power)
        if powers is None:
            self.losses.add(found.place, f"a texture of roughness of {found}", "roughness 0.3")
        return 0.3 if powers is None else powers

    def single(self, found, widths):
        """Roughness where crt's is the same in all directions."""
        if len(widths) > 1:
            self.losses.add(found.place, f"a direction of roughness of {found}", "one roughness")
        return widths["roughness"]

    # By the names of pbrt.

    def of_interface(self, found):
        return None

    def of_diffuse(self, found):
        return {"type": "diffuse", "reflectance": self.values.reflectance(found, "reflectance", 0.5)}

    def of_coateddiffuse(self, found):
        rough = self.single(found, self.widths(found))
        made = self.of_diffuse(found) | {"type": "plastic", "roughness": rough}
        eta = self.values.unbounded(found, "eta", 1.5)
        index = eta if isinstance(eta, (int, float)) else spectra.mean(eta) or 1.5
        self.no_coat_medium(found)
        return made | {"ior": min(max(index, 1), 10)}

    def no_coat_medium(self, found):
        for name in ("thickness", "g"):
            found.left.discard(name)
        if self.values.reflectance(found, "albedo", 0.0) != 0:
            self.losses.add(found.place, f"scattering within the coat of {found}", "a clear coat")

    def metal(self, found, prefix=""):
        if not (found.has(prefix + "eta") or found.has(prefix + "k")):
            return COPPER
        eta = self.values.unbounded(found, prefix + "eta", {"data": "metals/Cu/n"})
        k = self.values.unbounded(found, prefix + "k", {"data": "metals/Cu/k"})
        for metal in spectra.METAL_COLORS:
            if (eta, k) == ({"data": f"metals/{metal}/n"}, {"data": f"metals/{metal}/k"}):
                return {"metal": metal}
        eta, changed = spectra.index_above_0(eta)
        if changed:
            self.losses.add(found.place, "an 'eta' of 0 or less", f"{spectra.LEAST_INDEX}")
        return {"eta": eta, "k": k}

    def of_conductor(self, found):
        widths = self.widths(found)
        if found.has("reflectance"):
            self.losses.add(found.place, "a conductor by its reflectance", "OpenPBR's metal of that colour")
            return rough_mirror(self.values.reflectance(found, "reflectance", 0.5), widths)
        metal = self.metal(found)
        if widths["roughness"] == 0:
            return {"type": "conductor"} | metal
        self.losses.add(found.place, *ROUGH_METAL)
        return {"type": "rough_conductor"} | metal | widths

    def of_coatedconductor(self, found):
        below = self.widths(found, "conductor.")
        above = self.single(found, self.widths(found, "interface."))
        if found.has("reflectance"):
            color = self.values.reflectance(found, "reflectance", 0.5)
        else:
            metal = self.metal(found, "conductor.")
            color = spectra.rgb(spectra.METAL_COLORS.get(metal.get("metal", "Al")))
            if "metal" not in metal:
                self.losses.add(found.place, "the index of a coated metal", "the colour of aluminium")
        self.losses.add(found.place, f"{found}", "OpenPBR's metal under a coat")
        index = self.values.unbounded(found, "interface.eta", 1.5)
        self.no_coat_medium(found)
        return {"type": "openpbr", "base_metalness": 1, "base_color": color} | renamed_widths(below) | {
            "coat_weight": 1, "coat_roughness": above,
            "coat_ior": min(max(index if isinstance(index, (int, float)) else 1.5, 1), 10)}

    def index(self, found):
        made = self.values.unbounded(found, "eta", 1.5)
        return min(max(made, 1e-3), 1000) if isinstance(made, (int, float)) else made

    def of_dielectric(self, found):
        widths = self.widths(found)
        if widths["roughness"] == 0:
            return {"type": "dielectric", "ior": self.index(found)}
        return {"type": "rough_dielectric", "ior": self.index(found)} | widths

    def of_thindielectric(self, found):
        return {"type": "thin_dielectric", "ior": self.index(found)}

    def of_diffusetransmission(self, found):
        scale = found.number("scale", 1)
        both = {key: self.values.reflectance(found, key, 0.25) for key in ("reflectance", "transmittance")}
        if scale != 1 and any("texture" in str(value) for value in both.values()):
            self.losses.add(found.place, f"'scale' of {found} with a texture", "1")
        elif scale != 1:
            both = {key: spectra.scaled(value, scale) for key, value in both.items()}
        most = sum(spectra.largest(value) for value in both.values())
        if most > 1:
            self.losses.add(found.place, f"reflectance and transmittance of {found} above 1 together",
                            "as much less of both")
            both = {key: spectra.scaled(value, 1 / most) for key, value in both.items()}
        return {"type": "translucent"} | both

    def of_subsurface(self, found):
        self.losses.add(found.place, f"{found}", "plastic", large=True)
        color = self.values.reflectance(found, "reflectance", 0.5)
        made = {"type": "plastic", "reflectance": color, "roughness": self.single(found, self.widths(found)),
                "ior": min(max(found.number("eta", 1.33), 1), 10)}
        found.left.clear()
        return made

    def of_hair(self, found):
        self.losses.add(found.place, f"{found}", "diffuse", large=True)
        color = self.values.reflectance(found, "reflectance", spectra.rgb([0.2, 0.12, 0.07]))
        found.left.clear()
        return {"type": "diffuse", "reflectance": color}

    def of_measured(self, found):
        self.losses.add(found.place, f"{found}", "grey, diffuse", large=True)
        found.left.clear()
        return GREY

    def of_mix(self, found):
        raw = found.raw("materials")
        names = list(raw[1]) if raw else []
        if len(names) != 2:
            refuse(found.place, f"a mix is of two materials, not {len(names)}")
        amount = self.values.number(found, "amount", 0.5)
        parts = [self.content((name, raw[2])) for name in names]
        amount = amount if isinstance(amount, dict) else min(max(amount, 0.0), 1.0)
        if None in (parts[0][0], parts[1][0]):
            return self.part_of(found, parts, amount)
        opacity = any("opacity" in part or "geometry_opacity" in part for part, _ in parts)
        if opacity:
            self.losses.add(found.place, "a mix of surfaces with holes", "surfaces without holes")
        names = [self.scene.material(wanted, {key: value for key, value in part.items()
                                              if key not in ("opacity", "geometry_opacity")})
                 for part, wanted in parts]
        return {"type": "mix", "materials": names, "amount": amount}

    def part_of(self, found, parts, amount):
        """A mix with an interface: as much of the other."""
        solid = next((part for part, _ in parts if part is not None), None)
        if solid is None:
            return None
        if parts[0][0] is not None:
            if isinstance(amount, dict):
                self.losses.add(found.place, "a texture that mixes to an interface", "half of the surface")
            amount = 0.5 if isinstance(amount, dict) else 1 - amount
        return solid | {"geometry_opacity" if solid["type"] == "openpbr" else "opacity": amount}
