"""crt and Mitsuba as contestants of `race` and `mitsuba-speed`: each renders a scene with a number of
samples."""

import dataclasses
import time

import drjit as dr
import mitsuba as mi
import numpy as np

from . import agree_scene
from .program import Failure

WARM_UP_SEED = 999_999_937   # No measured render has it.


@dataclasses.dataclass
class Cost:
    """A render: its luminance, seconds, and the samples that it took."""

    luminance: np.ndarray
    seconds: float
    samples: int


def read_pfm(path):
    with open(path, "rb") as file:
        if file.readline().strip() != b"PF":
            raise Failure(f"{path} is not a PFM with three channels")
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), order).reshape(height, width, 3)[::-1].astype(np.float64)


class Crt:
    """One backend of crt, a process for every image, with Sobol points in this number of replicates (crt's
    default is two: an image of one does not know its error)."""

    def __init__(self, program, file, backend, replicates, size):
        self.program, self.file, self.backend, self.size = program, file, backend, size
        self.replicates = replicates
        self.name = f"crt {backend}, {replicates} sequence{'s' if replicates > 1 else ''}"

    def settings(self):
        made = [f"film.resolution=[{self.size},{self.size}]"]
        if around := agree_scene.environment_image(self.file):  # crt looks beside the scene alone
            made.append(f"environment.image={self.program.scratch / around}")
        return made

    def render(self, samples, seed, arguments=()):
        image = self.program.scratch / "race.pfm"
        settings = [
            *self.settings(),
            "film.color_space=xyz",
            f"sampler.replicates={self.replicates}",
        ]
        run = self.program.render(
            self.file,
            self.backend,
            ["--spp", samples, "--seed", seed, *arguments],
            [image],
            settings,
            environment={"CRT_MESH_PATH": self.mesh_path()},
        )
        return Cost(read_pfm(image)[:, :, 1], run.value("seconds", "render"), samples)

    def mesh_path(self):
        return f"{self.program.scratch}:{self.program.environment['CRT_MESH_PATH']}"

    def warm_up(self, samples):
        """The kernel of the scene is compiled at once, and in the cache for all renders after this one."""
        self.render(samples, WARM_UP_SEED, ["--kernel", "lean-only"])
        self.program.await_compilers()


class Mitsuba:
    """One variant with one of its samplers, in this process."""

    def __init__(self, program, file, variant, sampler, size):
        self.variant, self.sampler = variant, sampler
        self.name = f"Mitsuba {variant}, {sampler}"
        mi.set_variant(variant)
        self.scene = self.load(program, file, size)

    def load(self, program, file, size):
        meshes = program.build / "share" / "crt" / "meshes"
        given = agree_scene.translate(file, program.scratch, 1, meshes=meshes)
        given["sensor"]["film"] |= {"width": size, "height": size}
        given["sensor"]["sampler"]["type"] = self.sampler
        return mi.load_dict(given)

    def render(self, samples, seed):
        mi.set_variant(self.variant)
        begin = time.perf_counter()
        image = mi.render(self.scene, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        seconds = time.perf_counter() - begin
        took = self.scene.sensors()[0].sampler().sample_count()
        return Cost(np.array(image)[:, :, 1].astype(np.float64), seconds, took)

    def warm_up(self, samples):
        """Kernels are compiled for each number of samples."""
        self.render(samples, WARM_UP_SEED)
