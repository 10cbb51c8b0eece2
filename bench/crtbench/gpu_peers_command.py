"""How fast are crt and Mitsuba 3 on one GPU? The shipped Cornell boxes, a ball under a sky and the scenes
of bench/race are rendered by both in one run: paths a second on a large image, and seconds until the error
of an image is 1 %. Times are those of rendering alone: scenes are loaded and kernels compiled before.

Needs a Python with mitsuba, numpy and PyYAML (--python)."""

from .command import exit_code, program_for
from .peer_environment import mitsuba_parser, under_mitsuba


def main():
    parser = mitsuba_parser("bench/gpu_peers", __doc__, busy="nothing happens")
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
    parser.add_argument("--renders", type=int, default=2, help="with seeds of their own for an error (2)")
    parser.add_argument("--target", type=float, default=0.01, help="error to reach, of the mean (0.01)")
    parser.add_argument("--most", type=int, default=16384, help="samples a pixel to give up after (16384)")
    parser.add_argument(
        "--reference-samples", type=int, default=1024, help="of eight renders of a converged image (1024)"
    )
    parser.add_argument(
        "--seconds", type=float, default=1e9, help="after which no further scene is begun (no limit)"
    )
    parser.add_argument("--scenes", nargs="*", help="only these, by name without .yaml")
    arguments = parser.parse_args()

    def measure():
        under_mitsuba("gpu_peers", arguments.python)
        from . import gpu_peers  # Needs what only the right Python has.
        return gpu_peers.measure(program_for(arguments), arguments)

    return exit_code("bench/gpu_peers", arguments, measure)
