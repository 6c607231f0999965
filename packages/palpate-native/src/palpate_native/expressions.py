"""Expressions of laws as C: each typed by Numba's own rules, and each operand cast to what those ask for."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
from collections import ChainMap
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from palpate._jit.registry import parts, stored
from palpate._jit.stored import kind_of
from palpate_native.source import refuse, syntax_of
from palpate_native.structs import by_pointer, c_name, is_struct, members, plain, result_places, value_type

CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, UNARY, ATOM = range(9)
"""How tightly C binds an expression."""
OPERATORS = {
    ast.Add: ("+", operator.add, SUM), ast.Sub: ("-", operator.sub, SUM), ast.Mult: ("*", operator.mul, PRODUCT),
    ast.Div: ("/", operator.truediv, PRODUCT), ast.MatMult: ("@", operator.matmul, PRODUCT),
    ast.Mod: ("modulo", operator.mod, ATOM), ast.FloorDiv: ("floored", operator.floordiv, ATOM),
    ast.Lt: ("<", operator.lt, ORDER), ast.LtE: ("<=", operator.le, ORDER), ast.Gt: (">", operator.gt, ORDER),
    ast.GtE: (">=", operator.ge, ORDER), ast.Eq: ("==", operator.eq, EQUAL), ast.NotEq: ("!=", operator.ne, EQUAL),
    ast.In: ("==", operator.eq, EQUAL), ast.NotIn: ("==", operator.eq, EQUAL),
}  # fmt: skip
"""Operators of two numbers: in C, in Python, and how tightly C binds them; a helper's name where C has none."""
POWERS = {0.5: "root", 2: "square", 3: "cube"}
FUNCTIONS = {
    math.sqrt: "sqrt", np.sqrt: "sqrt", math.floor: "floor", math.fabs: "fabs", math.isnan: "isnan", np.isnan: "isnan",
    math.isfinite: "isfinite", math.copysign: "copysign", abs: "fabs",
}  # fmt: skip
"""Functions that C's library computes as Python's does, to the last bit: IEEE defines them."""


class Value(NamedTuple):
    """An expression in C.

    Args:
        text: of it.
        type: Numba's.
        rank: how tightly it binds.
        place: "" for a value, "named" for one that has an address, "pointer" for the address of a struct.
        fields: of a struct that is made here.
        call: of a function that writes large structs, @ for the address of each.
    """

    text: str
    type: Any
    rank: int = ATOM
    place: str = ""
    fields: tuple[Value, ...] = ()
    call: str = ""

    def at(self, rank: int) -> str:
        """The text where C binds as tightly as `rank`."""
        text, own = (f"*{self._within(UNARY)}", UNARY) if self.place == "pointer" else (self.text, self.rank)
        return text if own >= rank else f"({text})"

    def _within(self, rank: int) -> str:
        return self.text if self.rank >= rank else f"({self.text})"

    def member(self, name: str, kind: Any) -> Value:
        """A field of the struct."""
        pointer = self.place == "pointer"
        text = f"{self._within(ATOM)}{'->' if pointer else '.'}{name}"
        return Value(text, kind, ATOM, "named" if pointer else self.place)

    @property
    def address(self) -> str:
        """Where a struct is."""
        return self.text if self.place == "pointer" else f"&{self._within(UNARY)}"


def with_addresses(call: str, *addresses: str) -> str:
    """A call of a function that writes structs, with their addresses."""
    for address in addresses:
        call = call.replace("@", address, 1)
    return call


