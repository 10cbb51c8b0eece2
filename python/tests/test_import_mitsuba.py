"""Scenes of Mitsuba: crt's image of them is that of closed forms, and of the same scene written by hand."""

import math
import struct
import zlib

import numpy as np
import pytest
from imports import LUMINANCE, imported, near, pfm, quadrants, rendered, whats, write_png, written

import crt

LOOK = '<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>'


def scene(folder, body, *, look=LOOK, size=(16, 16), depth=6, camera='<float name="fov" value="40"/>',
          version="3.0.0", name="scene.xml"):
    return written(folder, name, f"""<scene version="{version}">
<integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
<sensor type="perspective">{camera}<transform name="to_world">{look}</transform>
<film type="hdrfilm"><integer name="width" value="{size[0]}"/><integer name="height" value="{size[1]}"/>
<rfilter type="box"/></film></sensor>
{body}
</scene>""")


def lamp(transform, rgb, shape="rectangle", more=""):
    return (f'<shape type="{shape}"><transform name="to_world">{transform}</transform>{more}'
            f'<emitter type="area"><rgb name="radiance" value="{rgb}"/></emitter></shape>')


def bsdf(folder, xml):
    """The materials of a sphere of this bsdf, by name, and which of them it has."""
    path = scene(folder, f'<shape type="sphere">{xml}</shape>')
    content = crt.import_scene(path).content
    return content["materials"], content["materials"][content["objects"][0]["material"]]


def test_a_thin_principled_bsdf_is_a_sheet(tmp_path):
    _, made = bsdf(tmp_path, '<bsdf type="principledthin"><rgb name="base_color" value="0.4 0.4 0.4"/>'
                             '<float name="diff_trans" value="1.5"/></bsdf>')
    assert made == {"type": "openpbr", "base_color": 0.4, "specular_roughness": 0.5,
                    "geometry_thin_walled": True, "subsurface_weight": 1, "subsurface_color": 0.4,
                    "subsurface_scatter_anisotropy": 0.5}


@pytest.mark.parametrize("shape", ["rectangle", "sphere"])
def test_a_bitmap_that_emits_stays_an_image(tmp_path, shape):
    """Its brightest number is the radiance, and a sphere a mesh."""
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[0, 1] = [8, 4, 2]
    written(tmp_path, "a.pfm", pfm(pixels))
    path = scene(tmp_path, f'<shape type="{shape}"><emitter type="area"><texture type="bitmap" '
                           'name="radiance"><string name="filename" value="a.pfm"/>'
                           '<string name="filter_type" value="nearest"/></texture></emitter></shape>')
    made = crt.import_scene(path)
    emission = made.content["objects"][0]["emission"]
    assert emission["radiance"] == {"rgb": [1, 1, 1], "space": "linear", "scale": 8}
    assert emission["color"]["filter"] == "nearest"
    assert {"mesh", "rectangle"} & set(made.content["objects"][0])
    seen = imported(path, 256)[..., 1]
    assert seen.max() == pytest.approx(4, rel=0.05) and 0.05 < np.count_nonzero(seen) / seen.size < 0.5
    assert not [loss for loss in made.losses if "emits" in loss.what]


def test_the_same_bits_as_a_scene_by_hand(tmp_path):
    path = scene(tmp_path, """
        <bsdf type="twosided" id="paint"><bsdf type="diffuse">
            <rgb name="reflectance" value="0.7 0.2 0.1"/></bsdf></bsdf>
        <shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="-90"/>
            <translate y="-1"/></transform><ref id="paint"/></shape>
        <shape type="sphere"><point name="center" x="0.5"/><float name="radius" value="0.75"/>
            <bsdf type="dielectric"><float name="int_ior" value="1.5"/>
                <float name="ext_ior" value="1"/></bsdf></shape>
        <emitter type="constant"><spectrum name="radiance" value="0.5"/></emitter>""")
    by_hand = crt.scene("""
        crt: 1
        camera: {position: [0, 0, 5], target: [0, 0, 4], fov: 40}
        film: {resolution: [16, 16]}
        integrator: {max_depth: 5}
        materials:
          paint: {type: diffuse, reflectance: {rgb: [0.7, 0.2, 0.1], space: linear}}
          glass: {type: dielectric, ior: 1.5}
        objects:
          - {rectangle: {size: [2, 2]}, material: paint, transform: [{matrix:
              [3, 0, 0, 0, 0, 0, 3, -1, 0, -3, 0, 0, 0, 0, 0, 1]}]}
          - {sphere: {radius: 0.75}, material: glass, transform: [{translate: [0.5, 0, 0]}]}
        environment: {radiance: 0.5}""")
    assert np.array_equal(imported(path), rendered(by_hand))


