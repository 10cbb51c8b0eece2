"""Does the error that an image states of itself hold? 400 renders of each scene that differ in nothing but the seed, each a crt process: how often does
the report's 95 % interval of the mean luminance cover the truth, is the predicted relative RMSE the real one, and how often is an image that
`--target-error` stopped really that good? Truths are closed forms, deterministic quadrature, or a long render by the independent sampler with a seed that no
repeat has. Times nothing: it may run on a busy machine, two processes on each core. What needs many samples runs on a GPU where there is one; on a
processor the Cornell box's target alone takes 400 times 15 s of one core."""
import array
import concurrent.futures
import json
import math
import os
import statistics
import struct

from .program import Failure, significant
from .results import Results

REPEATS = 400
REFERENCE_SEED = 1_000_003
TARGET = 0.01
# Luminance, and whence; the first is the form factor that configs/analytic/direct_light.yaml derives.
TRUTHS = {"analytic/direct_light": (0.2394564705, "closed form"), "analytic/cube": (0.197441, "quadrature"),
          "analytic/furnace": (2 * (1 - 0.5**9), "closed form"), "cornell_box": (None, "long render")}
SETTINGS = {"analytic/furnace": ["film.resolution=[1,1]"], "cornell_box": ["film.resolution=[32,32]", "outputs.0.aovs=[]"]}
SAMPLES = {"analytic/direct_light": 1024, "analytic/cube": 1024, "analytic/furnace": 1024, "cornell_box": 512}
# On a processor the last, of 2^18 samples, takes ten hours: it is left to a GPU.
TARGETS = [(scene, sampler) for scene in ("analytic/direct_light", "analytic/cube", "cornell_box") for sampler in ("sobol", "independent")]


def luminances(path):
    """Mean Y of each pixel of a .crtfilm (core/checkpoint.h), and the variance of each mean if its samples are independent."""
    data = path.read_bytes()
    header_bytes, = struct.unpack_from("<I", data, 12)
    width, height, channels, _ = struct.unpack_from("<4I", data, 32)
    sums_bytes = width * height * channels * 16
    sums = array.array("d", data[header_bytes:header_bytes + sums_bytes])
    counts = array.array("Q", data[header_bytes + sums_bytes:header_bytes + sums_bytes + width * height * 8])
    means, variances = [], []
    for pixel, n in enumerate(counts):
        y, y_squared = (sum(sums[(pixel * channels + c) * 2:(pixel * channels + c) * 2 + 2]) / n for c in (1, 3))
        means.append(y)
        variances.append(max(0.0, y_squared - y * y) / (n - 1))
    return means, variances


def binomial_tail(hits, trials, probability):
    """P(X ≥ hits)."""
    return math.fsum(math.comb(trials, k) * probability**k * (1 - probability)**(trials - k) for k in range(hits, trials + 1))


def clopper_pearson(hits, trials, confidence=0.95):
    """Exact interval of a proportion (Clopper and Pearson 1934)."""
    def root(function):
        low, high = 0.0, 1.0
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if function(middle) < 0 else (low, middle)
        return (low + high) / 2

    alpha = (1 - confidence) / 2
    lower = 0.0 if hits == 0 else root(lambda p: binomial_tail(hits, trials, p) - alpha)
    upper = 1.0 if hits == trials else root(lambda p: binomial_tail(hits + 1, trials, p) - (1 - alpha))
    return lower, upper


class Truth:
    """Luminance of each pixel, with the variance of what is known of it; zero where it is known exactly."""

    def __init__(self, pixels, variances=None):
        self.pixels, self.variances = pixels, variances or [0.0] * len(pixels)
        self.mean = statistics.fmean(pixels)
        self.relative_rmse = math.sqrt(statistics.fmean(self.variances)) / self.mean
        self.mean_error = math.sqrt(math.fsum(self.variances)) / len(pixels) / self.mean


def long_render(program, scene, backend, samples, threads):
    film = program.scratch / "truth.crtfilm"
    arguments = ["render", program.scene_file(scene), "--backend", backend, "--quiet", "--report", "none", "-o", film, "--spp", samples, "--seed", REFERENCE_SEED,
                 "--set", "sampler.type=independent", *threads]
    for setting in SETTINGS.get(scene, []):
        arguments += ["--set", setting]
    program.start(arguments)
    return Truth(*luminances(film))


