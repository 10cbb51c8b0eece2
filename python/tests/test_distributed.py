"""Renders on a cluster of Dask on this machine: bits, lost workers, checkpoints, errors, and ends."""

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
import types

import numpy as np
import pytest

distributed = pytest.importorskip("distributed",
                                  reason="Dask is not installed (pip install dask distributed)")

import crt  # noqa: E402 (after what may skip)
import crt.distributed  # noqa: E402
from crt import cluster_work  # noqa: E402
from crt.sample_ranges import ENDLESS, Missing, PartSize  # noqa: E402
from conftest import BOX  # noqa: E402
from test_render import same  # noqa: E402

ONE = {"backend": "embree", "threads": 1}


@pytest.fixture(scope="module")
def client():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as found:
            yield found


@pytest.fixture(scope="module")
def threads_client():
    """Workers within this process."""
    with distributed.Client(processes=False, n_workers=2, threads_per_worker=1,
                            dashboard_address=None) as found:
        yield found


def same_film(a, b):
    """Sums, counts, samples, and what follows from all channels."""
    return (same(a.xyz, b.xyz) and same(a.counts, b.counts) and a.sample_ranges == b.sample_ranges
            and same(a.develop().pixels.copy(), b.develop().pixels.copy())
            and error_of(a) == pytest.approx(error_of(b), rel=1e-12))


def error_of(film):
    return film.error.half_width_95 if film.error else -1.0


def test_a_film_pickles(box):
    film = crt.render(box, spp=4, backend="embree").film
    again = pickle.loads(pickle.dumps(film))
    assert same_film(film, again) and again.aovs == film.aovs
    function, (data,) = crt.pickling.reduced(film)
    with pytest.raises(crt.Error):
        function(data[:-1] + bytes([data[-1] ^ 1]))


def test_scenes_pickle(tmp_path, monkeypatch):
    (tmp_path / "box.yaml").write_text(BOX)
    monkeypatch.chdir(tmp_path)
    grid = np.linspace(0, 1, 300, dtype=np.float32).reshape(10, 10, 3)
    for scene in (crt.load("box.yaml"), crt.scene(BOX),
                  crt.scene({"crt": 1, "camera": {"position": [0, 0, 3], "target": [0, 0, 0], "fov": 40},
                             "film": {"resolution": [8, 8]}, "environment": {"radiance": 1},
                             "materials": {"m": {"type": "diffuse", "reflectance": {"texture": grid}}},
                             "objects": [{"name": "b", "material": "m", "sphere": {"radius": 1}}]})):
        scene["film.resolution"] = [20, 12]
        monkeypatch.chdir(tmp_path)
        sent = pickle.dumps(scene)
        film = crt.render(scene, spp=2, backend="embree").film
        monkeypatch.chdir("/")  # The progress of a worker is random.
        again = pickle.loads(sent)
        assert again.overrides == scene.overrides and (again.width, again.height) == (20, 12)
        assert same(crt.render(again, spp=2, backend="embree").film.xyz, film.xyz)


def test_errors_pickle(box):
    error = pickle.loads(pickle.dumps(crt.Error("no", crt.Kind.SCENE, "a.yaml", 3, 4)))
    assert (str(error), error.kind, error.file, error.line, error.column) == ("no", 3, "a.yaml", 3, 4)
    film = crt.render(box, spp=2, backend="embree").film
    failed = pickle.loads(pickle.dumps(crt.RenderFailed("lost", crt.Kind.DEVICE, "", 0, 0, film)))
    assert failed.kind == crt.Kind.DEVICE and failed.file is None and same_film(failed.film, film)


@pytest.mark.parametrize("parts", [None, 13])
def test_bits_are_those_of_one_render(client, box, parts):
    heard = []
    result = crt.distributed.render(box, client, spp=1201, parts=parts, on_progress=heard.append, **ONE)
    assert same_film(result.film, crt.render(box, spp=1201, backend="embree").film)
    assert result.stop == "samples" and result.report["samples"] == {"per_pixel": 1201, "resumed": 0}
    told = result.report["distributed"]
    assert told["parts"] > 4 and told["merges"] > 0 and heard[-1]["samples"] == 1201
    assert [now["samples"] for now in heard] == sorted(now["samples"] for now in heard)
    assert heard[0]["threads"] == 2


