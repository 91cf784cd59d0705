"""Mutants: small faults in the product's sources. Draws, stores and applies them.

A mutant is a file, a text that occurs exactly once in it, and the text that replaces it. draw()
makes mutants by the operators below alone, so that they are not chosen to be caught. The others are
marked `by_hand`: a person wrote or rewrote them.
"""

import bisect
import json
import pathlib
import random
import re
from dataclasses import asdict, dataclass

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent
PRODUCT = ("common", "capture_node", "recon_node", "sim_node", "render_node", "launch")
SUFFIXES = {".cpp", ".h", ".comp", ".glsl", ".vert", ".frag"}


@dataclass
class Mutant:
    """`program` and `test` name the test that must fail. A mutant that no test can notice has the
    reason in `equivalent`; one that no test notices yet has it in `survives`."""

    id: str
    operator: str
    file: str  # relative to the checkout
    text: str  # occurs exactly once in the file
    replacement: str
    program: str = ""
    test: str = ""
    equivalent: str = ""
    survives: str = ""
    by_hand: bool = False


def load(path):
    return [Mutant(**entry) for entry in json.loads(pathlib.Path(path).read_text())]


def save(path, mutants):
    """Makes the parent folder if needed."""
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    entries = [{k: v for k, v in asdict(m).items() if k == "replacement" or v not in ("", False)}
               for m in mutants]
    path.write_text(json.dumps(entries, indent=1, ensure_ascii=False) + "\n")


def applied(mutant, source):
    """Returns the source with the fault. Raises ValueError unless the text occurs exactly once."""
    count = source.count(mutant.text)
    if count != 1:
        raise ValueError(f"{mutant.id}: the text occurs {count} times in {mutant.file}, not once")
    if mutant.text == mutant.replacement:
        raise ValueError(f"{mutant.id}: the replacement equals the text")
    return source.replace(mutant.text, mutant.replacement)


def line_of(mutant, source):
    """Number of the first line that differs, from 1."""
    before = source[: source.index(mutant.text)].count("\n") + 1
    same = 0
    for old, new in zip(mutant.text.split("\n"), mutant.replacement.split("\n")):
        if old != new:
            break
        same += 1
    return before + same


# ---- Finding places ------------------------------------------------------------------------------

_HIDDEN = re.compile(
    r'R"\((?:.|\n)*?\)"'  # raw string
    r'|"(?:\\.|[^"\\\n])*"'
    r"|(?<![0-9A-Za-z])'(?:\\.|[^'\\\n])'"  # not a digit separator
    r"|//[^\n]*|/\*(?:.|\n)*?\*/"
    r"|^[ \t]*#(?:\\\n|[^\n])*",
    re.M,
)


def code_only(source):
    """The source, of equal length, with spaces for comments, texts and preprocessor lines."""
    return _HIDDEN.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), source)


def _closing(code, start):
    """Index of the parenthesis that closes the one at `start`."""
    depth = 0
    for i in range(start, len(code)):
        depth += (code[i] == "(") - (code[i] == ")")
        if depth == 0:
            return i
    return len(code) - 1


def _swaps(pairs):
    table = dict(pairs) | {b: a for a, b in pairs if b not in dict(pairs)}
    pattern = re.compile("|".join(rf"(?<![\w:]){re.escape(k)}" for k in table))
    return lambda code, rng: [(m.start(), m.end(), table[m[0]]) for m in pattern.finditer(code)]


def _spaced(table):
    pattern = re.compile("(?<= )(" + "|".join(re.escape(k) for k in table) + ")(?=[ \n])")
    return lambda code, rng: [(m.start(), m.end(), table[m[0]]) for m in pattern.finditer(code)]


_NUMBER = re.compile(
    r"(?<![\w.'])(\d[\d']*(?:\.\d*)?(?:e[+-]?\d+)?)([fuUlL]*)(?![\w.'])"
)


