"""Copies of this tree and patches on them, for programs that build or compile a changed crt."""

import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]


def copy_tracked(destination, under="."):
    """Makes `destination` hold the tracked files of a folder. Unchanged files keep their times, so that a
    second run does not build them again."""
    names = (
        subprocess.run(["git", "ls-files", "-z", "--", under], cwd=ROOT, check=True, stdout=subprocess.PIPE)
        .stdout.decode()
        .split("\0")
    )
    for name in filter(None, names):
        if not (ROOT / name).is_file():
            continue
        target = destination / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists() or target.read_bytes() != (ROOT / name).read_bytes():
            shutil.copyfile(ROOT / name, target)


def patched(path, tree, *options):
    """Applies a patch to a tree. Returns "" or, where it does not fit, a sentence that says why."""
    done = subprocess.run(
        ["patch", "--strip=1", "--fuzz=0", "--silent", *options, "-d", str(tree), "-i", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return "" if done.returncode == 0 else f"{path.name} does not apply: {done.stdout.strip()}"
