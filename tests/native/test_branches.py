"""Branches of the laws in C that recorded ticks take, and the conditions that decide a tick of the guard."""

import ast
import inspect
import itertools
import re
import shutil
import subprocess
import textwrap

import pytest
from msgspec.structs import replace

from palpate.force import SlidingLoop, guard, load_arm
from palpate.force.gains import gains_for, load_gains
from palpate.force.slide_table import Slide
from palpate.force.sliding.sliding_loop import DOWN
from palpate.native import laws, recording
from palpate.native.module import generate_sources
from palpate.native.replay import program, write_rows

OPERATORS = {
    "floored": "test_the_operators_of_python_are_those_of_c takes each branch",
    "modulo": "test_the_operators_of_python_are_those_of_c takes each branch",
    "root": "the root of minus infinity, which no variance is; likewise",
}
IN_FORCE_LOOP = {
    **OPERATORS,
    "variance > 0.0 ? sqrt(variance) : UNKNOWN": "rounding leaves no variance",
    "estimate->std.x == 0.0 ||": "the estimate is forgotten in free motion, so the second condition decides nothing",
    "stopped": "a tip that a servo moves; the recorded presses are those of a position arm",
    "&& estimate->value.x > 0.0": "likewise: the last condition of a servo's touch",
    "lead": "likewise",
    "state->law.stage.phase == 2.0": "there is no fourth phase",
}
IN_SQUARES = {
    "stretch": "it is asked where a variance is above its first value, so the length of the axis is above zero",
    "Vec3_matmul(v, even) > 1.0": "the three variances begin equal, so the condition before it is the stricter one",
    "propagate_root": "a gain of zero: the regressor is zero, and such a sample is not propagated",
    "!counts": "with a forgetting factor every sample counts; other policies have samples that do not",
    "squares <= 0.0": "residuals of exactly zero, which noise leaves none of",
}
IN_SLIDE = {
    "!(total > 0.0)": "the variance of what is read is positive, by the noise in it",
    "c->resolution == 0.0": "the sensor of this arm has steps below its noise",
    "size > c->force_limit ? LIMITED : SATURATED": "a force between 99 and 100 % of the sensor's scale, the limit",
    "state->numbers[112] == 6.0": "a blocked tip, which the recordings of the force loop have",
    "length > 1e-12 ? Vec3_truediv(a, length) : otherwise": "a vector that has a length, but for rounding",
    "to_rise < -2.0 * height - law->spacing && felt > c->level": "a sensor that drifts between two touches,"
    " which no recording has",
    "state->numbers[112] == 10.0": "likewise: the trouble of that sensor",
    "left < ARRIVED * law->spacing && to_rise < 0.0": "a tip over the next place that is not yet as high as is safe: it"
    " goes aside no further than its height allows",
    "way <= 0.0": "a tip that stands still to the last bit while the slide learns",
    "s.at[TROUBLE] == LOST && guard->trouble == FINE": "a fault in the ticks after a lost contact, which are too few",
    "lead_velocity": "a tip that a servo moves; the recorded slides are those of a position arm",
    "c->lead > 0.0 && s.at[PHASE] != PRESS": "likewise",
    "(s.at[SILENT] > lag || !(missed <= lag)) && s.at[TICKS] > 0.0": "a first tick of all that is late",
    "force.x == last.x": "a first reading of all that is zero to the last bit",
    "!(fast < 1000000000.0)": "a velocity that is no number, which finite readings do not give",
}
"""Branches that no recorded tick takes, by their function or a piece of their line, and why."""


TESTED_ALONE = {*OPERATORS, "exp_", "log_"}
"""Functions of C that have tests of their own."""
LAW = re.compile(r"(palpate/\S+:\d+) \*/\nstatic .*?(\w+)\(")


def slides(limit, **options):
    """A sliding loop as a law in C, with its recording."""
    gains = replace(
        gains_for(load_arm("ur5e"), 15.0, cap=4e4, limit=limit),
        slide=Slide(speed=0.03, mu_max=0.9, **options),
    )
    return laws.sliding_module(gains, DOWN), recording.record_sliding_loop(SlidingLoop(gains, DOWN))


