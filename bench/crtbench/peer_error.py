"""The error of a contestant's images against a converged one, and how long it takes to reach one."""
import math

import numpy as np

from . import log_log

REFERENCE_RENDERS = 8


def room_pixels(image):
    """Those that do not see the lamp, nor does a neighbour: what sees it is many times brighter than
    anything that it lights."""
    seen = image[:, :, 1] > 8 * image[:, :, 1].mean()
    padded = np.pad(seen, 1)
    height, width = seen.shape
    return ~np.any([padded[r:r + height, c:c + width] for r in range(3) for c in range(3)], axis=0)


class Reference:
    """A converged image, the mean of renders by crt with seeds that nothing else has, and the variance of
    that mean in every pixel."""

    def __init__(self, contestant, samples):
        images = np.array(
            [contestant.render(samples, 70_000_000 + r).image for r in range(REFERENCE_RENDERS)]
        )
        self.samples = REFERENCE_RENDERS * samples
        self.mean = images.mean(axis=0)
        self.variance = images.var(axis=0, ddof=1) / REFERENCE_RENDERS
        self.room = room_pixels(self.mean)
        self.error = math.sqrt(self.variance[..., 1].mean()) / self.mean[..., 1].mean()


def relative_error(images, unit, reference):
    """Relative RMSE of one render from R of them, and its standard error by the jackknife over renders:
    {metric: (error, se)}. `unit`: what their pixels are divided by. `error`: luminance of all pixels;
    `error_xyz`: X, Y and Z of all pixels; `error_room`: luminance of the pixels that see no lamp, over
    their mean; `spread`: luminance of all pixels, about the renders' own mean."""
    stack, room = np.array(images) / unit, reference.room

    def against(values, truth, variance):
        squares = ((values - truth) ** 2).reshape(len(values), -1).mean(axis=1)
        return jackknife(
            squares, lambda kept: math.sqrt(max(0.0, kept.mean() - variance.mean())) / truth.mean()
        )

    mean, variance = reference.mean, reference.variance
    return {
        "error": against(stack[..., 1], mean[..., 1], variance[..., 1]),
        "error_xyz": against(stack, mean, variance),
        "error_room": against(stack[..., 1][:, room], mean[..., 1][room], variance[..., 1][room]),
        "spread": jackknife(
            stack[..., 1], lambda kept: math.sqrt(kept.var(axis=0, ddof=1).mean()) / kept.mean()
        ),
    }


def jackknife(values, estimate):
    count = len(values)
    without = [estimate(np.delete(values, r, axis=0)) for r in range(count)]
    return estimate(values), math.sqrt(
        (count - 1) / count * sum((w - np.mean(without)) ** 2 for w in without)
    )


def seconds_to(points, key, target, metric="error"):
    """(seconds, whether extrapolated, relative standard error): between points log-log; beyond them along
    the line through the last three."""
    points = [
        p for p in points if p[metric] > 0 and p[key] > 0
    ]  # Of the smallest images, a start may have cost more than all.
    if len(points) < 2:
        return math.nan, True, math.nan
    x, y = [math.log(p[metric]) for p in points], [math.log(p[key]) for p in points]
    goal = math.log(target)
    uncertain = 2 * max(
        p[f"{metric}_se"] / p[metric] for p in points[-2:]
    )  # Time goes with the inverse square of error.
    for i in range(1, len(points)):
        if x[i] <= goal <= x[i - 1]:
            part = (goal - x[i - 1]) / (x[i] - x[i - 1])
            return math.exp(y[i - 1] + part * (y[i] - y[i - 1])), False, uncertain
    return log_log.PowerLaw([(p[metric], p[key]) for p in points[-3:]])(target), True, uncertain


def slope_of(points):
    """Of log error over log samples, of the last three points; of the smallest errors, the reference's
    variance may have taken all."""
    known = [(p["spp"], p["error"]) for p in points if p["error"] > 0]
    return log_log.PowerLaw(known[-3:]).exponent if len(known) > 1 else math.nan
