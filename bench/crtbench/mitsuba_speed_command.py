"""How fast are crt and Mitsuba 3? The shipped Cornell boxes, a ball under a sky and the scenes
of `race` are rendered by both in one run: paths a second on a large image, and seconds until the error
of an image is 1 %. Times are those of rendering alone: scenes are loaded and kernels compiled before.

Needs a Python with mitsuba, numpy and PyYAML (--python)."""

from .mitsuba_environment import add_python_option, under_mitsuba


def options(parser):
    add_python_option(parser)
    parser.add_argument("--backend", default="cuda", help="of crt (cuda)")
    parser.add_argument(
        "--variant", default="cuda_ad_spectral", help="of Mitsuba, a spectral one (cuda_ad_spectral)"
    )
    parser.add_argument(
        "--samplers", nargs="+", default=["multijitter"], help="of Mitsuba; the best counts (multijitter)"
    )
    parser.add_argument("--size", type=int, default=1440, help="pixels a side for rates (1440)")
    parser.add_argument("--samples", type=int, default=256, help="a pixel for rates (256)")
    parser.add_argument("--runs", type=int, default=5, help="for rates (5)")
    parser.add_argument("--error-size", type=int, default=256, help="pixels a side for errors (256)")
    parser.add_argument("--renders", type=int, default=2, help="with separate seeds, for an error (2)")
    parser.add_argument("--target", type=float, default=0.01, help="error to reach, of the mean (0.01)")
    parser.add_argument("--most", type=int, default=16384, help="samples a pixel to give up after (16384)")
    parser.add_argument(
        "--reference-samples", type=int, default=1024, help="of eight renders of a converged image (1024)"
    )
    parser.add_argument(
        "--seconds", type=float, default=1e9, help="after which no further scene is begun (no limit)"
    )
    parser.add_argument("--scenes", nargs="*", help="only these, by name without .yaml")


def prepare(arguments):
    under_mitsuba(arguments)


def measure(program, arguments):
    from . import mitsuba_speed  # Needs what only the right Python has.
    return mitsuba_speed.measure(program, arguments)
