"""The contestants of bench/peers. Each renders the Cornell box with a given number of samples and a seed,
and reports its cost; images are XYZ, row 0 at the top.

Their identity: `renderer`, `engine` (a backend of crt or a variant of Mitsuba), `replicates` (of crt's
sampler, otherwise 1) and `roulette`; `name` is for people.
"""

import json
import os
import subprocess
import sys
import pathlib
import time

import numpy as np

from . import program as crt
from .program import Failure

SCENE = "cornell_box"
ROULETTE_FROM = 4  # Scattering events; in both programs the first after which a path may end.


class Cost:
    """One render. Wall seconds and seconds of all processors of the render alone and of the process;
    `others`: the share that other processes had."""

    def __init__(self, image, spp, render, cpu, others, process=None, process_cpu=None):
        self.image, self.spp = image, spp
        self.render, self.cpu, self.others = render, cpu, others
        self.process, self.process_cpu = process, process_cpu


def read_pfm(path):
    with open(path, "rb") as file:
        if file.readline().strip() != b"PF":
            raise Failure(f"{path} is not a PFM with three channels")
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), order).reshape(height, width, 3)[::-1].astype(np.float64)


class Crt:
    """crt, a process for every image."""

    renderer, unit = "crt", 1.0

    def __init__(self, program, backend, replicates, roulette, setup):
        self.program, self.engine, self.replicates, self.roulette, self.setup = (
            program,
            backend,
            replicates,
            roulette,
            setup,
        )
        self.name = f"crt {backend}, {replicates} sequence{'s' if replicates > 1 else ''}" + (
            ", roulette" if roulette else ""
        )
        self.start_cpu = 0.0

    def settings(self):
        size = self.setup["size"]
        return [
            f"film.resolution=[{size},{size}]",
            "film.color_space=xyz",
            f"integrator.max_depth={self.setup['max_depth']}",
            f"integrator.roulette={'true' if self.roulette else 'false'}",
            f"integrator.roulette_depth={ROULETTE_FROM}",
            f"sampler.replicates={self.replicates}",
            "outputs.0.aovs=[]",
        ]

    def render(self, spp, seed, environment=None):
        file = self.program.scratch / "peer.pfm"
        before = crt.children_seconds()
        run = self.program.render(
            SCENE,
            self.engine,
            ["--spp", spp, "--seed", seed],
            [file],
            self.settings(),
            environment=environment,
        )
        cpu = crt.children_seconds() - before
        return Cost(
            read_pfm(file),
            spp,
            run.value("seconds", "render"),
            max(0.0, cpu - self.start_cpu),
            run.others,
            run.seconds,
            cpu,
        )

    def learn_start(self, runs):
        """Processor seconds of a process that renders nothing: of 1 and 4 samples, carried back to none."""
        one, four = ([self.render(spp, 7_000_000 + r).process_cpu for r in range(runs)] for spp in (1, 4))
        self.start_cpu = max(0.0, (4 * float(np.median(one)) - float(np.median(four))) / 3)

    def whole(self, spp, fresh):
        """(wall, processor) seconds of a whole process less those of its render; `fresh`: with no kernel in
        any cache."""
        folder = self.program.scratch / f"fresh-{time.monotonic_ns()}"
        environment = (
            {"CRT_CACHE_DIR": str(folder / "crt"), "POCL_CACHE_DIR": str(folder / "pocl")} if fresh else None
        )
        if fresh:
            (folder / "pocl").mkdir(parents=True)
        done = self.render(spp, 8_000_000, environment)
        if not fresh:
            return done.process - done.render, self.start_cpu
        # Compiling takes processor time that only a second, warm process can be told apart from: `cpu` is
        # less the warm start.
        return done.process - done.render, max(0.0, done.process_cpu - self.render(spp, 8_000_001).cpu)


class Worker:
    """Mitsuba 3 in one variant, waiting for requests; processes of one variant are shared by all its
    contestants."""

    def __init__(self, program, variant, setup):
        self.program, self.variant = program, variant
        self.scene_file = setup["mitsuba"]
        self.script = str(pathlib.Path(__file__).with_name("mitsuba_worker.py"))
        self.process = subprocess.Popen(
            [sys.executable, self.script, self.scene_file, variant],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def ask(self, request):
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # It has ended; what it said comes below.
        for line in self.process.stdout:
            if "{" in line:
                return json.loads(line[line.index("{"):])
        raise Failure(f"Mitsuba ({self.variant}) has ended: {self.process.stderr.read().strip()[-800:]}")

    def once(self, request, home):
        """A separate process for one request: (answer, wall seconds, processor seconds). Mitsuba keeps
        compiled kernels below HOME."""
        before, begin = crt.children_seconds(), time.perf_counter()
        done = subprocess.run(
            [sys.executable, self.script, self.scene_file, self.variant, json.dumps(request)],
            env={**os.environ, "HOME": str(home)},
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise Failure(f"Mitsuba ({self.variant}) fails: {done.stderr.strip()[-800:]}")
        return (
            json.loads(done.stdout[done.stdout.index("{") :]),
            time.perf_counter() - begin,
            crt.children_seconds() - before,
        )

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Mitsuba:
    renderer, replicates = "Mitsuba", 1

    def __init__(self, worker, sampler, roulette, unit):
        """`unit`: what the tables of the observer make of Mitsuba's pixels over crt's."""
        self.worker, self.sampler, self.roulette, self.unit = worker, sampler, roulette, unit
        self.engine = worker.variant.removesuffix("_spectral")
        self.name = f"Mitsuba {self.engine}, {sampler}" + (", roulette" if roulette else "")

    def request(self, spp, seed, image=None):
        return {
            "do": "render",
            "sampler": self.sampler,
            "spp": spp,
            "seed": seed,
            "roulette": ROULETTE_FROM if self.roulette else 0,
            "image": image,
        }

    def render(self, spp, seed):
        file = str(self.worker.program.scratch / "peer.npy")
        busy, begin = crt.processor_seconds(), time.perf_counter()
        done = self.worker.ask(self.request(spp, seed, file))
        elapsed = time.perf_counter() - begin
        others = max(0.0, crt.processor_seconds() - busy - done["busy_seconds"]) / (elapsed * os.cpu_count())
        if not done["finite"]:
            raise Failure(f"{self.name} made an image that is not finite")
        return Cost(
            np.load(file).astype(np.float64), done["spp"], done["seconds"], done["cpu_seconds"], others
        )

    def whole(self, spp, fresh):
        home = self.worker.program.scratch / (f"home-{time.monotonic_ns()}" if fresh else "home")
        home.mkdir(exist_ok=True)
        _, wall, cpu = self.worker.once(self.request(spp, 8_000_001), home)
        render = self.render(spp, 8_000_002)  # The same in a process that is warm: what remains is start-up.
        return max(0.0, wall - render.render), max(0.0, cpu - render.cpu)
