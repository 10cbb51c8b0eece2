"""Scenes of pbrt: crt's image of them is that of closed forms, and of the same scene written by hand."""

import gzip
import math

import numpy as np
import pytest
from imports import LUMINANCE, imported, near, pfm, quadrants, rendered, whats, write_png, written

import crt

LOOK = "LookAt 0 0 -5  0 0 0  0 1 0"


def scene(folder, body, *, before=LOOK, size=(16, 16), depth=5, camera='"float fov" 40', name="scene.pbrt"):
    return written(folder, name, f"""{before}
Camera "perspective" {camera}
Film "rgb" "integer xresolution" {size[0]} "integer yresolution" [ {size[1]} ]
PixelFilter "box"
Integrator "path" "integer maxdepth" [{depth}]
WorldBegin
{body}
""")


def quad(x=0, y=0, half=0.5, z=0, more=""):
    """It faces the camera of LOOK, which looks along z."""
    left, right, low, high = x - half, x + half, y - half, y + half
    return f"""Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] {more} "point3 P" [
        {left} {low} {z}  {right} {low} {z}  {right} {high} {z}  {left} {high} {z}]"""


def lamp(body, light):
    return f'AttributeBegin\nAreaLightSource "diffuse" {light}\n{body}\nAttributeEnd'


def luminance(image):
    return float((image @ LUMINANCE).mean())


def material(folder, text):
    """The material of a sphere of this kind."""
    content = crt.import_scene(scene(folder, text + '\nShape "sphere"')).content
    return content["materials"][content["objects"][0]["material"]]


def test_the_same_bits_as_a_scene_by_hand(tmp_path):
    path = scene(tmp_path, """
        LightSource "infinite" "rgb L" [0.5 0.6 0.7] "float scale" 2
        Material "diffuse" "rgb reflectance" [0.7 0.2 0.1]
        AttributeBegin
          Translate 0 -1 0
          Rotate 90 1 0 0
          Shape "disk" "float radius" 3
        AttributeEnd
        Material "dielectric" "float eta" 1.4
        AttributeBegin Translate 0.5 0 0 Shape "sphere" "float radius" 0.75 AttributeEnd""",
                 before="Scale -1 1 1\n" + LOOK)
    by_hand = crt.scene("""
        crt: 1
        camera: {position: [0, 0, -5], target: [0, 0, -4], fov: 40}
        film: {resolution: [16, 16]}
        integrator: {max_depth: 5}
        materials:
          paint: {type: diffuse, reflectance: {rgb: [0.7, 0.2, 0.1], space: linear}}
          glass: {type: dielectric, ior: 1.4}
        objects:
          - {disk: {radius: 3}, material: paint, transform: [{matrix:
              [1, 0, 0, 0, 0, 0, -1, -1, 0, 1, 0, 0, 0, 0, 0, 1]}]}
          - {sphere: {radius: 0.75}, material: glass, transform: [{translate: [0.5, 0, 0]}]}
        environment: {radiance: {rgb: [0.5, 0.6, 0.7], space: linear, scale: 2}}""")
    assert np.array_equal(imported(path), rendered(by_hand))


@pytest.mark.parametrize("before, side", [(LOOK, 1), ("Scale -1 1 1\n" + LOOK, 0)])
def test_things_are_on_the_side_where_pbrt_shows_them(tmp_path, before, side):
    """pbrt's world is left-handed: seen along z with y up, x is to the right."""
    body = lamp(quad(1.2, 1.2, 1), '"rgb L" [1 0 0]') + "\n" + lamp(quad(-1.2, -1.2, 1), '"rgb L" [0 0 1]')
    seen = quadrants(imported(scene(tmp_path, body, before=before), 64))
    assert seen[0, side, 0] > 0.5 and seen[1, 1 - side, 2] > 0.5
    assert seen[0, 1 - side].max() < 0.05 and seen[1, side].max() < 0.05


@pytest.mark.parametrize("camera, size, half", [
    ('"float fov" 60', (32, 16), 1), ('"float fov" 60', (16, 32), 1),
    ('"float fov" 60 "float screenwindow" [-4 4 -2 2]', (32, 16), 2)])
