"""The command line: picks a measurement, brings the build up to date, writes what was seen."""
import argparse
import os
import pathlib
import sys

from . import accelerators, calibration, cpu_speed, figure2, leave_out, pictures, power, robustness, same_bits, stability, start
from .program import Program, Failure

COMMANDS = {
    "same-bits": (same_bits, "every scene on every backend, thread count, tile size and split: do the bits agree?"),
    "cpu-speed": (cpu_speed, "paths and rays per second on the processor"),
    "start": (start, "what it costs to begin: process, libraries, kernels"),
    "leave-out": (leave_out, "what leaving features out of the kernel saves, bit by bit"),
    "accelerators": (accelerators, "loop, object boxes and BVH; from how many triangles on the BVH wins"),
    "figure2": (figure2, "render time against samples per pixel, at 1440² and 2880²"),
    "stability": (stability, "sweeps to where the arithmetic ends; --scenes names sweeps instead of scenes"),
    "robustness": (robustness, "what the watertight triangle test and the offsets cost, and what they buy"),
    "calibration": (calibration, "does the error that an image states of itself hold? 400 repeats of each scene"),
    "power": (power, "planted faults: how many seconds until a check finds each"),
    "pictures": (pictures, "all scenes as PNG in out/pictures, to look at; measures nothing"),
}
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser(prog="bench/run", description="Measures crt and writes docs/results/NAME.md and NAME.json.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (module, text) in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=module.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
        command.add_argument("--build", type=pathlib.Path, default=REPOSITORY / "build", help="build folder (build)")
        command.add_argument("--no-build", action="store_true", help="take the build as it is, instead of bringing it up to date first")
        command.add_argument("--results", type=pathlib.Path, default=REPOSITORY / "docs" / "results", help="where results go (docs/results)")
        command.add_argument("--tiny", action="store_true",
                             help="small images, few samples and runs: does the tool work? The numbers mean nothing and go to out/tiny")
        command.add_argument("--busy", type=float, default=0.05, metavar="SHARE",
                             help="a timed run is repeated when other processes took more than this share of the processor (0.05)")
        if name == "stability":
            command.add_argument("--times", type=float, default=1, metavar="N", help="so many times the rays of each point (1); 5 makes 1e8 of offset-safety")
        if name in ("figure2", "stability"):
            command.add_argument("--rows", help="measurements made on another machine, JSON Lines")
        command.add_argument("--scenes", nargs="*", help="only these scenes, by name without .yaml")
    arguments = parser.parse_args()
    if arguments.tiny:
        arguments.results = REPOSITORY / "out" / "tiny"
        arguments.busy = float("inf")
    try:
        program = Program(REPOSITORY, arguments.build.resolve(), arguments.busy)
        if not arguments.no_build:
            program.bring_up_to_date()
        return COMMANDS[arguments.command][0].measure(program, arguments) or 0
    except Failure as failure:
        print(f"bench/run {arguments.command}: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        sys.stdout.flush()
        os.sync()
