"""Scenes of other renderers on a command line of the program: `crt scene.xml --spp 64`."""

import os
import pathlib
import subprocess
import sys
import tempfile

from .importers import command, is_foreign

# Ends when whoever holds the other end of its input has ended, however that was, and removes the folder.
CLEANER = "import shutil, sys; sys.stdin.read(); shutil.rmtree(sys.argv[1], ignore_errors=True)"


def with_imported(arguments):
    """The arguments with the first scene of another renderer among them as a scene of crt: imported into a
    folder that is removed when this process, or the program that takes its place, ends. Where there is none
    they are what they were. Raises crt.Error as import_scene."""
    for i, word in enumerate(arguments):
        if is_foreign(word) and os.path.isfile(word):
            return [*arguments[:i], imported(word), *arguments[i + 1:]]
    return arguments


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