def test_fov_spans_the_shorter_side(tmp_path, camera, size, half):
    reach = 5 * math.tan(math.radians(30)) * half / 2
    path = scene(tmp_path, lamp(quad(half=reach), '"rgb L" [1 1 1]'), size=size, camera=camera)
    lit = imported(path)[:, :, 1] > 0.4
    along = lit[size[1] // 2] if size[0] < size[1] else lit[:, size[0] // 2]
    assert along.tolist() == [False] * 4 + [True] * 8 + [False] * 4


@pytest.mark.parametrize("depth, wanted", [(0, 1), (1, 1.5), (2, 1.75)])
def test_depths_count_bounces(tmp_path, depth, wanted):
    """Within a cube that emits 1 and reflects a half, each bounce more adds half of the one before."""
    corners = [(x, y, z) for z in (-9, 9) for y in (-9, 9) for x in (-9, 9)]
    sides = "0 2 1 1 2 3  4 5 6 5 7 6  0 1 4 1 5 4  2 6 3 3 6 7  0 4 2 2 4 6  1 3 5 3 7 5"
    numbers = " ".join(str(number) for corner in corners for number in corner)
    inside = f'ReverseOrientation Shape "trianglemesh" "integer indices" [{sides}] "point3 P" [{numbers}]'
    near(luminance(imported(scene(tmp_path, lamp(inside, '"rgb L" [1 1 1]'), depth=depth), 256)), wanted)


@pytest.mark.parametrize("light, wanted", [
    ('"rgb L" [2 2 2]', 2), ('"blackbody L" 3000 "float scale" 3', 3),
    ('"rgb L" [1 1 1] "float scale" 0.5', 0.5),
    ('"spectrum L" [360 5 830 5]', 1), ('"spectrum L" "stdillum-A"', 1),
    ('"rgb L" [1 1 1] "float power" 400', 400 / (math.pi * 400)),
    ('"rgb L" [1 1 1] "float power" 400 "bool twosided" true', 400 / (2 * math.pi * 400))])
def test_radiance_of_area_lights(tmp_path, light, wanted):
    """pbrt scales the spectra of lights to luminance 1; the quad has an area of 400."""
    near(luminance(imported(scene(tmp_path, lamp(quad(half=10), light)), 128)), wanted)


def test_area_of_round_lights(tmp_path):
    for shape, area in (('"sphere" "float radius" 2', 16 * math.pi),
                        ('"disk" "float radius" 2', 4 * math.pi),
                        ('"cylinder" "float radius" 2', 8 * math.pi)):
        light = '"rgb L" [1 1 1] "float power" 1'
        path = scene(tmp_path, lamp(f"Scale 2 2 2 Shape {shape}", light))
        made = crt.import_scene(path).content["objects"][0]["emission"]["radiance"]
        near(made["scale"], 1 / (math.pi * 4 * area), 1e-9)


@pytest.mark.parametrize("light, wanted", [
    ('LightSource "point" "point3 from" [0 0 -2] "rgb I" [8 8 8]', 2),
    ('LightSource "point" "point3 from" [0 0 -2] "blackbody I" 4000 "float power" 100',
     100 / (16 * math.pi)),
    ('Translate 0 0 -2 LightSource "spot" "rgb I" [8 8 8]', 2),
    ('LightSource "distant" "rgb L" [3 3 3]', 3),
    ('LightSource "distant" "point3 from" [0 0 0] "point3 to" [0 0 2] "float illuminance" 7', 7),
    ('LightSource "infinite" "rgb L" [2 2 2]', 2 * math.pi)])
def test_other_lights(tmp_path, light, wanted):
    """The wall's middle reflects 0.6 E / π, with E = I / 2² from two units away."""
    wall = f'Material "diffuse" "rgb reflectance" [.6 .6 .6]\n{quad(half=9)}\n'
    path = scene(tmp_path, wall + light, camera='"float fov" 1', depth=1)
    near(luminance(imported(path, 256)), 0.6 / math.pi * wanted)


@pytest.mark.parametrize("turn", ["", "Rotate -90 1 0 0", "Rotate 40 0 1 0 Rotate 30 1 0 0"])
@pytest.mark.parametrize("mirror", ["", "Scale -1 1 1\n"])
@pytest.mark.parametrize("texel, towards", [
    # Of the square that is folded to a sphere: its middle is +z, its corners -z, and edges x and y.
    ((16, 16), (0, 0, 1)), ((31, 16), (1, 0, 0)), ((16, 31), (0, 1, 0)), ((24, 16), "east"),
    ((1, 1), (0, 0, -1))])
def test_environments_are_unfolded(tmp_path, turn, mirror, texel, towards):
    side = 32
    bright = np.full((side, side, 3), 0.01)
    x, y = texel
    if towards == (0, 0, -1):
        for corner in ((0, 0), (0, side - 1), (side - 1, 0), (side - 1, side - 1)):
            bright[corner] = 5
    else:
        bright[y - 1:y + 1, x - 1:x + 1] = 5
    if towards == "east":  # Halfway: the radius r is 0.5, and z = 1 - r².
        towards = (math.sqrt(1 - 0.75**2), 0, 0.75)
    written(tmp_path, "sky.pfm", pfm(bright))
    axes = {"": np.eye(3), "Rotate -90 1 0 0": turned([1, 0, 0], -90)}.get(
        turn, turned([0, 1, 0], 40) @ turned([1, 0, 0], 30))
    target = " ".join(map(str, axes @ towards))
    path = scene(tmp_path, f'{turn}\nLightSource "infinite" "string filename" "sky.pfm"',
                 before=f"{mirror}LookAt 0 0 0  {target}  0.1 0.9 0.2", camera='"float fov" 60')
    image = imported(path, 32) @ LUMINANCE
    middle = image[6:10, 6:10].mean()
    assert middle > 1 and middle > 4 * max(image[[0, 0, -1, -1], [0, -1, 0, -1]])


def turned(axis, degrees):
    a, k = math.radians(degrees), -np.cross(np.eye(3), axis).T
    return np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * (k @ k)


def test_the_side_that_shines(tmp_path):
    """That of the normal: by the order of vertices, by N where there is one, and the other by
    ReverseOrientation; a transform that mirrors changes nothing."""
    light = '"rgb L" [1 1 1]'
    towards, away = '"normal3 N" [0 0 -1 0 0 -1 0 0 -1 0 0 -1]', '"normal3 N" [0 0 1 0 0 1 0 0 1 0 0 1]'
    for body, wanted in ((quad(half=9), 1), ("ReverseOrientation " + quad(half=9), 0),
                         ("Scale -1 1 1 " + quad(half=9), 1), (quad(half=9, more=towards), 1),
                         (quad(half=9, more=away), 0), ("ReverseOrientation " + quad(half=9, more=away), 1)):
        assert (luminance(imported(scene(tmp_path, lamp(body, light)))) > 0.5) == wanted, body


def ply(path, normals=False):
    lines = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {a}" for a in "xyz"),
             "element face 1", "property list uchar int vertex_indices", "end_header",
             "-9 -9 0", "-9 9 0", "9 9 0", "9 -9 0", "4 0 1 2 3", ""]
    data = "\n".join(lines).encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)


