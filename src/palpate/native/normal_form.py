"""Normal form of laws: each assignment has one name or one element, each comparison two sides."""

from __future__ import annotations

import ast
import copy
from typing import Any


def normal_form(tree: Any) -> Any:
    """A function that does the same in fewer kinds of statements; the tree itself stays as it is."""
    return _Rewriting().visit(copy.deepcopy(tree))


class _Rewriting(ast.NodeTransformer):
    """Rewrites assignments to several targets, assignments with an operator, chains of comparisons, and `in`."""

    def __init__(self) -> None:
        self._temporaries = 0

    def visit(self, node: ast.AST) -> Any:
        """Rewrites a node after those inside it; the new nodes stand at its place in the file."""
        new = getattr(self, f"_{type(node).__name__.lower()}", lambda rewritten: rewritten)(
            self.generic_visit(node)
        )
        for rewritten in new if isinstance(new, list) else [new]:
            ast.fix_missing_locations(ast.copy_location(rewritten, node))
        return new

    def _compare(self, node: ast.Compare) -> ast.expr:
        """`a < b < c` as `a < b and b < c`; `a in (b, c)` as `a == b or a == c`."""
        inside = isinstance(node.ops[0], ast.In | ast.NotIn)
        if inside and isinstance(node.comparators[0], ast.Tuple):
            value = ast.BoolOp(
                ast.Or(),
                [ast.Compare(node.left, [ast.Eq()], [element]) for element in node.comparators[0].elts],
            )
            return ast.UnaryOp(ast.Not(), value) if isinstance(node.ops[0], ast.NotIn) else value
        triples = zip([node.left, *node.comparators], node.ops, node.comparators, strict=False)
        pairs: list[ast.expr] = [ast.Compare(a, [op], [b]) for a, op, b in triples]
        return ast.BoolOp(ast.And(), pairs) if len(pairs) > 1 else node

    def _augassign(self, node: ast.AugAssign) -> list[ast.stmt]:
        """`a += b` as `a = a + b`."""
        before = copy.copy(node.target)
        before.ctx = ast.Load()
        return [ast.Assign([node.target], ast.BinOp(before, node.op, node.value))]

    def _assign(self, node: ast.Assign) -> list[ast.stmt]:
        """`a = b = c` as two assignments, and `a, b = c, d`."""
        lines: list[ast.stmt] = []
        alone = len(node.targets) == 1 or isinstance(node.value, ast.Constant | ast.UnaryOp)
        value = node.value if alone else self._temporary(node.value, lines)
        return [*lines, *(line for target in node.targets for line in self._split(target, value))]

    def _split(self, target: Any, value: Any) -> list[ast.stmt]:
        """Assigns an expression; of a tuple each element, and none before all are read that another's place is in."""
        if not isinstance(target, ast.Tuple):
            return [ast.Assign([target], value)]
        lines: list[ast.stmt] = []
        if isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
            if any(
                _may_read(read, element) for i, (element, _) in enumerate(pairs) for _, read in pairs[i + 1 :]
            ):
                pairs = [
                    (element, read if isinstance(read, ast.Constant) else self._temporary(read, lines))
                    for element, read in pairs
                ]
        else:
            source = value if isinstance(value, ast.Name) else self._temporary(value, lines)
            parts = ((element, ast.Constant(i)) for i, element in enumerate(target.elts))
            pairs = [
                (element, ast.Subscript(source, i, ast.Load()))
                for element, i in parts
                if getattr(element, "id", "") != "_"
            ]
        return lines + [line for element, part in pairs for line in self._split(element, part)]

    def _temporary(self, value: ast.expr, lines: list[ast.stmt]) -> ast.Name:
        """Stores a value in a variable that the function does not have, in one more line."""
        self._temporaries += 1
        name = f"value{self._temporaries}_"
        lines.append(ast.Assign([ast.Name(name, ast.Store())], value))
        return ast.Name(name, ast.Load())


def _may_read(node: ast.expr, stored: ast.expr) -> bool:
    """True if an expression may read what was stored before: a name, or any element of an array."""
    reads = list(ast.walk(node))
    stores = list(ast.walk(stored))
    names = {part.id for part in stores if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)}
    elements = any(isinstance(part, ast.Subscript) for part in stores)
    return any(
        part.id in names
        if isinstance(part, ast.Name)
        else elements and isinstance(part, ast.Subscript | ast.Call)
        for part in reads
    )
