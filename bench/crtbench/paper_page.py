"""Makes docs/results/paper.md of the rows of `bench/run paper`: the paper's figure beside each of ours."""

import statistics

from . import figure2, paper_pictures, section
from .accelerators import KINDS
from .paper import PARTS, SETTINGS
from .program import significant
from .results import Results

# All that the project knows of the paper's figures; the rest is "not known" on the page, never guessed.
UNKNOWN = "not known"
PAPER_MPATHS = {"cornell_box": 48, "cornell_dragon": 0.14}
MESHES = {"sphere": "960", "figure": "4,745", "dragon": "100,000"}
LAYOUTS = {
    "aos": "x y z x y z …, 4 bytes a load",
    "aos, wide": "x y z x y z …, 16 bytes a load",
    "soa": "x … y … z …, 4 bytes a load",
    "soa, wide": "x … y … z …, 16 bytes a load",
}


class Found:
    """The rows, asked by what they are."""

    def __init__(self, rows):
        self.rows = rows

    def all(self, part, **wanted):
        return [
            r for r in self.rows if r["part"] == part and all(r.get(k) == v for k, v in wanted.items())
        ]

    def seconds(self, part, **wanted):
        """Median over the runs of the row that is wanted, the last if it was measured twice."""
        rows = self.all(part, **wanted)
        return statistics.median(rows[-1]["seconds"]) if rows else None


def time_text(seconds):
    if seconds is None:
        return "–"
    for unit, scale in (("s", 1), ("ms", 1e3), ("µs", 1e6)):
        if seconds * scale >= 1 or unit == "µs":
            return f"{significant(seconds * scale)} {unit}"
    return "–"


def ratio_text(a, b):
    return significant(a / b) if a and b else "–"


def table1(results, found):
    results.heading("Table 1: the sum of N numbers")
    results.paragraph(
        "Floats in [0, 1), multiples of 2⁻²⁴, whose sum in double is exact; every sum here is within "
        "its bound of that. *Kernel*: on the GPU's clock, the numbers already there, launch after launch. "
        "*Answer*: on the host's clock, from the launch until the sum is on the host. *With upload*: that, "
        "and the numbers brought from pinned memory of the host before. *Ours*: loads of 16 bytes, warps by "
        "shuffles, blocks by the last to finish, one pass (`bench/paper_kernels.h`); CUB's is "
        "`cub::DeviceReduce::Sum`. The processor's numbers are in its caches where they fit, the GPU's in "
        "its L2: rates above that of memory are those of a cache. Uploads from pageable memory are in "
        "`out/bench/paper.json`."
    )
    copies = {}
    for row in found.all("copy"):
        copies[row["method"]] = row["bytes"] / statistics.median(row["seconds"])
    copy = max((copies[m] for m in ("cudaMemcpy", "kernel") if m in copies), default=None)
    rows, data = [], {"copies_bytes_per_second": copies, "sums": {}}
    for n in sorted({r["n"] for r in found.all("sum")}):
        cpu = [found.seconds("sum", where="cpu", method=m, n=n) for m in ("one thread", "all threads")]
        gpu = {
            (m, t): found.seconds("sum", where="gpu", method=m, time=t, n=n)
            for m in ("own", "cub")
            for t in ("device", "call", "upload", "upload, pageable")
        }
        rate = {m: 4 * n / gpu[m, "device"] if gpu[m, "device"] else None for m in ("own", "cub")}
        rows.append(
            [
                f"{n:,.0f}",
                UNKNOWN,
                UNKNOWN,
                *(time_text(s) for s in cpu),
                *(time_text(gpu[m, "device"]) for m in ("own", "cub")),
                time_text(gpu["own", "call"]),
                time_text(gpu["own", "upload"]),
                *(significant(rate[m] / 1e9) if rate[m] else "–" for m in ("own", "cub")),
            ]
        )
        data["sums"][f"{n:.0f}"] = {
            "cpu_one_thread": cpu[0],
            "cpu_all_threads": cpu[1],
            **{f"gpu {m}, {t}": s for (m, t), s in gpu.items()},
        }
    if rows:
        results.table(
            ["N", "paper: CPU", "paper: GPU", "CPU, one thread", "CPU, all threads", "GPU, ours: kernel",
             "CUB: kernel", "ours: answer", "ours: with upload", "ours, GB/s", "CUB, GB/s"],
            rows,
        )
    if copy:
        results.paragraph(
            "Copies within the GPU's memory, bytes read and written: "
            + ", ".join(f"{m} {significant(copies[m] / 1e9)} GB/s" for m in copies if "upload" not in m)
            + (
                f". From the host's pinned memory: {significant(copies['upload, pinned'] / 1e9)} GB/s."
                if "upload, pinned" in copies
                else "."
            )
        )
        n = max(r["n"] for r in found.all("sum", where="gpu"))
        said = []
        for method, name in (("own", "ours"), ("cub", "CUB")):
            if s := found.seconds("sum", where="gpu", method=method, time="device", n=n):
                share = 4 * n / s / copy
                data[f"{method}_share_of_copy"] = share
                rate = significant(4 * n / s / 1e9)
                said.append(f"{name} reads {rate} GB/s, {share:.0%} of the faster copy")
        results.paragraph(f"At N = {n:,.0f} {' and '.join(said)}.")
    return data


