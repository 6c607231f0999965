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
from pathlib import Path
from typing import Any, NoReturn

import palpate
from palpate.errors import InputError

_DIRECTIVE = re.compile(r"#\s*(fmt|noqa|type|ruff|mypy)\b")
_ARGUMENT = re.compile(r"^ {4}(\w+(?:, \w+)*): (.*)")


class OutsideSubset(InputError):
    """A law has something that the subset of Python which becomes C does not have; the text names file and line."""


def refuse(function: Callable[..., Any], node: ast.AST, fault: str, remedy: str) -> NoReturn:
    """Raises the refusal of a node of a function.

    Raises:
        OutsideSubset: always.
    """
    code = function.__code__
    line = getattr(node, "lineno", code.co_firstlineno)
    raise OutsideSubset(
        f"{_short(code.co_filename)}:{line}: {function.__name__}: {fault} has no C here; {remedy}"
    )


def place_of(function: Callable[..., Any]) -> str:
    """File and line of a function, from the package's folder on."""
    return f"{_short(function.__code__.co_filename)}:{function.__code__.co_firstlineno}"


def _short(file: str) -> str:
    path = Path(file)
    roots = (Path(str(one.__file__)).resolve().parents[1] for one in (palpate, sys.modules[__package__]))
    return next((path.relative_to(root).as_posix() for root in roots if root in path.parents), file)


def syntax_of(function: Callable[..., Any]) -> ast.FunctionDef | ast.Lambda:
    """The syntax tree of a function or a lambda, from its file.

    Raises:
        OutsideSubset: it has no file.
    """
    code = function.__code__
    names = list(code.co_varnames[: code.co_argcount])
    for node in ast.walk(_tree(code.co_filename)):
        if (
            isinstance(node, ast.FunctionDef | ast.Lambda)
            and min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", ()))])
            == code.co_firstlineno
            and [argument.arg for argument in node.args.args] == names
        ):
            return node
    raise OutsideSubset(f"{code.co_filename}: no source of {function.__name__}; keep the law in a file")


@functools.cache
def _tree(file: str) -> ast.Module:
    try:
        return ast.parse(Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise OutsideSubset(f"{file} cannot be read; keep the law in a file") from error


@functools.cache
def comments_of(file: str) -> dict[int, str]:
    """Comments of a file by their line, without those that are meant for tools."""
    text = Path(file).read_text(encoding="utf-8")
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {
        token.start[0]: token.string.lstrip("# ")
        for token in tokens
        if token.type == tokenize.COMMENT and not _DIRECTIVE.match(token.string)
    }


@functools.cache
def constant_notes(file: str) -> dict[str, str]:
    """First sentence below each constant of a module, by the constant's name; one below several counts for none."""
    notes = {}
    for before, node in zip(_tree(file).body, _tree(file).body[1:], strict=False):
        if (
            isinstance(before, ast.Assign)
            and isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
        ):
            target = before.targets[0]
            if isinstance(target, ast.Name):
                notes[target.id] = first_sentence(str(node.value.value))
    return notes


def first_sentence(text: str) -> str:
    """The first paragraph of a docstring in one line, safe inside a C comment."""
    return " ".join(text.strip().split("\n\n")[0].split()).replace("*/", "* /").replace("/*", "/ *")


def field_notes(cls: type) -> dict[str, str]:
    """Meaning and unit of each field, as a part's class has them: in `Args:` or in the comment beside it."""
    notes: dict[str, str] = {}
    names: list[str] = []
    for line in (inspect.getdoc(cls) or "").split("\n"):
        begins = _ARGUMENT.match(line)
        if begins:
            names = begins[1].split(", ")
            notes.update(dict.fromkeys(names, begins[2]))
        elif line.startswith(" " * 8):
            notes.update({name: f"{notes[name]} {line.strip()}" for name in names})
        else:
            names = []
    try:
        file = inspect.getsourcefile(cls)
        lines, start = inspect.getsourcelines(cls)
    except (OSError, TypeError):
        return notes
    for number, line in enumerate(lines, start):
        field = re.match(r"    (\w+): ", line)
        comment = comments_of(str(file)).get(number)
        if field and comment:
            notes[field[1]] = comment
    return {name: first_sentence(note) for name, note in notes.items()}
