"""The experiments of the paper that crt grew out of, with today's crt: sums (Table 1), boxes of meshes
(Table 2), ways to find what a ray hits (Table 3), time against samples (Figure 2), the pictures (Figure 3),
and its remarks on the layout of data and on constant memory. Writes one page, docs/results/paper.md.

Where the build is not, on a machine with a GPU say, the portable tree and --write-rows measure; --rows makes
the page of what they wrote, here."""

import argparse
import pathlib

from .paper import PARTS

BACKENDS = ["cuda", "embree", "opencl"]


def names_of(known):
    """Reads "a,b"; what is not known is an error of the command line."""

    def read(text):
        names = [name for name in text.split(",") if name]
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(known)}")
        return names

    return read


def options(parser):
    parser.add_argument("--quick", dest="tiny", action="store_true", help="the same as --tiny")
    parser.add_argument(
        "--backends",
        type=names_of(BACKENDS),
        default=BACKENDS,
        metavar="NAME,…",
        help=f"of crt, for the renders ({','.join(BACKENDS)})",
    )
    parser.add_argument(
        "--parts",
        type=names_of(PARTS),
        default=list(PARTS),
        metavar="PART,…",
        help=f"only these of {','.join(PARTS)}",
    )
    parser.add_argument("--runs", type=int, default=5, help="timed ones of each case, after warm-up (5)")
    parser.add_argument(
        "--longest", type=float, default=16, metavar="S", help="a render of Figure 2 may take (16)"
    )
    parser.add_argument(
        "--longest-picture",
        type=float,
        default=120,
        metavar="S",
        help="a picture of Figure 3 may take (120)",
    )
    parser.add_argument(
        "--write-rows",
        type=pathlib.Path,
        metavar="FILE",
        help="measure, write what was measured as JSON Lines there and the pictures beside it, and no page",
    )
    parser.add_argument(
        "--rows",
        type=pathlib.Path,
        nargs="+",
        metavar="FILE",
        help="make the page of these, measured before, and measure nothing",
    )
    parser.add_argument("--note", help="a paragraph for the page, about the machine say")


def measure(program, arguments):
    # Not before the command line has been read: their errors are ours.
    from . import log_log, paper, paper_page

    if arguments.rows:
        rows = [row for file in arguments.rows for row in paper.read_rows(file)]
        folders = [file.parent for file in arguments.rows]
    else:
        if "figure2" in arguments.parts and not arguments.write_rows:
            log_log.library()  # Of the page that is made afterwards.
        folder = arguments.write_rows.resolve().parent if arguments.write_rows else program.scratch
        folder.mkdir(parents=True, exist_ok=True)
        rows, folders = paper.measure(program, arguments, folder), [folder]
    if arguments.write_rows and not arguments.rows:
        return 0
    return paper_page.write(program, arguments, rows, folders)
