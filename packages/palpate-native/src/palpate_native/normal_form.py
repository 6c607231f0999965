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

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """`a < b < c` as `a < b and b < c`; `a in (b, c)` as `a == b or a == c`."""
        self.generic_visit(node)
        inside = isinstance(node.ops[0], ast.In | ast.NotIn)
        if inside and isinstance(node.comparators[0], ast.Tuple):
            each = [ast.Compare(node.left, [ast.Eq()], [one]) for one in node.comparators[0].elts]
            value: ast.expr = ast.BoolOp(ast.Or(), each)  # type: ignore[arg-type]
            value = ast.UnaryOp(ast.Not(), value) if isinstance(node.ops[0], ast.NotIn) else value
        elif len(node.ops) > 1:
            triples = zip([node.left, *node.comparators], node.ops, node.comparators, strict=False)
            value = ast.BoolOp(ast.And(), [ast.Compare(a, [op], [b]) for a, op, b in triples])
        else:
            return node
        return _at_place_of(value, node)

    def visit_AugAssign(self, node: ast.AugAssign) -> list[ast.stmt]:
        """`a += b` as `a = a + b`."""
        self.generic_visit(node)
        before = copy.deepcopy(node.target)
        before.ctx = ast.Load()
        return self._assign(node.target, _at_place_of(ast.BinOp(before, node.op, node.value), node), node)

    def visit_Assign(self, node: ast.Assign) -> list[ast.stmt]:
        """`a = b = c` as two assignments, and `a, b = c, d`."""
        self.generic_visit(node)
        if len(node.targets) == 1:
            return self._assign(node.targets[0], node.value, node)
        lines: list[ast.stmt] = []
        value = node.value
        if not isinstance(value, ast.Constant | ast.UnaryOp):
            lines, value = self._temporary(value)
        return [*lines, *(line for one in node.targets for line in self._assign(one, value, node))]

    def _assign(self, target: Any, value: Any, node: ast.stmt) -> list[ast.stmt]:
        """Assigns an expression; of a tuple each element, and none before all are read that another's place is in."""
        if not isinstance(target, ast.Tuple):
            return [_at_place_of(ast.Assign([target], value), node)]
        lines: list[ast.stmt] = []
        if isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
            later = [(one, read) for i, (one, _) in enumerate(pairs) for _, read in pairs[i + 1 :]]
            if any(_may_read(read, one) for one, read in later):
                for i, (one, read) in enumerate(pairs):
                    if not isinstance(read, ast.Constant):
                        new, name = self._temporary(read)
                        lines, pairs[i] = lines + new, (one, name)
        else:
            if not isinstance(value, ast.Name):
                lines, value = self._temporary(value)
            parts = [ast.Subscript(value, ast.Constant(i), ast.Load()) for i in range(len(target.elts))]
            pairs = [
                pair for pair in zip(target.elts, parts, strict=True) if getattr(pair[0], "id", "") != "_"
            ]
        return lines + [
            line for one, part in pairs for line in self._assign(one, _at_place_of(part, node), node)
        ]

    def _temporary(self, value: ast.expr) -> tuple[list[ast.stmt], ast.Name]:
        """The value under a name that the function does not have."""
        self._temporaries += 1
        name = f"value{self._temporaries}_"
        line = ast.Assign([ast.Name(name, ast.Store())], value)
        return [_at_place_of(line, value)], ast.Name(name, ast.Load())


def _at_place_of(node: Any, beside: ast.AST) -> Any:
    """A new node where another stands in the file."""
    return ast.fix_missing_locations(ast.copy_location(node, beside))


def _may_read(node: ast.expr, stored: ast.expr) -> bool:
    """Whether an expression may read what was stored before: a name, or any element of an array."""
    targets = stored.elts if isinstance(stored, ast.Tuple) else [stored]
    names = {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}
    elements = any(isinstance(one, ast.Subscript | ast.Call) for one in ast.walk(node))
    return any(one.id in names if isinstance(one, ast.Name) else elements for one in targets)
