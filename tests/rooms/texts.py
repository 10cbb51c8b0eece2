"""The sentences of a source: its comments, the texts that a user sees, and the prose of its pages. Each is
one string with the line of every character, so that a sentence that is broken over lines is found. READERS
lists the kinds of files."""

import ast
import bisect
import dataclasses
import functools
import io
import json
import re
import tokenize

CPP = re.compile(r"""
    R"(?P<raw>[^(\s"]*)\((?P<inside>.*?)\)(?P=raw)"     # a raw string
  | (?P<line>//[^\n]*) | (?P<block>/\*.*?\*/)
  | "(?P<text>(?:\\.|[^"\\\n])*)"
  | \b\d[\w']*                                          # 1'000: no character
  | '(?:\\.|[^'\\\n])*'
""", re.VERBOSE | re.DOTALL)
LEAD = re.compile(r"[ \t]*(?:///?<?|/?\*+(?!/)<?!?|\#+:?)?[ \t]*")
LITERAL = re.compile(r"""[rbfRBF]{0,2}("{3}|'{3}|"|')(.*?)(?<!\\)\1""", re.DOTALL)
FENCE = re.compile(r"^ {0,3}(`{3,}|~{3,})")
# Comments that begin with #, and the strings, in which # begins no comment.
CMAKE = re.compile(r"""
    \#?\[(?P<equals>=*)\[.*?\](?P=equals)\] | (?P<comment>\#[^\n]*) | "(?P<text>(?:\\.|[^"\\])*)"
""", re.VERBOSE | re.DOTALL)
SHELL = re.compile(r"""
    (?<![^\s;()])(?P<comment>\#(?!!)[^\n]*) | \\. | "(?P<text>(?:\\.|[^"\\])*)" | '[^']*'
""", re.VERBOSE | re.DOTALL)
YAML = re.compile(r"""
    (?<!\S)(?P<comment>\#[^\n]*)
  | (?<![^\s,:{[(])(?:"(?:\\.|[^"\\])*" | '(?:\'\'|[^'])*')
""", re.VERBOSE | re.DOTALL)
TITLE = re.compile(r"""^ *title: +(["']?)(?P<title>.*?)\1(?: +#.*)?$""", re.MULTILINE)
# Pages and Jinja's templates of pages.
HTML = re.compile(r"""
    <!--(?P<comment>.*?)--> | <![A-Za-z][^>]*> | \{\#(?P<remark>.*?)\#\}
  | <(?P<raw>script|style|pre)\b.*?</(?P=raw)>
  | \{\{(?P<value>.*?)\}\} | \{%(?P<statement>.*?)%\}
  | <(?P<end>/?)(?P<tag>\w+)(?P<attributes>(?:"[^"]*"|'[^']*'|[^>"'])*)>
""", re.VERBOSE | re.DOTALL)
INLINE = {"a", "b", "code", "em", "i", "small", "span", "strong", "sub", "sup"}
HEADINGS = {"h1", "h2", "h3", "h4", "summary", "td", "th", "title"}
LABEL = re.compile(r"""\b(?:alt|aria-label|placeholder|title)="(?P<text>[^"]+)\"""")
STRING = re.compile(r""""[^"]*"|'[^']*'""")
BETWEEN = re.compile(r"-?\s*(?:(?:end)?(?:block|for|macro)|extends)\b")
# Sentences of a mutant; what it changes is code.
MUTANT = re.compile(r"^(?:List|Breaks): (.*(?:\n +\S.*)*)$", re.MULTILINE)


@dataclasses.dataclass
class Text:
    kind: str  # "comment", "message" or "page"
    text: str
    places: list  # (place in text, place in the source) of each piece, rising
    heading: bool = False  # also a cell of a table

    def source_place(self, place):
        here, there = self.places[bisect.bisect_right(self.places, (place, float("inf"))) - 1]
        return there + place - here


def joined(kind, pieces, between=""):
    """One text of pieces (place in the source, text)."""
    text, places = "", []
    for place, piece in pieces:
        text += between if text else ""
        places.append((len(text), place))
        text += piece
    return Text(kind, text, places)


def comment_lines(source, start, end):
    """(place, words) of each line of a comment, without the marks before and after them."""
    place = start
    for line in source[start:end].split("\n"):
        lead = LEAD.match(line).end()
        words = line[lead:].removesuffix("*/").rstrip()
        yield place + lead, words
        place += len(line) + 1


def column(source, place):
    return place - (source.rfind("\n", 0, place) + 1)


