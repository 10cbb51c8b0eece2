"""`crt slurm`: a render as an array of jobs for Slurm, whose parts go on where they were stopped, and a job
that merges them."""

import argparse
import json
import os
import pathlib
import re
import subprocess

from . import program
from .errors import Error, Kind
from .rendering import plugins
from .sample_ranges import Missing
from .scenes import load
from .slurm_scripts import merge_script, render_script, submit_script

IMAGES = (".exr", ".png", ".jpg", ".jpeg", ".ppm", ".pfm", ".crtfilm")

DESCRIPTION = """Writes scripts that render a scene on a Slurm cluster:

  render.sbatch   one part of the samples, for an array of jobs; one that was stopped goes on from its film
  merge.sbatch    adds the parts to the outputs, when all are done
  submit.sh       submits both; run again, it submits what is missing

The folder, the scene, its files and crt must be at the same paths on every node."""

EXAMPLES = """Examples:
  crt slurm scene.yaml --spp 4096 --nodes 8 --submit
  crt slurm scene.yaml --spp 65536 --nodes 100 --partition gpu --time 2:00:00 \\
      --sbatch-option gres=gpu:1 --backend cuda --output scene.exr
  crt slurm scene.yaml --nodes 4 --folder out/jobs; out/jobs/submit.sh"""


def parser():
    options = argparse.ArgumentParser(prog="crt slurm", description=DESCRIPTION, epilog=EXAMPLES,
                                      formatter_class=argparse.RawDescriptionHelpFormatter,
                                      allow_abbrev=False)
    options.add_argument("scene", metavar="SCENE", help="a scene, or a model as crt MODEL takes it")
    add = options.add_argument
    add("--spp", type=count, metavar="N", help="samples per pixel, instead of the scene's")
    add("--nodes", type=count, required=True, metavar="M", help="maximum number of parts that run at the "
                                                                "same time")
    add("--parts", type=count, metavar="P", help="total number of parts (M); with more parts, a failed node "
                                                 "loses less")
    add("-o", "--output", action="append", metavar="FILE", default=[],
        help="an image or a .crtfilm (SCENE.exr in this folder); repeatable")
    add("--folder", metavar="DIR", help="folder for scripts, parts and logs (SCENE.slurm in this folder)")
    add("--submit", action="store_true", help="run submit.sh too")
    slurm = options.add_argument_group("Slurm")
    add = slurm.add_argument
    add("--partition", metavar="NAME", help="of all jobs")
    add("--time", metavar="TIME", help="time limit of a part, as sbatch takes it; a part that needs more is "
                                       "requeued")
    add("--sbatch-option", action="append", metavar="OPTION", default=[],
        help="of a part, such as gres=gpu:1 or cpus-per-task=16; repeatable")
    add("--merge-option", action="append", metavar="OPTION", default=[],
        help="of the merging job, such as mem=16G; repeatable")
    crt = options.add_argument_group("crt render")
    add = crt.add_argument
    add("-b", "--backend", metavar="NAME", help="cuda, embree, opencl, another, or auto")
    add("-d", "--device", metavar="NAME", help="number or part of the name; all for several")
    add("-t", "--threads", metavar="N", help="threads of the processor; 0 for all")
    add("--set", action="append", metavar="KEY=VALUE", default=[], help="change the scene; repeatable")
    add("--seed", metavar="N", help="another seed")
    add("--crop", metavar="X0,Y0,X1,Y1", help="only these pixels of the film")
    add("--checkpoint-every", metavar="DURATION", default="2m", help="interval at which a part saves its "
                                                                     "film (2m)")
    return options


def count(text):
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("must be 1 or more")
    return number


def main(arguments):
    options = parser().parse_args(arguments)
    folder = written(options)
    submit = folder / "submit.sh"
    if not options.submit:
        print(f"wrote {folder}; submit it with: {submit}")
        return 0
    try:
        return subprocess.run(["bash", submit], check=False).returncode and int(Kind.DEVICE)
    except KeyboardInterrupt:
        return 130


