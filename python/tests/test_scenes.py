"""Scenes: keys, errors with their places, dicts and arrays."""

import gc
import logging
import os
import pathlib
import signal
import tempfile

import numpy as np
import pytest
import yaml

import crt
from conftest import BOX
from test_render import same


def xyz(scene, spp=8):
    return crt.render(scene, spp=spp, backend="embree").film.xyz


def test_keys_are_set(box):
    before = xyz(box)
    box["film.resolution"] = np.array([12, 8])
    box["materials.red.reflectance"] = np.float32(0.25)
    assert (box.width, box.height) == (12, 8)
    other = crt.scene(BOX, set={"film.resolution": (12, 8), "materials.red.reflectance": 0.25})
    assert same(xyz(box), xyz(other))
    copy = box.copy()
    del copy["film.resolution"]
    del copy["materials.red.reflectance"]
    assert same(xyz(copy), before) and box.width == 12


def test_errors_have_a_place(tmp_path):
    file = tmp_path / "wrong.yaml"
    file.write_text(BOX.replace("fov: 50", "fof: 50"))
    with pytest.raises(crt.Error) as wrong:
        crt.load(file).native
    error = wrong.value
    assert error.kind == crt.Kind.SCENE and error.file == str(file) and error.line == 4 and error.column > 1
    assert "fof" in str(error) and "fov" in str(error)
    with pytest.raises(crt.Error) as missing:
        crt.load(tmp_path / "none.yaml").native
    assert missing.value.kind in (crt.Kind.SCENE, crt.Kind.USAGE)
    with pytest.raises(crt.Error) as unknown:
        crt.scene(BOX, set={"film.resolutoin": 1}).native
    assert unknown.value.kind == crt.Kind.SCENE and "resolution" in str(unknown.value)


def test_a_dict_is_its_text(box):
    assert same(xyz(yaml.safe_load(BOX)), xyz(box))


def field(n):
    """A wavy square of 2 n² triangles: positions and faces as lists of Python numbers."""
    axis = np.linspace(-1, 1, n + 1)
    x, z = np.meshgrid(axis, axis)
    y = 0.2 * np.sin(5 * x) * np.cos(4 * z)
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    i = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    faces = np.concatenate([np.stack([i, i + n + 1, i + 1], 1), np.stack([i + 1, i + n + 1, i + n + 2], 1)])
    return positions, faces


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_arrays_are_their_numbers(dtype):
    positions, faces = field(40)
    positions = positions.astype(dtype)
    uvs = (0.5 + 0.5 * positions[:, [0, 2]]).astype(dtype)
    scene = yaml.safe_load(BOX)
    checker = {"checker": [0.2, 0.8], "scale": [8, 3]}
    scene["materials"]["board"] = {"type": "diffuse", "reflectance": checker}
    written = {**scene, "objects": scene["objects"][2:] + [
        {"name": "field", "material": "board",
         "mesh": {"positions": positions.tolist(), "faces": faces.tolist(), "uvs": uvs.tolist()}}]}
    arrays = {**scene, "objects": scene["objects"][2:] + [
        {"name": "field", "material": "board",
         "mesh": {"positions": positions, "faces": faces, "uvs": uvs}}]}
    a, b = crt.scene(written), crt.scene(arrays)
    assert same(xyz(a), xyz(b)) and xyz(a).mean() > 0
    assert any(name.endswith(".ply") for name in b.files_read)


def textured(texture):
    scene = yaml.safe_load(BOX)
    scene["materials"]["picture"] = {"type": "diffuse", "reflectance": {"texture": texture}}
    scene["objects"][0]["material"] = "picture"
    scene["objects"][0]["mesh"]["uvs"] = [[0, 1], [0, 0], [1, 0], [1, 1]]
    return scene


def test_textures_are_arrays(tmp_path):
    rng = np.random.default_rng(1)
    floats = rng.uniform(0.1, 0.9, (8, 12, 3)).astype(np.float32)
    # A PFM that this test writes by itself: bottom row first.
    file = tmp_path / "floats.pfm"
    file.write_bytes(b"PF\n12 8\n-1.0\n" + b"".join(row.astype("<f4").tobytes() for row in reversed(floats)))
    of_file = xyz(textured(str(file)))
    assert same(xyz(textured(floats)), of_file)
    assert not same(xyz(textured(floats[::-1].copy())), of_file)  # rows matter

    eight = rng.integers(20, 230, (8, 12, 3), dtype=np.uint8)
    decoded = np.where(eight / 255 <= 0.04045, eight / 255 / 12.92, ((eight / 255 + 0.055) / 1.055) ** 2.4)
    a, b = xyz(textured(eight), 64), xyz(textured(decoded.astype(np.float32)), 64)
    assert np.abs(a - b).max() < 1e-3 * a.max()


def test_wrong_arrays():
    positions, faces = field(40)
    for wrong in ({"positions": positions[:, :2], "faces": faces},
                  {"positions": positions, "faces": faces + len(positions)},
                  {"positions": positions, "faces": faces.astype(float)},
                  {"positions": positions, "faces": faces, "uvs": positions[:5, :2]}):
        scene = yaml.safe_load(BOX)
        scene["objects"][0]["mesh"] = wrong
        with pytest.raises(ValueError):
            crt.scene(scene).native
    with pytest.raises(ValueError):
        crt.scene(textured(np.zeros((4, 4, 2)))).native
    with pytest.raises(TypeError):
        crt.scene(17)
    nan = positions.copy()
    nan[7, 1] = np.nan
    scene = yaml.safe_load(BOX)
    scene["objects"][0]["mesh"] = {"positions": nan, "faces": faces}
    with pytest.raises(ValueError, match="row 7"):
        crt.scene(scene).native


