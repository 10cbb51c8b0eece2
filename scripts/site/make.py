#!/usr/bin/env python3
"""Builds the documentation site from this tree. scripts/docs calls it.

    scripts/site/make.py BUILD_DIR WORK_DIR SITE_DIR

BUILD_DIR has crt and its Python module, WORK_DIR gets what the site is made from, SITE_DIR the site.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
import check_site  # noqa: E402
import gallery  # noqa: E402
import stage  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
ROOT = stage.ROOT
TITLE = re.compile(r"^# (.*)$", re.MULTILINE)
STATUS = re.compile(r"^Status: (.*)\.$", re.MULTILINE)


def say(text):
    print(f"== {text}", flush=True)


def title(text):
    return TITLE.search(text)[1].strip()


def package(build, work):
    """The package crt in a separate folder: this tree's files in Python, and the module that was built."""
    folder = work / "python/crt"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "python/crt", folder, ignore=shutil.ignore_patterns("__pycache__"))
    for module in (build / "python/crt").glob("_crt*"):
        (folder / module.name).symlink_to(module.resolve())
    libraries = work / "lib"  # The module looks for libcrt two folders above itself.
    libraries.unlink(missing_ok=True)
    libraries.symlink_to((build / "lib").resolve())
    if not any(folder.glob("_crt*.so")):
        sys.exit(f"== error: there is no Python module in {build}/python/crt; scripts/build makes it")
    return folder.parent


def decision_index(decisions):
    """The page that lists them, with the status that each must have."""
    lines = ["# Decisions", "", "The reasons for the design of crt.", "", "| | decision | status |",
             "|---|---|---|"]
    for file in decisions:
        text = file.read_text("utf-8")
        status = STATUS.search(text)
        if not status:
            sys.exit(f"== error: {file.name} has no line 'Status: …'")
        lines.append(f"| [{file.stem[:4]}]({file.name}) | {title(text).partition(': ')[2]} | {status[1]} |")
    return "\n".join(lines) + "\n"


def add_documents(site, program):
    """README.md, docs/ and what else is prose. The manual is what the program says today."""
    manual = subprocess.run([program, "schema", "--markdown"], stdout=subprocess.PIPE, text=True,
                            check=True).stdout
    for source in site.tree.pages():
        name = source.relative_to(ROOT).as_posix()
        if source.suffix == ".md" and (name in stage.PAGES or name.startswith("docs/")):
            site.add(source, manual if name == "docs/scene.md" else None)
    front = site.docs / "index.md"
    front.write_text("---\nhide: [navigation]\n---\n\n" + front.read_text("utf-8"), "utf-8")
    for file in sorted(site.tree.files):
        if file.is_relative_to(ROOT / "docs") and file.suffix in stage.ASSETS:
            site.copy(file)
    decisions = sorted((ROOT / "docs/decisions").glob("*.md"))
    site.write("decisions/index.md", decision_index(decisions))
    for page in sorted((HERE / "pages").iterdir()):
        site.write(page.name.removesuffix(".in"), page.read_text("utf-8"))
    (site.docs / "assets").mkdir(exist_ok=True)
    for name in ("favicon.svg", "extra.css", "iframe-worker.js"):
        shutil.copyfile(HERE / name, site.docs / "assets" / name)
    return decisions


def add_notebooks(site, work):
    """The notebooks, run at a small size; what they print and draw becomes part of their pages."""
    import nbclient
    import nbconvert
    import nbformat

    kernel = work / "jupyter/kernels/crt-site/kernel.json"
    kernel.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    kernel.write_text(json.dumps({"argv": command, "display_name": "crt", "language": "python"}))
    os.environ["JUPYTER_PATH"] = str(work / "jupyter")
    os.environ.setdefault("CRT_NOTEBOOK_SCALE", "0.5")
    rows = []
    for source in sorted((ROOT / "docs/notebooks").glob("*.ipynb")):
        say(f"notebook {source.stem}")
        notebook = nbformat.read(source, as_version=4)
        nbclient.NotebookClient(notebook, timeout=300, kernel_name="crt-site",
                                resources={"metadata": {"path": str(work)}}).execute()
        for cell in notebook.cells:
            if cell.cell_type == "code":  # Of a bar or a warning nothing is to be read here.
                cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
        pictures = {"output_files_dir": f"{source.stem}_files", "unique_key": source.stem}
        text, found = nbconvert.MarkdownExporter().from_notebook_node(notebook, pictures)
        site.add(source, text, found["outputs"])
        for name, data in found["outputs"].items():
            path = site.docs / "notebooks" / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)
        rows.append(f"| [{title(text)}]({source.stem}.md) | `docs/notebooks/{source.name}` |")
    site.write("notebooks/index.md", "# Notebooks\n\nEach was run when this site was made, at "
               f"{os.environ['CRT_NOTEBOOK_SCALE']} of its size.\n\n| notebook | file |\n|---|---|\n"
               + "\n".join(rows) + "\n")


