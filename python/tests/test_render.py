"""Renders: bits, options, interruption, and what a result holds."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import crt
from conftest import BOX
from crt import kept_sessions
from crt.kept_sessions import kept_session


def same(a, b):
    return a.shape == b.shape and np.array_equal(a.view(np.uint8), b.view(np.uint8))


def test_bits_are_those_of_the_program(backend, program, tmp_path):
    (tmp_path / "box.yaml").write_text(BOX)
    program("render", tmp_path / "box.yaml", "-b", backend, "-q", "-o", tmp_path / "box.pfm", "--spp", 8)
    result = crt.render(tmp_path / "box.yaml", spp=8, backend=backend)
    assert same(np.ascontiguousarray(crt.Image.load(str(tmp_path / "box.pfm")).pixels), result.image.copy())
    assert result.image.mean() > 0.01


def test_result_is_numpy(box):
    result = crt.render(box, spp=32, backend="embree")
    assert result.image.shape == (16, 24, 3) and result.image.dtype == np.float32
    assert not result.image.flags.owndata and not result.image.flags.writeable
    assert result.film.xyz.shape == (16, 24, 3) and result.film.xyz.dtype == np.float64
    assert result.film.counts.shape == (16, 24) and (result.film.counts == 32).all()
    assert result.film.samples == 32 and result.stop == "samples"
    assert 0 < result.error.half_width_95 < 1
    assert result.report["samples"]["per_pixel"] == 32
    # Y of the film is the luminance of the image: linear sRGB has the weights of IEC 61966-2-1.
    y = result.image @ np.array([0.2126390, 0.7151687, 0.0721923])
    assert np.abs(y - result.film.xyz[..., 1]).max() < 1e-4 * result.film.xyz[..., 1].max()


def test_an_error_lists_missing_light(box, tmp_path):
    """No sample finds the light of a point light that a mirror reflects."""
    assert crt.render(box, spp=64, backend="embree").error.missing_light == []
    scene = tmp_path / "mirrored.yaml"
    red = "{type: diffuse, reflectance: {rgb: [0.7, 0.1, 0.1]}}"
    scene.write_text(BOX.replace(red, "{type: mirror, reflectance: 0.9}") +
                     "lights: [{type: point, position: [1, 1.5, 1], power_w: 5}]\n")
    result = crt.render(scene, spp=64, backend="embree")
    missing = result.error.missing_light
    assert len(missing) == 1 and "point" in missing[0]
    assert "+ missing light" in repr(result) and "+ missing light" in repr(result.error)
    result.save(tmp_path / "mirrored.crtfilm")
    assert crt.Film.load(str(tmp_path / "mirrored.crtfilm")).error.missing_light == missing


def test_rows_go_from_the_top(box):
    """The floor fills the lower rows, above its edge there is nothing but the lamp's lower side."""
    rows = crt.render(box, spp=16, backend="embree").film.xyz[..., 1].mean(axis=1)
    assert rows[-4:].min() > 0 and rows[-1] > 0


def test_image_outlives_the_result(box):
    image = crt.render(box, spp=4, backend="embree").image
    before = image.copy()
    crt.render(box, spp=4, backend="embree", sample_range=None)
    assert same(before, image.copy())


def test_films_add_exactly(box):
    whole = crt.render(box, spp=16, backend="embree")
    first = crt.render(box, sample_range=(0, 6), backend="embree")
    rest = crt.render(box, sample_range=(6, 16), backend="embree")
    total = first.film + rest.film
    assert total.samples == 16 and total.sample_ranges == [(0, 16)]
    assert first.film.samples == 6  # neither is changed
    assert same(whole.film.xyz, total.xyz)
    with pytest.raises(crt.Error) as refused:
        total + rest.film
    assert refused.value.kind == crt.Kind.USAGE


def test_resume(box):
    part = crt.render(box, spp=6, backend="embree")
    rest = crt.render(box, spp=16, backend="embree", resume=part.film)
    assert rest.report["samples"]["resumed"] == 6 and part.film.samples == 6
    assert same(rest.film.xyz, crt.render(box, spp=16, backend="embree").film.xyz)


