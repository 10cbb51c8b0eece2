"""`python3 FOLDER DIR`, with the path of this folder: the pages without the package around it."""

import importlib.util
import pathlib
import sys


def load(folder):
    """The package in `folder` under a unique name, so that its files import each other."""
    spec = importlib.util.spec_from_file_location("crt_report", folder / "__init__.py",
                                                  submodule_search_locations=[str(folder)])
    package = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = package
    spec.loader.exec_module(package)
    return package


if __name__ == "__main__":
    # Python looks for modules in the folder that it runs: none here may stand in for one of the same name.
    here = pathlib.Path(__file__).resolve().parent
    sys.path[:] = [place for place in sys.path if pathlib.Path(place or ".").resolve() != here]
    sys.exit(load(here).main(sys.argv[1:]))
