"""`crt import` for scenes of other programs: what it writes, and what it leaves to the program."""

import os
import subprocess
import sys

import numpy as np
import pytest
from imports import rendered, written

import crt
from crt import writing

MANY = " ".join(f"{x} {y} 0" for y in range(41) for x in range(41))
FACES = " ".join(f"{41 * y + x} {41 * y + x + 1} {41 * y + x + 42}" for y in range(40) for x in range(40))
SCENE = f"""LookAt 20 20 50  20 20 0  0 1 0
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 12 "integer yresolution" 12
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Material "hair"
Shape "trianglemesh" "point3 P" [{MANY}] "integer indices" [{FACES}]
Shape "sphere" "float radius" 5
"""


def run(*arguments, cwd):
    return subprocess.run([sys.executable, "-m", "crt", "import", *map(str, arguments)], cwd=cwd,
                          capture_output=True, text=True, timeout=900, env=os.environ)


def test_a_scene_with_its_meshes_is_written_beside_it(tmp_path):
    source = written(tmp_path, "in/s.pbrt", SCENE)
    (tmp_path / "out").mkdir()
    done = run(source, "-o", "out/made.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"{source}:6: material 'hair': diffuse" in done.stderr
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["made.meshes", "made.yaml"]
    assert [path.name for path in (tmp_path / "out/made.meshes").iterdir()] == ["mesh0.ply"]
    text = (tmp_path / "out/made.yaml").read_text()
    assert text.startswith("crt: 1\n# From s.pbrt.\n") and "material 'hair'" in text
    assert max(map(len, text.splitlines())) < 130
    loaded = crt.load(tmp_path / "out/made.yaml")
    assert np.array_equal(rendered(loaded), rendered(crt.import_scene(source).scene))


def test_paths_hold_where_a_folder_is_a_symbolic_link(tmp_path):
    written(tmp_path, "in/triangle.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
            "property float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n40 0 0\n20 40 0\n3 0 1 2\n")
    mesh = 'Shape "plymesh" "string filename" "triangle.ply"'
    scene = SCENE.replace('Shape "sphere" "float radius" 5', mesh)
    source = written(tmp_path, "in/s.pbrt", scene)
    (tmp_path / "far/away").mkdir(parents=True)
    (tmp_path / "link").symlink_to("far/away")
    done = run(source, "-o", "link/made.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    loaded = crt.load(tmp_path / "link/made.yaml")
    assert np.array_equal(rendered(loaded), rendered(crt.import_scene(source).scene))


def test_nothing_is_overwritten_unless_asked(tmp_path):
    source = written(tmp_path, "s.pbrt", SCENE)
    made = written(tmp_path, "made.yaml", "mine")
    done = run(source, "-o", made, cwd=tmp_path)
    assert done.returncode == 2 and "--overwrite" in done.stderr and made.read_text() == "mine"
    assert not (tmp_path / "made.meshes").exists()
    for _ in range(2):
        assert run(source, "-o", made, "--overwrite", cwd=tmp_path).returncode == 0
    assert made.read_text().startswith("crt: 1")
    assert sorted(os.listdir(tmp_path)) == ["made.meshes", "made.yaml", "s.pbrt"]


def test_standard_output_has_all_of_a_scene(tmp_path):
    source = written(tmp_path, "s.pbrt", SCENE)
    done = run(source, cwd=tmp_path)
    assert done.returncode == 0 and os.listdir(tmp_path) == ["s.pbrt"]
    assert np.array_equal(rendered(crt.scene(done.stdout)), rendered(crt.import_scene(source).scene))


def test_errors_end_with_their_code(tmp_path):
    source = written(tmp_path, "s.pbrt", "Shap")
    done = run(source, "-o", "made.yaml", cwd=tmp_path)
    assert done.returncode == 3 and os.listdir(tmp_path) == ["s.pbrt"]
    assert done.stderr == f"crt: error: {source}:1:1: error: there is no directive 'Shap'; " \
                          "did you mean 'Shape'?\n"
    assert run("no.xml", cwd=tmp_path).returncode == 3
    good = written(tmp_path, "s.pbrt", SCENE)
    assert run(good, "-o", "no/such/folder/made.yaml", cwd=tmp_path).returncode == 6
    assert run(good, "-D", "x", cwd=tmp_path).returncode == 2
    assert run(good, "--wobble", cwd=tmp_path).returncode == 2


def test_parameters_of_mitsuba_are_given_by_name(tmp_path):
    source = written(tmp_path, "s.xml", '<scene version="3.0.0"><shape type="sphere">'
                     '<float name="radius" value="$size"/></shape></scene>')
    assert "radius: 2.5" in run(source, "-D", "size=2.5", cwd=tmp_path).stdout
    assert run(source, cwd=tmp_path).returncode == 3


@pytest.mark.parametrize("name, text, given, said", [
    ("s.xml", '<scene><shape type="sphere"><float name="radius" value="$size"/></shape></scene>',
     ["-D", "size=2"], "uses the parameter '$sise'; did you mean 'size'?"),
    ("s.pbrt", SCENE, [], "has no parameter 'sise'")])
def test_a_parameter_that_the_scene_does_not_use_is_an_error(tmp_path, name, text, given, said):
    source = written(tmp_path, name, text)
    done = run(source, *given, "-D", "sise=3", "-o", "made.yaml", cwd=tmp_path)
    assert done.returncode == 2 and said in done.stderr and os.listdir(tmp_path) == [name]


def test_an_import_replaces_none_of_its_inputs(tmp_path):
    quad = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n" \
           "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" \
           "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    for name, text in (("part.pbrt", 'Shape "plymesh" "string filename" "made.meshes/m.ply"\n'),
                       ("grey.spd", "400 1\n700 1\n"), ("made.meshes/m.ply", quad),
                       ("s.pbrt", SCENE + 'Include "part.pbrt"\nMaterial "diffuse" '
                        '"spectrum reflectance" "grey.spd"\nShape "sphere"\n')):
        written(tmp_path, name, text)
    os.link(tmp_path / "part.pbrt", tmp_path / "link.yaml")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for output, said in (("s.pbrt", "the output 's.pbrt' would replace an input file"),
                         ("part.pbrt", "would replace an input file"),
                         ("link.yaml", "would replace the input 'part.pbrt': they are the same file"),
                         ("grey.spd", "would replace an input file"),
                         ("made.yaml", "the folder 'made.meshes' of the output would replace the input")):
        done = run("s.pbrt", "-o", output, "--overwrite", cwd=tmp_path)
        assert done.returncode == 2 and said in done.stderr, done.stderr
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


def test_what_is_no_scene_is_refused_with_all_endings(tmp_path):
    for arguments in (["s.yaml"], ["-o", "m.obj", "s.yaml"]):
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 2 and done.stderr == (
            "crt: error: crt cannot import 's.yaml': it reads .glb, .gltf, .obj, .ply, .stl, .xml, "
            ".pbrt and .pbrt.gz\n")


def test_the_program_hands_scenes_of_other_renderers_over(tmp_path):
    written(tmp_path, "s.pbrt", SCENE)
    done = subprocess.run([os.environ["CRT_PROGRAM"], "import", "s.pbrt", "-o", "made.yaml"], cwd=tmp_path,
                          capture_output=True, text=True, timeout=900,
                          env=os.environ | {"CRT_PYTHON": sys.executable})
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "made.yaml").read_text().startswith("crt: 1\n# From s.pbrt.\n")


def test_models_go_to_the_program(tmp_path):
    written(tmp_path, "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = run("m.obj", cwd=tmp_path)
    assert done.returncode == 0 and "# m.obj, imported by crt." == done.stdout.splitlines()[0]


def test_other_files_are_refused():
    with pytest.raises(crt.Error, match="is not a Mitsuba") as caught:
        crt.import_scene("scene.blend")
    assert caught.value.kind == crt.Kind.USAGE


@pytest.mark.parametrize("value, text", [
    ({"a b": 1.0, "c": [True, None, "yes", "1e3", "plain"]},
     '{"a b": 1, c: [true, null, "yes", "1e3", plain]}'),
    (1e20, "1e+20"), (0.1, "0.1"), ('"', '"\\""')])
def test_yaml_keeps_what_is_text(value, text):
    assert writing.text_of(value) == text
