"""The command line: picks a measurement, brings the build up to date, writes what was seen."""
import argparse
import os
import pathlib
import sys

from . import (
    accelerators,
    assets,
    calibration,
    cpu_speed,
    false_alarms,
    figure2,
    instances,
    leave_out,
    meshes,
    mtl_agreement,
    pictures,
    power,
    robustness,
    same_bits,
    stability,
    start,
)
from .command import add_options, exit_code, program_for

COMMANDS = {
    "same-bits": (
        same_bits,
        "every scene on every backend, thread count, tile size and split: do the bits agree?",
    ),
    "cpu-speed": (cpu_speed, "paths and rays per second on the processor"),
    "start": (start, "what it costs to begin: process, libraries, kernels"),
    "leave-out": (leave_out, "what leaving features out of the kernel saves, bit by bit"),
    "accelerators": (accelerators, "loop, object boxes and BVH; from how many triangles on the BVH wins"),
    "figure2": (figure2, "render time against samples per pixel, at 1440² and 2880²"),
    "instances": (instances, "one mesh in ten thousand places: memory, time, rays, bits"),
    "stability": (stability, "sweeps to where the arithmetic ends; --scenes names sweeps instead of scenes"),
    "robustness": (robustness, "what the watertight triangle test and the offsets cost, and what they buy"),
    "calibration": (
        calibration,
        "does the error that an image states of itself hold? 40 seeds of fifteen scenes, many numbers of "
        "samples",
    ),
    "false-alarms": (
        false_alarms,
        "statements of crt converge where the truth is known by construction: how often are they wrong?",
    ),
    "power": (power, "planted faults: how many seconds until a check finds each"),
    "meshes": (meshes, "OBJ files of other people, in folders: which render, which are refused and why"),
    "assets": (
        assets,
        "models and scenes of other people: which render, which are refused and why",
    ),
    "mtl-agreement": (
        mtl_agreement,
        "the same OBJ and MTL in crt and in Mitsuba 3: is the luminance the same?",
    ),
    "pictures": (pictures, "all scenes as PNG in out/pictures, to look at; measures nothing"),
}


def main():
    parser = argparse.ArgumentParser(
        prog="bench/run", description="Measures crt and writes docs/results/NAME.md and NAME.json."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (module, text) in COMMANDS.items():
        command = commands.add_parser(
            name, help=text, description=module.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        add_options(command, busy="a timed run is repeated")
        if name == "stability":
            command.add_argument(
                "--times",
                type=float,
                default=1,
                metavar="N",
                help="so many times the rays of each point (1); 5 makes 1e8 of offset-safety",
            )
        if name in ("calibration", "figure2", "stability"):
            command.add_argument("--rows", help="measurements made on another machine, JSON Lines")
        if name == "leave-out":
            command.add_argument(
                "--quick", action="store_true", help="three runs, and no registers from NVRTC"
            )
            command.add_argument(
                "--features",
                nargs="+",
                metavar="NAME",
                help="only these of core/kernel/dialect/features.h, such as THIN_FILM",
            )
            command.add_argument(
                "--backends",
                nargs="+",
                choices=["cuda", "opencl", "embree"],
                default=["cuda", "opencl", "embree"],
                metavar="NAME",
                help="only these",
            )
        if name == "meshes":
            command.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER",
                                 help="looked through for *.obj; named REPOSITORY@COMMIT")
            command.add_argument("--note", help="a paragraph for the page, about what is in the folders")
            continue
        if name == "assets":
            command.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER",
                                 help="looked through for models and scenes; named REPOSITORY@COMMIT")
            command.add_argument("--note", help="a paragraph for the page, about what is in the folders")
            command.add_argument("--pictures", type=pathlib.Path, metavar="FOLDER",
                                 help="keeps the images, and a sheet of them")
            continue
        if name == "mtl-agreement":
            command.add_argument(
                "--python",
                help="a Python that has mitsuba, numpy and yaml; otherwise this one, or one that is made in "
                     "out/peers-venv",
            )
            command.add_argument(
                "--samples", type=int, default=1024, help="per pixel, in both programs (1024)"
            )
            command.add_argument("folders", nargs="*", type=pathlib.Path, metavar="FOLDER",
                                 help="looked through for *.obj with an MTL; named REPOSITORY@COMMIT")
            command.add_argument(
                "--model-samples", type=int, default=256, help="as --samples, of the models (256)"
            )
            command.add_argument(
                "--view",
                action="append",
                default=[],
                type=mtl_agreement.named_view,
                metavar="NAME=X,Y,Z,X,Y,Z,FOV",
                help="camera of NAME.obj: where it is, what it looks at, degrees",
            )
            command.add_argument(
                "--pictures", type=pathlib.Path, metavar="FOLDER", help="PNGs of the models by both programs"
            )
            continue
        command.add_argument("--scenes", nargs="*", help="only these scenes, by name without .yaml")
    arguments = parser.parse_args()
    try:
        return exit_code(
            f"bench/run {arguments.command}",
            arguments,
            lambda: COMMANDS[arguments.command][0].measure(program_for(arguments), arguments),
        )
    finally:
        sys.stdout.flush()
        os.sync()
