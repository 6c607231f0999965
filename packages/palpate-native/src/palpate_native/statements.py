"""Statements of laws as C: each variable declared where it is first assigned, each comment beside its line."""

from __future__ import annotations

import ast
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from palpate._jit.cache import parts
from palpate_native.expressions import SUM, UNARY, Expressions, Value
from palpate_native.normal_form import normal_form
from palpate_native.source import comments_of, syntax_of
from palpate_native.structs import by_pointer, c_name, is_struct, leaves, members

STEP = "    "


def _names(nodes: Iterable[ast.AST], kind: type = ast.expr_context) -> Counter[str]:
    """How often each name stands in some statements; of `kind` Store, how often each is assigned."""
    inside = (node for one in nodes for node in ast.walk(one))
    return Counter(node.id for node in inside if isinstance(node, ast.Name) and isinstance(node.ctx, kind))


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
        self.tree = normal_form(syntax_of(function))
        self.name, self.kinds, self.result, body = "", kinds, result, self.tree.body
        self._comments = dict(comments_of(function.__code__.co_filename))
        self._uses, self._stores = _names(body), _names(body, ast.Store)
        self._given = [one.arg for one in self.tree.args.args]
        self._stores.update(self._given)
        self._blocks: dict[str, list[ast.stmt]] = {}
        self._block_now: list[ast.stmt] = body
        self._first: list[str] = []
        self._homes: dict[str, Value] = {}
        self._standing: set[tuple[str, str]] = set()

    def text(self) -> str:
        """The function in C."""
        parameters = []
        for argument, kind in zip(self._given, self.kinds, strict=True):
            own, of, large = c_name(argument), self.whole.structs.name(kind), by_pointer(kind)
            parameters.append(f"const {of} *{own}" if large else f"{of} {own}")
            self.variables[argument] = _behind(own, kind) if large else Value(own, kind)
            self._blocks[argument] = self.tree.body
            self._first += [f"{of} {own}_;"] if large and self._stores[argument] > 1 else []
            self._first += [] if self._uses[argument] else [f"(void){own};"]
        returns = [one.value for one in ast.walk(self.tree) if isinstance(one, ast.Return) and one.value]
        if len(returns) == 1:
            once = {name for name, times in _names(returns).items() if times == 1 and name not in self._given}
            places = self._places(returns[0], _behind("to", self.result))
            self._homes = {name: place for name, place in places if name in once}
        lines, of = self._block(self.tree.body), f"{self.whole.structs.name(self.result)} "
        if by_pointer(self.result):
            parameters.append(f"{of}*to")
            of = f"const {of}*"
        head = f"static {of}{self.name}({', '.join(parameters) or 'void'}) {{"
        return "\n".join([head, *(STEP + line for line in self._first), *lines, "}"])

    def _block(self, block: list[ast.stmt]) -> list[str]:
        lines = []
        for statement in block:
            self._block_now = block
            new = self.expression(statement)
            if new and statement.lineno in self._comments:
                new[0] += f" /* {self._comments.pop(statement.lineno)} */"
            lines += [STEP + line for line in new]
        return lines

    def _expr(self, node: ast.Expr) -> list[str]:
        comment = isinstance(node.value, ast.Constant)
        return [] if comment else [f"{self.expression(node.value, alone=True).text};"]

    def _break(self, _: ast.Break) -> list[str]:
        return ["break;"]

    def _while(self, node: ast.While) -> list[str]:
        self.need(not node.orelse, node)
        return [f"while ({self.truth(node.test).text}) {{", *self._block(node.body), "}"]

    def _if(self, node: ast.If) -> list[str]:
        lines = [f"if ({self.truth(node.test).text}) {{", *self._block(node.body)]
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            first, *others = (line.removeprefix(STEP) for line in self._block(node.orelse))
            return [*lines, f"}} else {first}", *others]
        return [*lines, *(["} else {", *self._block(node.orelse)] if node.orelse else []), "}"]

    def _for(self, node: ast.For) -> list[str]:
        call: Any = node.iter
        target, changes = getattr(node.target, "id", ""), _names(node.body, ast.Store)
        counts = isinstance(call, ast.Call) and self.python_object(call.func) is range and not node.orelse
        self.need(counts and target and target not in {*changes, *self.variables}, node)
        values = [self.cast(self.expression(one), self.whole.integer, one) for one in call.args]
        at, down, own = int(len(values) > 1), len(values) == 3, c_name(target)
        self.need(not down or values[2].text == "-1", node)
        self.variables[target] = Value(own, self.whole.integer)
        first, end = f"int64_t {own} = {values[0].text if at else '0'}", values[at].at(SUM)
        if re.search(r"[^-\w]", end) or changes[getattr(call.args[at], "id", "")]:
            first, end = f"{first}, {own}_end = {values[at].text}", f"{own}_end"
        head = f"for ({first}; {own} {'>' if down else '<'} {end}; {'--' if down else '++'}{own}) {{"
        inner = self._block(node.body)
        del self.variables[target]
        return [head, *inner, "}"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ["return;"]
        value = self.cast(self.expression(node.value, alone=True), self.result, node)
        if not by_pointer(self.result):
            return [f"return {value.text};"]
        return [*self._fill(_behind("to", self.result), value), "return to;"]

    def _places(self, node: Any, place: Value) -> Iterator[tuple[str, Value]]:
        """Variables that are large fields of the struct that an expression makes, and their places in it."""
        if isinstance(node, ast.Name) and by_pointer(place.type):
            yield node.id, place
        callee = self.function.__globals__.get(getattr(getattr(node, "func", None), "id", ""))
        fields = getattr(node, "args" if callee in parts else "elts", [])
        for one, field in zip(fields, members(place.type) if fields else [], strict=False):
            yield from self._places(one, place.member(*field))

    def _fill(self, place: Value, value: Value) -> list[str]:
        """Writes a value into a place that it does not read: a large struct field by field, or by the function."""
        if value.call:
            return [f"{value.call}{place.address});"]
        if not (value.fields and by_pointer(value.type)):
            stands = (value.text, place.text) in self._standing
            return [] if stands else [f"{place.text} = {value.text};"]
        pairs = zip(members(value.type), value.fields, strict=True)
        return [line for field, one in pairs for line in self._fill(place.member(*field), one)]

    def _assign(self, node: ast.Assign) -> list[str]:
        target: Any = node.targets[0]
        if isinstance(node.value, ast.Call) and self.python_object(node.value.func) in (np.empty, np.zeros):
            return self._new_array(target, node)
        value = self.expression(node.value, alone=True)
        if isinstance(target, ast.Name):
            return self._store(target.id, value, node)
        place = self.expression(target)
        self.need(".at[" in place.text, node)
        self.writes |= self.expression(_root(target)).text not in self.scratch
        return [f"{place.text} = {self.cast(value, self.whole.real, node).text};"]

    def _store(self, name: str, value: Value, node: ast.Assign) -> list[str]:
        known = self.variables.get(name)
        if known and (known.type, value.type) == (self.whole.real, self.whole.integer):
            value = self.cast(value, known.type, node)
        if known and known.type == value.type:
            return self._store_again(name, known, value)
        self.need(not known or self._blocks[name] is self._block_now, node)
        of, own = self.whole.structs.name(value.type), c_name(name)
        large, built = by_pointer(value.type), value.call or value.fields
        place, home = Value(f"{own}_{of}" if known else own, value.type), self._homes.pop(name, None)
        self.variables[name], self._blocks[name] = place, self._block_now
        if home:
            place = self.variables[name] = _behind(own, value.type)
            self._first.append(f"{of} *{own} = {home.address};")
            self._standing.add((place.text, home.text))
        elif not known and _names(self._block_now)[name] != self._uses[name]:
            self._first.append(f"{of} {own} = {'{0}' if leaves(value.type) > 1 else '0'};")
        elif large and built:
            return [f"{of} {place.text};", *self._fill(place, value)]
        elif large and self._stays(name, node.value):
            self.variables[name] = _behind(place.text, value.type)
            return [f"const {of} *{place.text} = {value.address};"]
        else:
            text = value.text.removeprefix(f"({of})") if is_struct(value.type) else value.text
            return [f"{of} {place.text} = {text};"]
        return self._fill(place, value)

    def _store_again(self, name: str, known: Value, value: Value) -> list[str]:
        """Assigns to a variable; an argument by pointer then points to a struct of the function's own."""
        if value.text == known.text:
            return []
        own, given = known.text.removeprefix("*"), name in self._given and by_pointer(known.type)
        place = Value(f"{own}_", known.type) if given else known
        reads = re.search(rf"(?<![\w>.]){re.escape(own)}\b", value.text)
        lines = [f"{place.text} = {value.text};"] if reads else self._fill(place, value)
        return [*lines, f"{own} = &{place.text};"] if given else lines

    def _stays(self, name: str, node: ast.expr) -> bool:
        """Whether a variable is never assigned again, nor that in which its struct has a place."""
        root = _root(node)
        return self._stores[name] == 1 and isinstance(root, ast.Name) and self._stores[root.id] <= 1

    def _new_array(self, target: Any, node: Any) -> list[str]:
        """An array of a known size, on the stack."""
        from numba import types

        size, name = node.value.args[0], getattr(target, "id", "")
        lengths: Any = [getattr(one, "value", None) for one in getattr(size, "elts", [size])]
        inside = _names(self._block_now)[name] == self._uses[name] > 0
        self.need(inside and all(type(n) is int for n in lengths), node)
        kind, own = types.Array(types.float64, len(lengths), "C"), c_name(name)
        self.variables[name] = Value(own, kind)
        self.scratch.add(own)
        return [
            f"double {own}_numbers[{math.prod(lengths)}] = {{0}};",
            f"const {self.whole.structs.name(kind)} {own} = {{{own}_numbers, {{{', '.join(map(str, lengths))}}}}};",
        ]


def _behind(name: str, kind: Any) -> Value:
    """The struct behind a pointer."""
    return Value(f"*{name}", kind, UNARY)


def _root(node: Any) -> Any:
    """The variable of which an expression is a field, or an element."""
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return node