@pytest.mark.parametrize("name", ["q.ply", "q.ply.gz"])
def test_meshes_of_files(tmp_path, name):
    ply(tmp_path / name)
    shape = f'Shape "plymesh" "string filename" "{name}"'
    near(luminance(imported(scene(tmp_path, lamp(shape, '"rgb L" [1 1 1]')), 64)), 1)
    assert imported(scene(tmp_path, lamp("ReverseOrientation " + shape, '"rgb L" [1 1 1]'))).max() == 0


def test_bilinear_patches_and_parts_of_shapes(tmp_path):
    patch = 'Shape "bilinearmesh" "point3 P" [-9 -9 0  -9 9 0  9 -9 0  9 9 0]'
    near(luminance(imported(scene(tmp_path, lamp(patch, '"rgb L" [1 1 1]')), 64)), 1)
    half = lamp('Shape "disk" "float radius" 9 "float phimax" 180', '"rgb L" [1 1 1] "bool twosided" true')
    seen = quadrants(imported(scene(tmp_path, half), 64)) @ LUMINANCE
    assert seen[0].min() > 0.95 and seen[1].max() < 0.05


@pytest.mark.parametrize("text, wanted", [
    ('Material "diffuse"', {"type": "diffuse", "reflectance": 0.5}),
    ('Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.0625',
     {"type": "rough_conductor", "metal": "Au", "roughness": 0.5}),
    ('Material "conductor" "float roughness" 0.25 "bool remaproughness" false',
     {"type": "rough_conductor", "metal": "Cu", "roughness": 0.5}),
    ('Material "dielectric"', {"type": "dielectric", "ior": 1.5}),
    ('Material "dielectric" "spectrum eta" "glass-BK7"', {"type": "dielectric", "ior": {"glass": "N-BK7"}}),
    ('Material "thindielectric" "float eta" 1.3', {"type": "thin_dielectric", "ior": 1.3}),
    ('Material "diffusetransmission" "rgb reflectance" [.2 .2 .2] "rgb transmittance" [.1 .1 .1] '
     '"float scale" 2', {"type": "translucent", "reflectance": 0.4, "transmittance": 0.2}),
    ('Material "diffusetransmission"',
     {"type": "translucent", "reflectance": 0.25, "transmittance": 0.25}),
    ('Material "coateddiffuse" "rgb reflectance" [.2 .2 .2] "float roughness" 0.0625',
     {"type": "plastic", "reflectance": 0.2, "roughness": 0.5, "ior": 1.5}),
    ('MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [.1 .1 .1]\n'
     'MakeNamedMaterial "b" "string type" "interface"\n'
     'Material "mix" "string materials" ["a" "b"] "float amount" 0.25',
     {"type": "diffuse", "reflectance": 0.1, "opacity": 0.75}),
    ('MakeNamedMedium "ink" "string type" "homogeneous" "rgb sigma_s" [0 0 0] "rgb sigma_a" [2 2 2]\n'
     'MediumInterface "ink" "" Material "dielectric"', {"type": "dielectric", "ior": 1.5, "absorption": 2}),
    ('Texture "t" "spectrum" "checkerboard" "rgb tex1" [.1 .1 .1] "rgb tex2" [.9 .9 .9] "float uscale" 4\n'
     'Texture "half" "spectrum" "scale" "texture tex" "t" "float scale" 0.5\n'
     'Material "diffuse" "texture reflectance" "half"',
     {"type": "diffuse", "reflectance": {"checker": [0.05, 0.45], "scale": [4, 1]}}),
    ('Attribute "material" "rgb reflectance" [.3 .3 .3] Material "diffuse"',
     {"type": "diffuse", "reflectance": 0.3}),
    ('Attribute "shape" "float alpha" 0.5', {"type": "diffuse", "reflectance": 0.5, "opacity": 0.5})])
