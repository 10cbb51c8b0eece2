"""Mitsuba 3 as a process that the measurement talks to: one JSON object a line in, one out. Runs under a
Python that has mitsuba and numpy; nothing of crt is imported here.

    {"do": "describe"} → versions, constants, CIE tables as Mitsuba evaluates them
    {"do": "render", "sampler": …, "spp": …, "seed": …, "roulette": …, "image": path.npy}
        → seconds, cpu_seconds, spp, mean

Seconds are those of mi.render with its evaluation and synchronisation, on a scene that is loaded; every
setting is rendered once, untimed, with another seed before it is timed, so that kernels are compiled."""

import json
import os
import pathlib
import resource
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

WARM_UP_SEED = 999_999_937  # No measured render has it.


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def spectrum(given):
    """A number, or a table on a regular grid of wavelengths in nm: Mitsuba finds its cell by a
    multiplication, in an irregular one by bisection."""
    if not isinstance(given, dict):
        return {"type": "uniform", "value": float(given)}
    return {
        "type": "regular",
        "wavelength_min": given["nm"][0],
        "wavelength_max": given["nm"][-1],
        "values": ", ".join(map(repr, given["value"])),
    }


class Renderer:
    def __init__(self, description):
        self.description = description
        self.scenes = {}
        self.warm = set()

    def scene(self, sampler, roulette):
        """The scene with one shape per material: the fewer objects Mitsuba has to tell apart, the faster it
        is."""
        key = (sampler, roulette)
        if key not in self.scenes:
            d = self.description
            parts = {
                "type": "scene",
                # No roulette: it starts where no path gets to. Mitsuba's depth counts the emitter,
                # max_depth of crt does not.
                "integrator": {
                    "type": "path",
                    "max_depth": d["max_depth"] + 1,
                    "rr_depth": roulette if roulette else 1_000_000,
                },
                "sensor": {
                    "type": "perspective",
                    "fov": d["fov_degrees"],
                    "fov_axis": "x",
                    "near_clip": 1.0,
                    "far_clip": 1e5,
                    "to_world": mi.ScalarTransform4f().look_at(
                        origin=d["position"], target=d["target"], up=d["up"]
                    ),
                    "film": {
                        "type": "hdrfilm",
                        "width": d["size"],
                        "height": d["size"],
                        "pixel_format": "xyz",
                        "component_format": "float32",
                        "rfilter": {"type": "box"},
                    },
                    "sampler": {"type": sampler, "sample_count": 16},
                },
            }
            for name, part in d["parts"].items():
                shape = {"type": "ply", "filename": part["ply"], "face_normals": True,
                         "bsdf": {"type": "diffuse", "reflectance": spectrum(part["reflectance"])}}
                if "radiance" in part:
                    shape["emitter"] = {"type": "area", "radiance": spectrum(part["radiance"])}
                parts[name] = shape
            self.scenes[key] = mi.load_dict(parts)
        return self.scenes[key]

    def image(self, scene, spp, seed):
        image = mi.render(scene, spp=spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return image

    def render(self, request):
        start = cpu_seconds()
        scene = self.scene(request["sampler"], request["roulette"])
        case = (request["sampler"], request["roulette"], request["spp"])
        if request.get("warm_up", True) and case not in self.warm:
            # Interpreted code has nothing to compile for each number of samples; it gets few, to touch the
            # caches.
            self.image(scene, 1 if mi.variant().startswith("scalar") else request["spp"], WARM_UP_SEED)
            self.warm.add(case)
        cpu, begin = cpu_seconds(), time.perf_counter()
        image = self.image(scene, request["spp"], request["seed"])
        seconds, cpu = time.perf_counter() - begin, cpu_seconds() - cpu
        pixels = np.array(image, dtype=np.float32)[:, :, :3]
        if request.get("image"):
            np.save(request["image"], pixels)
        return {
            "seconds": seconds,
            "cpu_seconds": cpu,
            "busy_seconds": cpu_seconds() - start,
            "spp": scene.sensors()[0].sampler().sample_count(),
            "mean": float(pixels[:, :, 1].mean(dtype=np.float64)),
            "finite": bool(np.isfinite(pixels).all()),
        }

    def describe(self):
        nm = np.arange(360, 831, dtype=np.float64)
        table = [[float(np.ravel(np.array(c))[0]) for c in mi.cie1931_xyz(float(w))] for w in nm]
        return {
            "mitsuba": mi.__version__,
            "drjit": dr.__version__,
            "numpy": np.__version__,
            "python": sys.version.split()[0],
            "variant": mi.variant(),
            "llvm": pathlib.Path(os.environ.get("DRJIT_LIBLLVM_PATH", "")).name,
            "threads": dr.thread_count() if hasattr(dr, "thread_count") else None,
            "y_normalization": float(mi.MI_CIE_Y_NORMALIZATION),
            "cie_min_nm": mi.MI_CIE_MIN,
            "cie_max_nm": mi.MI_CIE_MAX,
            "cie_xyz": table,
        }


def main():
    description = json.loads(pathlib.Path(sys.argv[1]).read_text())
    variant = sys.argv[2]
    mi.set_variant(variant)
    mi.set_log_level(
        mi.LogLevel.Error
    )  # Samplers warn when they round a sample count; the answer says what it became.
    renderer = Renderer(description)
    if len(sys.argv) > 3:  # One request, to time a whole process.
        print(json.dumps(renderer.render({**json.loads(sys.argv[3]), "warm_up": False})))
        return
    for line in sys.stdin:
        request = json.loads(line)
        answer = renderer.describe() if request["do"] == "describe" else renderer.render(request)
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