@pytest.mark.long
@pytest.mark.skipif(not (shutil.which("gcc") and shutil.which("gcov")), reason="there is no gcc with gcov")
def test_recorded_slides_take_every_branch_that_there_is_a_way_to(force, tmp_path):
    """Laws of the press are those of the force loop, whose recording takes their branches."""
    cases = [slides(60.0, step=0.002), slides(40.0, touches=0.01)]
    press_roles = {place for place, _ in LAW.findall(force.sources.source)}
    shared = {
        name for place, name in LAW.findall(generate_sources(cases[0][0]).source) if place in press_roles
    }
    taken = all_branches(cases, 300_000, tmp_path)
    taken = {one: here for one, here in taken.items() if one[0] not in shared | TESTED_ALONE}
    assert len(taken) > 220
    check(taken, IN_SLIDE)


def all_branches(cases, ticks, folder):
    """Branches of laws, and whether any of their recordings took each."""
    taken = {}
    for module, recorded in cases:
        text = report(module, recorded.inputs, recorded.presses(ticks, 1), folder)
        for branch, here in branches_of(text):
            taken[branch] = taken.get(branch, False) or here
    return taken


def check(taken, unreachable):
    """Each branch is taken, or stands in a list with the reason why not; and only those stand there."""
    left = {branch[:2] for branch, here in taken.items() if not here}
    strange = [one for one in left if not any(why == one[0] or why in one[1] for why in unreachable)]
    assert not strange, "\n".join(map(str, strange))
    reasons = {why for why in unreachable for place, line in left if why == place or why in line}
    assert reasons == set(unreachable), "a branch that ticks take is not called unreachable"


@pytest.mark.long
@pytest.mark.skipif(not (shutil.which("gcc") and shutil.which("gcov")), reason="there is no gcc with gcov")
@pytest.mark.parametrize(
    ("law", "ticks", "least", "unreachable"),
    [("force", 400_000, 300, IN_FORCE_LOOP), ("squares", 20_000, 35, IN_SQUARES)],
)
def test_recorded_ticks_take_every_branch_that_there_is_a_way_to(
    law, ticks, least, unreachable, request, tmp_path
):
    exported = request.getfixturevalue(law)
    taken = all_branches([(exported.module, exported.recording)], ticks, tmp_path)
    assert len(taken) > least
    check(taken, unreachable)


def report(module, inputs, presses, folder):
    """The report of gcov on the C of a law that repeated some presses, each of its functions called at each tick."""
    own, sources = module.name, generate_sources(module)
    calls = [
        f"{entry.name}(gains, &state{''.join(map(place, entry.arguments))})" for entry in module.entries[1:]
    ]
    also = "".join(
        f"(void){own}_{call}; " for call in [*calls, *(f"{word}(&state)" for word in module.words)]
    )
    for old in folder.glob("*.gc*"):
        old.unlink()
    (folder / f"{own}.c").write_text(sources.source)
    (folder / f"{own}.h").write_text(sources.header)
    (folder / "replay.c").write_text(program(module, inputs).replace("++ticks;", f"++ticks; {also}"))
    write_rows(folder / "press.bin", presses)
    build = f"gcc -std=c99 -O0 -ffp-contract=off --coverage -I. {own}.c replay.c -lm -o replay"
    for words in (build, "./replay", f"gcov -b -c replay-{own}.gcda"):
        subprocess.run(words.split(), cwd=folder, check=True, capture_output=True)
    return (folder / f"{own}.c.gcov").read_text()


def place(argument):
    return f", (double[{argument.count}]){{0}}"


def branches_of(text):
    """Function, line and number there of each branch in a report of gcov, and whether it was taken."""
    function = line = ""
    number = 0
    for row in text.splitlines():
        if row.startswith("function "):
            function = row.split()[1]
        elif source := re.match(r"\s*[#\-\d*=]+:\s*\d+:(.*)", row):
            line, number = source[1].strip(), 0
        elif branch := re.match(r"branch\s+\d+ (never executed|taken (\d+))", row):
            number += 1
            yield (function, line, number), bool(branch[2]) and branch[2] != "0"


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
