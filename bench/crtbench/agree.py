"""Renders the scenes of bench/scenes/agree by crt and by Mitsuba 3, and judges whether they agree."""

import re

import mitsuba as mi
import numpy as np

from . import agree_scene
from .pool import TILES, Pool, ratio, tiles
from .program import Failure
from .results import Results

FOLDER = "bench/scenes/agree"
MARGIN = 0.005      # Of the image's mean: what counts as equal.
CONFIDENCE = 0.95


def beyond(confidence, of, dof):
    """The point that the largest of this number of values of Student's distribution passes with 1 -
    confidence
    (Šidák); one-sided."""
    t = np.linspace(0.0, 100.0, 200_001)
    density = (1 + t**2 / dof) ** (-(dof + 1) / 2)
    below = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return float(np.interp(confidence ** (1 / of), 0.5 + 0.5 * below / below[-1], t))


def write_picture(path):
    """The values of textured scenes: colours that change across and down, and a corner that is unlike the
    others."""
    v, u = np.mgrid[0:12, 0:16] / 16
    rgb = np.stack([0.15 + 0.7 * u, 0.2 + 0.6 * v, 0.75 - 0.5 * u * v], axis=2)
    rgb[:3, :4] = [0.8, 0.1, 0.1]
    mi.Bitmap(np.round(255 * rgb).astype(np.uint8)).write(str(path))


