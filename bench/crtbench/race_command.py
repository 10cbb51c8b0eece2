"""How long do crt and other renderers take to an error of 1 %? Scenes of bench/scenes/race, translated as
for `agree`, are rendered by each in turn with growing numbers of samples until the error of the image is
below the target; the time between the last two numbers is interpolated, never extrapolated. Times are those
of rendering alone: scenes are loaded and kernels compiled before.

The error is the root of the mean over pixels and renders of the squared difference in luminance from the
program's own converged image, over the mean luminance; the variance of that image is taken off. Each program
is measured against itself, so that differences between the models do not count.

The others are Mitsuba 3 and, with --peers, Blender's Cycles and LuxCore, which have three colours instead of
spectra. --scenes may name those of bench/scenes/mitsuba_speed, too. --files takes scenes of Mitsuba, which
crt imports: with Mitsuba alone, and with crt's Python package in the build.

Needs a Python with mitsuba, numpy and PyYAML (--python), and an LLVM for Mitsuba's llvm variant."""

import pathlib

from .mitsuba_environment import add_python_option, under_mitsuba
from .program import Failure


def options(parser):
    add_python_option(parser)
    parser.add_argument(
        "--peers",
        nargs="+",
        default=["mitsuba"],
        choices=["mitsuba", "cycles", "luxcore"],
        help="the other renderers (mitsuba); each that is missing is installed into out/",
    )
    parser.add_argument(
        "--backends",
        nargs="+",
        default=["embree", "opencl"],
        help="of crt; each is a contestant (embree opencl)",
    )
    parser.add_argument(
        "--replicates",
        nargs="+",
        type=int,
        default=[2, 1],
        help="of crt's sampler; each is a contestant (2 1)",
    )
    parser.add_argument(
        "--variants",
        nargs="+",
        default=["llvm_ad_spectral"],
        help="of Mitsuba, spectral ones (llvm_ad_spectral; cuda_ad_spectral with a GPU)",
    )
    parser.add_argument(
        "--samplers",
        nargs="+",
        default=["independent", "multijitter", "ldsampler"],
        help="of Mitsuba; each is a contestant (independent multijitter ldsampler)",
    )
    parser.add_argument("--size", type=int, default=96, help="of the images, in pixels a side (96)")
    parser.add_argument("--renders", type=int, default=4, help="with separate seeds, per point (4)")
    parser.add_argument("--target", type=float, default=0.01, help="error to reach, of the mean (0.01)")
    parser.add_argument(
        "--most", type=int, default=16384, help="samples a pixel after which a contestant gives up (16384)"
    )
    parser.add_argument(
        "--reference-samples",
        type=int,
        default=1024,
        help="of each of the eight renders of a converged image (1024)",
    )
    parser.add_argument("--name", default="race", help="of the page in --results (race)")
    parser.add_argument("--scenes", nargs="*", help="only these, by name without .yaml")
    parser.add_argument(
        "--files",
        nargs="+",
        type=pathlib.Path,
        help="scenes of Mitsuba instead, XML; pixels in height are --size",
    )
    parser.add_argument(
        "--depth", type=int, default=16, help="of --files, the most scattering events of a path (16)"
    )


def prepare(arguments):
    if arguments.files and arguments.peers != ["mitsuba"]:
        raise Failure("--files are for Mitsuba alone")
    under_mitsuba(arguments)


def measure(program, arguments):
    from . import race  # Needs what only the right Python has.
    return race.measure(program, arguments)
