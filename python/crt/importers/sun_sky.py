"""Mitsuba's clear sky and its sun (Hosek and Wilkie 2012 and 2013) as a CIE sky and a sun of crt.

crt has the distribution of the CIE standard skies and not that of Hosek and Wilkie. The illuminance and the
colour of level ground are those of Mitsuba."""

import datetime
import math

import numpy as np

# The XYZ of level white ground in the open, under the sky alone and under the sun alone, by turbidity and
# elevation; a light of D65 with radiance 1 all around gives Y = 1. Measured with Mitsuba 3.9.1, variant
# scalar_spectral, plugin sunsky, albedo 0.3: 64 pixels of 8192 samples each.
TURBIDITIES = np.array([1.0, 2, 3, 4, 6, 10])
ELEVATIONS_DEG = np.array([1.0, 4, 10, 20, 40, 60, 90])
SKY_XYZ = np.array([
    [[0.01339, 0.01445, 0.01394], [0.02142, 0.02351, 0.02941], [0.0321, 0.03515, 0.0537],
     [0.04319, 0.04676, 0.08111], [0.0562, 0.05927, 0.11531], [0.06332, 0.06583, 0.1322],
     [0.06857, 0.07333, 0.14054]],
    [[0.01354, 0.0145, 0.01384], [0.02244, 0.02445, 0.02958], [0.03434, 0.03747, 0.05471],
     [0.04702, 0.05074, 0.08339], [0.06151, 0.06502, 0.11922], [0.06862, 0.07169, 0.13786],
     [0.07511, 0.0801, 0.14524]],
    [[0.01359, 0.01443, 0.01366], [0.02388, 0.02584, 0.02991], [0.03771, 0.04093, 0.05585],
     [0.05287, 0.05688, 0.08655], [0.0707, 0.07465, 0.12634], [0.07851, 0.08238, 0.14684],
     [0.08571, 0.09116, 0.15072]],
    [[0.01347, 0.01421, 0.01332], [0.0257, 0.02759, 0.03033], [0.04283, 0.04599, 0.05832],
     [0.06213, 0.06619, 0.09269], [0.08521, 0.08996, 0.13802], [0.09475, 0.0995, 0.16226],
     [0.10195, 0.10726, 0.16615]],
    [[0.01292, 0.01357, 0.01278], [0.028, 0.02975, 0.03054], [0.04982, 0.05299, 0.06007],
     [0.07516, 0.07969, 0.09736], [0.10902, 0.11523, 0.15568], [0.12363, 0.13029, 0.18778],
     [0.12757, 0.13518, 0.17718]],
    [[0.0102, 0.01071, 0.01059], [0.0271, 0.02807, 0.02612], [0.05802, 0.06023, 0.05897],
     [0.10343, 0.10805, 0.11038], [0.20653, 0.21623, 0.22724], [0.28516, 0.30165, 0.31545],
     [0.22797, 0.23812, 0.26002]],
])
SUN_XYZ = np.array([
    [[0.0013, 0.00106, 0.00011], [0.00866, 0.0078, 0.00178], [0.04001, 0.03953, 0.01791],
     [0.10602, 0.10813, 0.07054], [0.23378, 0.24077, 0.19099], [0.331, 0.34149, 0.28743],
     [0.38966, 0.40222, 0.34648]],
    [[0.00103, 0.00083, 0.00009], [0.00759, 0.00683, 0.00157], [0.03784, 0.03733, 0.01693],
     [0.10305, 0.10501, 0.06853], [0.23027, 0.23705, 0.18806], [0.32729, 0.33755, 0.28418],
     [0.38591, 0.39823, 0.3431]],
    [[0.0007, 0.00056, 0.00006], [0.00614, 0.00552, 0.00129], [0.0345, 0.03396, 0.01543],
     [0.09833, 0.10008, 0.06535], [0.22457, 0.23101, 0.18335], [0.32127, 0.33118, 0.2789],
     [0.37977, 0.39174, 0.33756]],
    [[0.00037, 0.00029, 0.00003], [0.00438, 0.00392, 0.00094], [0.02965, 0.02907, 0.01324],
     [0.09101, 0.09243, 0.06041], [0.21549, 0.22143, 0.17585], [0.31156, 0.3209, 0.27038],
     [0.3698, 0.38117, 0.3286]],
    [[0.0001, 0.00008, 0.00001], [0.00238, 0.00212, 0.00052], [0.02239, 0.0218, 0.00998],
     [0.07885, 0.07976, 0.05222], [0.19961, 0.20467, 0.16274], [0.29435, 0.30269, 0.25529],
     [0.35204, 0.36237, 0.31265]],
    [[0, 0, 0], [0.00005, 0.00004, 0.00001], [0.00344, 0.0032, 0.0015], [0.02971, 0.02926, 0.01936],
     [0.11858, 0.11984, 0.0961], [0.19998, 0.20343, 0.17269], [0.25188, 0.25684, 0.22297]],
])
LUX = math.pi * 683.002 * 106.856895  # Illuminance in lx of ground whose Y is 1.
HAZY = 4  # From this turbidity on the sky is the standard's "clear, polluted" instead of "clear".
TO_SRGB = np.array([[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560],
                    [0.0556434, -0.2040259, 1.0572252]])


def ground_xyz(table, turbidity, elevation_deg):
    """The XYZ (3) of level white ground by one of the tables, linear in both, held at its ends."""
    at_turbidity = [np.interp(turbidity, TURBIDITIES, table[:, e, c]) for e in range(len(ELEVATIONS_DEG))
                    for c in range(3)]
    by_elevation = np.reshape(at_turbidity, (-1, 3))
    return np.array([np.interp(elevation_deg, ELEVATIONS_DEG, by_elevation[:, c]) for c in range(3)])


def spectrum(xyz):
    """The colour of a light as crt's rgb of luminance 1."""
    linear = np.clip(TO_SRGB @ xyz, 0, None) / max(xyz[1], 1e-12)
    return {"rgb": [float(v) for v in linear], "space": "linear"}


def sky(turbidity, elevation_deg, scale):
    """crt's keys of the sky without direction and zenith."""
    xyz = ground_xyz(SKY_XYZ, turbidity, elevation_deg)
    kind = 13 if turbidity >= HAZY else 12
    illuminance = float(LUX * scale * xyz[1])
    return {"type": kind, "horizontal_illuminance_lx": illuminance, "spectrum": spectrum(xyz)}


def sun(turbidity, elevation_deg, scale, diameter_deg):
    """crt's keys of the sun without direction."""
    xyz = ground_xyz(SUN_XYZ, turbidity, elevation_deg)
    facing = LUX * scale * xyz[1] / math.sin(math.radians(max(elevation_deg, ELEVATIONS_DEG[0])))
    return {"type": "sun", "angular_diameter_deg": diameter_deg, "illuminance_lx": float(facing),
            "spectrum": spectrum(xyz)}


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
