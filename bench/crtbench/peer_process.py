"""The process of a renderer that `race` has beside Mitsuba: takes calls from its standard input and answers
them on its standard output, all pickled."""

import os
import pickle
import sys


class Untranslated(Exception):
    """A scene that this renderer cannot show as crt means it; a few words."""


def serve(renderer):
    """The first call makes the renderer, the others are its renders. Whatever else prints goes to the standard
    error."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    made = None
    while True:
        try:
            call = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            if made is None:
                answer = made = renderer(**call)
                answer = "ready"
            else:
                answer = made.render(**call)
        except Untranslated as reason:
            answer = reason
        pickle.dump(answer, answers)
        answers.flush()
