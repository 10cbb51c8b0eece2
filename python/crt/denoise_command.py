"""`crt denoise`: a guess at a film's image without its noise, by Open Image Denoise."""

import argparse
import sys

from . import _crt
from .denoising import denoise


def parser():
    made = argparse.ArgumentParser(
        prog="crt denoise", description="guess an image without its noise",
        epilog="The guess is no measurement: it has no stated error, and it is marked (crt/denoised).")
    made.add_argument("film", metavar="FILM", help="a film (.crtfilm)")
    made.add_argument("-o", "--output", metavar="FILE", action="append", required=True,
                      help=".exr, linear, or .png, with the film's exposure; repeatable")
    made.add_argument("--no-guides", action="store_true", help="do not use the film's albedo and normal")
    return made


def main(arguments):
    given = parser().parse_args(arguments)
    made = denoise(_crt.Film.load(given.film), aovs=[] if given.no_guides else None)
    for path in given.output:
        made.save(path)
    print(f"crt: {', '.join(given.output)}: {made.made_with}; a guess, whose error is not known",
          file=sys.stderr)
    return 0
