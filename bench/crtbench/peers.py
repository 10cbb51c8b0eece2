"""Renderers beside Mitsuba that `race` compares with crt. Each runs in a separate process, under a Python
that has it."""

import dataclasses
import os
import pickle
import shutil
import subprocess
import sys

import numpy as np

from . import rgb_scene
from .command import REPOSITORY
from .contestants import WARM_UP_SEED, Cost
from .peer_process import Untranslated
from .program import Failure

@dataclasses.dataclass
class Kind:
    """A renderer: our module that renders, the module that it imports, the package, the Python that the
    package is for (any if None), and the settings of its contestants by their labels."""

    name: str
    module: str
    needs: str
    package: str
    python: str | None
    contestants: dict


# In these scenes Cycles' blue noise has 1.2 times the error of its tabulated Sobol points, and LuxCore's
# strategies for lights differ by less than 1 % with Sobol points.
KINDS = {
    "cycles": Kind("Cycles", "cycles", "bpy", "bpy==5.0.1", "3.11", {
        "light tree": {"pattern": "TABULATED_SOBOL", "light_tree": True},
        "no light tree": {"pattern": "TABULATED_SOBOL", "light_tree": False},
    }),
    "luxcore": Kind("LuxCore", "luxcore", "pyluxcore", "pyluxcore==2.11.2", None, {
        "sobol": {"sampler": "SOBOL"},
        "random": {"sampler": "RANDOM"},
    }),
}


def has(python, module):
    asks = f"from importlib.util import find_spec as f; exit(not (f('{module}') and f('numpy')))"
    return subprocess.run([python, "-c", asks], capture_output=True).returncode == 0


def python_for(kind):
    """This Python, or that of out/NAME-venv, made when it is missing."""
    if has(sys.executable, kind.needs):
        return sys.executable
    folder = REPOSITORY / "out" / f"{kind.module}-venv"
    python = str(folder / "bin" / "python")
    if not (folder / "bin" / "python").exists() or not has(python, kind.needs):
        maker = shutil.which(f"python{kind.python}") if kind.python else sys.executable
        if maker is None:
            raise Failure(f"{kind.package} is for Python {kind.python}, which is not there")
        print(f"installing {kind.package} into {folder}", flush=True)
        for command in ([maker, "-m", "venv", str(folder)],
                        [python, "-m", "pip", "install", "--quiet", kind.package, "numpy"]):
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                raise Failure(f"{folder} cannot be made: {done.stderr.strip()[-500:]}")
    return python


class Peer:
    """A renderer with some settings, in a separate process."""

    def __init__(self, described, kind, python, label):
        self.name = f"{kind.name} {label}"
        self.process = subprocess.Popen(
            [python, "-m", "crtbench.peer_process", kind.module, kind.name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # LuxCore asks for OpenCL devices, and some drivers end its process.
            env={**os.environ, "PYTHONPATH": str(REPOSITORY / "bench"), "OCL_ICD_VENDORS": os.devnull},
        )
        self.call({"described": described, **kind.contestants[label]})

    def call(self, arguments):
        try:
            pickle.dump(arguments, self.process.stdin)
            self.process.stdin.flush()
            answer = pickle.load(self.process.stdout)
        except (EOFError, BrokenPipeError) as end:
            raise Failure(f"the process of {self.name} ended with code {self.process.wait()}") from end
        if isinstance(answer, Untranslated):
            self.close()
            raise answer
        return answer

    def render(self, samples, seed):
        rgb, seconds, took = self.call({"samples": samples, "seed": seed})
        return Cost(rgb_scene.luminance(np.asarray(rgb)), seconds, took)

    def warm_up(self, samples):
        self.render(samples, WARM_UP_SEED)

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def contestants(program, file, who, size):
    """A renderer with each of its settings."""
    kind = KINDS[who]
    meshes = program.build / "share" / "crt" / "meshes"
    try:
        described = rgb_scene.describe(file, program.scratch, meshes, size)
    except Failure as reason:
        raise Untranslated(str(reason)) from reason
    python = python_for(kind)
    return [Peer(described, kind, python, label) for label in kind.contestants]
