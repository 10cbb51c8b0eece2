"""The tasks of a render on a Dask cluster: parts are submitted, their films added where they lie, and what
has been added comes to this process now and then.

A worker's own films are added on it, which sends nothing. The sums of all workers become one film as a tree
of tasks. Futures that this process holds are made again by Dask when a worker is lost; what has come here is
safe.
"""

import contextlib
import functools
import itertools
import queue
import socket
import time
import uuid
import warnings
from concurrent.futures import CancelledError

from distributed import KilledWorker, get_worker
from distributed.client import ClosedClientError

from . import _crt
from .errors import Error, Kind
from .kept_sessions import kept_session
from .messages import LOGGER

PILE = 4     # Films of one worker that are added at once.
BRANCH = 8   # Films of several workers that one task adds.
FEW = 64     # Workers that each send one film, not several; with more the scheduler is what takes long.
PART_SECONDS = 20
PARTS_A_SECOND = 10   # Of all workers together: what a scheduler and this process bear with ease.
SECONDS_A_PIXEL = 160e-6  # Between two merges: a hundred times what packing, sending and reading takes.
PARTS_A_SECOND_AT_FIRST = 200  # As long as parts grow.
PARTS_A_SECOND_AT_LAST = 100  # When they get smaller, so that all end together.
LEAST_SECONDS = 0.5  # Of the last parts, which end within that time of each other.
LEAST_SECONDS_A_PIXEL = 3e-6  # Likewise: ten times what is no less in a part of fewer samples.
PROBES = 64  # Parts at once until that can be kept: a thousand tiny ones would hold the scheduler up.
FAILURES = 3   # Of one part, on devices that fail.
GONE = (OSError, ClosedClientError, CancelledError)
URGENT = 10    # Sums before parts, so that films do not pile up.


class PartFailed(Error):
    """A part could not be rendered on `worker`, the address of one of Dask's."""

    def __init__(self, sentence, kind, file, line, column, worker):
        super().__init__(sentence, kind, file, line, column)
        self.worker = worker

    def __reduce__(self):
        made, arguments = super().__reduce__()
        return made, (*arguments, self.worker)


def rendered(scene, first, end, options, seconds):
    """A task: the film of these samples, or of the first of them where `seconds` are too few."""
    try:
        with kept_session(scene) as session:
            result = session.render(sample_range=(first, end), time_limit=seconds, progress=False,
                                    estimate_error=False, **options)
        return result.film
    except Error as error:  # RenderFailed too: a part is rendered again as a whole.
        address = get_worker().address
        raise PartFailed(f"{error} (on {socket.gethostname()}, worker {address})", error.kind,
                         error.file or "", error.line or 0, error.column or 0, address) from None


def added(films):
    """A task: their sum."""
    return _crt.sum_films(films)


def same(value):
    """A task: the scene, which workers then have from each other."""
    return value


def reaching(method):
    """For methods that talk to the cluster: where that is gone, crt.Error says so."""
    @functools.wraps(method)
    def tried(*arguments):
        try:
            return method(*arguments)
        except GONE as gone:
            raise Error(f"the Dask cluster is gone: {gone}", Kind.DEVICE) from gone
        except RuntimeError as gone:
            if "ConnectionPool is closed" not in str(gone):
                raise
            raise Error(f"the Dask cluster is gone: {gone}", Kind.DEVICE) from gone
    return tried


