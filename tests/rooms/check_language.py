#!/usr/bin/env python3
"""Messages, pages and comments are in plain English: sentences with a subject and a verb, no persons for
things, no idioms. CONTRIBUTING.md has the rules with examples. None may break one of the patterns below.
Exit code 1 names the lines.

tests/rooms/check_language.py [--root FOLDER] [FOLDER...]   only these
"""

import argparse
import collections
import pathlib
import re
import sys

sys.dont_write_bytecode = True
from check_links import known_files  # noqa: E402
from texts import reader_of  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = (".ci", ".github", "bench", "cmake", "configs", "core", "data", "docs", "plugins", "python",
           "scripts", "tests", "verify")
PAGES = ("README.md", "CONTRIBUTING.md", "CMakeLists.txt", "Dockerfile", "pyproject.toml", ".clang-format",
         ".clang-tidy")
# Texts that a user sees: strings of these folders, except of tests.
SEEN = ("CMakeLists.txt", "cmake", "core", "plugins", "python/crt", "python/src", "scripts", "verify")
# The rules quote what they forbid.
QUOTES = {"CONTRIBUTING.md", "tests/rooms/check_language.py", "tests/rooms/test_language.py"}

CLAUSE = r"(?:What|Whatever|Whether|Which|How(?! to\b)|Who|Whom|Whose|Why|Where|Wherever|Of what|Of which)\b"
THING = ("(?:image|film|scene|file|page|kernel|program|backend|device|shading|vertex|surface|renderer|class)"
         "(?:e?s)?")
PATTERNS = (
    ("person", r"\b(?:[Nn]obody|[Ww]hoever|[Ss]omebody|[Aa]nybody|[Ss]omeone|[Ss]trangers?)\b|\b[Nn]o one\b"
     r"|(?:^|[;:] |\b(?:that|and|or|if) )[Ww]ho\b(?!.*\?$)",
     "name the thing or the user, or use the passive"),
    ("clause", rf"^{CLAUSE}(?!.*\?$)(?!.*[^?]\?\s)",
     "begin with the noun or the verb: 'True if …', 'The … that …', 'Returns …'"),
    ("that", r"^That (?:the|a|an|it|they|each|every|all|no|there|this|these|crt)\b",
     "begin with the main clause"),
    ("have", r"\b(?:is|are|was|were) (?:not |nowhere )?to be had\b|\bcannot be had\b",
     "'is not available', 'does not exist'"),
    ("speech", rf"\b{THING} (?:knows?|asks?|tells?)\b|\b(?:is|are|was|were) told\b",
     "a thing stores, needs, reports or requests"),
    ("another", r"\b(?:is|are|was|were) (?:others?|another)(?=[ .,;:)]|$)(?! (?:than|of|way|user))",
     "'differs', 'are different'"),
    ("idiom", r"\b(?:good books|better things to do|in any case|by any means|once and for all|anew"
     r"|beyond any use|leads nowhere|makes itself felt|at (?:one's|its) leisure|the road of|has its say"
     r"|goes its way|in one go)\b",
     "say it literally"),
    ("so many", r"\bso (?:many|much)\b(?! (?:that|more|less|as)\b)",
     "give the number or the bound: 'up to N', 'this number of'"),
    ("own", r"\bof (?:its|their|one's) own(?=[.,;:)]|$| "
            r"(?:and|or|for|in|with|that|which|where|when|by|on|from"
     r"|to|is|are|as)\b)",
     "'its own X', 'a separate X', or leave it out"),
)
PATTERNS = tuple((name, re.compile(pattern), hint) for name, pattern, hint in PATTERNS)
VERB = re.compile(r"\b(?:is|are|was|were|has|have|had|does|do|did|can|cannot|may|must|will|would|takes?|goes"
                  r"|gets?|holds?|costs?|gives?|makes?|needs?|depends?|stays?|counts?|becomes?|enters?"
                  r"|follows?|belongs?|decides?|loses?|raises?|begins?|ends?|leaves?)\b")


def split(text):
    """(place, sentence) of each sentence of a text; code in ` is one word."""
    plain = re.sub(r"`[^`\n]*`", lambda code: "`" + "x" * (len(code[0]) - 2) + "`", text).replace("\n", " ")
    for found in re.finditer(r"\S.*?(?:[.!?](?:[)\"'’”]*)(?=\s|$)|(?<=\S)(?=\s\s)|$)", plain):
        sentence = found[0].lstrip("*_([\"'“‘-•> ")
        yield found.end() - len(sentence), sentence


def complaints_of(text):
    """(place, name, hint) of each pattern that the text shows."""
    for place, sentence in split(text.text):
        for name, pattern, hint in PATTERNS:
            found = pattern.search(sentence)
            if found and not (name == "clause" and (text.heading or has_main_clause(text.kind, sentence))):
                yield place + found.start(), name, hint


def has_main_clause(kind, sentence):
    """'Where a lens is given, it '
       '…': a comma divides the clause from a main clause. In the prose of pages also
    'What is listed is no error': the clause is the subject of a second verb."""
    if re.match(r"(?:Where|Wherever)\b", sentence):
        return re.search(r"[^,]+, (?:[^,]+, )*\w+", sentence) is not None
    return kind == "page" and len(VERB.findall(sentence)) > 1


def is_in(name, places):
    """True if a file is one of these or in a folder of these."""
    return name in places or name.startswith(tuple(place + "/" for place in places))


def area(name, kind):
    if kind == "comment":
        return "comments"
    if kind == "message" and (not is_in(name, SEEN) or "/tests/" in name):
        return None
    return "messages and pages"


def check(root, folders):
    """name of the area -> lines to print."""
    found = collections.defaultdict(list)
    number = 0
    for file in sorted(known_files(root)):
        name = file.relative_to(root).as_posix()
        if name in QUOTES or not is_in(name, folders):
            continue
        reader = reader_of(file)
        if reader is None:
            continue
        source = file.read_text("utf-8")
        number += 1
        for text in reader(source):
            where = area(name, text.kind)
            if where is None or text.heading and name.startswith("docs/decisions/"):
                continue  # titles of decisions are names
            for place, pattern, hint in complaints_of(text):
                line = source.count("\n", 0, text.source_place(place)) + 1
                words = " ".join(text.text[place:place + 60].split())
                found[where].append(f"{name}:{line}: {pattern}: “{words}”: {hint}")
    return number, found


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--root", type=pathlib.Path, default=ROOT)
    parser.add_argument("folders", nargs="*")
    arguments = parser.parse_args()
    number, found = check(arguments.root.resolve(), arguments.folders or FOLDERS + PAGES)
    for where, lines in sorted(found.items()):
        print("\n".join(lines))
        print(f"{where}: {len(lines)}")
    print(f"{number} files")
    return 1 if found or not number else 0


if __name__ == "__main__":
    sys.exit(main())
