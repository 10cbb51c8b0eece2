#!/usr/bin/env python3
"""The rooms of core/ and plugins/ and the arrows between them, as their CMakeLists.txt say them.

    tests/rooms/check_rooms.py                  exit code 1 when something goes against the arrows
    tests/rooms/check_rooms.py --build DIR      also looks at the include roots of a build tree
    tests/rooms/check_rooms.py --draw           the picture of docs/architecture.md
    tests/rooms/check_rooms.py --write          puts that picture there

The checks: only CMakeLists.txt and rooms lie directly in core/ and plugins/, and in plugins/ the backends;
every header lies in a room; every source file of a room is in its target; every include of another room's
header follows the arrows; no backend includes files of another; no target links a room outside crt_room();
an include root holds the headers of its own room alone; docs/architecture.md has the picture that --draw
makes. """

import argparse
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOTS = {"core": ROOT / "core", "plugins": ROOT / "plugins"}
PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- rooms: tests/rooms/check_rooms.py --write -->\n", "<!-- /rooms -->\n"
KEYWORDS = ("SOURCES", "USES", "LIBRARIES", "HEADERS")
# Files of a room's folder that other targets are made of.
OTHER_TARGETS = {
    "image/image_io_oiio.cpp",
    "image/image_io_plain.cpp",
    "image/png_codec.cpp",
    "image/exif_orientation.cpp",
    "image/icc_profile.cpp",
    "image/image_bounds.cpp",
    "image/exr_header.cpp",
    "image/exr_writer.cpp",
    "image/image_io_exr.cpp",
    "image/png_header.cpp",
    "image/jpeg_reader.cpp",
    "image/jpeg_writer.cpp",
    "image/png_reader.cpp",
    "image/radiance_reader.cpp",
    "image/tga_reader.cpp",
    "backend/sdk/compile_message.cpp",
    "backend/sdk/compile_process.cpp",
    "backend/sdk/kernel_cache.cpp",
    "cli/main.cpp",
}


# Folders that are not rooms, and the room that they are linked to (libcrt).
BESIDE = {"api": "render"}
# Folders of plugins/ that are not rooms, and the room that they are linked to.
BACKENDS = {"embree": "backend/sdk", "opencl": "gpu", "cuda": "gpu"}


class Room:
    def __init__(self, root, folder, comment, words):
        self.root, self.folder, self.comment = root, folder, comment
        self.parts = {k: [] for k in KEYWORDS}
        part = None
        for word in words:
            if word in KEYWORDS:
                part = self.parts[word]
            elif part is not None:
                part.append(word)

    @property
    def path(self):
        return ROOTS[self.root] / self.folder

    @property
    def name(self):
        return self.folder if self.root == "core" else f"{self.root}/{self.folder}"

    @property
    def uses(self):
        return self.parts["USES"]


def target_of(folder):
    """The CMake target of a room, and the name of its include root."""
    return "crt_" + folder.replace("/", "_")


def read_rooms():
    """Rooms in the order of the files, which is that of the data."""
    rooms = {}
    for root, path in ROOTS.items():
        text = (path / "CMakeLists.txt").read_text()
        for match in re.finditer(r"((?:^# .*\n)*)^crt_room\(([^)]*)\)", text, re.MULTILINE):
            comment = " ".join(line[2:] for line in match.group(1).splitlines())
            folder, *words = match.group(2).split()
            rooms[folder] = Room(root, folder, comment, words)
    return rooms


def seen_from(rooms, folder):
    """The rooms whose headers a room sees: those that it uses, those that these use, and so on."""
    seen, waiting = set(), list(rooms[folder].uses)
    while waiting:
        room = waiting.pop()
        if room not in seen:
            seen.add(room)
            waiting += rooms[room].uses
    return seen


def room_of(rooms, header):
    """The room of "film/film.h", or None for a header of no room."""
    folder = str(pathlib.PurePosixPath(header).parent)
    if not any((path / header).is_file() for path in ROOTS.values()):
        return None
    for name, room in rooms.items():
        if header in room.parts["HEADERS"]:
            return name
    return folder if folder in rooms else None


def files_of(*suffixes):
    """(root, path, its name from there) of each file below the roots."""
    for root, path in ROOTS.items():
        for file in sorted(path.rglob("*")):
            if file.suffix in suffixes:
                yield root, file, file.relative_to(path)