def table2(results, found):
    results.heading("Table 2: the box of a mesh")
    results.paragraph(
        "Least and greatest x, y and z of all corners of the triangles (three a triangle, x y z x y z …), "
        "equal to the processor's in every bit. The meshes are those of `configs/`, with as many triangles "
        "as the paper's; the last one, of random corners, is ours: large enough that memory is what limits. "
        "Times on the host's clock until the box is on the host. *Streams*: the upload from pinned memory "
        "cut in parts, four streams in turn, so that a part is boxed while the next one comes."
    )
    rows, data = [], {}
    for mesh in dict.fromkeys(r["mesh"] for r in found.all("box")):
        triangles = found.all("box", mesh=mesh)[0]["triangles"]
        cpu = [
            found.seconds("box", where="cpu", mesh=mesh, layout="aos", method=m)
            for m in ("one thread", "all threads")
        ]
        there = found.seconds("box", where="gpu", mesh=mesh, layout="aos, wide", time="call")
        uploads = [
            found.seconds("box", where="gpu", mesh=mesh, method=m, time=t)
            for m, t in (
                ("one stream", "upload, pageable"), ("one stream", "upload"), ("four streams", "upload")
            )
        ]
        theirs = [UNKNOWN] * 3 if mesh in MESHES else ["–"] * 3
        times = [*cpu, there, *uploads]
        rows.append(
            [f"{mesh}, {triangles:,.0f}", *theirs, *(time_text(s) for s in times),
             ratio_text(uploads[1], uploads[2])]
        )
        data[mesh] = dict(
            zip(
                ("cpu_one_thread", "cpu_all_threads", "gpu_there", "gpu_pageable", "gpu_pinned",
                 "gpu_streams"),
                times,
            )
        )
    if rows:
        results.table(
            ["mesh, triangles", "paper: CPU", "paper: GPU", "paper: streams", "CPU, one thread",
             "CPU, all threads", "GPU, data there", "GPU, pageable upload", "GPU, pinned upload",
             "GPU, streams", "gain of streams"],
            rows,
        )
    return data