def written(options):
    """Writes the folder of a render; returns its path. Raises crt.Error."""
    scene = absolute(options.scene)
    changes = words({"--seed": options.seed, "--crop": options.crop}, {"--set": options.set})
    program.run(["info", scene, *changes])  # Says what is wrong with the scene, before any node does.
    stem = pathlib.Path(scene).stem
    outputs = [absolute(name) for name in options.output] or [absolute(f"{stem}.exr")]
    for output in outputs:
        if not output.endswith(IMAGES):
            raise Error(f"an output is {', '.join(IMAGES)}, not '{output}'", Kind.USAGE)
        if not os.path.isdir(os.path.dirname(output)):
            raise Error(f"there is no folder '{os.path.dirname(output)}' for '{output}'", Kind.OUTPUT)
    samples = options.spp or load(scene).samples
    if not options.spp and any(change.startswith("sampler.samples=") for change in options.set):
        raise Error("give the number of samples as --spp, not as --set sampler.samples", Kind.USAGE)
    spec = {"scene": scene, "samples": samples, "ranges": parts_of(samples, options.parts or options.nodes),
            "changes": changes}
    folder = pathlib.Path(absolute(options.folder or f"{stem}.slurm"))
    require_same(folder, spec)
    backend = backend_on_nodes(options.backend)
    render = [*words({"-b": backend, "-d": options.device, "-t": options.threads}), *changes]
    require_readable([*render, "--samples", ":".join(map(str, spec["ranges"][-1])),
                      "--checkpoint-every", options.checkpoint_every])
    crt = str(program.path().resolve())
    name = "crt-" + re.sub(r"[^A-Za-z0-9_.-]", "_", stem)
    shared = words({"--partition": options.partition})
    part = [*shared, *words({"--time": options.time}), *map(option, options.sbatch_option)]
    merge = [*shared, *map(option, options.merge_option)]
    ranges = spec["ranges"]
    try:
        for inner in ("parts", "logs"):
            (folder / inner).mkdir(parents=True, exist_ok=True)
        write(folder / "render.sbatch",
              render_script(folder, crt, scene, ranges, render, options.checkpoint_every))
        write(folder / "merge.sbatch", merge_script(folder, crt, len(ranges), outputs))
        write(folder / "submit.sh",
              submit_script(folder, name, len(ranges), options.nodes, part, merge), executable=True)
        write(folder / "render.json", json.dumps(spec, indent=1) + "\n")
    except OSError as error:
        raise Error(f"cannot write the scripts: {error}", Kind.OUTPUT) from None
    return folder


NO_SCENE = "/dev/null/scene.yaml"  # Nothing can be below a file that is no folder.


def require_readable(arguments):
    """Raises crt.Error where `crt render` refuses one of its arguments, which would end every part. The
    program reads its arguments before it opens a scene, and here it finds none."""
    program.run(["render", NO_SCENE, *arguments], answers=(int(Kind.SCENE),))


def backend_on_nodes(backend):
    """The backend as a script names it, whose working directory may differ. Raises crt.Error where crt does
    not have it. This machine may lack the device."""
    if backend is None or backend == "auto":
        return backend
    if "/" in backend:
        if not os.path.isfile(backend):
            raise Error(f"there is no backend file '{backend}'", Kind.USAGE)
        return absolute(backend)
    known = [plugin.name for plugin in plugins()]
    if backend not in known:
        raise Error(f"backend '{backend}' is unknown; backends are auto, {', '.join(known)}", Kind.BACKEND)
    return backend


def absolute(path):
    """Without following links, whose names may be all that is the same on every node."""
    if "\n" in path:
        raise Error("a script cannot contain a path with a line break", Kind.USAGE)
    return os.path.abspath(path)


def words(once, repeated=()):
    return ([word for name, value in once.items() if value is not None for word in (name, str(value))]
            + [word for name, values in dict(repeated).items() for value in values
               for word in (name, value)])


def option(text):
    """"gres=gpu:1" and "--gres=gpu:1" are the same."""
    return text if text.startswith("-") else f"--{text}"


def parts_of(samples, parts):
    missing = Missing([], samples)
    each = -(-samples // parts)
    ranges = []
    while missing.left:
        ranges.append(list(missing.take(each)))
    return ranges


def require_same(folder, spec):
    """Films of another render in the folder would be added to this one's."""
    try:
        before = json.loads((folder / "render.json").read_text("utf-8"))
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise Error(f"'{folder / 'render.json'}' cannot be read: {error}", Kind.USAGE) from None
    if before != spec and any((folder / "parts").glob("*.crtfilm")):
        raise Error(f"'{folder}' holds parts of another render: choose another --folder, or remove it",
                    Kind.USAGE)


def write(path, text, executable=False):
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    temporary.write_bytes(text.encode("utf-8", "surrogateescape"))  # Names of files may be no UTF-8.
    if executable:
        temporary.chmod(temporary.stat().st_mode | 0o111)
    os.replace(temporary, path)
