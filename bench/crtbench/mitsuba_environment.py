"""The environment of the comparisons with Mitsuba 3: a Python with mitsuba, numpy and PyYAML, and an LLVM
that Mitsuba's compiler accepts. Both are put into out/ when they are missing; nothing of them is ever part
of the product. The measurement then runs under that Python."""

import os
import pathlib
import re
import subprocess
import sys
import venv

from .command import REPOSITORY
from .program import Failure

PACKAGES = ["mitsuba==3.9.1", "numpy", "pyyaml"]
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


def add_python_option(parser):
    parser.add_argument(
        "--python",
        help="a Python that has mitsuba, numpy and yaml; otherwise this one, or one that is made in "
             "out/peers-venv",
    )


def under_mitsuba(arguments):
    """Starts bench/run again under a Python that has mitsuba, unless this one is it."""
    os.environ["DRJIT_LIBLLVM_PATH"] = llvm_library()
    if READY not in os.environ:
        python = python_with_mitsuba(arguments.python)
        os.execve(
            python, [python, str(REPOSITORY / "bench" / "run"), *sys.argv[1:]], {**os.environ, READY: "1"}
        )