def test_files_of_arrays_go_with_the_scene():
    scene = crt.scene(textured(np.full((4, 4, 3), 0.5, np.float32)))
    files = [pathlib.Path(name) for name in scene.files_read if "crt-arrays" in name]
    assert len(files) == 1 and files[0].exists()
    copy = scene.copy()
    del scene
    assert xyz(copy).mean() > 0 and files[0].exists()
    del copy
    gc.collect()
    assert not files[0].parent.exists()


def forked_with_arrays(folder):
    """A process with a scene of a dict, and the folder of its arrays."""
    before = set(folder.iterdir())
    made, begun = os.pipe()
    process = os.fork()
    if process == 0:
        kept = crt.scene(yaml.safe_load(BOX))
        os.write(begun, b"x")
        signal.pause()
        os._exit(kept is None)
    assert os.read(made, 1) == b"x"
    (own,) = set(folder.iterdir()) - before
    return process, own


def unlocked(path):
    path.mkdir(parents=True)
    (path / "lock").touch()
    return path


def test_folders_of_killed_processes_are_removed_and_no_others(tmp_path, monkeypatch):
    temporary = tmp_path / "temporary"
    others = [unlocked(tmp_path / "linked"), unlocked(temporary / "other-arrays-1")]
    if os.geteuid() == 0:
        others.append(unlocked(temporary / "crt-arrays-of-another-user"))
        os.chown(others[-1], 1, 1)
    others += [temporary / "crt-arrays-without-a-lock", temporary / "crt-arrays-link"]
    others[-2].mkdir()
    others[-1].symlink_to(tmp_path / "linked")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    (killed, left), (living, kept) = forked_with_arrays(temporary), forked_with_arrays(temporary)
    try:
        os.kill(killed, signal.SIGKILL)
        os.waitpid(killed, 0)
        own = crt.scene(yaml.safe_load(BOX))._source.folder.path
        assert not left.exists() and kept.exists()
        assert all((path / "lock").exists() or path == others[-2] for path in others) and others[-2].exists()
    finally:
        os.kill(living, signal.SIGKILL)
        os.waitpid(living, 0)
    assert own.parent.parent == temporary and not own.parent.exists()  # It went with its scene.


def test_a_forked_process_leaves_the_folder_of_arrays(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    scene = crt.scene(yaml.safe_load(BOX))
    process = os.fork()
    if process == 0:
        del scene
        gc.collect()
        os._exit(0)
    assert os.waitpid(process, 0)[1] == 0
    assert scene._source.folder.path.is_dir()
    del scene
    gc.collect()
    assert not list(tmp_path.iterdir())


def test_folders_of_arrays_take_one_open_file():
    before = len(os.listdir("/proc/self/fd"))
    scenes = [crt.scene(yaml.safe_load(BOX)) for _ in range(20)]
    assert len({scene._source.folder.path for scene in scenes}) == 20
    assert len(os.listdir("/proc/self/fd")) <= before + 1


def test_messages_go_to_logging(caplog):
    scene = yaml.safe_load(BOX)
    scene["lights"] = [{"type": "point", "position": [0, 1.5, 0], "power_w": 1}]
    scene["materials"]["grey"] = scene["materials"]["red"] = {"type": "mirror", "reflectance": 0.9}
    with caplog.at_level(logging.INFO, logger="crt"):
        crt.render(scene, spp=1, backend="embree")
    assert any("point" in record.getMessage() for record in caplog.records)


def test_configs_load():
    for file in sorted(pathlib.Path(os.environ["CRT_CONFIGS"]).glob("*.yaml"))[:4]:
        assert crt.load(file, set={"film.resolution": [8, 8]}).width == 8


def test_examples_are_scenes_that_can_be_read(monkeypatch, tmp_path):
    assert {"cornell_box", "prism", "forest"} <= set(crt.examples())
    path = crt.example("cornell_box")
    assert path.is_file() and crt.load(path).title == "Cornell box"
    with pytest.raises(crt.Error, match="did you mean 'cornell_box'") as raised:
        crt.example("cornel_box")
    assert raised.value.kind == crt.Kind.USAGE
    monkeypatch.setenv("CRT_CONFIGS", str(tmp_path / "none"))
    with pytest.raises(crt.Error, match="none"):
        crt.examples()


def test_examples_are_found_beside_the_package(monkeypatch, tmp_path):
    monkeypatch.delenv("CRT_CONFIGS", raising=False)
    for package, place in (("wheel/crt", "wheel/crt/_tree/share/crt/configs"),
                           ("build/python/crt", "build/share/crt/configs")):
        package, place = tmp_path / package, tmp_path / place
        place.mkdir(parents=True)
        (place / "one.yaml").write_text("crt: 1")
        monkeypatch.setattr(crt.scenes, "__file__", str(package / "scenes.py"))
        assert crt.examples() == ["one"] and crt.example("one") == place / "one.yaml"
