"""Open Image Denoise: nearer to the converged image, of the same energy, and never in the place of what was
measured."""

import os
import subprocess
import sys

import numpy as np
import pytest

import crt
from conftest import BOX

AOVS = BOX + "outputs: [{file: a.exr, aovs: [albedo, normal, error]}]\n"
# Of five seeds the worst kept 0.52 of the error, and 0.9975 of the mean.
MARGIN, ENERGY = 0.65, 0.01
SIZE = {"film.resolution": [96, 64], "sampler.type": "independent"}


@pytest.fixture(scope="module")
def oidn():
    """The libraries that denoising needs; OpenEXR."""
    pytest.importorskip("pyoidn", reason="pyoidn is not installed")
    return pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")


@pytest.fixture(scope="module")
def converged(oidn):
    return crt.render(crt.scene(AOVS, set={**SIZE, "sampler.seed": 99}), spp=1024).image.astype(float)


def rmse(image, truth):
    return float(np.sqrt(np.mean((image - truth) ** 2)))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_is_nearer_to_the_converged_image(oidn, converged, seed):
    result = crt.render(crt.scene(AOVS, set={**SIZE, "sampler.seed": seed}), spp=8)
    before = result.image.copy()
    guided, bare = crt.denoise(result), crt.denoise(result.film, aovs=[])
    assert "8 samples a pixel, with albedo and normal" in guided.made_with and "with" not in bare.made_with
    noisy = rmse(result.image, converged)
    assert rmse(guided.image, converged) < MARGIN * noisy
    assert rmse(bare.image, converged) < MARGIN * noisy
    assert not np.array_equal(guided.image, bare.image)
    assert guided.image.dtype == np.float32 and guided.image.shape == (64, 96, 3)
    assert guided.image.min() >= 0 and guided.image.max() > 1.05, "linear, and not cut at 1"
    assert guided.image.mean() == pytest.approx(result.image.mean(), rel=ENERGY)
    assert np.array_equal(before, result.image)


def test_a_spectral_film_is_denoised_like_any_other(oidn, converged, tmp_path):
    """Its bins are no guides, and they are not in the denoised file."""
    bins = {"film.spectral": {"from_nm": 400, "to_nm": 700, "bins": 6}}
    result = crt.render(crt.scene(AOVS, set={**SIZE, **bins}), spp=8)
    denoised = crt.denoise(result)
    assert denoised.image.shape == (64, 96, 3) and "with albedo and normal" in denoised.made_with
    assert rmse(denoised.image, converged) < MARGIN * rmse(result.image[..., :3], converged)
    denoised.save(tmp_path / "a.exr")
    header = oidn.File(str(tmp_path / "a.exr")).header()
    assert "spectralLayoutVersion" not in header and "emissiveUnits" not in header
    assert crt.Image.load(str(tmp_path / "a.exr")).channels == ["R", "G", "B"]


