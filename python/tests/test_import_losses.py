"""Scenes of other programs: the losses that an import reports."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from imports import LUMINANCE, imported, near, quadrants, rendered, written

import crt

HEAD = """LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective"
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
"""
SPHERE = 'Shape "sphere"\n'


def of_pbrt(folder, before, after=SPHERE):
    return crt.import_scene(written(folder, "s.pbrt", HEAD + before + "WorldBegin\n" + after)).losses


def of_mitsuba(folder, body, version="3.0.0"):
    return crt.import_scene(written(folder, "s.xml", f'<scene version="{version}">{body}</scene>'))


def test_what_changes_the_picture_a_lot_comes_first_and_is_a_warning(tmp_path):
    source = written(tmp_path, "s.pbrt", HEAD + 'PixelFilter "mitchell"\nWorldBegin\nMaterial "hair"\n'
                     + SPHERE)
    losses = crt.import_scene(source).losses
    assert [(loss.what, loss.large) for loss in losses] == [("material 'hair'", True),
                                                            ("pixelfilter 'mitchell'", False)]
    done = subprocess.run([sys.executable, "-m", "crt", "import", str(source), "-o", "x.yaml"], cwd=tmp_path,
                          capture_output=True, text=True, timeout=600, env=os.environ)
    lines = done.stderr.splitlines()
    assert lines[0].startswith("crt: warning: the picture changes a lot: ") and "'hair'" in lines[0]
    assert lines[1].startswith("crt: not imported: ") and "'mitchell'" in lines[1] and len(lines) == 2


def test_parameters_of_another_integrator_are_one_line(tmp_path):
    losses = of_pbrt(tmp_path, 'Integrator "sppm" "float radius" 1 "integer photonsperiteration" 9 '
                               '"integer maxdepth" 4\n')
    assert [loss.what for loss in losses] == ["integrator 'sppm' with 'photonsperiteration', 'radius'"]
    made = of_mitsuba(tmp_path, '<integrator type="pssmlt"><integer name="max_depth" value="4"/>'
                                '<float name="p_large" value="0.3"/><integer name="chains" value="2"/>'
                                '</integrator>')
    assert [loss.what for loss in made.losses] == ["integrator 'pssmlt' with 'chains', 'p_large'"]
    assert made.content["integrator"]["max_depth"] == 3


FOG = 'MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_s" [1 1 1]\n'


@pytest.mark.parametrize("before, after, said", [
    (FOG + 'MediumInterface "" "fog"\n', SPHERE, ["the medium 'fog' outside of shapes"]),
    (FOG + 'MediumInterface "fog"\n', SPHERE, ["the medium 'fog' outside of shapes"]),
    ("", FOG + 'MediumInterface "fog" ""\nMaterial "dielectric"\n' + SPHERE, ["participating media"]),
    ("", FOG + 'MediumInterface "fog" ""\nMaterial "interface"\n' + SPHERE, ["participating media"]),
    ("", FOG + 'MediumInterface "fog" ""\n' + SPHERE, [])])
def test_a_medium_that_one_would_see_is_said(tmp_path, before, after, said):
    losses = of_pbrt(tmp_path, before, after)
    assert [loss.what for loss in losses if loss.large] == said


@pytest.mark.parametrize("version, objects", [("0.6.0", 0), ("3.0.0", 1)])
def test_a_shape_of_a_medium_alone_is_empty_space_before_version_2(tmp_path, version, objects):
    made = of_mitsuba(tmp_path, '<shape type="sphere"><medium name="interior" type="homogeneous"/></shape>',
                      version)
    assert len(made.content.get("objects", [])) == objects
    assert [(loss.what, loss.large) for loss in made.losses] == [("participating media", True)]


@pytest.mark.parametrize("film, body, line", [
    ("image", SPHERE, 3), ("rgb", 'Material "matte"\n' + SPHERE, 5), ("rgb", SPHERE + "WorldEnd\n", 6)])
def test_a_scene_of_version_3_of_pbrt_is_named(tmp_path, film, body, line):
    path = written(tmp_path, "s.pbrt", HEAD.replace('"rgb"', f'"{film}"') + "WorldBegin\n" + body)
    named = [loss for loss in crt.import_scene(path).losses if loss.what == "a scene of pbrt-v3"]
    assert [(loss.first.line, loss.count, loss.large) for loss in named] == [(line, 1, True)]


def test_a_clamp_and_metals_without_loss_are_said(tmp_path):
    path = written(tmp_path, "s.pbrt", HEAD.replace(
        '"rgb" ', '"rgb" "float maxcomponentvalue" 10 ')
        + 'WorldBegin\nMaterial "conductor" "float roughness" 0.3\n' + SPHERE)
    said = [loss.what for loss in crt.import_scene(path).losses]
    assert any("maxcomponentvalue" in what for what in said)
    assert "light that a rough metal loses between its facets" in said


def test_a_colour_in_place_of_a_number_is_said(tmp_path):
    def said(parameter):
        losses = of_pbrt(tmp_path, "", f'Material "dielectric" {parameter}\n' + SPHERE)
        return [(loss.what, loss.instead) for loss in losses]

    assert ("a colour as 'roughness' of material 'dielectric'", "its mean") in said(
        '"rgb roughness" [0.1 0.2 0.3]')
    assert said('"rgb roughness" [0.2 0.2 0.2]') == said('"float roughness" 0.2')
    assert ("'roughness' of material 'dielectric'", "0.0") in said('"spectrum roughness" [400 0.1 700 0.2]')


def test_an_index_of_0_or_less_renders_and_is_said(tmp_path):
    of_rgb = '<rgb name="eta" value="-0.05, 4, 4.7"/><rgb name="k" value="0, 0.1, 1.3"/>'
    of_number = '<spectrum name="eta" value="0"/><spectrum name="k" value="1"/>'
    made = [of_mitsuba(tmp_path, f'<shape type="sphere"><bsdf type="{kind}">{values}</bsdf></shape>')
            for kind in ("conductor", "roughconductor") for values in (of_rgb, of_number)]
    made.append(crt.import_scene(written(
        tmp_path, "s.pbrt", HEAD + 'WorldBegin\nMaterial "conductor" "spectrum eta" [400 0 700 0] '
        '"spectrum k" [400 1 700 1]\n' + SPHERE)))
    for one in made:
        assert ("an 'eta' of 0 or less", "0.01") in [(loss.what, loss.instead) for loss in one.losses]
        assert np.isfinite(rendered(one.scene, 1)).all()


def said(losses):
    return [(loss.what, loss.instead, loss.large) for loss in losses]


def test_a_colour_as_an_index_of_refraction_is_said(tmp_path):
    line = "its numbers at 610, 540 and 460 nm, and a straight line between them"
    values = '<rgb name="eta" value="0.2, 0.4, 1.3"/><rgb name="k" value="3, 3, 3"/>'
    made = of_mitsuba(tmp_path, f'<shape type="sphere"><bsdf type="conductor">{values}</bsdf></shape>')
    assert said(made.losses) == [("a colour as 'eta' of bsdf 'conductor'", line, False)]
    eta = next(of["eta"] for of in made.content["materials"].values() if "eta" in of)
    assert eta["table"] == {"nm": [460, 540, 610], "value": [1.3, 0.4, 0.2]}
    metal = '"rgb eta" [0.2 0.4 1.3] "rgb k" [3 3 3]'
    losses = of_pbrt(tmp_path, "", f'Material "conductor" "float roughness" 0 {metal}\n' + SPHERE)
    assert said(losses) == [("a colour as 'eta' of material 'conductor'", line, False)]


@pytest.mark.parametrize("scattered, wanted", [
    ("0 0 0", ("a colour as 'sigma_a' of medium 'homogeneous'", False)),
    ("1 2 3", ("participating media", True))])
def test_a_colour_that_glass_absorbs_is_said(tmp_path, scattered, wanted):
    losses = of_pbrt(tmp_path, "", 'MakeNamedMedium "ink" "string type" "homogeneous" "rgb sigma_a" [1 2 3] '
                     f'"rgb sigma_s" [{scattered}]\nMediumInterface "ink" ""\nMaterial "dielectric"\n'
                     + SPHERE)
    assert [(loss.what, loss.large) for loss in losses] == [wanted]


def test_an_image_that_emits_and_cannot_be_read_is_white_and_said(tmp_path):
    for name, content in (("a.bmp", b"BM"), ("a.png", b"no image")):
        written(tmp_path, name, content)
        image = f'type="bitmap"><string name="filename" value="{name}"/></texture>'
        made = of_mitsuba(tmp_path, '<shape type="sphere"><emitter type="area"><texture name="radiance" '
                          f'{image}</emitter></shape>')
        assert said(made.losses) == [(f"a texture of type '{name[1:]}' that emits light",
                                      "white of radiance 1", True)]
        assert made.content["objects"][0]["emission"]["radiance"] == {"illuminant": "D65", "scale": 1.0}


def test_curtains_that_would_make_light_are_a_loss(tmp_path):
    losses = of_pbrt(tmp_path, "", 'Material "diffusetransmission" "rgb reflectance" [0.75 0.75 0.75] '
                                   '"rgb transmittance" [0.5 0.5 0.5]\n' + SPHERE)
    assert said(losses) == [("reflectance and transmittance of material 'diffusetransmission' above 1 "
                             "together", "as much less of both", False)]


@pytest.mark.parametrize("given, wanted", [
    ("", True), ('<string name="distribution" value="beckmann"/>', True),
    ('<string name="distribution" value="ggx"/>', False)])
def test_the_tails_of_other_microfacets_are_said(tmp_path, given, wanted):
    made = of_mitsuba(tmp_path, f'<shape type="sphere"><bsdf type="roughdielectric">{given}</bsdf></shape>')
    assert said(made.losses) == wanted * [(
        "microfacets of Beckmann's distribution", "GGX of the same width (20 % of its facets lean by more "
        "than two widths, of Beckmann's 2 %)", False)]


def test_all_missing_files_are_listed_at_once(tmp_path):
    written(tmp_path, "there.png", b"")
    body = "".join(f'<shape type="{kind}"><string name="filename" value="{name}"/></shape>\n'
                   for kind, name in (("ply", "a.ply"), ("obj", "b.obj"), ("ply", "a.ply"),
                                      ("obj", "c.obj")))
    path = written(tmp_path, "s.xml", f"<scene>\n{body}</scene>")
    with pytest.raises(crt.Error) as caught:
        crt.import_scene(path)
    text = str(caught.value)
    assert text.startswith(f"{path}:2:") and text.count("a.ply") == 1
    assert f"b.obj' ({path}:3)" in text and f"c.obj' ({path}:5)" in text
    source = written(tmp_path, "s.pbrt", HEAD + "WorldBegin\n" + "".join(
        f'Shape "plymesh" "string filename" "{name}.ply"\n' for name in "de"))
    with pytest.raises(crt.Error) as caught:
        crt.import_scene(source)
    assert "d.ply" in str(caught.value) and f"e.ply' ({source}:6)" in str(caught.value)


# The sun and the sky of Mitsuba.

GROUND = """<shape type="rectangle">{turn}
<bsdf type="diffuse"><float name="reflectance" value="1"/></bsdf></shape>"""
ABOVE = """<integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><float name="fov" value="1"/><transform name="to_world">{look}</transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/>
</film></sensor>"""
# Mitsuba 3.9.1, scalar_spectral, albedo 0.3: Y of level white ground under the sky alone, and under the sun.
MEASURED = [(2, 30, 0.05935, 0.17351), (3, 45, 0.07715, 0.25972), (5, 60, 0.11765, 0.31015),
            (8, 15, 0.07726, 0.03419)]


def ground(folder, turbidity, elevation_deg, more, older=False):
    """The mean luminance of level white ground in the open."""
    level, up = math.cos(math.radians(elevation_deg)), math.sin(math.radians(elevation_deg))
    direction = f'x="{level}" y="{up}" z="0"' if older else f'x="{level}" y="0" z="{up}"'
    look = "0,5,0|0,0,1" if older else "0,0,5|0,1,0"
    origin, above = look.split("|")
    turn = '<transform name="toWorld"><rotate x="1" angle="-90"/></transform>' if older else ""
    body = (f'<emitter type="sunsky"><float name="turbidity" value="{turbidity}"/>'
            f'<vector name="{"sunDirection" if older else "sun_direction"}" {direction}/>{more}</emitter>'
            + GROUND.format(turn=turn)
            + ABOVE.format(look=f'<lookat origin="{origin}" target="0,0,0" up="{above}"/>'))
    made = of_mitsuba(folder, body, "0.6.0" if older else "3.0.0")
    return float((rendered(made.scene, 1024) @ LUMINANCE).mean())


@pytest.mark.parametrize("turbidity, elevation_deg, sky, sun", MEASURED)
def test_sun_and_sky_light_level_ground_as_in_mitsuba(tmp_path, turbidity, elevation_deg, sky, sun):
    near(ground(tmp_path, turbidity, elevation_deg, '<float name="sun_scale" value="0"/>'), sky, 0.02)
    near(ground(tmp_path, turbidity, elevation_deg, '<float name="sky_scale" value="0"/>'), sun, 0.02)


def test_scales_count_and_older_scenes_have_y_up(tmp_path):
    plain = ground(tmp_path, 3, 40, "")
    near(plain, 0.07465 + 0.23101, 0.02)
    near(ground(tmp_path, 3, 40, "", older=True), plain, 0.02)
    near(ground(tmp_path, 3, 40, '<float name="skyScale" value="30"/><float name="sunScale" value="10"/>',
                older=True), 30 * 0.07465 + 10 * 0.23101, 0.02)


def test_a_sun_below_the_horizon_is_said(tmp_path):
    made = of_mitsuba(tmp_path, '<emitter type="sunsky"><vector name="sun_direction" x="1" y="0" z="-0.5"/>'
                                '</emitter>')
    assert "environment" not in made.content and "lights" not in made.content
    assert len(made.losses) == 1 and made.losses[0].large and "26.6 degrees below" in made.losses[0].what


def test_the_sun_stands_where_mitsuba_has_it_by_time_and_place(tmp_path):
    made = of_mitsuba(tmp_path, '<emitter type="sunsky"><float name="hour" value="9"/></emitter>')
    towards = -np.array(made.content["environment"]["clear_sky"]["direction"])
    assert np.allclose(towards, [0.0956952, -0.614786, 0.782867], atol=5e-4)  # Mitsuba 3.9.1.


def test_a_sky_and_a_sun_become_one_clear_sky(tmp_path):
    south = '<vector name="sun_direction" x="1" y="0" z="0.5"/>'
    sky = f'<emitter type="sky">{south}<float name="scale" value="2"/></emitter>'
    sun = (f'<emitter type="sun">{south}<float name="sun_scale" value="3"/>'
           '<float name="sun_aperture" value="5"/></emitter>')
    for body in (sky + sun, sun + sky):
        made = of_mitsuba(tmp_path, body)
        found = made.content["environment"]["clear_sky"]
        assert (found["scale"], found["sun_scale"], found["sun_diameter_deg"]) == (2, 3, 5)
        assert not made.losses
    made = of_mitsuba(tmp_path, sky + sky)
    assert [loss.what for loss in made.losses] == ["a second environment"]


# Geometry that only Mitsuba lays out so.

def picture(folder, body, *, distance=5, camera="perspective", size=(16, 16)):
    look = f'origin="0,0,{distance}" target="0,0,0" up="0,1,0"'
    fov = '<float name="fov" value="20"/>' if camera == "perspective" else ""
    return imported(written(folder, "s.xml", f"""<scene version="3.0.0"><integrator type="path"/>
