"""Measures the cost of a Dask cluster on one machine against one plain render of the same samples: wall and
processor seconds, in turn, and whether the bits are the same. The same processes that render an equal share
each, of which no film is sent or added, show what processes cost without crt.distributed. Prints one table;
--write replaces its section of docs/results.

Where a machine's speed changes from minute to minute, so do the ratios of wall times. The last column does
not: of the processors' time in that very run, what was not spent on rendering parts, to what was. It leaves
out that processes can slow each other down, which the wall times of the shares show.

The workers are processes of one thread each, which render with one thread each; the plain render uses as
many threads as there are workers, or all where the machine has fewer. The cluster has been started when the
clock begins, as docs/cluster.md says for busy machines: without the profiler of Dask, with its monitors and
ticks far apart, and with workers that keep the memory of films. With --gpus a plain render on one device
is compared with workers that have one GPU each, as CUDA_VISIBLE_DEVICES says, and the last column is of the
GPUs' time."""

import contextlib
import os
import shlex
import statistics
import sys
import time

import dask
import distributed

import crt
import crt.distributed
from crt import cluster_work

from . import section

QUIET = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "1s",
         "distributed.admin.system-monitor.interval": "10s",
         "distributed.worker.memory.monitor-interval": "5s"}
KEPT_MEMORY = {"MALLOC_ARENA_MAX": 1, "MALLOC_MMAP_MAX_": 0, "MALLOC_TRIM_THRESHOLD_": 4_000_000_000}


def processor_seconds(client):
    """Of this process and all workers."""
    return time.process_time() + sum(client.run(time.process_time).values())


def start(workers, gpus):
    """A cluster of this number of processes; each sees one GPU where `gpus` is."""
    if not gpus:
        return distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    specification = {index: {"cls": distributed.Nanny,
                             "options": {"nthreads": 1, "env": {"CUDA_VISIBLE_DEVICES": str(index)}}}
                     for index in range(workers)}
    scheduler = {"cls": distributed.Scheduler, "options": {"dashboard": False}}
    return distributed.SpecCluster(workers=specification, scheduler=scheduler)


RENDERING = []  # Of a worker: seconds of its renders.
part_rendered = cluster_work.rendered


@contextlib.contextmanager
def timed(options):
    """Adds the seconds of a render: of this thread, which renders alone, or those that its GPU has."""
    clock = time.thread_time if options["threads"] == 1 else time.perf_counter
    begin = clock()
    yield
    RENDERING.append(clock() - begin)


def timed_part(scene, first, end, options, seconds):
    """A task: a part."""
    with timed(options):
        return part_rendered(scene, first, end, options, seconds)


def render_share(scene, first, end, options):
    """A task whose film is thrown away."""
    with timed(options):
        crt.render(scene, sample_range=(first, end), progress=False, **options)


def seconds_of_renders():
    """Since the last call."""
    seconds = sum(RENDERING)
    RENDERING.clear()
    return seconds


