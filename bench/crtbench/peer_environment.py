"""The requirements of bench/peers and bench/agree besides crt: a Python with mitsuba, numpy and PyYAML, for
the chart of bench/peers with matplotlib too, and an LLVM that Mitsuba's compiler accepts. Both are put into
out/ when they are missing; nothing of them is ever part of the product. The measurement then runs under that
Python."""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import venv

from .command import REPOSITORY, add_options, exit_code, program_for
from .program import Failure

PACKAGES = ["mitsuba==3.9.1", "numpy", "pyyaml", "matplotlib"]
OLDEST_LLVM = (
    17  # Older ones cannot select the instruction `fminimum` on x86, which Mitsuba's kernels contain.
)
LLVM_PACKAGE = "libllvm19"
READY = "PEERS_PYTHON_IS_READY"  # Set for the process that runs under the right Python.


def has_packages(python):
    return subprocess.run([python, "-c", "import mitsuba, numpy, yaml"], capture_output=True).returncode == 0


def python_with_mitsuba(wanted):
    """The Python that was asked for, this one, or that of out/peers-venv, made when it is missing."""
    if wanted:
        if not has_packages(wanted):
            raise Failure(
                f"'{wanted}' cannot import mitsuba, numpy and yaml: {wanted} -m pip install "
                f"{' '.join(PACKAGES)}"
            )
        return wanted
    if has_packages(sys.executable):
        return sys.executable
    folder = REPOSITORY / "out" / "peers-venv"
    python = str(folder / "bin" / "python")
    if not pathlib.Path(python).exists() or not has_packages(python):
        print(f"installing {', '.join(PACKAGES)} into {folder}", flush=True)
        venv.create(folder, with_pip=True)
        done = subprocess.run(
            [python, "-m", "pip", "install", "--quiet", *PACKAGES], capture_output=True, text=True
        )
        if done.returncode != 0:
            raise Failure(f"pip cannot install {', '.join(PACKAGES)}: {done.stderr.strip()[-500:]}")
    return python


def llvm_library():
    """An LLVM new enough for Mitsuba's llvm variants: the system's, or the Debian package unpacked into
    out/peers-llvm."""
    given = os.environ.get("DRJIT_LIBLLVM_PATH")
    if given:
        return given
    places = ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64"]
    folder = REPOSITORY / "out" / "peers-llvm"

    def newest():
        files = [
            p
            for place in [*places, *folder.glob("usr/lib/*")]
            for p in pathlib.Path(place).glob("libLLVM*.so*")
        ]
        found = sorted(
            (int(m[1]), str(p)) for p in files if (m := re.search(r"libLLVM(?:\.so\.|-)(\d+)", p.name))
        )
        return next((p for version, p in reversed(found) if version >= OLDEST_LLVM), None)

    if newest() is None:
        print(f"unpacking {LLVM_PACKAGE} into {folder}", flush=True)
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(
            f"apt-get download {LLVM_PACKAGE} && dpkg -x {LLVM_PACKAGE}_*.deb .",
            shell=True,
            cwd=folder,
            capture_output=True,
            text=True,
        )
        if done.returncode != 0 or newest() is None:
            raise Failure(
                f"Mitsuba's llvm variants need LLVM {OLDEST_LLVM} or newer; install {LLVM_PACKAGE} or name "
                f"one in DRJIT_LIBLLVM_PATH"
            )
    return newest()


def mitsuba_parser(prog, description, busy):
    """Of a bench command that runs under a Python with mitsuba; `busy` as in add_options()."""
    parser = argparse.ArgumentParser(
        prog=prog, description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_options(parser, busy=busy)
    parser.add_argument(
        "--python",
        help="a Python that has mitsuba, numpy and yaml; otherwise this one, or one that is made in "
             "out/peers-venv",
    )
    return parser


def main():
    parser = mitsuba_parser("bench/peers", __doc__, busy="a wall time is marked")
    parser.add_argument(
        "--seconds",
        type=float,
        default=600,
        help="about how long all of it may take, without making environments (600)",
    )
    parser.add_argument(
        "--replicates",
        type=int,
        default=8,
        help="renders with seeds of their own for each number of samples (8)",
    )
    parser.add_argument(
        "--samplers",
        nargs="+",
        default=["independent", "stratified", "multijitter", "orthogonal", "ldsampler"],
        help="Mitsuba's samplers of which the best is taken (all five)",
    )
    arguments = parser.parse_args()
    return exit_code("bench/peers", arguments, lambda: measure(arguments))


def under_mitsuba(tool, wanted):
    """Restarts bench/TOOL under a Python that has mitsuba, unless this one is it."""
    os.environ["DRJIT_LIBLLVM_PATH"] = llvm_library()
    if READY not in os.environ:
        python = python_with_mitsuba(wanted)
        os.execve(
            python, [python, str(REPOSITORY / "bench" / tool), *sys.argv[1:]], {**os.environ, READY: "1"}
        )


def measure(arguments):
    under_mitsuba("peers", arguments.python)
    from . import peers  # Needs what only the right Python has.
    return peers.measure(program_for(arguments), arguments)