class Work:
    """
    missing   Missing: what is not submitted
    kept      crt.Film: the sum of what has come to this process; None at first
    samples   done, those of `kept` and of parts on workers
    """

    def __init__(self, client, scene, options, missing, size, kept, checkpoint, checkpoint_every):
        self.client, self.scene, self.options = client, scene, options
        self.missing, self.size, self.kept = missing, size, kept
        self.checkpoint = str(checkpoint) if checkpoint is not None else None
        self.error = None   # Of `kept`: to ask a film for it takes as long as to add one.
        self.resumed = self.samples = kept.samples if kept is not None else 0
        self.every = max(checkpoint_every, SECONDS_A_PIXEL * scene.width * scene.height)
        self.name = f"crt-{uuid.uuid4().hex[:12]}"
        self.serial = itertools.count()
        self.done = queue.Queue()
        self.running = {}   # Future: (first, end, time).
        self.piles = {}     # Worker: futures of films on it.
        self.coming = None  # The future of a sum that is to come here.
        self.failures = {}  # First sample of a part: how often its device failed.
        self.good = None    # Addresses of workers whose devices did not fail; None: all.
        self.bad = set()
        self.parts = self.redone = self.merges = self.threads = self.most_threads = 0
        self.began = self.asked = self.merged = time.monotonic()
        # Of a film that was there it must show soon whether it is of this scene.
        self.soon = kept is not None
        self.warned = False
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            self.sent = client.submit(same, scene, key=f"{self.name}-scene")
        self.count_threads()

    @reaching
    def submit(self, seconds_left, until):
        """Parts for all threads of the workers that there are, and a few more, so that none waits. They are
        to end together when `until` samples are done, or all."""
        self.count_threads()
        part_seconds = max(PART_SECONDS, self.threads / PARTS_A_SECOND)
        least = max(LEAST_SECONDS, LEAST_SECONDS_A_PIXEL * self.scene.width * self.scene.height,
                    self.threads / PARTS_A_SECOND_AT_LAST)
        if seconds_left is not None:
            part_seconds = min(part_seconds, seconds_left)
        left = self.missing.left
        soon = until - self.samples - sum(end - first for first, end, _ in self.running.values())
        # A task that waits behind another part ends last.
        spare = seconds_left is None and not self.size.shrinks(part_seconds, min(soon, left), self.threads)
        most = self.threads + (-(-self.threads // 8) if spare else 0)
        if not self.size.is_known(min(part_seconds, self.threads / PARTS_A_SECOND_AT_FIRST)):
            most = min(most, PROBES)
        parts = []
        while left > 0 and len(self.running) + len(parts) < most:
            samples = self.size.next(part_seconds, least, min(soon, left), self.threads)
            first, end = self.missing.take(samples)
            left -= end - first
            soon -= end - first
            parts.append((first, end))
        self.start(parts, seconds_left)

    def start(self, parts, seconds_left):
        """Tasks of these parts, in one message: a thousand of them would hold the scheduler up."""
        if not parts:
            return
        keys = [self.key(rendered) for _ in parts]
        futures = self.client.map(rendered, [self.sent] * len(parts), *zip(*parts), options=self.options,
                                  seconds=seconds_left, key=keys, workers=self.good)
        for future, (first, end) in zip(futures, parts):
            self.running[future] = (first, end, time.monotonic())
            future.add_done_callback(self.done.put)

    def task(self, function, *arguments, **more):
        return self.client.submit(function, *arguments, key=self.key(function), **more)

    def key(self, function):
        """A name that no other task has."""
        return f"crt-{function.__name__}-{self.name}-{next(self.serial)}"

    def count_threads(self):
        now = time.monotonic()
        if self.threads and now < self.asked:
            return
        self.asked = now + 1
        workers = self.client.nthreads()
        if self.bad:
            workers = {address: threads for address, threads in workers.items() if address not in self.bad}
            self.good = list(workers)
        self.threads = sum(workers.values())
        self.most_threads = max(self.most_threads, self.threads)
        if not workers and now > self.began + 10 and not self.warned:
            self.warned = True
            LOGGER.warning("the Dask cluster has no workers; waiting for some")

    @reaching
    def collect(self, seconds):
        """Takes back what is done, after waiting so long at most; whether there was anything."""
        finished = []
        try:
            finished.append(self.done.get(timeout=seconds))
            while True:
                finished.append(self.done.get_nowait())
        except queue.Empty:
            pass
        good = [future for future in finished if future in self.running and self.is_good(future)]
        for future in good:
            first, end, began = self.running.pop(future)
            self.size.learn(end - first, time.monotonic() - began)
            self.samples += end - first
            self.parts += 1
        self.pile_up(good)
        return bool(good)

    def is_good(self, future):
        if future.status == "finished":
            return True
        first, end, _ = self.running.pop(future)
        error = failure_of(future, f"samples {first}-{end}")
        tries = self.failures[first] = self.failures.get(first, 0) + 1
        if error.kind != Kind.DEVICE or tries >= FAILURES or not isinstance(error, PartFailed):
            raise error
        # A worker that fails at once would otherwise take one part after the other.
        self.bad.add(error.worker)
        self.asked = 0
        self.count_threads()
        if not self.good:
            raise error
        LOGGER.warning("samples %d-%d are rendered again on another worker: %s", first, end, error)
        self.redone += 1
        self.missing.give_back(first, end)
        return False

    def pile_up(self, futures):
        """Adds films that lie on one worker."""
        if not futures:
            return
        holders = self.client.who_has(futures)
        for future in futures:
            worker = next(iter(holders.get(future.key) or ["lost"]))
            pile = self.piles.setdefault(worker, [])
            pile.append(future)
            if len(pile) >= PILE:
                self.piles[worker] = [self.sum_on(worker, pile)]

    @reaching
    def harvest(self, now):
        """Brings the sum of what is done here, when it is time or wanted `now`; whether it has come."""
        if self.coming is not None:
            return self.coming.done() and self.take_in()
        wait = max(self.every, 2 * self.threads / PARTS_A_SECOND)
        due = time.monotonic() > self.merged + wait and not self.ends_within(wait)
        if self.piles and (now or self.soon or due):
            self.soon = False
            self.merge()
        return False

    def ends_within(self, seconds):
        """True if all parts will be done so soon that what is done can come with them. A checkpoint is not
put off, nor are the films of a number of workers at which the end would be all sums."""
        if self.checkpoint is not None or self.size.speed is None or len(self.piles) > FEW:
            return False
        left = self.missing.left + sum(end - first for first, end, _ in self.running.values())
        return left < self.size.speed * self.threads * seconds

    def sum_on(self, worker, pile):
        """The future of the sum of films that lie on this worker."""
        if len(pile) == 1:
            return pile[0]
        self.merges += 1
        return self.task(added, pile, workers=[worker], allow_other_workers=True, priority=URGENT)

    def merge(self):
        piles, self.piles = self.piles, {}
        if len(piles) <= FEW:
            futures = [self.sum_on(worker, pile) for worker, pile in piles.items()]
        else:
            futures = [future for pile in piles.values() for future in pile]
        while len(futures) > 1:
            groups = [futures[i:i + BRANCH] for i in range(0, len(futures), BRANCH)]
            futures = [self.task(added, group, priority=URGENT) if len(group) > 1 else group[0]
                       for group in groups]
            self.merges += sum(len(group) > 1 for group in groups)
        self.coming = futures[0]

    def take_in(self):
        if self.coming.status != "finished":
            raise failure_of(self.coming, "a sum of films")
        film = self.coming.result()
        self.coming = None
        self.kept = film if self.kept is None else self.kept + film
        self.error = self.kept.error
        self.merged = time.monotonic()
        if self.checkpoint is not None:
            self.kept.save(self.checkpoint)
        return True

    @reaching
    def finish(self):
        """Brings everything that is done here, and drops what is not."""
        self.client.cancel(list(self.running))
        self.running = {}
        while self.coming is not None or self.piles:
            if self.coming is None:
                self.merge()
            # result() waits in a way that Ctrl-C can end; take_in reports its error.
            self.coming.exception()
            self.take_in()

    def cancel(self):
        """Leaves nothing on the cluster."""
        left = [*self.running, *(future for pile in self.piles.values() for future in pile), self.sent]
        with contextlib.suppress(*GONE, RuntimeError):
            self.client.cancel(left + ([self.coming] if self.coming is not None else []))
        self.running, self.piles, self.coming = {}, {}, None

    def report(self, stop):
        return {"stop": stop,
                "samples": {"per_pixel": self.kept.samples, "resumed": self.resumed},
                "seconds": {"total": time.monotonic() - self.began},
                "distributed": {"parts": self.parts, "parts_redone": self.redone, "merges": self.merges,
                                "threads_most": self.most_threads}}


def failure_of(future, what):
    """The crt.Error of a future that failed."""
    if future.status != "error":
        return Error(f"the Dask cluster is gone: {what} became '{future.status}'", Kind.DEVICE)
    error = future.exception()
    if isinstance(error, Error):
        return error
    if isinstance(error, KilledWorker):
        # Not to be tried again: where a scene takes more memory than workers have, it would end them all.
        return Error(f"{what} ended every worker that tried them; there may be too little memory: {error}",
                     Kind.BACKEND)
    hint = "; crt must be installed on every worker" if isinstance(error, ImportError) else ""
    return Error(f"a Dask worker fails with {type(error).__name__}: {error}{hint}", Kind.BACKEND)
