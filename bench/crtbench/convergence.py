"""Error against samples and time of the Cornell box with Sobol and with independent samples, against a long reference with another seed."""
from .program import Spread, significant
from .results import Results

SCENE = "cornell_box"
SEEDS = [1, 2, 3, 4, 5]
REFERENCE_SEED = 1000


def measure(program, arguments):
    size, reference_spp = (24, 64) if arguments.tiny else (200, 16384)
    counts = [1, 4] if arguments.tiny else [1, 4, 16, 64, 256, 1024]
    usable, absent = program.backends(["embree", "opencl"])
    backend = usable[0]
    results = Results(program, arguments, "convergence", "Error against time")
    settings = [f"film.resolution=[{size},{size}]", "outputs.0.aovs=[]"]
    reference = program.scratch / "reference.pfm"
    program.render(SCENE, backend, ["--spp", reference_spp, "--seed", REFERENCE_SEED], [reference], settings)

    data, rows = {}, []
    for spp in counts:
        row, rmse = [spp], {}
        for sampler in ("sobol", "independent"):
            errors, relative = [], []
            image = program.scratch / "image.pfm"
            for seed in SEEDS:
                program.render(SCENE, backend, ["--spp", spp, "--seed", seed], [image], [*settings, f"sampler.type={sampler}"])
                metrics = program.compare(image, reference)["metrics"]
                errors.append(metrics["rmse"])
                relative.append(metrics["relmse"])
            rmse[sampler] = Spread(errors), Spread(relative)
        timed = program.interleaved({sampler: lambda sampler=sampler: program.render(SCENE, backend, ["--spp", spp], settings=[*settings, f"sampler.type={sampler}"])
                                     for sampler in ("sobol", "independent")}, 2 if arguments.tiny else 5)
        data[spp] = {}
        for sampler, done in timed.items():
            seconds = Spread(r.value("seconds", "render") for r in done)
            data[spp][sampler] = {"rmse": rmse[sampler][0].json(), "relmse": rmse[sampler][1].json(), "render_seconds": seconds.json()}
            row += [seconds.text(), rmse[sampler][0].text(), significant(rmse[sampler][1].median)]
        # Time for the same error, as error falls with the root of time for independent samples.
        ratio = rmse["independent"][0].median / rmse["sobol"][0].median
        times = {s: data[spp][s]["render_seconds"]["median"] for s in timed}
        data[spp]["independent_over_sobol"] = {"rmse": ratio, "time_to_equal_error": ratio**2 * times["independent"] / times["sobol"]}
        row += [significant(ratio), significant(data[spp]["independent_over_sobol"]["time_to_equal_error"])]
        rows.append(row)
        print(row, flush=True)
    results.paragraph(f"`{SCENE}` at {size} × {size} with {backend}, otherwise as in the file. RMSE over all pixels and channels, the lamp included, against {reference_spp} Sobol samples "
                      f"with another seed; median of {len(SEEDS)} seeds, in brackets the least and the most. Render seconds: median of 5 interleaved runs. The last column: how "
                      "many times longer independent samples take to Sobol's error of that row, were they to go on with the inverse root of time.")
    results.table(["samples", *(f"{s}, {what}" for s in ("Sobol", "independent") for what in ("s", "RMSE", "relMSE")), "RMSE, independent : Sobol",
                   "time to Sobol's error, independent : Sobol"], rows)
    results.command(f"crt render configs/{SCENE}.yaml --backend {backend} --spp N --seed SEED --set 'film.resolution=[{size},{size}]' --set 'outputs.0.aovs=[]' "
                    "--set sampler.type=sobol|independent -o image.pfm")
    results.command("crt compare --json image.pfm reference.pfm")
    results.data = {"scene": SCENE, "size": size, "backend": backend, "reference_spp": reference_spp, "by_samples": data}
    results.write()
