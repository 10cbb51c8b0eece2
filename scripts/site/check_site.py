"""The site that was built: every link within it leads to a file and, where it names one, to an anchor; no
page loads anything from elsewhere; and search has its files."""

import html.parser
import pathlib
import sys
import urllib.parse

LOADS = {("script", "src"), ("img", "src"), ("source", "src"), ("iframe", "src"), ("video", "src")}
# Search in pages that are opened as files needs these.
SEARCH = ("assets/iframe-worker.js", "search/search_index.js")
LOADED_LINKS = ("stylesheet", "icon", "preload")


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors, self.links, self.loads = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, pairs):
        values = dict(pairs)
        for name in ("id", "name"):
            if values.get(name) and (name == "id" or tag == "a"):
                self.anchors.add(values[name])
        for name in ("href", "src"):
            if values.get(name) is None:
                continue
            loads = (tag, name) in LOADS or tag == "link" and values.get("rel") in LOADED_LINKS
            (self.loads if loads else self.links).append((self.getpos()[0], values[name]))


def elsewhere(target):
    return urllib.parse.urlsplit(target).scheme in ("http", "https") or target.startswith("//")


def check(site):
    """Sentences on what is wrong, and the number of links."""
    pages = {path: Page(path.read_text("utf-8", errors="replace")) for path in sorted(site.rglob("*.html"))
             if path.name != "404.html"}
    wrong, count = [], 0
    for path, page in pages.items():
        where = path.relative_to(site)
        wrong += [f"{where}:{line}: loads {target}" for line, target in page.loads if elsewhere(target)]
        for line, target in page.links + page.loads:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme or target.startswith("//"):
                continue
            count += 1
            name, fragment = urllib.parse.unquote(parts.path), urllib.parse.unquote(parts.fragment)
            place = pathlib.Path(path.parent, name).resolve() if name else path
            if place.is_dir():
                place = place / "index.html"
            if not place.is_file():
                wrong.append(f"{where}:{line}: {target}: there is no {name}")
            elif fragment and place in pages and fragment not in pages[place].anchors:
                wrong.append(f"{where}:{line}: {target}: there is no such anchor")
    wrong += [f"{name} is missing, which search needs" for name in SEARCH if not (site / name).is_file()]
    for sheet in site.rglob("*.css"):
        text = sheet.read_text("utf-8", errors="replace")
        bare = text.replace('"', "").replace("'", "")
        wrong += [f"{sheet.relative_to(site)}: loads from elsewhere"
                  for word in ("url(http", "url(//", "@import") if word in bare]
    return wrong, count, len(pages)


def main(folder):
    wrong, count, pages = check(pathlib.Path(folder).resolve())
    for sentence in wrong:
        print(sentence)
    print(f"{pages} pages, {count} links, {len(wrong)} wrong")
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
