"""How soon is a small error in the light transport found? Three faults are planted, one at a time, in a
copy of the kernel that the OpenCL backend compiles while it runs (CRT_KERNEL_DIR); the Embree backend was
compiled before and stays sound. `crt compare --backends opencl,embree` then judges by other seeds alone, and
`crt verify` by answers known in closed form. Without a fault the same commands must pass, or finding it
means nothing. Seconds are of the whole process, kernels compiled again. A found fault is a verdict FAIL,
exit code 7."""

import json
import shutil
import statistics

from .program import Failure, children_seconds, significant
from .results import Results

LIMIT_SECONDS = 60
SEEDS = [1, 2]
ROULETTE = ["integrator.roulette=true", "integrator.roulette_depth=1", "integrator.max_depth=64"]


class Fault:
    def __init__(self, mutant, what, scene, why, samples, delta, case, settings=()):
        self.mutant, self.what, self.scene, self.why, self.samples, self.delta, self.case = (
            mutant,
            what,
            scene,
            why,
            samples,
            delta,
            case,
        )
        self.settings = ["outputs=[]", *settings]


FAULTS = [
    Fault(
        "03-pdf-one-percent",
        "density of a sampled light direction 1 % too high",
        "analytic/direct_light",
        "all its light is sampled light",
        1024,
        "0.2%",
        "square-light",
        ["film.resolution=[8,8]"],
    ),
    Fault(
        "04-mis-weight-one-percent",
        "MIS weight of what scattering finds 1 % too high",
        "analytic/furnace",
        "every wall glows, so both techniques find all light",
        64,
        "0.2%",
        "furnace",
    ),
    Fault(
        "05-roulette-without-compensation",
        "roulette without 1/p",
        "analytic/cube",
        "roulette from the first bounce, up to 64 bounces",
        256,
        "2%",
        "roulette",
        ["film.resolution=[8,8]", *ROULETTE],
    ),
]


class Check:
    """A command that should find a fault: its verdict, in words, and what it took."""

    def __init__(self, program, arguments, kernel, read):
        shutil.rmtree(program.scratch / "cache", ignore_errors=True)
        shutil.rmtree(program.scratch / "pocl", ignore_errors=True)
        cpu = children_seconds()
        run = program.start(
            arguments, codes=(0, 7), environment={"CRT_KERNEL_DIR": str(kernel)} if kernel else None
        )
        self.seconds, self.cpu_seconds = run.seconds, children_seconds() - cpu
        self.verdict, self.words = read(run)

    def json(self):
        return {
            "verdict": self.verdict,
            "words": self.words,
            "seconds": self.seconds,
            "cpu_seconds": self.cpu_seconds,
        }


def compare(program, fault, kernel, seed):
    arguments = [
        "compare",
        "--backends",
        "opencl,embree",
        program.scene_file(fault.scene),
        "--delta",
        fault.delta,
        "--spp",
        fault.samples,
        "--seed",
        seed,
        "-q",
    ]
    for setting in fault.settings:
        arguments += ["--set", setting]
    arguments.append("--json")

    def read(run):
        result = json.loads(run.output)["backends"][0]
        y = next(m for m in result["means"] if m["channel"] == "Y")
        lower, upper = y["interval"]
        return result["verdict"], f"mean Y {y['relative_difference']:+.2%} [{lower:+.2%}, {upper:+.2%}]"

    return Check(program, arguments, kernel, read)


def verify(program, fault, kernel):
    folder = program.scratch / "verify"

    def read(_run):
        case = json.loads((folder / "verify.json").read_text())["cases"][0]
        bad = next((o for o in case["outcomes"] if o["verdict"] in ("FAIL", "INCONCLUSIVE")), {})
        return case["verdict"].upper(), "; ".join(
            filter(None, [bad.get("physics"), bad.get("note")])
        ) or bad.get("what", "")

    return Check(
        program, ["verify", "--backend", "opencl", "--case", fault.case, "-q", "-o", folder], kernel, read
    )