def add_gallery(site, work, program):
    import crt

    folder = work / "gallery"
    folder.mkdir(exist_ok=True)
    cards = []
    for name in crt.examples():
        scene = crt.example(name)
        full = crt.load(scene)
        scale = gallery.SIDE / max(full.width, full.height)
        say(f"gallery: {name}")
        resolution = [round(full.width * scale), round(full.height * scale)]
        figures = gallery.rendered(program, scene, folder, resolution)
        cards.append(gallery.card(name, scene.read_text("utf-8"), figures))
        (site.docs / "gallery").mkdir(exist_ok=True)
        shutil.copyfile(folder / f"{name}.png", site.docs / "gallery" / f"{name}.png")
        site.page_of(scene)
    site.write("gallery.md", gallery.page(cards, figures["report"]))


def add_interface(site, work):
    """C and C++, by Doxygen, whose warnings are errors."""
    output = work / "doxygen"
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir()
    settings = (HERE / "Doxyfile").read_text() + f"OUTPUT_DIRECTORY = {output}\nHTML_OUTPUT = cpp\n"
    if subprocess.run(["doxygen", "-"], input=settings, text=True, cwd=ROOT).returncode:
        sys.exit("== error: Doxygen has warnings about the public headers")
    shutil.copytree(output / "cpp", site.docs / "cpp")


def navigation(site, decisions):
    def pages(folder):
        return [f"{folder}/index.md"] + sorted(path.relative_to(site.docs).as_posix() for path in
                                               (site.docs / folder).glob("*.md") if path.name != "index.md")

    index = (ROOT / "docs/results/README.md").read_text("utf-8")
    results = ["results/index.md", *(f"results/{name}" for name in re.findall(r"\]\(([\w-]+\.md)\)", index))]
    titled = [{title(file.read_text("utf-8")).replace(": ", " ", 1): f"decisions/{file.name}"}
              for file in decisions]
    return [{"crt": ["index.md"]}, {"Gallery": "gallery.md"},
            {"Manual": [{"Install": "install.md"}, {"Tutorial": "tutorial.md"},
                        {"Scene files": "scene.md"}, {"Live view": "view.md"},
                        {"Errors of images": "error.md"}, {"Python": "python.md"},
                        {"Scenes of Mitsuba and pbrt": "import.md"}, {"Many machines": "cluster.md"},
                        {"libcrt": "embedding.md"}, {"A backend": "example_backend.md"},
                        {"When things fail": "faults.md"}]},
            {"Notebooks": pages("notebooks")},
            {"API": [{"Python": "python-api.md"}, {"C and C++": "cpp.md"}]},
            {"Design": [{"Tour": "tour.md"}, {"Architecture": "architecture.md"},
                        {"Known answers": "stability.md"}, {"Decisions": ["decisions/index.md", *titled]}]},
            {"Results": results},
            {"Taking part": [{"How to": "contributing.md"}, {"Measuring": "bench.md"},
                             {"Changes": "changelog.md"}]}]


def main(build, work, output):
    build, work, output = (pathlib.Path(path).resolve() for path in (build, work, output))
    program = build / "bin/crt"
    docs = work / "docs"
    shutil.rmtree(docs, ignore_errors=True)
    docs.mkdir(parents=True)
    python = package(build, work)
    sys.path.insert(0, str(python))
    os.environ.update(CRT_PROGRAM=str(program), CRT_CONFIGS=str(ROOT / "configs"), PYTHONPATH=str(python),
                      CRT_BACKEND_PATH=str(build / "lib/crt"), PYTHONDONTWRITEBYTECODE="1")
    site = stage.Stage(docs)
    decisions = add_documents(site, program)
    add_interface(site, work)
    add_notebooks(site, work)
    add_gallery(site, work, program)
    say(f"{site.show_sources()} files of the repository are shown")

    options = {"extensions": [str(HERE / "docstrings.py")], "allow_inspection": False,
               "docstring_style": None, "show_source": False, "show_root_heading": True,
               "show_root_full_path": True, "show_root_toc_entry": True, "show_if_no_docstring": True,
               "show_signature_annotations": False, "separate_signature": True, "line_length": 90,
               "heading_level": 3, "filters": ["!^_"], "members_order": "source"}
    mkdocstrings = {"handlers": {"python": {"paths": [str(python)], "options": options}}}
    settings = {"INHERIT": str(HERE / "mkdocs.yml"), "docs_dir": str(docs), "site_dir": str(output),
                "nav": navigation(site, decisions),
                "plugins": ["search", "offline", {"mkdocstrings": mkdocstrings}]}
    (work / "mkdocs.yml").write_text(json.dumps(settings, indent=1))
    say("MkDocs")
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "DISABLE_MKDOCS_2_WARNING": "true"}
    if subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-f", work / "mkdocs.yml"],
                      env=environment).returncode:
        sys.exit("== error: MkDocs has warnings")
    return check_site.main(output)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