def test_killed_workers_change_nothing(box):
    """Two of four are killed while parts run on them and films lie on them."""
    box["film.resolution"] = [32, 32]
    killed = []
    with distributed.LocalCluster(n_workers=4, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            pids = sorted(client.run(os.getpid).values())

            def kill(now):
                if now["parts"] >= 8 and not killed:
                    killed.extend(pids[:2])
                    for pid in killed:
                        os.kill(pid, signal.SIGKILL)

            result = crt.distributed.render(box, client, spp=2048, parts=32, on_progress=kill, **ONE)
            assert len(killed) == 2 and not set(killed) & set(client.run(os.getpid).values())
    assert same_film(result.film, crt.render(box, spp=2048, backend="embree").film)


class FourThreads:
    """Stands for a client."""

    def submit(self, *_, **__):
        return None

    def nthreads(self):
        return {"one": 3, "other": 1}


@pytest.mark.parametrize("samples, running", [(10_000, 5), (2_600, 5), (2_500, 4), (300, 4)])
def test_no_part_waits_behind_another_at_the_end(box, samples, running):
    """As long as parts have 320 samples one more than there are threads is on its way."""
    size = PartSize()
    size.learn(160, 10.0)
    work = cluster_work.Work(FourThreads(), box, {}, Missing([], samples), size, None, None, 60)
    started = []
    work.start = lambda parts, _: started.extend(parts)
    work.submit(None, ENDLESS)
    assert len(started) == running
    assert len(set(started)) == running and min(end - first for first, end in started) > 0


@pytest.mark.parametrize("samples, workers, checkpoint, fetched", [
    (3_800, 64, None, False), (3_900, 64, None, True), (3_800, 65, None, True),
    (3_800, 64, "box.crtfilm", True)])
def test_films_are_not_fetched_just_before_the_end(box, samples, workers, checkpoint, fetched):
    """Four threads have 3,840 samples in the minute between two merges."""
    size = PartSize()
    size.learn(160, 10.0)
    work = cluster_work.Work(FourThreads(), box, {}, Missing([], samples), size, None, checkpoint, 60)
    work.piles = {worker: ["a film"] for worker in range(workers)}
    work.merged -= 61
    merged = []
    work.merge = lambda: merged.append(True)
    work.harvest(False)
    assert bool(merged) == fetched


def test_late_workers_get_parts(box):
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            heard = []

            def grow(now):
                heard.append(now["threads"])
                if len(heard) == 1:
                    cluster.scale(2)

            box["film.resolution"] = [48, 48]
            result = crt.distributed.render(box, client, time_limit=6, on_progress=grow, **ONE)
    assert heard[0] == 1 and heard[-1] == 2 and result.report["distributed"]["threads_most"] == 2
    assert result.stop == "time" and result.film.samples > 0
    assert 5 < result.report["seconds"]["total"] < 9


def test_checkpoint_is_gone_on_from(client, box, tmp_path, monkeypatch):
    path = tmp_path / "box.crtfilm"
    first = crt.distributed.render(box, client, spp=64, checkpoint=path, **ONE)
    assert crt.Film.load(str(path)).sample_ranges == [(0, 64)]
    # A film with a gap: only what it lacks is rendered, or the sum would be refused.
    (first.film + crt.render(box, sample_range=(96, 112), backend="embree").film).save(str(path))
    rest = crt.distributed.render(box, client, spp=192, checkpoint=path, **ONE)
    assert same_film(rest.film, crt.render(box, spp=192, backend="embree").film)
    assert rest.report["samples"] == {"per_pixel": 192, "resumed": 80}
    assert same_film(crt.Film.load(str(path)), rest.film)
    nothing = crt.distributed.render(box, client, spp=192, checkpoint=path, **ONE)
    assert nothing.report["distributed"]["parts"] == 0 and same_film(nothing.film, rest.film)


def test_checkpoint_of_another_scene_is_kept(client, box, tmp_path):
    path = tmp_path / "box.crtfilm"
    other = box.copy()
    other["sampler.seed"] = 5
    crt.render(other, spp=16, backend="embree").save(path)
    before = path.read_bytes()
    done = [0]
    # With the first part, and not at a checkpoint: none is due before the end.
    with pytest.raises(crt.Error) as refused:
        crt.distributed.render(box, client, spp=1 << 18, checkpoint=path, checkpoint_every=1e9,
                               on_progress=lambda now: done.append(now["fraction"]), **ONE)
    assert max(done) < 0.5
    assert refused.value.kind == crt.Kind.USAGE and path.read_bytes() == before


def test_checkpoint_comes_meanwhile(threads_client, box, tmp_path):
    path = tmp_path / "box.crtfilm"
    found = []

    def look(now):
        if path.exists():
            found.append(crt.Film.load(str(path)).samples)

    box["film.resolution"] = [48, 48]
    result = crt.distributed.render(box, threads_client, time_limit=4, checkpoint=path, on_progress=look,
                                    checkpoint_every=0.5, **ONE)
    assert found and found[0] < result.film.samples == crt.Film.load(str(path)).samples


def test_target_error(threads_client, box):
    first = -(-1_000_000 // (24 * 16))  # Not looked at before.
    target = 0.6 * crt.render(box, spp=first, backend="embree").error.half_width_95
    result = crt.distributed.render(box, threads_client, target_error=target, **ONE)
    assert result.stop == "target" and result.error.half_width_95 <= target
    assert 2 * first <= result.film.samples < 16 * first
    assert crt.distributed.render(box, threads_client, target_error=0.5, **ONE).film.samples >= first


def test_target_error_is_looked_at_as_by_the_program(box):
    """The even and the odd pixels can each veto what the whole image would stop at."""
    result = crt.render(box, spp=4096, backend="embree", target_error=1e-6)
    error = result.report["error"]
    whole = error["half_width_95"]
    halves = [error["judged"][name]["half_width_95"] for name in ("even_pixels", "odd_pixels")]
    assert max(halves) > whole, "a seed that asks nothing"
    between = 0.5 * (whole + max(halves))
    look = crt.distributed.Look(between, result.film)
    look.next = 1
    assert not look.reached(types.SimpleNamespace(kept=result.film, error=result.error))
    look.target = 1.01 * max(halves)
    look.next = 1
    assert look.reached(types.SimpleNamespace(kept=result.film, error=result.error))


def test_scene_error_is_raised_once_and_here(client):
    text = BOX.replace("radius: 0.5", "radius: -1")
    tasks = len(client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.tasks)))
    with pytest.raises(crt.Error) as here:
        crt.render(crt.scene(text))
    with pytest.raises(crt.Error) as raised:
        crt.distributed.render(crt.scene(text), client)
    assert str(raised.value) == str(here.value) and raised.value.line == here.value.line
    assert len(client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.tasks))) == tasks


