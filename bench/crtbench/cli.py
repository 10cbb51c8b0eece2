"""The command line: picks a measurement, brings the build up to date, writes what was seen."""
import argparse
import importlib
import os
import sys

from .command import add_options, exit_code, program_for

# Name: the module of this folder, and what the command does. A module has `measure(program, arguments)`, or
# `alone(arguments)` where it needs no build and prints what it finds; `options(parser)` adds what it
# understands, and `prepare(arguments)` comes before the build.
COMMANDS = {
    "same-bits": ("same_bits", "every scene, backend, number of threads and split: the same bits?"),
    "cpu-speed": ("cpu_speed", "paths and rays per second on the processor"),
    "gpu-speed": ("gpu_speed", "paths per second on a GPU"),
    "mitsuba-speed": ("mitsuba_speed_command", "paths per second and time to 1 % error, beside Mitsuba 3"),
    "race": ("race_command", "time to 1 % error of complex scenes, beside Mitsuba 3"),
    "agree": ("agree_command", "scenes translated for Mitsuba 3: do both converge to the same image?"),
    "mtl-agreement": ("mtl_agreement", "the same OBJ and MTL in crt and in Mitsuba 3: the same luminance?"),
    "start": ("start", "what it costs to begin: process, libraries, kernels"),
    "leave-out": ("leave_out", "what leaving features out of the kernel saves, feature by feature"),
    "accelerators": ("accelerators", "loop, object boxes and BVH; from how many triangles on the BVH wins"),
    "instances": ("instances", "one mesh in ten thousand places: memory, time, rays, bits"),
    "lamps": ("lamps", "a thousand lamps, rendered by several builds of crt in turn"),
    "view": ("view", "pictures a second of crt view"),
    "cluster-overhead": ("cluster_overhead", "a Dask cluster on one machine beside one render"),
    "cluster-simulation": ("cluster_simulation", "a thousand Dask workers that sleep instead of rendering"),
    "stability": ("stability", "sweeps to where the arithmetic ends; --scenes names sweeps"),
    "robustness": ("robustness", "what the watertight test and exact offsets cost and gain"),
    "calibration": ("calibration", "does the error that an image states hold? Many seeds of fifteen scenes"),
    "false-alarms": ("false_alarms", "statements of crt converge on data of known truth: how many fail?"),
    "power": ("power", "planted faults: how many seconds until a check finds each"),
    "meshes": ("meshes", "OBJ files of other people, in folders: which render, which are refused and why"),
    "assets": ("assets", "models and scenes of other people: which render, which are refused and why"),
    "paper": ("paper_command", "the tables and figures of the paper that crt grew out of"),
    "pictures": ("pictures", "all scenes as PNG in out/pictures, to look at; measures nothing"),
}


def parser_of(name):
    """(the parser, the module of the command `name`, if it is one). Only that module is loaded: some need
    libraries that others can do without."""
    parser = argparse.ArgumentParser(
        prog="bench/run",
        description="Measures crt: all of it in out/bench, and the command's section of docs/results.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    chosen = None
    for command, (module_name, text) in COMMANDS.items():
        sub = commands.add_parser(command, help=text.replace("%", "%%"),
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
        if command != name:
            continue
        try:
            chosen = importlib.import_module(f".{module_name}", __package__)
        except ImportError as error:
            sys.exit(f"bench/run {name}: {error}: see bench/README.md")
        sub.description = chosen.__doc__
        if not hasattr(chosen, "alone"):
            add_options(sub)
        if hasattr(chosen, "options"):
            chosen.options(sub)
        else:
            sub.add_argument("--scenes", nargs="*", help="only these scenes, by name without .yaml")
    return parser, chosen


def main():
    parser, module = parser_of(sys.argv[1] if len(sys.argv) > 1 else None)
    arguments = parser.parse_args()

    def measure():
        if hasattr(module, "alone"):
            return module.alone(arguments)
        if hasattr(module, "prepare"):
            module.prepare(arguments)
        return module.measure(program_for(arguments), arguments)

    try:
        return exit_code(f"bench/run {arguments.command}", arguments, measure)
    finally:
        sys.stdout.flush()
        os.sync()
