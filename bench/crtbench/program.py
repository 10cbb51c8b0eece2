"""crt as the measurements see it: where it is, how it is started, what it reports, and how undisturbed it
ran."""

import json
import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time


class Failure(Exception):
    """A measurement that cannot be made; one sentence."""


def processor_seconds():
    """Seconds that all processors together were busy since boot, with what a hypervisor took from them."""
    fields = pathlib.Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]
    user, nice, system, _idle, _wait, irq, soft_irq, steal = (int(f) for f in fields[:8])
    return (user + nice + system + irq + soft_irq + steal) / os.sysconf("SC_CLK_TCK")


def children_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Run:
    """One process that ran: how long, what it printed, what crt reported, and what share of the processor
    others took meanwhile."""

    def __init__(self, code, seconds, output, others, report=None, errors=""):
        self.code = code
        self.seconds = seconds
        self.output = output
        self.errors = errors
        self.others = others
        self.report = report

    def value(self, *keys):
        value = self.report
        for key in keys:
            value = value[key]
        return value


class Program:
    """One build of crt. Everything it writes goes to a scratch folder that disappears at the end."""

    def __init__(self, repository, build, busy_share):
        self.repository = repository
        self.build = build
        self.busy_share = busy_share
        self.crt = build / "bin" / "crt"
        self._scratch = tempfile.TemporaryDirectory(prefix="crt-bench-")
        self.scratch = pathlib.Path(self._scratch.name)
        self.disturbed = 0   # Timed runs that were repeated because others used the processor.
        self.timed = 0
        self.environment = {
            **{k: v for k, v in os.environ.items() if not k.startswith("CRT_")},
            "CRT_MESH_PATH": str(build / "share" / "crt" / "meshes"),
            "CRT_BACKEND_PATH": f"{build / 'tests' / 'fake_plugins'}:{build / 'tests' / 'backends'}",
            "CRT_CACHE_DIR": str(self.scratch / "cache"),
            "POCL_CACHE_DIR": str(self.scratch / "pocl"),
            "LC_ALL": "C.UTF-8",
        }

    def bring_up_to_date(self):
        if not (self.build / "CMakeCache.txt").exists():
            raise Failure(
                f"there is no build in '{self.build}': cmake -B {self.build} && cmake --build {self.build}"
            )
        home = self.cmake_cache().get("CMAKE_HOME_DIRECTORY", "")
        if pathlib.Path(home).resolve() != self.repository:
            raise Failure(f"'{self.build}' is a build of '{home}', not of '{self.repository}'")
        done = subprocess.run(
            ["cmake", "--build", str(self.build), "-j", str(os.cpu_count())], capture_output=True, text=True
        )
        if done.returncode != 0:
            raise Failure(f"the build fails:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")

    def cmake_cache(self):
        entries = {}
        for line in (self.build / "CMakeCache.txt").read_text().splitlines():
            match = re.match(r"([A-Za-z0-9_-]+):[A-Z]+=(.*)", line)
            if match:
                entries[match[1]] = match[2]
        return entries

    def scenes(self, only=None):
        """Names of the shipped scenes."""
        names = sorted(path.stem for path in (self.repository / "configs").glob("*.yaml"))
        unknown = set(only or []) - set(names)
        if unknown:
            raise Failure(f"no such scene: {', '.join(sorted(unknown))}")
        return [name for name in names if not only or name in only]

    def scene_file(self, name):
        return f"configs/{name}.yaml"

    def backends(self, wanted):
        """Those of the wanted that have a device here, with why the others have none."""
        usable, absent = [], {}
        statuses = self.plugin_statuses()
        for name in wanted:
            status = statuses.get(name, {"reason": "not built"})
            if status.get("devices"):
                usable.append(name)
            else:
                absent[name] = status.get("reason", "no device")
        return usable, absent

    def plugin_statuses(self):
        """`crt plugins`, parsed: name → version, built with, devices, reason."""
        statuses, current = {}, None
        for line in self.start(["plugins"]).output.splitlines():
            if line and not line.startswith(" "):
                name, _, version = line.partition(" ")
                current = statuses.setdefault(name, {"version": version, "devices": []})
            elif current is not None and (
                match := re.match(r"  (file|built with|device|cannot run)\s+(.*)", line)
            ):
                if match[1] == "device":
                    current["devices"].append(match[2])
                elif match[1] == "cannot run":
                    current["reason"] = match[2]
                elif match[1] == "built with":
                    current["build"] = match[2]
        return statuses

    def start(self, arguments, *, environment=None, codes=(0,), program=None):
        """Runs crt (or `program`) to its end."""
        command = [str(program or self.crt), *map(str, arguments)]
        busy, own, begin = processor_seconds(), children_seconds(), time.perf_counter()
        done = subprocess.run(command, cwd=self.repository, env={**self.environment, **(environment or {})},
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace")
        seconds = time.perf_counter() - begin
        others = max(0.0, (processor_seconds() - busy) - (children_seconds() - own)) / (
            seconds * os.cpu_count()
        )
        if done.returncode not in codes:
            raise Failure(
                f"{self.plain(' '.join(command))} ended with code {done.returncode}: "
                f"{done.stderr.strip()[-1500:]}"
            )
        return Run(done.returncode, seconds, done.stdout, others, errors=done.stderr)

    def render(self, scene, backend, arguments=(), outputs=(), settings=(), codes=(0,), environment=None):
        """Renders a scene of the repository (by name) or a file, and reads the report. Without outputs, a
        PFM that is not read."""
        report = self.scratch / "report.json"
        report.unlink(missing_ok=True)
        command = [
            "render",
            self.scene_file(scene) if "/" not in str(scene) else scene,
            "--backend",
            backend,
            "--quiet",
            "--report",
            report,
        ]
        for setting in settings:
            command += ["--set", setting]
        for output in outputs or [self.scratch / "unseen.pfm"]:
            command += ["-o", output]
        run = self.start([*command, *arguments], codes=codes, environment=environment)
        run.report = json.loads(report.read_text())
        return run

    def compare(self, a, b):
        """`crt compare --all-channels --json`: bit for bit, AOVs too."""
        run = self.start(["compare", "--all-channels", "--json", a, b], codes=(0, 7))
        result = json.loads(run.output)
        if result["mismatch"]:
            raise Failure(f"{a} and {b} cannot be compared: {result['mismatch']}")
        return result

    def interleaved(self, cases, runs, attempts=6, warm_up=True):
        """{name: function → Run} → {name: [Run]}: first all once, untimed, to warm caches (`warm_up`);
        then all in turn, `runs` times. A run during which other processes used the processor is repeated;
        when that does not help, the measurement is given up."""
        for case in cases.values() if warm_up else ():
            case()
        self.await_compilers()
        kept = {name: [] for name in cases}
        for _ in range(runs):
            for name, case in cases.items():
                for attempt in range(attempts):
                    run = case()
                    self.timed += 1
                    if run.others <= self.busy_share:
                        break
                    self.disturbed += 1
                    if attempt + 1 == attempts:
                        raise Failure(
                            f"other processes take {run.others:.0%} of the processor: no timing of '{name}' "
                            f"means anything now"
                        )
                    time.sleep(2 * attempt)
                kept[name].append(run)
        return kept

    @staticmethod
    def await_compilers():
        """A render of the CUDA backend may end before its compiler: until that has put the kernel into the
        cache."""
        def at_work():
            for process in pathlib.Path("/proc").glob("[0-9]*"):
                try:
                    if os.readlink(process / "exe").endswith("/crt_nvrtc"):
                        return True
                except OSError:
                    pass  # Ended meanwhile, or another user's.
            return False
        while at_work():
            time.sleep(0.1)

    def plain(self, text):
        """Text without folders of this machine."""
        for folder, name in ((self.scratch, "SCRATCH"), (self.build, "BUILD"), (self.repository, ".")):
            text = text.replace(str(folder), name)
        return text

    def patched_kernel(self, patch):
        """A copy of the kernel texts with a patch of the repository in it, for CRT_KERNEL_DIR."""
        tree = self.scratch / patch.stem
        shutil.copytree(self.repository / "core" / "kernel", tree / "core" / "kernel")
        # Without fuzz: if the text around a change differs now, the patch needs an update by hand.
        done = subprocess.run(
            ["patch", "--strip=1", "--fuzz=0", "--silent", "-d", str(tree), "-i", str(patch)],
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise Failure(f"{patch.name} does not fit the kernel any more: {done.stdout.strip()}")
        return tree / "core" / "kernel"

    def mutated_kernel(self, name):
        """The same with a fault of tests/mutations."""
        mutations = self.repository / "tests" / "mutations"
        sys.path.append(str(mutations))
        from mutant import Misfit, Mutant

        tree = self.scratch / name
        shutil.copytree(self.repository / "core" / "kernel", tree / "core" / "kernel")
        try:
            Mutant(mutations / f"{name}.mutant").apply(tree)
        except Misfit as misfit:
            raise Failure(f"{name}.mutant does not fit the kernel any more: {misfit}") from misfit
        return tree / "core" / "kernel"

    def kernels_with(self, extra, masks):
        """A copy of the kernel texts, for CRT_KERNEL_DIR, in which a kernel with one of the masks, or with a
        part of one, as the shaders of a wave have, has the feature `extra` as well. Other kernels, which
        were not asked for, have nothing at all, so that they compile fast: what they render is wrong, and
        renders are to ask for --kernel lean-only."""
        directory = self.scratch / f"kernel-{extra:05x}"
        if directory.exists():
            return directory
        shutil.copytree(self.repository / "core" / "kernel", directory)
        asked = " || ".join(f"((CRT_FEATURES) & ~{mask:#x}ul) == 0" for mask in masks)
        # CRT_KERNEL_DIR wants the headers of the layout untouched, features.h among them: the first that
        # includes them gets more.
        more = (
            f"#undef CRT_HAS\n#if {asked}\n"
            f"#define CRT_MORE ((CRT_FEATURES) | {extra:#x}ul)\n"
            "#define CRT_HAS(name) CRT_IN_MASK(CRT_MORE, name)\n"
            "#undef CRT_KERNEL_MATERIALS\n#define CRT_KERNEL_MATERIALS (CRT_MORE & CRT_FEATURES_MATERIALS)\n"
            "#else\n#define CRT_HAS(name) (0)\n#endif\n"
        )
        include = '#include "kernel/dialect/layout.h"\n'
        users = [h for h in directory.glob("*/*.h") if include in h.read_text()]
        if not users:
            raise Failure("no kernel header includes layout.h: kernels_with() has to be taught the new way")
        for header in users:
            header.write_text(header.read_text().replace(include, include + more))
        return directory


def feature_bits(repository):
    """[(bit, NAME, text)] of core/kernel/dialect/features.h."""
    text = (repository / "core" / "kernel" / "dialect" / "features.h").read_text()
    found = re.findall(r'(?:F\(|M\(F, )(\d+), (\w+),[\w,\s\\]*"([^"]*)"\)', text)
    if not found:
        raise Failure("core/kernel/dialect/features.h lists no features in the form F(bit, NAME, \"text\")")
    return [(int(bit), name, what) for bit, name, what in found]


class Spread:
    """Median, least and most of several runs."""

    def __init__(self, values):
        self.values = list(values)
        self.median = statistics.median(self.values)
        self.least, self.most = min(self.values), max(self.values)

    def json(self):
        return {"median": self.median, "min": self.least, "max": self.most, "runs": self.values}

    def text(self, digits=3, scale=1.0):
        median, least, most = (significant(v * scale, digits) for v in (self.median, self.least, self.most))
        return f"{median} ({least} – {most})"


def significant(value, digits=3):
    """A number with this number of significant digits, without exponent in the range of the measurements
    here."""
    if value == 0:
        return "0"
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and abs(value) >= 1 else text