def table3(results, found):
    results.heading("Table 3: ways to find what a ray hits")
    results.paragraph(
        f"Milliseconds of rendering a million camera paths ({' '.join(SETTINGS)}, Sobol points), median of "
        "interleaved runs; the same image whatever is chosen. Sizes and samples differ, so that no render "
        "takes minutes: they are in `out/bench/paper.json`. Of the paper's rates two are known, on the GPU "
        "of its "
        "time "
        "and at five events: 48 Mpaths/s of the Cornell box and 0.14 of a dragon, without the way in which "
        "they were found; they stand here as milliseconds, too."
    )
    rows, data = [], {}
    for scene, backend in dict.fromkeys((r["scene"], r["backend"]) for r in found.all("render")):
        cost = {}
        for kind in KINDS:
            of_kind = found.all("render", scene=scene, backend=backend, accelerator=kind)
            if of_kind:
                row = of_kind[-1]
                paths = row["size"] ** 2 * row["spp"]
                cost[kind] = statistics.median(row["seconds"]) / paths * 1e6
        triangles = found.all("render", scene=scene)[0]["triangles"]
        rate = PAPER_MPATHS.get(scene)
        paper = f"{significant(1e3 / rate)} ({rate} Mpaths/s)" if rate else UNKNOWN
        rows.append(
            [
                scene,
                f"{triangles:,}",
                paper,
                backend,
                *(significant(1e3 * cost[k]) if k in cost else "–" for k in KINDS),
                ratio_text(cost.get("none"), cost.get("aabb")),
                ratio_text(cost.get("none"), cost.get("bvh")),
            ]
        )
        data[f"{scene} {backend}"] = {f"seconds_per_mpath_{k}": v for k, v in cost.items()}
    if rows:
        results.table(
            ["scene", "triangles", "paper, ms", "backend", *(f"`{k}`: {text}" for k, text in KINDS.items()),
             "boxes gain", "BVH gains"],
            rows,
        )
    return data


def time_against_samples(results, found, folder):
    results.heading("Figure 2: time against samples")
    rows = found.all("figure2")
    if not rows:
        return {}
    lines = figure2.medians(rows)
    results.paragraph(
        "Render seconds of the Cornell box by the backend's report, median of repeats, fitted by t₀ + cN. "
        f"The paper's curve: {UNKNOWN}; its rate of 48 Mpaths/s would be "
        f"{significant(1e3 * 1440**2 / 48e6)} ms a sample at 1440² and "
        f"{significant(1e3 * 2880**2 / 48e6)} at "
        "2880². Renders that would take long were left out."
    )
    results.paragraph("![Seconds against samples per pixel](paper.svg)")
    data = figure2.show(results, lines)
    sentences = figure2.doublings(lines, data)
    results.lines += [*sentences, ""] if sentences else []
    chart = figure2.draw(lines)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "paper.svg").write_text(chart)
    return data


def figure3(results, found, rows_folders, folder):
    results.heading("Figure 3: the pictures")
    rows = []
    for row in found.all("picture"):
        paths = row["size"] ** 2 * row["spp"]
        scene = row["scene"]
        rate = PAPER_MPATHS.get(scene)
        paper = time_text(paths / rate / 1e6) if rate else UNKNOWN
        seconds = statistics.median(row["seconds"])
        rows.append(
            [scene, f"{row['size']}²", f"{row['spp']:,}", UNKNOWN, paper, row["backend"],
             time_text(seconds), significant(paths / seconds / 1e6), time_text(row["process_seconds"])]
        )
    if rows:
        results.paragraph(
            f"Rendered once ({' '.join(SETTINGS)}). *By its rate*: the paths over the paper's 48 and 0.14 "
            "Mpaths/s; the times that it states are not known."
        )
        results.table(
            ["scene", "size", "samples", "paper", "paper, by its rate", "backend", "render", "Mpaths/s",
             "whole process"],
            rows,
        )
    for scene in dict.fromkeys(r["scene"] for r in found.all("picture")):
        row = found.all("picture", scene=scene)[0]
        source = next((f / row["file"] for f in rows_folders if (f / row["file"]).exists()), None)
        if source:
            name = f"paper-{scene}.png"
            folder.mkdir(parents=True, exist_ok=True)
            paper_pictures.write_png(folder / name, *paper_pictures.smaller(source.read_bytes(), 360))
            results.paragraph(f"![{scene}, {row['spp']} samples]({name})")
    return {}


