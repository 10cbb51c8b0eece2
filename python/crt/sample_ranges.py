"""Keeps the samples of a render that are still to be done, in parts of a wanted size."""

ENDLESS = 1 << 31  # Of a render that time or error ends.
STEP = 16  # Samples take turns between 16 sequences at most: parts of whole turns leave them equally full.
SMALL = 4 * STEP  # Parts of fewer are not rounded to whole turns, which made 32 samples of 17.


class Missing:
    """The samples of [0, end) that are in none of the ranges `done`."""

    def __init__(self, done, end):
        self.gaps = []
        first = 0
        for begin, until in sorted(done):
            self.give_back(first, min(begin, end))
            first = max(first, until)
        self.give_back(first, end)

    @property
    def left(self):
        return sum(end - first for first, end in self.gaps)

    def give_back(self, first, end):
        """These samples are to be done again."""
        if first < end:
            self.gaps.append((first, end))
            self.gaps.sort()

    def take(self, samples):
        """(first, end) of the next part, of about this number of samples; None if nothing is left."""
        if not self.gaps:
            return None
        first, end = self.gaps.pop(0)
        step = STEP if samples >= SMALL else 2 if samples > 1 else 1
        cut = min(end, -(-(first + max(1, int(samples))) // step) * step)
        self.give_back(cut, end)
        return first, cut


class PartSize:
    """Number of samples of the next part: as many as take `seconds`, by the speed of earlier ones;
    fewer to begin with and towards the end, so that all workers end together.

    `fixed` samples instead, where that is given.
    """

    FEWEST = 2
    # From part to part at most. The overhead of a short part makes workers look slower than they are: the
    # next part gets shorter than wanted, not longer.
    GROWTH = 64

    def __init__(self, fixed=None):
        self.fixed = fixed
        self.speed = None  # Samples a second of one thread of Dask.
        self.largest = STEP

    def learn(self, samples, seconds):
        """Records the time of a part with this number of samples."""
        speed = samples / max(seconds, 1e-3)
        self.speed = speed if self.speed is None else 0.7 * self.speed + 0.3 * speed
        self.largest = max(self.largest, self.GROWTH * samples)

    def is_known(self, seconds):
        """True if parts may have the size that takes this time, not only a few times that of earlier
        ones."""
        return self.fixed is not None or (self.speed is not None and self.largest >= self.speed * seconds)

    def shrinks(self, seconds, left, threads):
        """True if the end is so near that parts get shorter than `seconds`, or, of a fixed size, that each
        thread gets two more at most."""
        wanted = self.fixed if self.fixed is not None else (self.speed or 0) * seconds
        return left / (2 * max(threads, 1)) < wanted

    def next(self, seconds, least, left, threads):
        """Shares `left` samples between this number of threads, in parts of at least this number of
        seconds."""
        if self.fixed is not None:
            return self.fixed
        share = left / (2 * max(threads, 1))
        if self.speed is None:
            return max(self.FEWEST, min(self.largest, share))
        wanted = self.speed * seconds
        return max(self.FEWEST, min(self.largest, wanted, max(share, self.speed * least)))