def number(value: float | bool) -> str:
    """A number as C reads it back, to the last bit."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return "NAN" if math.isnan(value) else repr(float(value))


class Expressions:
    """Translates expressions of one function: a method for each kind of node.

    Args:
        whole: the `Translation` that the function is part of.
        function: whose expressions these are.
    """

    def __init__(self, whole: Any, function: Callable[..., Any]):
        self.whole, self.function = whole, function
        self.variables: dict[str, Value] = {}
        self.scratch: set[str] = set()
        self.writes = False
        self._alone: set[int] = set()
        self._condition: Any = None

    def need(self, good: Any, node: Any, fault: str, remedy: str) -> None:
        """Refuses a node of this function that is not as C needs it."""
        if not good:
            refuse(self.function, node, fault, remedy)

    def expression(self, node: Any, alone: bool = False) -> Value:
        """The C of an expression; a call `alone` in its statement may write to an array.

        Raises:
            OutsideSubset: it has none.
        """
        if alone:
            self._alone.add(id(node))
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            refuse(self.function, node, type(node).__name__, "use numbers, parts, arrays, operators and laws")
        value: Value = method(node)
        return value

    def truth(self, node: Any) -> Value:
        """The C of a condition."""
        self._condition = node
        return self.cast(self.expression(node, alone=True), self.whole.boolean, node)

    def cast(self, value: Value, kind: Any, node: Any) -> Value:
        """A value as one of another type."""
        if value.type == kind:
            return value
        same = is_struct(value.type) or is_struct(kind)
        self.need(not same, node, f"{value.type} where {kind} is asked for", "give all branches one type")
        if kind == self.whole.boolean:
            return Value(f"{value.at(EQUAL + 1)} != 0", kind, EQUAL)
        return Value(f"({self.whole.structs.name(kind)}){value.at(UNARY)}", kind, UNARY)

    def python_object(self, node: Any) -> Any:
        """The Python object that a name, or a name in a module, stands for; None for a variable or a value."""
        if isinstance(node, ast.Name) and node.id not in self.variables:
            own = dict(inspect.getclosurevars(self.function).nonlocals)
            names = ChainMap(own, self.function.__globals__, vars(builtins))
            self.need(
                node.id in names, node, f"the name {node.id!r}", "assign it before, at every way to here"
            )
            return names[node.id]
        module = self.python_object(node.value) if isinstance(node, ast.Attribute) else None
        return getattr(module, node.attr) if isinstance(module, ModuleType) else None

    def _literal(self, value: Any, node: Any) -> Value:
        kinds = self.whole.kinds
        self.need(type(value) in kinds, node, f"a {type(value).__name__}", "use a number or a truth")
        return Value(number(value), kinds[type(value)], UNARY if number(value).startswith("-") else ATOM)

    def _constant(self, node: ast.Constant) -> Value:
        return self._literal(node.value, node)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.variables:
            return self.variables[node.id]
        found = self.python_object(node)
        constant: Value | None = self.whole.constants.value(node.id, found, self.function)
        return constant or self._literal(found, node)

    def _attribute(self, node: ast.Attribute) -> Value:
        fixed = self.python_object(node)
        if fixed is not None:
            return self._literal(fixed, node)
        part = self.expression(node.value)
        fields = dict(members(part.type)) if is_struct(part.type) else {}
        name = c_name(node.attr, field=True)
        if name in fields:
            return part.member(name, fields[name])
        getter = inspect.getattr_static(getattr(part.type, "instance_class", None), node.attr, None)
        self.need(
            isinstance(getter, property), node, f".{node.attr} of {part.type}", "use a field or a property"
        )
        return self._calling(getter.fget, [part], node)

    def _tuple(self, node: ast.Tuple) -> Value:
        from numba import types

        values = [self.expression(one, alone=True) for one in node.elts]
        return self.struct(values, plain(types.Tuple([value.type for value in values])), node)

    def struct(self, values: list[Value], kind: Any, node: Any) -> Value:
        """A struct made of its fields."""
        fields = [self.cast(value, one, node) for value, (_, one) in zip(values, members(kind), strict=True)]
        text = ", ".join(one.at(CHOICE) for one in fields)
        return Value(f"({self.whole.structs.name(kind)}){{{text}}}", kind, fields=tuple(fields))

    def _subscript(self, node: ast.Subscript) -> Value:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            place = self._field_number(node.slice)
            return Value(f"{self.expression(node.value.value).at(ATOM)}.shape[{place}]", self.whole.integer)
        table = None if isinstance(node.value, ast.Subscript) else self.python_object(node.value)
        if isinstance(table, np.ndarray) or (type(table) is tuple and isinstance(node.value, ast.Name)):
            name = self.whole.constants.table(ast.unparse(node.value), table, self.function)
            return self._element(name, [str(n) for n in np.shape(table)], node)
        base = self.expression(node.value)
        if is_struct(base.type):
            return self._field(base, node)
        if isinstance(node.slice, ast.Slice):
            return self._view(base, node.slice)
        lengths = [f"{base.at(ATOM)}.shape[{k}]" for k in range(base.type.ndim)]
        return self._element(f"{base.at(ATOM)}.at", lengths, node)

    def _element(self, name: str, lengths: list[str], node: ast.Subscript) -> Value:
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        self.need(
            len(indices) == len(lengths), node, "a row of a table", "index every dimension of the array"
        )
        place = self._index(indices[0])
        for index, length in zip(indices[1:], lengths[1:], strict=True):
            text = f"{place.at(PRODUCT)} * {length} + {self._index(index).at(PRODUCT)}"
            place = Value(text, self.whole.integer, SUM)
        return Value(f"{name}[{place.at(CHOICE)}]", self.whole.real, ATOM, "named")

    def _index(self, node: Any) -> Value:
        value = self.expression(node)
        good = value.type == self.whole.integer and not value.text.startswith("-")
        self.need(good, node, f"the index {ast.unparse(node)}", "use an integer from 0 on: int(...)")
        return value

    def _view(self, array: Value, part: ast.Slice) -> Value:
        good = part.step is None and array.type.ndim == 1
        self.need(good, part, "this slice", "slice one dimension, without a step")
        base, of = array.at(ATOM), self.whole.structs.name(array.type)
        start = self._index(part.lower).at(SUM + 1) if part.lower else "0"
        stop = self._index(part.upper).at(SUM) if part.upper else f"{base}.shape[0]"
        return Value(f"({of}){{{base}.at + {start}, {{{stop} - {start}}}}}", array.type)

    def _field_number(self, node: Any) -> int:
        value = getattr(node, "value", None)
        self.need(isinstance(value, int), node, f"the place {ast.unparse(node)}", "write the field's number")
        return int(value)  # type: ignore[arg-type]

    def _field(self, base: Value, node: ast.Subscript) -> Value:
        inner = members(base.type)
        self.need(
            value_type(base.type) == base.type, node, "a field of a tuple with parts", "unpack it into names"
        )
        if isinstance(node.slice, ast.Constant):
            return base.member(*inner[self._field_number(node.slice)])
        alike = all(kind == inner[0][1] for _, kind in inner)
        self.need(alike, node, "a field of a part by a variable", "name the field")
        return self._call_of(self.whole.selector(base.type), [base, self._index(node.slice)], inner[0][1])

    def _binop(self, node: ast.BinOp) -> Value:
        if isinstance(node.op, ast.Pow):
            base, power = self.expression(node.left), getattr(node.right, "value", None)
            good = base.type == self.whole.real and power in POWERS
            self.need(good, node, f"the power {ast.unparse(node)}", "write a product, or ** 0.5 for a root")
            return Value(f"{self.whole.helper(POWERS[power], base.type)}({base.at(CHOICE)})", base.type)  # type: ignore[index]
        return self.operation(node.op, self.expression(node.left), self.expression(node.right), node)

    def operation(self, op: ast.operator | ast.cmpop, a: Value, b: Value, node: Any) -> Value:
        """Two values joined by an operator, each cast as Numba's signature has it."""
        known = type(op) in OPERATORS
        self.need(
            known, node, f"the operator of {ast.unparse(node)}", "use + - * / // % ** @ and comparisons"
        )
        sign, meaning, rank = OPERATORS[type(op)]
        if is_struct(a.type) or is_struct(b.type):
            return self._calling_overload(meaning, [a, b], node)
        signature = self.whole.rules.signature(meaning, (a.type, b.type))
        kind = signature.return_type
        asked = (kind, kind) if kind == self.whole.real else signature.args
        a, b = (self.cast(x, of, node) for x, of in zip((a, b), asked, strict=True))
        if rank == ATOM:
            return Value(f"{self.whole.helper(sign, kind)}({a.at(CHOICE)}, {b.at(CHOICE)})", kind)
        return Value(f"{a.at(max(rank, SUM))} {sign} {b.at(max(rank + 1, SUM))}", kind, rank)

    def _compare(self, node: ast.Compare) -> Value:
        inside = (part for middle in node.comparators[:-1] for part in ast.walk(middle))
        calls = any(isinstance(part, ast.Call) for part in inside)
        self.need(not calls, node, "a call between two comparisons", "assign it to a name first")
        if isinstance(node.ops[0], ast.In | ast.NotIn):
            values = getattr(node.comparators[0], "elts", [])
            self.need(values, node, "in", "give a tuple of numbers")
            ops, lefts, rights = node.ops * len(values), [node.left] * len(values), values
            sign, rank = " || ", OR
        else:
            ops, lefts, rights = node.ops, [node.left, *node.comparators], node.comparators
            sign, rank = " && ", AND
        triples = zip(ops, lefts, rights, strict=False)
        each = [self.operation(op, self.expression(a), self.expression(b), node) for op, a, b in triples]
        if len(each) == 1 and rank == AND:
            return each[0]
        text = sign.join(one.at(EQUAL) for one in each)
        if isinstance(node.ops[0], ast.NotIn):
            return Value(f"!({text})", self.whole.boolean, UNARY)
        return Value(text, self.whole.boolean, rank)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return Value(f"!{self.truth(node.operand).at(UNARY)}", self.whole.boolean, UNARY)
        self.need(isinstance(node.op, ast.USub), node, "this sign", "leave it out")
        value = self.expression(node.operand)
        if is_struct(value.type):
            return self._calling_overload(operator.neg, [value], node)
        return Value(f"-{value.at(ATOM)}", value.type, UNARY)

    def _boolop(self, node: ast.BoolOp) -> Value:
        sign, rank = (" && ", AND) if isinstance(node.op, ast.And) else (" || ", OR)
        condition = node is self._condition
        values = [self.expression(one, alone=True) for one in node.values]
        good = condition or all(value.type == self.whole.boolean for value in values)
        self.need(good, node, f"{ast.unparse(node)} as a value", "write a if b else c")
        texts = [self.cast(value, self.whole.boolean, node).at(EQUAL) for value in values]
        return Value(sign.join(texts), self.whole.boolean, rank)

    def _ifexp(self, node: ast.IfExp) -> Value:
        test = self.truth(node.test)
        a, b = self.expression(node.body, alone=True), self.expression(node.orelse, alone=True)
        kind = a.type if a.type == b.type else plain(self.whole.typing.unify_types(a.type, b.type) or a.type)
        a, b = self.cast(a, kind, node), self.cast(b, kind, node)
        if by_pointer(kind):
            return Value(f"{test.at(OR)} ? {a.address} : {b.address}", kind, CHOICE, "pointer")
        return Value(f"{test.at(OR)} ? {a.at(OR)} : {b.at(CHOICE)}", kind, CHOICE)

    def _call(self, node: ast.Call) -> Value:
        callee = self.python_object(node.func)
        if callee is None and isinstance(node.func, ast.Attribute):
            part = self.expression(node.func.value)
            method = inspect.getattr_static(getattr(part.type, "instance_class", None), node.func.attr, None)
            good = inspect.isfunction(method)
            self.need(good, node, f".{node.func.attr}() of {part.type}", "call a method of a part, or a law")
            return self._calling(method, [part, *self._arguments(method, node, 1)], node)
        if isinstance(callee, type) and callee in parts:
            from numba import types

            values = self._arguments(callee, node, 0)
            kinds = tuple(value.type for value in values)
            made = self.whole.typing.resolve_function_type(types.NamedTupleClass(callee), kinds, {})
            return self.struct(values, plain(made.return_type), node)
        if callee in stored:
            return self._storage(*stored[callee], node)
        if inspect.isfunction(callee):
            return self._calling_overload(callee, self._arguments(callee, node, 0), node)
        return self._built_in(callee, [self.expression(one) for one in node.args], node)

    def _storage(self, part: type, reads: bool, node: ast.Call) -> Value:
        """A part read from the beginning of an array; or the array's beginning as the part that is written there."""
        values = [self.expression(one) for one in node.args]
        name, kind = self.whole.storage(plain(kind_of(part)), reads), plain(kind_of(part))
        if reads:
            return self._call_of(name, values, kind)
        self.need(id(node) in self._alone, node, "writing a part in an expression", "write it in a statement")
        self.writes |= values[0].text not in self.scratch
        return self._call_of(name, values, self.whole.none)

    def _arguments(self, callee: Any, node: ast.Call, known: int) -> list[Value]:
        """Values of a call in the order of the function's parameters, defaults where none is given."""
        starred = any(isinstance(one, ast.Starred) for one in node.args) or None in (
            w.arg for w in node.keywords
        )
        self.need(not starred, node, "a starred argument", "name each argument")
        parameters = list(inspect.signature(callee).parameters.values())[known:]
        given: dict[Any, Any] = dict(zip((p.name for p in parameters), node.args, strict=False))
        given.update({word.arg: word.value for word in node.keywords})
        return [
            self.expression(given[p.name]) if p.name in given else self._literal(p.default, node)
            for p in parameters
        ]

    def _built_in(self, callee: Any, values: list[Value], node: ast.Call) -> Value:
        """A call of one of Python's own functions, or of its mathematics."""
        kinds, first = tuple(value.type for value in values), values[0] if values else None
        casts = self.whole.kinds
        if callee is abs and first and is_struct(first.type):
            return self._calling_overload(abs, values, node)
        if callee is len and first:
            return Value(f"{first.at(ATOM)}.shape[0]", self.whole.integer)
        if callee in casts and first:
            return self.cast(first, casts[callee], node)
        if callee in (min, max):
            kind = self.whole.typing.unify_types(*kinds)
            name = self.whole.helper("larger" if callee is max else "smaller", kind)
            text, *others = [self.cast(value, kind, node).at(CHOICE) for value in values]
            for other in others:
                text = f"{name}({text}, {other})"
            return Value(text, kind)
        remedy = (
            "call palpate._jit.log, which C has too"
            if "log" in ast.unparse(node.func)
            else "call a law, or abs, max, sqrt"
        )
        self.need(callee in FUNCTIONS, node, f"{ast.unparse(node.func)}()", remedy)
        texts = [self.cast(value, self.whole.real, node).at(CHOICE) for value in values]
        result = plain(self.whole.rules.signature(callee, kinds).return_type)
        own = self.whole.real if result != self.whole.boolean else result
        return self.cast(Value(f"{FUNCTIONS[callee]}({', '.join(texts)})", own), result, node)

    def _calling_overload(self, callee: Any, values: list[Value], node: Any) -> Value:
        kinds = tuple(value.type for value in values)
        found: Any = self.whole.rules.implementation(callee, kinds)
        name = getattr(callee, "__name__", callee)
        self.need(found, node, f"{name} of {', '.join(map(str, kinds))}", "mark the function with @law")
        return self._calling(found, values, node)

    def _calling(self, function: Callable[..., Any], values: list[Value], node: Any) -> Value:
        """A call of a function of Python, which is translated first; a lambda's expression stands in its place."""
        tree = syntax_of(function)
        if isinstance(tree, ast.Lambda):
            inner = Expressions(self.whole, function)
            inner.variables = dict(zip(function.__code__.co_varnames, values, strict=False))
            return inner.expression(tree.body)
        known = self.whole.function(function, tuple(value.type for value in values))
        fault = f"{function.__name__}(), which writes to an array, in an expression"
        self.need(not known.writes or id(node) in self._alone, node, fault, "assign its value to a name")
        arrays = [value for value in values if getattr(value.type, "ndim", 0) or is_struct(value.type)]
        self.writes |= known.writes and any(value.text not in self.scratch for value in arrays)
        return self._call_of(known.name, values, known.result)

    def _call_of(self, name: str, values: list[Value], kind: Any) -> Value:
        """A call in C; a large struct is written where the last argument points to."""
        texts = [value.address if by_pointer(value.type) else value.at(CHOICE) for value in values]
        places = result_places(kind)
        if not places:
            return Value(f"{name}({', '.join(texts)})", kind)
        call = f"{name}({', '.join([*texts, *('@' for _ in places)])})"
        return Value(
            with_addresses(call, *(f"&({self.whole.structs.name(one)}){{0}}" for _, one in places)),
            kind, place="pointer", call=call,
        )  # fmt: skip
