"""The results of a measurement: all of it in out/bench (NAME.md for people, NAME.json for programs, both
with the machine and the build), and what crt claims by it in its section of a page in docs/results."""

import datetime
import json
import os
import pathlib
import platform
import re
import shlex
import subprocess
import sys
import textwrap

from . import section
from .command import REPOSITORY
from .section import processor, processor_name

JSON_TEXT_COLUMNS = 80  # A key and its indent stand before it.


class Results:
    """Collects a page; nothing is written before write(), so that a measurement that breaks off leaves no
    half of a page."""

    machine = None   # In words, where rows were measured on other machines.

    def __init__(self, program, arguments, name, title):
        self.program, self.arguments, self.name = program, arguments, name
        self.lines = [f"# {title}", ""]
        self.claims = {}
        self.data = {}
        self.commands = []
        self.shown = {}   # Arguments of the command line that the page shows in other words.
        self.load = os.getloadavg()[0]
        self.started = datetime.datetime.now(datetime.timezone.utc)

    def paragraph(self, text):
        self.lines += [*section.wrapped(text), ""]

    def heading(self, text):
        self.lines += [f"## {text}", ""]

    def table(self, head, rows):
        self.lines += [*section.table(head, rows), ""]

    def claim(self, title, text, head, rows, name=None):
        """A section of docs/results: `name` where it is not that of the measurement."""
        self.claims[name or self.name] = (title, text, head, rows)

    def not_measured(self, absent):
        """`absent`: {backend: why}."""
        for backend, reason in absent.items():
            self.paragraph(f"Not measured: `{backend}` ({reason}).")

    def command(self, text):
        """A crt command line that stands for those that were run."""
        self.commands.append(self.program.plain(text))

    def command_line(self):
        """As it was typed, without the names of folders of this machine."""
        words = [self.shown.get(a) or self.program.plain(a) for a in sys.argv[1:]]
        return "bench/run " + shlex.join(words)

    def write(self, whole_page=False):
        """`whole_page`: docs/results/NAME.md is this page, and not only sections."""
        facts = provenance(self.program)
        facts["command"] = self.command_line()
        facts["date"] = self.started.strftime("%Y-%m-%d %H:%M UTC")
        facts["load_at_start"] = self.load
        facts["timed_runs"] = self.program.timed
        facts["repeated_because_disturbed"] = self.program.disturbed

        self.heading("How it was measured")
        rows = [
            ("Command", f"`{facts['command']}`"),
            ("Date", facts["date"]),
            (
                "Commit",
                f"`{facts['commit']}`"
                + (", with uncommitted changes" if facts["dirty"] else ", nothing uncommitted"),
            ),
            ("Compiler", f"{facts['compiler']}, {facts['build_type']}: `{facts['flags']}`"),
        ]
        if facts["embree_kernel_flags"]:
            rows.append(("Embree kernels", f"`{facts['embree_kernel_flags']}`"))
        rows += [("Processor", f"{processor()}, {facts['memory_gb']} GB"),
                 ("GPU", facts["gpu"] or "none"),
                 ("System", facts["os"])]
        rows += [(f"Backend `{name}`", text) for name, text in facts["backends"].items()]
        if facts["timed_runs"]:
            rows.append(
                (
                    "Disturbance",
                    f"load {self.load:.1f} at the start; {facts['timed_runs']} timed runs, "
                    f"{facts['repeated_because_disturbed']} of "
                    f"them repeated because other processes took over {self.program.busy_share:.0%} of the "
                    f"processor",
                )
            )
        self.table(("", ""), rows)
        if self.commands:
            self.lines += [
                "Runs like these, from the repository's folder:",
                "",
                "```sh",
                *self.commands,
                "```",
                "",
            ]

        # Results that were asked for in another folder, or are of a trial, change no page of docs/results.
        apart = self.arguments.results
        folder = apart or REPOSITORY / "out" / "bench"
        folder.mkdir(parents=True, exist_ok=True)
        page = (apart or section.PAGES if whole_page else folder) / f"{self.name}.md"
        page.write_text("\n".join(self.lines).rstrip() + "\n")
        (folder / f"{self.name}.json").write_text(
            json.dumps(folded({"measured": facts, **self.data}), indent=1, ensure_ascii=False) + "\n"
        )
        print(f"wrote {page} and {folder / self.name}.json")
        if not apart:
            self.write_sections(facts)

    def write_sections(self, facts):
        with_what = "; ".join(filter(None, [
            self.machine or processor(), None if self.machine else facts["gpu"]]))
        line = section.source(facts["command"], facts["commit"][:10] + ("+" if facts["dirty"] else ""),
                              facts["date"].split()[0], with_what)
        for name, claim in self.claims.items():
            page = section.page_of(name)
            if page is None:
                print(f"no page of docs/results has the section '{name}'")
                continue
            title, text, head, rows = claim
            section.replace(page, name, section.section(title, line, text, head, rows))
            print(f"wrote the section '{name}' of {page}")


