"""Pages of what `crt converge -o DIR` and `crt verify -o DIR` have written: one file each, with all that it
shows in itself.

    python -m crt report DIR [-o FILE.html]

These files need jinja2 and matplotlib and nothing else of the package: the installed program runs the
folder they lie in, `python3 share/crt/report DIR`, where no package is installed. Figures, verdicts and
findings are the program's; here they are laid out.
"""

from .command import main

__all__ = ["main"]
