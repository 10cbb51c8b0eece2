"""compare, converge and verify: what the program finds, with its errors and its codes."""

import logging

import numpy as np
import pytest

import crt
from conftest import BOX, usable


@pytest.fixture(autouse=True)
def no_pages(monkeypatch):
    """test_report.py has the pages of runs, which take longer than these runs themselves."""
    monkeypatch.setenv("CRT_PYTHON", "")


def test_the_same_samples_are_the_same_image(box):
    a, b = (crt.render(box, spp=16, backend=name) for name in (usable()[0], usable()[-1]))
    judged = crt.compare(a, b.film, all_channels=True)
    assert judged and judged.figures["differing_pixels"] == 0


def test_other_samples_are_another_image(box, tmp_path):
    a = crt.render(box, spp=16)
    a.save(tmp_path / "a.exr")
    b = crt.render(box, sample_range=(16, 32))
    judged = crt.compare(tmp_path / "a.exr", b)
    assert not judged
    assert judged.figures["differing_pixels"] > 100
    difference = np.sqrt(np.mean((a.image.astype(float) - b.image) ** 2))
    assert judged.figures["metrics"]["rmse"] == pytest.approx(difference, rel=1e-6)
    assert crt.compare(a, b, tolerance=10)


def test_names_that_look_like_options_are_names(box, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    crt.render(box, spp=1).save("--help.exr")
    assert crt.compare("--help.exr", "--help.exr")


def test_what_is_no_image_is_an_error(tmp_path):
    (tmp_path / "a.exr").write_text("no image")
    with pytest.raises(crt.Error) as raised:
        crt.compare(tmp_path / "a.exr", tmp_path / "a.exr")
    assert raised.value.kind == crt.Kind.USAGE
    assert "a.exr" in str(raised.value)


def test_a_run_of_converge(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "--help").write_text(BOX)  # A name that looks like an option.
    scene = crt.load("--help", set={"integrator.max_depth": 2})
    judged = crt.converge(scene, tmp_path / "run", backends=[usable()[0]], time_limit=1, replicates=4,
                          vary={"sampler": ["sobol", "independent"]}, resolution=24)
    assert judged.folder == tmp_path / "run"
    assert "sampler=sobol,independent" in judged.figures["environment"]["commands"][0]
    assert "integrator.max_depth=2" in judged.figures["environment"]["commands"][0]


def test_an_error_of_the_scene_has_its_place(tmp_path):
    broken = crt.scene(BOX.replace("resolution", "resolutio"), directory=tmp_path)
    with pytest.raises(crt.Error) as raised:
        crt.converge(broken, tmp_path / "run", time_limit=3)
    assert raised.value.kind == crt.Kind.SCENE
    assert (raised.value.line, raised.value.column) == (3, 8)
    assert list(tmp_path.glob(".scene-*")) == []


def test_a_backend_is_verified(tmp_path):
    judged = crt.verify(usable()[0], cases=["furnace"], output=tmp_path / "page")
    assert judged and [case["id"] for case in judged.figures["cases"]] == ["A01"]
    assert (tmp_path / "page" / "verify.json").exists()
    with pytest.raises(crt.Error) as raised:
        crt.verify("nosuch", cases=["A01"])
    assert raised.value.kind == crt.Kind.BACKEND


def test_what_the_program_says_goes_to_the_logger(box, tmp_path, caplog):
    with caplog.at_level(logging.INFO, logger="crt"):
        crt.converge(box, tmp_path / "run", backends=[usable()[0]], time_limit=1, replicates=4,
                     resolution=24)
    assert any("wrote" in record.message for record in caplog.records)
