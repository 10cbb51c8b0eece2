"""Files of other programs that are broken or malicious: each is refused in a sentence with file and line, in
time and memory that do not run away."""

import gzip
import os
import pathlib
import re
import resource
import struct
import subprocess
import sys
import zlib

import pytest
from imports import at_most, written

import crt
from crt import Kind
from crt.importers.draft import Draft

MITSUBA = '<scene version="3.0.0"><sensor type="perspective"/>%s</scene>'
PBRT = 'Camera "perspective"\nWorldBegin\n%s\n'
GLOW = '<emitter type="constant"><blackbody name="radiance" temperature="{}"/></emitter>'
FUZZER = pathlib.Path(__file__).resolve().parents[2] / "tests" / "fuzz" / "importers.py"
TWICE = 40  # Each names the next twice: 2^40 ways.


def refused(path):
    """The sentence. No exception but crt.Error of kind SCENE, whose text shows no control characters."""
    with pytest.raises(crt.Error) as caught:
        crt.import_scene(path)
    assert caught.value.kind == Kind.SCENE
    assert re.match(r".+:\d+:\d+: error: ", str(caught.value)), str(caught.value)
    assert not re.search(r"[\x00-\x08\x0b-\x1f]", str(caught.value))
    return str(caught.value)


@pytest.mark.parametrize("name, text", [
    ("encoding.xml", '<?xml version="1.0" encoding="x-unknown"?><scene version="3.0.0"/>'),
    ("utf_7.xml", '<?xml version="1.0" encoding="utf-7"?><scene version="3.0.0"/>'),
    ("version.xml", '<scene version="%s"/>' % ("9" * 6000)),
    ("name.xml", MITSUBA % f'<include filename="{"a" * 5000}"/>'),
    ("kelvin.xml", MITSUBA % GLOW.format("nan")),
    ("cold.xml", MITSUBA % GLOW.format("-5")),
    ("name.pbrt", f'Include "{"a" * 5000}"'),
    ("window.pbrt", 'Camera "orthographic" "float screenwindow" [0 0 0 0]\nWorldBegin\n'),
    ("aspect.pbrt", 'Camera "perspective" "float frameaspectratio" 0\nWorldBegin\n'),
    ("huge.pbrt", PBRT % 'Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1e308 1e308 1]'),
    ("escape.pbrt", PBRT % 'Mat\x1b[2Jerial "diffuse"'),
])
def test_what_is_no_scene(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    refused(tmp_path / name)


@pytest.fixture
def address_space():
    """Half a tebibyte, so that a larger file cannot be read however readily the system lends memory."""
    before, most = resource.getrlimit(resource.RLIMIT_AS)
    half = 1 << 39 if most == resource.RLIM_INFINITY else min(1 << 39, most)
    resource.setrlimit(resource.RLIMIT_AS, (half, most))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (before, most))


@pytest.mark.parametrize("name", ["huge.xml", "huge.pbrt"])
def test_a_file_of_a_tebibyte_is_no_scene(tmp_path, address_space, name):
    with open(tmp_path / name, "wb") as file:
        file.truncate(1 << 40)  # It takes no blocks.
    with at_most(5):
        assert "not enough memory" in refused(tmp_path / name)


def test_losses_show_no_control_characters(tmp_path):
    path = tmp_path / "escape.pbrt"
    path.write_text(PBRT % 'Material "x\x1b]0;title\x07"\nShape "sphere"', encoding="utf-8")
    losses = [str(loss) for loss in crt.import_scene(path).losses]
    assert losses and not re.search(r"[\x00-\x1f]", "".join(losses))


def doubled(form, last):
    return "".join(form.format(i=i, next=i + 1) for i in range(TWICE)) + last