def test_materials_become_those_of_crt(tmp_path, text, wanted):
    assert material(tmp_path, text) == wanted


def test_images_have_their_top_where_pbrt_has_it(tmp_path):
    """v = 0 is at the bottom of an image; a quad without coordinates has those of its triangles."""
    written(tmp_path, "t.pfm", pfm([[[0.8, 0, 0], [0, 0.8, 0]], [[0, 0, 0.8], [0.4, 0.4, 0.4]]]))
    body = 'LightSource "infinite"\nTexture "t" "spectrum" "imagemap" "string filename" "t.pfm"' \
           ' "string filter" "point"\nMaterial "diffuse" "texture reflectance" "t"\n'
    uv = quad(half=1.8, more='"point2 uv" [0 0 1 0 1 1 0 1]')
    seen = quadrants(imported(scene(tmp_path, body + uv, depth=1), 64))
    assert seen[0, 0].argmax() == 0 and seen[0, 1].argmax() == 1 and seen[1, 0].argmax() == 2
    assert luminance(imported(scene(tmp_path, body + quad(half=1.8)))) > 0.1


def test_instances_blocks_and_coordinate_systems(tmp_path):
    body = """LightSource "infinite"
        ObjectBegin "ball" Translate 0 0.5 0 Shape "sphere" "float radius" 0.5 ObjectEnd
        AttributeBegin Translate -1 0 0 ObjectInstance "ball" AttributeEnd
        TransformBegin Translate 1 0 0 Scale 1 2 1 CoordinateSystem "there" TransformEnd
        CoordSysTransform "there" ObjectInstance "ball"
        """
    content = crt.import_scene(scene(tmp_path, body, before="Scale -1 1 1\n" + LOOK)).content
    one, = content["objects"]
    assert [steps[0]["matrix"][3::4] for steps in one["transforms"]] == [[-1, 0.5, 0, 1], [1, 1, 0, 1]]
    assert "mesh" in one  # A sphere that is stretched in one of its places.


