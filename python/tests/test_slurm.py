"""`crt slurm`: the scripts, and a real Slurm that runs them."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import pytest

import crt
import slurm_cluster
from conftest import BOX
from crt import slurm
from test_render import same

MISSING = slurm_cluster.missing()
needs_slurm = pytest.mark.skipif(bool(MISSING), reason=f"Slurm is not installed: no {', '.join(MISSING)}")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder whose name has what shells, sbatch and sed take for something else, with a scene in it."""
    place = tmp_path / "it's a $HOME %a & 'more'"
    place.mkdir()
    (place / "my box.yaml").write_text(BOX)
    monkeypatch.chdir(place)
    return place


def command(*arguments, **more):
    return subprocess.run([sys.executable, "-m", "crt", "slurm", *map(str, arguments)], text=True,
                          capture_output=True, timeout=900, **more)


def part_script(folder, part, **environment):
    return subprocess.Popen(["bash", folder / "my box.slurm/render.sbatch"], text=True, cwd="/",
                            env={**os.environ, "SLURM_ARRAY_TASK_ID": str(part), **environment},
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def test_parts_cover_all_samples():
    for samples, parts in ((4096, 8), (100, 3), (7, 4), (1, 5), (1000, 1000)):
        ranges = slurm.parts_of(samples, parts)
        assert ranges[0][0] == 0 and ranges[-1][1] == samples and len(ranges) <= parts
        assert all(a[1] == b[0] for a, b in zip(ranges, ranges[1:])) and all(a < b for a, b in ranges)


def test_scripts_say_what_was_asked(folder):
    done = command("my box.yaml", "--spp", 64, "--nodes", 2, "--parts", 4, "--partition", "gpu", "--time",
                   "1:00:00", "--sbatch-option", "gres=gpu:1", "--sbatch-option=--comment=two words",
                   "--merge-option", "mem=1G", "-b", "embree", "--set", "film.resolution=[8, 8]")
    assert done.returncode == 0, done.stderr
    text = (folder / "my box.slurm/submit.sh").read_text()
    assert "%2" in text and "--partition gpu" in text and "--time 1:00:00" in text
    assert "--gres=gpu:1 '--comment=two words'" in text and "--mem=1G" in text
    render = (folder / "my box.slurm/render.sbatch").read_text()
    assert "(0:16 16:32 32:48 48:64)" in render and "-b embree --set 'film.resolution=[8, 8]'" in render
    assert str(pathlib.Path(os.environ["CRT_PROGRAM"]).resolve()) in render
    for script in ("submit.sh", "render.sbatch", "merge.sbatch"):
        assert subprocess.run(["bash", "-n", folder / "my box.slurm" / script]).returncode == 0


def test_a_part_that_is_stopped_goes_on(folder):
    """Without Slurm: the script is run as a node would."""
    assert command("my box.yaml", "--spp", 200000, "--nodes", 2, "-b", "embree", "-t", 1).returncode == 0
    parts = folder / "my box.slurm/parts"
    running = part_script(folder, 1)
    time.sleep(1.5)
    running.send_signal(signal.SIGTERM)
    said = running.communicate(timeout=900)[0]
    assert running.returncode == 143, said
    before = crt.Film.load(str(parts / "1.crtfilm")).sample_ranges
    assert before[0][0] == 100000 and before[0][1] < 200000 and len(before) == 1
    # The time of a job ends: the part asks Slurm to put it back into the queue.
    tools = folder / "tools"
    tools.mkdir()
    (tools / "scontrol").write_text('#!/bin/bash\necho "$@" >"$(dirname "$0")/called"\n')
    (tools / "scontrol").chmod(0o755)
    running = part_script(folder, 1, PATH=f"{tools}:{os.environ['PATH']}", SLURM_JOB_ID="77")
    time.sleep(1.5)
    running.send_signal(signal.SIGUSR1)
    said = running.communicate(timeout=900)[0]
    assert running.returncode == 143, said
    assert (tools / "called").read_text() == "requeue 77\n"
    after = crt.Film.load(str(parts / "1.crtfilm")).sample_ranges
    assert len(after) == 1 and before[0][1] < after[0][1]


def test_a_part_does_the_samples_that_are_missing_and_ends(folder):
    assert command("my box.yaml", "--spp", 200, "--nodes", 2, "-b", "embree").returncode == 0
    parts = folder / "my box.slurm/parts"
    parts.mkdir(exist_ok=True)
    crt.render("my box.yaml", sample_range=(100, 190), backend="embree").save(parts / "1.crtfilm")
    running = part_script(folder, 1)
    said = running.communicate(timeout=900)[0]
    assert running.returncode == 0, said
    assert crt.Film.load(str(parts / "1.whole.crtfilm")).sample_ranges == [(100, 200)]
    assert not (parts / "1.crtfilm").exists()
    running = part_script(folder, 1)
    assert "part 1 is done" in running.communicate(timeout=900)[0] and running.returncode == 0


def test_merge_says_what_is_missing(folder):
    assert command("my box.yaml", "--spp", 64, "--nodes", 4, "-b", "embree").returncode == 0
    for part in (0, 2):
        assert part_script(folder, part).wait(60) == 0
    merge = subprocess.run(["bash", folder / "my box.slurm/merge.sbatch"], text=True, capture_output=True)
    assert merge.returncode == 5 and "not done: 1 3 of 4 parts" in merge.stderr
    assert not (folder / "my box.exr").exists()
    assert [part_script(folder, part).wait(60) for part in (1, 3)] == [0, 0]
    assert subprocess.run(["bash", folder / "my box.slurm/merge.sbatch"]).returncode == 0
    whole = crt.render("my box.yaml", spp=64, backend="embree")
    assert same(crt.Image.load("my box.exr").pixels[..., :3].copy(), whole.image.copy())


@pytest.mark.parametrize("arguments, code, words", [
    (["none.yaml", "--nodes", 2], 3, "none.yaml"),
    (["bad.yaml", "--nodes", 2], 3, "bad.yaml:3:"),
    (["my box.yaml"], 2, "--nodes"),
    (["my box.yaml", "--nodes", 0], 2, "1 or more"),
    (["my box.yaml", "--nodes", 2, "-o", "a.gif"], 2, "not '"),
    (["my box.yaml", "--nodes", 2, "-o", "no/a.exr"], 6, "there is no folder"),
    (["my box.yaml", "--nodes", 2, "--set", "film.resolutio=[2,2]"], 3, "did you mean 'resolution'"),
    (["my box.yaml", "--nodes", 2, "--checkpoint-every", "never"], 2, "--checkpoint-every takes a duration"),
    (["my box.yaml", "--nodes", 2, "-t", "all"], 2, "--threads takes a whole number"),
    (["my box.yaml", "--nodes", 2, "--seed", "x"], 2, "--seed"),
    (["my box.yaml", "--nodes", 2, "--crop", "0,0,1"], 2, "--crop"),
    (["my box.yaml", "--nodes", 2, "--spp", 10**20], 2, "--samples"),
    (["my box.yaml", "--nodes", 2, "-b", "embre"], 4, "'embre' is unknown"),
    (["my box.yaml", "--nodes", 2, "-b", "./none.so"], 2, "no backend file './none.so'"),
])
def test_bad_requests(folder, arguments, code, words):
    (folder / "bad.yaml").write_text("crt: 1\nfilm:\n  resolution: [a, b]\n")
    done = command(*arguments)
    assert done.returncode == code and words in done.stderr, (done.returncode, done.stderr)
    assert not list(folder.glob("*.slurm"))


def test_a_scene_whose_name_is_no_utf_8(folder):
    name = os.fsdecode(b"caf\xe9.yaml")
    shutil.copy("my box.yaml", name)
    done = subprocess.run([sys.executable, "-m", "crt", "slurm", name, "--spp", "4", "--nodes", "2"],
                          capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr
    (script,) = folder.glob("caf*.slurm/render.sbatch")
    assert b"caf\xe9.yaml" in script.read_bytes()


def test_folder_of_another_render_is_refused(folder):
    assert command("my box.yaml", "--spp", 64, "--nodes", 2, "-b", "embree").returncode == 0
    assert command("my box.yaml", "--spp", 64, "--nodes", 4, "-b", "embree").returncode == 0
    assert part_script(folder, 0).wait(60) == 0
    assert command("my box.yaml", "--spp", 64, "--nodes", 4, "-b", "embree").returncode == 0
    done = command("my box.yaml", "--spp", 128, "--nodes", 4)
    assert done.returncode == 2 and "parts of another render" in done.stderr
    assert json.loads((folder / "my box.slurm/render.json").read_text())["samples"] == 64


@needs_slurm
def test_real_slurm(folder):
    """Eight parts at once, one of them killed and one requeued: the merge has the bits of one render."""
    samples, parts = 16384, folder / "my box.slurm/parts"
    more = ["--set", "film.resolution=[32,32]", "-o", "my image.exr", "-o", "all.crtfilm"]
    with slurm_cluster.Slurm() as cluster:
        done = command("my box.yaml", "--spp", samples, "--nodes", 8, "-b", "embree", "-t", 1,
                       "--checkpoint-every", "1s", "--submit", *more, env=cluster.environment)
        assert done.returncode == 0, done.stderr
        array, merge = (folder / "my box.slurm/jobs").read_text().strip().split(",")
        again = subprocess.run([folder / "my box.slurm/submit.sh"], env=cluster.environment, text=True,
                               capture_output=True)
        assert again.returncode == 2 and "still exist" in again.stderr

        cluster.wait(lambda: (parts / "3.crtfilm").exists(), 900, "film of part 3")
        kill_program(parts / "3.crtfilm")
        cluster.wait(lambda: (parts / "5.crtfilm").exists(), 900, "film of part 5")
        cluster.run("scontrol", "requeue", f"{array}_5")
        cluster.wait(lambda: ended(cluster, merge), 900, "end of the merging job")
        states = cluster.states(array)
        assert states[f"{array}_3"] == "FAILED", states
        assert cluster.states(merge) == {merge: "FAILED"}
        assert "not done: 3 of 8 parts" in (folder / "my box.slurm/logs/merge.log").read_text()
        assert not (folder / "my image.exr").exists()
        assert "resuming" in (folder / "my box.slurm/logs/5.log").read_text()

        # The missing parts, each from its last sample, and the merge.
        kept = crt.Film.load(str(parts / "3.crtfilm")).samples
        again = subprocess.run([folder / "my box.slurm/submit.sh"], env=cluster.environment, text=True,
                               capture_output=True)
        assert again.returncode == 0 and "1 of 8 parts" in again.stdout, again.stderr
        array, merge = (folder / "my box.slurm/jobs").read_text().strip().split(",")
        cluster.wait(lambda: ended(cluster, merge), 900, "end of the merging job")
        assert cluster.states(merge) == {merge: "COMPLETED"}, cluster.logs()
        log = (folder / "my box.slurm/logs/3.log").read_text()
        assert f"after {kept} samples per pixel" in log and kept > 0
    film = crt.Film.load("all.crtfilm")
    whole = crt.render(crt.load("my box.yaml", set={"film.resolution": [32, 32]}), spp=samples,
                       backend="embree")
    assert film.sample_ranges == [(0, samples)] and same(film.xyz, whole.film.xyz)
    assert same(crt.Image.load("my image.exr").pixels[..., :3].copy(), whole.image.copy())


def ended(cluster, job):
    return set(cluster.states(job).values()) <= {"COMPLETED", "FAILED", "CANCELLED", "TIMEOUT"}


def kill_program(film):
    """The crt that writes this film, and no other."""
    pids = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        if str(film) in words and "render" in words:
            pids.append(int(process.name))
    assert len(pids) == 1, pids
    os.kill(pids[0], signal.SIGKILL)


@needs_slurm
def test_daemons_leave_nothing():
    with slurm_cluster.Slurm() as cluster:
        folder, pids = cluster.folder, [process.pid for _, process in cluster.processes]
        assert len(pids) == 3 and shutil.which("sbatch", path=slurm_cluster.PATH)
    assert not folder.exists() and not any(pathlib.Path(f"/proc/{pid}").exists() for pid in pids)
