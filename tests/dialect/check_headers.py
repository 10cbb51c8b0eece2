#!/usr/bin/env python3
"""Compiles every kernel header alone, in one of its languages, with everything in it and with nothing.

    check_headers.py cxx|cuda|opencl COMPILER ROOMS

Syntax and types only. COMPILER: of cuda, the library NVRTC, which compiles a header in a tenth of the time
that nvcc takes; nvcc compiles the kernel with everything in it in every build. ROOMS: the include roots of a
build tree (cmake/Rooms.cmake); a header is compiled with those that its room sees. So a header that uses
another without including it, that includes one of a later room, or that is not in the common subset of
C++17, CUDA C++ and OpenCL C 1.2, fails here with its name. Exit code 77, which ctest shows as skipped, where
the compiler is missing.
"""

import ctypes
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "rooms"))
import check_rooms  # noqa: E402

SKIPPED = 77
WARNINGS = ["-Wall", "-Wextra", "-Wshadow", "-Werror", "-Wno-unused-function"]

# Suffix, then what makes the compiler only look.
LANGUAGES = {
    "cxx": (".cpp", ["-std=c++17", "-fsyntax-only", *WARNINGS]),
    "cuda": (".cu", ["--std=c++17", "--gpu-architecture=sm_90", "--fmad=false", "--diag-suppress=177"]),
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


class Program:
    """A compiler that is a program."""

    def __init__(self, path):
        self.path = path

    def compile(self, unit, options):
        """(True if it compiles, what the compiler says)"""
        command = [self.path, *options, str(unit)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        return result.returncode == 0, result.stdout + result.stderr


class Nvrtc:
    """NVRTC, a compiler that is a library."""

    def __init__(self, path):
        self.library = ctypes.CDLL(path)

    def compile(self, unit, options):
        """(True if it compiles without a warning, what the compiler says)"""
        program = ctypes.c_void_p()
        arguments = [option.encode() for option in options]
        if self.library.nvrtcCreateProgram(ctypes.byref(program), unit.read_bytes(), unit.name.encode(), 0,
                                           None, None):
            raise SystemExit("NVRTC cannot create a program")
        ok = self.library.nvrtcCompileProgram(program, len(arguments),
                                              (ctypes.c_char_p * len(arguments))(*arguments)) == 0
        size = ctypes.c_size_t()
        self.library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
        log = ctypes.create_string_buffer(max(1, size.value))
        self.library.nvrtcGetProgramLog(program, log)
        self.library.nvrtcDestroyProgram(ctypes.byref(program))
        said = log.value.decode(errors="replace")
        return ok and not said, said


def compiler_of(language, path):
    """The compiler, or None where there is none."""
    if language != "cuda":
        return Program(path) if shutil.which(path) else None
    try:
        return Nvrtc(path)
    except OSError:
        return None


def main() -> int:
    if len(sys.argv) != 4 or sys.argv[1] not in LANGUAGES:
        print(__doc__, file=sys.stderr)
        return 2
    language, path, roots = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    compiler = compiler_of(language, path)
    if compiler is None:
        print(f"skipped: no compiler for {language} ('{path}')")
        return SKIPPED
    suffix, options = LANGUAGES[language]
    rooms = check_rooms.read_rooms()
    headers = [(room, header) for room in rooms if room.startswith("kernel/")
               for header in sorted(rooms[room].path.glob("*.h"))]
    if not headers:
        print("core/kernel has no headers", file=sys.stderr)
        return 1
    failed = []
    with tempfile.TemporaryDirectory() as scratch:
        for room, header in headers:
            seen = [f"-I{roots / check_rooms.target_of(folder)}"
                    for folder in (room, *check_rooms.seen_from(rooms, room))]
            # Twice, so that a missing include guard shows.
            unit = pathlib.Path(scratch) / (header.stem + suffix)
            unit.write_text(f'#include "{room}/{header.name}"\n' * 2)
            for mask in ([], ["-DCRT_FEATURES=0ul"]):
                ok, said = compiler.compile(unit, [*options, *mask, *seen])
                print(
                    f"dialect_{header.stem}_{language}{' (no features)' if mask else ''}: "
                    f"{'ok' if ok else 'FAILED'}"
                )
                if not ok:
                    failed.append(header.name)
                    print(said)
    if failed:
        print(f"{len(failed)} of {2 * len(headers)} failed: {', '.join(dict.fromkeys(failed))}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