def test_import_keeps_its_state_and_include_does_not(tmp_path):
    written(tmp_path, "parts/move.pbrt", 'Translate 1 0 0\nMaterial "diffuse" "rgb reflectance" [.2 .2 .2]')
    for word, wanted in (("Include", 0.2), ("Import", 0.5)):
        made = material(tmp_path, f'{word} "parts/move.pbrt"')
        assert made["reflectance"] == wanted
    packed = tmp_path / "whole.pbrt.gz"
    packed.write_bytes(gzip.compress(scene(tmp_path, 'Shape "sphere"').read_bytes()))
    assert len(crt.import_scene(packed).content["objects"]) == 1


def test_film_crop_and_exposure(tmp_path):
    path = written(tmp_path, "scene.pbrt", """
        Film "rgb" "integer xresolution" 40 "integer yresolution" 20 "float cropwindow" [0.25 0.75 0.5 1]
            "float iso" 400
        Sampler "halton" "integer pixelsamples" 7
        WorldBegin""")
    content = crt.import_scene(path).content
    assert content["film"]["crop"] == [10, 10, 30, 20] and content["sampler"]["samples"] == 7
    assert content["film"]["exposure_ev"] == 2 and content["film"]["apply_to_float"] is True
    assert content["integrator"]["max_depth"] == 5


def test_what_crt_lacks_is_listed_once_with_its_count(tmp_path):
    path = written(tmp_path, "scene.pbrt", 'WorldBegin\nMaterial "glitter"\nShape "sphere"\n'
                   'Material "glitter"\nShape "sphere" "float wobble" 1\nShape "spheer"\n'
                   'LightSource "laser"\n')
    assert whats(path) == {"2": ("material 'glitter'", "grey, diffuse", 2),
                           "5": ("'wobble' of shape 'sphere'", "left out", 1),
                           "6": ("shape 'spheer'; did you mean 'sphere'?", "left out", 1),
                           "7": ("light 'laser'", "left out", 1)}


