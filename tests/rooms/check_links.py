#!/usr/bin/env python3
"""Links of Markdown files and notebooks lead somewhere within this repository: to a file or folder that git
knows, and, where they name an anchor, to a heading as GitHub makes anchors of them. Exit code 1 names those
that do not, and functions that a table names beside a file that lacks them. Links to other sites are not
followed.

    tests/rooms/check_links.py [FOLDER]      another tree than this one; what lies in it counts
"""

import json
import pathlib
import re
import subprocess
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^ {0,3}(`{3,}|~{3,})")
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.*?)\s*#*\s*$")
SPAN = re.compile(r"(`+).+?\1")
# [text](target "title") and ![text](target); text may hold an image, which is then a separate link.
INLINE = re.compile(r"\]\(\s*(?:<([^>]*)>|([^\s()]*(?:\([^\s()]*\)[^\s()]*)*))(?:\s+[\"'][^)]*)?\s*\)")
REFERENCE = re.compile(r"^ {0,3}\[[^\]]+\]:\s+(\S+)")
USED = re.compile(r"\[([^\][]+)\]\[([^\][]*)\]")
HTML = re.compile(r"<(?:a|img|source)\b[^>]*?\b(?:href|src)=[\"']([^\"']+)[\"']")
NAMED = re.compile(r"<[a-z]+\b[^>]*?\b(?:id|name)=[\"']([^\"']+)[\"']")
# A row of a table that says which function of a file to look at: | [file](target) | `function` |
FUNCTION = re.compile(r"\]\(([^\s()#]+)\) \| `(\w+)` \|")
ELSEWHERE = re.compile(r"^[a-zA-Z][a-zA-Z0-9+.-]*:|^//")


def text_of(path):
    """Markdown of a file; of a notebook that of its cells of text."""
    text = path.read_text("utf-8")
    if path.suffix != ".ipynb":
        return text
    cells = json.loads(text)["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")


def prose(text):
    """(number, line) of the lines that are no code."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        found = FENCE.match(line)
        if found and fence is None:
            fence = found[1]
        elif found and found[1].startswith(fence) and not line.strip(" `~"):
            fence = None
        elif fence is None:
            yield number, line


def anchor(heading):
    """As GitHub makes it: of the words alone, in lower case, with - for blanks."""
    words = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    words = re.sub(r"<[^>]+>", "", words).lower()
    return re.sub(r"[^\w\- ]", "", words).replace(" ", "-")


def anchors(text):
    found, times = set(), {}
    for _, line in prose(text):
        heading = HEADING.match(line)
        if heading:
            name = anchor(heading[1])
            count = times.get(name, 0)
            times[name] = count + 1
            found.add(f"{name}-{count}" if count else name)
        found.update(NAMED.findall(line))
    return found


def links(text):
    """(number of the line, target) of every link."""
    lines = [(number, SPAN.sub(lambda span: " " * len(span[0]), line)) for number, line in prose(text)]
    defined = {match[0].split("]:")[0].strip(" [").lower() for _, line in lines
               for match in [REFERENCE.match(line)] if match}
    for number, line in lines:
        for target in INLINE.finditer(line):
            yield number, target[1] if target[1] is not None else target[2]
        for target in HTML.findall(line):
            yield number, target
        reference = REFERENCE.match(line)
        if reference:
            yield number, reference[1]
        for words, name in USED.findall(line):
            if (name or words).lower() not in defined:
                yield number, f"[{name or words}], which is not defined"


def known_files(root):
    """Files that git knows or would, so that what a build leaves behind is no target; else all there are."""
    git = ["git", "-C", root]
    done = subprocess.run([*git, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                          capture_output=True, text=True)
    top = subprocess.run([*git, "rev-parse", "--show-toplevel"], capture_output=True, text=True)
    if done.returncode == 0 and pathlib.Path(top.stdout.strip()).resolve() == root:
        files = [root / name for name in done.stdout.split("\0") if name]
        return {file for file in files if file.is_file()}
    return {file for file in root.rglob("*") if file.is_file()
            and not any(part.startswith((".", "build")) for part in file.relative_to(root).parts)}


class Tree:
    def __init__(self, root):
        self.root = root.resolve()
        self.files = known_files(self.root)
        self.folders = {parent for file in self.files for parent in file.parents}
        self.anchors = {}

    def pages(self):
        return sorted(file for file in self.files if file.suffix in (".md", ".ipynb"))

    def wrong(self, page, target):
        """The error of `target` in `page`, or None."""
        if ELSEWHERE.match(target):
            return None
        if "which is not defined" in target:
            return target
        name, _, fragment = urllib.parse.unquote(target).partition("#")
        place = pathlib.Path(page.parent, name).resolve() if name else page
        if place in self.folders:
            if not fragment:
                return None
            place = place / "README.md"
        if place not in self.files:
            return f"there is no {name}"
        if not fragment or place.suffix not in (".md", ".ipynb"):
            return None
        if place not in self.anchors:
            self.anchors[place] = anchors(text_of(place))
        return None if fragment in self.anchors[place] else f"{name or page.name} has no heading #{fragment}"


    def lacking(self, page):
        """(number of the line, error) of each function that the linked file lacks."""
        for number, line in prose(text_of(page)):
            for target, function in FUNCTION.findall(line):
                file = pathlib.Path(page.parent, target).resolve()
                if file in self.files and not re.search(rf"\b{function}\(", file.read_text("utf-8")):
                    yield number, f"{target} has no function {function}"


def main():
    tree = Tree(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
    count = broken = 0
    for page in tree.pages():
        for number, target in links(text_of(page)):
            count += 1
            why = tree.wrong(page, target)
            if why:
                broken += 1
                print(f"{page.relative_to(tree.root)}:{number}: {target}: {why}")
        for number, why in tree.lacking(page):
            broken += 1
            print(f"{page.relative_to(tree.root)}:{number}: {why}")
    print(f"{len(tree.pages())} pages, {count} links, {broken} broken")
    return 1 if broken or not count else 0


if __name__ == "__main__":
    sys.exit(main())