def cpp_texts(source):
    comment, comment_end, strings, string_end = [], 0, [], 0
    mark = None

    def flush_comment():
        if comment:
            yield joined("comment", list(comment), "\n")
            comment.clear()

    def flush_strings():
        if strings:
            yield joined("message", list(strings))
            strings.clear()

    for token in CPP.finditer(source):
        between = source[string_end:token.start()]
        if token["line"]:
            lead = re.match(r"///?<?", token["line"])[0]
            gap = source[comment_end:token.start()]
            follows = (comment and gap.strip() == "" and gap.count("\n") == 1 and lead == mark[0]
                       and column(source, token.start()) == mark[1])
            if not follows:
                yield from flush_comment()
            comment += comment_lines(source, *token.span())
            comment_end, mark = token.end(), (lead, column(source, token.start()))
        elif token["block"]:
            yield from flush_comment()
            yield joined("comment", list(comment_lines(source, *token.span())), "\n")
        elif token["text"] is not None or token["inside"] is not None:
            group = "text" if token["text"] is not None else "inside"
            if between.strip() or not strings:
                yield from flush_strings()
            strings.append((token.start(group), token[group]))
            string_end = token.end()
    yield from flush_comment()
    yield from flush_strings()


def python_texts(source):
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def place(row, bytes_before):
        return starts[row - 1] + len(lines[row - 1].encode()[:bytes_before].decode())

    comments, last = [], None
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT or token.start == (1, 0) and token.string.startswith("#!"):
            continue
        here = starts[token.start[0] - 1] + token.start[1]
        if last != (token.start[0] - 1, token.start[1]) and comments:
            yield joined("comment", comments, "\n")
            comments = []
        comments += comment_lines(source, here, here + len(token.string))
        last = token.start
    if comments:
        yield joined("comment", comments, "\n")

    tree = ast.parse(source)
    docs, inner = set(), set()
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                docs.add(first.value)
        if isinstance(node, ast.JoinedStr):
            inner.update(part for part in ast.walk(node) if part is not node)
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
        if (is_text or isinstance(node, ast.JoinedStr)) and node not in inner:
            start = place(node.lineno, node.col_offset)
            end = place(node.end_lineno, node.end_col_offset)
            pieces = []
            for token in LITERAL.finditer(source[start:end]):
                pieces.append((start + token.start(2), token[2]))
            if pieces:
                yield joined("comment" if node in docs else "message", pieces)


def page_texts(source):
    """Paragraphs, items, cells of tables and headings; code is left out."""
    fence, paragraph, place = None, [], 0
    for line in [*source.splitlines(keepends=True), "\n"]:
        bare = line.rstrip()
        found = FENCE.match(line)
        alone = None
        if found and fence is None:
            fence = found[1]
        elif found and found[1].startswith(fence or "-") and not bare.strip(" `~"):
            fence = None
        elif fence is None and bare.strip() and not (bare.startswith("    ") and not paragraph):
            if re.match(r" {0,3}#{1,6} ", bare):
                lead = re.match(r" *#+ *", bare).end()
                alone = [(place + lead, bare[lead:])]
            elif bare.lstrip().startswith("|"):
                alone = [(place + cell.start(), cell[0].rstrip())
                         for cell in re.finditer(r"(?:[^|`]|`[^`]*`)+", bare) if cell[0].strip(" -:")]
            else:
                lead = re.match(r"[ >]*(?:[-*+] +|\d+\. +)?", bare).end()
                if paragraph and re.match(r" *(?:[-*+] |\d+\. )", bare):
                    yield joined("page", paragraph, "\n")
                    paragraph = []
                paragraph.append((place + lead, bare[lead:]))
                place += len(line)
                continue
        if paragraph:
            yield joined("page", paragraph, "\n")
            paragraph = []
        for piece in alone or ():
            text = joined("page", [piece])
            text.heading = True
            yield text
        place += len(line)


def hash_texts(language, source):
    """Comments that begin with #, and strings, of a language (CMAKE, SHELL or YAML)."""
    comment, comment_end, margin = [], 0, None
    strings, string_end = [], 0
    for token in language.finditer(source):
        start = token.start()
        if token.lastgroup == "comment":
            follows = source[comment_end:start].strip(" \t") == "\n" and column(source, start) == margin
            if comment and not follows:
                yield joined("comment", comment, "\n")
                comment = []
            comment += comment_lines(source, *token.span())
            comment_end, margin = token.end(), column(source, start)
        elif token.lastgroup == "text":
            if strings and source[string_end:start].strip(" \\\n"):
                yield joined("message", strings, " ")
                strings = []
            strings += comment_lines(source, *token.span("text"))
            string_end = token.end()
    if comment:
        yield joined("comment", comment, "\n")
    if strings:
        yield joined("message", strings, " ")