def test_worker_without_a_backend_says_why(client, box):
    with pytest.raises(crt.Error) as raised:
        crt.distributed.render(box, client, backend="none")
    assert raised.value.kind == crt.Kind.BACKEND
    assert "backend 'none' is unknown" in str(raised.value) and "worker tcp://" in str(raised.value)


def test_nothing_is_left_on_the_cluster(client, box):
    crt.distributed.render(box, client, spp=64, parts=9, **ONE)
    with pytest.raises(RuntimeError, match="enough"):
        crt.distributed.render(box, client, spp=1 << 20, on_progress=fail, **ONE)
    until = time.monotonic() + 600
    while client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.tasks)):
        assert time.monotonic() < until
        time.sleep(0.1)


def fail(now):
    raise RuntimeError("enough")


def test_a_failing_device_gets_no_more_parts(threads_client, box, monkeypatch):
    """Real tasks on real workers; only the failure is made."""
    tried = []  # The first worker that tries has the broken device.
    real = crt.Session.render

    def render(session, **options):
        address = distributed.get_worker().address
        tried.append(address)
        if address == tried[0]:
            raise crt.RenderFailed("the device is lost", crt.Kind.DEVICE, "", 0, 0, None)
        return real(session, **options)

    monkeypatch.setattr(crt.Session, "render", render)
    result = crt.distributed.render(box, threads_client, spp=96, parts=12, **ONE)
    assert same_film(result.film, crt.render(box, spp=96, backend="embree").film)
    assert tried.count(tried[0]) <= 3 < len(tried) and result.report["distributed"]["parts_redone"] >= 1
    monkeypatch.setattr(crt.Session, "render", lambda session, **options: render_failing())
    with pytest.raises(crt.Error, match="the device is lost") as raised:
        crt.distributed.render(box, threads_client, spp=96, parts=12, **ONE)
    assert raised.value.kind == crt.Kind.DEVICE


