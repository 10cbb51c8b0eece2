"""Reads the output of tests/nvrtc_variants."""
import re

from .program import Failure

SKIPPED = 77


def find(program):
    for folder in ("bin", "tests"):
        path = program.build / folder / "nvrtc_variants"
        if path.exists():
            return path
    return None


def variants(program, scenes, environment=None, only=False):
    """(compiler, [variant]) for the kernels of the scenes and, unless `only`, the representative ones; (why
    not, None) where NVRTC is missing."""
    tool = find(program)
    if tool is None:
        return "this build has no nvrtc_variants", None
    # Code 1 says that a variant spills or keeps memory that it should not; its numbers are measurements all
    # the same.
    run = program.start(
        [*(["--only"] if only else []), *map(program.scene_file, scenes)],
        program=tool,
        codes=(0, 1, SKIPPED),
        environment=environment,
    )
    return (run.output.strip(), None) if run.code == SKIPPED else parsed(run.output)


def parsed(output):
    head = re.match(r"(.*), (sm_\d+), \d+ variants", output)
    rows = re.findall(
        r"^\s*(\d+)\s+(\d+)\s+(\d+)\s+([\d.]+)\s+([\d.]+)\s+(crt_\w+)\s+(0x[0-9a-f]+) (.*)$",
        output,
        re.MULTILINE,
    )
    if not head or not rows:
        raise Failure(f"nvrtc_variants prints something new:\n{output[:500]}")
    return f"{head[1]}, {head[2]}", [
        {
            "kernel": kernel,
            "mask": hex(int(mask, 16)),
            "name": name,
            "registers": int(registers),
            "stack": int(stack),
            "spill": int(spill),
            "cubin_kb": float(size),
            "ms": float(ms),
        }
        for registers, stack, spill, size, ms, kernel, mask, name in rows
    ]
