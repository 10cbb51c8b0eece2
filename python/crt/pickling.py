"""Films in pickles, as multiprocessing and Dask send them: the bytes of a .crtfilm, which is packed and has
a checksum."""

import copyreg
import os
import shutil
import tempfile

from . import _crt

SHARED_MEMORY = "/dev/shm"
BYTES_PER_PIXEL = 400  # More than a film with all AOVs takes.


def folder_for(pixels):
    """Where the file of a film is to lie for a moment: in memory, where there is room."""
    try:
        free = shutil.disk_usage(SHARED_MEMORY).free if os.access(SHARED_MEMORY, os.W_OK) else 0
    except OSError:
        free = 0
    return SHARED_MEMORY if free > BYTES_PER_PIXEL * pixels else tempfile.gettempdir()


def film_bytes(film):
    """The bytes that film.save would write."""
    with tempfile.TemporaryDirectory(dir=folder_for(film.width * film.height), prefix="crt-film-") as folder:
        path = os.path.join(folder, "a.crtfilm")
        film.save(path)
        with open(path, "rb") as file:
            return file.read()


def film_of(data):
    """The film of these bytes. Raises crt.Error of kind USAGE where they are damaged."""
    descriptor = os.memfd_create("a.crtfilm")
    try:
        with open(descriptor, "wb", closefd=False) as file:
            file.write(data)
        return _crt.Film.load(f"/proc/self/fd/{descriptor}")
    finally:
        os.close(descriptor)


def reduced(film):
    return film_of, (film_bytes(film),)


def register():
    copyreg.pickle(_crt.Film, reduced)
