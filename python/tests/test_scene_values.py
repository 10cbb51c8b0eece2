"""Scenes as values: their keys are read, and they are copied, pickled and written."""

import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import pytest
import yaml

import crt
from conftest import BOX
from test_render import same
from test_scenes import field, textured, xyz

ROOM = """
crt: 1
film: {resolution: [24, 16], filter: gaussian}
camera: {position: [0, 1, 3], target: [0, 0.4, 0], focal_length: 35, sensor: [36, 24]}
spectra: {paint: {file: paint.csv, outside: clamp}}
materials: {grey: {type: diffuse, reflectance: paint}, a.b: {type: diffuse, reflectance: .5}}
objects:
  - {name: floor, material: grey, obj: square.obj}
"""
USER = """
crt: 1
include: parts/room.yaml
title: "2024"
camera: {fov: +50}
sampler: {samples: 16}
materials: {red: {type: diffuse, reflectance: {texture: red.pfm}}}
objects:
  - {name: ball, material: red, sphere: {radius: 0.5}, transform: [{translate: [0, 0.5, 0]}]}
environment: {radiance: 1e0}
outputs: [{file: picture.png}]
"""


@pytest.fixture
def files(tmp_path):
    """A scene that includes one from another folder, each with files next to it."""
    parts = tmp_path / "parts"
    parts.mkdir()
    (parts / "room.yaml").write_text(ROOM)
    (parts / "paint.csv").write_text("400,0.4\n700,0.8\n")
    (parts / "square.obj").write_text("v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n")
    (tmp_path / "red.pfm").write_bytes(b"PF\n1 1\n-1.0\n" + np.array([0.7, 0.1, 0.1], "<f4").tobytes())
    (tmp_path / "user.yaml").write_text(USER)
    return tmp_path


def test_keys_are_read(files):
    scene = crt.load(files / "user.yaml", set={"materials.red.reflectance": 0.25})
    scene["film.resolution"] = [12, 8]
    assert scene["film.resolution"] == [12, 8] and scene["film.filter"] == "gaussian"
    assert scene["camera"] == {"position": [0, 1, 3], "target": [0, 0.4, 0], "fov": 50}
    assert scene["materials.red.reflectance"] == 0.25 and scene["materials.a.b.reflectance"] == 0.5
    assert scene["objects.1.transform.0.translate"] == [0, 0.5, 0] and scene["title"] == "2024"
    assert scene["environment.radiance"] == 1 and scene["outputs.0.file"] == "picture.png"
    scene["camera.position"] = np.add(scene["camera.position"], [0, 0, 1])
    assert scene["camera.position"] == [0, 1, 4] and scene.get("camera.position.2") == 4
    del scene["camera.position"]
    assert scene["camera.position"] == [0, 1, 3]
    scene["camera.position"].append(7)
    assert scene["camera.position"] == [0, 1, 3]
    scene["title"] = "Glass 😀"
    assert scene["title"] == scene.title == "Glass 😀"


def test_keys_are_asked_for(files):
    scene = crt.load(files / "user.yaml")
    assert set(scene) == set(scene.keys()) == {"crt", "title", "film", "camera", "sampler", "spectra",
                                               "materials", "objects", "environment", "outputs"}
    assert dict(scene) == scene.to_dict()
    assert "camera.fov" in scene and "objects.0" in scene and "camera.position.2" in scene
    for absent in ("camera.focal_length", "include", "objects.2", "objects.-1", "camera.fov.x", "camera.",
                   ""):
        assert absent not in scene and scene.get(absent, 3) == 3
    assert 1 not in scene


@pytest.mark.parametrize("key, answer", [
    ("camera.postion", "did you mean 'camera.position'"), ("camer.fov", "did you mean 'camera'"),
    ("film.exposure_ev", "'film' has resolution, filter"),
    ("objects.7.name", "'objects' is a list of 2"),
    ("camera.fov.x", "'camera.fov' is 50"), ("zzz", "the scene has crt, ")])
def test_missing_keys_are_errors_with_advice(files, key, answer):
    with pytest.raises(KeyError) as raised:
        crt.load(files / "user.yaml")[key]
    error = raised.value
    assert isinstance(error, crt.Error) and error.kind == crt.Kind.USAGE
    assert str(error).startswith(f"the scene does not set '{key}'; ") and answer in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is crt.MissingKey and str(again) == str(error)
    with pytest.raises(TypeError):
        crt.load(files / "user.yaml")[0]


def test_errors_of_the_scene_are_raised(files):
    (files / "parts/square.obj").unlink()
    with pytest.raises(crt.Error, match="square.obj"):
        crt.load(files / "user.yaml")["camera.fov"]


def test_a_dict_makes_the_same_scene(files, monkeypatch, tmp_path_factory):
    scene = crt.load(files / "user.yaml", set={"film.resolution": [12, 8]})
    expected = xyz(scene)
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    content = scene.to_dict()
    assert same(xyz(crt.scene(content)), expected) and same(xyz(crt.scene(scene.to_yaml())), expected)
    assert yaml.safe_load(scene.to_yaml()) == content == json.loads(json.dumps(content))
    assert content["objects"][0]["obj"] == str(files / "parts/square.obj")


