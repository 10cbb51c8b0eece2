#!/usr/bin/env python3
"""check_links.py finds links that are broken, each by its line, and none that are not."""

import json
import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(__file__).with_name("check_links.py")

GOOD = """# One page

[itself](#two-words--a-dash), [again](#again-1), [a page](sub/b.md#named-by-hand), [a folder](sub/),
![a picture](sub/c.png "with a title"), [![both](sub/c.png)](sub/b.md), <a href="sub/b.md">HTML</a>,
[in brackets](sub/d_(1).md), [elsewhere](https://example.org/nothing), [a reference][ref], [ref][].

## Two words – a dash
## Again
## Again ##

[ref]: sub/b.md

`[code](nowhere.md)`

```
```text does not end it
[code](nowhere.md)
# No heading
```
"""
BROKEN = {
    "[a](nowhere.md)": "there is no nowhere.md",
    "![a](sub/nowhere.png)": "there is no sub/nowhere.png",
    "[a](#no-heading)": "has no heading #no-heading",
    "[a](sub/b.md#Named)": "has no heading #Named",
    "[a](#again-2)": "has no heading #again-2",
    "[a](../outside.md)": "there is no ../outside.md",
    "<img src='nowhere.svg'>": "there is no nowhere.svg",
    "[x]: nowhere.md": "there is no nowhere.md",
    "| [x](sub/b.md) | `nothing` |": "sub/b.md has no function nothing",
    "[a][nobody]": "[nobody], which is not defined",
    "[![a](sub/c.png)](nowhere.md)": "there is no nowhere.md",
    "`x` [a](nowhere.md) `y`": "there is no nowhere.md",
}


def check(folder, page):
    (folder / "a.md").write_text(page, "utf-8")
    return subprocess.run([sys.executable, CHECK, folder], capture_output=True, text=True)


def main():
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name, "tree")
        (folder / "sub").mkdir(parents=True)
        pathlib.Path(name, "outside.md").write_text("# outside")
        (folder / "sub/b.md").write_text("# B\n\n## `Named` by *hand*\n\n[back](../a.md)\n")
        (folder / "sub/d_(1).md").write_text("# D\n")
        (folder / "sub/c.png").write_text("no picture")
        done = check(folder, GOOD)
        if done.returncode != 0 or "0 broken" not in done.stdout:
            failed += 1
            print("good links are called broken:", done.stdout, done.stderr)
        for link, why in BROKEN.items():
            done = check(folder, GOOD + "\n" + link + "\n")
            line = GOOD.count("\n") + 2
            if done.returncode != 1 or f"a.md:{line}: " not in done.stdout or why not in done.stdout:
                failed += 1
                print(f"{link}: not found:", done.stdout, done.stderr)
        cells = [{"cell_type": "code", "source": ["[a](unseen.md)"]},
                 {"cell_type": "markdown", "source": ["# Notebook\n", "[a](nowhere.md)"]}]
        (folder / "n.ipynb").write_text(json.dumps({"cells": cells}))
        done = check(folder, GOOD)
        if done.returncode != 1 or "n.ipynb:2: nowhere.md" not in done.stdout or "unseen" in done.stdout:
            failed += 1
            print("a notebook's link is not found:", done.stdout, done.stderr)
    print(f"{2 + len(BROKEN)} cases, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
