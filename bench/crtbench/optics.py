"""Fresnel's equations, for renderers whose materials have other parameters."""

import numpy as np


def fresnel(cosine, ior):
    """Reflectance of unpolarised light that comes from outside."""
    inside = np.sqrt(1 - (1 - cosine**2) / ior**2)
    parallel = (ior * cosine - inside) / (ior * cosine + inside)
    across = (cosine - ior * inside) / (cosine + ior * inside)
    return (parallel**2 + across**2) / 2


def under_coat(reflectance, ior):
    """Albedo of the layer below a plastic's surface, of the light that gets there: with what the surface
    throws back from below, again and again."""
    cosine = (np.arange(10_000) + 0.5) / 10_000
    outside = float((2 * cosine * fresnel(cosine, ior)).mean())
    inside = 1 - (1 - outside) / ior**2
    return [(1 - inside) * r / (1 - inside * r) for r in reflectance]


def mirrored(eta, k):
    """Reflectance of a conductor at a right angle, by colour."""
    return [((n - 1) ** 2 + a**2) / ((n + 1) ** 2 + a**2) for n, a in zip(eta, k)]
