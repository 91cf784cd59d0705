"""Tests of the mutation operators, of the stored lists' format, and of the reader of coverage."""

import itertools
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import coverage
import mutants
import sandbox
from mutants import Mutant, Source, applied, code_only, draw, line_of


class Scratch:
    """A checkout with one source file."""

    def __init__(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "common" / "base" / "a.cpp"
            path.parent.mkdir(parents=True)
            path.write_text(text)
            self.source = Source(path, {"kBatch"}, pathlib.Path(folder))

    def results(self, operator):
        """The file after each edit of the operator."""
        edits = self.source.places(operator, random.Random(1))
        made = [self.source.mutant("id", operator, edit) for edit in edits]
        return [applied(m, self.source.text) for m in made]


class CodeOnly(unittest.TestCase):
    def test_hides_comments_texts_and_preprocessor_lines(self):
        text = 'int a = 1;  // 2\n/* 3\n4 */ f("5 \\" 6", \'7\');\n#define B 8 \\\n 9\n R"(10)";\n'
        self.assertEqual(
            re.findall(r"\d+", code_only(text)), ["1"]
        )
        self.assertEqual(len(code_only(text)), len(text))
        self.assertEqual(code_only(text).count("\n"), text.count("\n"))

    def test_keeps_digit_separators(self):
        self.assertEqual(code_only("int a = 1'000'000;"), "int a = 1'000'000;")


class Operators(unittest.TestCase):
    def only(self, operator, text, *expected):
        body = f"void f() {{\n  {text}\n}}\n"
        got = [r.split("\n")[1].strip() for r in Scratch(body).results(operator)]
        self.assertEqual(got, list(expected))

    def test_relational(self):
        self.only("relational", "g(a < b);", "g(a >= b);")
        self.only("relational", "std::vector<int> a;")

    def test_bound(self):
        self.only("bound", "g(a >= b);", "g(a > b);")

    def test_arithmetic(self):
        self.only("arithmetic", "g(a * b + *c);", "g(a / b + *c);", "g(a * b - *c);")

    def test_logical(self):
        self.only("logical", "g(a && b);", "g(a || b);")

    def test_constant(self):
        self.only("constant", "g(0.0, x2);", "g(1.0, x2);")
        for operator_seed in range(5):
            edits = mutants._constants("1e-3f", random.Random(operator_seed))
            self.assertIn(edits[0][2], ("0.002f", "0.0005f"))
            self.assertIn(mutants._constants(" 0 ", random.Random(operator_seed))[0][2], "1")

    def test_sign(self):
        self.only("sign", "return -a - b;", "return a - b;")
        self.only("sign", "g(-a, b);", "g(a, b);")

    def test_condition(self):
        got = {r for s in range(9) for r in [self.condition("if (a(b)) c();", s)]}
        self.assertEqual(got, {"if (true) c();", "if (false) c();", "if (!(a(b))) c();"})
        self.only("condition", "if (const int a = b()) c();")
        self.only("condition", "while (a) b();", "while (false) b();")

    def condition(self, text, seed):
        scratch = Scratch(f"void f() {{\n  {text}\n}}\n")
        edit = scratch.source.places("condition", random.Random(seed))[0]
        made = scratch.source.mutant("id", "condition", edit)
        return applied(made, scratch.source.text).split("\n")[1].strip()

    def test_dropped_statement(self):
        self.only("dropped statement", "a.b(c);", ";")
        self.only("dropped statement", "a = b;", ";")
        self.only("dropped statement", "continue;", ";")
        self.only("dropped statement", "return b;")
        self.only("dropped statement", "int a = b;")

    def test_dropped_statement_after_a_comment_and_a_blank_line(self):
        text = "void f() {\n  a(b);  // why\n\n  // because\n  forget(c);\n}\n"
        self.assertEqual(Scratch(text).results("dropped statement")[1],
                         "void f() {\n  a(b);  // why\n\n  // because\n  ;\n}\n")

    def test_dropped_statement_spans_lines(self):
        text = "void f() {\n  a(b,\n    [] { c; });\n  d();\n}\n"
        self.assertEqual(Scratch(text).results("dropped statement")[0],
                         "void f() {\n  ;\n  d();\n}\n")

    def test_minimum_and_boolean(self):
        self.only("minimum", "g(std::min(a, b));", "g(std::max(a, b));")
        self.only("boolean", "g(true, a_true);", "g(false, a_true);")

    def test_skips_assertions_and_constants_of_speed(self):
        self.only("constant", "assert(a == 1);")
        self.only("constant", "constexpr int kBatch = 16;")
        self.only("relational", "g(kBatch == 16);", "g(kBatch != 16);")
        self.only("constant", "g(kBatch + 16);", *self.either("g(kBatch + 32);", "g(kBatch + 8);"))

    def either(self, *texts):
        edits = mutants._constants(" 16)", random.Random(1))
        return [texts[0] if edits[0][2] == "32" else texts[1]]


class Stored(unittest.TestCase):
    def test_text_is_unique(self):
        scratch = Scratch("void f() {\n  a(1);\n}\nvoid g() {\n  a(1);\n}\n")
        made = [scratch.source.mutant("id", "constant", e)
                for e in scratch.source.places("constant", random.Random(1))]
        self.assertEqual([line_of(m, scratch.source.text) for m in made], [2, 5])
        for m in made:
            self.assertEqual(scratch.source.text.count(m.text), 1)

    def test_a_text_that_is_missing_or_repeated_is_refused(self):
        for source in ("b", "a a"):
            with self.assertRaises(ValueError):
                applied(Mutant("id", "constant", "f", "a", "c"), source)

    def test_a_list_is_saved_into_a_new_folder(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "new" / "list.json"
            saved = [Mutant("1-1", "constant", "f", "a", "c", program="p_test", test="P.Test"),
                     Mutant("1-2", "dropped statement", "f", "a;", "", survives="x", by_hand=True)]
            mutants.save(path, saved)
            self.assertEqual(mutants.load(path), saved)

    def test_only_an_edit_of_the_stated_operator_can_be_drawn(self):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name)
            (root / "a.cpp").write_text("void f() {\n  if (a < 3) g(4);\n  h();\n}\n")

            def can(operator, text, replacement):
                return mutants.can_be_drawn(Mutant("i", operator, "a.cpp", text, replacement), root)

            for condition in ("true", "false", "!(a < 3)"):
                self.assertTrue(can("condition", "a < 3", condition))
            self.assertTrue(can("dropped statement", "  h();\n", "  ;\n"))
            self.assertTrue(can("constant", "3", "2") and can("constant", "3", "4"))
            self.assertFalse(can("constant", "3", "5"))
            self.assertFalse(can("bound", "a < 3", "a >= 3"))
            self.assertFalse(can("dropped statement", "  if (a < 3) g(4);\n  h();\n", ""))
            self.assertFalse(can("statement", "  h();\n", "  ;\n"))

    def test_draw_is_reproducible_and_avoids_taken_mutants(self):
        first = list(itertools.islice(draw(7), 40))
        self.assertEqual(first, list(itertools.islice(draw(7), 40)))
        taken = {(m.file, m.text) for m in first}
        again = itertools.islice(draw(8, taken=taken), 40)
        self.assertFalse(taken & {(m.file, m.text) for m in again})
        self.assertEqual(len({mutants.stratum_of(m.file) for m in first}), 40)


class Coverage(unittest.TestCase):
    SOURCE = """int unused(int x) {
  return x + 1;
}
inline int square(int x) {
  return x * x;
}
struct Local {
  int twice(int x) const { return 2 * x; }
  int never(int x) const { return -x; }
};
int main() {
  return square(2) + Local().twice(2) > 0 ? 0 : Local().never(1);
}
"""

    def test_names_the_programs_that_execute_the_innermost_function(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name).resolve()
            (folder / "a.cpp").write_text(self.SOURCE)
            subprocess.run(["c++", *coverage.FLAGS.split(), "-c", "a.cpp"], cwd=folder, check=True)
            subprocess.run(["c++", "--coverage", "a.o", "-o", "a"], cwd=folder, check=True)
            counters = folder / "counters"
            subprocess.run([folder / "a"], check=True,
                           env=os.environ | {"GCOV_PREFIX": str(counters / "a_test")})
            (counters / "killed_test").mkdir()
            (counters / "a_test" / "ended").touch()
            found = coverage.Coverage(counters, folder)
            executed = {line for line in range(1, 14) if found.programs("a.cpp", line)}
            self.assertEqual(found.programs("a.cpp", 5), {"a_test", "killed_test"})
            # Another compilation may have other functions.
            gcno = folder / "a.gcno"
            gcno.write_bytes(gcno.read_bytes()[:8] + b"\0\0\0\0" + gcno.read_bytes()[12:])
            self.assertEqual(coverage.Coverage(counters, folder).unknown,
                             {"a_test", "killed_test"})
        self.assertEqual(executed, {4, 5, 6, 8, 11, 12, 13})


class FailedTest(unittest.TestCase):
    def test_is_the_first_that_is_named_or_the_last_that_was_started(self):
        started = "[ RUN      ] A.One\n[       OK ] A.One\n[ RUN      ] P/B.Two/3\n"
        self.assertEqual(sandbox.failed_test(started), "P/B.Two/3")
        self.assertEqual(sandbox.failed_test(started + "[  FAILED  ] A.One (3 ms)\n"), "A.One")
        # A failure between tests has no name.
        self.assertEqual(sandbox.failed_test(started + "[  FAILED  ] 0 tests, listed below:\n"
                                             "[  FAILED  ] B: SetUpTestSuite\n"), "P/B.Two/3")
        self.assertIsNone(sandbox.failed_test("Segmentation fault\n"))


if __name__ == "__main__":
    unittest.main()