<sensor type="{camera}">{fov}<transform name="to_world"><lookat {look}/></transform><film type="hdrfilm">
<integer name="width" value="{size[0]}"/><integer name="height" value="{size[1]}"/>
<rfilter type="box"/></film></sensor>
{body}</scene>"""), 64)


def test_the_height_of_an_orthographic_picture_follows_from_its_width(tmp_path):
    lamp = ('<shape type="rectangle"><transform name="to_world"><scale x="0.5" y="0.25" z="1"/></transform>'
            '<emitter type="area"><spectrum name="radiance" value="1"/></emitter></shape>')
    for size in ((32, 16), (16, 16), (16, 32)):
        lit = (picture(tmp_path, lamp, camera="orthographic", size=size)[:, :, 1] > 0.5).mean()
        near(lit, 0.5 * min(1, 0.25 * size[0] / size[1]), 0.01)


@pytest.mark.parametrize("mirror, normals, lit", [
    # The triangle lies at z = 0.
    ("", "", True), ('<scale x="-1"/>', "", False), ('<scale z="-1"/>', "", True),
    ('<scale x="-1"/>', "0 0 1", True), ('<scale z="-1"/>', "0 0 1", False)])
def test_a_mirror_turns_meshes_without_normals_inside_out(tmp_path, mirror, normals, lit):
    names = "".join(f"property float n{axis}\n" for axis in "xyz") if normals else ""
    rows = "".join(f"{x} {y} 0 {normals}\n" for x, y in ((-1, -1), (1, -1), (0, 1)))
    written(tmp_path, "m.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
            f"property float y\nproperty float z\n{names}element face 1\n"
            f"property list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n")
    lamp = ('<shape type="ply"><string name="filename" value="m.ply"/><transform name="to_world">' + mirror +
            '</transform><emitter type="area"><spectrum name="radiance" value="1"/></emitter></shape>')
    assert (picture(tmp_path, lamp).max() > 0.5) == lit


def textured(folder, shape, columns, rows):
    """Of a picture straight from z: the number of the texel, row by row, at the middle of each quadrant."""
    values = np.linspace(0.1, 0.9, columns * rows).reshape(rows, columns)
    pixels = np.repeat(values[:, :, None], 3, 2).astype("<f4")
    written(folder, "t.pfm", f"PF\n{columns} {rows}\n-1.0\n".encode() + pixels[::-1].tobytes())
    seen = picture(folder, f"""<emitter type="constant"/><shape type="{shape}"><bsdf type="diffuse">
<texture type="bitmap" name="reflectance"><string name="filename" value="t.pfm"/>
<boolean name="raw" value="true"/><string name="filter_type" value="nearest"/></texture></bsdf></shape>""",
                   distance=20, size=(64, 64))
    middle = seen[[[29], [34]], [29, 34]] if shape == "disk" else quadrants(seen[26:38, 26:38])
    return [int(np.argmin(abs(values.reshape(-1) - v))) for v in middle.mean(2).reshape(-1)]


def test_textures_lie_on_cubes_and_disks_as_in_mitsuba(tmp_path):
    # On the side towards z, u leads along y and v along x: top left is (1, 0).
    assert textured(tmp_path, "cube", 2, 2) == [1, 3, 0, 2]
    # On a disk, u is the distance from the middle and v the angle from x: four rows are the quadrants.
    assert textured(tmp_path, "disk", 2, 4) == [2, 0, 4, 6]