def render_failing():
    raise crt.RenderFailed("the device is lost", crt.Kind.DEVICE, "", 0, 0, None)


def test_a_cluster_that_goes_leaves_the_film(box, tmp_path):
    path = tmp_path / "box.crtfilm"
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None,
                                       processes=False)
    with distributed.Client(cluster) as client:
        closing = []

        def close(now):
            if path.exists() and not closing:
                closing.append(threading.Thread(target=cluster.close))
                closing[0].start()

        with pytest.raises(crt.RenderFailed) as raised:
            crt.distributed.render(box, client, spp=1 << 20, parts=512, checkpoint=path,
                                   checkpoint_every=0.3, on_progress=close, **ONE)
        closing[0].join()
    assert raised.value.kind == crt.Kind.DEVICE and "cluster is gone" in str(raised.value)
    assert same_film(raised.value.film, crt.Film.load(str(path)))


def test_interrupt_keeps_what_is_done(tmp_path):
    script = textwrap.dedent("""
        import os, signal, sys
        sys.path.insert(0, sys.argv[1])
        import crt.distributed, distributed
        from conftest import BOX

        if __name__ == "__main__":
            with distributed.Client(processes=False, n_workers=1, threads_per_worker=1,
                                    dashboard_address=None) as client:
                def interrupt(now):
                    if now["parts"] == 5:
                        os.kill(os.getpid(), signal.SIGINT)
                result = crt.distributed.render(crt.scene(BOX), client, spp=1 << 18, parts=128,
                                                backend="embree", on_progress=interrupt,
                                                checkpoint="a.crtfilm")
                print("end", result.stop, result.film.samples, flush=True)
            try:
                os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt:
                print("handler is back")
    """)
    # A test that runs in the background of a shell ignores the signal, and so would the program.
    done = subprocess.run([sys.executable, "-c", script, os.path.dirname(__file__)], text=True, timeout=900,
                          capture_output=True, cwd=tmp_path,
                          preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    words = done.stdout.split()
    assert words[:2] == ["end", "interrupted"] and words[3:] == ["handler", "is", "back"], done.stderr
    assert 0 < int(words[2]) < 1 << 18 and "the film is kept" in done.stderr
    assert crt.Film.load(str(tmp_path / "a.crtfilm")).samples == int(words[2])


def test_no_client():
    done = subprocess.run([sys.executable, "-c", "import crt.distributed as d; d.render('none.yaml')"],
                          text=True, capture_output=True, timeout=900)
    assert done.returncode == 1 and "crt.errors.Error: there is no client of Dask" in done.stderr


def test_without_dask_the_libraries_are_named():
    hide = "import sys; sys.modules['distributed'] = None; import crt.distributed"
    done = subprocess.run([sys.executable, "-c", hide], text=True, capture_output=True, timeout=900)
    assert done.returncode == 1 and "pip install dask distributed" in done.stderr


def test_current_client_is_found(client, box):
    with client.as_current():
        assert crt.distributed.render(box, spp=4, **ONE).film.samples == 4


def test_bad_options(client, box):
    for wrong in ({"spp": 0}, {"parts": 0}, {"target_error": 1.5}, {"time_limit": -1},
                  {"parts": 4, "time_limit": 2}):
        with pytest.raises(crt.Error) as refused:
            crt.distributed.render(box, client, **wrong)
        assert refused.value.kind == crt.Kind.USAGE
