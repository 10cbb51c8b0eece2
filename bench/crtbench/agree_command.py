"""Do crt and Mitsuba 3 converge to one image? Scenes of bench/scenes/agree, a kind of material, texture or
light each, are translated by a program (agree_scene.py) and rendered by both, several times with different
seeds. The verdict is an equivalence test: the mean luminance of the two differs by less than 0.5 %, with 95
% confidence, and in no tile of 8 × 8 do they differ, after the common factor, by more than 0.5 % of the
image's mean beyond what chance gives in one of 64 tiles (Šidák). Where the models differ on purpose, the
scene says how, and that is what is reported. Times nothing: it may run on a busy machine.

Needs a Python with mitsuba, numpy and PyYAML (--python), and an LLVM for Mitsuba's llvm variant."""

from .mitsuba_environment import add_python_option, under_mitsuba


def options(parser):
    add_python_option(parser)
    parser.add_argument(
        "--variant",
        default="llvm_ad_spectral",
        help="of Mitsuba; a spectral one (llvm_ad_spectral; cuda_ad_spectral with a GPU)",
    )
    parser.add_argument(
        "--backend", help="of crt (the first of cuda, embree and opencl that has a device)"
    )
    parser.add_argument(
        "--samples", type=int, default=256, help="per pixel of each render, in both programs (256)"
    )
    parser.add_argument("--renders", type=int, default=16, help="of each scene by each program (16)")
    parser.add_argument("--scenes", nargs="*", help="only these, by name without .yaml")


def prepare(arguments):
    under_mitsuba(arguments)


def measure(program, arguments):
    from . import agree  # Needs what only the right Python has.
    return agree.measure(program, arguments)
