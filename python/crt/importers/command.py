"""`crt import`: scenes of Mitsuba and pbrt here, models by the program."""

import argparse
import os
import sys

from .. import program, writing
from ..errors import Error, Kind
from . import ENDINGS, import_scene, is_foreign

MODELS = (".glb", ".gltf", ".obj", ".ply", ".stl")  # These go to the program.


def parser():
    made = argparse.ArgumentParser(
        prog="crt import", description="convert a scene of another program",
        epilog=f"Models ({', '.join(MODELS)}) go to the program crt: crt import MODEL --help.")
    made.add_argument("scene", metavar="SCENE",
                      help="a scene of Mitsuba 3 (.xml) or pbrt-v4 (.pbrt, .pbrt.gz)")
    made.add_argument("-o", "--output", metavar="YAML", default="-",
                      help="output scene, with meshes in the folder NAME.meshes next to it; standard output "
                           "by default, or -")
    made.add_argument("--overwrite", action="store_true", help="replace an existing scene")
    made.add_argument("-D", "--define", metavar="NAME=VALUE", action="append", default=[],
                      help="the value of $NAME in a scene of Mitsuba")
    return made


def definitions(words):
    for word in words:
        if "=" not in word:
            raise Error(f"-D takes NAME=VALUE, not '{word}'", Kind.USAGE)
    return dict(word.split("=", 1) for word in words)


def refuse_others(arguments):
    """Raises crt.Error where the arguments name files, but none that crt imports."""
    files = [word for before, word in zip(["", *arguments], arguments)
             if not word.startswith("-") and before not in ("-o", "--output")]
    if files and not any(word.lower().endswith(MODELS) for word in files):
        raise Error(f"crt cannot import '{files[0]}': it reads {', '.join(MODELS + ENDINGS[:-1])} and "
                    f"{ENDINGS[-1]}", Kind.USAGE)


def main(arguments):
    if not any(map(is_foreign, arguments)) and not {"-h", "--help"} & set(arguments):
        refuse_others(arguments)
        path = str(program.path())
        os.execv(path, [path, "import", *arguments])
    given = parser().parse_args(arguments)
    made = import_scene(given.scene, definitions(given.define))
    remarks = [f"From {os.path.basename(given.scene)}."]
    if made.losses:
        remarks += ["Unsupported features, with the first place of each and crt's replacement:",
                    *(f"  {loss}".replace("\n", " ") for loss in made.losses)]
    if given.output == "-":
        sys.stdout.write(writing.to_text(made.content, remarks))
    else:
        writing.to_file(made.content, remarks, given.output, given.overwrite, made.files_read)
    report(made.losses)
    return 0


def report(losses):
    """Prints the losses: a warning for each that changes the picture a lot, a line for each other."""
    for loss in losses:
        kind = "warning: the picture changes a lot" if loss.large else "not imported"
        print(f"crt: {kind}: {loss}", file=sys.stderr)
