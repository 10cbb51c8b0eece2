#!/usr/bin/env python3
"""check_language.py finds each pattern in messages, pages and comments, also over line breaks, and accepts
plain sentences."""

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
WRAPS = {
    "core/a.cpp": ("// {}", 'const char* a = "{}";', "/* {} */", "int b = 1'000;  ///< {}"),
    "python/crt/a.py": ("# {}", 'a = "{}"', 'def b():\n    """{}"""'),
    "docs/a.md": ("{}", "- {}", "> {}"),
}


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
        folder, _, ending = place.rpartition(".")
        for number, wrap in enumerate(wraps):
            for case, (name, text) in enumerate(cases):
                file = f"{folder}_{number}_{case}.{ending}"
                files[file] = "\n\n" + wrap.format(text) + "\n"
                line = 4 if "\n" in wrap else 3
                expected.append(f"{file}:{line}: {name}: ")
    files["core/broken.cpp"] = ('/// A loop of\n/// its own.\n'
                                'const char* b = "a loop of "\n    "its own";\n')
    expected += ["core/broken.cpp:1: own: ", "core/broken.cpp:3: own: "]
    files["docs/code.md"] = "```\nNobody may differ.\n```\n\n    Nobody may differ.\n\n`Nobody`\n"
    for place, wraps in WRAPS.items():
        folder, _, ending = place.rpartition(".")
        for number, wrap in enumerate(wraps):
            for case, text in enumerate(PLAIN):
                files[f"{folder}_plain_{number}_{case}.{ending}"] = wrap.format(text) + "\n"
    done = check(files)
    found = done.stdout.splitlines()
    for want in expected:
        if not any(line.startswith(want) for line in found):
            failed += 1
            print(f"not found: {want}")
    for line in found:
        if "plain" in line or "code.md" in line:
            failed += 1
            print(f"plain, and called wrong: {line}")
    if done.returncode not in (0, 1) or done.stderr:
        failed += 1
        print(done.stderr)
    print(f"{len(files)} cases, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
