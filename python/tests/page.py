"""A page of a report as its tests read it."""

import html.parser
import re


class Page(html.parser.HTMLParser):
    """A page, read: its text, tables, ids, and what it refers to."""

    EMPTY = {"meta", "img", "br", "path", "use", "rect", "col"}

    def __init__(self, path):
        super().__init__()
        self.source = path.read_text(encoding="utf-8")
        self.open, self.tags, self.ids, self.links, self.alts = [], [], [], [], []
        self.rows, self.cell, self.words, self.visible = [], None, [], []
        self.feed(self.source)
        assert not self.open, self.open
        self.text = " ".join("".join(self.words).split())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append(tag)
        if tag not in self.EMPTY:
            self.open.append(tag)
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.links += [value for name, value in attributes.items() if name in ("src", "href", "xlink:href")]
        for value in attributes.values():
            self.links += re.findall(r"url\(([^)]*)\)", value or "")
        if tag == "img":
            self.alts.append(attributes.get("alt"))
        if tag == "tr":
            self.rows.append({})
        if tag in ("td", "th") and self.rows:
            self.cell = attributes.get("data-label", "head")
            self.rows[-1][self.cell] = ""

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.EMPTY:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, (tag, self.open[-3:], self.getpos())
        self.open.pop()
        if tag in ("td", "th"):
            self.cell = None

    def handle_data(self, data):
        if "style" in self.open:
            return
        data = data.replace("\u2060", "").replace("\u00a0", " ")
        self.words.append(data)
        if "details" not in self.open:
            self.visible.append(data)
        if self.cell is not None:
            self.rows[-1][self.cell] += data

    def row(self, head, column):
        """The cells of the first row with this head that has such a column."""
        found = [row for row in self.rows if row.get("head", "").strip() == head and column in row]
        return {name: " ".join(cell.split()) for name, cell in found[0].items()}
