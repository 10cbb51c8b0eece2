#!/usr/bin/env python3
"""check_language.py finds each pattern in messages, pages and comments of each kind of file, also over line
breaks, and accepts plain sentences."""

import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(__file__).with_name("check_language.py")

PLANTED = {
    "person": ["Nobody may differ.", "It is for whoever builds it.", "The error goes to somebody.",
               "There is no one to ask.", "It is closed: who has the token may enter."],
    "clause": ["What a sample adds to the film.", "Whether the kernel is lean.", "How the image is "
                                                                                 "developed.",
               "Which of them are there.", "Where the file is.", "Whose turn it is."],
    "that": ["That the film is whole."],
    "have": ["The port is not to be had.", "Five replicates cannot be had."],
    "speech": ["The image knows its error.", "The scene asks for planes.", "Each thread is told once."],
    "another": ["The materials are others.", "It was another."],
    "idiom": ["It stays in the cache's good books.", "Kernels are compiled anew.", "The link leads "
                                                                                   "nowhere."],
    "so many": ["It ends after so many samples."],
    "own": ["Each has a loop of its own."],
}
PLAIN = ("Returns the error of the image.", "True if the kernel is lean.", "How large is the error?",
         "Where a lens is given, the camera focuses.", "The file that has a record of its own scene.",
         "Users who build crt need CMake.", "There are so many that it matters.", "How to add a material.",
         "It differs from the other one; is another than the first excluded?", "`What is this` is code.")
# A cell of text, and a comment of a cell of code.
TEXT_CELL = '{"cells": [{"cell_type": "markdown", "source": [\n"# A title\\n",\n"{}"]}]}'
CODE_CELL = '{"cells": [{"cell_type": "code", "source": [\n"a = 1\\n",\n"# {}"]}]}'
# Name of a file, with {} for the number of the case -> texts of such a file, with {} for the sentence.
WRAPS = {
    "core/a{}.cpp": ("// {}", 'const char* a = "{}";', "/* {} */", "int b = 1'000;  ///< {}"),
    "python/crt/a{}.py": ("# {}", 'a = "{}"', 'def b():\n    """{}"""'),
    "docs/a{}.md": ("{}", "- {}", "> {}"),
    "docs/a{}.md.in": ("{}",),
    "docs/a{}.ipynb": (TEXT_CELL, CODE_CELL),
    "core/a{}/CMakeLists.txt": ("# {}", 'message(STATUS "#1")  # {}', 'message("{}")'),
    "core/a{}.cmake": ("# {}", "set(A [[ \" ]])\n# {}"),
    "core/a{}.cmake.in": ("# {}",),
    "core/a{}.sh": ("# {}", "a='it # is'  # {}", 'echo "{}"', "b=${#a}\n    # {}"),
    "core/script{}": ("#!/usr/bin/env bash\n# {}", "#!/usr/bin/env bash\necho $1  # {}",
                      "#!/usr/bin/env python3\na = '''{}'''", "#!/usr/bin/env python3\n# {}"),
    "core/a{}.yaml": ("# {}", "a: crt's  # {}", 'title: "{}"', "title: {}  # a comment"),
    "core/a{}/Dockerfile": ("# {}",),
    "core/a{}.toml": ("# {}",),
    "core/a{}.html": ("<p>{}</p>", "<b>A title</b></p><p>{}", "{# {} #}", "<!-- {} -->", '<a alt="{}">',
                      "{{ a(\"{}\") }}", "{% if a %}\n{}\n{% endif %}"),
    "core/a{}.mutant": ("Breaks: {}", "List: {}"),
}
# Sentences that begin in one line and end in another.
BROKEN = {
    "core/broken.cpp": ('/// A loop of\n/// its own.\n'
                        'const char* b = "a loop of "\n    "its own";\n', (1, 3)),
    "core/broken.sh": ('# A loop of\n# its own.\necho "a loop of" \\\n    "its own"\n', (1, 3)),
    "core/CMakeLists.txt": ('set(A ON)\n# A loop of\n# its own.\nmessage("a loop of "\n  "its own")\n',
                            (2, 4)),
    "core/broken.yaml": ("a: 1\n# A loop of\n# its own.\n", (2,)),
    "core/broken.html": ("<p>A\n<b>loop</b> of\n    its <i>own</i>.</p>\n<p>A loop of\nits own.\n", (2, 4)),
    "core/broken.mutant": ("Mutation: a\nBreaks: It has a loop\n  of\n  its own.\n", (3,)),
    "docs/broken.ipynb": (TEXT_CELL.replace("{}", 'A loop of\\n",\n"its own.'), (3,)),
}
# Text that is code; @ stands for a word that no sentence may have.
CODE = {
    "docs/code.md": "```\n@ may differ.\n```\n\n    @ may differ.\n\n`@`\n",
    "docs/code.ipynb": TEXT_CELL.replace("{}", "```\\n\",\n\"@ may differ.\\n\",\n\"```"),
    "core/code.html": ("<!DOCTYPE @><style>@ {}</style><script>@()</script>\n"
                       "<pre>@</pre><h2>What is listed</h2>\n"
                       '<p class="@ may">{% if @ %}{{ @ }}{% endif %}</p>\n'),
    "core/code.yaml": "a: @\nb: 'it # @ may differ.'\nc: [\"# @\"]\n",
    "core/code.sh": "echo $# 'it # @ may' @#@\n",
    "core/code.mutant": "Mutation: @\nKilled-by: unit @\n\nIn: a b\n- @\n+ b /* @ */\n",
    "core/code": "@ is no script.\n",
}
CODE = {name: text.replace("@", PLANTED["person"][0].split()[0]) for name, text in CODE.items()}


def check(files):
    with tempfile.TemporaryDirectory() as name:
        for place, text in files.items():
            path = pathlib.Path(name, place)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return subprocess.run([sys.executable, CHECK, "--root", name, "core", "python", "docs"],
                              capture_output=True, text=True)


def main():
    failed = 0
    cases = [(name, text) for name, planted in PLANTED.items() for text in planted]
    files, expected = {}, []
    for place, wraps in WRAPS.items():
        for number, wrap in enumerate(wraps):
            above = "" if wrap.startswith("#!") else "\n\n"
            line = 1 + (above + wrap)[:(above + wrap).index("{}")].count("\n")
            for case, (name, text) in enumerate(cases):
                file = place.replace("{}", f"_{number}_{case}")
                files[file] = above + wrap.replace("{}", text) + "\n"
                expected.append(f"{file}:{line}: {name}: ")
            for case, text in enumerate(PLAIN):
                files[place.replace("{}", f"_plain_{number}_{case}")] = wrap.replace("{}", text) + "\n"
    for file, (text, lines) in BROKEN.items():
        files[file] = text
        expected += [f"{file}:{line}: own: " for line in lines]
    files.update(CODE)
    done = check(files)
    found = done.stdout.splitlines()
    for want in expected:
        if not any(line.startswith(want) for line in found):
            failed += 1
            print(f"not found: {want}")
    for line in found:
        if "plain" in line or line.split(":")[0] in CODE:
            failed += 1
            print(f"plain, and called wrong: {line}")
    if done.returncode not in (0, 1) or done.stderr:
        failed += 1
        print(done.stderr)
    print(f"{len(files)} cases, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
