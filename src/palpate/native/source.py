"""Sources of laws: the syntax tree of a function, the comments beside its lines, and refusals that name the line."""

from __future__ import annotations

import ast
import functools
import inspect
import io
import re
import sys
import tokenize
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

from palpate.errors import InputError

_DIRECTIVE = re.compile(r"#\s*(fmt|noqa|type|ruff|mypy)\b")
_ARGUMENT = re.compile(r"^ {4}(\w+(?:, \w+)*): (.*(?:\n {8}.*)*)", re.MULTILINE)


class OutsideSubset(InputError):
    """A law has something that the subset of Python which becomes C does not have; the text names file and line."""


def refuse(function: Callable[..., Any], node: Any, fault: str, remedy: str) -> NoReturn:
    """Raises the refusal of a node of a function.

    Raises:
        OutsideSubset: always.
    """
    place = locate_line(function, node.lineno)
    raise OutsideSubset(f"{place}: {function.__name__}: {fault} has no C here; {remedy}")


def locate_line(function: Callable[..., Any], line: int) -> str:
    """File and line of a function's code, from the folder of its package on."""
    file = function.__code__.co_filename
    packages = function.__module__.count(".")
    return f"{'/'.join(Path(file).parts[-1 - packages :]) if packages else file}:{line}"


def parse_function(function: Callable[..., Any]) -> ast.FunctionDef | ast.Lambda:
    """The syntax tree of a function or a lambda, from its file.

    Raises:
        OutsideSubset: it has no file, or another begins in its line.
    """
    code = function.__code__
    nodes = []
    for node in ast.walk(_tree(code.co_filename)):
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            first = min([node, *getattr(node, "decorator_list", ())], key=lambda start: start.lineno)
            nodes += [node] if first.lineno == code.co_firstlineno else []
    if len(nodes) != 1:
        place = locate_line(function, code.co_firstlineno)
        raise OutsideSubset(
            f"{place}: no source of {function.__name__} alone; keep the law in a file, in lines of its own"
        )
    return nodes[0]


@functools.cache
def _tree(file: str) -> ast.Module:
    return ast.parse(Path(file).read_text(encoding="utf-8"))


@functools.cache
def statement_comments(file: str) -> dict[int, str]:
    """Comments of a file by their line, without those that are meant for tools."""
    tokens = tokenize.generate_tokens(io.StringIO(Path(file).read_text(encoding="utf-8")).readline)
    comments = ((token.start[0], token.string) for token in tokens if token.type == tokenize.COMMENT)
    return {line: text.lstrip("# ") for line, text in comments if not _DIRECTIVE.match(text)}


@functools.cache
def constant_notes(file: str) -> dict[str, str]:
    """First sentence below each constant of a module, by the constant's name; one below several counts for none."""
    return {
        before.targets[0].id: first_sentence(str(node.value.value))
        for before, node in pairwise(_tree(file).body)
        if isinstance(before, ast.Assign)
        and isinstance(before.targets[0], ast.Name)
        and isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
    }


def constant_home(name: str, value: Any, function: Callable[..., Any]) -> tuple[str, str]:
    """The module of ours that says what a constant is, and the sentence; or the function's."""
    for module in [
        module_ for module_ in list(sys.modules.values()) if module_.__name__.startswith("palpate")
    ]:
        note = constant_notes(str(module.__file__)).get(name) if vars(module).get(name) is value else None
        if note:
            return module.__name__, note
    return function.__module__, ""


def comment_text(text: str) -> str:
    """A text as a C comment can have it."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def first_sentence(text: str) -> str:
    """The first paragraph of a docstring in one line of a C comment."""
    return comment_text(" ".join(text.strip().split("\n\n")[0].split()))


def field_notes(cls: type) -> dict[str, str]:
    """Meaning and unit of each field, as a part's class has them: in `Args:` or in the comment beside it."""
    notes = {
        name: first_sentence(note)
        for names, note in _ARGUMENT.findall(inspect.getdoc(cls) or "")
        for name in names.split(", ")
    }
    comments = statement_comments(str(inspect.getsourcefile(cls)))
    lines, start = inspect.getsourcelines(cls)
    for number, line in enumerate(lines, start):
        if number in comments and (field := re.match(r"    (\w+): ", line)):
            notes[field[1]] = first_sentence(comments[number])
    return notes