@pytest.mark.parametrize("mirror, side", [("", 1), ('<scale x="-1" y="1" z="1"/>', 0)])
def test_things_are_on_the_side_where_mitsuba_shows_them(tmp_path, mirror, side):
    body = lamp('<translate x="1.2" y="1.2"/>', "1 0 0") + lamp(
        '<translate x="-1.2" y="-1.2"/>', "0 0 1")
    seen = quadrants(imported(scene(tmp_path, body, look=mirror + LOOK)))
    assert seen[0, side, 0] > 0.5 and seen[1, 1 - side, 2] > 0.5
    assert seen[0, 1 - side].max() < 0.05 and seen[1, side].max() < 0.05


@pytest.mark.parametrize("axis, tangent_x", [
    ("x", math.tan(math.radians(30))), ("larger", math.tan(math.radians(30))),
    ("y", 2 * math.tan(math.radians(30))), ("smaller", 2 * math.tan(math.radians(30))),
    ("diagonal", math.tan(math.radians(30)) * 2 / math.sqrt(5))])
def test_fov_spans_its_axis(tmp_path, axis, tangent_x):
    half = 5 * tangent_x / 2
    camera = f'<float name="fov" value="60"/><string name="fov_axis" value="{axis}"/>'
    path = scene(tmp_path, lamp(f'<scale x="{half}" y="0.4"/>', "1"), size=(32, 16), camera=camera)
    lit = imported(path)[7, :, 1] > 0.5
    assert lit.tolist() == [False] * 8 + [True] * 16 + [False] * 8


def test_focal_lengths_are_of_film_of_35_mm(tmp_path):
    path = scene(tmp_path, "", camera='<string name="focal_length" value="50mm"/>', size=(30, 20))
    diagonal = math.hypot(36, 24) / 2 / 50
    near(crt.import_scene(path).content["camera"]["fov"],
         2 * math.degrees(math.atan(diagonal / math.hypot(1, 1.5))), 1e-9)


@pytest.mark.parametrize("depth, wanted", [(1, 1), (2, 1.5), (3, 1.75), (-1, 2)])
def test_depths_count_a_paths_edges(tmp_path, depth, wanted):
    """Within a cube that emits 1 and reflects a half, each edge more adds half of the one before."""
    inside = lamp("", "1", "cube", '<boolean name="flip_normals" value="true"/><bsdf type="diffuse"/>')
    image = imported(scene(tmp_path, inside, depth=depth, look=""), 256)
    near((image @ LUMINANCE).mean(), wanted)


def test_radiance_of_colours_and_spectra(tmp_path):
    near((imported(scene(tmp_path, lamp('<scale value="9"/>', "2")), 64) @ LUMINANCE).mean(), 2, 5e-3)
    even = lamp('<scale value="9"/>', "1").replace("<rgb", "<spectrum")
    seen = imported(scene(tmp_path, even), 256)[4:12, 4:12].mean((0, 1))
    assert np.allclose(seen, [1.2048, 0.9483, 0.9088], atol=0.01)  # Illuminant E in linear sRGB.


WALL = '<shape type="rectangle"><transform name="to_world"><scale value="9"/></transform>' \
       '<bsdf type="diffuse"><spectrum name="reflectance" value="0.6"/></bsdf></shape>'


@pytest.mark.parametrize("light, wanted", [
    ('<emitter type="point"><point name="position" z="2"/><rgb name="intensity" value="8"/></emitter>', 2),
    ('<emitter type="spot"><transform name="to_world"><lookat origin="0,0,2" target="0,0,0" up="0,1,0"/>'
     '</transform><rgb name="intensity" value="8"/></emitter>', 2),
    ('<emitter type="directional"><vector name="direction" z="-1"/><rgb name="irradiance" value="3"/>'
     '</emitter>', 3)])
