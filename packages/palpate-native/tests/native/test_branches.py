"""Branches of the laws in C that recorded ticks take, and the conditions that decide a tick of the guard."""

import ast
import inspect
import itertools
import re
import shutil
import subprocess
import textwrap

import pytest

from palpate.force import guard
from palpate.force.gains import load_gains
from palpate_native.replay import program, write_rows

UNREACHABLE = {
    "floored": "test_the_operators_of_python_are_those_of_c takes each branch",
    "modulo": "test_the_operators_of_python_are_those_of_c takes each branch",
    "root": "the root of minus infinity, which no variance is; likewise",
    "law->locking > 0.0": "a switch that gains of palpate tune have on",
    "law->bounding > 0.0": "a switch that gains of palpate tune have on",
    "law->backing == 0.0": "a switch that gains of palpate tune have on",
    "variance > 0.0 ? sqrt(variance) : UNKNOWN": "rounding leaves no variance",
    "known->std.x == 0.0 ||": "the estimate is forgotten in free motion, so the second condition decides nothing",
    "stopped": "a tip that a servo moves; the recorded presses are those of a position arm",
    "&& known->found.x > 0.0": "likewise: the last condition of a servo's touch",
    "lead": "likewise",
    "state->law.stage.phase == 2.0": "there is no fourth phase",
}
"""Branches that no press takes, by their function or a piece of their line, and why."""


@pytest.mark.long
@pytest.mark.skipif(not (shutil.which("gcc") and shutil.which("gcov")), reason="there is no gcc with gcov")
def test_recorded_presses_take_every_branch_that_there_is_a_way_to(force, tmp_path):
    more = "".join(f"palpate_force_{name}(&state);" for name in ("phase", "trouble"))
    also = f"++ticks; palpate_force_estimate(gains, &state); {more}"
    replay = program(force.module, force.recording.inputs).replace("++ticks;", also)
    (tmp_path / "palpate_force.c").write_text(force.sources.source)
    (tmp_path / "palpate_force.h").write_text(force.sources.header)
    (tmp_path / "replay.c").write_text(replay)
    write_rows(tmp_path / "press.bin", force.recording.presses(400_000, 1))
    build = "gcc -std=c99 -O0 -ffp-contract=off --coverage -I. palpate_force.c replay.c -lm -o replay"
    for words in (build, "./replay", "gcov -b -c replay-palpate_force.gcda"):
        subprocess.run(words.split(), cwd=tmp_path, check=True, capture_output=True)
    branches = list(branches_of((tmp_path / "palpate_force.c.gcov").read_text()))
    left = {(place, line) for place, line, taken in branches if not taken}
    reasons = {why for why in UNREACHABLE for place, line in left if why == place or why in line}
    assert len(branches) > 300
    assert [one for one in left if not any(why == one[0] or why in one[1] for why in UNREACHABLE)] == []
    assert reasons == set(UNREACHABLE), "a branch that presses take is not called unreachable"


def branches_of(text):
    """Function, line, and whether it was taken, of each branch in a report of gcov."""
    place = line = ""
    for row in text.splitlines():
        if row.startswith("function "):
            place = row.split()[1]
        elif source := re.match(r"\s*[#\-\d*=]+:\s*\d+:(.*)", row):
            line = source[1].strip()
        elif branch := re.match(r"branch\s+\d+ (never executed|taken (\d+))", row):
            yield place, line, bool(branch[2]) and branch[2] != "0"


DECISIVE = {
    "not (abs(force) <= SCALES * law.full_scale and abs(position) <= FAR)": "F-:T TF:T TT:F",
    "guard.silent > 0.0 or not missed <= 0.0": "FF:T FT:F T-:T",
    "guard.silent > lag or not missed <= lag": "FF:T FT:F T-:T",
    "gap": "F:F T:T",
    "force == state.watch.last and state.ticks > 0.0": "F-:F TF:F TT:T",
    "unchanged > 0.0": "F:F T:T",
    "not abs(speed) <= law.speed": "F:T T:F",
}
"""Each decision of `safe_step` with the truths of its conditions, a dash where one is not asked, and its own."""


@pytest.mark.long
def test_each_condition_of_the_guard_decides_a_tick(force, gains):
    """Modified condition/decision coverage of `safe_step`, by ticks that C repeats to the last bit."""
    seen, law = {}, load_gains(gains).cautious()
    step = recorder(guard.safe_step, seen)
    for rows in itertools.islice(force.recording.presses(10**6, 1), 14):
        state, quiet = law.start(), guard.QUIET
        for desired, reading, position, missed in rows[:700, 1:5].tolist():
            _, state, quiet = step(law, state, quiet, desired, reading, position, missed)
    assert {text: " ".join(sorted(vectors)) for text, vectors in seen.items()} == DECISIVE
    for text, vectors in DECISIVE.items():
        rows = [vector.split(":") for vector in vectors.split()]
        for at in range(len(rows[0][0])):
            assert any(decides(at, *pair) for pair in itertools.combinations(rows, 2)), (text, at)


def decides(at, first, second):
    """Whether two ticks differ in the decision and, of the conditions that both ask, in that one alone."""
    pairs = list(zip(first[0], second[0], strict=True))
    others = all(a == b or "-" in (a, b) for k, (a, b) in enumerate(pairs) if k != at)
    return first[1] != second[1] and "-" not in pairs[at] and pairs[at][0] != pairs[at][1] and others


class Marked(ast.NodeTransformer):
    """Has each decision ask its conditions by number."""

    def decision(self, test):
        leaves = itertools.count()
        text, marked = ast.unparse(test), ast.unparse(self.conditions(test, leaves))
        return ast.parse(f"_decide({text!r}, {next(leaves)}, lambda: {marked})", mode="eval").body

    def conditions(self, node, leaves):
        if isinstance(node, ast.BoolOp):
            node.values = [self.conditions(one, leaves) for one in node.values]
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            node.operand = self.conditions(node.operand, leaves)
        else:
            node = ast.parse(f"_ask({next(leaves)}, {ast.unparse(node)})", mode="eval").body
        return node

    def visit_If(self, node):
        self.generic_visit(node)
        node.test = self.decision(node.test)
        return node

    visit_IfExp = visit_If

    def visit_Assign(self, node):
        self.generic_visit(node)
        node.value = self.decision(node.value) if isinstance(node.value, ast.BoolOp) else node.value
        return node


def recorder(function, seen):
    """The function with its decisions written down: each condition's truth and the whole's."""
    truths = {}

    def ask(at, value):
        truths[at] = bool(value)
        return value

    def decide(text, count, test):
        truths.clear()
        outcome = bool(test())
        vector = "".join("-" if at not in truths else "FT"[truths[at]] for at in range(count))
        seen.setdefault(text, set()).add(f"{vector}:{'FT'[outcome]}")
        return outcome

    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    tree.body[0].decorator_list = []
    names = {**vars(guard), "_ask": ask, "_decide": decide}
    exec(compile(ast.fix_missing_locations(Marked().visit(tree)), "marked", "exec"), names)
    return names[function.__name__]
