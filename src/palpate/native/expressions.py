"""Expressions of laws as C: each typed by Numba's own rules, and each operand cast to what those ask for."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
from collections import ChainMap
from collections.abc import Callable
from functools import reduce
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from palpate._jit.cache import parts, stored
from palpate._jit.overloads import kind_of
from palpate.native.normal_form import normal_form
from palpate.native.source import parse_function, refuse
from palpate.native.structs import by_pointer, c_name, is_struct, leaves, members, number, plain

CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, UNARY, ATOM = range(9)
"""Precedence of expressions in C, the loosest first."""
OPERATORS = {
    ast.Add: ("+", operator.add, SUM),
    ast.Sub: ("-", operator.sub, SUM),
    ast.Mult: ("*", operator.mul, PRODUCT),
    ast.Div: ("/", operator.truediv, PRODUCT),
    ast.MatMult: ("@", operator.matmul, PRODUCT),
    ast.Mod: ("modulo", operator.mod, ATOM),
    ast.FloorDiv: ("floored", operator.floordiv, ATOM),
    ast.Lt: ("<", operator.lt, ORDER),
    ast.LtE: ("<=", operator.le, ORDER),
    ast.Gt: (">", operator.gt, ORDER),
    ast.GtE: (">=", operator.ge, ORDER),
    ast.Eq: ("==", operator.eq, EQUAL),
    ast.NotEq: ("!=", operator.ne, EQUAL),
}
"""Operators of two numbers: in C, in Python, and how tightly C binds them; a helper's name where C has none."""
POWERS = {0.5: "root", 2: "square", 3: "cube"}
FUNCTIONS = {
    math.sqrt: "sqrt",
    np.sqrt: "sqrt",
    math.floor: "floor",
    math.fabs: "fabs",
    math.isnan: "isnan",
    np.isnan: "isnan",
    math.isfinite: "isfinite",
    math.copysign: "copysign",
    abs: "fabs",
}
"""Functions that C's library computes as Python's does, to the last bit: IEEE defines them."""
REMEDIES = {
    "name": "assign a number or a truth before, at every way to here",
    "constant": "use a number or a truth",
    "attribute": "use a field or a property of a part",
    "subscript": "index each dimension by an integer from 0 on, int(...), or slice the only one, without a step",
    "binop": "use + - * / // % @, ** 2, ** 3, or ** 0.5 for a root",
    "unaryop": "use - of numbers and not of truths",
    "boolop": "join truths; write a if b else c for another value",
    "ifexp": "give both values one type",
    "call": "call a law, or abs, max, sqrt, or palpate's log, with all its arguments in order; and alone in a "
    "statement if it writes to an array",
    "for": "count with range by 1 or by -1, with a name that nothing else has",
    "assign": "assign one type, as 0.0 for 0, to a name or an array's element, and arrays of a size in numbers",
    "other": "use numbers, parts, arrays, operators and laws",
}
"""Remedies of refused syntax, by its kind."""


