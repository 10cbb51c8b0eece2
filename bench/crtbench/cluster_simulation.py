"""A thousand workers of Dask whose parts only sleep: what do scheduler, client and merges cost a long
render? Prints a table; nothing is written.

Real: crt.distributed with all it does in this process, the scheduler in a separate one, each worker with its
own connections, all messages, and what the client does with a film: it reads a packed one and adds it. The
workers share some processes (--processes), as one machine has not a thousand nodes. Made up: a part sleeps
for as long as a worker of its speed would render (speeds differ by --spread), and gives its range of samples
instead of a film, because a thousand nodes have room for a thousand films and one machine has not. A sum on
a worker sleeps for as long as a node of its own would take: to add, and to pack, send (--bandwidth) and read
what comes from others, as measured with real films when the program starts. With --real-sums each sum adds
real films instead, all on the processors of this machine, and none is sent. Tasks are coroutines: otherwise
a thousand threads that wait for one interpreter would be measured. At the end every sample is there once, or
the run fails."""

import asyncio
import contextlib
import logging
import multiprocessing
import os
import random
import resource
import statistics
import time

import dask
import distributed

import crt
import crt.distributed
from crt import cluster_work
from crt.pickling import film_bytes, film_of
from crt.sample_ranges import Missing

from . import section


# One worker looks at its process 50 times a second; a thousand need not look at the same few.
QUIET = {"distributed.worker.profile.enabled": False, "distributed.admin.system-monitor.interval": "60s",
         "distributed.admin.tick.interval": "10s", "distributed.admin.tick.limit": "1h",
         "distributed.worker.use-file-locking": False, "distributed.worker.memory.target": False,
         "distributed.worker.memory.spill": False, "distributed.worker.memory.pause": False,
         "distributed.worker.memory.terminate": False, "distributed.scheduler.dashboard.enabled": False}
STARTED_AT_ONCE = 20  # Workers of a process.


class Films:
    """Real films of disjoint samples, and what is done with them."""

    def __init__(self, resolution, count, real_sums, bandwidth):
        scene = crt.load("configs/cornell_box.yaml", set={"film.resolution": [resolution] * 2})
        self.films = [crt.render(scene, sample_range=(4 * i, 4 * i + 4), backend="embree").film
                      for i in range(count)]
        self.packed = film_bytes(self.films[0])
        self.sums = Sums(processor_seconds(lambda: self.films[0] + self.films[1]),
                         processor_seconds(lambda: film_bytes(self.films[0]))
                         + processor_seconds(lambda: film_of(self.packed)) + len(self.packed) / bandwidth,
                         [film_bytes(film) for film in self.films] if real_sums else [])

    def take(self):
        """The client's work on a film that arrives."""
        return film_of(self.packed) + self.films[1]


class Sums:
    """The work on films: packed ones that are added; none where it only takes so long."""

    def __init__(self, add_seconds, send_seconds, packed):
        self.add_seconds, self.send_seconds, self.packed = add_seconds, send_seconds, packed
        self.films = []

    def unpack(self):
        self.films = [film_of(packed) for packed in self.packed]

    async def add(self, count, sent):
        """So many films, some of which were sent."""
        if self.films:
            await asyncio.to_thread(really_added, self.films[:count])
        else:
            await asyncio.sleep((count - 1) * self.add_seconds + sent * self.send_seconds)


def processor_seconds(work, runs=5):
    seconds = []
    for _ in range(runs):
        begin = time.thread_time()
        work()
        seconds.append(time.thread_time() - begin)
    return statistics.median(seconds)


really_added = cluster_work.added
FILMS = None  # Of the client.
SUMS = None   # Of a process of workers, where tasks find both.
SPEEDS = []   # Samples a second of each worker.


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
    worker = distributed.get_worker()
    await asyncio.sleep((end - first) / SPEEDS[worker.name])
    return Part([(first, end)], worker.address)


async def added(parts):
    worker = distributed.get_worker().address
    await SUMS.add(len(parts), sum(part.worker != worker for part in parts))
    return Part(disjoint([one for part in parts for one in part.sample_ranges]), worker)


def set_up():
    """Of each process."""
    dask.config.set(QUIET)
    # An error ends the render here; when all is done, each worker would report that the others go.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


def serve_scheduler(addresses):
    """A process: the scheduler, whose address it tells."""
    async def serve():
        async with distributed.Scheduler(protocol="tcp", host="127.0.0.1", port=0) as scheduler:
            addresses.put(scheduler.address)
            await scheduler.finished()

    set_up()
    asyncio.run(serve())