def test_files_say_that_they_are_denoised(oidn, tmp_path):
    settings = {**SIZE, "film.exposure_ev": 1, "film.color_space": "acescg"}
    result = crt.render(crt.scene(AOVS, set=settings), spp=8)
    result.save(tmp_path / "measured.exr")
    denoised = crt.denoise(result)
    denoised.save(tmp_path / "a.exr")
    denoised.save(tmp_path / "a.png")
    header = oidn.File(str(tmp_path / "a.exr")).header()
    measured = oidn.File(str(tmp_path / "measured.exr")).header()
    assert header["crt/denoised"] == denoised.made_with and "crt/denoised" not in measured
    assert "crt/errorDegreesOfFreedom" in measured and "crt/errorDegreesOfFreedom" not in header
    for name in ("chromaticities", "crt/sceneHash", "crt/exposure", "crt/spp"):
        assert header[name] == measured[name], name
    read = crt.Image.load(str(tmp_path / "a.exr"))
    assert read.channels == ["R", "G", "B"] and np.array_equal(read.pixels, denoised.image)
    shown = crt.Image.load(str(tmp_path / "a.png")).pixels[..., :3]
    assert crt.pictures.texts((tmp_path / "a.png").read_bytes()) == {"crt/denoised": denoised.made_with}
    assert np.abs(shown - np.clip(denoised.display, 0, 1)).max() < 0.01
    assert denoised.display.mean() > 1.5 * denoised.image.mean(), "one stop brighter"
    assert denoised._repr_png_() == (tmp_path / "a.png").read_bytes()
    denoised.save(tmp_path / "a.exr")
    denoised.save(tmp_path / "a.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "a.png", "measured.exr"]


@pytest.mark.parametrize("ending", ["exr", "png"])
def test_what_was_measured_stays(oidn, tmp_path, box, ending):
    result = crt.render(box, spp=4)
    path, other = tmp_path / f"measured.{ending}", tmp_path / f"other.{ending}"
    result.save(path)
    other.write_bytes(b"something else")
    (tmp_path / f"link.{ending}").symlink_to(path)
    before = path.read_bytes()
    for name in (path, other, tmp_path / f"link.{ending}"):
        with pytest.raises(crt.Error, match=f"denoised.{ending}'") as raised:
            crt.denoise(result.film).save(name)
        assert raised.value.kind == crt.Kind.USAGE
    assert path.read_bytes() == before and other.read_bytes() == b"something else"
    path.unlink()
    with pytest.raises(crt.Error):
        crt.denoise(result).save(path)
    assert not path.exists()


def test_what_cannot_be_done_is_said(oidn, tmp_path, box):
    film = crt.render(box, spp=4).film
    for aovs, word in ((["albedo"], "albedo"), (["depth"], "depth"), (["normal"], "together with albedo")):
        with pytest.raises(crt.Error, match=word) as raised:
            crt.denoise(film, aovs=aovs)
        assert raised.value.kind == crt.Kind.USAGE
    with pytest.raises(TypeError, match="ndarray"):
        crt.denoise(np.zeros((4, 4, 3)))
    with pytest.raises(crt.Error, match="a.pfm"):
        crt.denoise(film).save(tmp_path / "a.pfm")
    with pytest.raises(crt.Error, match="cannot be written") as raised:
        crt.denoise(film).save(tmp_path / "none/a.png")
    assert raised.value.kind == crt.Kind.OUTPUT
    assert list(tmp_path.iterdir()) == []


def test_without_the_libraries_it_names_them(monkeypatch, box):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(crt.Error, match=r"pip install pyoidn OpenEXR"):
        crt.denoise(crt.render(box, spp=4))


def test_the_command_guesses_beside_the_film(oidn, tmp_path, capfd):
    """`crt denoise`: both formats of one film, the metadata say so, and the film is left as it is."""
    from crt.__main__ import main
    crt.render(crt.scene(AOVS, set=SIZE), spp=4).save(tmp_path / "a.crtfilm")
    before = (tmp_path / "a.crtfilm").read_bytes()
    names = [str(tmp_path / name) for name in ("a.exr", "a.png")]
    assert main(["denoise", str(tmp_path / "a.crtfilm"), "-o", names[0], "-o", names[1]]) == 0
    assert "4 samples a pixel, with albedo and normal; a guess" in capfd.readouterr().err
    assert "4 samples a pixel" in oidn.File(names[0], header_only=True).header()["crt/denoised"]
    assert (tmp_path / "a.crtfilm").read_bytes() == before
    assert main(["denoise", str(tmp_path / "a.crtfilm"), "-o", str(tmp_path / "a.crtfilm")]) != 0
    assert (tmp_path / "a.crtfilm").read_bytes() == before


def test_a_render_is_denoised_on_request(oidn, tmp_path):
    (tmp_path / "box.yaml").write_text(BOX)

    def render(*more):
        return subprocess.run([sys.executable, "-m", "crt", "box.yaml", "--spp", "4", *more], cwd=tmp_path,
                              capture_output=True, text=True, timeout=600,
                              env={**os.environ, "CRT_PYTHON": sys.executable})
    done = render("-o", "a.png", "-o", "b.exr", "-o", "c.pfm", "--denoise")
    assert done.returncode == 0, done.stderr
    for name in ("a.png", "b.exr", "c.pfm", "a.crtfilm", "a.denoised.png", "b.denoised.exr"):
        assert (tmp_path / name).exists(), name
    assert "crt/denoised" not in crt.pictures.texts((tmp_path / "a.png").read_bytes())
    assert "crt/denoised" in crt.pictures.texts((tmp_path / "a.denoised.png").read_bytes())
    done = render("-o", "only.pfm", "--denoise")
    assert done.returncode == 2 and "there is none" in done.stderr and not (tmp_path / "only.pfm").exists()