class Value(NamedTuple):
    """An expression in C.

    Args:
        text: of it; that of a struct behind a pointer begins with *.
        type: Numba's.
        rank: how tightly it binds.
        fields: of a struct that is made here.
        call: of a function that writes a large struct, up to the address.
    """

    text: str
    type: Any
    rank: int = ATOM
    fields: tuple[Value, ...] = ()
    call: str = ""

    def at(self, rank: int) -> str:
        """The text where C binds as tightly as `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"

    def member(self, name: str, kind: Any) -> Value:
        """A field of the struct."""
        return Value(f"{self.text[1:]}->{name}" if self.text[0] == "*" else f"{self.at(ATOM)}.{name}", kind)

    @property
    def address(self) -> str:
        """Address of a struct."""
        return self.text[1:] if self.text[0] == "*" else f"&{self.at(UNARY)}"


class Expressions:
    """Translates expressions of one function: a method for each kind of node.

    Args:
        whole: the `Translation` that the function is part of.
        function: whose expressions these are.
    """

    def __init__(self, whole: Any, function: Callable[..., Any]):
        self.whole = whole
        self.function = function
        self.variables: dict[str, Value] = {}
        self.scratch: set[str] = set()
        self.writes = False
        self._alone: set[int] = set()

    def need(self, good: Any, node: Any) -> None:
        """Refuses a node of this function that is not as C needs it.

        Raises:
            OutsideSubset: it is not good.
        """
        if not good:
            remedy = REMEDIES.get(type(node).__name__.lower(), REMEDIES["other"])
            refuse(self.function, node, ast.unparse(node).split("\n")[0], remedy)

    def expression(self, node: Any, alone: bool = False) -> Any:
        """The C of an expression, or the lines of a statement; a call `alone` there may write to an array."""
        if alone:
            self._alone.add(id(node))
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        self.need(method, node)
        return method(node)  # type: ignore[misc]

    def truth(self, node: Any) -> Value:
        """The C of a condition."""
        return self.cast(self.expression(node, alone=True), self.whole.boolean, node)

    def cast(self, value: Value, kind: Any, node: Any) -> Value:
        """A value as one of another type."""
        if value.type == kind:
            return value
        self.need(not is_struct(value.type) and not is_struct(kind) and kind != self.whole.boolean, node)
        return Value(f"({self.whole.structs.name(kind)}){value.at(UNARY)}", kind, UNARY)

    def python_object(self, node: Any) -> Any:
        """The Python object that a name, or a name in a module, stands for; None for a variable or a value."""
        if isinstance(node, ast.Name) and node.id not in self.variables:
            nonlocals = dict(inspect.getclosurevars(self.function).nonlocals)
            names = ChainMap(nonlocals, self.function.__globals__, vars(builtins))
            self.need(node.id in names, node)
            return names[node.id]
        module = self.python_object(node.value) if isinstance(node, ast.Attribute) else None
        return getattr(module, node.attr) if isinstance(module, ModuleType) else None

    def _constant(self, node: ast.Constant) -> Value:
        return self._literal(node.value, node)

    def _literal(self, value: Any, node: Any) -> Value:
        self.need(type(value) in self.whole.kinds, node)
        return Value(number(value), self.whole.kinds[type(value)])

    def _name(self, node: Any) -> Value:
        if isinstance(node, ast.Name) and node.id in self.variables:
            return self.variables[node.id]
        value = self.python_object(node)
        name = getattr(node, "id", getattr(node, "attr", ""))
        if isinstance(value, np.ndarray | tuple) or (type(value) in (int, float) and math.isfinite(value)):
            return Value(*self.whole.constant(name, value, self.function))
        return self._literal(value, node)

    def _attribute(self, node: ast.Attribute) -> Value:
        if self.python_object(node) is not None:
            return self._name(node)
        part = self.expression(node.value)
        name = c_name(node.attr, field=True)
        fields = dict(members(part.type)) if is_struct(part.type) else {}
        if name in fields:
            return part.member(name, fields[name])
        getter = getattr(_method(part, node), "fget", None)
        self.need(getter, node)
        return self._calling(getter, [part], node, is_property=True)

    def _tuple(self, node: ast.Tuple) -> Value:
        return self._new_part([self.expression(element, alone=True) for element in node.elts])

    def _new_part(self, fields: list[Value], cls: Any = None) -> Value:
        """A part, or a tuple, of its fields."""
        from numba import types

        kind = plain(types.BaseTuple.from_types(tuple(value.type for value in fields), cls))
        text = ", ".join(field.text for field in fields)
        return Value(f"({self.whole.structs.name(kind)}){{{text}}}", kind, fields=tuple(fields))

    def _subscript(self, node: ast.Subscript) -> Value:
        shape = isinstance(node.value, ast.Attribute) and node.value.attr == "shape"
        base: Value = self.expression(node.value.value if shape else node.value)  # type: ignore[attr-defined]
        if is_struct(base.type):
            return self._field(base, node)
        name, integer = base.at(ATOM), self.whole.integer
        if shape:
            return Value(f"{name}.shape[{self._index(node.slice, node).text}]", integer)
        if isinstance(node.slice, ast.Slice):
            part = node.slice
            of = self.whole.structs.name(base.type)
            self.need(part.lower and part.step is None and base.type.ndim == 1, node)
            start = self._index(part.lower, node).at(SUM + 1)
            stop = self._index(part.upper, node).at(SUM) if part.upper else f"{name}.shape[0]"
            return Value(f"({of}){{{name}.at + {start}, {{{stop} - {start}}}}}", base.type)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        self.need(len(indices) == base.type.ndim, node)
        place, *others = (self._index(index, node) for index in indices)
        for k, index in enumerate(others, 1):
            text = f"{place.at(PRODUCT)} * {name}.shape[{k}] + {index.at(PRODUCT)}"
            place = Value(text, integer, SUM)
        return Value(f"{name}.at[{place.text}]", self.whole.real)

    def _index(self, index: Any, node: ast.Subscript) -> Value:
        value: Value = self.expression(index)
        self.need(value.type == self.whole.integer and not value.text.startswith("-"), node)
        return value

    def _field(self, base: Value, node: ast.Subscript) -> Value:
        """A field of a tuple by its place; by a variable one of several that are alike."""
        inner = members(base.type)
        place = self._index(node.slice, node)
        if place.text.isdigit():
            return base.member(*inner[int(place.text)])
        self.need(all(kind == inner[0][1] for _, kind in inner), node)
        values = [base.member(*member) for member in inner]
        for k in reversed(range(len(values) - 1)):
            test = Value(f"{place.at(ORDER)} == {k}", self.whole.boolean, EQUAL)
            values[k] = self._choice(test, *values[k : k + 2])
        return values[0]

    def _binop(self, node: ast.BinOp) -> Value:
        if not isinstance(node.op, ast.Pow):
            return self._operation(node.op, node.left, node.right, node)
        base = self.expression(node.left)
        power = getattr(node.right, "value", None)
        self.need(base.type == self.whole.real and power in POWERS, node)
        return self._c_call(self.whole.helper(POWERS[power], base.type), [base], base.type)  # type: ignore[index]

    def _compare(self, node: ast.Compare) -> Value:
        return self._operation(node.ops[0], node.left, node.comparators[0], node)

    def _operation(self, op: ast.operator | ast.cmpop, left: Any, right: Any, node: Any) -> Value:
        """Two values joined by an operator, each cast as Numba's signature has it."""
        self.need(type(op) in OPERATORS, node)
        sign, meaning, rank = OPERATORS[type(op)]
        values = [self.expression(left), self.expression(right)]
        if any(is_struct(value.type) for value in values):
            return self._calling(meaning, values, node)
        signature = self.whole.rules.signature(meaning, tuple(value.type for value in values))
        kind = signature.return_type
        types = (kind, kind) if kind == self.whole.real else signature.args
        a, b = (self.cast(x, of, node) for x, of in zip(values, types, strict=True))
        if rank == ATOM:
            return self._c_call(self.whole.helper(sign, kind), [a, b], kind)
        return Value(f"{a.at(max(rank, SUM))} {sign} {b.at(max(rank + 1, SUM))}", kind, rank)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return Value(f"!{self.truth(node.operand).at(UNARY)}", self.whole.boolean, UNARY)
        self.need(isinstance(node.op, ast.USub), node)
        value = self.expression(node.operand)
        if is_struct(value.type):
            return self._calling(operator.neg, [value], node)
        return Value(f"-{value.at(ATOM)}", value.type, UNARY)

    def _boolop(self, node: ast.BoolOp) -> Value:
        sign, rank = (" && ", AND) if isinstance(node.op, ast.And) else (" || ", OR)
        return Value(
            sign.join(self.truth(operand).at(EQUAL) for operand in node.values), self.whole.boolean, rank
        )

    def _ifexp(self, node: ast.IfExp) -> Value:
        test = self.truth(node.test)
        values = [self.expression(branch, alone=True) for branch in (node.body, node.orelse)]
        kind = plain(self.whole.typing.unify_types(*(value.type for value in values)))
        return self._choice(test, *(self.cast(value, kind, node) for value in values))

    def _choice(self, test: Value, a: Value, b: Value) -> Value:
        if by_pointer(a.type):
            return Value(f"*({test.at(OR)} ? {a.address} : {b.address})", a.type, UNARY)
        return Value(f"{test.at(OR)} ? {a.at(OR)} : {b.at(CHOICE)}", a.type, CHOICE)

    def _call(self, node: ast.Call) -> Value:
        self.need(not node.keywords, node)
        callee = self.python_object(node.func)
        part = []
        is_method = callee is None and isinstance(node.func, ast.Attribute)
        if is_method:
            part = [self.expression(node.func.value)]  # type: ignore[attr-defined]
            callee = _method(part[0], node.func)  # type: ignore[arg-type]
            self.need(inspect.isfunction(callee), node)
        values = [*part, *map(self.expression, node.args)]
        if callee in stored:
            of, reads = stored[callee]
            kind = plain(kind_of(of))
            name = self.whole.helper("read_TYPE" if reads else "write_TYPE", kind)
            return self._c_call(name, values, *((kind,) if reads else (self.whole.none, node)))
        if inspect.isfunction(callee):
            return self._calling(callee, values, node, is_method)
        if callee in parts:
            return self._new_part(values, callee)
        return self._built_in(callee, values, node)

    def _built_in(self, callee: Any, values: list[Value], node: ast.Call) -> Value:
        """A call of one of Python's own functions, or of its mathematics."""
        kinds = tuple(value.type for value in values)
        casts = self.whole.kinds
        if callee is len:
            return Value(f"{values[0].at(ATOM)}.shape[0]", self.whole.integer)
        if callee in casts:
            return self.cast(values[0], casts[callee], node)
        if callee in (min, max):
            kind = self.whole.typing.unify_types(*kinds)
            name = self.whole.helper("larger" if callee is max else "smaller", kind)
            each = (self.cast(value, kind, node) for value in values)
            return reduce(lambda a, b: self._c_call(name, [a, b], kind), each)
        self.need(callee in FUNCTIONS, node)
        values = [self.cast(value, self.whole.real, node) for value in values]
        result = self.whole.rules.signature(callee, kinds).return_type
        c_type = self.whole.real if result != self.whole.boolean else result
        return self.cast(self._c_call(FUNCTIONS[callee], values, c_type), result, node)

    def _calling(self, callee: Any, values: list[Value], node: Any, is_property: bool = False) -> Value:
        """Translate a function and call it: a part's own if `is_property`, else the one that Numba has for it."""
        kinds = tuple(value.type for value in values)
        function = callee if is_property else self.whole.rules.implementation(callee, kinds)
        self.need(function and function.__code__.co_argcount == len(values), node)
        tree = parse_function(function)
        if isinstance(tree, ast.Lambda):
            inner = Expressions(self.whole, function)
            inner.variables = dict(zip(function.__code__.co_varnames, values, strict=True))
            value: Value = inner.expression(normal_form(tree.body))
            return value
        known = self.whole.function(function, kinds)
        return self._c_call(known.name, values, known.result, node if known.writes else None)

    def _c_call(self, name: str, values: list[Value], kind: Any, writer: Any = None) -> Value:
        """A call in C, of a `writer` to arrays; that of a large struct writes it where its last argument points to."""
        if writer:
            self.need(id(writer) in self._alone, writer)
            self.writes |= any(
                leaves(argument.type) > 1 and argument.text not in self.scratch for argument in values
            )
        texts = [value.address if by_pointer(value.type) else value.text for value in values]
        call = f"{name}({', '.join(texts)}"
        if not by_pointer(kind):
            return Value(f"{call})", kind)
        new = f"&({self.whole.structs.name(kind)}){{0}}"
        return Value(f"*{call}, {new})", kind, UNARY, call=f"{call}, ")


def _method(part: Value, node: ast.Attribute) -> Any:
    """A function or a property of a part, by an attribute's name."""
    return inspect.getattr_static(getattr(part.type, "instance_class", None), node.attr, None)
