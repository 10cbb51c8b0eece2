"""Mitsuba's plugins sunsky, sky and sun, which have the model of crt's clear sky."""

import datetime
import math

import numpy as np

from . import matrices
from .losses import refuse

IGNORED = ("resolution", "stretch", "extend", "sun_rays", "sun_samples", "complex_sun", "to_world",
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
        elevation, azimuth = position(when, given["latitude"], given["longitude"])
        level = math.cos(elevation)
        east, north = math.sin(azimuth) * level, math.cos(azimuth) * level
        # Older versions: x is east and z south. Later ones: x is south and y west.
        return np.array([east, math.sin(elevation), -north] if self.older else
                        [-north, -east, math.sin(elevation)])

    def keys(self, albedo):
        """The keys of crt's clear sky, of the same model."""
        made = {"turbidity": self.turbidity, "ground_albedo": albedo, "direction": -self.towards,
                "up": self.up}
        for key, name, without in (("scale", "sky_scale", "sun"), ("sun_scale", "sun_scale", "sky")):
            made[key] = 0 if self.plugin.kind == without else \
                self.scale * max(self.plugin.number(name, 1), 0)
        diameter = self.plugin.number("sun_aperture", 0.5358) * self.plugin.number("sun_radius_scale", 1)
        if diameter != 0.5358 and made["sun_scale"] > 0:
            made["sun_diameter_deg"] = min(max(diameter, 0.001), 90.0)
        return made


def together(first, second):
    """One clear sky of two, of which one is a sky alone and the other a sun alone; or None."""
    if "clear_sky" not in first or "clear_sky" not in second:
        return None
    sky, sun = sorted((first["clear_sky"], second["clear_sky"]), key=lambda keys: keys["sun_scale"] > 0)
    alone = sky["sun_scale"] == 0 and sun["scale"] == 0
    of_sun = {key: sun[key] for key in ("direction", "sun_scale", "sun_diameter_deg") if key in sun}
    return {"clear_sky": sky | of_sun} if alone else None


def position(when, latitude_deg, longitude_deg):
    """Elevation and azimuth of the sun in radians, the azimuth from north through east. `when` is Universal
    Time. Source: the Astronomical Almanac's low precision formulas, 0.01 degrees from 1950 to 2050."""
    days = (when - datetime.datetime(2000, 1, 1, 12)).total_seconds() / 86400
    mean_longitude = 280.460 + 0.9856474 * days
    anomaly = math.radians(357.528 + 0.9856003 * days)
    longitude = math.radians(mean_longitude + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly))
    obliquity = math.radians(23.439 - 4e-7 * days)
    ascension = math.atan2(math.cos(obliquity) * math.sin(longitude), math.cos(longitude))
    declination = math.asin(math.sin(obliquity) * math.sin(longitude))
    sidereal = math.radians(280.46062 + 360.985647 * days + longitude_deg)
    hour_angle, latitude = sidereal - ascension, math.radians(latitude_deg)
    elevation = math.asin(math.sin(latitude) * math.sin(declination)
                          + math.cos(latitude) * math.cos(declination) * math.cos(hour_angle))
    azimuth = math.atan2(-math.cos(declination) * math.sin(hour_angle),
                         math.cos(latitude) * math.sin(declination)
                         - math.sin(latitude) * math.cos(declination) * math.cos(hour_angle))
    return elevation, azimuth