def test_film_in_a_file(box, tmp_path):
    film = crt.render(box, spp=4, backend="embree").film
    film.save(str(tmp_path / "a.crtfilm"))
    assert same(crt.Film.load(str(tmp_path / "a.crtfilm")).xyz, film.xyz)
    (tmp_path / "b.crtfilm").write_bytes(b"none")
    with pytest.raises(crt.Error) as refused:
        crt.Film.load(str(tmp_path / "b.crtfilm"))
    assert refused.value.kind == crt.Kind.USAGE


def test_target_error(box):
    result = crt.render(box, backend="embree", target_error=0.2)
    assert result.stop == "target" and result.error.half_width_95 <= 0.2


def test_aovs(box):
    box["outputs"] = [{"file": "unused.exr", "aovs": ["normal", "depth"]}]
    result = crt.render(box, spp=4, backend="embree")
    assert set(result.aovs) == {"normal", "depth"}
    assert result.aovs["normal"].shape == (16, 24, 3) and result.aovs["depth"].shape == (16, 24)
    lengths = np.linalg.norm(result.aovs["normal"], axis=-1)
    assert (lengths < 1.001).all() and lengths[-1].min() > 0.99  # the floor's, at the bottom
    assert crt.render(crt.scene(BOX), spp=4, backend="embree").aovs == {}


SPECTRAL = {"film.spectral": {"from_nm": 400, "to_nm": 700, "bins": 6},
            "film.responses": {"eye": {"table": {"nm": [400, 550, 700], "value": [0, 1, 0]},
                                       "outside": "zero"}}}
SHAPES = {"albedo": (16, 24, 3), "normal": (16, 24, 3), "depth": (16, 24), "primitive": (16, 24),
          "variance": (16, 24), "samples": (16, 24), "error": (16, 24)}


@pytest.mark.parametrize("film", [{}, SPECTRAL])
def test_aovs_have_channels_of_their_own(film, tmp_path):
    settings = {**film, "outputs": [{"file": "unused.exr", "aovs": list(SHAPES)}]}
    result = crt.render(crt.scene(BOX, set=settings), spp=16, backend="embree")
    assert {name: plane.shape for name, plane in result.aovs.items()} == SHAPES
    whole = {name: plane.dtype for name, plane in result.aovs.items() if plane.dtype != np.float32}
    assert whole == {"primitive": np.uint32, "samples": np.uint32}
    assert (result.aovs["samples"] == 16).all() and len(np.unique(result.aovs["primitive"])) > 2
    result.save(tmp_path / "a.exr")
    saved = crt.Image.load(str(tmp_path / "a.exr"))
    named = {"albedo": "Albedo.", "normal": "Ns.", "depth": "Z", "variance": "Variance.",
             "error": "StdError."}
    for name, start in named.items():
        own = [i for i, channel in enumerate(saved.channels) if channel.startswith(start)]
        planes = [saved.pixels[..., own].reshape(SHAPES[name]), result.aovs[name]]
        assert same(*map(np.ascontiguousarray, planes)), name
    assert result.image.shape == (16, 24, 10 if film else 3)


def test_notebook_picture(box, tmp_path):
    result = crt.render(box, spp=16, backend="embree")
    (tmp_path / "a.png").write_bytes(result._repr_png_())
    result.save(tmp_path / "b.png")
    a, b = (crt.Image.load(str(tmp_path / f"{name}.png")).pixels for name in "ab")
    assert a.shape == (16, 24, 3)
    assert np.abs(a - b).max() < 0.012  # one step of 8 bits, where both round


def test_progress_and_exceptions(box):
    heard = []
    crt.render(box, spp=4096, backend="embree", on_progress=heard.append)
    assert heard and heard[-1]["samples"] <= 4096 and heard[-1]["fraction"] <= 1

    def fail(now):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        crt.render(box, spp=1 << 22, backend="embree", on_progress=fail)


def test_other_threads_run_meanwhile(box):
    # Were they held up, each would run once or twice between two renders, and never twenty times in one.
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    def counted_in_one(seconds):
        before = counted[0]
        crt.render(box, backend="embree", time_limit=seconds)
        return counted[0] - before

    thread = threading.Thread(target=count)
    thread.start()
    # A second try takes twice as long, up to 38 s: the machine may have much else to do.
    enough = any(counted_in_one(0.6 * 2**i) >= 20 for i in range(7))
    done.set()
    thread.join()
    assert enough


