"""The Cornell box in crt and in Mitsuba 3: whether their images agree, and their error against time. One
run, one machine, everything interleaved.

The error of a setting with N samples is the root of the mean over pixels and renders of the squared
difference in luminance from a converged image, over the mean luminance; the converged image's own variance
is taken off. The spread between seeds would need no reference, but it is blind to what all seeds have in
common, and a low-discrepancy sampler that is scrambled alike for every seed has much of its error there."""

import json
import time

import numpy as np

from . import log_log, peer_agreement, peer_page, peer_scene
from .peer_error import Reference, relative_error
from .peer_lines import ROULETTE_FROM, SCENE, Crt, Mitsuba, Worker
from .results import Results

SIZE, MAX_DEPTH, TARGET = 128, 16, 0.01
COUNTS = [4, 16, 64, 128, 256, 512, 1024]
REFERENCE_SAMPLES = 1024  # Of each of its renders.
FEWEST_POOLED = 16  # Samples of a render that counts among the converged ones.
HEADLINE_WEIGHT, MATCHED_WEIGHT = (
    4,
    2,
)  # Of the time for measuring: with roulette, and without; the other lines have 1.


class Line:
    """One contestant: for every number of samples its renders' costs and their images' error."""

    def __init__(self, contestant, weight):
        self.contestant, self.weight = contestant, weight
        self.name = contestant.name
        self.points, self.spent, self.share = [], 0.0, 0.0

    def wants(self, spp):
        """True if `spp` still fits into this line's share, were it to cost in proportion to the last. Three
points are always needed."""
        if len(self.points) < 3:
            return True
        last = self.points[-1]
        return self.spent + last["elapsed"] * spp / last["asked"] <= self.share


def measure_round(lines, spp, replicates, seed_base, reference, pool_of):
    """R renders of every line, all in turn."""
    gathered = {line: {"costs": [], "images": [], "elapsed": 0.0} for line in lines}
    for r in range(replicates):
        for line in lines:
            begin = time.perf_counter()
            cost = line.contestant.render(spp, seed_base + 1000 * line.seed_block + r)
            data = gathered[line]
            data["elapsed"] += time.perf_counter() - begin
            data["images"].append(cost.image)
            data["costs"].append(cost)
            if spp >= FEWEST_POOLED:
                pool_of(line).add(cost.image, cost.spp)
            cost.image = None
    for line, data in gathered.items():
        errors = relative_error(data["images"], line.contestant.unit, reference)
        costs = data["costs"]
        line.points.append(
            {
                "asked": spp,
                "spp": costs[0].spp,
                **{name: e for name, (e, _) in errors.items()},
                **{f"{name}_se": se for name, (_, se) in errors.items()},
                "elapsed": data["elapsed"],
                "cpu_seconds": float(np.median([c.cpu for c in costs])),
                "render_seconds": float(np.median([c.render for c in costs])),
                "others": float(np.median([c.others for c in costs])),
                "cpu_seconds_all": [c.cpu for c in costs],
                "render_seconds_all": [c.render for c in costs],
            }
        )
        line.spent += data["elapsed"]
        p = line.points[-1]
        print(
            f"{line.name:42} {p['spp']:5} spp  {100 * p['error']:6.2f} %  spread {100 * p['spread']:6.2f} % "
            f" "
            f"{p['cpu_seconds']:7.3f} cpu s  {p['render_seconds']:7.3f} s  others {p['others']:.0%}",
            flush=True,
        )


def tournament(worker, unit, samplers, spp, replicates, reference):
    """Samplers of Mitsuba: {sampler: error² × CPU seconds, …}, least is best. With roulette, the
    cheaper way."""
    scores = {}
    for sampler in samplers:
        contestant = Mitsuba(worker, sampler, True, unit)
        costs = [contestant.render(spp, 5_000_000 + r) for r in range(replicates)]
        errors = relative_error([c.image for c in costs], unit, reference)
        error, spread = errors["error"][0], errors["spread"][0]
        cpu = float(np.median([c.cpu for c in costs]))
        scores[sampler] = {
            "spp": costs[0].spp,
            "error": error,
            "spread": spread,
            "cpu_seconds": cpu,
            "error2_seconds": error**2 * cpu,
        }
        print(
            f"{contestant.name:42} {costs[0].spp:5} spp  {100 * error:6.2f} %  spread {100 * spread:6.2f} % "
            f" "
            f"{cpu:7.3f} cpu s  error² × s {error**2 * cpu:.3g}",
            flush=True,
        )
    return scores