@pytest.mark.parametrize("name, text", [
    ("blend.xml", MITSUBA % (doubled(
        '<bsdf type="blendbsdf" id="b{i}"><float name="weight" value="0.5"/><ref id="b{next}"/>'
        '<ref id="b{next}"/></bsdf>', f'<bsdf type="diffuse" id="b{TWICE}"/>')
        + '<shape type="sphere"><ref id="b0"/></shape>')),
    ("merge.xml", MITSUBA % doubled(
        '<shape type="merge" id="b{i}"><ref id="b{next}"/><ref id="b{next}"/></shape>',
        f'<shape type="sphere" id="b{TWICE}"/>')),
    ("textures.pbrt", PBRT % (f'Texture "t{TWICE}" "spectrum" "constant" "rgb value" [1 0 0]\n' + "".join(
        f'Texture "t{i}" "spectrum" "mix" "texture tex1" "t{i + 1}" "texture tex2" "t{i + 1}"\n'
        for i in reversed(range(TWICE))) + 'Material "diffuse" "texture reflectance" "t0"\nShape "sphere"')),
])
def test_what_names_the_next_twice_is_refused(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    refused(tmp_path / name)


def test_mixes_that_name_the_next_twice_are_made_once_each(tmp_path):
    path = tmp_path / "mixes.pbrt"
    path.write_text(PBRT % (doubled(
        'MakeNamedMaterial "m{i}" "string type" "mix" "string materials" ["m{next}" "m{next}"]\n',
        f'MakeNamedMaterial "m{TWICE}" "string type" "diffuse"\n') + 'NamedMaterial "m0"\nShape "sphere"'))
    assert crt.import_scene(path).content["objects"]


@pytest.mark.parametrize("ending, line, within", [
    (".xml", '<include filename="i{}.xml"/>', '<scene version="3.0.0">{}</scene>'),
    (".pbrt", 'Include "i{}.pbrt"\n', "{}"),
])
def test_files_that_include_the_next_twice_are_refused(tmp_path, ending, line, within):
    for i in range(14):
        (tmp_path / f"i{i}{ending}").write_text(within.format(line.format(i + 1) * 6))
    (tmp_path / f"i14{ending}").write_text(within.format(""))
    assert "double at each level" in refused(tmp_path / f"i0{ending}")


def bomb(form, size=1 << 29):
    """A packed stream of `size` equal bytes, without its end."""
    packer = zlib.compressobj(9, zlib.DEFLATED, form)
    head = packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(b"#" * (1 << 22)) + packer.flush(zlib.Z_FULL_FLUSH)  # Needs nothing before it.
    return head + block * (size >> 22)


def test_files_that_unpack_to_a_thousand_times_their_size_are_refused(tmp_path):
    (tmp_path / "a.pbrt.gz").write_bytes(bomb(31))
    assert "unpacked it is more than" in refused(tmp_path / "a.pbrt.gz")
    (tmp_path / "a.serialized").write_bytes(
        struct.pack("<HH", 0x041C, 4) + bomb(15) + struct.pack("<QI", 0, 1))
    (tmp_path / "s.xml").write_text(
        MITSUBA % '<shape type="serialized"><string name="filename" value="a.serialized"/></shape>')
    assert "unpacked it is more than" in refused(tmp_path / "s.xml")
    # Several members of ordinary files are one file.
    (tmp_path / "two.pbrt.gz").write_bytes(
        gzip.compress(b'Camera "perspective"\n') + gzip.compress(b'WorldBegin\nShape "sphere"\n')
        + b"\0" * 100)
    assert crt.import_scene(tmp_path / "two.pbrt.gz").content["objects"]


def test_spectra_are_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in ("/dev/zero", "pipe"):
        spectrum = f'<spectrum name="reflectance" filename="{name}"/>'
        (tmp_path / "s.xml").write_text(
            MITSUBA % f'<shape type="sphere"><bsdf type="diffuse">{spectrum}</bsdf></shape>')
        assert "it is no file" in refused(tmp_path / "s.xml")


def test_mutations_of_scenes_are_refused_in_a_sentence(tmp_path):
    done = subprocess.run([sys.executable, FUZZER, "--mutations", "40", "--findings", tmp_path],
                          capture_output=True, text=True, timeout=900)
    said = done.stdout + done.stderr
    assert done.returncode == 0 and " 40 mutations each: 0 findings" in said, said


def test_many_materials_without_a_name_take_linear_time(tmp_path):
    draft = Draft(tmp_path / "many.pbrt")
    with at_most(6):
        names = {draft.material("", {"type": "diffuse", "reflectance": i / 20000}) for i in range(20000)}
    assert len(names) == len(draft.materials) == 20000


def test_each_material_without_a_name_is_kept(tmp_path):
    path = written(tmp_path, "many.pbrt", PBRT % "\n".join(
        f'Material "diffuse" "rgb reflectance" [{i / 2000} 0.5 0.5]\nShape "sphere"' for i in range(2000)))
    materials = crt.import_scene(path).content["materials"]
    assert sum("reflectance" in material for material in materials.values()) == 2000


def test_many_references_in_one_shape_take_linear_time(tmp_path):
    path = written(tmp_path, "many.xml", MITSUBA % (
        '<shape type="sphere" id="a"/><shape type="shapegroup" id="g">' + '<ref id="a"/>' * 32000
        + '</shape>'))
    with at_most(5):
        crt.import_scene(path)


@pytest.mark.parametrize("file_format, properties, rows", [
    ("ascii", "", b"-1\n" * 9),
    ("binary_little_endian", "", struct.pack("<i", -1) * 9),
    # A reader that takes -1 for all that follows reads it again for each row.
    ("binary_little_endian", "property uchar material\n", struct.pack("<iB", -1, 0) * 9),
], ids=["text", "binary", "among others"])
def test_lists_of_less_than_no_values_are_refused(tmp_path, file_format, properties, rows):
    written(tmp_path, "a.ply", f"ply\nformat {file_format} 1.0\nelement face 9\n"
            f"property list int int vertex_indices\n{properties}end_header\n".encode() + rows)
    scene = written(tmp_path, "s.xml", MITSUBA % (
        '<shape type="ply"><string name="filename" value="a.ply"/>'
        '<boolean name="flip_normals" value="true"/></shape>'))  # So that the importer reads the mesh.
    assert "a list has -1 values" in refused(scene)