def render_shares(client, scene, samples, options):
    """All workers, each with one range of the samples."""
    workers = list(client.nthreads())
    cuts = [samples * i // len(workers) for i in range(len(workers) + 1)]
    client.gather([client.submit(render_share, scene, first, end, options, workers=[worker], pure=False)
                   for worker, first, end in zip(workers, cuts, cuts[1:])])


def measured(client, render):
    """(result, wall seconds, processor seconds, seconds of the workers' renders)."""
    client.run(seconds_of_renders)
    busy, begin = processor_seconds(client), time.perf_counter()
    result = render()
    wall = time.perf_counter() - begin
    return (result, wall, processor_seconds(client) - busy,
            sum(client.run(seconds_of_renders).values()))


def options(parser):
    parser.add_argument("--scene", default="configs/cornell_box.yaml")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--seconds", type=float, default=60, help="of the plain render, about (60)")
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--backend", default="embree")
    parser.add_argument("--gpus", action="store_true", help="a GPU for each worker")
    parser.add_argument("--write", action="store_true", help="replace the section of docs/results")


def alone(arguments):

    scene = crt.load(arguments.scene, set={"film.resolution": [arguments.resolution] * 2})
    threads = 0 if arguments.gpus else min(arguments.workers, len(os.sched_getaffinity(0)))
    # Kernels and caches; on a GPU the first seconds are of a kernel that is not yet lean.
    crt.render(scene, backend=arguments.backend, threads=threads, time_limit=arguments.seconds / 10)
    trial = crt.render(scene, backend=arguments.backend, threads=threads, time_limit=arguments.seconds / 10)
    samples = int(trial.film.samples * arguments.seconds / trial.report["seconds"]["render"])
    dask.config.set({**QUIET, **{f"distributed.nanny.pre-spawn-environ.{name}": value
                                 for name, value in KEPT_MEMORY.items()}})
    with start(arguments.workers, arguments.gpus) as cluster, distributed.Client(cluster) as client:
        client.wait_for_workers(arguments.workers)
        options = {"backend": arguments.backend, "threads": 0 if arguments.gpus else 1}
        cases = {
            "one render": lambda: crt.render(scene, spp=samples, backend=arguments.backend, threads=threads),
            "processes": lambda: render_shares(client, scene, samples, options),
            "Dask": lambda: crt.distributed.render(scene, client, spp=samples, **options)}
        cluster_work.rendered = timed_part
        crt.distributed.render(scene, client, spp=4 * arguments.workers, parts=2 * arguments.workers,
                               **options)  # Workers load what they need.
        found, films = {name: [] for name in cases}, {}
        for _ in range(arguments.runs):
            for name, render in cases.items():
                result, wall, processor, rendering = measured(client, render)
                films[name] = result and result.film
                if rendering:
                    at_once = arguments.workers if arguments.gpus else threads
                else:
                    at_once, rendering = (1, wall) if arguments.gpus else (threads, processor)
                found[name].append((wall, processor, at_once * wall / rendering - 1))
                print(f"{name}: {wall:.2f} s, {processor:.2f} processor seconds, "
                      f"{found[name][-1][2]:.2%} not of renders, load {os.getloadavg()[0]:.1f}",
                      result.report.get("distributed", "") if result else "", flush=True)
    same = (films["one render"].xyz == films["Dask"].xyz).all()
    rows = []
    for name, runs in found.items():
        wall, processor, lost = zip(*runs)
        columns = [f"{statistics.median(c):.1f} ({min(c):.1f} – {max(c):.1f})" for c in (wall, processor)]
        rows.append([name, *columns, f"{statistics.median(lost):.1%} ({min(lost):.1%} – {max(lost):.1%})"])
    ratios = [[statistics.median(d[i] / p[i] for p, d in zip(found[name], found["Dask"])) for i in range(2)]
              for name in ("one render", "processes")]
    rows += [[f"Dask to {name}, median of neighbours", f"{wall:.3f}", f"{processor:.3f}", ""]
             for name, (wall, processor) in zip(("one render", "processes"), ratios)]
    what = (f"{samples} samples of the scene at {arguments.resolution} × {arguments.resolution} pixels, "
            f"{arguments.workers} workers; {'the same bits' if same else 'OTHER BITS'}.")
    head = ["", "wall s", "processor s", "not rendering"]
    print("\n" + what + "\n\n" + "\n".join(section.table(head, rows)))
    if arguments.write:
        name = "cluster-overhead-gpus" if arguments.gpus else "cluster-overhead"
        share = f"takes {ratios[0][0]:.2f} of the time of"
        title = (f"Dask with {arguments.workers} GPUs {share} one GPU" if arguments.gpus
                 else f"Dask on one machine {share} one render")
        line = section.source("bench/run " + shlex.join(sys.argv[1:]), section.commit(), section.today(),
                              section.processor())
        text = (f"{what} *Processes*: the same, without films sent or added. *Not rendering*: time of "
                "the processors, or GPUs, that was not spent on rendering, over the time that was.")
        section.replace(section.page_of(name), name, section.section(title, line, text, head, rows))
    return 0 if same else 1