def test_lights_without_a_surface(tmp_path, light, wanted):
    """The wall's middle reflects 0.6 E / π, with E = I / 2² from two units away."""
    path = scene(tmp_path, WALL + light, camera='<float name="fov" value="1"/>')
    near((imported(path, 64) @ LUMINANCE).mean(), 0.6 / math.pi * wanted, 5e-3)


@pytest.mark.parametrize("turn", ["", '<rotate y="1" angle="90"/>', '<rotate x="1" angle="90"/>',
                                  '<rotate z="1" angle="30"/><rotate y="1" angle="20"/>'])
@pytest.mark.parametrize("mirror", ["", '<scale x="-1" y="1" z="1"/>'])
def test_environments_shine_from_where_mitsubas_do(tmp_path, turn, mirror):
    rows = 16
    bright = np.full((rows, 2 * rows, 3), 0.01)
    bright[5:7, 11:13] = [1, 2, 4]
    written(tmp_path, "sky.pfm", pfm(bright))
    phi, theta = 2 * math.pi * 12 / (2 * rows), math.pi * 6 / rows
    towards = np.array([math.sin(phi) * math.sin(theta), math.cos(theta), -math.cos(phi) * math.sin(theta)])
    path = scene(tmp_path, f'<emitter type="envmap"><string name="filename" value="sky.pfm"/>'
                 f'<float name="scale" value="2"/><transform name="to_world">{turn}</transform></emitter>')
    for word, axis in (("z", [0, 0, 1]), ("x", [1, 0, 0]), ("y", [0, 1, 0])):
        if f'{word}="1" angle' in turn:
            degrees = turn.split(f'{word}="1" angle="')[1].split('"')[0]
            towards = turned(axis, float(degrees)) @ towards
    target = ",".join(map(str, towards))
    look = f'<lookat origin="0,0,0" target="{target}" up="0.1,0.9,0.2"/>'
    path.write_text(path.read_text().replace(LOOK, mirror + look))
    image = imported(path, 64)
    assert np.allclose(image[6:10, 6:10].mean((0, 1)) @ LUMINANCE, 2 * LUMINANCE @ [1, 2, 4], rtol=0.2)
    assert image[[0, 0, -1, -1], [0, -1, 0, -1]].max() < 0.3


def turned(axis, degrees):
    a, k = math.radians(degrees), -np.cross(np.eye(3), axis).T
    return np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * (k @ k)


def test_a_surface_without_two_sides_is_black_behind(tmp_path):
    sky = '<emitter type="constant"><rgb name="radiance" value="1"/></emitter>'
    for matrix, wanted in (("", 0.5), ('<rotate y="1" angle="180"/>', 0)):
        wall = f'<shape type="rectangle"><transform name="to_world">{matrix}<scale value="9"/>' \
               '</transform><bsdf type="diffuse"/></shape>'
        near((imported(scene(tmp_path, wall + sky), 64) @ LUMINANCE).mean(), wanted, 0.02)


def test_materials_become_those_of_crt(tmp_path):
    made, top = bsdf(tmp_path, '<bsdf type="roughconductor"><string name="material" value="Au"/>'
                     '<string name="distribution" value="ggx"/><float name="alpha" value="0.04"/></bsdf>')
    assert top["type"] == "two_sided" and made[top["back"]] == {"type": "diffuse", "reflectance": 0}
    assert made[top["front"]] == {"type": "rough_conductor", "metal": "Au", "roughness": 0.2}
    _, glass = bsdf(tmp_path, '<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf>')
    near(glass["ior"], 1.333 / 1.000277, 1e-8)
    made, top = bsdf(tmp_path, '<bsdf type="twosided"><bsdf type="roughconductor"><float name="alpha_u"'
                     ' value="0.1"/><float name="alpha_v" value="0.2"/></bsdf></bsdf>')
    a, r = top["specular_roughness_anisotropy"], top["specular_roughness"]
    near(r**2 * math.sqrt(2 / (1 + (1 - a)**2)), 0.2, 1e-9)
    near((1 - a) * 0.2, 0.1, 1e-9)
    assert top["anisotropy_rotation_deg"] == 90
    made, top = bsdf(tmp_path, '<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="diffuse"/>'
                     '</bsdf>')
    assert top["opacity"] == 0.25
    made, top = bsdf(tmp_path, '<bsdf type="twosided"><bsdf type="principled"><float name="metallic"'
                     ' value="1"/><float name="specular" value="0.5"/></bsdf></bsdf>')
    assert top["base_metalness"] == 1 and top["specular_roughness"] == 0.5
    near(top["specular_ior"], 1.5, 1e-9)