def yaml_texts(source):
    yield from hash_texts(YAML, source)
    for found in TITLE.finditer(source):
        yield joined("page", [(found.start("title"), found["title"])])


def words_of(source, start, end):
    """(place, text) of each word, and of one blank for the white space between two."""
    for found in re.finditer(r"\S+|\s+", source[start:end]):
        yield start + found.start(), found[0] if found[0].strip() else " "


def divides(found):
    """True if a tag or a statement of the template ends a paragraph."""
    if found["tag"]:
        return found["tag"] not in INLINE
    if found["statement"]:
        return BETWEEN.match(found["statement"]) is not None
    return not found["value"]


def html_paragraphs(source):
    """`code` and values of the template are one word."""
    pieces, heading, end = [], False, 0
    for found in [*HTML.finditer(source), None]:
        pieces += words_of(source, end, found.start() if found else len(source))
        if found is None or divides(found):
            pieces = [piece for before, piece in zip([(0, " "), *pieces], pieces)
                      if (before[1], piece[1]) != (" ", " ")]
            if pieces:
                text = joined("page", pieces)
                text.heading = heading
                yield text
            pieces, heading = [], found is not None and found["tag"] in HEADINGS and not found["end"]
        elif found["value"]:
            pieces.append((found.start(), "`x`"))
        elif found["tag"] == "code":
            pieces.append((found.start(), "`"))
        end = found.end() if found else end


def html_texts(source):
    """Paragraphs, headings and labels of a page, and comments and strings of its template."""
    yield from html_paragraphs(source)
    for found in HTML.finditer(source):
        for kind in ("comment", "remark"):
            if found[kind]:
                yield joined("comment", list(words_of(source, *found.span(kind))))
        for kind in ("value", "statement"):
            for string in STRING.finditer(found[kind] or ""):
                yield joined("message", [(found.start(kind) + string.start() + 1, string[0][1:-1])])
        if found["tag"]:
            for label in LABEL.finditer(source, *found.span("attributes")):
                yield joined("page", list(words_of(source, *label.span("text"))))


def notebook_texts(source):
    """Cells of text, and the comments of cells of code."""
    at = 0
    for cell in json.loads(source)["cells"]:
        lines, starts, places = cell["source"], [0], []
        for line in [lines] if isinstance(lines, str) else lines:
            at = max(at, source.find(json.dumps(line, ensure_ascii=False), at + 1))
            places.append(at + 1)
            starts.append(starts[-1] + len(line))
        code = "".join(lines)
        for text in page_texts(code) if cell["cell_type"] == "markdown" else hash_texts(SHELL, code):
            text.places = [(here, places[min(bisect.bisect_right(starts, there), len(places)) - 1])
                           for here, there in text.places]
            yield text


def mutant_texts(source):
    for found in MUTANT.finditer(source):
        yield joined("comment", list(words_of(source, *found.span(1))))


cmake_texts = functools.partial(hash_texts, CMAKE)
shell_texts = functools.partial(hash_texts, SHELL)
# Ending or name of a file -> the function that yields its texts. Scripts without an ending: reader_of.
READERS = {
    **dict.fromkeys((".cpp", ".h", ".cu", ".c", ".cl", ".js"), cpp_texts),
    ".py": python_texts, ".md": page_texts, ".html": html_texts, ".ipynb": notebook_texts,
    ".cmake": cmake_texts, "CMakeLists.txt": cmake_texts, ".mutant": mutant_texts,
    **dict.fromkeys((".sh", ".supp", ".toml", "Dockerfile"), shell_texts),
    **dict.fromkeys((".yaml", ".yml", ".clang-format", ".clang-tidy"), yaml_texts),
}


def reader_of(path):
    """The function that yields the texts of a file, or None if it is of no known kind."""
    ending = path.with_suffix("").suffix if path.suffix == ".in" else path.suffix
    reader = READERS.get(path.name) or READERS.get(ending)
    if reader or path.suffix:
        return reader
    with path.open("rb") as file:
        program = file.readline()
    if not program.startswith(b"#!"):
        return None
    return python_texts if b"python" in program else shell_texts
