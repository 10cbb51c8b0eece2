"""Every scene as it is in the file, with the best backend there is, to out/pictures/*.png: to look at, not
to measure."""

def measure(program, arguments):
    folder = program.repository / "out" / ("tiny" if arguments.tiny else "pictures")
    folder.mkdir(parents=True, exist_ok=True)
    backend = program.backends(["cuda", "embree", "opencl"])[0][0]
    for scene in program.scenes(arguments.scenes):
        settings = ["film.resolution=[64,64]"] if arguments.tiny else []
        run = program.render(
            scene, backend, ["--spp", 4] if arguments.tiny else [], [folder / f"{scene}.png"], settings
        )
        print(
            f"{folder / scene}.png  {run.value('samples', 'per_pixel')} samples, "
            f"{run.value('seconds', 'render'):.1f} s with {backend}",
            flush=True,
        )
