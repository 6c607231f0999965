"""Statements of laws as C: each variable declared where it is first assigned, each comment beside its line."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from palpate.native.expressions import SUM, Expressions, Value
from palpate.native.source import comments_of, syntax_of
from palpate.native.structs import by_pointer, c_name, is_struct, members

Blocks = tuple[int, ...]
"""The blocks that a statement stands in, from the function's own on."""
STEP = "    "


def blocks_of(statement: ast.stmt) -> list[list[ast.stmt]]:
    """The blocks inside a statement."""
    return [block for name in ("body", "orelse") if (block := getattr(statement, name, None))]


def names_of(statement: ast.stmt) -> Iterator[ast.Name]:
    """Names in a statement outside the blocks in it."""
    inside = {id(one) for block in blocks_of(statement) for one in block}
    waiting: list[ast.AST] = [statement]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name):
            yield node
        waiting += [one for one in ast.iter_child_nodes(node) if id(one) not in inside]


class FunctionBody(Expressions):
    """Translates the statements of one function.

    Args:
        whole: the `Translation` that the function is part of.
        function: a law, or a method of a part.
        kinds: Numba's types of its arguments.
        result: and of what it returns.
    """

    def __init__(self, whole: Any, function: Callable[..., Any], kinds: tuple[Any, ...], result: Any):
        super().__init__(whole, function)
        self.kinds, self.result = kinds, result
        tree = syntax_of(function)
        assert isinstance(tree, ast.FunctionDef)
        self.tree = tree
        self._comments = comments_of(function.__code__.co_filename)
        self._homes: dict[str, Blocks] = {}
        self._declared: dict[str, Blocks] = {}
        self._waiting: dict[Blocks, list[str]] = defaultdict(list)
        self._new = 0
        self._find_homes(tree.body, (0,), {})

    def text(self, name: str) -> str:
        """The function in C."""
        first, parameters = [], []
        stored = {
            n.id for n in ast.walk(self.tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }
        for argument, kind in zip(self.tree.args.args, self.kinds, strict=True):
            own, of = c_name(argument.arg), self.whole.structs.name(kind)
            self._declared[argument.arg] = self._homes[argument.arg] = (0,)
            if by_pointer(kind) and argument.arg in stored:
                parameters.append(f"const {of} *{own}_given")
                first.append(f"{STEP}{of} {own} = *{own}_given;")
                self.variables[argument.arg] = Value(own, kind, place="named")
            elif by_pointer(kind):
                parameters.append(f"const {of} *{own}")
                self.variables[argument.arg] = Value(own, kind, place="pointer")
            else:
                parameters.append(f"{of} {own}")
                self.variables[argument.arg] = Value(own, kind, place="named")
        lines = self._block(self.tree.body, (0,), 1)
        unused = [
            f"{STEP}(void){c_name(a.arg)};"
            for a in self.tree.args.args
            if not any(isinstance(n, ast.Name) and n.id == a.arg for n in ast.walk(self.tree))
        ]
        of = self.whole.structs.name(self.result)
        head = f"static {of} {name}({', '.join(parameters) or 'void'}) {{"
        return "\n".join([head, *unused, *first, *lines, "}"])

    def _find_homes(self, block: list[ast.stmt], path: Blocks, loops: dict[str, int]) -> None:
        """Notes for each variable the innermost block that holds all its places; a loop's own are in the loop."""
        for statement in block:
            inner = dict(loops)
            if isinstance(statement, ast.For) and isinstance(statement.target, ast.Name):
                inner[statement.target.id] = id(statement.body)
            for name in names_of(statement):
                if name.id in loops or (isinstance(statement, ast.For) and name is statement.target):
                    continue
                old = self._homes.get(name.id, path)
                same = [a for a, b in zip(old, path, strict=False) if a == b]
                self._homes[name.id] = tuple(same)
            for one in blocks_of(statement):
                self._find_homes(one, (*path, id(one)), inner)

    def _block(self, block: list[ast.stmt], path: Blocks, depth: int) -> list[str]:
        lines: list[str] = []
        for statement in block:
            new = self._statement(statement, path, depth)
            lines += [STEP * depth + line for line in self._waiting.pop(path, [])]
            comment = self._comments.get(statement.lineno)
            if comment and new:
                new[0] += f" /* {comment} */"
            lines += new
        return lines

    def _statement(self, node: ast.stmt, path: Blocks, depth: int) -> list[str]:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return []
        if isinstance(node, ast.If):
            return self._if(node, path, depth)
        if isinstance(node, ast.While) and not node.orelse:
            head = f"while ({self.truth(node.test).text}) {{"
            return [
                STEP * depth + head,
                *self._block(node.body, (*path, id(node.body)), depth + 1),
                STEP * depth + "}",
            ]
        if isinstance(node, ast.For) and not node.orelse:
            return self._for(node, path, depth)
        return [STEP * depth + line for line in self._simple(node, path)]

    def _simple(self, node: ast.stmt, path: Blocks) -> list[str]:
        if isinstance(node, ast.Return):
            return self._return(node)
        if isinstance(node, ast.Expr):
            return [f"{self.statement_value(node.value).text};"]
        if isinstance(node, ast.Assign):
            return self._assign(node, path)
        if isinstance(node, ast.AugAssign):
            return self._augment(node, path)
        if isinstance(node, ast.Break | ast.Continue | ast.Pass):
            return [] if isinstance(node, ast.Pass) else [f"{type(node).__name__.lower()};"]
        kind = type(node).__name__.lower()
        return self.refuse(node, kind, "use assignments, if, while, for over range, and return")

    def _if(self, node: ast.If, path: Blocks, depth: int) -> list[str]:
        lines = [f"{STEP * depth}if ({self.truth(node.test).text}) {{"]
        lines += self._block(node.body, (*path, id(node.body)), depth + 1)
        if node.orelse:
            inner = (*path, id(node.orelse))
            follows = node.orelse[0]
            if (
                len(node.orelse) == 1
                and isinstance(follows, ast.If)
                and not isinstance(follows.test, ast.Constant)
            ):
                chain = self._if(follows, inner, depth)
                lines += [STEP * (depth + 1) + line for line in self._waiting.pop(inner, [])]
                comment = self._comments.get(follows.lineno)
                chain[0] += f" /* {comment} */" if comment else ""
                return [*lines, f"{STEP * depth}}} else {chain[0].lstrip()}", *chain[1:]]
            lines += [f"{STEP * depth}}} else {{", *self._block(node.orelse, inner, depth + 1)]
        return [*lines, STEP * depth + "}"]

    def _for(self, node: ast.For, path: Blocks, depth: int) -> list[str]:
        call, target = node.iter, node.target
        if not (
            isinstance(call, ast.Call)
            and self.python_object(call.func) is range
            and isinstance(target, ast.Name)
        ):
            self.refuse(node, "this loop", "count with range")
        values = [self.cast(self.expression(one), self.whole.integer, one) for one in call.args]
        down = len(values) == 3
        if down and values[2].text != "-1":
            self.refuse(node, f"a step of {values[2].text}", "count by 1 or by -1")
        start = values[0].text if len(values) > 1 else "0"
        place = min(len(values), 2) - 1
        stop, name = values[place], call.args[place]
        own, before = c_name(target.id), self.variables.get(target.id)
        self.variables[target.id] = Value(own, self.whole.integer, place="named")
        first, end = f"int64_t {own} = {start}", stop.at(SUM)
        changes = _stored_names(node.body)
        if target.id in changes:
            self.refuse(node, f"assigning to the loop's own {target.id}", "use another name")
        if not isinstance(name, ast.Constant | ast.Name | ast.UnaryOp) or (
            isinstance(name, ast.Name) and name.id in changes
        ):
            first, end = f"{first}, {own}_end = {stop.text}", f"{own}_end"
        head = f"for ({first}; {own} {'>' if down else '<'} {end}; {'--' if down else '++'}{own}) {{"
        inner = self._block(node.body, (*path, id(node.body)), depth + 1)
        self.variables.pop(target.id)
        if before is not None:
            self.variables[target.id] = before
        return [STEP * depth + head, *inner, STEP * depth + "}"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ["return;"]
        if isinstance(node.value, ast.Tuple) and is_struct(self.result):
            values = [self.statement_value(one) for one in node.value.elts]
            return [f"return {self.struct(values, self.result, node).text};"]
        value = self.cast(self.statement_value(node.value), self.result, node)
        return [f"return {value.at(0)};"]

    def _augment(self, node: ast.AugAssign, path: Blocks) -> list[str]:
        target = self.expression(node.target)
        value = self.statement_value(node.value)
        whole = self.binary(node.op, target, value, node)
        if is_struct(target.type) or isinstance(node.target, ast.Name):
            return self._store(node.target, whole, path)
        self._write(node.target)
        return [f"{target.text} = {whole.at(0)};"]

    def _assign(self, node: ast.Assign, path: Blocks) -> list[str]:
        scratch = self._scratch(node, path)
        if scratch:
            return scratch
        first, *others = node.targets
        if not others:
            return self._store_value(first, node.value, path)
        if isinstance(node.value, ast.Constant | ast.UnaryOp):
            return [
                line
                for target in node.targets
                for line in self._store(target, self.expression(node.value), path)
            ]
        value = self.statement_value(node.value)
        lines = []
        if isinstance(first, ast.Name):
            lines = self._store(first, value, path)
            value = self.variables[first.id]
        else:
            lines, value = self._temporary(value)
            others = node.targets
        return lines + [line for target in others for line in self._store(target, value, path)]

    def _temporary(self, value: Value) -> tuple[list[str], Value]:
        """A constant of the value, under a name that Python does not have."""
        self._new += 1
        name = f"value{self._new}_"
        of = self.whole.structs.name(value.type)
        return [f"const {of} {name} = {value.at(0)};"], Value(name, value.type, place="named")

    def _store_value(self, target: ast.expr, node: ast.expr, path: Blocks) -> list[str]:
        """Assigns an expression; of a tuple each element, and none before all are read that another's place is in."""
        if not (isinstance(target, ast.Tuple) and isinstance(node, ast.Tuple)):
            return self._store(target, self.statement_value(node), path)
        pairs = list(zip(target.elts, node.elts, strict=True))
        waits = any(
            _may_read(later, stored) for i, (stored, _) in enumerate(pairs) for _, later in pairs[i + 1 :]
        )
        lines, values = [], []
        for stored, one in pairs:
            if not waits:
                lines += self._store_value(stored, one, path)
            elif isinstance(one, ast.Constant):
                values.append(self.expression(one))
            else:
                more, value = self._temporary(self.statement_value(one))
                lines += more
                values.append(value)
        for (stored, _), value in zip(pairs, values, strict=False):
            lines += self._store(stored, value, path)
        return lines

    def _store(self, target: ast.expr, value: Value, path: Blocks) -> list[str]:
        if isinstance(target, ast.Name):
            return self._store_name(target, value, path)
        if isinstance(target, ast.Tuple):
            return self._unpack(target, value, path)
        if not isinstance(target, ast.Subscript) or isinstance(target.slice, ast.Slice):
            self.refuse(
                target, f"assigning to {ast.unparse(target)}", "assign to a name or to an element of an array"
            )
        place = self.expression(target)
        if ".at[" not in place.text:
            self.refuse(target, "assigning to a part's field", "make a new part")
        self._write(target.value)
        return [f"{place.text} = {self.cast(value, self.whole.real, target).at(0)};"]

    def _write(self, target: ast.expr) -> None:
        """Notes a store to an array, unless the array is this function's own."""
        root = target
        while isinstance(root, ast.Subscript | ast.Attribute):
            root = root.value
        own = (
            isinstance(root, ast.Name)
            and root.id in self.variables
            and self.variables[root.id].text in self.scratch
        )
        self.writes = self.writes or not own

    def _unpack(self, target: ast.Tuple, value: Value, path: Blocks) -> list[str]:
        if not is_struct(value.type) or len(members(value.type)) != len(target.elts):
            self.refuse(target, f"unpacking {value.type}", "give as many names as it has fields")
        lines: list[str] = []
        if not value.place:
            lines, value = self._temporary(value)
        for one, field in zip(target.elts, members(value.type), strict=True):
            if not (isinstance(one, ast.Name) and one.id == "_"):
                lines += self._store(one, value.member(*field), path)
        return lines

    def _store_name(self, target: ast.Name, value: Value, path: Blocks) -> list[str]:
        known = self.variables.get(target.id)
        if known is not None and known.type != value.type:
            if known.type == self.whole.real and value.type == self.whole.integer:
                value = self.cast(value, known.type, target)
            elif self._homes[target.id] != path:
                self.refuse(
                    target,
                    f"{target.id} as {value.type} and as {known.type}",
                    "give it one type, as 0.0 for 0",
                )
            else:
                known = None
        if known is not None:
            return [] if known.text == value.text else [f"{known.at(0)} = {value.at(0)};"]
        name, of = c_name(target.id), self.whole.structs.name(value.type)
        if target.id in self.variables:
            name = f"{name}_{of}"
        self.variables[target.id] = Value(name, value.type, place="named")
        home = self._homes.get(target.id, path)
        if home == path:
            text = value.at(0).removeprefix(f"({of})") if is_struct(value.type) else value.at(0)
            return [f"{of} {name} = {text};"]
        empty = "{0}" if is_struct(value.type) or hasattr(value.type, "ndim") else "0"
        self._waiting[home].append(f"{of} {name} = {empty};")
        return [f"{name} = {value.at(0)};"]

    def _scratch(self, node: ast.Assign, path: Blocks) -> list[str]:
        """Arrays of a known size, on the stack; empty where the assignment makes none."""
        pairs = [(node.targets[0], node.value)]
        if isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = list(zip(node.targets[0].elts, node.value.elts, strict=True))
        lines = []
        for target, call in pairs:
            makes = isinstance(call, ast.Call) and self.python_object(call.func) in (np.empty, np.zeros)
            if not makes or not isinstance(target, ast.Name) or not isinstance(call, ast.Call):
                return []
            lines += self._new_array(target, call, path)
        return lines

    def _new_array(self, target: ast.Name, call: ast.Call, path: Blocks) -> list[str]:
        shape = call.args[0]
        written = shape.elts if isinstance(shape, ast.Tuple) else [shape]
        lengths = [
            int(one.value) for one in written if isinstance(one, ast.Constant) and type(one.value) is int
        ]
        if len(lengths) < len(written) or self._homes[target.id] != path:
            self.refuse(
                call, f"an array of {ast.unparse(shape)}", "write its size as numbers, where all its uses are"
            )
        from numba import types

        kind = types.Array(types.float64, len(lengths), "C")
        name, of = c_name(target.id), self.whole.structs.name(kind)
        self.variables[target.id] = Value(name, kind, place="named")
        self.scratch.add(name)
        count = int(np.prod(lengths))
        return [
            f"double {name}_numbers[{count}] = {{0}};",
            f"const {of} {name} = {{{name}_numbers, {{{', '.join(map(str, lengths))}}}}};",
        ]


def _stored_names(block: list[ast.stmt]) -> set[str]:
    """Names that are assigned in a block."""
    nodes = (node for statement in block for node in ast.walk(statement))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


def _may_read(node: ast.expr, stored: ast.expr) -> bool:
    """Whether an expression may read what was stored before: a name, or any element of an array."""
    parts = list(ast.walk(node))
    for target in stored.elts if isinstance(stored, ast.Tuple) else [stored]:
        if isinstance(target, ast.Name) and any(isinstance(n, ast.Name) and n.id == target.id for n in parts):
            return True
        if isinstance(target, ast.Subscript) and any(isinstance(n, ast.Subscript | ast.Call) for n in parts):
            return True
    return False
