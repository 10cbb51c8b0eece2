"""Pages of `python -m crt report`: the page shows the data in the JSON of a run, it has no external
resources, and for a folder without a run no page is begun."""

import functools
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree

import pytest

import crt

pytest.importorskip("jinja2", reason="the pages of reports need jinja2 (pip install jinja2)")
pytest.importorskip("matplotlib", reason="the pages of reports need matplotlib (pip install matplotlib)")

from page import Page  # noqa: E402

from crt.report import command  # noqa: E402

FOLDER = pathlib.Path(command.__file__).parent
BACKEND = next((plugin.name for plugin in crt.plugins()
                if plugin.name in ("embree", "opencl", "cuda") and not plugin.reason), None)
SCENE = """
crt: 1
film: {resolution: [16, 16]}
camera: {position: [0, 1, 3], target: [0, 0.4, 0], fov: 50}
materials: {grey: {type: diffuse, reflectance: 0.5}}
objects:
  - {name: ball, material: grey, sphere: {radius: 0.5}, transform: [{translate: [0, 0.5, 0]}]}
  - name: lamp
    material: grey
    mesh: {positions: [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]}
    emission: {radiance: 4}
"""
needs_backend = pytest.mark.skipif(BACKEND is None, reason="no backend can run here")


def run_program(*arguments, python="", codes=(0,)):
    done = subprocess.run([os.environ["CRT_PROGRAM"], *map(str, arguments)], capture_output=True, text=True,
                          timeout=900, env=os.environ | {"CRT_PYTHON": python})
    assert done.returncode in codes, done.stderr
    return done


@pytest.fixture(scope="module")
def converged(tmp_path_factory):
    """The folder of a small run: two samplers, a backend that is not there, maps."""
    folder = tmp_path_factory.mktemp("converge")
    (folder / "scene.yaml").write_text(SCENE)
    run_program("converge", folder / "scene.yaml", "--backends", f"{BACKEND},nosuch", "--vary",
                "sampler=sobol,independent", "--time", "4s", "--max-spp", "16", "--replicates", "4",
                "-o", folder / "out", codes=(0, 7))
    return folder / "out"


