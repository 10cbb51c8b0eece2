"""`crt` and `python -m crt`: the commands that are written in Python; all others are the program's, which is
given scenes of other renderers as scenes of crt."""

import importlib
import os
import sys

from . import program
from .errors import Error
from .importers import is_foreign

# Command: the module whose main(arguments) it is. It returns the exit code.
COMMANDS = {"denoise": ".denoise_command", "import": ".importers.command", "report": ".report",
            "slurm": ".slurm"}


def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    try:
        if arguments and arguments[0] in COMMANDS:
            return importlib.import_module(COMMANDS[arguments[0]], __package__).main(arguments[1:])
        path = str(program.path())
        if any(map(is_foreign, arguments)):
            arguments = importlib.import_module(".foreign_scenes", __package__).with_imported(arguments)
    except Error as error:
        print(f"crt: error: {error}", file=sys.stderr)
        return int(error.kind)
    os.execv(path, [path, *arguments])


if __name__ == "__main__":
    sys.exit(main())
