"""Spectra, textures and materials of crt as Mitsuba 3 has them; what has no counterpart is refused."""

import mitsuba as mi

from .program import Failure


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
