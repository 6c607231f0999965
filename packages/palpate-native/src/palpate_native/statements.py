"""Statements of laws as C: each variable declared where it is first assigned, each comment beside its line."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from palpate._jit.registry import parts
from palpate_native.expressions import SUM, Expressions, Value, with_addresses
from palpate_native.source import comments_of, refuse, syntax_of
from palpate_native.structs import by_pointer, c_name, is_struct, members, result_places, value_type

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
        self.kinds, self.result = kinds, result
        self.tree: Any = syntax_of(function)
        self._comments = comments_of(function.__code__.co_filename)
        body: Any = self.tree.body
        self._uses, self._stores = _names(body), _names(body, ast.Store)
        self._blocks: dict[str, list[ast.stmt]] = {}
        self._block_now: list[ast.stmt] = body
        self._first: list[str] = []
        self._slots: dict[str, Value] = {}
        self._temporaries = 0

    def text(self, name: str) -> str:
        """The function in C."""
        parameters = []
        for argument, kind in zip((one.arg for one in self.tree.args.args), self.kinds, strict=True):
            own, of = c_name(argument), self.whole.structs.name(kind)
            place, given = ("pointer", f"const {of} *{own}") if by_pointer(kind) else ("named", f"{of} {own}")
            if by_pointer(kind) and self._stores[argument]:
                self._first.append(f"{of} {own}_;")
            if not self._uses[argument]:
                self._first.append(f"(void){own};")
            parameters.append(given)
            self.variables[argument], self._blocks[argument] = Value(own, kind, place=place), self.tree.body
        self._slots = self._places_in_result() if result_places(self.result) else {}
        lines = self._block(self.tree.body)
        of = self.whole.structs.name(value_type(self.result))
        parameters += [f"{self.whole.structs.name(kind)} *{to}" for to, kind in result_places(self.result)]
        if by_pointer(value_type(self.result)):
            of = f"const {of} *"
        head = f"static {of} {name}({', '.join(parameters) or 'void'}) {{".replace("* ", "*")
        return "\n".join([head, *(STEP + line for line in self._first), *lines, "}"])

    def _block(self, block: list[ast.stmt]) -> list[str]:
        lines, before = [], self._block_now
        for statement in block:
            self._block_now = block
            new = self._statement(statement)
            comment = self._comments.get(statement.lineno)
            if comment and new:
                new[0] += f" /* {comment} */"
            lines += [STEP + line for line in new]
        self._block_now = before
        return lines

    def _statement(self, node: Any) -> list[str]:
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None or (isinstance(node, ast.For | ast.While) and node.orelse):
            remedy = "use assignments, if, while, for over range, and return"
            refuse(self.function, node, type(node).__name__.lower(), remedy)
        lines: list[str] = method(node)
        return lines

    def _expr(self, node: ast.Expr) -> list[str]:
        comment = isinstance(node.value, ast.Constant)
        return [] if comment else [f"{self.expression(node.value, alone=True).text};"]

    def _pass(self, node: ast.Pass) -> list[str]:
        return []

    def _break(self, node: ast.Break | ast.Continue) -> list[str]:
        return [f"{type(node).__name__.lower()};"]

    _continue = _break

    def _while(self, node: ast.While) -> list[str]:
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
        self.need(counts, node, "this loop", "count with range")
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
        if isinstance(node.value, ast.Tuple) and is_struct(self.result):
            value = self.struct(
                [self.expression(one, alone=True) for one in node.value.elts], self.result, node
            )
        else:
            value = self.cast(self.expression(node.value, alone=True), self.result, node)
        places = [Value(to, kind, place="pointer") for to, kind in result_places(self.result)]
        if not places:
            return [f"return {value.at(0)};"]
        if value.call:
            return [f"return {with_addresses(value.call, *(place.text for place in places))};"]
        if value_type(self.result) == self.result:
            return [*self._fill(places[0], value), "return to;"]
        self.need(value.fields, node, "a tuple with parts by its name", "return its fields")
        small = next(one for one in value.fields if not by_pointer(one.type))
        pairs = zip(places, (one for one in value.fields if by_pointer(one.type)), strict=True)
        return [line for place, one in pairs for line in self._fill(place, one)] + [f"return {small.at(0)};"]

    def _fill(self, place: Value, value: Value) -> list[str]:
        """Writes a value into a place that it does not read: a large struct field by field, or by the function."""
        if value.text == place.text:
            return []
        if value.call:
            return [f"{with_addresses(value.call, place.address)};"]
        if not (value.fields and by_pointer(value.type)):
            return [f"{place.at(0)} = {value.at(0)};"]
        pairs = zip(members(value.type), value.fields, strict=True)
        return [line for field, one in pairs for line in self._fill(place.member(*field), one)]

    def _places_in_result(self) -> dict[str, Value]:
        """Large variables that stand in the result from the beginning: those that every return has at one place."""
        places: dict[str, set[Value | None]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Return) and node.value:
                bare = dict(self._elements(node.value, Value("to", self.result, place="pointer")))
                for name in _names([node.value]):
                    places.setdefault(name, set()).add(bare.get(name))
        ways = [_way(one) for found in places.values() for one in found if one]
        single = {name: one for name, (one, *more) in places.items() if one and not more}
        return {
            name: one for name, one in single.items() if name not in self.variables
            and sum(way.startswith(_way(one)) or _way(one).startswith(way) for way in ways) == 1
        }  # fmt: skip

    def _elements(self, node: ast.expr, place: Value) -> Iterator[tuple[str, Value]]:
        """Names in an expression of a struct that are its fields, or fields of fields, and their places."""
        if isinstance(node, ast.Name) and by_pointer(place.type):
            yield node.id, place
        inner: list[ast.expr] = getattr(node, "elts", [])
        if isinstance(node, ast.Call) and not node.keywords:
            inner = node.args if self.function.__globals__.get(getattr(node.func, "id", "")) in parts else []
        if is_struct(place.type):
            for one, field in zip(inner, members(place.type), strict=False):
                whole = place.text == "to" and value_type(self.result) != self.result
                own = Value(f"to{field[0][1:]}", field[1], place="pointer") if whole else place.member(*field)
                yield from self._elements(one, own)

    def _augassign(self, node: ast.AugAssign) -> list[str]:
        target, value = self.expression(node.target), self.expression(node.value, alone=True)
        return self._store(node.target, self.operation(node.op, target, value, node))

    def _assign(self, node: ast.Assign) -> list[str]:
        if len(node.targets) == 1:
            return self._store_value(node.targets[0], node.value)
        value = self.expression(node.value, alone=True)
        lines: list[str] = []
        if not isinstance(node.value, ast.Constant | ast.UnaryOp):
            lines, value = self._temporary(value)
        return lines + [line for target in node.targets for line in self._store(target, value)]

    def _temporary(self, value: Value) -> tuple[list[str], Value]:
        """A constant of the value, under a name that Python does not have."""
        lines, own = self._temporary_of(value.type)
        return (
            [*lines, *self._fill(own, value)] if value.call else [f"const {lines[0][:-1]} = {value.at(0)};"]
        ), own

    def _temporary_of(self, kind: Any) -> tuple[list[str], Value]:
        """The declaration of a variable under a name that Python does not have, and its place."""
        self._temporaries += 1
        own = Value(f"value{self._temporaries}_", kind, place="named")
        return [f"{self.whole.structs.name(kind)} {own.text};"], own

    def _store_value(self, target: Any, node: Any) -> list[str]:
        """Assigns an expression; of a tuple each element, and none before all are read that another's place is in."""
        if isinstance(node, ast.Call) and self.python_object(node.func) in (np.empty, np.zeros):
            return self._new_array(target, node)
        if not (isinstance(target, ast.Tuple) and isinstance(node, ast.Tuple)):
            return self._store(target, self.expression(node, alone=True))
        pairs = list(zip(target.elts, node.elts, strict=True))
        if not any(
            _may_read(later, stored) for i, (stored, _) in enumerate(pairs) for _, later in pairs[i + 1 :]
        ):
            return [line for pair in pairs for line in self._store_value(*pair)]
        first: list[str] = []
        then: list[str] = []
        for stored, one in pairs:
            value = self.expression(one, alone=True)
            if not isinstance(one, ast.Constant):
                lines, value = self._temporary(value)
                first += lines
            then += self._store(stored, value)
        return first + then

    def _store(self, target: Any, value: Value) -> list[str]:
        if isinstance(target, ast.Name):
            return self._store_name(target, value)
        if isinstance(target, ast.Tuple):
            return self._unpack(target, value)
        element = isinstance(target, ast.Subscript) and not isinstance(target.slice, ast.Slice)
        place = self.expression(target) if element else value
        fault = f"assigning to {ast.unparse(target)}"
        self.need(
            ".at[" in place.text and element, target, fault, "assign to a name or to an array's element"
        )
        root = target
        while isinstance(root, ast.Subscript | ast.Attribute):
            root = root.value
        self.writes |= self.expression(root).text not in self.scratch
        return [f"{place.text} = {self.cast(value, self.whole.real, target).at(0)};"]

    def _unpack(self, target: ast.Tuple, value: Value) -> list[str]:
        good = is_struct(value.type) and len(members(value.type)) == len(target.elts)
        self.need(good, target, f"unpacking {value.type}", "give as many names as it has fields")
        if value.call and value_type(value.type) != value.type:
            return self._unpack_call(target, value)
        lines, value = ([], value) if value.place and not value.call else self._temporary(value)
        for one, field in zip(target.elts, members(value.type), strict=True):
            if getattr(one, "id", "") != "_":
                lines += self._store(one, value.member(*field))
        return lines

    def _unpack_call(self, target: ast.Tuple, value: Value) -> list[str]:
        """Unpacks a tuple whose large fields the function writes: new variables at once, others by a temporary."""
        before, after, places = [], [], []
        for one, (_, kind) in zip(target.elts, members(value.type), strict=True):
            name = getattr(one, "id", "_")
            if not by_pointer(kind):
                small = one
                continue
            new = name != "_" and name not in self.variables
            lines, place = self._new(name, kind) if new else self._temporary_of(kind)
            before += lines
            after += [] if new or name == "_" else self._store(one, place)
            places.append(place)
        call = Value(with_addresses(value.call, *(place.address for place in places)), value_type(value.type))
        stored = [f"{call.text};"] if getattr(small, "id", "") == "_" else self._store(small, call)
        return [*before, *stored, *after]

    def _new(self, name: str, kind: Any) -> tuple[list[str], Value]:
        """A variable where it is first assigned: its declaration if it has one here, and its place."""
        known, slot, of = self.variables.get(name), self._slots.get(name), self.whole.structs.name(kind)
        if known is None and slot is not None and slot.type == kind:
            self.variables[name] = slot
            return [], slot
        block, text = self._block_now, c_name(name) if known is None else f"{c_name(name)}_{of}"
        self._blocks[name], own = block, Value(text, kind, place="named")
        self.variables[name] = own
        if known is not None or _names(block)[name] == self._uses[name]:
            return [f"{of} {text};"], own
        self._first.append(f"{of} {text} = {'{0}' if is_struct(kind) or hasattr(kind, 'ndim') else '0'};")
        return [], own

    def _store_name(self, target: ast.Name, value: Value) -> list[str]:
        known = self.variables.get(target.id)
        if known is not None and (known.type, value.type) == (self.whole.real, self.whole.integer):
            value = self.cast(value, known.type, target)
        if known is not None and known.type == value.type:
            return self._store_again(known, value, target.id in self._slots)
        if known is not None:
            fault = f"{target.id} as {value.type} and as {known.type}"
            same = self._blocks[target.id] is self._block_now
            self.need(same, target, fault, "give it one type, as 0.0 for 0")
        stays = by_pointer(value.type) and self._stores[target.id] == 1 and self._stays(value)
        lines, place = self._new(target.id, value.type)
        if stays and lines:
            self.variables[target.id] = place._replace(place="pointer")
            return [f"const {lines[0].removesuffix(place.text + ';')}*{place.text} = {value.address};"]
        if lines and not (value.call or any(one.call for one in value.fields)):
            of = self.whole.structs.name(value.type)
            text = value.at(0).removeprefix(f"({of})") if is_struct(value.type) else value.at(0)
            return [f"{of} {place.text} = {text};"]
        return [*lines, *self._fill(place, value)]

    def _store_again(self, known: Value, value: Value, in_result: bool) -> list[str]:
        """Assigns to a variable; an argument by pointer then points to a struct of the function's own."""
        if known.text == value.text:
            return []
        pointer = known.place == "pointer" and not in_result
        place = Value(f"{known.text}_", known.type, place="named") if pointer else known
        reads = re.search(rf"(?<![\w>.]){re.escape(known.text)}\b", value.text)
        lines = [f"{place.at(0)} = {value.at(0)};"] if reads else self._fill(place, value)
        return [*lines, f"{known.text} = &{place.text};"] if pointer else lines

    def _stays(self, value: Value) -> bool:
        """Whether a struct has a place, in a name that is never assigned again."""
        pythons = [
            name
            for name, known in self.variables.items()
            if re.match(rf"{re.escape(known.text)}\b", value.text)
        ]
        given = {argument.arg for argument in self.tree.args.args}
        fixed = pythons or re.fullmatch(r"\w+", value.text)
        return bool(value.place and not value.call and fixed) and all(
            self._stores[name] <= (name not in given) for name in pythons
        )

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


def _way(place: Value) -> str:
    """The fields that lead to a place in the result, each behind a dot."""
    return f"{place.text}.".replace("->", ".")


def _may_read(node: ast.expr, stored: ast.expr) -> bool:
    """Whether an expression may read what was stored before: a name, or any element of an array."""
    reads_array = any(isinstance(one, ast.Subscript | ast.Call) for one in ast.walk(node))
    return any(
        target.id in _names([node]) if isinstance(target, ast.Name) else reads_array
        for target in (stored.elts if isinstance(stored, ast.Tuple) else [stored])
    )
