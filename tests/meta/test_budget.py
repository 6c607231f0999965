"""The weight of the house, and its names: what is added pays by what is taken out."""

import ast
import io
import tokenize
from collections import Counter
from typing import NamedTuple

import pytest


class Weight(NamedTuple):
    """Size of a package's Python sources; tokens are names, operators, numbers and texts."""

    files: int
    lines: int
    tokens: int


ROOM = 1.01
"""Of a figure, for what several people add on the same day."""
LARGEST = {
    "src/palpate": Weight(files=249, lines=49439, tokens=340329),
    "packages/palpate-bags/src/palpate_bags": Weight(files=5, lines=1348, tokens=9289),
    "packages/palpate-benchmark/src/palpate_benchmark": Weight(files=13, lines=1926, tokens=12559),
    "packages/palpate-thesis/src/palpate_thesis": Weight(files=56, lines=9498, tokens=78900),
    "packages/palpate-laboratory/src/palpate_laboratory": Weight(files=14, lines=2438, tokens=16170),
    "packages/palpate-native/src/palpate_native": Weight(files=14, lines=2412, tokens=17978),
    "packages/palpate-references/src/palpate_references": Weight(files=6, lines=761, tokens=6179),
    "packages/palpate-certify/src/palpate_certify": Weight(files=6, lines=1427, tokens=12138),
    "packages/palpate-checks/src/palpate_checks": Weight(files=7, lines=757, tokens=5550),
    "packages/palpate-excitation/src/palpate_excitation": Weight(files=10, lines=2138, tokens=13570),
    "packages/palpate-export/src/palpate_export": Weight(files=8, lines=1936, tokens=12408),
    "packages/palpate-live/src/palpate_live": Weight(files=10, lines=2534, tokens=15971),
    "packages/palpate-maps/src/palpate_maps": Weight(files=10, lines=2501, tokens=19538),
    "packages/palpate-rehearsal/src/palpate_rehearsal": Weight(files=9, lines=1305, tokens=9043),
    "packages/palpate-slide/src/palpate_slide": Weight(files=12, lines=2890, tokens=25561),
    "packages/palpate-wires/src/palpate_wires": Weight(files=19, lines=3168, tokens=18712),
    "packages/palpate-studies/src/palpate_studies": Weight(files=28, lines=6284, tokens=42381),
}
"""Largest weights. They may only fall: who makes a package lighter enters the new figure here, and who adds to it takes
out as much."""
PARTICIPLES, SHORT_DOCSTRINGS = 33, 0
"""Most functions whose name is a bare participle, and most docstrings below four words; they may only fall, too."""
UNTESTED = 240
"""Most modules without a test file of their own name, `test_MODULE.py`; others test them by what they do."""
TWICE = frozenset({"Data", "Fit", "Surface", "Table"})
"""Class names that stand for two things. None is added; whoever renames one takes it off."""

NO_PARTICIPLES = {
    "bed",
    "bleed",
    "breed",
    "embed",
    "exceed",
    "feed",
    "need",
    "proceed",
    "red",
    "seed",
    "speed",
}
IRREGULAR = {
    *(
        "begun",
        "bent",
        "born",
        "bound",
        "bred",
        "broken",
        "brought",
        "built",
        "caught",
        "chosen",
        "dealt",
        "done",
    ),
    *(
        "drawn",
        "driven",
        "fallen",
        "felt",
        "forgotten",
        "fought",
        "found",
        "frozen",
        "given",
        "gone",
        "gotten",
    ),
    *(
        "grown",
        "heard",
        "held",
        "hidden",
        "hung",
        "kept",
        "known",
        "laid",
        "learnt",
        "left",
        "lent",
        "lost",
        "made",
    ),
    *(
        "meant",
        "met",
        "paid",
        "proven",
        "ridden",
        "risen",
        "said",
        "seen",
        "sent",
        "shaken",
        "shown",
        "sought",
    ),
    *("spent", "spoken", "stolen", "struck", "stuck", "sunk", "sworn", "swept", "taken", "taught", "thought"),
    *("thrown", "told", "torn", "understood", "woken", "won", "worn", "wound", "woven", "written", "wrung"),
}


def weight(sources):
    """Files, lines and tokens of some sources."""
    kinds = {tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING}
    tokens = (
        token.type in kinds
        for source in sources
        for token in tokenize.generate_tokens(io.StringIO(source.text).readline)
    )
    return Weight(len(sources), sum(source.text.count("\n") for source in sources), sum(tokens))


def is_participle(name):
    """Whether a name is one word, and that a participle: `pressed`, `_told`."""
    word = name.strip("_").lower()
    return word in IRREGULAR or (word.endswith("ed") and word.isalpha() and word not in NO_PARTICIPLES)


def participles(tree):
    """Functions whose name is a bare participle; a predicate, which returns a truth, may be one."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and is_participle(node.name):
            predicate = node.returns is not None and ast.unparse(node.returns) == "bool"
            yield from () if predicate else (node.name,)


def short_docstrings(tree):
    """Docstrings of fewer than four words."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text is not None and len(text.split()) < 4:
                yield f"{getattr(node, 'name', 'module')}: {text}"


def classes(trees):
    """How many classes have each name, over all files."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    return Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))


@pytest.mark.parametrize("package", LARGEST)
def test_no_package_grows(sources, package):
    own = [source for source in sources if source.path.as_posix().startswith(f"{package}/")]
    for name, now, most in zip(Weight._fields, weight(own), LARGEST[package], strict=True):
        assert now <= ROOM * most, (
            f"{package} has {now} {name}, and {most} are the most: merge or delete as much as was added "
            "(LARGEST in tests/meta/test_budget.py)"
        )


def test_no_function_more_is_named_by_a_bare_participle(sources):
    found = [f"{path}: {name}" for path, _, tree in sources for name in participles(tree)]
    assert len(found) <= ROOM * PARTICIPLES, "name it by a verb or by what it returns:\n" + "\n".join(found)


def test_no_docstring_more_needs_its_neighbour(sources):
    found = [f"{path}: {text}" for path, _, tree in sources for text in short_docstrings(tree)]
    assert len(found) <= ROOM * SHORT_DOCSTRINGS, "say what the thing is:\n" + "\n".join(found)


def test_a_class_name_stands_for_one_thing(sources):
    twice = {name for name, count in classes(tree for *_, tree in sources).items() if count > 1}
    assert not twice - {*TWICE}, f"also the name of another class: {sorted(twice - {*TWICE})}"


def test_no_module_more_is_without_a_test_of_its_name(root, sources):
    tests = {
        path.stem for folder in (root / "tests", root / "packages") for path in folder.rglob("test_*.py")
    }
    modules = [path for path, *_ in sources if not path.stem.startswith("__")]
    missing = [path for path in modules if f"test_{path.stem.lstrip('_')}" not in tests]
    assert len(missing) <= ROOM * UNTESTED, "\n".join(map(str, missing))


def test_what_is_counted_is_found():
    tree = ast.parse(
        """
class Cell:
    "A cell."
    def pressed(self) -> float: ...
    def held(self) -> bool: ...
def _told(x):
    "Told of x."
async def drawn(): ...
def speed(): ...
def closed_loop(): "The loop when it is closed."
class Cell: ...
"""
    )
    assert list(participles(tree)) == ["_told", "drawn", "pressed"]
    assert sorted(short_docstrings(tree)) == ["Cell: A cell.", "_told: Told of x."]
    assert classes([tree])["Cell"] == 2