def test_renders_of_two_threads_do_not_mix(box):
    alone = crt.render(box, spp=64, backend="embree").film.xyz
    results = [None] * 4

    def render(i):
        results[i] = crt.render(crt.scene(BOX), spp=64, backend="embree").film.xyz

    threads = [threading.Thread(target=render, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same(alone, xyz) for xyz in results)


def test_interrupt_keeps_the_film(tmp_path):
    script = textwrap.dedent("""
        import sys, crt
        sys.path.insert(0, sys.argv[1])
        from conftest import BOX
        print("begin", flush=True)
        result = crt.render(crt.scene(BOX), spp=1 << 24, backend="embree",
                            on_progress=lambda now: print("on", flush=True))
        print("end", result.stop, result.film.samples, flush=True)
    """)
    process = subprocess.Popen([sys.executable, "-c", script, os.path.dirname(__file__)], text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while process.stdout.readline().strip() != "on":
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, said = process.communicate(timeout=900)
    word, stop, samples = out.split()[-3:]
    assert process.returncode == 0 and (word, stop) == ("end", "interrupted") and 0 < int(samples) < 1 << 24
    assert "interrupted" in said


def test_interrupt_within_a_function_of_python(box):
    """Ctrl-C finds the interpreter at a random place: here it is in the function that receives progress."""
    def interrupt(now):
        raise KeyboardInterrupt

    result = crt.render(box, spp=1 << 24, backend="embree", on_progress=interrupt)
    assert result.stop == "interrupted" and 0 < result.film.samples < 1 << 24


def test_bad_options(box):
    for wrong in ({"spp": 0}, {"backend": "none"}, {"target_error": 1.5}, {"sample_range": (4, 4)},
                  {"devices": "no such device"}):
        with pytest.raises(crt.Error) as refused:
            crt.render(box, **{"backend": "embree", **wrong})
        assert refused.value.kind in (crt.Kind.USAGE, crt.Kind.BACKEND) and str(refused.value)


def test_plugins():
    found = {plugin.name: plugin for plugin in crt.plugins()}
    assert "embree" in found and (found["embree"].devices or found["embree"].reason)


def test_session_has_the_bits_of_renders(box, backend):
    whole = crt.render(box, spp=16, backend=backend)
    with crt.Session(box) as session:
        first = session.render(sample_range=(0, 6), backend=backend)
        rest = crt.render(session, sample_range=(6, 16), backend=backend)
        assert same((first.film + rest.film).xyz, whole.film.xyz)
        assert first.report["seconds"]["open"] > 0
        assert rest.report["seconds"]["open"] < first.report["seconds"]["open"] / 10
    with pytest.raises(crt.Error) as refused:
        session.render(spp=1)
    assert refused.value.kind == crt.Kind.USAGE


def test_a_report_without_the_error(box):
    result = crt.render(box, spp=1024, backend="embree", estimate_error=False)
    assert result.report["error"] is None and 0 < result.error.half_width_95 < 1
    assert crt.render(box, spp=1024, backend="embree").report["error"]["half_width_95"] == pytest.approx(
        result.error.half_width_95)


def test_threads_take_turns_with_a_session(box):
    expected = crt.render(box, spp=4, backend="embree").film.xyz
    found = {}
    with crt.Session(box) as session:
        def render(i):
            found[i] = session.render(spp=4, backend="embree").film.xyz

        threads = [threading.Thread(target=render, args=[i]) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(found) == 4 and all(same(expected, film) for film in found.values())


def test_kept_sessions_are_used_again_and_then_closed(box, monkeypatch):
    monkeypatch.setattr(kept_sessions, "IDLE_SECONDS", 0.2)
    with kept_session(box) as first:
        with kept_session(box) as other:  # As another thread of a worker has it.
            assert other is not first
    with kept_session(box) as again:
        assert again is first or again is other
    with pytest.raises(ZeroDivisionError), kept_session(box) as spoilt:
        1 / 0
    with kept_session(box) as third:
        assert third is not spoilt
    end = time.monotonic() + 600
    while kept_sessions._IDLE and time.monotonic() < end:
        time.sleep(0.05)
    assert not kept_sessions._IDLE
    with pytest.raises(crt.Error):
        third.render(spp=1)
