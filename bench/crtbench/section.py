"""Sections of the pages in docs/results. A section stands between `<!-- results: NAME -->` and
`<!-- /results: NAME -->`; the command that measures NAME replaces it. Moving the two marks to another page
moves the section."""

import datetime
import os
import pathlib
import platform
import re
import subprocess
import textwrap

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGES = REPOSITORY / "docs" / "results"
COLUMNS = 109


def wrapped(text):
    return textwrap.wrap(text, COLUMNS, break_long_words=False, break_on_hyphens=False)


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head),
            *("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows)]


def section(title, source, text, head, rows, figure=None):
    """Lines: a claim as the title, where its figures come from, what they mean, one table."""
    lines = [f"## {title}", "", *wrapped(source), ""]
    for paragraph in [text] if isinstance(text, str) else text:
        lines += [*wrapped(paragraph), ""]
    if figure:
        lines += [figure, ""]
    return [*lines, *table(head, rows)]


def source(command, commit, date, machine):
    """The line below a section's title."""
    return f"`{command}`, commit `{commit}`, {date}. {machine}."


def today():
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")


def commit():
    """Of the repository; with a `+` where files of it, other than results, have been changed."""
    def git(*arguments):
        return subprocess.run(["git", "-C", REPOSITORY, *arguments], capture_output=True, text=True).stdout

    changed = [line for line in git("status", "--porcelain").splitlines()
               if not line[3:].startswith("docs/results/")]
    return git("rev-parse", "HEAD").strip()[:10] + ("+" if changed else "")


def processor_name():
    match = re.search(r"model name\s*:\s*(.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return match[1] if match else platform.processor()


def processor():
    return f"{processor_name()}, {os.cpu_count()} threads"


def marks(name):
    return f"<!-- results: {name} -->", f"<!-- /results: {name} -->"


def page_of(name, folder=PAGES):
    """The page with the marks of a section, or None."""
    begin, _ = marks(name)
    return next((page for page in sorted(folder.glob("*.md")) if begin in page.read_text("utf-8")), None)


def replace(page, name, lines):
    """Puts the lines between the marks of the section."""
    begin, end = marks(name)
    text, found = re.subn(f"{re.escape(begin)}\n.*?{re.escape(end)}",
                          lambda _: "\n".join([begin, *lines, end]),
                          page.read_text("utf-8"), flags=re.DOTALL)
    if found != 1:
        raise ValueError(f"{page} has no section between '{begin}' and '{end}'")
    page.write_text(text, "utf-8")
