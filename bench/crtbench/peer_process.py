"""The process of a renderer that `race` has beside Mitsuba: takes calls from its standard input and answers
them on its standard output, all pickled."""

import importlib
import os
import pickle
import sys


class Untranslated(Exception):
    """A scene that this renderer cannot show as crt means it; a few words."""


def serve(module, name):
    """The first call makes the renderer, the others are its renders. Text of libraries, which print as soon
    as they are loaded, goes to the standard error."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    from crtbench import peer_process  # The one whose exception the renderer raises.

    make, made = getattr(importlib.import_module(f".{module}", __package__), name), None
    while True:
        try:
            call = pickle.load(sys.stdin.buffer)
        except EOFError:
            os._exit(0)   # LuxCore's library crashes where Python unloads it.
        try:
            if made is None:
                made, answer = make(**call), "ready"
            else:
                answer = made.render(**call)
        except peer_process.Untranslated as reason:
            answer = reason
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    serve(*sys.argv[1:])
