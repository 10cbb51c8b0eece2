#!/usr/bin/env python3
"""An include against the arrows of the rooms is found by check_rooms.py, and does not compile.

    test_rooms.py COMPILER ROOMS

ROOMS: the include roots of a build tree (cmake/Rooms.cmake). """

import pathlib
import shutil
import subprocess
import sys
import tempfile

import check_rooms


def first_header(folder):
    return f"{folder}/{min(h.name for h in check_rooms.read_rooms()[folder].path.glob('*.h'))}"


def compiles(compiler, roots, seen, header):
    done = subprocess.run(
        [compiler, "-std=c++17", "-fsyntax-only", "-x", "c++", "-"]
        + [option for room in seen for option in ("-I", str(roots / check_rooms.target_of(room)))],
        input=f'#include "{header}"\n',
        capture_output=True,
        text=True,
    )
    missing = "No such file" in done.stderr or "file not found" in done.stderr
    assert done.returncode == 0 or missing, done.stderr
    return done.returncode == 0


def check_compiler(compiler, roots):
    """Of the rooms of the kernel, which have headers alone, each sees those that it uses and no other."""
    rooms = check_rooms.read_rooms()
    kernel = [room for room in rooms if room.startswith("kernel/")]
    assert len(kernel) > 1
    for room in kernel:
        seen = {room} | check_rooms.seen_from(rooms, room)
        for other in kernel:
            allowed = compiles(compiler, roots, seen, first_header(other))
            assert allowed == (other in seen), f"{room} {'sees' if allowed else 'does not see'} {other}"


def check_complaints():
    """An include against the arrows, a header between the rooms, and an include of another backend."""
    with tempfile.TemporaryDirectory() as name:
        for root, path in check_rooms.ROOTS.items():
            check_rooms.ROOTS[root] = pathlib.Path(shutil.copytree(path, pathlib.Path(name) / root))
        core, plugins = check_rooms.ROOTS["core"], check_rooms.ROOTS["plugins"]
        rooms = check_rooms.read_rooms()
        assert [*check_rooms.check_sources(rooms), *check_rooms.check_includes(rooms)] == []
        header = core / first_header("kernel/sampling")
        header.write_text(f'#include "{first_header("kernel/geometry")}"\n' + header.read_text())
        (core / "kernel" / "between.h").write_text("")
        (plugins / "gpu" / "gpu_device.h").write_text('#include "cuda/cuda_device.h"\n')
        (plugins / "embree" / "plugin.cpp").write_text('#include "gpu/gpu_device.h"\n')
        assert list(check_rooms.check_includes(rooms)) == [
            f"core/{header.relative_to(core)}:1: kernel/sampling does not use kernel/geometry",
            "plugins/embree/plugin.cpp:1: embree does not use gpu",
            "plugins/gpu/gpu_device.h:1: gpu does not use cuda/cuda_device.h",
        ]
        assert list(check_rooms.check_sources(rooms)) == ["core/kernel/between.h lies outside every room"]


if __name__ == "__main__":
    check_compiler(sys.argv[1], pathlib.Path(sys.argv[2]))
    check_complaints()
