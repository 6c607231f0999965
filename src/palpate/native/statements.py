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
from palpate.native.expressions import SUM, UNARY, Expressions, Value
from palpate.native.normal_form import normal_form
from palpate.native.source import parse_function, statement_comments
from palpate.native.structs import by_pointer, c_name, is_struct, leaves, members

STEP = "    "


def _names(nodes: Iterable[ast.AST], kind: type = ast.expr_context) -> Counter[str]:
    """Count of each name in some statements; with `kind` Store, of its assignments."""
    inside = (node for statement in nodes for node in ast.walk(statement))
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
        self.tree = normal_form(parse_function(function))
        self.name = ""
        self.kinds = kinds
        self.result = result
        body = self.tree.body
        self._comments = dict(statement_comments(function.__code__.co_filename))
        self._uses = _names(body)
        self._stores = _names(body, ast.Store)
        self._given = [argument.arg for argument in self.tree.args.args]
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
            parameter = c_name(argument)
            of = self.whole.structs.name(kind)
            large = by_pointer(kind)
            parameters.append(f"const {of} *{parameter}" if large else f"{of} {parameter}")
            self.variables[argument] = _behind(parameter, kind) if large else Value(parameter, kind)
            self._blocks[argument] = self.tree.body
            self._first += [f"{of} {parameter}_;"] if large and self._stores[argument] > 1 else []
            self._first += [] if self._uses[argument] else [f"(void){parameter};"]
        returns = [node.value for node in ast.walk(self.tree) if isinstance(node, ast.Return) and node.value]
        if len(returns) == 1:
            once = {name for name, times in _names(returns).items() if times == 1 and name not in self._given}
            places = self._places(returns[0], _behind("to", self.result))
            self._homes = {name: place for name, place in places if name in once}
        lines = self._block(self.tree.body)
        of = f"{self.whole.structs.name(self.result)} "
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
        target = getattr(node.target, "id", "")
        changes = _names(node.body, ast.Store)
        counts = isinstance(call, ast.Call) and self.python_object(call.func) is range and not node.orelse
        self.need(counts and target and target not in {*changes, *self.variables}, node)
        values = [
            self.cast(self.expression(argument), self.whole.integer, argument) for argument in call.args
        ]
        at = int(len(values) > 1)
        down = len(values) == 3
        name = c_name(target)
        self.need(not down or values[2].text == "-1", node)
        self.variables[target] = Value(name, self.whole.integer)
        first = f"int64_t {name} = {values[0].text if at else '0'}"
        end = values[at].at(SUM)
        if re.search(r"[^-\w]", end) or changes[getattr(call.args[at], "id", "")]:
            first = f"{first}, {name}_end = {values[at].text}"
            end = f"{name}_end"
        head = f"for ({first}; {name} {'>' if down else '<'} {end}; {'--' if down else '++'}{name}) {{"
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
        for inner, field in zip(fields, members(place.type) if fields else [], strict=False):
            yield from self._places(inner, place.member(*field))

    def _fill(self, place: Value, value: Value) -> list[str]:
        """Writes a value into a place that it does not read: a large struct field by field, or by the function."""
        if value.call:
            return [f"{value.call}{place.address});"]
        if not (value.fields and by_pointer(value.type)):
            stands = (value.text, place.text) in self._standing
            return [] if stands else [f"{place.text} = {value.text};"]
        pairs = zip(members(value.type), value.fields, strict=True)
        return [line for field, inner in pairs for line in self._fill(place.member(*field), inner)]

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
        of = self.whole.structs.name(value.type)
        variable = c_name(name)
        large = by_pointer(value.type)
        built = value.call or value.fields
        place = Value(f"{variable}_{of}" if known else variable, value.type)
        home = self._homes.pop(name, None)
        self.variables[name], self._blocks[name] = place, self._block_now
        if home:
            place = self.variables[name] = _behind(variable, value.type)
            self._first.append(f"{of} *{variable} = {home.address};")
            self._standing.add((place.text, home.text))
        elif not known and _names(self._block_now)[name] != self._uses[name]:
            self._first.append(f"{of} {variable} = {'{0}' if leaves(value.type) > 1 else '0'};")
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
        variable = known.text.removeprefix("*")
        is_argument = name in self._given and by_pointer(known.type)
        place = Value(f"{variable}_", known.type) if is_argument else known
        reads = re.search(rf"(?<![\w>.]){re.escape(variable)}\b", value.text)
        lines = [f"{place.text} = {value.text};"] if reads else self._fill(place, value)
        return [*lines, f"{variable} = &{place.text};"] if is_argument else lines

    def _stays(self, name: str, node: ast.expr) -> bool:
        """True if neither a variable is assigned again, nor that in which its struct has a place."""
        root = _root(node)
        return self._stores[name] == 1 and isinstance(root, ast.Name) and self._stores[root.id] <= 1

    def _new_array(self, target: Any, node: Any) -> list[str]:
        """An array of a known size, on the stack."""
        from numba import types

        size, name = node.value.args[0], getattr(target, "id", "")
        lengths: Any = [getattr(length, "value", None) for length in getattr(size, "elts", [size])]
        inside = _names(self._block_now)[name] == self._uses[name] > 0
        self.need(inside and all(type(n) is int for n in lengths), node)
        kind = types.Array(types.float64, len(lengths), "C")
        array = c_name(name)
        self.variables[name] = Value(array, kind)
        self.scratch.add(array)
        return [
            f"double {array}_numbers[{math.prod(lengths)}] = {{0}};",
            f"const {self.whole.structs.name(kind)} {array} = {{{array}_numbers, {{{', '.join(map(str, lengths))}}}}};",
        ]


def _behind(name: str, kind: Any) -> Value:
    """The struct behind a pointer."""
    return Value(f"*{name}", kind, UNARY)


def _root(node: Any) -> Any:
    """The variable of which an expression is a field, or an element."""
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return node