def _constants(code, rng):
    edits = []
    for m in _NUMBER.finditer(code):
        digits, suffix = m[1].replace("'", ""), m[2]
        if re.search(r"[.e]", digits):
            value = float(digits)
            new = repr(value * 2 if rng.random() < 0.5 else value / 2) if value else "1.0"
        else:
            value = int(digits)
            if value >= 16:
                new = str(value * 2 if rng.random() < 0.5 else value // 2)
            else:
                new = str(value + 1 if value == 0 or rng.random() < 0.5 else value - 1)
        edits.append((m.start(), m.end(), new + suffix))
    return edits


_SIGN = re.compile(r"(?<=[(,=<>?:&|*/{\[])(\s*)-(?=[\w(])|(?<=\breturn )-(?=[\w(])")


def _signs(code, rng):
    return [(m.end() - 1, m.end(), "") for m in _SIGN.finditer(code)]


_CONDITION = re.compile(r"\b(?:if|while) \(")


def _conditions(code, rng):
    edits = []
    for m in _CONDITION.finditer(code):
        start = m.end() - 1
        inner = code[start + 1 : _closing(code, start)]
        if ";" in inner or re.search(r"[^=!<>]=[^=]", inner):
            continue  # declares or assigns
        if m[0].startswith("while"):
            new = "false"
        else:
            new = rng.choice(["true", "false", None])
        edits.append((start + 1, start + 1 + len(inner), new))  # None: the negation
    return edits


_STATEMENT = re.compile(
    r"(?<=[;{}):])[ \t]*\n\s*(?:"  # code_only() leaves spaces where comments are
    r"(?:break|continue)(?=;)"
    r"|(?:\+\+|--)[\w.\->\[\]]+(?=;)"
    r"|[\w.:\->\[\]()*]+ (?:=|\+=|-=|\*=|/=|\|=|&=)(?=\s)"
    r"|(?!(?:return|if|for|while|switch|sizeof|static_assert|assert)\b)[\w.:\->\[\]]+(?=\()"
    r")"
)


def _statements(code, rng):
    edits = []
    for m in _STATEMENT.finditer(code):
        start = m.start() + len(m[0]) - len(m[0].lstrip())
        depth, end = 0, m.end()
        while end < len(code) and not (code[end] == ";" and depth == 0):
            depth += (code[end] in "({[") - (code[end] in ")}]")
            if depth < 0:
                break
            end += 1
        if depth == 0 and end < len(code) and not re.match(r"[\w:]+\([^;]*\)\s*:", code[start:end]):
            edits.append((start, end, ""))
    return edits


# Operator, weight, edits of a code: (start, end, replacement). Changes of a bound by one, such as
# < to <=, have a low weight: between floating-point numbers most of them change nothing.
OPERATORS = {
    "relational": (
        2,
        _spaced({"<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "=="}),
    ),
    "bound": (1, _spaced({"<": "<=", ">": ">=", "<=": "<", ">=": ">"})),
    "arithmetic": (
        2,
        _spaced({"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "%": "/"}),
    ),
    "logical": (1, _spaced({"&&": "||", "||": "&&"})),
    "constant": (2, _constants),
    "sign": (1, _signs),
    "condition": (2, _conditions),
    "dropped statement": (3, _statements),
    "minimum": (1, _swaps([("std::min", "std::max"), ("hn::Min", "hn::Max")])),
    "boolean": (1, _swaps([("true", "false")])),
    "vector": (
        1,
        _swaps([("hn::Add(", "hn::Sub("), ("hn::Lt(", "hn::Ge("), ("hn::Gt(", "hn::Le("),
                ("hn::And(", "hn::Or("), ("hn::MulAdd(", "hn::MulSub(")]),
    ),
}

# assert() and static_assert() are not in the release build; reserve() only saves time.
_SKIPPED_LINE = re.compile(
    r"\bassert\(|\bstatic_assert\b|\breserve\(|^\s*(?:using|namespace|template)\b"
)


def speed_constants():
    """The constants that steer speed alone: no mutant changes their values."""
    lines = (FOLDER / "speed-constants.txt").read_text().splitlines()
    return {line.split()[0] for line in lines if line.strip() and not line.startswith("#")}


class Source:
    """The places of a file that an operator can change."""

    def __init__(self, path, skipped_constants, root=ROOT):
        self.file = str(path.relative_to(root))
        self.text = path.read_text()
        self.code = code_only(self.text)
        self._line_starts = [0] + [m.end() for m in re.finditer("\n", self.text)]
        names = "|".join(map(re.escape, sorted(skipped_constants)))
        self._skipped = re.compile(rf"\b(?:{names})(?:\[\])?\s*(?:=(?!=)|\{{)") if names else None

    def places(self, operator, rng):
        edits = OPERATORS[operator][1](self.code, rng)
        return [edit for edit in edits if not self._is_skipped(edit)]

    def mutant(self, identifier, operator, edit):
        start, end, new = edit
        if new is None:
            new = f"!({self.text[start:end]})"
        first, last = self._line(start), self._line(max(start, end - 1))
        while True:  # adds lines above and below until the text is unique
            begin, stop = self._line_starts[first], self._end(last)
            text = self.text[begin:stop]
            if self.text.count(text) == 1:
                break
            first, last = max(0, first - 1), min(len(self._line_starts) - 1, last + 1)
        changed = self.text[begin:start] + new + self.text[end:stop]
        return Mutant(identifier, operator, self.file, text, changed)

    def _is_skipped(self, edit):
        line = self._line(edit[0])
        text = self.code[self._line_starts[line] : self._end(line)]
        return bool(
            _SKIPPED_LINE.search(text) or (self._skipped and self._skipped.search(text))
        )

    def _line(self, offset):
        return bisect.bisect_right(self._line_starts, offset) - 1

    def _end(self, line):
        last = line + 1 == len(self._line_starts)
        return len(self.text) if last else self._line_starts[line + 1] - 1


class FixedChoice:
    """Stands for random.Random, and always makes the same of the choices."""

    def __init__(self, number):
        self.number = number

    def random(self):
        return 0.25 if self.number == 0 else 0.75

    def choice(self, options):
        return options[self.number % len(options)]


def can_be_drawn(mutant, root=ROOT):
    """Whether draw() can make this mutant of the present sources: one edit of its operator."""
    source = Source(root / mutant.file, (), root)
    changed = applied(mutant, source.text)
    if mutant.operator not in OPERATORS:
        return False
    for choice in range(3):  # an operator chooses between at most three edits of a place
        for start, end, new in source.places(mutant.operator, FixedChoice(choice)):
            if new is None:
                new = f"!({source.text[start:end]})"
            if source.text[:start] + new + source.text[end:] == changed:
                return True
    return False


def stratum_of(file):
    """The module of a file; the wiring of each node is a module of its own."""
    path = pathlib.PurePosixPath(file)
    if path.name == "main.cpp" or path.stem.endswith("_pipe"):
        return f"{path.parent} (wiring)"
    return str(path.parent)


def sources_by_stratum(root=ROOT):
    skipped = speed_constants()
    strata = {}
    for top in PRODUCT:
        for path in sorted((root / top).rglob("*")):
            if path.suffix in SUFFIXES:
                source = Source(path, skipped, root)
                strata.setdefault(stratum_of(source.file), []).append(source)
    return strata


def draw(seed, root=ROOT, taken=()):
    """Yields mutants until no module has an unused one: one per stratum and round, in an order that
    only the seed and the sources determine. `taken`: (file, text) of mutants that must not be drawn
    again."""
    strata = sources_by_stratum(root)
    taken = set(taken)
    rngs = {name: random.Random(f"{seed} {name}") for name in strata}
    number = 0
    while strata:
        order = sorted(strata)
        random.Random(f"{seed} {number}").shuffle(order)
        for name in order:
            mutant = _draw_one(strata[name], rngs[name], taken)
            if mutant is None:
                del strata[name]
                continue
            number += 1
            mutant.id = f"{seed}-{number:03}"
            yield mutant


def _draw_one(sources, rng, taken):
    for _ in range(200):
        operator = rng.choices(list(OPERATORS), [weight for weight, _ in OPERATORS.values()])[0]
        places = [(s, edit) for s in sources for edit in s.places(operator, rng)]
        if not places:
            continue
        source, edit = rng.choice(places)
        mutant = source.mutant("", operator, edit)
        if (mutant.file, mutant.text) not in taken:
            taken.add((mutant.file, mutant.text))
            return mutant
    return None