@pytest.mark.parametrize("text, line, column, phrase", [
    ("WorldBegin\n  Shap \"sphere\"", 2, 3, "did you mean 'Shape'?"),
    ("Translate 1 x 0", 1, 13, "not 'x'"),
    ("Translate 1 2", 1, 14, "the file ends"),
    ("Translate 1 2 inf", 1, 15, "finite"),
    ('WorldBegin\nShape "sphere', 2, 7, "no end on its line"),
    ('Shape "sphere" "float radius" [1', 1, 31, "']' is missing"),
    ('Shape "sphere" "flaot radius" 1', 1, 16, "did you mean 'float'?"),
    ('Shape "sphere" "float radius" "big"', 1, 16, "takes numbers"),
    ('Shape "trianglemesh" "point3 P" [0 0 0 1]', 1, 22, "3 numbers each"),
    ('Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 3]', 1, 53,
     "not among the 3"),
    ('NamedMaterial "a"\nShape "sphere"', 1, 1, "no material 'a'"),
    ('Shape "plymesh" "string filename" "no.ply"', 1, 17, "does not exist"),
    ('Include "scene.pbrt"', 1, 1, "includes itself"),
    ("AttributeBegin", 1, 1, "without AttributeEnd"),
    ("WorldBegin\nAttributeEnd", 2, 1, "without AttributeBegin"),
    ('ObjectInstance "x"', 1, 1, "no object 'x'"),
    ("LookAt 0 0 0 0 0 1 0 0 1", 1, 1, "one line"),
    ('Film "rgb" "integer xresolution" 1000000000', 1, 1, "65535"),
    ('Material "diffuse" "texture reflectance" "t"\nShape "sphere"', 1, 20, "no texture 't'"),
    ('Texture "t" "float" "scale" "texture tex" "t"\nShape "sphere" "texture alpha" "t"', 1, 29,
     "contains itself"),
    ('Shape "sphere" "float radius" -1', 1, 1, "above 0"),
    ('Camera "perspective"\n"float fov" 0', 2, 1, "larger than 0"),
    ('Camera "perspective" "float fov" 200', 1, 22, "smaller than 180 degrees"),
    ('Shape "plymesh" "string filename" "."', 1, 17, "is a folder"),
    ('LightSource "infinite" "spectrum L" "."', 1, 24, "is a folder"),
    ('AreaLightSource "diffuse" "string filename" "no.png"\nShape "sphere"', 1, 27, "does not exist"),
    ('Camera "perspective"\n "float fov" [60 30]', 2, 2,
     "'fov' of camera 'perspective' is one number, not 2"),
    ('Shape "sphere" "float radius" []', 1, 16, "one number, not 0"),
    ('Film "rgb" "float cropwindow" [0 1 0]', 1, 12, "4 numbers, not 3"),
    ('Film "rgb" "integer pixelbounds" [0 1 0 1 2]', 1, 12, "4 numbers, not 5"),
    ('Camera "perspective" "float screenwindow" [1 1]', 1, 22, "4 numbers, not 2"),
    ('LightSource "point" "point3 from" [0 0 0 1 1 1]', 1, 21, "3 numbers, not 6"),
    ('Shape "plymesh" "string filename" ["a.ply" "b.ply"]', 1, 17, "one text, not 2"),
    ('AreaLightSource "diffuse" "bool twosided" [true false]\nShape "sphere"', 1, 27, "one text, not 2"),
    ('Material "diffuse" "texture reflectance" ["a" "b"]\nShape "sphere"', 1, 20, "one texture, not 2"),
    ('Material "dielectric" "texture roughness" ["a" "b"]\nShape "sphere"', 1, 23, "one texture, not 2"),
    ('Material "dielectric" "spectrum eta" ["glass-BK7" "glass-SF11"]\nShape "sphere"', 1, 23,
     "one spectrum, not 2"),
    ('Material "dielectric" "float roughness" [0.1 0.3]\nShape "sphere"', 1, 23, "one number, not 2"),
    ('Texture "t" "float" "scale" "float scale" [1 2]\nShape "sphere" "texture alpha" "t"', 1, 29,
     "one number, not 2"),
])
def test_errors_have_their_place(tmp_path, text, line, column, phrase):
    path = written(tmp_path, "scene.pbrt", text)
    with pytest.raises(crt.Error) as caught:
        crt.import_scene(path)
    assert phrase in str(caught.value)
    assert caught.value.kind == crt.Kind.SCENE
    assert (caught.value.file, caught.value.line, caught.value.column) == (str(path), line, column)


def test_power_of_a_spot(tmp_path):
    path = scene(tmp_path, 'LightSource "spot" "rgb I" [1 1 1] "float power" 10 "float coneangle" 60'
                 ' "float conedeltaangle" 60')
    light, = crt.import_scene(path).content["lights"]
    near(light["radiant_intensity"]["scale"], 10 / (2 * math.pi * 0.25), 1e-9)


def test_images_of_roughness_become_crts(tmp_path):
    """Two roots: crt's roughness is the root of the width, which is the root of pbrt's roughness."""
    written(tmp_path, "t.pfm", pfm([[[0.0625] * 3, [1] * 3]]))
    made = material(tmp_path, 'Texture "t" "float" "imagemap" "string filename" "t.pfm"\n'
                    'Material "conductor" "texture roughness" "t"')
    assert np.allclose(made["roughness"]["texture"], [[0.5, 1]])
    made = material(tmp_path, 'Texture "t" "float" "imagemap" "string filename" "t.pfm"\n'
                    'Material "coateddiffuse" "texture roughness" "t"')
    assert np.allclose(made["roughness"]["texture"], [[0.5, 1]])


