"""The page of `crt converge`: summary.json and the maps beside it, laid out."""

import math

from . import figures, pages, text

VERDICTS = ("FAIL", "INCONCLUSIVE", "PASS")
MEASURES = (("relMSE", "relmse"), ("SMAPE", "smape"), ("MAE", "mae"), ("FLIP", "flip_mean"),
            ("ΔE2000", "delta_e2000_mean"))
STAGES = ("parse", "build", "compile", "upload", "first_sample", "render_wall", "render_device", "write")


def page(run):
    """(html, figures) of a run."""
    summary = run.data
    options = summary["options"]
    places = styles(summary["configurations"])
    scenes = [scene_of(run, scene, places) for scene in summary["scenes"]]
    slugs = [scene["slug"] for scene in scenes]
    for scene in scenes:  # Of names that differ in signs only, all but the first get a number.
        if slugs.count(scene["slug"]) > 1:
            scene["slug"] += f"-{scenes.index(scene) + 1}"
    for scene in scenes:
        scene["figures"] = figures.of_scene(scene, options)
        scene["lead"] = lead_picture(scene)
    html = pages.render("converge.html", scenes=scenes, options=options, notes=summary["notes"],
                        environment=summary["environment"], replicates=summary["replicates"],
                        configurations=[c for c in summary["configurations"] if c["omitted"] is None],
                        asked=len(summary["configurations"]), label=label, plural=text.plural)
    return html, [figure for scene in scenes for figure in scene["figures"]]


def label(configuration):
    """"embree, sampler=sobol": a configuration within its scene."""
    return ", ".join(filter(None, (configuration["backend"], configuration["variant"])))


def styles(configurations):
    """(colour, marker) of (backend, variant): colours tell backends and markers variants, and where there is
    one of either, both tell the other."""
    backends = list(dict.fromkeys(c["backend"] for c in configurations))
    variants = list(dict.fromkeys(c["variant"] for c in configurations))

    def of(backend, variant):
        colour, marker = backends.index(backend), variants.index(variant)
        if len(backends) == 1:
            return marker, marker
        return (colour, colour) if len(variants) == 1 else (colour, marker)

    return {(c["backend"], c["variant"]): of(c["backend"], c["variant"]) for c in configurations}


def scene_of(run, scene, places):
    """All that the page says about one scene."""
    summary, name = run.data, scene["scene"]
    pairs = [(c, f) for c, f in zip(summary["configurations"], summary["fits"], strict=True)
             if c["scene"] == name]
    rows = [row_of(c, f, places) for c, f in pairs]
    subjects = [row for row in rows if not row["omitted"]]
    reference = next((r for r in summary["references"] if r["scene"] == name), None)
    verdicts = [row["fit"]["verdict"] for row in subjects]
    return {
        "name": name, "slug": pages.slug(name), "findings": scene["findings"], "rows": rows,
        "subjects": subjects, "reference": reference_sentence(reference),
        "counts": [(verdict, verdicts.count(verdict)) for verdict in VERDICTS if verdict in verdicts],
        "targets": summary["options"]["targets"],
        "measures": measures_of(subjects), "tests": [s for s in subjects if tested(s["tests"])],
        "void_rows": [row | {"label": label(row)} for row in scene["void_rows"]],
        "maps": maps_of(run, scene["maps"]), "features": features_of(subjects), "stages": STAGES,
    }


def tested(tests):
    return any(tests[key] is not None for key in ("smallest_tile_p", "smallest_pixel_p", "largest_share"))


def row_of(configuration, fit, places):
    """A configuration with its fit, and the cells of its row as (value, interval)."""
    colour, marker = places[configuration["backend"], configuration["variant"]]
    row = {"label": label(configuration), "colour": colour, "marker": marker, "fit": fit,
           "omitted": configuration["omitted"], "points": [], "floor": None, "start": None}
    if row["omitted"] is not None:
        return row
    row.update(points=fit["points"], kept=configuration["kept"], left_out=configuration["left_out"],
               stages=configuration["stage_seconds"], tests=configuration["image_tests"])
    dash = (text.DASH, "")
    row.update(slope=dash, efficiency=dash, time=dash, floor_cell=dash,
               target_cells=[dash for _ in fit.get("targets", ())])
    if "time" in fit:
        time, error = fit["time"], fit["error"]
        launch = time["launch_seconds"]["value"]
        if text.known(launch) and text.known(time["before_first_sample_seconds"]):
            row["start"] = time["before_first_sample_seconds"] + launch
        row.update(slope=text.value_and_bounds(fit["slope_against_samples"], "number"),
                   efficiency=text.value_and_bounds(fit["efficiency_per_second"], "number"),
                   time=(text.seconds(row["start"]),
                         "+ " + text.seconds(time["seconds_per_sample"]["value"]) + " · N"),
                   floor_cell=floor_cell(error), target_cells=[target_cell(t) for t in fit["targets"]])
        if error["flattening"]:
            row["floor"] = root(error["floor"]["value"])
    row["errors"] = [text.error(point["relative_rmse"]) for point in row["points"]]
    return row