def check_sources(rooms):
    for root, path in ROOTS.items():
        for entry in sorted(path.iterdir()):
            if entry.is_file() and entry.name != "CMakeLists.txt":
                yield f"{root}/{entry.name} lies outside every room"
    for root, file, name in files_of(".h", ".cpp"):
        folder = str(name.parent)
        if folder in BESIDE or folder.startswith("include/"):
            continue
        if root == "plugins" and name.parts[0] in BACKENDS:
            continue
        if folder not in rooms or rooms[folder].root != root:
            yield f"{root}/{name} lies outside every room"
        elif file.suffix == ".cpp" and not (
            file.name in rooms[folder].parts["SOURCES"] or str(name) in OTHER_TARGETS
        ):
            yield f"{root}/{name} is in no target"


def check_includes(rooms):
    linked = {**BESIDE, **BACKENDS}
    for root, file, name in files_of(".h", ".cpp"):
        folder = str(name.parent)
        if str(name) in OTHER_TARGETS:
            continue  # Other targets say what they see themselves.
        if folder not in linked and folder not in rooms:
            continue
        room = linked.get(folder, folder)
        seen = seen_from(rooms, room) | {room}
        for number, line in enumerate(file.read_text().splitlines(), 1):
            match = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
            if not match:
                continue
            target = room_of(rooms, match.group(1))
            first = pathlib.PurePosixPath(match.group(1)).parts[0]
            if target is None and root == "plugins" and first in {"..", *BACKENDS} - {folder}:
                target = match.group(1)
            if target is not None and target not in seen:
                yield f"{root}/{name}:{number}: {folder} does not use {target}"


def check_links(rooms):
    """crt_room() is the only place where rooms are linked to rooms."""
    targets = {target_of(folder): folder for folder in rooms}
    for root, path in ROOTS.items():
        text = (path / "CMakeLists.txt").read_text()
        for match in re.finditer(r"target_link_libraries\((\w+)([^)]*)\)", text):
            if match.group(1) not in targets:
                continue
            for word in match.group(2).split():
                if word in targets:
                    yield f"{root}/CMakeLists.txt links {word} to {match.group(1)} outside crt_room()"


def check_roots(rooms, build):
    for folder, room in rooms.items():
        root = build / "rooms" / target_of(folder)
        wanted = {f"{folder}/{header.name}" for header in room.path.glob("*.h")} | set(room.parts["HEADERS"])
        found = {str(h.relative_to(root)) for h in root.rglob("*.h")} if root.is_dir() else set()
        for header in sorted(found ^ wanted):
            yield f"{root.relative_to(build)}: {'has' if header in found else 'lacks'} {header}"


def draw(rooms):
    """Reading order from top to bottom; to the right what a room uses directly."""
    width = max(len(room.name) for room in rooms.values())
    lines = ["```text"]
    for folder, room in rooms.items():
        # Rooms that another of its rooms already uses are not drawn again.
        direct = [u for u in room.uses if not any(u in seen_from(rooms, v) for v in room.uses if v != u)]
        lines.append(f"{room.name:<{width}}  →  {', '.join(direct)}".rstrip(" →"))
        lines += [f"{name:<{width}}  →  {linked}" for name, linked in BESIDE.items() if linked == folder]
    for name, linked in BACKENDS.items():
        lines.append(f"{'plugins/' + name:<{width}}  →  {rooms[linked].name}")
    return "\n".join(lines) + "\n```\n"


def page_with(picture):
    text = PAGE.read_text()
    if BEGIN not in text or END not in text:
        return None
    before, rest = text.split(BEGIN, 1)
    return before + BEGIN + picture + END + rest.split(END, 1)[1]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--build", type=pathlib.Path)
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()

    rooms = read_rooms()
    if arguments.draw:
        print(draw(rooms), end="")
        return 0
    if arguments.write:
        PAGE.write_text(page_with(draw(rooms)))
        return 0
    complaints = [*check_sources(rooms), *check_includes(rooms), *check_links(rooms)]
    if arguments.build:
        complaints += check_roots(rooms, arguments.build)
    if page_with(draw(rooms)) != PAGE.read_text():
        complaints.append("docs/architecture.md shows other rooms: run tests/rooms/check_rooms.py --write")
    for complaint in complaints:
        print(complaint)
    print(f"{len(rooms)} rooms, {len(complaints)} complaints")
    return 1 if complaints or not rooms else 0


if __name__ == "__main__":
    sys.exit(main())