def one_repeat(program, scene, sampler, backend, seed, stop, truth):
    """A render: what it says of itself, and what is so."""
    film, report = (program.scratch / f"{scene.replace('/', '-')}-{sampler}-{seed}.{kind}" for kind in ("crtfilm", "json"))
    arguments = ["render", program.scene_file(scene), "--backend", backend, "--quiet", "--report", report, "-o", film, "--seed", seed, *stop,
                 "--set", f"sampler.type={sampler}", *(["-t", 1] if backend == "embree" else [])]
    for setting in SETTINGS.get(scene, []):
        arguments += ["--set", setting]
    program.start(arguments)
    said, pixels = json.loads(report.read_text()), luminances(film)[0]
    film.unlink()
    error = said["error"]
    actual = math.sqrt(statistics.fmean((a - b) ** 2 for a, b in zip(pixels, truth.pixels))) / truth.mean
    lower, upper = error["mean_luminance_95"]
    judged = error.get("verdict")
    return {"seed": seed, "samples": said["samples"]["per_pixel"], "mean": statistics.fmean(pixels), "covered": lower <= truth.mean <= upper, "predicted": error["relative_rmse"],
            "actual": actual, "half_width": error["half_width_95"], "within_half_width": actual <= error["half_width_95"],
            "judged_half_width": judged["half_width_95"] if judged else None}


def repeats(program, scene, sampler, backend, stop, truth, count):
    workers = 2 * os.cpu_count() if backend == "embree" else 8
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        rows = list(pool.map(lambda seed: one_repeat(program, scene, sampler, backend, seed, stop, truth), range(1, count + 1)))
    print(f"{scene} {sampler} {' '.join(map(str, stop))} on {backend}: {sum(r['covered'] for r in rows)} of {count} cover, "
          f"{sum(r['actual'] <= TARGET for r in rows)} within {TARGET:.0%}", flush=True)
    return rows


def proportion(hits, trials):
    lower, upper = clopper_pearson(hits, trials)
    return f"{hits / trials:.1%} ({lower:.1%} – {upper:.1%})"


def root_mean_square(values):
    return math.sqrt(statistics.fmean(v * v for v in values))


def prediction(rows, truth):
    """Predicted over actual RMSE, root mean square over the repeats, the truth's own error taken off the actual one; with the standard error of the
    ratio, from the spread of both among the repeats."""
    actual = [r["actual"] ** 2 - truth.relative_rmse**2 for r in rows]
    predicted = [r["predicted"] ** 2 for r in rows]
    ratio = math.sqrt(statistics.fmean(predicted) / statistics.fmean(actual))
    # Delta method: the relative error of the root of a quotient is half that of the quotient.
    residuals = [p / statistics.fmean(predicted) - a / statistics.fmean(actual) for p, a in zip(predicted, actual)]
    return ratio, ratio * 0.5 * statistics.stdev(residuals) / math.sqrt(len(rows))