def test_factors_on_what_is_mirrored_are_tints(tmp_path):
    factor = '<spectrum name="specular_{}" value="0.25"/>'
    gold = '<string name="material" value="Au"/>'
    for kind, name, more in (("conductor", "reflectance", gold), ("roughconductor", "reflectance", gold),
                             ("plastic", "reflectance", ""), ("roughplastic", "reflectance", ""),
                             ("thindielectric", "transmittance", "")):
        made, _ = bsdf(tmp_path, f'<bsdf type="{kind}">{factor.format(name)}{more}</bsdf>')
        assert [m["tint"] for m in made.values() if "tint" in m] == [0.25], kind
        made, _ = bsdf(tmp_path, f'<bsdf type="{kind}">{more}</bsdf>')
        assert not any("tint" in m for m in made.values()), kind
    write_png(tmp_path / "t.png", np.uint8([[[0] * 3, [255] * 3]]))
    made, _ = bsdf(tmp_path, f'<bsdf type="roughconductor">{gold}<texture name="specular_reflectance" '
                   'type="bitmap"><string name="filename" value="t.png"/></texture></bsdf>')
    assert [m["tint"]["texture"] for m in made.values() if "tint" in m] == [tmp_path / "t.png"]


def test_images_of_roughness_become_crts(tmp_path):
    """crt's roughness is the root of Mitsuba's width; that of `principled` is crt's."""
    write_png(tmp_path / "t.png", np.uint8([[[255] * 3, [64] * 3]]))

    def image(name):
        return f'<texture name="{name}" type="bitmap"><string name="filename" value="t.png"/><boolean ' \
               'name="raw" value="true"/></texture>'
    for names in (["alpha"], ["alpha_u", "alpha_v"]):
        made, _ = bsdf(tmp_path, '<bsdf type="roughconductor"><string name="material" value="Au"/>'
                       + "".join(map(image, names)) + "</bsdf>")
        (rough,) = [m["roughness"] for m in made.values() if "roughness" in m]
        assert np.allclose(rough["texture"], [[1, (64 / 255)**0.5]], atol=1e-3)
    made, _ = bsdf(tmp_path, f'<bsdf type="principled">{image("roughness")}<float name="clearcoat" '
                   'value="1"/></bsdf>')
    (rough,) = [m["specular_roughness"] for m in made.values() if "specular_roughness" in m]
    assert "texture" in rough


def test_two_shapes_have_one_material_with_an_array(tmp_path):
    write_png(tmp_path / "t.png", np.uint8([[[0] * 3, [187] * 3]]))
    path = scene(tmp_path, '<bsdf type="mask" id="holes"><texture name="opacity" type="bitmap"><string '
                 'name="filename" value="t.png"/></texture><bsdf type="diffuse"/></bsdf>'
                 + '<shape type="rectangle"><ref id="holes"/></shape>' * 2)
    content = crt.import_scene(path).content
    (name,) = {thing["material"] for thing in content["objects"]}
    assert len(content["objects"]) == 2
    opacity = content["materials"][name]["opacity"]["texture"]
    assert np.allclose(opacity, [[0, 0.4969]], atol=1e-3)
    assert imported(path, 1).shape == (16, 16, 3)


