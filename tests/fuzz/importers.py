#!/usr/bin/env python3
"""Mutates scenes of pbrt and Mitsuba and imports each: only crt.Error may come out.

    tests/fuzz/importers.py                           100 mutations of each scene of corpus/importers
    tests/fuzz/importers.py --mutations 2000 FOLDER…  of each .pbrt and .xml below these folders as well

Findings: an exception other than crt.Error, an error without file, line and column, more than 10 s of
processor time, or more than 2 GiB of memory. The input stays in --findings. Exit code 1 when anything was
found. Needs the package crt on PYTHONPATH.
"""

import argparse
import concurrent.futures
import os
import pathlib
import random
import re
import resource
import signal
import sys
import tempfile

SECONDS, BYTES = 10, 2 << 30
SEEDS = pathlib.Path(__file__).resolve().parent / "corpus" / "importers"
NUMBERS = ["1e308", "-1e308", "1e-308", "nan", "inf", "-1", "0", "99999999999999999999", "1e39",
           "2147483648", ""]
PLACE = re.compile(r".+:\d+:\d+: error: ", re.DOTALL)


def mutated(data, chance):
    """One to four random changes of the bytes."""
    made = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        if not made:
            break
        kind, at = chance.randrange(7), chance.randrange(len(made))
        if kind == 0:
            made[at] = chance.randrange(256)
        elif kind == 1:
            del made[at:]
        elif kind == 2:
            del made[at:at + chance.randint(1, 40)]
        elif kind == 3:
            made[at:at] = bytes(chance.randrange(256) for _ in range(chance.randint(1, 8)))
        elif kind == 4:  # A part once more, elsewhere.
            part = made[at:at + chance.randint(1, 200)]
            made[chance.randrange(len(made)):0] = part
        else:  # A number becomes another.
            numbers = list(re.finditer(rb"-?\d[\d.e+-]*", made))
            if numbers:
                found = chance.choice(numbers)
                made[found.start():found.end()] = chance.choice(NUMBERS).encode()
    return bytes(made)


class TooSlow(BaseException):
    """Not an Exception, which importers turn into sentences."""


def give_up(*_):
    raise TooSlow


def fault(path, crt):
    """The fault of an import, or None."""
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        crt.import_scene(path)
    except crt.Error as error:
        if not PLACE.match(str(error)):
            return f"no place: {error}"
    except TooSlow:
        return f"more than {SECONDS} s"
    except BaseException as error:  # noqa: B902 (whatever it is)
        return f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return None


def fuzz(path, mutations, seed, findings):
    """Faults of the mutations of one file, as (name, fault), and the most memory in bytes."""
    import crt

    resource.setrlimit(resource.RLIMIT_AS, (2 * BYTES, 2 * BYTES))
    signal.signal(signal.SIGPROF, give_up)
    data, found = path.read_bytes(), []
    # Beside the original, so that the files that it names are found.
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".fuzz-", suffix=path.suffix) as file:
        for number in range(mutations):
            made = mutated(data, random.Random(f"{seed} {path.name} {number}"))
            file.seek(0)
            file.truncate()
            file.write(made)
            file.flush()
            wrong = fault(file.name, crt)
            if wrong is not None:
                kept = findings / f"{path.stem}-{number}{path.suffix}"
                kept.write_bytes(made)
                found.append((kept.name, wrong))
    return found, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--mutations", type=int, default=100, help="of each file (100)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--findings", type=pathlib.Path, metavar="FOLDER",
                        default=pathlib.Path("build/fuzz/findings/importers"))
    arguments = parser.parse_args()
    arguments.findings.mkdir(parents=True, exist_ok=True)
    paths = sorted(path for folder in [SEEDS, *arguments.folders] for path in folder.rglob("*")
                   if path.suffix in (".pbrt", ".xml") and not path.name.startswith(".fuzz-"))
    bad = 0
    with concurrent.futures.ProcessPoolExecutor(arguments.processes, max_tasks_per_child=1) as workers:
        asked = {workers.submit(fuzz, path, arguments.mutations, arguments.seed, arguments.findings): path
                 for path in paths}
        for done in concurrent.futures.as_completed(asked):
            found, memory = done.result()
            if memory > BYTES:
                found.append((asked[done].name, f"took {memory / 1e9:.1f} GB"))
            bad += len(found)
            print(f"{asked[done]}: {len(found)} findings, {memory >> 20} MiB", flush=True)
            for name, wrong in found[:10]:
                print(f"    {name}: {wrong[:200]}", flush=True)
    print(f"{len(paths)} files, {arguments.mutations} mutations each: {bad} findings")
    return 1 if bad or not paths else 0


if __name__ == "__main__":
    sys.exit(main())