def measure(program, arguments):
    count = 8 if arguments.tiny else REPEATS
    usable, absent = program.backends(["cuda", "embree"])
    if "embree" not in usable:
        raise Failure(f"the embree backend cannot run: {absent['embree']}")
    heavy = usable[0]
    scenes = arguments.scenes or list(TRUTHS)
    if unknown := set(scenes) - set(TRUTHS):
        raise Failure(f"nothing is known of {', '.join(sorted(unknown))}; there are {', '.join(TRUTHS)}")
    reference_samples = 1024 if arguments.tiny else 2**23 if heavy == "cuda" else 2**20
    truths = {scene: long_render(program, scene, heavy, reference_samples, []) if TRUTHS[scene][0] is None else Truth([TRUTHS[scene][0]]) for scene in scenes}

    results = Results(program, arguments, "calibration", "Does the stated error hold?")
    coverage, data = [], {"repeats": count, "coverage": [], "target": []}
    for scene in scenes:
        for sampler in ("sobol", "independent"):
            rows = repeats(program, scene, sampler, "embree", ["--spp", SAMPLES[scene]], truths[scene], count)
            ratio, ratio_error = prediction(rows, truths[scene])
            bias = statistics.fmean(r["mean"] for r in rows) / truths[scene].mean - 1
            bias_error = statistics.stdev(r["mean"] for r in rows) / truths[scene].mean / math.sqrt(count)
            covered, within = (sum(r[key] for r in rows) for key in ("covered", "within_half_width"))
            coverage.append([scene, sampler, SAMPLES[scene], f"{root_mean_square(r['actual'] for r in rows):.3%}", f"{ratio:.3f} ± {ratio_error:.3f}", proportion(covered, count),
                             proportion(within, count), f"{bias:+.3%} ± {math.hypot(bias_error, truths[scene].mean_error):.3%}"])
            data["coverage"].append({"scene": scene, "sampler": sampler, "samples": SAMPLES[scene], "covered": covered, "within_half_width": within, "clopper_pearson_95": clopper_pearson(covered, count),
                                     "predicted_over_actual": ratio, "predicted_over_actual_error": ratio_error, "rows": rows})
    stopped, left_to_a_gpu = [], False
    for scene, sampler in TARGETS:
        if scene not in scenes:
            continue
        if (scene, sampler) == ("cornell_box", "independent") and heavy != "cuda" and not arguments.tiny:
            left_to_a_gpu = True
            continue
        backend = heavy if scene == "cornell_box" else "embree"
        target = ["--target-error", f"{TARGET:g}", "--spp", 2**20]
        rows = repeats(program, scene, sampler, backend, ["--spp", 256] if arguments.tiny else target, truths[scene], count)
        within = sum(r["actual"] <= TARGET for r in rows)
        counts = statistics.multimode(r["samples"] for r in rows)
        stopped.append([scene, sampler, backend, f"{min(r['samples'] for r in rows)} / {counts[0]} / {max(r['samples'] for r in rows)}",
                        f"{root_mean_square(r['actual'] for r in rows):.3%}", f"{max(r['actual'] for r in rows):.3%}", proportion(within, count)])
        data["target"].append({"scene": scene, "sampler": sampler, "backend": backend, "within_target": within, "clopper_pearson_95": clopper_pearson(within, count), "rows": rows})

    results.paragraph(__doc__.replace("\n", " "))
    results.heading("Intervals")
    results.paragraph(f"{count} renders of each row, seeds 1 to {count}. *Covered*: the report's `error.mean_luminance_95` holds the truth; with {count} repeats 95 % appears as 93 to 97 % (95 % of "
                      "the time). *Within the half-width*: the image's root mean square error over its pixels is at most `half_width_95`. In brackets 95 % Clopper–Pearson intervals. "
                      "*Predicted : actual*: the report's `relative_rmse` over the real one, root mean squares over all repeats, ± one standard error. *Mean*: of all repeats, "
                      "off the truth.")
    results.table(["scene", "sampler", "samples", "relative RMSE", "predicted : actual", "covered", "within the half-width", "mean"], coverage)
    results.heading(f"`--target-error {TARGET:.0%}`")
    results.paragraph("Rendered until the image says that it is good enough. *Within*: its root mean square error over the pixels against the truth, relative to the mean, is at most "
                      f"{TARGET:.0%}; 93 % are promised.")
    results.table(["scene", "sampler", "backend", "samples: least / most often / most", "relative RMSE", "the worst", "within"], stopped)
    if left_to_a_gpu:
        results.paragraph("Not measured: `cornell_box` with independent samples, which takes a GPU.")
    for scene, truth in truths.items():
        if TRUTHS[scene][0] is None:
            results.paragraph(f"The truth of `{scene}`, 32 × 32 pixels: {reference_samples} independent samples a pixel on {heavy}, seed {REFERENCE_SEED}. Its own relative RMSE is {truth.relative_rmse:.3%}, taken "
                              f"off where predicted is divided by actual and left in elsewhere; of its mean, {truth.mean_error:.4%}.")
            data["truth"] = {"scene": scene, "samples": reference_samples, "relative_rmse": truth.relative_rmse, "mean_relative_error": truth.mean_error}
    results.command(f"crt render configs/SCENE.yaml --backend embree -t 1 --spp N --seed K --set sampler.type=sobol|independent --report report.json -o film.crtfilm")
    results.command(f"crt render configs/SCENE.yaml --backend BACKEND --target-error 1% --seed K --report report.json -o film.crtfilm")
    results.data = data
    results.write()