def measure(program, arguments):
    usable, absent = program.backends(["opencl", "embree"])
    if absent:
        raise Failure(
            "needs both opencl and embree: "
            + "; ".join(f"{name}: {reason}" for name, reason in absent.items())
        )
    results = Results(program, arguments, "power", "Small faults are found")
    rows, data, failures = [], [], 0
    for fault in FAULTS:
        kernel = program.mutated_kernel(fault.mutant)
        found = [compare(program, fault, kernel, seed) for seed in SEEDS]
        sound = [compare(program, fault, None, seed) for seed in SEEDS]
        known, known_sound = verify(program, fault, kernel), verify(program, fault, None)
        slowest = max(c.seconds for c in [*found, known])
        ok = (
            all(c.verdict == "FAIL" for c in [*found, known])
            and all(c.verdict == "PASS" for c in [*sound, known_sound])
            and slowest <= LIMIT_SECONDS
        )
        failures += not ok
        for how, bad, good in (("compare", found, sound), (f"verify {fault.case}", [known], [known_sound])):
            rows.append(
                [
                    fault.what if how == "compare" else "",
                    how,
                    ", ".join(c.verdict for c in bad),
                    bad[0].words,
                    significant(statistics.median(c.seconds for c in bad)),
                    significant(statistics.median(c.cpu_seconds for c in bad)),
                    ", ".join(c.verdict for c in good),
                    good[0].words,
                ]
            )
            print(rows[-1], flush=True)
        data.append(
            {
                "fault": fault.mutant,
                "scene": fault.scene,
                "found": [c.json() for c in found],
                "sound": [c.json() for c in sound],
                "verify": known.json(),
                "verify_sound": known_sound.json(),
            }
        )
    worst = max(c["seconds"] for d in data for c in [*d["found"], d["verify"]])
    results.paragraph(__doc__.replace("\n", " "))
    results.paragraph(
        f"**{len(FAULTS) - failures} of {len(FAULTS)} faults are found by both commands, for all "
        f"{len(SEEDS)} seeds of `compare`, and nothing is found where there is none. The slowest of all "
        f"took "
        f"{worst:.1f} s.**"
    )
    results.claim(
        f"Small faults are found in seconds: {len(FAULTS) - failures} of {len(FAULTS)}",
        "Each fault is planted in a copy of the kernel that OpenCL compiles at run time; Embree stays "
        "sound. "
        "`crt compare` sees the two backends differ, `crt verify` knows the answer in closed form. Without "
        "the "
        "fault both commands pass. Seconds are of the whole process, with the kernels compiled.",
        ["fault", "command", "verdict", "seconds", "without the fault"],
        [[row[0], row[1], row[2], row[4], row[6]] for row in rows],
    )
    results.table(
        [
            "fault",
            "command",
            "verdict",
            "which says",
            "seconds",
            "CPU seconds",
            "without the fault",
            "which says",
        ],
        rows,
    )
    results.paragraph(
        "Where each fault matters: "
        + "; ".join(f"*{f.what}*: `{f.scene}`, {f.why}" for f in FAULTS)
        + f". `compare` has 16 renders by each backend; the interval is 99.9 % confident. `compare` ran "
          f"with "
          f"seeds {', '.join(map(str, SEEDS))}; words are those of the first, seconds "
        "the median. The faults are mutants in `tests/mutations/`."
    )
    for fault in FAULTS:
        results.command(
            f"CRT_KERNEL_DIR=FAULTY crt compare --backends opencl,embree configs/{fault.scene}.yaml --delta "
            f"{fault.delta} --spp {fault.samples} "
            + " ".join(f"--set '{s}'" for s in fault.settings)
        )
        results.command(f"CRT_KERNEL_DIR=FAULTY crt verify --backend opencl --case {fault.case}")
    results.data = {"limit_seconds": LIMIT_SECONDS, "faults": data}
    results.write()
    return 1 if failures else 0