def test_plastic_without_nonlinear_has_the_albedo_of_mitsubas(tmp_path):
    """The light that the coat transmits from crt's base and from Mitsuba's is the same after all rounds
    below it."""
    from crt.importers.mitsuba_materials import inner_reflectance
    inner = inner_reflectance(1.5)
    near(inner, 0.5964, 1e-3)  # Of index 1.5, as tables have it.
    made, _ = bsdf(tmp_path, '<bsdf type="plastic"><float name="int_ior" value="1.5"/><float name="ext_ior"'
                   ' value="1"/><spectrum name="diffuse_reflectance" value="0.3"/></bsdf>')
    base = next(m for m in made.values() if m["type"] == "plastic")["reflectance"]
    near(base / (1 - base * inner), 0.3 / (1 - inner), 1e-9)


def test_textures_have_their_top_where_mitsuba_has_it(tmp_path):
    """Row 0 of a bitmap is at v = 0, which OBJ files have at the top and rectangles at the bottom."""
    written(tmp_path, "t.pfm", pfm([[[0.8, 0, 0], [0, 0.8, 0]], [[0, 0, 0.8], [0.4, 0.4, 0.4]]]))
    written(tmp_path, "q.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
            "f 1/1 2/2 3/3 4/4\n")
    paint = '<bsdf type="diffuse"><texture name="reflectance" type="bitmap"><string name="filename"' \
            ' value="t.pfm"/><string name="filter_type" value="nearest"/></texture></bsdf>' \
            '<transform name="to_world"><scale value="1.8"/></transform></shape>' \
            '<emitter type="constant"/>'
    seen = quadrants(imported(scene(tmp_path, f'<shape type="rectangle">{paint}'), 64))
    assert seen[1, 0].argmax() == 0 and seen[1, 1].argmax() == 1 and seen[0, 0].argmax() == 2
    obj = f'<shape type="obj"><string name="filename" value="q.obj"/>{paint}'
    seen = quadrants(imported(scene(tmp_path, obj), 64))
    assert seen[0, 0].argmax() == 0 and seen[0, 1].argmax() == 1 and seen[1, 0].argmax() == 2


def serialized(meshes):
    """A file of version 4 of meshes (positions, faces)."""
    parts, offsets, length = [], [], 0
    for positions, faces in meshes:
        inner = struct.pack("<I", 0x1000) + b"name\0" + struct.pack("<QQ", len(positions), len(faces))
        inner += np.asarray(positions, "<f4").tobytes() + np.asarray(faces, "<u4").tobytes()
        offsets.append(length)
        parts.append(struct.pack("<HH", 0x041C, 4) + zlib.compress(inner))
        length += len(parts[-1])
    return b"".join(parts) + struct.pack(f"<{len(offsets)}QI", *offsets, len(offsets))


def test_meshes_are_read_and_turned_to_where_their_normals_point(tmp_path):
    corners = [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]
    written(tmp_path, "m.serialized", serialized([([[0, 0, 0]] * 3, [[0, 1, 2]]),
                                                  (corners, [[0, 1, 2], [0, 2, 3]])]))
    written(tmp_path, "back.obj", "".join("v {} {} {}\n".format(*c) for c in corners)
            + "vn 0 0 1\nf 4//1 3//1 2//1 1//1\n")
    for kind, name, more in (("serialized", "m.serialized", '<integer name="shape_index" value="1"/>'),
                             ("obj", "back.obj", "")):
        more += f'<string name="filename" value="{name}"/>'
        assert imported(scene(tmp_path, lamp("", "1", kind, more)))[8, 8, 1] > 0.9
        more += '<boolean name="flip_normals" value="true"/>'
        assert imported(scene(tmp_path, lamp("", "1", kind, more))).max() == 0


def test_instances_are_copies(tmp_path):
    group = '<shape type="shapegroup" id="g"><shape type="sphere"><float name="radius" value="0.5"/>' \
            '</shape></shape>'
    places = ['<translate x="-1"/>', '<scale x="1" y="2" z="1"/><translate x="1"/>']
    sky = '<emitter type="constant"/>'
    shown = group + "".join(f'<shape type="instance"><ref id="g"/><transform name="to_world">{place}'
                            "</transform></shape>" for place in places)
    copies = "".join('<shape type="sphere"><float name="radius" value="0.5"/><transform name="to_world">'
                     f"{place}</transform></shape>" for place in places)
    one = imported(scene(tmp_path, shown + sky), 64)
    assert np.allclose(one, imported(scene(tmp_path, copies + sky), 64), atol=0.03)
    middles = [one[8, 4] @ LUMINANCE, one[8, 11] @ LUMINANCE, one[5, 11] @ LUMINANCE]
    assert np.allclose(middles, 0.5, atol=0.05) and one[5, 4] @ LUMINANCE > 0.9


