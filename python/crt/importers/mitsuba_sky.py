"""Mitsuba's plugins sunsky, sky and sun: where their sun stands and how bright they are."""

import datetime
import math

import numpy as np

from . import matrices, sun_sky
from .losses import refuse

IGNORED = ("resolution", "stretch", "extend", "sun_rays", "sun_samples", "albedo", "complex_sun", "to_world",
           "sampling_weight")


class Daylight:
    """`older`: the scene is of a version before 2, in which y points up; later z does."""

    def __init__(self, plugin, older):
        self.plugin, self.older = plugin, older
        matrix = plugin.transform()[:3, :3]
        up = matrices.unit(matrix @ ([0, 1, 0] if older else [0, 0, 1]))
        towards = plugin.triple("sun_direction", None)
        towards = matrix @ self.by_time() if towards is None else np.array(towards, float)
        self.up, self.towards = up, matrices.unit(towards)
        if up is None or self.towards is None:
            refuse(plugin.place, f"{plugin} has no direction: its transform or its 'sun_direction' is 0")
        self.elevation_deg = math.degrees(math.asin(min(max(float(self.towards @ up), -1), 1)))
        self.turbidity = min(max(plugin.number("turbidity", 3), 1), 10)
        self.scale = max(plugin.number("scale", 1), 0)
        for name in IGNORED:
            plugin.left.discard(name)

    def by_time(self):
        """Towards the sun, in the plugin's own axes, by its date, time and place (Tokyo in summer)."""
        given = {name: self.plugin.number(name, default) for name, default in (
            ("year", 2010), ("month", 7), ("day", 10), ("hour", 15), ("minute", 0), ("second", 0),
            ("latitude", 35.6894), ("longitude", 139.6917), ("timezone", 9))}
        try:
            day = datetime.datetime(int(given["year"]), int(given["month"]), int(given["day"]))
            when = day + datetime.timedelta(hours=given["hour"] - given["timezone"], minutes=given["minute"],
                                            seconds=given["second"])
        except (ValueError, OverflowError) as error:
            refuse(self.plugin.place, f"{self.plugin} has no such date: {error}")
        elevation, azimuth = sun_sky.position(when, given["latitude"], given["longitude"])
        level = math.cos(elevation)
        east, north = math.sin(azimuth) * level, math.cos(azimuth) * level
        # Older versions: x is east and z south. Later ones: x is south and y west.
        return np.array([east, math.sin(elevation), -north] if self.older else
                        [-north, -east, math.sin(elevation)])

    def sky(self):
        """The keys of crt's sky, or None where the plugin has none."""
        scale = self.scale * max(self.plugin.number("sky_scale", 1), 0)
        if self.plugin.kind == "sun" or scale == 0:
            return None
        return sun_sky.sky(self.turbidity, self.elevation_deg, scale) | {
            "direction": -self.towards, "up": self.up}

    def sun(self):
        """The keys of crt's sun, or None where the plugin has none."""
        scale = self.scale * max(self.plugin.number("sun_scale", 1), 0)
        diameter = self.plugin.number("sun_aperture", 0.5358) * self.plugin.number("sun_radius_scale", 1)
        if self.plugin.kind == "sky" or scale == 0:
            return None
        made = sun_sky.sun(self.turbidity, self.elevation_deg, scale, min(max(diameter, 0.001), 90.0))
        return made | {"direction": -self.towards} if made["illuminance_lx"] > 0 else None