def root(square):
    return math.sqrt(max(square, 0)) if text.known(square) else None


def floor_cell(error):
    """√ of b², signed: what a reader can compare with the error."""
    floor = error["floor"]
    if not text.known(floor["value"]):
        return text.DASH, ""
    low, high = root(floor["low"]), root(floor["high"])
    if error["flattening"]:
        return text.percent(root(floor["value"])), text.percent(low) + " – " + text.percent(high)
    # Without a reference the floor is where the line v/N + b² meets the axis, which is below 0 for errors
    # that fall faster.
    if error["bias_squared"] is None and error["faster_than_inverse"]:
        return "none seen", "falls faster than 1/√N"
    return "none seen", "below " + text.percent(high, 2) if high else ""


def target_cell(target):
    seconds = target["seconds"]
    if not seconds:
        return "not reached", ""
    if not target["reached"]:  # A forecast, by all laws that fit: its range says more than its middle.
        value, interval = text.value_and_bounds(seconds, "seconds", 2)
        return "not reached", f"≈ {value} expected{', ' + interval if interval else ''}"
    value, interval = text.value_and_bounds(seconds, "seconds")
    samples = text.number(target["samples_per_pixel"]["value"])
    return ("≤ " if target["at_first_point"] else "") + value, f"{interval}\n{samples} spp"


def reference_sentence(reference):
    if reference is None or reference["kind"] == "none":
        return ("Reference: none. Errors are the spread between replicates, which is right for the variance "
                "and blind to bias.")
    kinds = {"analytic": "a closed form", "quadrature": "deterministic quadrature",
             "independent": "an independent render"}
    sentence = "Reference: " + kinds[reference["kind"]]
    if reference["estimator"]:
        sentence += ", " + reference["estimator"]
    if reference["samples_per_pixel"]:
        sentence += f", {text.count(reference['samples_per_pixel'])} samples per pixel"
    if reference["file"]:
        sentence += f" ({reference['file']})"
    if reference["relative_error"]:
        sentence += (f". Its own relative error is {text.percent(reference['relative_error'], 2)}; it is "
                     "subtracted, and part of every interval of what is measured against it")
    return sentence + "."


def measures_of(subjects):
    """Error and other measures at the most samples; those that no configuration has are left out."""
    last = [(subject, subject["points"][-1]) for subject in subjects if subject["points"]]
    names = [(name, key) for name, key in MEASURES if any(point[key] is not None for _, point in last)]
    return {"names": [name for name, _ in names],
            "rows": [{"subject": subject, "point": point,
                      "seconds": text.value_and_bounds(point["seconds"], "seconds"),
                      "error": text.error(point["relative_rmse"]),
                      "values": [text.number(point[key]) for _, key in names]} for subject, point in last]}


def maps_of(run, maps):
    """The pictures of a scene as data URIs, and the most samples among them; None where there are none."""
    if maps is None:
        return None
    shown = [of | {"label": label(of), "pictures": [picture | {"uri": run.picture(picture["file"])}
                                                    for picture in of["pictures"]]}
             for of in maps["configurations"]]
    return {"left_out": maps["left_out"], "configurations": shown, "scales": maps["scales"],
            "equal": len({of["samples_per_pixel"] for of in shown}) < 2}


def lead_picture(scene):
    """The picture that the section opens with: the image of the first configuration that has one."""
    for of in (scene["maps"] or {"configurations": []})["configurations"]:
        for picture in of["pictures"]:
            if picture["title"] == "image":
                return picture | {"of": of["label"], "samples": of["samples_per_pixel"]}
    return None


def features_of(subjects):
    """Parts that are kept and left out; configurations that have the same share a table."""
    groups = []
    for subject in subjects:
        parts = [("kept", f) for f in subject["kept"]] + [("left out", f) for f in subject["left_out"]]
        found = next((group for group in groups if group["parts"] == parts), None)
        if found:
            found["labels"].append(subject["label"])
        elif parts:
            groups.append({"labels": [subject["label"]], "parts": parts})
    return groups
