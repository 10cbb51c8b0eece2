#!/usr/bin/env python3
"""Applies mutants to files, and checks the messages of those that do not fit."""

import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
from mutant import Misfit, Mutant  # noqa: E402

SOURCE = """\
/* area(x) is no function. */
#define LIMIT 4.0f
constexpr float kScale = 2.0f;

CRT_FN f32 area(f32 x) {
    /* The square. */
    const f32 y = x * x;
    return y * LIMIT;
}

CRT_FN f32 twice(f32 x) {
    const f32 y = x * x;
    return y + y;
}
"""


class Fits(unittest.TestCase):
    def result(self, edits, source=SOURCE):
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder)
            (tree / "a.h").write_text(source)
            file = tree / "1-name.mutant"
            head = "Mutation: name\nList: item\nBreaks: It is\n  wrong.\nKilled-by: unit one test\n\n"
            file.write_text(head + edits)
            mutant = Mutant(file)
            self.assertEqual((mutant.number, mutant.name, mutant.breaks), ("1", "name", "It is wrong."))
            self.assertEqual((mutant.check_kind, mutant.check_name), ("unit", "one test"))
            before = mutant.apply(tree)
            self.assertEqual(before, {"a.h": source})
            return (tree / "a.h").read_text()

    def misfit(self, edits, words, source=SOURCE):
        with self.assertRaisesRegex(Misfit, words):
            self.result(edits, source)

    def test_the_function_is_part_of_the_place(self):
        self.assertEqual(self.result("In: a.h twice\n- x * x\n+ x\n"),
                         SOURCE.replace("= x * x;\n    return y +", "= x;\n    return y +"))

    def test_macros_and_constants_are_places_too(self):
        self.assertEqual(self.result("In: a.h LIMIT\n- 4.0f\n+ 5.0f\n\nIn: a.h kScale\n- 2.0f\n+ 3.0f\n"),
                         SOURCE.replace("4.0f", "5.0f").replace("2.0f", "3.0f"))

    def test_layout_and_comments_do_not_count(self):
        edits = "In: a.h area\n- const f32 y = x * x;\n- return y\n+ return x\n"
        self.assertEqual(self.result(edits, SOURCE.replace("y = x", "y =  /* why */\n        x", 1)),
                         self.result(edits))
        self.assertEqual(self.result(edits, SOURCE.replace("kScale = 2.0f", "kScale = 3.0f")),
                         self.result(edits).replace("kScale = 2.0f", "kScale = 3.0f"))

    def test_a_line_that_is_left_blank_goes(self):
        self.assertEqual(self.result("In: a.h area\n- const f32 y = x * x;\n\n- y * LIMIT\n+ x\n"),
                         SOURCE.replace("    const f32 y = x * x;\n    return y * LIMIT", "    return x"))

    def test_what_does_not_fit_is_said(self):
        self.misfit("In: a.h none\n- x\n+ y\n", "a.h has no function none")
        self.misfit("In: a.h area\n- z\n+ y\n", "in area of a.h this is not there: z")
        self.misfit("In: a.h twice\n- y\n+ x\n", "in twice of a.h this is there 3 times: y")
        self.misfit("In: a.h area\n- square\n+ y\n", "not there")  # A comment.
        self.misfit("In: a.h LIMIT\n- 4.0\n+ 5.0\n", "not there")  # Half a number.


if __name__ == "__main__":
    unittest.main()