def folded(value):
    """The same value; texts too long for a line as lists of lines, which joined by blanks are the text."""
    if isinstance(value, dict):
        return {key: folded(v) for key, v in value.items()}
    if isinstance(value, list):
        return [folded(v) for v in value]
    if isinstance(value, str) and len(value) > JSON_TEXT_COLUMNS:
        return textwrap.wrap(value, JSON_TEXT_COLUMNS, break_long_words=False, break_on_hyphens=False)
    return value


def provenance(program):
    def git(*arguments):
        return subprocess.run(
            ["git", "-C", str(program.repository), *arguments], capture_output=True, text=True
        ).stdout

    cache = program.cmake_cache()
    build_type = cache.get("CMAKE_BUILD_TYPE", "")
    version = subprocess.run(
        [cache["CMAKE_CXX_COMPILER"], "--version"], capture_output=True, text=True
    ).stdout.split("\n", 1)[0]
    statuses = program.plugin_statuses()
    shown = ("cuda", "embree", "opencl", "cuda_on_host", "example")
    backends = {}
    for name in shown:
        if name in statuses:
            status = statuses[name]
            backends[name] = program.plain(
                f"{status['version']}; "
                + ("; ".join(status["devices"]) or status.get("reason", "no device"))
            )
    gpus = [
        d
        for name in ("cuda", "opencl")
        for d in statuses.get(name, {"devices": []})["devices"]
        if re.search(r"NVIDIA|AMD Radeon|GPU", d)
    ]
    memory_kb = int(re.search(r"MemTotal:\s+(\d+)", pathlib.Path("/proc/meminfo").read_text())[1])
    # Results are what the measurements write; they do not change what is measured.
    changed = [
        line
        for line in git("status", "--porcelain").splitlines()
        if not line[3:].startswith("docs/results/")
    ]
    return {"commit": git("rev-parse", "HEAD").strip(), "dirty": bool(changed),
            "compiler": version, "build_type": build_type,
            "flags": compile_flags(program, "/core/compile/compile.cpp", "/crt_compile.dir/"),
            "embree_kernel_flags": (compile_flags(program, "/plugins/embree/kernels.cpp")
                                    if "embree" in statuses else ""),
            "cpu": processor_name(), "threads": os.cpu_count(), "memory_gb": round(memory_kb / 1e6, 1),
            "gpu": gpus[0] if gpus else None, "os": operating_system(), "backends": backends}


def operating_system():
    match = re.search(r'PRETTY_NAME="(.*)"', pathlib.Path("/etc/os-release").read_text())
    return f"{match[1] if match else platform.system()}, {platform.system()} {platform.release()}"


def compile_flags(program, *sources):
    """Flags of the first of these files that the build compiles, without its paths and definitions. A room
    may be compiled several files at a time, which then have another name."""
    path = program.build / "compile_commands.json"
    if not path.exists():
        return ""
    for entry in json.loads(path.read_text()):
        if any(source in entry["file"] for source in sources):
            words = shlex.split(entry["command"])
            return " ".join(w for w in words if re.match(r"-(O|m|f|std=|g)", w) and "/" not in w)
    raise LookupError(f"{path} has none of {', '.join(sources)}")
