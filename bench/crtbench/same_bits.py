"""Renders every scene in many ways and compares the images bit by bit, all channels. The reference is the
OpenCL backend with its defaults; variations of Embree (threads, tiles, resumed, merged) are compared with
Embree's own image.

The images are half of it: the films, double sums of every pixel, are compared too. Where Embree's differ,
both backends render every sample number alone and the samples that differ are counted. Between the fast
backends all samples are compared; backends of one thread, and variations of one backend, which a quarter of
the samples shows as well, have fewer. Times nothing, so it needs no quiet machine.
"""

import ctypes
import math
import signal
import struct
import subprocess
import time

from .program import Failure
from .results import Results

REFERENCE = "opencl"
FAST = ("opencl", "embree", "cuda")
SAMPLE_BOUND = 1e-6   # Share of samples in which Embree and OpenCL may differ.
FILM_BOUND = (
    2.0**-100
)  # Of a sum: by which two orders of adding the same samples may differ (docs/decisions/0002-film-sums.md).


class FilmDifference:
    """Differences between two films. `pixels`: whose sums, count or primitive differ in any bit;
    `exact_pixels`:
    whose count or primitive differs; `relative`: the largest difference of two sums, hi + lo, over the
    larger of them."""

    def __init__(self, pixels=0, exact_pixels=0, relative=0.0):
        self.pixels, self.exact_pixels, self.relative = pixels, exact_pixels, relative

    @property
    def beyond_promise(self):
        return self.exact_pixels > 0 or not self.relative <= FILM_BOUND

    def json(self):
        return {
            "differing_film_pixels": self.pixels,
            "differing_counts_or_primitives": self.exact_pixels,
            "largest_relative_film_difference": self.relative if math.isfinite(self.relative) else None,
            "film_beyond_promise": self.beyond_promise,
        }


class Film:
    """A .crtfilm (core/film/checkpoint.h): what is compared is sums, counts and primitives of every pixel,
    not the header."""

    FORMAT = 3
    BLOCK_PIXELS = 16384

    def __init__(self, path):
        data = path.read_bytes()
        version, header_bytes = struct.unpack_from("<2I", data, 8)
        if version != self.FORMAT:
            raise Failure(
                f"{path} is a film of format {version}, and format {self.FORMAT} is what this can read"
            )
        width, height, self.channels, aovs = struct.unpack_from("<4I", data, 32)
        self.pixels = width * height
        # Two doubles for each channel, a count of 64 bits, and the primitive's number where the scene
        # requests it.
        self.strides = [self.channels * 16, 8] + ([4] if aovs & 8 else [])
        self.body = memoryview(self.unpacked(data, header_bytes))
        self.sums = self.body[:self.pixels * self.strides[0]].cast("d")

    def unpacked(self, data, at):
        """The planes of bytes of core/film/film_pack.h, put together."""
        zstd = ctypes.CDLL("libzstd.so.1")
        zstd.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
        zstd.ZSTD_decompress.restype = ctypes.c_size_t
        body = bytearray(self.pixels * sum(self.strides))
        begin = 0
        for stride in self.strides:
            for first in range(0, self.pixels, self.BLOCK_PIXELS):
                count = min(self.BLOCK_PIXELS, self.pixels - first)
                plane = ctypes.create_string_buffer(count)
                for byte in range(stride):
                    size, = struct.unpack_from("<I", data, at)
                    packed = data[at + 4:at + 4 + size]
                    at += 4 + size
                    if size == 1:
                        packed *= count
                    elif size != count:
                        if zstd.ZSTD_decompress(plane, count, packed, size) != count:
                            raise Failure("a film cannot be unpacked")
                        packed = plane.raw
                    block = begin + first * stride
                    body[block + byte:block + count * stride:stride] = packed
            begin += self.pixels * stride
        if at != len(data):
            raise Failure("a film has more in it than its pixels")
        return body

    def difference(self, other):
        if len(self.body) != len(other.body) or self.strides != other.strides:
            raise Failure("two films of one scene have different sizes")
        if self.body == other.body:
            return FilmDifference()
        begin, planes = 0, []
        for stride in self.strides:
            starts = range(begin, begin + self.pixels * stride, stride)
            planes.append(
                {
                    pixel
                    for pixel, at in enumerate(starts)
                    if self.body[at : at + stride] != other.body[at : at + stride]
                }
            )
            begin += self.pixels * stride
        sums, exact = planes[0], set().union(*planes[1:])
        relative = max(
            (
                self.relative_difference(other, pixel * self.channels + c)
                for pixel in sums
                for c in range(self.channels)
            ),
            default=0.0,
        )
        return FilmDifference(len(sums | exact), len(exact), relative)

    def relative_difference(self, other, index):
        """Of one sum; infinite where the films differ and either is not finite."""
        (high, low), (other_high, other_low) = (film.sums[2 * index:2 * index + 2] for film in (self, other))
        if (high, low) == (other_high, other_low):
            return 0.0
        if not all(map(math.isfinite, (high, low, other_high, other_low))):
            return math.inf
        # fsum is exact until it rounds once: pairs of one sum that are split in another place differ by
        # nothing.
        difference = abs(math.fsum((high, low, -other_high, -other_low)))
        return difference / max(abs(high + low), abs(other_high + other_low)) if difference else 0.0