def write_normals(path):
    """The values of scenes with normal maps: waves across, and a slope up the picture that grows."""
    v, u = np.mgrid[0:24, 0:32] / 32
    normals = np.stack([0.2 * np.sin(4 * np.pi * u), 0.25 * (0.75 - v) - 0.1, np.ones_like(u)], axis=2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    mi.Bitmap(np.round(127.5 * (normals + 1)).astype(np.uint8)).write(str(path))


def write_sky(path):
    """The values of environment images: a bright spot over a horizon, and colours that change all around. So
    smooth that it is the same between texels and within."""
    v, u = (np.mgrid[0:256, 0:512] + 0.5) / 512
    rgb = np.stack([0.5 + 0.4 * np.cos(2 * np.pi * u), 0.4 + 0.3 * np.sin(2 * np.pi * u), 0.9 - v], axis=2)
    rgb *= np.sin(2 * np.pi * v)[:, :, None]  # the same all around at the poles
    rgb += 0.2 + 8 * np.exp(-((u - 0.7) ** 2 + (v - 0.12) ** 2) / 0.003)[:, :, None]
    mi.Bitmap(rgb.astype(np.float32)).write(str(path))


def side_by_side(channels):
    """Channels of a spectral film as one picture of their luminance, so that columns of tiles are theirs."""
    return np.repeat(np.concatenate(channels, axis=1)[:, :, None], 3, axis=2)


def crt_image(program, backend, file, samples, seed):
    """XYZ, (height, width, 3), rows from the top; of a spectral film, its bins and responses."""
    bands = agree_scene.bands(file)
    image = program.scratch / ("image.exr" if bands else "image.pfm")
    settings = ["film.color_space=xyz", f"sampler.seed={seed}"]
    if around := agree_scene.environment_image(file):  # crt looks beside the scene alone
        settings.append(f"environment.image={program.scratch / around}")
    where = {"CRT_MESH_PATH": str(program.scratch)}
    program.render(file, backend, ["--spp", samples], [image], settings, environment=where)
    if bands:
        read = mi.Bitmap(str(image))
        names = [field.name for field in read.struct_()]
        return side_by_side([np.array(read)[:, :, names.index(band.channel)] for band in bands])
    data = image.read_bytes()
    header = re.match(rb"PF\n(\d+) (\d+)\n-[0-9.]+\n", data)
    width, height = int(header[1]), int(header[2])
    return np.frombuffer(data[header.end():], dtype="<f4").reshape(height, width, 3)[::-1]


class Agreement:
    """One scene in both programs: the ratio of the means of luminance, and of every tile after it, with
    their standard errors."""

    def __init__(self, ours, theirs):
        def mean(image):
            return image[:, :, 1].mean(dtype=np.float64)

        self.ratio, self.ratio_se = (float(v) for v in ratio(theirs, ours, mean))
        (a, va), (b, vb) = ours.of(tiles), theirs.of(tiles)
        whole = float(ours.of(mean)[0])
        self.tiles = (b / self.ratio - a) / whole           # in units of the image's mean
        self.tiles_se = np.sqrt(va + vb / self.ratio**2) / whole
        # At least this number, however unlike the two variances are (Welch).
        self.dof = len(ours.images) - 1

    def reach(self):
        """Half of the ratio's 95 % interval."""
        return beyond(0.975, 1, self.dof) * self.ratio_se

    def mean_agrees(self):
        """Two one-sided tests."""
        reach = beyond(CONFIDENCE, 1, self.dof) * self.ratio_se
        return abs(self.ratio - 1) + reach < MARGIN

    def worst_excess(self):
        """The largest part of a tile's difference beyond the margin, in its standard errors."""
        return float(((np.abs(self.tiles) - MARGIN) / np.maximum(self.tiles_se, 1e-12)).max())

    def chance(self):
        """The bound of the largest of all tiles by chance."""
        return beyond(CONFIDENCE, TILES * TILES, self.dof)

    def tiles_agree(self):
        return self.worst_excess() < self.chance()

    def resolves(self):
        """True if a difference of two margins in the median tile would have been seen."""
        return float(np.median(self.tiles_se)) * self.chance() < MARGIN


def verdict(found, documented):
    if found.mean_agrees() and found.tiles_agree():
        return "agree" if found.resolves() else "not known: too few samples"
    return "differ as documented" if documented else "DIFFER"


class Translated:
    """A scene in Mitsuba. Of a spectral film one scene a band: where bands have edges in common, Mitsuba's
    mean over a constant spectrum is up to 0.2 % off as long as it renders them together."""

    def __init__(self, file, folder, samples):
        self.bands = agree_scene.bands(file)
        self.samples = samples
        self.scenes = [
            mi.load_dict(agree_scene.translate(file, folder, samples, band))
            for band in self.bands or [None]
        ]

    def image(self, seed):
        """As crt_image."""
        images = [np.array(mi.render(s, spp=self.samples, seed=seed)) for s in self.scenes]
        if not self.bands:
            return images[0][:, :, :3]
        return side_by_side([i[:, :, 0] / band.integral for i, band in zip(images, self.bands)])


def measure(program, arguments):
    mi.set_variant(arguments.variant)
    mi.set_log_level(mi.LogLevel.Error)
    backend = arguments.backend or program.backends(["cuda", "embree", "opencl"])[0][0]
    samples, renders = (4, 2) if arguments.tiny else (arguments.samples, arguments.renders)
    files = sorted((program.repository / FOLDER).glob("*.yaml"))
    if arguments.scenes:
        files = [f for f in files if f.stem in arguments.scenes]
        if unknown := set(arguments.scenes) - {f.stem for f in files}:
            raise Failure(f"there is no {FOLDER}/{sorted(unknown)[0]}.yaml")
    results = Results(program, arguments, "agree", "Do crt and Mitsuba 3 agree?")
    write_picture(program.scratch / "picture.png")
    write_normals(program.scratch / "normals.png")
    write_sky(program.scratch / "sky.exr")
    rows, notes, failed = [], [], 0
    for file in files:
        documented = agree_scene.difference(file)
        ours, theirs = Pool(), Pool()
        translated = Translated(file, program.scratch, samples)
        for seed in range(renders):
            ours.add(crt_image(program, backend, file, samples, 1 + seed), samples)
            theirs.add(translated.image(1 + seed), samples)
        found = Agreement(ours, theirs)
        said = verdict(found, documented)
        failed += said == "DIFFER"
        rows.append(
            [
                f"`{file.stem}`: {agree_scene.title(file)}",
                f"{found.ratio - 1:+.3%} ± {found.reach():.3%}",
                f"{np.abs(found.tiles).max():.2%}",
                f"{found.worst_excess():.1f}",
                f"**{said}**",
            ]
        )
        print(*rows[-1], flush=True)
        if documented:
            notes.append(f"`{file.stem}`: {documented}")
        results.data[file.stem] = {
            "mitsuba_over_crt": found.ratio,
            "standard_error": found.ratio_se,
            "largest_tile": float(np.abs(found.tiles).max()),
            "median_standard_error_of_tiles": float(np.median(found.tiles_se)),
            "worst_excess": found.worst_excess(),
            "verdict": said,
        }
    bound = beyond(CONFIDENCE, TILES * TILES, renders - 1)
    results.paragraph(
        f"Scenes of `{FOLDER}`, translated by `bench/crtbench/agree_scene.py`, rendered {renders} times by "
        f"crt on `{backend}` and by Mitsuba {mi.__version__} (`{arguments.variant}`) with {samples} samples "
        f"a pixel and separate seeds. *Mean*: luminance of Mitsuba's image over that of crt's, less "
        f"one, with its 95 % interval. It agrees when two one-sided tests at 95 % put it within "
        f"{MARGIN:.1%}. *Worst tile*: the largest difference in one of {TILES} × {TILES} tiles after that "
        f"common factor, in units of the image's mean. *Excess*: what is beyond {MARGIN:.1%} of it, in "
        f"standard errors; chance gives up to {bound:.2f} in one of {TILES * TILES} tiles at 95 %. Both "
        "programs have different tables of the observer, which alone make 0.1 %."
    )
    results.table(["scene", "Mitsuba over crt, mean", "worst tile", "excess", "verdict"], rows)
    results.claim(
        "crt and Mitsuba 3 agree where their models are the same",
        [f"{renders} renders of each scene by each program, {samples} samples per pixel, separate seeds; "
         f"crt on `{backend}`, Mitsuba {mi.__version__} (`{arguments.variant}`). Images agree when two "
         f"one-sided tests at 95 % put the ratio of the mean luminances within {MARGIN:.1%} of 1, and none "
         f"of {TILES} × {TILES} tiles of the image differs, once that ratio is divided out, by more than "
         f"{MARGIN:.1%} "
         "and what chance explains at 95 %. The programs have different tables of the observer, which alone "
         "cause 0.1 %.",
         *notes],
        ["scene", "Mitsuba over crt, mean", "largest difference of a tile", "verdict"],
        [[*row[:3], row[4]] for row in rows],
    )
    for note in notes:
        results.paragraph(note)
    results.command(f"crt render {FOLDER}/SCENE.yaml --backend {backend} --spp {samples} -o IMAGE.pfm")
    if arguments.python:
        results.shown = {arguments.python: "PYTHON"}
    results.write()
    return 1 if failed and not arguments.tiny else 0