def remarks(results, found):
    results.heading("The paper's remarks, in our numbers")
    results.paragraph(
        "The paper remarks on structures of arrays against arrays of structures, and on constant memory; "
        "how "
        f"it judges is {UNKNOWN} to the project."
    )
    data = {"layouts": {}, "tables": {}}
    rows = []
    for mesh in dict.fromkeys(r["mesh"] for r in found.all("box", where="gpu")):
        triangles = found.all("box", mesh=mesh)[0]["triangles"]
        cost = {
            layout: found.seconds("box", where="gpu", mesh=mesh, layout=layout, time="device")
            for layout in LAYOUTS
        }
        data["layouts"][mesh] = cost
        rows.append(
            [f"{mesh}, {triangles:,.0f}"]
            + [f"{time_text(s)}; {significant(36 * triangles / s / 1e9)}" if s else "–"
               for s in cost.values()]
        )
    if rows:
        results.paragraph("**Layout.** Boxes on the GPU as in Table 2, the kernel alone; then GB/s read.")
        results.table(["mesh, triangles", *LAYOUTS.values()], rows)
        largest = list(data["layouts"].values())[-1]
        if all(largest.values()):
            results.paragraph(
                f"Of the largest, arrays of structures take {ratio_text(largest['aos'], largest['soa'])} "
                "times "
                f"as long as structures of arrays with loads of 4 bytes, and "
                f"{ratio_text(largest['aos, wide'], largest['soa, wide'])} times with loads of 16."
            )
    rows = []
    for triangles in sorted({r["triangles"] for r in found.all("table")}):
        for where, method, layout in dict.fromkeys(
            (r["where"], r["method"], r["layout"]) for r in found.all("table", triangles=triangles)
        ):
            row = found.all("table", triangles=triangles, where=where, method=method, layout=layout)[-1]
            tests = row["rays"] * triangles / statistics.median(row["seconds"])
            data["tables"][f"{triangles:.0f} {where} {method} {layout}"] = tests
            rows.append(
                [f"{triangles:.0f}", f"{where.upper()}, {method}", layout, UNKNOWN, significant(tests / 1e9)]
            )
    if rows:
        results.paragraph(
            "**Constant memory.** All rays against all triangles of a table, as brute force does: every "
            "thread "
            "reads the same triangle at the same time. The test of Möller and Trumbore, rays made on the "
            "spot; "
            "the same nearest triangles everywhere."
        )
        results.table(["triangles", "where the table is", "layout", "paper", "10⁹ tests a second"], rows)
        said = []
        for triangles in sorted({r["triangles"] for r in found.all("table", where="gpu")}):
            tests = {
                m: data["tables"].get(f"{triangles:.0f} gpu {m} aos")
                for m in ("constant", "global", "shared")
            }
            if all(tests.values()):
                said.append(
                    f"of {triangles:.0f} triangles, constant memory gives "
                    f"{ratio_text(tests['constant'], tests['global'])} times the tests of global memory, "
                    "and "
                    f"shared {ratio_text(tests['shared'], tests['global'])} times"
                )
        if said:
            results.paragraph(f"Tables {'; '.join(said)}.")
    return data


def wrong_rows(found):
    return [r for r in found.rows if r.get("right") is False]


