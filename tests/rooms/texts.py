"""The sentences of a source: its comments, the texts that a user sees, and the prose of its pages. Each is
one string with the line of every character, so that a sentence that is broken over lines is found."""

import ast
import bisect
import dataclasses
import io
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
        if token.type != tokenize.COMMENT:
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


def texts(path, source):
    if path.suffix == ".md":
        return list(page_texts(source))
    if path.suffix in (".cpp", ".h", ".cu", ".c", ".cl", ".js"):
        return list(cpp_texts(source))
    if path.suffix == ".py":
        return list(python_texts(source))
    return []
