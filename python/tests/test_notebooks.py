"""The notebooks of docs/notebooks: each runs to its end at a small size, and finds what its text says."""

import json
import pathlib
import sys

import pytest

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[2] / "docs/notebooks"
# Conditions on the variables that a notebook leaves, as Python in its own kernel.
CLAIMS = {
    "1_first_picture": ["red_is_left is True", "resumed_is_the_same is True", "read.samples == 4 * SPP",
                        "image.shape == (SIZE, SIZE, 3)", "0.05 < image.mean() < 0.3"],
    # The slope of independent samples is -1/2 but for the noise of 16 seeds; that of Sobol points, of which
    # edges in the picture hold half, lies between -1/2 and -1.
    "2_error_against_time": ["-0.65 < slopes['independent'] < -0.38", "-1.0 < slopes['sobol'] < -0.5",
                             "slopes['sobol'] < slopes['independent'] - 0.05",
                             "all(len(n) >= 6 for n, _, _ in measured.values())"],
    "3_measured_spectrum": ["spectrum_error < 0.02", "rgb_round_trip < 0.02", "spectra_differ_by > 0.08",
                            "worst['D65'] < 0.03", "worst['F11'] > 0.04"],
    "4_scene_of_arrays": ["np.abs(near_left - colours[0, 0]).max() < 0.06",
                          "np.abs(near_right - colours[0, 1]).max() < 0.06", "0.7 < facing_up <= 1",
                          "result.image.shape == (SIZE * 3 // 4, SIZE, 3)"],
    "5_same_bits": ["same_bits is True", "split_is_the_same is True", "seeds_differ is True",
                    "len(backends) >= 1"],
    "6_sweep_on_dask": ["same_bits is True", "peak_falls is True", "len(answers) == len(roughness)"],
}
NEEDS = {"2_error_against_time": ["matplotlib"], "3_measured_spectrum": ["matplotlib"],
         "4_scene_of_arrays": ["matplotlib"], "6_sweep_on_dask": ["matplotlib", "dask", "distributed"]}


def paths():
    return sorted(NOTEBOOKS.glob("*.ipynb"))


@pytest.fixture(scope="session")
def kernel(tmp_path_factory):
    """The name of a kernel that is this interpreter, and nothing of the user's own Jupyter."""
    folder = tmp_path_factory.mktemp("jupyter")
    spec = folder / "kernels/crt-tests/kernel.json"
    spec.parent.mkdir(parents=True)
    command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    spec.write_text(json.dumps({"argv": command, "display_name": "crt", "language": "python"}))
    values = {"JUPYTER_PATH": str(folder), "JUPYTER_CONFIG_DIR": str(folder / "config"),
              "JUPYTER_RUNTIME_DIR": str(folder / "runtime"), "IPYTHONDIR": str(folder / "ipython"),
              "MPLCONFIGDIR": str(folder / "matplotlib"),
              "CRT_NOTEBOOK_SCALE": "0.2"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in values.items():
            patch.setenv(name, value)
        yield spec.parent.name


def test_each_notebook_has_claims():
    assert [path.stem for path in paths()] == sorted(CLAIMS)


@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_a_notebook_is_committed_bare(path):
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert set(notebook.metadata) == {"kernelspec", "language_info"}
    assert notebook.metadata.kernelspec.name == "python3"
    assert notebook.cells[0].cell_type == "markdown" and notebook.cells[0].source.startswith("# ")
    for cell in notebook.cells:
        assert cell.metadata == {}
        assert max(map(len, cell.source.splitlines())) < 120
        if cell.cell_type == "code":
            assert cell.outputs == [] and cell.execution_count is None


@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_a_notebook_finds_what_it_says(path, kernel, tmp_path):
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    for library in ["ipykernel", *NEEDS.get(path.stem, [])]:
        pytest.importorskip(library, reason=f"{library} is not installed")
    notebook = nbformat.read(path, as_version=4)
    for claim in CLAIMS[path.stem]:
        notebook.cells.append(nbformat.v4.new_code_cell(f"assert {claim}"))
    nbclient.NotebookClient(notebook, timeout=900, kernel_name=kernel,
                            resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert list(tmp_path.iterdir()) == []
