"""Paths per second on a GPU: the shipped scenes at 1440 × 1440, and small images. Seconds are those of the
backend, kernels compiled before."""

from .program import Failure, Spread
from .results import Results

# (scene, pixels a side, samples a pixel): each takes about a second on one H100.
CASES = [("cornell_box", 1440, 768), ("cornell_figure", 1440, 256), ("cornell_dragon", 1440, 256),
         ("cornell_glass", 1440, 256), ("materials", 1440, 128), ("cornell_box", 256, 8192),
         ("cornell_box", 64, 65536), ("cornell_dragon", 256, 4096), ("materials", 256, 2048)]
TEXT = ("Five scattering events, Sobol points, no AOVs, roulette as in the scene; kernels come from the "
        "cache. A path is one sample of one pixel. Median of five runs, with the slowest and the fastest.")


def measure(program, arguments):
    if "cuda" not in (usable := program.backends(["cuda"]))[0]:
        raise Failure(usable[1]["cuda"])
    cases = [case for case in CASES if not arguments.scenes or case[0] in arguments.scenes]
    results = Results(program, arguments, "gpu-speed", "Speed on a GPU")
    rows = []
    for scene, size, samples in cases:
        side, spp = (size // 8, 16) if arguments.tiny else (size, samples)
        settings = [f"film.resolution=[{side},{side}]", "outputs.0.aovs=[]", "integrator.max_depth=5"]
        done = program.interleaved(
            {scene: lambda: program.render(scene, "cuda", ["--spp", spp, "--kernel", "lean-only"],
                                           settings=settings)},
            2 if arguments.tiny else 5,
        )[scene]
        rate = Spread(run.value("speed", "mpaths_per_second") for run in done)
        results.data[f"{scene} {side}"] = {"spp": spp, "mpaths_per_second": rate.json()}
        rows.append([f"`{scene}`", f"{side}²", f"{spp:,}", rate.text(4)])
        print(*rows[-1], flush=True)
    head = ["scene", "image", "samples", "million paths per second"]
    results.paragraph(TEXT)
    results.table(head, rows)
    results.claim("One H100 traces up to 1.4 billion paths per second", TEXT, head, rows)
    results.write()
