"""`python -m crt`: the program, with the commands that are written in Python."""

import subprocess
import sys
import time

import pytest

from crt import program as the_program


def run(*arguments):
    return subprocess.run([sys.executable, "-m", "crt", *arguments], capture_output=True, text=True,
                          timeout=900)


def test_what_is_not_written_in_python_is_the_program(program):
    done = run("--version")
    assert (done.returncode, done.stdout) == (0, program("--version"))
    done = run("nosuch.yaml")
    assert done.returncode == 3 and "nosuch.yaml" in done.stderr


def test_without_its_program_it_says_so(monkeypatch):
    monkeypatch.setenv("CRT_PROGRAM", "/nowhere/crt")
    done = run("a.yaml")
    assert done.returncode == 2 and "/nowhere/crt" in done.stderr


PBRT = """LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Material "hair"
Shape "sphere" "float radius" 1
"""


@pytest.fixture
def foreign(tmp_path, monkeypatch):
    """A folder with a scene of pbrt, as the working directory; imports go to `temporary` in it."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ball.pbrt").write_text(PBRT)
    return tmp_path


def wait_until_empty(folder):
    for _ in range(100):
        if not list(folder.iterdir()):
            return
        time.sleep(0.1)
    raise AssertionError(f"{list(folder.iterdir())} is still there")


def test_a_scene_of_another_renderer_renders_at_once(foreign, backend):
    done = run("ball.pbrt", "-b", backend, "--spp", "2", "--set", "film.resolution=[4, 6]")
    assert done.returncode == 0, done.stderr
    assert "material 'hair': diffuse" in done.stderr
    # In the user's folder, under the scene's own name.
    assert {path.name for path in foreign.iterdir()} == {
        "ball.pbrt", "temporary", "ball.exr", "ball.png", "ball.report.json"}
    wait_until_empty(foreign / "temporary")


def test_other_commands_take_scenes_of_other_renderers(foreign):
    done = run("info", "ball.pbrt")
    assert done.returncode == 0 and "8 x 8 pixels" in done.stdout, done.stderr
    wait_until_empty(foreign / "temporary")


def test_errors_of_a_scene_of_another_renderer_are_its_own(foreign):
    (foreign / "broken.pbrt").write_text(PBRT.replace('"float radius" 1', '"float radius"'))
    done = run("broken.pbrt")
    assert done.returncode == 3 and "broken.pbrt" in done.stderr
    # The program's code is the one that counts.
    assert run("ball.pbrt", "--set", "film.resolution=[0, 0]").returncode == 3
    assert run("nosuch.pbrt").returncode == 3
    wait_until_empty(foreign / "temporary")


def test_the_program_hands_scenes_of_other_renderers_over(foreign, monkeypatch):
    """`crt ball.pbrt` by the program, with this Python."""
    monkeypatch.setenv("CRT_PYTHON", sys.executable)
    done = subprocess.run([the_program.path(), "info", "ball.pbrt"], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 0 and "8 x 8 pixels" in done.stdout, done.stderr
    wait_until_empty(foreign / "temporary")