def test_parameters_includes_and_references(tmp_path):
    written(tmp_path, "parts/lamp.xml", '<scene version="3.0.0"><emitter type="area" id="light">'
            '<rgb name="radiance" value="$bright"/></emitter></scene>')
    path = scene(tmp_path, '<default name="bright" value="3"/><shape type="rectangle"><ref id="same"/>'
                 '<transform name="to_world"><scale value="9"/></transform></shape>'
                 '<include filename="parts/lamp.xml"/><alias id="light" as="same"/>')
    near((imported(path, 64) @ LUMINANCE).mean(), 3, 5e-3)
    near((rendered(crt.import_scene(path, {"bright": 5}).scene, 64) @ LUMINANCE).mean(), 5, 5e-3)


def test_names_of_versions_before_2(tmp_path):
    path = scene(tmp_path, '<shape type="sphere"><bsdf type="dielectric"><float name="intIOR" value="1.3"/>'
                 '<float name="extIOR" value="1"/></bsdf><transform name="toWorld"><lookAt origin="0,0,1"'
                 ' target="0,0,0" up="0,1,0"/></transform></shape>', version="0.6.0",
                 camera='<float name="fov" value="30"/><string name="fovAxis" value="y"/>')
    content = crt.import_scene(path).content
    assert content["materials"]["dielectric"]["ior"] == 1.3
    assert content["objects"][0]["transform"][0]["matrix"][11] == 1
    near(content["camera"]["fov"], 30, 1e-9)


def test_what_crt_lacks_is_listed_once_with_its_count(tmp_path):
    path = written(tmp_path, "s.xml", """<scene version="3.0.0">
<shape type="sphere"><bsdf type="hairy"/></shape>
<shape type="sphere"><bsdf type="hairy"/><float name="wobble" value="1"/></shape>
<shape type="sfere"/>
<emitter type="projector"/>
<shape type="cube"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<float name="wobble" value="2"/></texture></bsdf></shape>
</scene>""")
    assert whats(path) == {"2": ("bsdf 'hairy'", "grey, diffuse", 2),
                           "3": ("'wobble' of shape 'sphere'", "left out", 1),
                           "4": ("shape 'sfere'; did you mean 'sphere'?", "left out", 1),
                           "5": ("emitter 'projector'", "left out", 1),
                           "7": ("'wobble' of texture 'checkerboard'", "left out", 1)}


@pytest.mark.parametrize("text, line, column, phrase", [
    ("<scene>\n  <shape\n</scene>", 3, 1, "this is not XML"),
    ("<scene>\n  <shap type='sphere'/></scene>", 2, 3, "did you mean 'shape'?"),
    ("<scene>\n <shape type='sphere'><float name='radius' value='big'/></shape></scene>", 2, 23, "'big'"),
    ("<scene><shape type='sphere'><float name='radius' value='nan'/></shape></scene>", 1, 29, "finite"),
    ("<scene>\n<shape type='obj'><string name='filename' value='no.obj'/></shape></scene>", 2, 19,
     "does not exist"),
    ("<scene><include filename='scene.xml'/></scene>", 1, 8, "includes itself"),
    ("<scene><shape type='sphere'><ref id='b'/></shape><bsdf type='diffuse' id='bb'/></scene>", 1, 29,
     "did you mean 'bb'?"),
    ("<scene><bsdf type='twosided' id='a'><ref id='a'/></bsdf></scene>", 1, 8, "contains itself"),
    ("<scene><integer name='x' value='$n'/></scene>", 1, 8, "-D n=VALUE"),
    ("<scene><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='1000000000'/>"
     "</film></sensor></scene>", 1, 35, "65535"),
    ("<world/>", 1, 1, "<world>"),
    ("<scene><sensor type='perspective'>\n<float name='fov' value='180'/></sensor></scene>", 2, 1,
     "smaller than 180 degrees"),
    ("<scene><shape type='ply'>\n<string name='filename' value='.'/></shape></scene>", 2, 1, "is a folder"),
    ("<scene><shape type='sphere'><string name='center' value='0 0 1'/></shape></scene>", 1, 29,
     "three numbers"),
    ('<!DOCTYPE s [<!ENTITY a "b">]><scene/>', 1, 25, "entities"),
])
def test_errors_have_their_place(tmp_path, text, line, column, phrase):
    path = written(tmp_path, "scene.xml", text)
    with pytest.raises(crt.Error, match=".") as caught:
        crt.import_scene(path)
    assert phrase in str(caught.value)
    assert caught.value.kind == crt.Kind.SCENE
    assert (caught.value.file, caught.value.line, caught.value.column) == (str(path), line, column)
    assert str(caught.value).startswith(f"{path}:{line}:{column}: error: ")


