"""A mutant: one fault to plant in the source. A file NUMBER-NAME.mutant says what it breaks, which check
should find it ("verify NAME": that case of `crt verify`; "unit NAME": that unit test), and what changes:

    Mutation: cosine-omitted
    List: cos omitted
    Breaks: Light that falls on a surface at a slant counts in full.
    Killed-by: verify square-light

    In: core/kernel/transport/direct_light.h crt_sample_lights
    - crt_surface_eval(bsdf, offer.wi)
    + crt_surface_eval(bsdf, offer.wi) / dot3(offer.wi, bsdf->ns)

The text after '-' must stand exactly once in the function (or macro, or constant) of that name. White space
and comments between its tokens do not count, so a new layout of the file does no harm, and neither does any
change elsewhere in it. The text after '+' takes its place. Without one, the old text goes, and with it a
line that it leaves blank. Several lines of either kind belong together.
"""

import re

# Lines that begin with blanks continue the field before them.
HEADER = re.compile(r"^(Mutation|List|Breaks|Killed-by): (.*(?:\n[ ]+\S.*)*)$", re.MULTILINE)
EDIT = re.compile(r"((?:^-.*\n)+)((?:^\+.*\n)*)", re.MULTILINE)
TOKEN = re.compile(r"\.?\d(?:[eE][-+]|[\w.])*|\w+|->|<<|>>|&&|\|\||::|[-+*/<>=!]=|[^\w\s]")
COMMENT = r"/\*.*?\*/|//[^\n]*"
STRING = r""" "(?:\\.|[^"\\\n])*" | '(?:\\.|[^'\\\n])' """.strip().replace(" | ", "|")
BETWEEN_FUNCTIONS = re.compile(r"[\s}]|namespace\b|using\b|extern \"C\"|#(?!define)")


class Misfit(Exception):
    """The source has changed under a mutant."""


def blanked(text, *, strings=False):
    """The text with blanks in place of its comments, and of its strings."""
    def blank(found):
        if found[0].startswith(("/*", "//")) or strings:
            return re.sub(r"[^\n]", " ", found[0])
        return found[0]

    return re.sub(f"{COMMENT}|{STRING}", blank, text, flags=re.DOTALL)


def functions(text):
    """(name, start, end) of what stands at the left margin: functions, macros, constants."""
    at, lines = 0, blanked(text, strings=True).splitlines(keepends=True)
    index = 0
    while index < len(lines):
        if not lines[index].strip() or BETWEEN_FUNCTIONS.match(lines[index]):
            at += len(lines[index])
            index += 1
            continue
        start, block = at, ""
        while index < len(lines):
            line = lines[index]
            block, at, index = block + line, at + len(line), index + 1
            if block.startswith("#"):
                done = not line.rstrip().endswith("\\")
            else:
                opened = block.count("{") - block.count("}")
                ends = line.startswith("}") or not line.strip() or line.rstrip().endswith((";", "}"))
                done = opened == 0 and ends
            if done:
                break
        yield name_of(block), start, at


def name_of(block):
    if macro := re.match(r"#define\s+(\w+)", block):
        return macro[1]
    head = re.split(r"[{;=]", block, maxsplit=1)[0]
    named = re.search(r"(\w+)\s*\(", head) or re.search(r"(\w+)\s*(?:\[[^\]]*\]\s*)*$", head)
    return named[1] if named else ""


def pattern_of(old):
    tokens = TOKEN.findall(blanked(old))
    first, last = (r"\b" if edge[0].isalnum() or edge[0] == "_" else "" for edge in (tokens[0], tokens[-1]))
    return re.compile(first + r"\s*".join(re.escape(token) for token in tokens) + last)


class Edit:
    def __init__(self, path, function, old, new):
        self.path, self.function, self.old, self.new = path, function, old, new

    def places(self, text):
        """(start, end) of each place in the function where the old text stands."""
        pattern, code = pattern_of(self.old), blanked(text)
        return [found.span() for name, start, end in functions(text) if name == self.function
                for found in pattern.finditer(code, start, end)]

    def place(self, text):
        names = [name for name, _, _ in functions(text) if name == self.function]
        if not names:
            raise Misfit(f"{self.path} has no function {self.function}")
        places = self.places(text)
        if len(places) != 1:
            how_often = "not there" if not places else f"there {len(places)} times"
            raise Misfit(f"in {self.function} of {self.path} this is {how_often}: {self.old}")
        return places[0]


def changed(text, edits):
    """The text of a file with all of its edits, whose places are those of the text without any."""
    for (start, end), edit in sorted(((edit.place(text), edit) for edit in edits), key=lambda pair: pair[0],
                                     reverse=True):
        text = text[:start] + edit.new + text[end:]
        line = text.rfind("\n", 0, start) + 1
        rest = text.find("\n", start) + 1
        if not edit.new and not text[line:rest].strip():
            text = text[:line] + text[rest:]
    return text


class Mutant:
    def __init__(self, path):
        text = path.read_text()
        head, *parts = re.split(r"^In: ", text, flags=re.MULTILINE)
        fields = {key: " ".join(value.split()) for key, value in HEADER.findall(head)}
        self.path, self.number = path, path.name.split("-", 1)[0]
        self.name, self.item, self.breaks = fields["Mutation"], fields["List"], fields["Breaks"]
        self.check_kind, self.check_name = fields["Killed-by"].split(" ", 1)
        self.edits = []
        for part in parts:
            place, changes = part.split("\n", 1)
            file, function = place.split()
            for old, new in EDIT.findall(changes):
                self.edits.append(Edit(file, function, *(
                    "\n".join(line[2:] for line in lines.splitlines()) for lines in (old, new))))

    @property
    def files(self):
        return sorted({edit.path for edit in self.edits})

    def results(self, tree):
        """{file: its text with the fault}. Throws Misfit."""
        return {file: changed((tree / file).read_text(), [e for e in self.edits if e.path == file])
                for file in self.files}

    def apply(self, tree):
        """Plants the fault in a tree and returns what the files held before."""
        results = self.results(tree)
        before = {file: (tree / file).read_text() for file in results}
        for file, text in results.items():
            (tree / file).write_text(text)
        return before
