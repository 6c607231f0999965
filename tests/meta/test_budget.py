"""The weight of everything that is shipped and written, and its words: what is added pays by what is taken out."""

import ast
import io
import subprocess
import tokenize
from collections import Counter
from pathlib import Path

import pytest

COUNTED = {tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING}
ROOM = 1.005
"""Factor by which a figure may exceed its budget, so that two people can add a line on the same day."""
BUDGET = {
    "distributions": 2,
    "files": 414,
    "tokens": 577100,
    "tokens in a line of code": 10.34,
    "lines of tests": 49210,
    "lines of benchmarks": 12778,
    "words in documents": 45000,
    "private imports from another distribution": 0,
    "classes of one name": 4,
    "modules without a test of their name": 190,
    "functions in _of": 89,
    "short docstrings": 0,
}
"""Largest figures of the whole product, in whatever folder. They may only fall: whoever makes it lighter enters
the new figure."""
VAGUE = {"found": 17, "own": 35, "one": 15, "told": 3, "asked": 2, "seen": 13, "held": 29, "kept": 4}
"""Largest number of assignments to local names that say how a value came about, not what it holds."""


def docstring_lines(tree):
    """Lines of docstrings and of texts that stand below an attribute."""
    lines = set()
    for node in ast.walk(tree):
        text = node.value if isinstance(node, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            lines.update(range(text.lineno, text.end_lineno + 1))
    return lines


def weight(sources):
    """Tokens and lines of code of some sources; docstrings and comments are no code."""
    tokens, lines = 0, 0
    for _, text, tree in sources:
        counted = [t for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type in COUNTED]
        used = {line for token in counted for line in range(token.start[0], token.end[0] + 1)}
        tokens += len(counted)
        lines += len(used - docstring_lines(tree))
    return tokens, lines


def line_count(root, folders):
    """Lines of Python in some folders of the checkout."""
    paths = {path for folder in folders for path in root.glob(folder)}
    return sum(path.read_text(encoding="utf-8").count("\n") for path in paths)


def private_imports(sources):
    """Imports of a private name or module of palpate by another distribution."""
    for path, _, tree in sources:
        if path.as_posix().startswith("packages/"):
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("palpate."):
                    names = [*node.module.split("."), *(alias.name for alias in node.names)]
                    yield from (name for name in names if name.startswith("_") and name != "_vector")


def assignments(trees):
    """How often each name is assigned or is an argument."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    return Counter(
        node.id if isinstance(node, ast.Name) else node.arg
        for node in nodes
        if isinstance(node, ast.arg) or (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    )


def short_docstrings(tree):
    """Docstrings of fewer than four words."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text is not None and len(text.split()) < 4:
                yield f"{getattr(node, 'name', 'module')}: {text}"


def classes_named_twice(trees):
    """Class names that stand for more than one class."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    return {name for name, count in names.items() if count > 1}


def modules_without_test(root, sources):
    """Modules without a test file of their own name, `test_MODULE.py`; others test them by what they do."""
    tests = {path.stem for folder in ("tests", "packages") for path in (root / folder).rglob("test_*.py")}
    modules = [path for path, *_ in sources if not path.stem.startswith("__")]
    return [path for path in modules if f"test_{path.stem.lstrip('_')}" not in tests]


def words_in_documents(root):
    """Words of all Markdown files under version control."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=root, capture_output=True, text=True, check=True)
    return sum(len((root / name).read_text(encoding="utf-8").split()) for name in listed.stdout.splitlines())


@pytest.fixture(scope="module")
def figures(root, sources):
    trees = [tree for *_, tree in sources]
    tokens, code = weight(sources)
    functions = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    return {
        "distributions": 1 + len(list(root.glob("packages/*/pyproject.toml"))),
        "files": len(sources),
        "tokens": tokens,
        "tokens in a line of code": tokens / code,
        "lines of tests": line_count(root, ["tests/**/*.py", "packages/*/tests/**/*.py"]),
        "lines of benchmarks": line_count(root, ["benchmarks/**/*.py", "packages/*/benchmarks/**/*.py"]),
        "words in documents": words_in_documents(root),
        "private imports from another distribution": len(list(private_imports(sources))),
        "classes of one name": len(classes_named_twice(trees)),
        "modules without a test of their name": len(modules_without_test(root, sources)),
        "functions in _of": sum(node.name.endswith("_of") for node in functions),
        "short docstrings": sum(len(list(short_docstrings(tree))) for tree in trees),
    }


@pytest.mark.parametrize("name", BUDGET)
def test_the_product_does_not_grow(figures, name):
    assert figures[name] <= ROOM * BUDGET[name], (
        f"{name}: take out as much as was added, or say why more is needed"
    )


@pytest.mark.parametrize("name", BUDGET)
def test_a_lighter_product_lowers_its_budget(figures, name):
    assert figures[name] >= 0.97 * BUDGET[name] - 3, f"{name} is {figures[name]:.6g} now: enter it in BUDGET"


@pytest.mark.parametrize("name", VAGUE)
def test_local_names_say_what_they_hold(sources, name):
    count = assignments(tree for *_, tree in sources)[name]
    assert count <= ROOM * VAGUE[name], f"`{name}` is assigned {count} times; say what the value is"


def test_what_is_counted_is_found():
    text = '"""A module of two cells."""\n\n# a comment\nfound: int = 1\n"""Cells."""\n\n\ndef f(told):\n    "Told."\n'
    tree = ast.parse(text)
    assert weight([("", text, tree)]) == (14, 2)
    assert assignments([tree]) == {"found": 1, "told": 1}
    assert list(short_docstrings(tree)) == ["f: Told."]
    twice = ast.parse("class Cell: ...\nclass Cell: ...\n")
    assert classes_named_twice([twice]) == {"Cell"}
    tree = ast.parse("from palpate._jit import law\nfrom palpate.force import _x, y\n")
    assert list(private_imports([(Path("packages/other/a.py"), "", tree)])) == ["_jit", "_x"]
    assert not list(private_imports([(Path("src/palpate/a.py"), "", tree)]))