def test_grey_light_is_white(tmp_path):
    seen = imported(scene(tmp_path, lamp('<scale value="9"/>', "2")), 256).mean((0, 1))
    assert np.allclose(seen, 2, atol=0.02)


CHECKER = '<bsdf type="twosided"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">' \
          '<spectrum name="color0" value="0.1"/><spectrum name="color1" value="0.9"/>' \
          "</texture></bsdf></bsdf>"


def test_textures_on_shapes_have_their_coordinates(tmp_path):
    """Squares of Mitsuba's checkerboard have a side of one half; v goes down its spheres."""
    path = scene(tmp_path, "".join(f'<shape type="{shape}">{CHECKER}</shape>'
                                   for shape in ("rectangle", "sphere")))
    made = list(crt.import_scene(path).content["materials"].values())
    assert made[0]["reflectance"] == {"checker": [0.1, 0.9], "scale": [2, 2]}
    assert made[1]["reflectance"] == {"checker": [0.1, 0.9], "scale": [2, -2], "offset": [0, 2]}


def test_a_mesh_is_smooth_where_mitsuba_works_normals_out(tmp_path):
    written(tmp_path, "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    written(tmp_path, "n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 2\nf 1//1 2//1 3//1\n")
    flip = '<boolean name="flip_normals" value="true"/>'
    path = scene(tmp_path, "".join(
        f'<shape type="obj"><string name="filename" value="{name}"/>{more}</shape>' for name, more in
        (("m.obj", ""), ("m.obj", '<boolean name="face_normals" value="true"/>'), ("n.obj", ""),
         ("n.obj", flip))))
    first, flat, own, turned_over = crt.import_scene(path).content["objects"]
    assert (first["normals"], first["crease_angle_deg"]) == ("smooth", 180)
    assert flat["normals"] == "flat" and "normals" not in own
    assert turned_over["mesh"]["normals"].tolist() == [[0, 0, -2]] * 3


def test_older_names_in_newer_scenes_are_large_losses(tmp_path):
    path = written(tmp_path, "s.xml", """<scene version="3.0.0">
<shape type="sphere" id="a"><transform name="toWorld"><translate x="1"/></transform>
<bsdf type="plastic"><float name="intIOR" value="1.3"/>
<texture type="checkerboard" name="diffuseReflectance"/></bsdf></shape>
<shape type="sphere"><float name="wobbleWidth" value="1"/></shape>
<integrator type="sppm"><integer name="maxDepth" value="3"/></integrator>
<shape type="instance">
<transform name="toWorld"/><shape type="shapegroup"><shape type="sphere"/></shape></shape>
</scene>""")
    found = {loss.first.line: (loss.what, loss.large) for loss in crt.import_scene(path).losses
             if loss.first.line != 6 or loss.large}
    assert found == {2: ("'toWorld' of shape 'sphere'; did you mean 'to_world'?", True),
                     3: ("'intIOR' of bsdf 'plastic'; did you mean 'int_ior'?", True),
                     4: ("'diffuseReflectance' of bsdf 'plastic'; did you mean 'diffuse_reflectance'?",
                         True),
                     5: ("'wobbleWidth' of shape 'sphere'", False),
                     6: ("'maxDepth' of integrator 'sppm'; did you mean 'max_depth'?", True),
                     8: ("'toWorld' of shape 'instance'; did you mean 'to_world'?", True)}