@pytest.fixture(scope="module")
def verified(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verify") / "out"
    run_program("verify", "-b", BACKEND, "--case", "furnace,A03,B01", "-o", folder, "-q")
    return folder


@pytest.fixture
def edited(tmp_path):
    """Copies the folder of a run and lets a function change its JSON."""

    def copy(folder, change):
        copied = tmp_path / "run"
        shutil.copytree(folder, copied, ignore=shutil.ignore_patterns("replicates"))
        path = next(copied / name for name in ("summary.json", "verify.json") if (copied / name).exists())
        data = json.loads(path.read_text(encoding="utf-8"))
        change(data)
        path.write_text(json.dumps(data), encoding="utf-8")
        return copied

    return copy


def page_of(folder, *more):
    assert command.main([str(folder), *more]) == 0
    return Page(next(folder / name for name in ("report.html", "verify.html") if (folder / name).exists()))


page_as_measured = functools.cache(page_of)  # Of a folder that no test has edited.


def without_points(data):
    """No figure is left to draw."""
    data["scenes"][0]["maps"] = {"left_out": "no codec", "configurations": [], "scales": []}
    data["scenes"][0]["findings"] = []
    data["references"] = []
    for fit in data["fits"]:
        fit.update(points=[], relative_mean_bias_rgb=None)
        for name in ("time", "error", "slope_against_samples", "efficiency_per_second", "targets"):
            fit.pop(name, None)


def fit_of(data, variant):
    return next(fit for fit in data["fits"] if fit["variant"] == variant and not fit["omitted"])


# -------------------------------------------------------------------------------------------------- converge


@needs_backend
def test_every_configuration_has_its_verdict_and_why(converged):
    page = page_as_measured(converged)
    data = json.loads((converged / "summary.json").read_text())
    for fit in data["fits"]:
        label = f"{fit['backend']}, {fit['variant']}"
        if fit["omitted"]:
            assert "nosuch" in page.row(label, "not measured")["not measured"]
            continue
        verdict = page.row(label, "verdict")["verdict"]
        assert verdict == f"{fit['verdict']} {fit['verdict_reason']}".strip() or \
            verdict == f"{fit['verdict']}{fit['verdict_reason']}"
    assert {fit["backend"] for fit in data["fits"]} == {BACKEND, "nosuch"}


@needs_backend
def test_figures_of_a_configuration_stand_in_its_row(converged, edited):
    def change(data):
        # Every field of a fit: on a busy machine the run has too few points to fit one.
        fit = fit_of(data, "sampler=sobol")
        fit["common_error"] = {"relative_rmse": 0.02, "reached": True, "at_first_point": False}
        fit["slope_against_samples"] = {"value": -0.806, "low": -0.848, "high": -0.764}
        fit["efficiency_per_second"] = {"value": 19.34, "low": 13.7, "high": 27.2}
        fit["time"] = {"before_first_sample_seconds": 0.02, "launch_seconds": {"value": 0.0033, "low": 0,
                       "high": 1}, "seconds_per_sample": {"value": 0.0107, "low": 0, "high": 1}, "r2": 1}
        fit["error"] = {"floor": {"value": 1e-4, "low": 0.25e-4, "high": 4e-4}, "flattening": True}
        fit["targets"] = [
            {"relative_rmse": 0.01, "reached": True, "at_first_point": True,
             "samples_per_pixel": {"value": 12, "low": 1, "high": 20},
             "seconds": {"value": 2.408, "low": 2.35, "high": 2.47}},
            {"relative_rmse": 0.001, "reached": False, "at_first_point": False, "samples_per_pixel": None,
             "seconds": None}]
        last = fit["points"][-1]
        last["relative_rmse"] = {"value": 0.151, "low": 0.139, "high": 0.165}
        last["flip_mean"] = 0.0624

    page = page_of(edited(converged, change))
    row = page.row(f"{BACKEND}, sampler=sobol", "slope")
    assert row["slope"] == "−0.806−0.848 to −0.764"
    assert row["efficiency, 1/s"] == "19.313.7–27.2"
    assert row["time t₀ + c·N"] == "23.3 ms+ 10.7 ms · N"
    assert row["error floor"] == "1.00 %0.500 % – 2.00 %"
    assert row["time to 1 %"] == "≤ 2.41 s2.35–2.47 s 12.0 spp"
    assert row["time to 0.1 %"] == "not reached"
    last = page.row(f"{BACKEND}, sampler=sobol", "relative RMSE")
    assert last["relative RMSE"] == "15.1 %13.9–16.5 %"
    assert last["FLIP"] == "0.0624"


@needs_backend
def test_findings_notes_and_how_it_was_measured_are_told(converged):
    page = page_as_measured(converged)
    data = json.loads((converged / "summary.json").read_text())
    environment = data["environment"]
    sentences = [finding["text"] for scene in data["scenes"] for finding in scene["findings"]]
    told = [environment[name] for name in ("cpu", "compiler", "operating_system", "working_directory",
                                           "started", "finished")]
    hashes = [c["scene_hash"] for c in data["configurations"] if not c["omitted"]]
    why = [f["why"] for c in data["configurations"] if not c["omitted"] for f in c["left_out"]]
    assert len(sentences) > 3 and data["notes"] and why
    for sentence in sentences + data["notes"] + told + environment["commands"] + hashes + why:
        assert " ".join(sentence.split()) in page.text
    # The first thing to read is the first finding; picture and plot come next.
    assert page.text.index(sentences[0]) < page.text.index("Error against time,") < \
        page.text.index(sentences[1])


@needs_backend
def test_maps_are_of_the_same_samples_and_have_names(converged):
    page = page_as_measured(converged)
    data = json.loads((converged / "summary.json").read_text())
    maps = data["scenes"][0]["maps"]
    samples = {of["samples_per_pixel"] for of in maps["configurations"]}
    assert len(maps["configurations"]) == 2 and len(samples) == 1
    assert f"All after {samples.pop()} samples per pixel" in page.text
    pictures = [(p["title"], of["variant"]) for of in maps["configurations"] for p in of["pictures"]]
    for title, variant in pictures:
        assert f"{title} of {BACKEND}, {variant}" in page.alts
    assert len(page.alts) == len(pictures) + 1 and all(page.alts)
    for scale in maps["scales"]:
        assert scale["title"] in page.text and scale["low"] in page.text


@needs_backend
@pytest.mark.parametrize("run", ["converged", "verified"])
def test_a_page_asks_for_nothing_and_its_names_are_its_own(run, request):
    page = page_as_measured(request.getfixturevalue(run))
    assert page.links
    for link in page.links:
        assert link.startswith("data:image/png;base64,") or link.strip("'\"")[1:] in page.ids, link[:60]
    assert len(page.ids) == len(set(page.ids))
    assert not {"script", "link", "iframe", "object"} & set(page.tags)
    without_data = re.sub(r"base64,[^\"]*", "", page.source)
    assert not re.search(r"https?:|@import|//", without_data)
    # Colours are the page's, so that they follow light and dark.
    assert "#a000" not in without_data and "prefers-color-scheme:dark" in without_data
    assert "var(--c0)" in without_data and not re.search(r"\bnan\b|\binf\b", page.text)


@needs_backend
def test_void_rows_and_failures_are_named(converged, edited):
    def change(data):
        fit = fit_of(data, "sampler=independent")
        fit.update(verdict="FAIL", verdict_reason="3 rows are void", points=[], void_rows=3)
        for name in ("time", "error", "slope_against_samples", "efficiency_per_second", "targets"):
            fit.pop(name, None)
        data["scenes"][0]["void_rows"] = [{"backend": BACKEND, "variant": "sampler=independent",
                                           "replicate": 3, "samples_per_pixel": 65536, "invalid_samples": 7}]

    page = page_of(edited(converged, change))
    label = f"{BACKEND}, sampler=independent"
    assert page.row(label, "verdict")["verdict"].startswith("FAIL")
    assert page.row(label, "slope")["slope"] == "–"
    assert page.row(label, "invalid samples") == {"head": label, "replicate": "3", "invalid samples": "7",
                                                  "samples per pixel": "65\u202f536".replace("\u202f", " ")}
    assert "1 FAIL" in page.text


@needs_backend
def test_a_run_without_points_and_without_maps_has_a_page(converged, edited):
    page = page_of(edited(converged, without_points))
    assert "Left out: no codec" in page.text and "Reference: none." in page.text


@needs_backend
def test_scenes_whose_names_differ_in_signs_only_are_kept_apart(converged, edited):
    def change(data):
        for name in ("scenes", "configurations", "fits"):
            again = [one | {"scene": one["scene"] + "!"} for one in data[name]]
            data[name] += again

    page = page_of(edited(converged, change))
    assert len(page.ids) == len(set(page.ids))
    assert page.text.count("Error against time, scene!.") == 1


@needs_backend
@pytest.mark.parametrize("run", ["converged", "verified"])
def test_markup_in_what_a_run_says_is_text(run, request, edited):
    attack = "<script>alert(1)</script>&\"'"

    def poison(value):
        if isinstance(value, dict):
            return {key: poison(v) if key not in KEPT else v for key, v in value.items()}
        if isinstance(value, list):
            return [poison(v) for v in value]
        return value + attack if isinstance(value, str) else value

    page = page_of(edited(request.getfixturevalue(run), lambda data: data.update(poison(data))))
    assert "script" not in page.tags and attack in page.text
    assert "<script" not in page.source


# The parts that a valid page of a run must have.
KEPT = {"format", "verdict", "file", "id", "tone", "kind", "colours"}


# ---------------------------------------------------------------------------------------------------- verify


@needs_backend
def test_expected_measured_and_tolerance_are_in_sight(verified):
    page = page_as_measured(verified)
    data = json.loads((verified / "verify.json").read_text())
    seen = " ".join("".join(page.visible).split())
    outcomes = [outcome for case in data["cases"] for outcome in case["outcomes"]]
    for outcome in outcomes:
        row = next(row for row in page.rows if " ".join(row.get("quantity", "").split()) == outcome["what"]
                   and row.get("verdict", "").strip() == outcome["verdict"])
        assert row["tolerance"].strip() == outcome["tolerance"]
        if outcome["expected"] is not None:
            number = row["expected"].replace("−", "-")
            assert float(number) == pytest.approx(outcome["expected"], rel=1e-8)
        if outcome["measured"] is not None:
            number = row["measured"].replace("−", "-").split("[")[0]
            width = (outcome["interval"][1] - outcome["interval"][0]) if "interval" in outcome else 0
            rounding = 0.026 * width + 1e-8 * abs(outcome["measured"])
            assert abs(float(number) - outcome["measured"]) <= rounding
    for case in data["cases"]:
        for name in ("title", "expected", "source", "tolerance"):
            assert " ".join(case[name].split()) in seen
    assert any("interval" in outcome for outcome in outcomes)
    assert f"{len(data['cases'])} pass" in seen


@needs_backend
def test_what_failed_comes_first(verified, edited):
    def change(data):
        last = data["cases"][-1]
        last["verdict"] = last["outcomes"][-1]["verdict"] = "FAIL"
        last["outcomes"][-1]["physics"] = "one of the two cosines is missing"
        last["outcomes"].insert(0, last["outcomes"][0] | {"what": "first", "verdict": "pass"})
        data["passed"] = False

    page = page_of(edited(verified, change))
    data = json.loads((verified / "verify.json").read_text())
    cases = [name for name in page.ids if re.fullmatch(r"[A-Z]\d\d", name)]
    assert cases == [data["cases"][-1]["id"], *(case["id"] for case in data["cases"][:-1])]
    assert page.text.startswith("crt verify: FAILED")
    assert page.text.index("one of the two cosines is missing") < page.text.index("Deviations from the "
                                                                                  "expected results")
    rows = [row for row in page.rows if "quantity" in row]
    assert rows[0]["verdict"].strip() == "FAIL" and rows[1]["quantity"].strip() == "first"
    assert "1 FAIL" in page.text


# --------------------------------------------------------------------------------------------------- refused


def refused(capsys, folder, *arguments):
    before = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else None
    assert command.main([str(folder), *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("crt: error: ") and said.err.count("\n") == 1
    assert before == (sorted(path.name for path in folder.iterdir()) if folder.is_dir() else None)
    return said.err


def test_a_folder_that_is_no_run_is_refused(tmp_path, capsys):
    assert "is not a folder" in refused(capsys, tmp_path / "absent")
    assert "holds no run" in refused(capsys, tmp_path)
    for damaged, why in (("{", ":1:2: this is not JSON"), ("[]", "has the format null"),
                         ('{"format": "crt converge summary 2"}', "summary 2"),
                         ("\udcff", "is not JSON"), ("[" * 100000, "is not JSON"),
                         ('{"format": "crt converge summary 1"}', "'options'")):
        (tmp_path / "summary.json").write_text(damaged, errors="surrogateescape")
        assert why in refused(capsys, tmp_path)


@needs_backend
@pytest.mark.parametrize("run", ["converged", "verified"])
def test_json_that_lost_a_part_is_refused_and_no_page_is_begun(run, request, edited, capsys):
    change = without_points if run == "converged" else dict.copy
    folder = edited(request.getfixturevalue(run), change)
    (folder / "report.html").write_text("as it was")
    (folder / "verify.html").write_text("as it was")
    path = next(folder / name for name in ("summary.json", "verify.json") if (folder / name).exists())
    whole = json.loads(path.read_text())
    for name in whole:
        path.write_text(json.dumps({key: value for key, value in whole.items() if key != name}))
        refused(capsys, folder)
        if isinstance(whole[name], (list, dict)):
            path.write_text(json.dumps(whole | {name: 7}))
            refused(capsys, folder)
    assert (folder / "report.html").read_text() == (folder / "verify.html").read_text() == "as it was"


@needs_backend
def test_pictures_must_be_pictures_of_the_folder(converged, edited, capsys):
    folder = edited(converged, lambda data: None)
    path = folder / "summary.json"
    data = json.loads(path.read_text())
    picture = data["scenes"][0]["maps"]["configurations"][0]["pictures"][0]
    name = picture["file"]
    for file, why in (("../secret.png", "outside its folder"), ("absent.png", "cannot read"),
                      ("results.csv", "not a PNG")):
        picture["file"] = file
        path.write_text(json.dumps(data))
        assert why in refused(capsys, folder)
    picture["file"] = name
    path.write_text(json.dumps(data))
    assert command.main([str(folder)]) == 0


@needs_backend
def test_the_page_goes_where_it_is_asked_to(verified, tmp_path, capsys):
    assert command.main([str(verified), "-o", str(tmp_path / "new/page.html")]) == 0
    assert Page(tmp_path / "new/page.html").text.startswith("crt verify: passed")
    assert os.listdir(tmp_path / "new") == ["page.html"]
    capsys.readouterr()
    before = (verified / "verify.json").read_text()
    assert "choose another file" in refused(capsys, verified, "-o", str(verified / "verify.json"))
    assert (verified / "verify.json").read_text() == before
    (tmp_path / "file").write_text("")
    assert command.main([str(verified), "-o", str(tmp_path / "file/page.html")]) == 6
    assert "cannot write" in capsys.readouterr().err


@needs_backend
def test_figures_are_files_of_their_own(converged, tmp_path):
    assert command.main([str(converged), "--figures", str(tmp_path / "figures")]) == 0
    names = sorted(os.listdir(tmp_path / "figures"))
    assert "scene-work-precision.svg" in names and len(names) >= 6
    for name in names:
        source = (tmp_path / "figures" / name).read_text()
        assert xml.etree.ElementTree.fromstring(source).tag.endswith("svg")
        assert "var(" not in source and "#a000" not in source


# ------------------------------------------------------------------------------ from the program, and alone


@needs_backend
def test_the_program_makes_the_page_at_the_end(tmp_path):
    done = run_program("verify", "-b", BACKEND, "--case", "furnace", "-o", tmp_path, python=sys.executable)
    assert f"{tmp_path}/verify.html" in done.stdout
    assert Page(tmp_path / "verify.html").text.startswith("crt verify: passed")


@needs_backend
def test_where_python_cannot_the_program_says_the_command(tmp_path):
    liar = tmp_path / "liar"
    liar.write_text("#!/bin/sh\necho 'crt: error: no library here' >&2\nexit 2\n")
    liar.chmod(0o755)
    for python, why in (("", "because CRT_PYTHON is empty"), ("/nowhere/python", "cannot start "
                                                                                 "'/nowhere/python'"),
                        (str(liar), "no page was made: no library here"),
                        ("/bin/false", "ended with code 1")):
        folder = tmp_path / "a folder"
        done = run_program("verify", "-b", BACKEND, "--case", "furnace", "-o", folder, python=python)
        assert why in done.stdout and not (folder / "verify.html").exists()
        assert (folder / "verify.json").exists()
        typed = re.search(r"this command makes it: (.*)$", done.stdout, re.MULTILINE)[1]
        assert typed.endswith(f"share/crt/report '{folder}'")
    # The command that it prints works.
    said = typed.replace("/bin/false", sys.executable)
    subprocess.run(["sh", "-c", said], check=True, capture_output=True)
    assert (folder / "verify.html").exists()


@needs_backend
def test_pages_need_neither_the_package_nor_its_module(verified, tmp_path):
    script = ("import runpy, sys\nsys.argv = sys.argv[1:]\ntry:\n    runpy.run_path(sys.argv[0], "
              "run_name='__main__')\nexcept SystemExit as end:\n    assert not end.code\n"
              "assert not [name for name in sys.modules if name.split('.')[0] in ('crt', '_crt')]\n")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run([sys.executable, "-B", "-c", script, str(FOLDER), str(verified), "-o",
                    str(tmp_path / "page.html")], check=True, env=environment, cwd=tmp_path)
    assert (tmp_path / "page.html").exists()


@needs_backend
def test_without_its_libraries_it_names_them(verified, tmp_path):
    done = subprocess.run([sys.executable, "-B", "-S", str(FOLDER), str(verified), "-o",
                           str(tmp_path / "page.html")], capture_output=True, text=True,
                          env={"PATH": os.environ["PATH"]})
    assert done.returncode == 2 and "pip install jinja2 matplotlib" in done.stderr
    assert not list(tmp_path.iterdir())
