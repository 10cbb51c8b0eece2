"""Means of independent renders, whole or tile by tile, and how sure they are."""

import numpy as np

TILES = 8


class Pool:
    """The mean of independent renders, each weighted with its samples, and how sure it is."""

    def __init__(self):
        self.images, self.weights = [], []

    def add(self, image, samples):
        self.images.append(image.astype(np.float32))
        self.weights.append(float(samples))

    def mean(self):
        return np.average(self.images, axis=0, weights=self.weights)

    def of(self, function):
        """Mean and variance of that mean of a linear function of the image: renders are unbiased and
        independent, so each is evidence for the other."""
        w = np.array(self.weights) / sum(self.weights)
        values = np.array([function(i) for i in self.images], dtype=np.float64)
        mean = np.tensordot(w, values, 1)
        return mean, np.tensordot(w**2, (values - mean) ** 2, 1) * len(w) / (len(w) - 1)


def tiles(image):
    y = image[:, :, 1].astype(np.float64)
    high, wide = y.shape[0] // TILES, y.shape[1] // TILES
    return y[: high * TILES, : wide * TILES].reshape(TILES, high, TILES, wide).mean(axis=(1, 3))


def ratio(a, b, function):
    """a/b with its standard error, to first order, of a function of both pools."""
    (ma, va), (mb, vb) = a.of(function), b.of(function)
    return ma / mb, np.abs(ma / mb) * np.sqrt(va / ma**2 + vb / mb**2)