def test_numbers_in_encoded_images_are_decoded(tmp_path):
    grey = np.full((2, 2, 3), 188, np.uint8)  # 0.5029 by IEC 61966-2-1.
    write_png(tmp_path / "t.png", grey)
    made = material(tmp_path, 'Texture "t" "float" "imagemap" "string filename" "t.png"\n'
                    'Attribute "shape" "texture alpha" "t"')
    assert np.allclose(made["opacity"]["texture"], 0.5029, atol=1e-3)
    rough = material(tmp_path, 'Texture "t" "float" "imagemap" "string filename" "t.png"'
                     ' "string encoding" "linear"\nMaterial "conductor" "texture roughness" "t"')
    assert np.allclose(rough["roughness"]["texture"], (188 / 255)**0.25, atol=1e-3)


def test_two_shapes_have_one_material_with_an_array(tmp_path):
    write_png(tmp_path / "t.png", np.uint8([[0, 187], [255, 187]])[:, :, None].repeat(3, 2))
    path = scene(tmp_path, 'Texture "t" "float" "imagemap" "string filename" "t.png"\n'
                 'Material "diffuse"\n' + 2 * (quad(more='"texture alpha" "t"') + "\n"))
    content = crt.import_scene(path).content
    (name,) = {thing["material"] for thing in content["objects"]}
    assert len(content["objects"]) == 2 and set(content["materials"]) == {name}
    assert content["materials"][name]["opacity"]["texture"].shape == (2, 2)
    assert imported(path, 1).shape == (16, 16, 3)


def test_matrices_are_given_by_columns(tmp_path):
    for word, wanted in (("Transform", [5, 6, 7]), ("ConcatTransform", [6, 6, 7])):
        path = scene(tmp_path, f'Translate 1 0 0 {word} [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1] Shape "sphere"',
                     before="Scale -1 1 1\n" + LOOK)
        matrix = crt.import_scene(path).content["objects"][0]["transform"][0]["matrix"]
        assert matrix[3:12:4] == wanted


def test_the_scale_of_a_texture_is_a_texture_of_numbers(tmp_path):
    def made(tex, scale):
        return material(tmp_path, f'Texture "a" "float" {scale}\nTexture "b" "spectrum" "scale" {tex} '
                        '"texture scale" "a"\nMaterial "diffuse" "texture reflectance" "b"')["reflectance"]
    assert made('"rgb tex" [.5 .5 .5]', '"constant" "float value" .5') == 0.25
    assert made('"rgb tex" [.4 .2 .1]', '"constant" "float value" .5')["scale"] == 0.5
    written(tmp_path, "a.pfm", pfm(np.full((2, 2, 3), 0.5)))
    found = made('"rgb tex" [.5 .5 .5]', '"imagemap" "string filename" "a.pfm"')
    assert found["factor"] == 0.5 and "color_space" not in found


def test_files_may_begin_with_a_byte_order_mark(tmp_path):
    path = written(tmp_path, "s.pbrt", b'\xef\xbb\xbfWorldBegin\nInclude "a.pbrt"\n')
    written(tmp_path, "a.pbrt", b'\xef\xbb\xbfShape "sphere"\n')
    assert len(crt.import_scene(path).content["objects"]) == 1


def test_the_second_value_of_a_spectrum_counts_in_version_3_and_is_said_else(tmp_path):
    text = 'WorldBegin\nLightSource "point" "blackbody I" [6500 3 ]\n'
    one = crt.import_scene(written(tmp_path, "s.pbrt", text.replace("3 ]", "]"))).content["lights"][0]
    made = crt.import_scene(written(tmp_path, "s.pbrt", text))
    assert [loss.what for loss in made.losses] == ["'I' of light 'point' with 2 values"]
    assert made.content["lights"][0] == one
    of_version_3 = crt.import_scene(written(tmp_path, "s.pbrt", text + "WorldEnd\n"))
    assert [loss.what for loss in of_version_3.losses] == ["a scene of pbrt-v3"]
    near(of_version_3.content["lights"][0]["radiant_intensity"]["scale"],
         3 * one["radiant_intensity"]["scale"], 1e-9)