class Images:
    """The ways to render one scene, all with the same samples."""

    def __init__(self, program, scene, size, spp):
        self.program, self.scene, self.size, self.spp = program, scene, size, spp
        self.folder = program.scratch / f"{scene}-{spp}"
        self.folder.mkdir()

    def arguments(self, backend, outputs, more):
        command = ["render", self.program.scene_file(self.scene), "--backend", backend, "--quiet",
                   "--set", f"film.resolution=[{self.size},{self.size}]", "--report", "none", *more]
        for output in outputs:
            command += ["-o", output]
        return command

    def render(self, name, backend, more=()):
        self.program.start(
            self.arguments(
                backend,
                [self.folder / f"{name}.exr", self.folder / f"{name}.crtfilm"],
                ["--spp", self.spp, *more],
            )
        )
        return name

    def merged(self, name, first_backend, second_backend):
        half = self.spp // 2
        parts = [self.folder / f"{name}-{i}.crtfilm" for i in (0, 1)]
        for part, backend, samples in zip(
            parts, (first_backend, second_backend), (f"0:{half}", f"{half}:{self.spp}")
        ):
            self.program.start(self.arguments(backend, [part], ["--samples", samples]))
        # Later part first: the order of merging must not show either.
        self.program.start(
            [
                "merge",
                "--quiet",
                "--scene",
                self.program.scene_file(self.scene),
                "-o",
                self.folder / f"{name}.exr",
                "-o",
                self.folder / f"{name}.crtfilm",
                *reversed(parts),
            ]
            + self.merge_settings()
        )
        return name

    def merge_settings(self):
        return ["--set", f"film.resolution=[{self.size},{self.size}]"]

    def resumed(self, name, backend):
        """Ctrl-C in the middle, then --resume. Returns the name and how many samples there were when it
        stopped."""
        stopped, resumed = (
            self.folder / "stopped.pfm",
            self.folder / f"{name}.exr",
        )  # A PFM opens no codecs, which would take most of the time.
        checkpoint = self.folder / f"{name}.crtfilm"
        more = ["--spp", self.spp, "--chunk", 1, "--checkpoint", checkpoint]
        shortest, whole = (
            self.program.start(self.arguments(backend, [stopped], ["--spp", spp, "--chunk", 1])).seconds
            for spp in (1, self.spp)
        )
        for share in (0.5, 0.3, 0.7, 0.4, 0.6, 0.2, 0.8, 0.1) * 3:  # On a busy machine a signal may miss.
            checkpoint.unlink(missing_ok=True)
            process = subprocess.Popen(
                [str(self.program.crt), *map(str, self.arguments(backend, [stopped], more))],
                cwd=self.program.repository,
                env=self.program.environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            time.sleep(shortest + share * (whole - shortest))
            process.send_signal(signal.SIGINT)
            code = process.wait()
            if code != 130 or not checkpoint.exists():
                continue
            stopped_after = int(
                self.program.start(["info", checkpoint]).output.split("samples", 1)[1].split()[0]
            )
            if 0 < stopped_after < self.spp:
                self.program.start(
                    self.arguments(backend, [resumed], ["--spp", self.spp, f"--resume={checkpoint}"])
                )
                return name, stopped_after
        raise Failure(f"{self.scene} on {backend}: no signal met the middle of the render")

    def compare(self, name, reference):
        image = self.program.compare(self.folder / f"{name}.exr", self.folder / f"{reference}.exr")
        film = Film(self.folder / f"{name}.crtfilm").difference(Film(self.folder / f"{reference}.crtfilm"))
        return {"differing_pixels": image["differing_pixels"], **film.json(), "metrics": image["metrics"],
                "channels": image["channels"], "pixels": self.size * self.size, "spp": self.spp}

    def differing_samples(self, backend, reference):
        """Every sample number alone, counted where the sums of a pixel differ."""
        differing = 0
        one, two = self.folder / "one.crtfilm", self.folder / "two.crtfilm"
        for s in range(self.spp):
            for path, name in ((one, backend), (two, reference)):
                self.program.start(self.arguments(name, [path], ["--samples", f"{s}:{s + 1}"]))
            differing += Film(one).difference(Film(two)).pixels
        return differing


def beyond_promise(result):
    """Two backends may differ in one sample of a million; where no sample differs, nothing else may: not
    the image, and not the film, but for the last words of sums whose samples were added up in another
    order."""
    if result.get("differing_samples", 0) > 0:
        return result["differing_samples"] > SAMPLE_BOUND * result["samples"]
    film = result["film_beyond_promise"] if result["reordered"] else result["differing_film_pixels"] > 0
    return result["differing_pixels"] > 0 or film


def cell(result):
    """Pixels of the image that differ; in brackets those of the film, if any, and its largest relative
    difference, rounded up to a power of two."""
    image, film, relative = (
        result["differing_pixels"],
        result["differing_film_pixels"],
        result["largest_relative_film_difference"],
    )
    if film == 0:
        return f"{image}"
    return f"{image} ({film}; {power_of_two(relative)})"


def power_of_two(relative):
    if relative is None:
        return "not finite"
    return f"2^{math.ceil(math.log2(relative))}" if relative else "same sums"


def measure(program, arguments):
    # Started in the background, a shell would have us ignore SIGINT, and crt would inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    size, spp, fewer = (64, 64, 64) if arguments.tiny else (256, 64, 16)
    usable, absent = program.backends(["opencl", "embree", "cuda", "example", "cuda_on_host"])
    if REFERENCE not in usable:
        raise Failure(f"the reference backend '{REFERENCE}' cannot run: {absent[REFERENCE]}")

    results = Results(program, arguments, "same-bits", "The same bits")
    scenes = program.scenes(arguments.scenes)
    table, data = {}, {}
    failures = 0
    for scene in scenes:
        print(f"{scene} …", flush=True)
        column = {}

        def check(images, label, name, reference, reordered=False, column=column):
            column[label] = images.compare(name, reference) | {"reordered": reordered}
            print(f"  {label}: {cell(column[label])} pixels differ", flush=True)

        everything = Images(program, scene, size, spp)
        everything.render(REFERENCE, REFERENCE)
        for backend in usable:
            if backend in FAST and backend != REFERENCE:
                check(everything, f"{backend} : {REFERENCE}", everything.render(backend, backend), REFERENCE)
        images = everything if fewer == spp else Images(program, scene, size, fewer)
        for backend in usable:
            if images is not everything and backend in FAST:
                images.render(backend, backend)
            if backend not in FAST:
                check(images, f"{backend} : {REFERENCE}", images.render(backend, backend), REFERENCE)
        for backend in [b for b in FAST if b in usable]:
            threads = (1, 2, 7) if backend != "cuda" else ()
            variations = {f"{n} thread{'s' if n > 1 else ''}": ["--threads", n] for n in threads}
            variations |= {f"tiles of {n}": ["--tile", n] for n in (8, 37, 128)}
            variations |= {"5 samples at a time": ["--chunk", 5], "full kernel": ["--kernel", "full"]}
            for number, (what, more) in enumerate(variations.items()):
                check(
                    images,
                    f"{backend}, {what}",
                    images.render(f"{backend}-{number}", backend, more),
                    backend,
                )
            check(
                images,
                f"{backend}, two halves merged",
                images.merged(f"{backend}-merged", backend, backend),
                backend,
                reordered=True,
            )
            name, stopped_after = images.resumed(f"{backend}-resumed", backend)
            check(images, f"{backend}, stopped and resumed", name, backend, reordered=True)
            column[f"{backend}, stopped and resumed"]["stopped_after_samples"] = stopped_after
        if "example" in usable:
            check(
                images,
                f"halves of {REFERENCE} and example merged",
                images.merged("mixed", REFERENCE, "example"),
                REFERENCE,
                reordered=True,
            )

        for label, result in column.items():
            if result["differing_pixels"] == 0 and result["differing_film_pixels"] == 0:
                result["differing_samples"] = 0
            elif label == "embree : opencl":
                result["differing_samples"] = everything.differing_samples("embree", REFERENCE)
                result["samples"] = size * size * spp
        data[scene] = column
        for label, result in column.items():
            failures += beyond_promise(result)
            table.setdefault(label, {})[scene] = result

    comparisons = sum(len(column) for column in data.values())
    equal = sum(r["differing_pixels"] == 0 for column in data.values() for r in column.values())
    results.paragraph(
        f"Every scene at {size} × {size} pixels, rendered in every way there is here, and the images "
        f"compared bit by "
        f"bit in all their channels, AOVs included. **{equal} of {comparisons} comparisons: the same bits "
        f"in "
        f"every pixel.** A cell is the number "
        f"of pixels, of {size * size}, in which any bit of any channel differs; in brackets, where there "
        f"are "
        f"any, the pixels of the film in which any bit differs, and "
        "the largest difference over the sum. The film holds each sum as a pair of doubles, which is "
        "rounded "
        "once, for the image: added up in another order, a sum may be "
        "split elsewhere ('same sums') or differ in its last words (docs/decisions/0002-film-sums.md), and "
        "no image shows either. There, in what was merged or resumed, more "
        f"than 2^{math.log2(FILM_BOUND):.0f} of the sum is a failure; in all other rows any bit of the film "
        f"is, and everywhere a pixel's count of samples or its primitive. `a : b` compares two backends; "
        f"the "
        f"other "
        "rows compare one backend with itself."
    )
    results.claim(
        f"{equal} of {comparisons} renders have the bits of the reference",
        f"{len(scenes)} scenes, {size} × {size} pixels, all channels and AOVs. Each row compares "
        f"renders with the reference: two backends (`a : b`), or one backend with itself.",
        ["what differs between the renders", "samples per pixel", "scenes", "pixels that differ"],
        [
            [
                label,
                by_scene[scenes[0]]["spp"],
                len(by_scene),
                sum(result["differing_pixels"] for result in by_scene.values()),
            ]
            for label, by_scene in table.items()
        ],
    )
    rows = []
    for label, by_scene in table.items():
        rows.append([label, by_scene[scenes[0]]["spp"], *(cell(by_scene[scene]) for scene in scenes)])
    results.table(["", "samples per pixel", *scenes], rows)

    if "embree" in usable:
        counted = {scene: column["embree : opencl"]["differing_samples"] for scene, column in data.items()}
        total = size * size * spp
        results.paragraph(
            f"Samples in which Embree and OpenCL differ, of {total} in each scene: "
            + ", ".join(
                f"{scene} {n}" + (f" ({n / total:.1e})" if n else "") for scene, n in counted.items()
            )
            + f". The bound that crt sets itself is {SAMPLE_BOUND:g}."
        )
    stopped = "; ".join(
        f"{scene} "
        + ", ".join(
            f"{b} {column[f'{b}, stopped and resumed']['stopped_after_samples']}"
            for b in FAST
            if f"{b}, stopped and resumed" in column
        )
        for scene, column in data.items()
    )
    results.paragraph(
        f"Stopped by SIGINT after so many of {fewer} samples per pixel, then resumed: {stopped}."
    )
    results.paragraph(
        "`example` is the kernel as portable C++, `cuda_on_host` the CUDA backend's entry points compiled "
        "for the host; both run "
        "on one thread."
    )
    for name, reason in absent.items():
        results.paragraph(f"Not compared: `{name}` ({reason}).")
    results.command(
        f"crt render configs/SCENE.yaml --set 'film.resolution=[{size},{size}]' --spp {spp} --backend "
        f"BACKEND -o a.exr -o a.crtfilm"
    )
    results.command("crt compare --all-channels --json a.exr b.exr")
    results.data = {"size": size, "reference": REFERENCE, "absent": absent, "scenes": data}
    results.write()
    if failures:
        print(f"{failures} comparisons are beyond what is promised")
    return 1 if failures else 0