def measure(program, arguments):
    log_log.library()  # Of the page that is made at the end.
    begin = time.monotonic()
    size = 32 if arguments.tiny else SIZE
    results = Results(program, arguments, "peers", "crt and Mitsuba 3")
    results.tool = "bench/peers"
    scene = peer_scene.describe(
        program.repository / program.scene_file(SCENE), program.scratch, size, MAX_DEPTH
    )
    setup = {"size": size, "max_depth": MAX_DEPTH, "mitsuba": str(program.scratch / "mitsuba.json")}
    with open(setup["mitsuba"], "w") as file:
        json.dump(scene, file)
    crt_backends, _ = program.backends(["embree", "opencl", "cuda"])
    variants = ["llvm_ad_spectral", "scalar_spectral"] + (
        ["cuda_ad_spectral"] if "cuda" in crt_backends else []
    )
    workers = {v: Worker(program, v, setup) for v in variants}
    try:
        return run(program, arguments, results, scene, setup, crt_backends, workers, begin)
    finally:
        for worker in workers.values():
            worker.close()


def run(program, arguments, results, scene, setup, crt_backends, workers, begin):
    described = {v: w.ask({"do": "describe"}) for v, w in workers.items()}
    llvm = workers["llvm_ad_spectral"]
    unit = peer_agreement.predicted_ratios(program.repository, described["llvm_ad_spectral"], scene)[
        "mitsuba_over_crt_xyz_by_reflections"
    ][1][1]
    reference = Reference(Crt(program, "embree", 1, False, setup), REFERENCE_SAMPLES)
    print(
        f"reference of {reference.samples} samples: {100 * reference.error:.2f} % itself, which is taken "
        f"off",
        flush=True,
    )
    scores = tournament(llvm, unit, arguments.samplers, 64 if arguments.tiny else 256, 3, reference)
    best = min(scores, key=lambda sampler: scores[sampler]["error2_seconds"])
    lines = [
        Line(Crt(program, b, n, False, setup), MATCHED_WEIGHT if (b, n) == ("embree", 1) else 1)
        for b in crt_backends
        for n in (1, 2)
    ]
    lines += [
        Line(Crt(program, "embree", 1, True, setup), HEADLINE_WEIGHT),
        Line(Mitsuba(llvm, best, False, unit), MATCHED_WEIGHT),
        Line(Mitsuba(llvm, best, True, unit), HEADLINE_WEIGHT),
    ]
    lines += [Line(Mitsuba(w, best, True, unit), 1) for v, w in workers.items() if v != "llvm_ad_spectral"]
    for block, line in enumerate(lines, start=1):
        line.seed_block = block
        if isinstance(line.contestant, Crt):
            line.contestant.render(4, 9_000_000)  # Fills caches.
            line.contestant.learn_start(2)
    starts = {}
    for line in lines:
        if line.contestant.replicates == 1:
            starts[line.name] = {
                "cold": line.contestant.whole(16, True),
                "warm": [line.contestant.whole(16, False) for _ in range(3)],
            }

    print(f"started after {time.monotonic() - begin:.0f} s", flush=True)
    left = 0.92 * arguments.seconds - (time.monotonic() - begin)
    for line in lines:
        line.share = max(0.0, left) * line.weight / sum(other.weight for other in lines)
    pools = {"crt": peer_agreement.Pool(), "Mitsuba": peer_agreement.Pool()}
    for number, spp in enumerate(COUNTS, start=1):
        going = [line for line in lines if line.wants(spp)]
        if not going:
            break
        measure_round(
            going,
            spp,
            arguments.replicates,
            10_000_000 * number,
            reference,
            lambda line: pools[line.contestant.renderer],
        )
    return peer_page.write(
        program,
        results,
        arguments,
        {
            "setup": setup,
            "scene": scene,
            "described": described,
            "scores": scores,
            "lines": lines,
            "starts": starts,
            "pools": pools,
            "reference": reference,
            "target": TARGET,
            "roulette_from": ROULETTE_FROM,
        },
    )
