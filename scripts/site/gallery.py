"""The gallery: every scene that comes with crt, rendered small by the program, with command and seconds."""

import hashlib
import json
import re
import subprocess
import time

SIDE = 384      # Pixels of the longer side.
SECONDS = 6     # Of sampling, at most.
SAMPLES = 512   # Of a pixel, at most.


def about(text):
    """The comment at the top of a scene: its first paragraphs, and hints for the viewer."""
    comment = re.match(r"(?:#.*\n)+", text)[0]
    paragraphs = "\n".join(line[1:].removeprefix(" ") for line in comment.splitlines()).split("\n\n")
    kept = [" ".join(p.split()) for p in paragraphs if not p.startswith(" ")]
    return [p for p in kept if p and not p.startswith("crt ")]


def title_of(text):
    return re.search(r"^title: (.*)$", text, re.MULTILINE)[1].strip("\"'")


def rendered(program, scene, folder, resolution):
    """Renders `scene` into folder/NAME.jpg unless it is there, of the same program and scene. Returns the
    command and what the run took."""
    name = scene.stem
    options = ["--time", f"{SECONDS}s", "--spp", str(SAMPLES), "--set",
               f"film.resolution=[{resolution[0]},{resolution[1]}]", "--set", "outputs=[]"]
    shared = b"".join(path.read_bytes() for path in sorted((scene.parent / "shared").iterdir()))
    state = hashlib.sha256(scene.read_bytes() + shared + " ".join(options).encode()
                           + str(program.stat().st_mtime_ns).encode()).hexdigest()
    picture, known = folder / f"{name}.png", folder / f"{name}.json"
    if picture.is_file() and known.is_file():
        figures = json.loads(known.read_text())
        if figures["state"] == state:
            return figures
    report = folder / f"{name}.report.json"
    began = time.monotonic()
    subprocess.run([program, scene, *options, "-q", "-o", picture, "--report", report], check=True)
    seconds = time.monotonic() - began
    found = json.loads(report.read_text())
    shown = " ".join(f"'{word}'" if "[" in word else word for word in options)
    figures = {"state": state, "command": f"crt configs/{name}.yaml {shown} -o {name}.png",
               "seconds": round(seconds, 1), "report": found}
    known.write_text(json.dumps(figures))
    return figures


def card(name, text, figures):
    report = figures["report"]
    error = report["error"]
    known = f", error {error['relative_rmse']:.1%}" if error and error.get("relative_rmse") else ""
    words = "\n\n".join(about(text))
    return f"""<div markdown>

![{title_of(text)}](gallery/{name}.png){{ loading=lazy }}

## {title_of(text)}

{words}

```
{figures["command"]}
```

{report["samples"]["per_pixel"]} samples a pixel in {report["seconds"]["sampling"]:.1f} s,
{figures["seconds"]} s with everything{known}. [The scene](source/configs/{name}.yaml.md)

</div>"""


def page(cards, report):
    """`report` is of any of the runs: the machine is the same."""
    where = f"{report['backend']['name']}, {report['host']['cpu']}, {report['host']['threads']} threads"
    return f"""---
hide: [navigation, toc]
---

# Gallery

Every scene that comes with crt, rendered small when this site was made, by the command below each
({where}): at most {SECONDS} seconds of sampling, so that rare paths, as of a caustic, are still noisy.
*error* is the estimate of the image's error, relative to its mean luminance ([what that means](error.md)).

<div class="gallery" markdown>

{chr(10).join(cards)}

</div>
"""
