"""Block diagrams read from the program: each step of a control law is a block, each value that it uses an arrow."""

import ast
import inspect
import re
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple

GIVEN = ("task", "sense", "state")
"""Arguments of a control law at each tick: desired values, measured values, and its memory."""
SAMPLE = {"phi", "y"}
"""Arguments of an identifier: the regressor and the force."""
MEMORIES = ("memory", "signals", "deltas")
"""Arrays that a step changes in place: the next step that names them follows it."""
LETTERS = {
    "self.kf": "K_fp",
    "self.ki": "K_fi",
    "task.x": "x_d",
    "task.f": "f_d",
    "task.s": "S",
    "sense.": "",
    "self.": "",
    "model.": "",
    "[0]": "",
}
"""Letters of the thesis for the names of the program."""
EQUATION = re.compile(r"#.*?(\(\d\.\d+\))")


class Block(NamedTuple):
    """One step of a law."""

    name: str  # of the value that the step computes; of a function that only changes a memory; "return"
    law: str  # name of the function that computes the value; empty for a formula
    formula: str  # right-hand side, in the letters of the thesis
    equation: str  # number in the thesis, "(4.19)"; empty if the source names none
    inputs: frozenset[str]  # names of other blocks, and of what the law is given ("sense.x")


class _Reader:
    """Blocks of one function, collected statement by statement."""

    def __init__(self, source: str) -> None:
        self.lines = source.splitlines()
        self.blocks: dict[str, Block] = {}
        self.writers: dict[str, str] = {}  # the block that each local value or memory comes from

    def read(self, statement: ast.stmt) -> None:
        """Add the blocks of a statement."""
        if isinstance(statement, ast.Assign):
            self._assign(statement.targets[0], statement.value)
        elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
            self._call(statement.value)
        elif isinstance(statement, ast.Return) and statement.value is not None:
            value = statement.value
            first = value.elts[0] if isinstance(value, ast.Tuple) else value
            if not isinstance(first, ast.Name):
                self._add("return", first)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Subscript):
            self.writers |= {
                name: self.writers[root]
                for name in _names(target)
                for root in _names(value) & self.writers.keys()
            }
            return
        parts = value.elts if isinstance(value, ast.Tuple) else [value]
        if all(isinstance(part, ast.Name | ast.Attribute) for part in parts):
            return  # only another name
        nested = (
            [n for n in ast.walk(value) if isinstance(n, ast.Call)] if isinstance(value, ast.BinOp) else []
        )
        for call in nested:
            self._call(call)
        name = ast.unparse(target).strip("()")
        self._add(name, value, nested)
        self.writers |= dict.fromkeys(_names(target), name)

    def _call(self, call: ast.Call) -> None:
        name = ast.unparse(call.func)
        self._add(name, call)
        self.writers |= dict.fromkeys(_names(call) & set(MEMORIES), name)

    def _add(self, name: str, value: ast.expr, nested: Sequence[ast.Call] = ()) -> None:
        used = _names(value) - {root for call in nested for root in _names(call)}
        inputs = {self.writers[root] for root in used & self.writers.keys()} | {
            ast.unparse(c.func) for c in nested
        }
        inputs |= {
            ast.unparse(n) for n in ast.walk(value) if isinstance(n, ast.Attribute) and _is_given(n.value)
        }
        inputs |= used & SAMPLE
        law, formula = ast.unparse(value.func) if isinstance(value, ast.Call) else "", ast.unparse(value)
        for word, letter in LETTERS.items():
            formula = formula.replace(word, letter)
        match = EQUATION.search(self.lines[value.lineno - 1])
        earlier = self.blocks[name].inputs if name in self.blocks else frozenset()
        equation = match.group(1) if match else ""
        self.blocks[name] = Block(name, law, formula, equation, earlier | inputs - {name})


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _is_given(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id in GIVEN


def read_blocks(source: str, function: str) -> dict[str, Block]:
    """Blocks of a function, "Neural.step" in the source of its module, by name in the order of its steps."""
    body: list[ast.stmt] = ast.parse(source).body
    for name in function.split("."):
        body = next(n for n in body if isinstance(n, ast.ClassDef | ast.FunctionDef) and n.name == name).body
    reader = _Reader(source)
    for statement in body:
        reader.read(statement)
    return reader.blocks


def blocks_of(module: ModuleType, function: str) -> dict[str, Block]:
    """Blocks of a function of the program; one that names no equation has that of the law that it calls."""
    blocks = read_blocks(inspect.getsource(module), function)
    for name, block in blocks.items():
        called = inspect.getmodule(getattr(module, block.law, None)) if block.law else None
        definition = re.search(rf"def {block.law}\(.*", inspect.getsource(called)) if called else None
        match = EQUATION.search(definition.group()) if definition else None
        if match and not block.equation:
            blocks[name] = block._replace(equation=match.group(1))
    return blocks
