"""Statements of laws as C: each variable declared where it is first assigned, each comment beside its line."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from palpate_native.expressions import SUM, Expressions, Value
from palpate_native.normal_form import normal_form
from palpate_native.source import comments_of, syntax_of
from palpate_native.structs import by_pointer, c_name, is_struct, members

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
        self.kinds, self.result, body = kinds, result, self.tree.body
        self._comments = dict(comments_of(function.__code__.co_filename))
        self._uses, self._stores = _names(body), _names(body, ast.Store)
        self._stores.update(one.arg for one in self.tree.args.args)
        self._blocks: dict[str, list[ast.stmt]] = {}
        self._block_now: list[ast.stmt] = body
        self._first: list[str] = []

    def text(self, name: str) -> str:
        """The function in C."""
        parameters = []
        for argument, kind in zip((one.arg for one in self.tree.args.args), self.kinds, strict=True):
            own, of = c_name(argument), self.whole.structs.name(kind)
            place, given = ("pointer", f"const {of} *{own}") if by_pointer(kind) else ("named", f"{of} {own}")
            if by_pointer(kind) and self._stores[argument] > 1:
                self._first.append(f"{of} {own}_;")
            if not self._uses[argument]:
                self._first.append(f"(void){own};")
            parameters.append(given)
            self.variables[argument], self._blocks[argument] = Value(own, kind, place=place), self.tree.body
        lines, of = self._block(self.tree.body), f"{self.whole.structs.name(self.result)} "
        if by_pointer(self.result):
            parameters.append(f"{of}*to")
            of = f"const {of}*"
        head = f"static {of}{name}({', '.join(parameters) or 'void'}) {{"
        return "\n".join([head, *(STEP + line for line in self._first), *lines, "}"])

    def _block(self, block: list[ast.stmt]) -> list[str]:
        lines, before = [], self._block_now
        for statement in block:
            self._block_now = block
            new = self._statement(statement)
            if new and statement.lineno in self._comments:
                new[0] += f" /* {self._comments.pop(statement.lineno)} */"
            lines += [STEP + line for line in new]
        self._block_now = before
        return lines

    def _statement(self, node: Any) -> list[str]:
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        remedy = "use assignments, if, while, for over range, and return"
        self.need(method, node, type(node).__name__.lower(), remedy)
        return method(node)  # type: ignore[misc,no-any-return]

    def _expr(self, node: ast.Expr) -> list[str]:
        comment = isinstance(node.value, ast.Constant)
        return [] if comment else [f"{self.expression(node.value, alone=True).text};"]

    def _pass(self, node: ast.Pass) -> list[str]:
        return []

    def _break(self, node: ast.Break | ast.Continue) -> list[str]:
        return [f"{type(node).__name__.lower()};"]

    _continue = _break

    def _while(self, node: ast.While) -> list[str]:
        self.need(not node.orelse, node, "else of a loop", "use a truth")
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
        counts = isinstance(call, ast.Call) and self.python_object(call.func) is range and target
        self.need(counts and not node.orelse, node, "this loop", "count with range")
        values = [self.cast(self.expression(one), self.whole.integer, one) for one in call.args]
        down, at = len(values) == 3, min(len(values), 2) - 1
        self.need(not down or values[2].text == "-1", node, "a step of a loop", "count by 1 or by -1")
        own, before, changes = c_name(target), self.variables.get(target), _names(node.body, ast.Store)
        self.need(target not in changes, node, f"assigning to the loop's own {target}", "use another name")
        self.variables[target] = Value(own, self.whole.integer, place="named")
        first, end = f"int64_t {own} = {values[0].text if at else '0'}", values[at].at(SUM)
        if re.search(r"[^-\w]", end) or changes[getattr(call.args[at], "id", "")]:
            first, end = f"{first}, {own}_end = {values[at].text}", f"{own}_end"
        head = f"for ({first}; {own} {'>' if down else '<'} {end}; {'--' if down else '++'}{own}) {{"
        inner = self._block(node.body)
        del self.variables[target]
        self.variables |= {target: before} if before else {}
        return [head, *inner, "}"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ["return;"]
        if isinstance(node.value, ast.Tuple):
            each = [self.expression(one, alone=True) for one in node.value.elts]
            value = self.struct(each, self.result, node)
        else:
            value = self.cast(self.expression(node.value, alone=True), self.result, node)
        if not by_pointer(self.result):
            return [f"return {value.at(0)};"]
        if value.call:
            return [f"return {value.call}to);"]
        return [*self._fill(Value("to", self.result, place="pointer"), value), "return to;"]

    def _fill(self, place: Value, value: Value) -> list[str]:
        """Writes a value into a place that it does not read: a large struct field by field, or by the function."""
        if value.call:
            return [f"{value.call}{place.address});"]
        if value.text == place.text:
            return []
        if not (value.fields and by_pointer(value.type)):
            return [f"{place.at(0)} = {value.at(0)};"]
        pairs = zip(members(value.type), value.fields, strict=True)
        return [line for field, one in pairs for line in self._fill(place.member(*field), one)]

    def _assign(self, node: ast.Assign) -> list[str]:
        target: Any = node.targets[0]
        if isinstance(node.value, ast.Call) and self.python_object(node.value.func) in (np.empty, np.zeros):
            return self._new_array(target, node.value)
        value = self.expression(node.value, alone=True)
        if isinstance(target, ast.Name):
            return self._store_name(target, value, node.value)
        element = isinstance(target, ast.Subscript) and not isinstance(target.slice, ast.Slice)
        place = self.expression(target) if element else value
        fault = f"assigning to {ast.unparse(target)}"
        good = element and ".at[" in place.text
        self.need(good, target, fault, "assign to a name or to an array's element")
        self.writes |= self.expression(_root(target)).text not in self.scratch
        return [f"{place.text} = {self.cast(value, self.whole.real, target).at(0)};"]

    def _store_name(self, target: ast.Name, value: Value, node: ast.expr) -> list[str]:
        name, known = target.id, self.variables.get(target.id)
        if known is not None and (known.type, value.type) == (self.whole.real, self.whole.integer):
            value = self.cast(value, known.type, target)
        if known is not None and known.type == value.type:
            return self._store_again(known, value)
        fault = f"{name} as {value.type} and as {known and known.type}"
        same = known is None or self._blocks[name] is self._block_now
        self.need(same, target, fault, "give it one type, as 0.0 for 0")
        block, of = self._block_now, self.whole.structs.name(value.type)
        place = Value(c_name(name) if known is None else f"{c_name(name)}_{of}", value.type, place="named")
        self.variables[name], self._blocks[name] = place, block
        if known is None and _names(block)[name] != self._uses[name]:
            zero = "{0}" if is_struct(value.type) or hasattr(value.type, "ndim") else "0"
            self._first.append(f"{of} {place.text} = {zero};")
            return self._fill(place, value)
        if by_pointer(value.type) and self._stores[name] == 1 and self._stays(value, node):
            self.variables[name] = place._replace(place="pointer")
            return [f"const {of} *{place.text} = {value.address};"]
        if value.call or (value.fields and by_pointer(value.type)):
            return [f"{of} {place.text};", *self._fill(place, value)]
        text = value.at(0).removeprefix(f"({of})") if is_struct(value.type) else value.at(0)
        return [f"{of} {place.text} = {text};"]

    def _store_again(self, known: Value, value: Value) -> list[str]:
        """Assigns to a variable; an argument by pointer then points to a struct of the function's own."""
        pointer = known.place == "pointer"
        place = Value(f"{known.text}_", known.type, place="named") if pointer else known
        reads = re.search(rf"(?<![\w>.]){re.escape(known.text)}\b", value.text)
        lines = [f"{place.at(0)} = {value.at(0)};"] if reads else self._fill(place, value)
        return [*lines, f"{known.text} = &{place.text};"] if pointer else lines

    def _stays(self, value: Value, node: ast.expr) -> bool:
        """Whether a struct has a place that is never assigned again: in a name, or in a field of one."""
        root = _root(node)
        return bool(value.place and not value.call) and isinstance(root, ast.Name) and self._stores[root.id] <= 1

    def _new_array(self, target: Any, call: ast.Call) -> list[str]:
        """An array of a known size, on the stack."""
        from numba import types

        lengths = [getattr(one, "value", None) for one in getattr(call.args[0], "elts", call.args[:1])]
        name = getattr(target, "id", "")
        good = all(type(n) is int for n in lengths) and _names(self._block_now)[name] == self._uses[name] > 0
        fault = f"an array of {ast.unparse(call.args[0])}"
        self.need(good, call, fault, "write its size as numbers, where all its uses are")
        kind, own = types.Array(types.float64, len(lengths), "C"), c_name(name)
        self.variables[name] = Value(own, kind, place="named")
        self.scratch.add(own)
        shape = ", ".join(map(str, lengths))
        return [
            f"double {own}_numbers[{np.prod(lengths)}] = {{0}};",  # type: ignore[arg-type]
            f"const {self.whole.structs.name(kind)} {own} = {{{own}_numbers, {{{shape}}}}};",
        ]


def _root(node: Any) -> Any:
    """The variable of which an expression is a field, or an element."""
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return node
