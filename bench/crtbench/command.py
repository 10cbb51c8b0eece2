"""Shared parts of the commands of bench/run."""
import pathlib
import sys

from .program import Failure, Program

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def add_options(parser):
    parser.add_argument(
        "--build", type=pathlib.Path, default=REPOSITORY / "build", help="build folder (build)"
    )
    parser.add_argument(
        "--no-build",
        action="store_true",
        help="take the build as it is, instead of bringing it up to date first",
    )
    parser.add_argument(
        "--results",
        type=pathlib.Path,
        metavar="FOLDER",
        help="write everything there, and change no page of docs/results",
    )
    parser.add_argument(
        "--tiny",
        action="store_true",
        help="small images, few samples and runs: does the tool work? The numbers mean nothing and go to "
             "out/tiny",
    )
    parser.add_argument(
        "--busy",
        type=float,
        default=0.05,
        metavar="SHARE",
        help="repeat or mark a timed run when others took more than this share of the processor (0.05)",
    )


def program_for(arguments):
    """The build that was asked for, up to date."""
    program = Program(REPOSITORY, arguments.build.resolve(), arguments.busy)
    if not arguments.no_build:
        program.bring_up_to_date()
    return program


def exit_code(name, arguments, measure):
    """Of measure(), which says what is wrong by a Failure."""
    if getattr(arguments, "tiny", False):
        arguments.results = REPOSITORY / "out" / "tiny"
        arguments.busy = float("inf")
    try:
        return measure() or 0
    except Failure as failure:
        print(f"{name}: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
