"""Files of other programs that are broken or malicious: each is refused in a sentence with file and line, in
time and memory that do not run away."""

import gzip
import os
import pathlib
import re
import struct
import subprocess
import sys
import zlib

import pytest

import crt
from crt import Kind

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


def bomb(form, head=b"", size=1 << 29):
    packer = zlib.compressobj(9, zlib.DEFLATED, form)
    block = b"#" * (1 << 22)
    parts = [packer.compress(head), *(packer.compress(block) for _ in range(size >> 22))]
    return b"".join([*parts, packer.flush()])


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
    path = tmp_path / "many.pbrt"
    path.write_text(PBRT % "\n".join(
        f'Material "diffuse" "rgb reflectance" [{i / 20000} 0.5 0.5]\nShape "sphere"' for i in range(20000)))
    materials = crt.import_scene(path).content["materials"]
    assert sum("reflectance" in material for material in materials.values()) == 20000
