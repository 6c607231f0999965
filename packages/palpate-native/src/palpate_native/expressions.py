"""Expressions of laws as C: each typed by Numba's own rules, and each operand cast to what those ask for."""

from __future__ import annotations

import ast
import builtins
import functools
import inspect
import math
import operator
from collections import ChainMap
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from palpate._jit.registry import parts, stored
from palpate._jit.stored import kind_of
from palpate_native.constants import number
from palpate_native.normal_form import normal_form
from palpate_native.source import refuse, syntax_of
from palpate_native.structs import by_pointer, c_name, is_struct, members, plain

CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, UNARY, ATOM = range(9)
"""How tightly C binds an expression."""
OPERATORS = {
    ast.Add: ("+", operator.add, SUM), ast.Sub: ("-", operator.sub, SUM), ast.Mult: ("*", operator.mul, PRODUCT),
    ast.Div: ("/", operator.truediv, PRODUCT), ast.MatMult: ("@", operator.matmul, PRODUCT),
    ast.Mod: ("modulo", operator.mod, ATOM), ast.FloorDiv: ("floored", operator.floordiv, ATOM),
    ast.Lt: ("<", operator.lt, ORDER), ast.LtE: ("<=", operator.le, ORDER), ast.Gt: (">", operator.gt, ORDER),
    ast.GtE: (">=", operator.ge, ORDER), ast.Eq: ("==", operator.eq, EQUAL), ast.NotEq: ("!=", operator.ne, EQUAL),
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
        call: of a function that writes a large struct, up to the address.
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
        remedy = "use numbers, parts, arrays, operators and laws"
        self.need(method, node, type(node).__name__, remedy)
        return method(node)  # type: ignore[misc,no-any-return]

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
            fault = f"the name {node.id!r}"
            self.need(node.id in names, node, fault, "assign it before, at every way to here")
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
        part = isinstance(found, tuple) and hasattr(found, "_fields")
        if not part and (type(found) not in (int, float) or not math.isfinite(found)):
            return self._literal(found, node)
        kind = self.whole.type_of(found)
        return Value(self.whole.constants.name(node.id, found, kind, self.function), kind, place="named")

    def _attribute(self, node: ast.Attribute) -> Value:
        fixed = self.python_object(node)
        if fixed is not None:
            return self._literal(fixed, node)
        part, name = self.expression(node.value), c_name(node.attr, field=True)
        fields = dict(members(part.type)) if is_struct(part.type) else {}
        if name in fields:
            return part.member(name, fields[name])
        getter = inspect.getattr_static(getattr(part.type, "instance_class", None), node.attr, None)
        found, fault = isinstance(getter, property), f".{node.attr} of {part.type}"
        self.need(found, node, fault, "use a field or a property")
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
        of = node.value
        if isinstance(of, ast.Attribute) and of.attr == "shape":
            place = f"shape[{self._index(node.slice).text}]"
            return Value(f"{self.expression(of.value).at(ATOM)}.{place}", self.whole.integer)
        table = self.python_object(of)
        if isinstance(table, np.ndarray | tuple) and not hasattr(table, "_fields"):
            name = self.whole.constants.name(ast.unparse(of), table, None, self.function)
            return self._element(name, [str(n) for n in np.shape(table)], node)
        base = self.expression(of)
        if is_struct(base.type):
            return self._field(base, node)
        if isinstance(node.slice, ast.Slice):
            return self._view(base, node.slice)
        lengths = [f"{base.at(ATOM)}.shape[{k}]" for k in range(base.type.ndim)]
        return self._element(f"{base.at(ATOM)}.at", lengths, node)

    def _element(self, name: str, lengths: list[str], node: ast.Subscript) -> Value:
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        whole, remedy = len(indices) == len(lengths), "index every dimension of the array"
        self.need(whole, node, "a row of a table", remedy)
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

    def _field(self, base: Value, node: ast.Subscript) -> Value:
        inner, place = members(base.type), self._index(node.slice)
        if place.text.isdigit():
            return base.member(*inner[int(place.text)])
        alike = all(kind == inner[0][1] for _, kind in inner)
        self.need(alike, node, "a field of a part by a variable", "name the field")
        return self._call_of(self.whole.selector(base.type), [base, place], inner[0][1])

    def _binop(self, node: ast.BinOp) -> Value:
        if not isinstance(node.op, ast.Pow):
            return self._operation(node.op, node.left, node.right, node)
        base, power = self.expression(node.left), getattr(node.right, "value", None)
        good = base.type == self.whole.real and power in POWERS
        self.need(good, node, f"the power {ast.unparse(node)}", "write a product, or ** 0.5 for a root")
        return self._call_of(self.whole.helper(POWERS[power], base.type), [base], base.type)  # type: ignore[index]

    def _compare(self, node: ast.Compare) -> Value:
        return self._operation(node.ops[0], node.left, node.comparators[0], node)

    def _operation(self, op: ast.operator | ast.cmpop, left: Any, right: Any, node: Any) -> Value:
        """Two values joined by an operator, each cast as Numba's signature has it."""
        known, remedy = type(op) in OPERATORS, "use + - * / // % ** @ and comparisons"
        self.need(known, node, f"the operator of {ast.unparse(node)}", remedy)
        sign, meaning, rank = OPERATORS[type(op)]
        a, b = self.expression(left), self.expression(right)
        if is_struct(a.type) or is_struct(b.type):
            return self._calling_overload(meaning, [a, b], node)
        signature = self.whole.rules.signature(meaning, (a.type, b.type))
        kind = signature.return_type
        asked = (kind, kind) if kind == self.whole.real else signature.args
        a, b = (self.cast(x, of, node) for x, of in zip((a, b), asked, strict=True))
        if rank == ATOM:
            return self._call_of(self.whole.helper(sign, kind), [a, b], kind)
        return Value(f"{a.at(max(rank, SUM))} {sign} {b.at(max(rank + 1, SUM))}", kind, rank)

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
            good, fault = inspect.isfunction(method), f".{node.func.attr}() of {part.type}"
            self.need(good, node, fault, "call a method of a part, or a law")
            return self._calling(method, self._arguments(method, node, [part]), node)
        if isinstance(callee, type) and callee in parts:
            from numba import types

            values = self._arguments(callee, node)
            kinds = tuple(value.type for value in values)
            made = self.whole.typing.resolve_function_type(types.NamedTupleClass(callee), kinds, {})
            return self.struct(values, plain(made.return_type), node)
        if callee in stored:
            return self._storage(*stored[callee], node)
        if inspect.isfunction(callee):
            return self._calling_overload(callee, self._arguments(callee, node), node)
        return self._built_in(callee, [self.expression(one) for one in node.args], node)

    def _arguments(self, callee: Any, node: ast.Call, known: Sequence[Value] = ()) -> list[Value]:
        """Values of a call in the order of the function's parameters, `known` first, defaults where none is given."""
        words = {str(word.arg): word.value for word in node.keywords}
        bound = inspect.signature(callee).bind(*known, *node.args, **words)
        bound.apply_defaults()
        others = list(bound.arguments.values())[len(known) :]
        return [
            *known,
            *(self.expression(x) if isinstance(x, ast.AST) else self._literal(x, node) for x in others),
        ]

    def _storage(self, part: type, reads: bool, node: ast.Call) -> Value:
        """A part read from the beginning of an array; or the array's beginning as the part that is written there."""
        values, kind = [self.expression(one) for one in node.args], plain(kind_of(part))
        name = self.whole.storage(kind, reads)
        if reads:
            return self._call_of(name, values, kind)
        self.need(id(node) in self._alone, node, "writing a part in an expression", "write it in a statement")
        self.writes |= values[0].text not in self.scratch
        return self._call_of(name, values, self.whole.none)

    def _built_in(self, callee: Any, values: list[Value], node: ast.Call) -> Value:
        """A call of one of Python's own functions, or of its mathematics."""
        kinds, casts = tuple(value.type for value in values), self.whole.kinds
        if callee is abs and is_struct(kinds[0]):
            return self._calling_overload(abs, values, node)
        if callee is len:
            return Value(f"{values[0].at(ATOM)}.shape[0]", self.whole.integer)
        if callee in casts:
            return self.cast(values[0], casts[callee], node)
        if callee in (min, max):
            kind = self.whole.typing.unify_types(*kinds)
            name = self.whole.helper("larger" if callee is max else "smaller", kind)
            each = (self.cast(value, kind, node) for value in values)
            return functools.reduce(lambda a, b: self._call_of(name, [a, b], kind), each)
        remedy = "call a law, or abs, max, sqrt; palpate._jit.elementary has log and exp"
        self.need(callee in FUNCTIONS, node, f"{ast.unparse(node.func)}()", remedy)
        values = [self.cast(value, self.whole.real, node) for value in values]
        result = plain(self.whole.rules.signature(callee, kinds).return_type)
        own = self.whole.real if result != self.whole.boolean else result
        return self.cast(self._call_of(FUNCTIONS[callee], values, own), result, node)

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
            return inner.expression(normal_form(tree.body))
        known = self.whole.function(function, tuple(value.type for value in values))
        fault = f"{function.__name__}(), which writes to an array, in an expression"
        self.need(not known.writes or id(node) in self._alone, node, fault, "assign its value to a name")
        arrays = [value for value in values if getattr(value.type, "ndim", 0) or is_struct(value.type)]
        self.writes |= known.writes and any(value.text not in self.scratch for value in arrays)
        return self._call_of(known.name, values, known.result)

    def _call_of(self, name: str, values: list[Value], kind: Any) -> Value:
        """A call in C; a large struct is written where the last argument points to."""
        texts = [value.address if by_pointer(value.type) else value.at(CHOICE) for value in values]
        call = f"{name}({', '.join(texts)}"
        if not by_pointer(kind):
            return Value(f"{call})", kind)
        call = f"{call}, " if texts else call
        new = f"&({self.whole.structs.name(kind)}){{0}}"
        return Value(f"{call}{new})", kind, place="pointer", call=call)
