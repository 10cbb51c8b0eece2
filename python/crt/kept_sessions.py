"""Sessions of a process that renders one part of a scene after another, for some seconds after each part: a
device that is open and a scene that is compiled are worth more than the wait for the next part."""

import contextlib
import threading

from .rendering import Session

IDLE_SECONDS = 10  # After which the memory of the device is given back.

_LOCK = threading.Lock()
_IDLE = []  # Those that no thread uses, each with the timer that closes it.


@contextlib.contextmanager
def kept_session(scene):
    """A session of this crt.Scene, the very object, for one thread. It is kept afterwards, unless what is
    done with it raises."""
    session = taken(scene) or Session(scene)
    yield session
    timer = threading.Timer(IDLE_SECONDS, forget, [session])
    timer.daemon = True
    with _LOCK:
        _IDLE.append((session, timer))
    timer.start()


def taken(scene):
    """One that is idle; None where there is none."""
    with _LOCK:
        for place, (session, timer) in enumerate(_IDLE):
            if session.scene is scene:
                del _IDLE[place]
                timer.cancel()
                return session
    return None


def forget(session):
    """Unless it is in use again."""
    with _LOCK:
        kept = [idle for idle in _IDLE if idle[0] is not session]
        if len(kept) == len(_IDLE):
            return
        _IDLE[:] = kept
    session.close()
