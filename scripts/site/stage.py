"""Markdown of the repository as pages of the site: links to files that are no pages lead to pages that show
those files, and lists look as they do on GitHub."""

import os
import pathlib
import re
import shutil
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/rooms"))
import check_links  # noqa: E402

# Files outside docs/ that are pages.
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md",
         "bench/README.md": "bench.md", "docs/example_backend/README.md": "example_backend.md"}
# Files of docs/ that are copied as they are.
ASSETS = {".png", ".jpg", ".svg", ".json"}
LEXERS = {".c": "c", ".cl": "opencl", ".cmake": "cmake", ".cpp": "cpp", ".cu": "cuda", ".h": "cpp",
          ".json": "json", ".py": "python", ".sh": "bash", ".toml": "toml", ".yaml": "yaml", ".yml": "yaml"}
LARGEST = 200_000  # Bytes of a file that is shown.
ITEM = re.compile(r"^([-*+]|\d+[.)]) ")


class Stage:
    """The folder `docs` that MkDocs builds from. `shown` are files and folders of the repository that links
    lead to and that are no pages."""

    def __init__(self, docs):
        self.docs = docs
        self.tree = check_links.Tree(ROOT)
        self.shown = set()

    def page_of(self, place):
        """The place of a file or folder of the repository on the site: a path relative to `docs`."""
        name = place.relative_to(ROOT).as_posix()
        if name in PAGES:
            return PAGES[name]
        if name.startswith("docs/") and place.suffix in {".md", ".ipynb"} | ASSETS:
            inner = pathlib.PurePosixPath(name.removeprefix("docs/"))
            if inner.suffix == ".ipynb":
                inner = inner.with_suffix(".md")
            return str(inner.with_name("index.md") if inner.name == "README.md" else inner)
        # MkDocs leaves out what begins with a dot.
        shown = "/".join(part.lstrip(".") for part in place.relative_to(ROOT).parts)
        if place.is_dir():
            if name in ("docs/decisions", "docs/notebooks"):
                return name.removeprefix("docs/") + "/index.md"
            if place / "README.md" in self.tree.files:
                return self.page_of(place / "README.md")
            self.shown.add(place)
            return f"source/{shown}/index.md"
        self.shown.add(place)
        return f"source/{shown}.md"

    def target(self, source, page, target):
        """The link `target` of the file `source`, as it is on the page `page`."""
        if check_links.ELSEWHERE.match(target) or target.startswith("#"):
            return target
        name, hash_sign, fragment = target.partition("#")
        place = pathlib.Path(source.parent, name).resolve()
        if place not in self.tree.files and place not in self.tree.folders:
            raise SystemExit(f"{source.relative_to(ROOT)}: {target}: no such file or folder")
        return os.path.relpath(self.page_of(place), os.path.dirname(page) or ".") + hash_sign + fragment

    def rewritten(self, text, source, page, own):
        """The text of `source` with links as they are on `page`; those of `own` stay."""
        def put(match):
            group = next(k for k in range(1, match.re.groups + 1) if match[k] is not None)
            if match[group] in own:
                return match[0]
            start, end = (at - match.start() for at in match.span(group))
            return match[0][:start] + self.target(source, page, match[group]) + match[0][end:]

        lines = text.splitlines()
        for number, line in check_links.prose(text):
            spans = []

            def hide(span):
                spans.append(span[0])
                return f"\0{len(spans) - 1}\0"

            line = check_links.SPAN.sub(hide, line)
            for form in (check_links.INLINE, check_links.HTML, check_links.REFERENCE):
                line = form.sub(put, line)
            lines[number - 1] = re.sub("\0(\\d+)\0", lambda at: spans[int(at[1])], line)
        return "\n".join(spaced(lines)) + "\n"

    def add(self, source, text=None, own=()):
        """A page of a file of the repository, or of `text` in its place. Links of `own` are the page's."""
        page = self.page_of(source)
        text = source.read_text("utf-8") if text is None else text
        self.write(page, self.rewritten(text, source, page, own))
        return page

    def write(self, page, text):
        path = self.docs / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")

    def copy(self, source):
        path = self.docs / self.page_of(source)
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, path)

    def show_sources(self):
        """Pages of the files and folders that links lead to and that are no pages themselves."""
        done = set()
        while self.shown - done:
            for place in sorted(self.shown - done):
                done.add(place)
                (self.show_folder if place.is_dir() else self.show_file)(place)
        return len(done)

    def show_folder(self, folder):
        page = self.page_of(folder)
        lines = [HIDDEN, f"# {folder.relative_to(ROOT)}/\n", "The files of this folder of the repository.\n"]
        inner = {place for place in self.tree.files | self.tree.folders if place.parent == folder}
        for place in sorted(inner, key=lambda place: (place.is_file(), place.name)):
            name = f"`{place.name}{'/' if place.is_dir() else ''}`"
            readable = place.is_file() and text_of(place) is not None
            link = os.path.relpath(self.page_of(place), os.path.dirname(page)) if readable else None
            lines.append(f"- [{name}]({link})" if link else f"- {name}")
        self.write(page, "\n".join(lines) + "\n")

    def show_file(self, file):
        text = text_of(file)
        if text is None:
            raise SystemExit(f"{file.relative_to(ROOT)} is linked, and neither text nor a picture of docs/")
        lexer = "cmake" if file.name == "CMakeLists.txt" else LEXERS.get(file.suffix, "text")
        fence = "`" * 6
        self.write(self.page_of(file), f"{HIDDEN}# {file.name}\n\n`{file.relative_to(ROOT)}`\n\n"
                                       f"{fence}{lexer}\n{text.rstrip()}\n{fence}\n")


# Not found by the search, which is for prose.
HIDDEN = "---\nsearch:\n  exclude: true\n---\n\n"


def text_of(file):
    if file.stat().st_size > LARGEST:
        return None
    try:
        return file.read_text("utf-8")
    except UnicodeDecodeError:
        return None


def spaced(lines):
    """A blank line before each list that follows a paragraph without one, which Python-Markdown needs."""
    code = set(range(len(lines))) - {n - 1 for n, _ in check_links.prose("\n".join(lines))}
    begin = ""  # The first line of the paragraph.
    for at, line in enumerate(lines):
        if at in code or not line.strip():
            begin = ""
        elif not begin:
            begin = line
        elif ITEM.match(line) and not ITEM.match(begin) and not begin.startswith((" ", "|", "#", "<")):
            yield ""
            begin = line
        yield line
