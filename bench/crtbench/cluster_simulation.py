"""A thousand workers of Dask in one process, whose parts only sleep: what do scheduler, client and merges
cost a long render? Prints a table; nothing is written.

Real: crt.distributed with all it does, the scheduler, each worker with its own connection, and what the
client does with a film: it reads a packed one and adds it. Made up: a part sleeps for as long as a worker of
its speed would render (speeds differ by --spread), and gives its range of samples instead of a film, because
a thousand nodes have room for a thousand films and one machine has not. A sum on a worker sleeps for as long
as a node of its own would take: to add, and to pack, send (--bandwidth) and read what comes from others, as
measured with real films when the program starts. With --real-sums each sum adds real films instead, all on
the processors of this machine, and nothing is sent. Tasks are coroutines: otherwise a thousand threads that
wait for one interpreter would be measured. Messages stay within the process. At the end every
sample is there once, or the run fails."""

import argparse
import asyncio
import os
import random
import statistics
import time

import dask
import distributed

import crt
import crt.distributed
from crt import cluster_work
from crt.pickling import film_bytes, film_of
from crt.sample_ranges import Missing


class Films:
    """Real films of disjoint samples, and what is done with them."""

    def __init__(self, resolution, count, real_sums, bandwidth):
        scene = crt.load("configs/cornell_box.yaml", set={"film.resolution": [resolution] * 2})
        self.films = [crt.render(scene, sample_range=(4 * i, 4 * i + 4), backend="embree").film
                      for i in range(count)]
        self.added, self.real_sums = 0, real_sums
        self.packed = film_bytes(self.films[0])
        self.add_seconds = processor_seconds(lambda: self.films[0] + self.films[1])
        self.send_seconds = (processor_seconds(lambda: film_bytes(self.films[0]))
                             + processor_seconds(lambda: film_of(self.packed))
                             + len(self.packed) / bandwidth)

    async def add(self, count, sent):
        """What a worker does with so many films, some of which were sent to it."""
        if self.real_sums:
            await asyncio.to_thread(really_added, self.films[:count])
        else:
            await asyncio.sleep((count - 1) * self.add_seconds + sent * self.send_seconds)
        self.added += count - 1

    def take(self):
        """What the client does with a film that comes to it."""
        return film_of(self.packed) + self.films[1]


def processor_seconds(work, runs=5):
    seconds = []
    for _ in range(runs):
        begin = time.thread_time()
        work()
        seconds.append(time.thread_time() - begin)
    return statistics.median(seconds)


really_added = cluster_work.added
FILMS = None  # Tasks of workers in this process find it here.
SPEEDS = {}


class Part:
    """Stands for a film: the samples that it has."""

    error = None

    def __init__(self, ranges, worker):
        self.sample_ranges, self.worker = ranges, worker

    @property
    def samples(self):
        return sum(end - first for first, end in self.sample_ranges)

    def __add__(self, other):
        FILMS.take()
        return Part(disjoint([*self.sample_ranges, *other.sample_ranges]), None)


def disjoint(ranges):
    """Sorted, joined where they meet. Samples that are twice in it are an error of the render."""
    joined = []
    for first, end in sorted(ranges):
        if joined and first < joined[-1][1]:
            raise RuntimeError(f"samples {first}-{end} are there twice")
        if joined and first == joined[-1][1]:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((first, end))
    return joined


async def rendered(scene, first, end, options, seconds):
    worker = distributed.get_worker().address
    await asyncio.sleep((end - first) / SPEEDS[worker])
    return Part([(first, end)], worker)


async def added(parts):
    worker = distributed.get_worker().address
    await FILMS.add(len(parts), sum(part.worker != worker for part in parts))
    return Part(disjoint([one for part in parts for one in part.sample_ranges]), worker)


def simulate(client, workers, seconds, speed, spread):
    """Returns (ideal seconds, real seconds, report)."""
    chance = random.Random(1)
    SPEEDS.update((address, speed * chance.uniform(1 - spread, 1 + spread))
                  for address in client.nthreads())
    samples = int(sum(SPEEDS.values()) * seconds)
    scene = crt.load("configs/cornell_box.yaml", set={"film.resolution": [64, 64]})

    def tell(now):
        if now["parts"] // workers != tell.shown:
            tell.shown = now["parts"] // workers
            print(f"{now['seconds']:.0f} s: {now['parts']} parts, {now['fraction']:.1%}", flush=True)

    tell.shown = 0
    result = crt.distributed.render(scene, client, spp=samples, on_progress=tell, progress=False)
    if Missing(result.film.sample_ranges, samples).left or result.film.samples != samples:
        raise RuntimeError("samples are missing")
    return samples / sum(SPEEDS.values()), result.report["seconds"]["total"], result.report["distributed"]


def main():
    global FILMS
    parser = argparse.ArgumentParser(prog="bench/cluster_simulation", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=600, help="of the render on ideal workers (600)")
    parser.add_argument("--resolution", type=int, default=512, help="of the films that merges add (512)")
    parser.add_argument("--speed", type=float, default=16, help="samples a second of a worker (16)")
    parser.add_argument("--spread", type=float, default=0.2, help="of the workers' speeds (0.2)")
    parser.add_argument("--bandwidth", type=float, default=125e6, help="bytes a second of a node (125e6)")
    parser.add_argument("--real-sums", action="store_true", help="add real films, on this machine")
    arguments = parser.parse_args()
    FILMS = Films(arguments.resolution, cluster_work.BRANCH if arguments.real_sums else 2,
                  arguments.real_sums, arguments.bandwidth)
    print(f"a film: {len(FILMS.packed) / 1e6:.1f} MB packed; {FILMS.add_seconds:.3f} s to add, "
          f"{FILMS.send_seconds:.3f} s to pack, send and read", flush=True)
    cluster_work.rendered, cluster_work.added = rendered, added
    # One worker looks at its process 50 times a second; a thousand need not look at the same one.
    dask.config.set({"distributed.worker.profile.enabled": False,
                     "distributed.admin.system-monitor.interval": "60s",
                     "distributed.admin.tick.interval": "10s", "distributed.admin.tick.limit": "1h",
                     "distributed.worker.use-file-locking": False,
                     "distributed.worker.memory.target": False, "distributed.worker.memory.spill": False,
                     "distributed.worker.memory.pause": False,
                     "distributed.worker.memory.terminate": False})
    begin = time.perf_counter()
    with distributed.Client(processes=False, n_workers=arguments.workers, threads_per_worker=1,
                            dashboard_address=None) as client:
        client.wait_for_workers(arguments.workers)
        print(f"{arguments.workers} workers after {time.perf_counter() - begin:.1f} s", flush=True)
        before = time.process_time()
        ideal, real, report = simulate(client, arguments.workers, arguments.seconds, arguments.speed,
                                       arguments.spread)
        busy = time.process_time() - before
    print(f"\n| workers | ideal s | real s | overhead | parts | films added | processor s | load |\n"
          f"|{'---|' * 8}\n| {arguments.workers} | {ideal:.1f} | {real:.1f} | {real / ideal - 1:.1%} "
          f"| {report['parts']} | {FILMS.added} | {busy:.1f} | "
          f"{os.getloadavg()[0]:.1f} |", flush=True)
    return 0