def test_a_scene_is_saved(files, monkeypatch, tmp_path_factory):
    scene = crt.load(files / "user.yaml", set={"film.resolution": [12, 8]})
    expected = xyz(scene)
    other = tmp_path_factory.mktemp("other")
    scene.save(other / "far.yaml")
    monkeypatch.chdir(files)
    scene.save("near.yaml")
    for path in (other / "far.yaml", files / "near.yaml"):
        assert same(xyz(path), expected)
    near = yaml.safe_load((files / "near.yaml").read_text())
    assert near["objects"][0]["obj"] == "parts/square.obj"
    assert near["materials"]["red"]["reflectance"]["texture"] == "red.pfm"
    before = (files / "near.yaml").read_text()
    scene["film.resolution"] = [6, 4]
    with pytest.raises(crt.Error, match="overwrite=True") as raised:
        scene.save(files / "near.yaml")
    assert raised.value.kind == crt.Kind.USAGE and (files / "near.yaml").read_text() == before
    scene.save(files / "near.yaml", overwrite=True)
    assert crt.load(files / "near.yaml").width == 6
    with pytest.raises(crt.Error) as raised:
        scene.save(files / "none/a.yaml")
    assert raised.value.kind == crt.Kind.OUTPUT


def arrays():
    positions, faces = field(40)
    scene = textured(np.random.default_rng(1).uniform(0.1, 0.9, (4, 6, 3)).astype(np.float32))
    scene["objects"].append({"name": "field", "material": "red",
                             "mesh": {"positions": positions.astype(np.float32), "faces": faces}})
    return scene


def test_arrays_come_back_and_are_saved(tmp_path):
    source = arrays()
    scene = crt.scene(source)
    expected = xyz(scene)
    content = scene.to_dict()
    assert content["objects"][-1]["mesh"]["positions"] is source["objects"][-1]["mesh"]["positions"]
    texture = source["materials"]["picture"]["reflectance"]["texture"]
    assert scene["materials.picture.reflectance.texture"] is texture
    scene.save(tmp_path / "a.yaml")
    del scene
    assert same(xyz(crt.scene(content)), expected) and same(xyz(tmp_path / "a.yaml"), expected)
    assert len(list((tmp_path / "a.meshes").iterdir())) == 2
    with pytest.raises(crt.Error, match="scene.save"):
        crt.scene(content).to_yaml()
    del content["materials"]["picture"], content["objects"][0]
    assert same(xyz(crt.scene(crt.scene(content).to_yaml())), xyz(crt.scene(content)))


def test_models_are_written_too(files):
    model = crt.load(files / "parts/square.obj", set={"film.resolution": [24, 16]})
    assert "objects.0.obj" in model and same(xyz(crt.scene(model.to_dict())), xyz(model))


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, crt.Scene.copy,
                                    lambda scene: pickle.loads(pickle.dumps(scene))])
@pytest.mark.parametrize("kind", ["file", "text", "dict"])
def test_copies_are_changed_apart(files, kind, copied):
    scene = {"file": lambda: crt.load(files / "user.yaml"), "text": lambda: crt.scene(BOX),
             "dict": lambda: crt.scene(arrays())}[kind]()
    scene["film.resolution"] = [12, 8]
    before = xyz(scene)
    other = copied(scene)
    assert same(xyz(other), before)
    other["film.resolution"] = [6, 4]
    other["sampler.seed"] = 5
    assert (scene.width, other.width) == (12, 6) and "sampler.seed" not in scene and other.seed == 5


def test_a_render_takes_a_seed(box):
    before = xyz(box)
    seeded = crt.render(box, spp=8, seed=7, backend="embree")
    assert not same(seeded.film.xyz, before) and same(xyz(box), before)
    box["sampler.seed"] = 7
    assert same(xyz(box), seeded.film.xyz)
    with crt.Session(crt.scene(BOX), seed=7) as session:
        assert same(session.render(spp=8, backend="embree").film.xyz, seeded.film.xyz)
        with pytest.raises(crt.Error, match="seed") as raised:
            session.render(seed=8)
        assert raised.value.kind == crt.Kind.USAGE
    with pytest.raises(crt.Error, match="seed"):
        crt.render(box, seed=-1)


def test_what_is_shown(files):
    scene = crt.load(files / "user.yaml", set={"film.resolution": [12, 8]})
    for word in ("'2024'", "user.yaml", "film.resolution set", "12 x 8", "16 samples"):
        assert word in repr(scene)
    assert "of text" in repr(crt.scene(BOX)) and "of a dict" in repr(crt.scene(yaml.safe_load(BOX)))
    wrong = repr(crt.scene("crt: 1\nfilm: 3"))
    assert "has errors" in wrong and "film" in wrong
    result = crt.render(crt.scene(BOX), spp=64, backend="embree")
    error = result.error
    assert f"{100 * error.relative_rmse:.3g}" in repr(error)
    assert f"{100 * error.half_width_95:.3g} %" in repr(error)
    assert repr(result.film) == "<crt.Film 24 x 16, 64 samples a pixel>"
    assert repr(result.film.develop()) == "<crt.Image 24 x 16: R, G, B>"
    for plugin in crt.plugins():
        assert plugin.name in repr(plugin) and (plugin.reason or plugin.devices[0].name) in repr(plugin)
        assert all(device.name in repr(device) for device in plugin.devices)


def test_distributed_is_reached_without_being_imported_first():
    script = ("import sys, crt\nassert 'dask' not in sys.modules\nprint(crt.distributed.__name__)\n"
              "try: crt.nothing\nexcept AttributeError as error: print(error)")
    pytest.importorskip("distributed", reason="Dask is not installed")
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert done.stdout == "crt.distributed\nmodule 'crt' has no attribute 'nothing'\n", done.stderr