def serve_workers(scheduler, names, sums, speeds):
    """A process: the workers of these names."""
    global SUMS, SPEEDS

    async def serve():
        async with contextlib.AsyncExitStack() as stack:
            workers = [distributed.Worker(scheduler, host="127.0.0.1", nthreads=1, name=name, memory_limit=0)
                       for name in names]
            for first in range(0, len(workers), STARTED_AT_ONCE):
                await asyncio.gather(*(stack.enter_async_context(worker)
                                       for worker in workers[first:first + STARTED_AT_ONCE]))
            await asyncio.gather(*(worker.finished() for worker in workers))

    SUMS, SPEEDS = sums, speeds
    SUMS.unpack()
    set_up()
    asyncio.run(serve())


@contextlib.contextmanager
def cluster(processes, speeds):
    """A client of a scheduler with one worker for each of these speeds, in this number of processes."""
    context = multiprocessing.get_context("spawn")
    addresses = context.Queue()
    started = [context.Process(target=serve_scheduler, args=(addresses,))]
    started[0].start()
    try:
        scheduler = addresses.get(timeout=60)
        names = range(len(speeds))
        for process in range(processes):
            started.append(context.Process(target=serve_workers, args=(scheduler, names[process::processes],
                                                                       FILMS.sums, speeds)))
            started[-1].start()
        with distributed.Client(scheduler) as client:
            client.wait_for_workers(len(speeds), timeout=300)
            yield client
            client.shutdown()
    finally:
        for process in started:
            process.join(timeout=30)
            process.kill()


def processor_seconds_of(client):
    """Those of the client, of the scheduler and of all workers: (3,)."""
    workers = dict(client.run(own_seconds).values())
    return time.process_time(), client.run_on_scheduler(time.process_time), sum(workers.values())


def own_seconds():
    """(the process, its processor seconds)."""
    return os.getpid(), time.process_time()


def simulate(client, seconds, speeds):
    """Returns (ideal seconds, real seconds, report)."""
    samples = int(sum(speeds) * seconds)
    scene = crt.load("configs/cornell_box.yaml", set={"film.resolution": [64, 64]})

    def tell(now):
        if now["parts"] // len(speeds) != tell.shown:
            tell.shown = now["parts"] // len(speeds)
            print(f"{now['seconds']:.0f} s: {now['parts']} parts, {now['fraction']:.1%}", flush=True)

    tell.shown = 0
    result = crt.distributed.render(scene, client, spp=samples, on_progress=tell, progress=False)
    if Missing(result.film.sample_ranges, samples).left or result.film.samples != samples:
        raise RuntimeError("samples are missing")
    return samples / sum(speeds), result.report["seconds"]["total"], result.report["distributed"]


def options(parser):
    parser.add_argument("--workers", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)),
                        help="that the workers share (one a processor)")
    parser.add_argument("--seconds", type=float, default=600, help="of the render on ideal workers (600)")
    parser.add_argument("--resolution", type=int, default=512, help="of the films that merges add (512)")
    parser.add_argument("--speed", type=float, default=16, help="samples a second of a worker (16)")
    parser.add_argument("--spread", type=float, default=0.2, help="of the workers' speeds (0.2)")
    parser.add_argument("--bandwidth", type=float, default=125e6, help="bytes a second of a node (125e6)")
    parser.add_argument("--real-sums", action="store_true", help="add real films, on this machine")


def alone(arguments):
    global FILMS
    FILMS = Films(arguments.resolution, cluster_work.BRANCH if arguments.real_sums else 2,
                  arguments.real_sums, arguments.bandwidth)
    print(f"a film: {len(FILMS.packed) / 1e6:.1f} MB packed; {FILMS.sums.add_seconds:.3f} s to add, "
          f"{FILMS.sums.send_seconds:.3f} s to pack, send and read", flush=True)
    cluster_work.rendered, cluster_work.added = rendered, added
    set_up()
    chance = random.Random(1)
    speeds = [arguments.speed * chance.uniform(1 - arguments.spread, 1 + arguments.spread)
              for _ in range(arguments.workers)]
    begin = time.perf_counter()
    with cluster(arguments.processes, speeds) as client:
        print(f"{arguments.workers} workers after {time.perf_counter() - begin:.1f} s", flush=True)
        before = processor_seconds_of(client)
        ideal, real, report = simulate(client, arguments.seconds, speeds)
        busy = [after - earlier for after, earlier in zip(processor_seconds_of(client), before)]
    head = ["workers", "ideal s", "real s", "lost s", "parts", "sums", "processor s: client", "scheduler",
            "workers", "load"]
    lost = f"{real - ideal:.1f} ({real / ideal - 1:.1%})"
    row = [f"{arguments.workers:,}", f"{ideal:.1f}", f"{real:.1f}", lost, report["parts"], report["merges"],
           *(f"{seconds:.1f}" for seconds in busy), f"{os.getloadavg()[0]:.1f}"]
    print("\n" + "\n".join(section.table(head, [row])), flush=True)
    return 0
