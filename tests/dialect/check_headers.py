#!/usr/bin/env python3
"""Compiles every kernel header alone, in one of its languages, with everything in it and with nothing.

    check_headers.py cxx|cuda|opencl COMPILER KERNEL_FOLDER

Syntax and types only. A header that leans on another without including it, or that strays from the common
subset of C++17, CUDA C++ and OpenCL C 1.2, fails here with its name. Exit code 77, which ctest shows as
skipped, where the compiler is missing.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
WARNINGS = ["-Wall", "-Wextra", "-Wshadow", "-Werror", "-Wno-unused-function"]

# Suffix, then what makes the compiler only look.
LANGUAGES = {
    "cxx": (".cpp", ["-std=c++17", "-fsyntax-only", *WARNINGS]),
    "cuda": (
        ".cu",
        [
            "-std=c++17",
            "-arch=sm_90",
            "-ptx",
            "--fmad=false",
            "-Werror=all-warnings",
            "-diag-suppress=177",
            "-o",
            "/dev/null",
        ],
    ),
    # Run times define __OPENCL_VERSION__; a bare clang leaves it to them.
    "opencl": (
        ".cl",
        [
            "-x",
            "cl",
            "-cl-std=CL1.2",
            "-D__OPENCL_VERSION__=120",
            "-Xclang",
            "-finclude-default-header",
            "-fsyntax-only",
            *WARNINGS,
        ],
    ),
}


def main() -> int:
    if len(sys.argv) != 4 or sys.argv[1] not in LANGUAGES:
        print(__doc__, file=sys.stderr)
        return 2
    language, compiler, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    if not shutil.which(compiler):
        print(f"skipped: no compiler for {language} ('{compiler}')")
        return SKIPPED
    suffix, options = LANGUAGES[language]
    headers = sorted(folder.glob("*.h"))
    if not headers:
        print(f"no headers in {folder}", file=sys.stderr)
        return 1
    failed = []
    with tempfile.TemporaryDirectory() as scratch:
        for header in headers:
            # Twice, so that a missing include guard shows.
            unit = pathlib.Path(scratch) / (header.stem + suffix)
            unit.write_text(f'#include "kernel/{header.name}"\n#include "kernel/{header.name}"\n')
            for mask in ([], ["-DCRT_FEATURES=0ul"]):
                command = [compiler, *options, *mask, "-I", str(folder.parent), str(unit)]
                result = subprocess.run(command, capture_output=True, text=True, check=False)
                ok = result.returncode == 0
                print(
                    f"dialect_{header.stem}_{language}{' (no features)' if mask else ''}: "
                    f"{'ok' if ok else 'FAILED'}"
                )
                if not ok:
                    failed.append(header.name)
                    print(result.stdout + result.stderr)
    if failed:
        print(f"{len(failed)} of {2 * len(headers)} failed: {', '.join(dict.fromkeys(failed))}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
