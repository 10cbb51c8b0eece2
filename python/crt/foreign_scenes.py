"""Scenes of other renderers on a command line of the program: `crt scene.xml --spp 64`."""

import os
import pathlib
import subprocess
import sys
import tempfile

from .importers import command, is_foreign

# Waits until the process at the other end of its input has ended in any way, and removes the folder.
CLEANER = "import shutil, sys; sys.stdin.read(); shutil.rmtree(sys.argv[1], ignore_errors=True)"


def with_imported(arguments):
    """The arguments with a scene of another renderer, at their beginning or behind a command, as a scene of
    crt: imported into a folder that is removed when this process, or the program that takes its place, ends.
Without one they stay as they were. Raises crt.Error as import_scene."""
    at = 0 if arguments[:1] and os.path.isfile(arguments[0]) else 1
    if len(arguments) <= at or not is_foreign(arguments[at]) or not os.path.isfile(arguments[at]):
        return arguments
    return [*arguments[:at], imported(arguments[at]), *arguments[at + 1:]]


def imported(path):
    folder = tempfile.mkdtemp(prefix="crt-import-")
    remove_at_end(folder)
    name = os.path.basename(path).removesuffix(".gz")
    scene = os.path.join(folder, f"{pathlib.Path(name).stem}.yaml")
    command.main([path, "--output", scene])
    return scene


def remove_at_end(folder):
    """The program replaces this process, so that signals and exit codes are its own: another process waits
    for its end, which closes the pipe."""
    ours, theirs = os.pipe()
    os.set_inheritable(theirs, True)
    subprocess.Popen([sys.executable, "-c", CLEANER, folder], stdin=ours, stdout=subprocess.DEVNULL,
                     stderr=subprocess.DEVNULL, start_new_session=True)
    os.close(ours)