def begin(results, found):
    """The subject of the page, the machine, and any errors."""
    results.paragraph(
        "crt grew out of a course paper: a path tracer on a GPU, with tables and figures of its parts. Here "
        f"are its experiments, made again with today's crt. Where a figure of the paper is {UNKNOWN} to the "
        "project, the cell says so."
    )
    machines = found.all("machine")
    if any(m["quick"] for m in machines):
        results.paragraph(
            "**Made with `--quick`, to see whether the tools work: these figures mean nothing.**"
        )
    limit = max((m["busy"] or 0.05 for m in machines), default=0.05)
    shares = [(r["others"], r) for r in found.rows if "others" in r]
    busy = [r for share, r in shares if share > limit]
    if busy:
        results.paragraph(
            f"**Disturbed:** in {len(busy)} of {len(shares)} timed runs or groups of runs other processes "
            "took "
            f"more than {limit:.0%} of the processor, at most {max(s for s, _ in shares):.0%}: figures of "
            "the "
            "processor are not to be published."
        )
    if wrong := wrong_rows(found):
        results.paragraph(f"**Wrong:** {len(wrong)} results are wrong: see `out/bench/paper.json`.")
    gpus = dict.fromkeys(
        f"{r['method']}, {r['multiprocessors']:.0f} multiprocessors, {r['l2_bytes'] / 2**20:.0f} MiB of L2, "
        "compiled with CUDA "
        f"{r['compiled_with_cuda'] // 1000:.0f}.{r['compiled_with_cuda'] % 1000 // 10:.0f}"
        for r in found.all("device")
    )
    rows = []
    for machine in machines:
        rows += [
            [
                ", ".join(machine["parts"]),
                f"{machine['cpu']}, {machine['threads']} threads, {machine['os']}",
                "; ".join(f"`{b}`: {', '.join(d) or 'none'}" for b, d in machine["devices"].items()),
                machine["date"],
                f"`{machine['commit'][:7]}`" if machine["commit"] else "see below",
            ]
        ]
    results.table(["measured", "host", "devices", "date", "commit"], rows)
    for gpu in gpus:
        results.paragraph(f"Tables 1 and 2 and the remarks: one {gpu}.")


def is_elsewhere(found, absent):
    """True if another machine's rows have the results that one machine could not measure."""
    part, what = absent["of"], absent["what"]
    if what in ("paper_host", "paper_gpu"):
        return bool(found.all("run", of=part, what=what, complete=True))
    if part == "figure2":
        return bool(found.all("figure2", backend=what))
    return any(what in (r["backend"], f"{r['scene']}, {r['backend']}")
               for kind in ("render", "picture") for r in found.all(kind, of=part))


def end(results, found, arguments):
    """Missing results, and how to measure them."""
    asked = {part for m in found.all("machine") for part in m["parts"]}
    absent = {}
    for row in found.all("absent"):
        if not is_elsewhere(found, row):
            absent.setdefault((row["what"], row["reason"]), []).append(row["of"])
    for (what, reason), parts in absent.items():
        results.paragraph(
            f"Not measured: {', '.join(parts)}, `{what}`: {reason}. The command, where it can run: "
            "`bench/run paper "
            f"--parts {','.join(parts)}`."
        )
    for part in PARTS:
        if not any(part in (r["part"], r.get("of")) for r in found.rows):
            why = "the run ended before" if part in asked else "it was not asked for"
            results.paragraph(
                f"Not measured: {part} ({PARTS[part]}): {why}. The command: `bench/run paper --parts "
                f"{part}`."
            )
    if arguments.note:
        results.paragraph(arguments.note)


def write(program, arguments, rows, rows_folders):
    """The page; 1 where a result is wrong. The pictures are in one of the folders."""
    found = Found(rows)
    results = Results(program, arguments, "paper", "The paper's experiments, today")
    folder = arguments.results or section.PAGES  # Of the charts and pictures, too.
    begin(results, found)
    results.data = {
        "table1": table1(results, found),
        "table2": table2(results, found),
        "table3": table3(results, found),
        "figure2": time_against_samples(results, found, folder),
        "figure3": figure3(results, found, rows_folders, folder),
        "remarks": remarks(results, found),
        "rows": rows,
    }
    end(results, found, arguments)
    results.command("paper_host sum boxes table --meshes share/crt/meshes")
    results.command("paper_gpu copy sum boxes table --meshes share/crt/meshes")
    results.command(
        "crt render configs/SCENE.yaml --backend BACKEND --spp N --set 'film.resolution=[1440,1440]' --set "
        f"'outputs.0.aovs=[]' {' '.join(f'--set {s}' for s in SETTINGS)} --set "
        "integrator.accelerator=none|aabb|bvh|auto -o unseen.pfm"
    )
    results.write(whole_page=True)
    return 1 if wrong_rows(found) else 0
