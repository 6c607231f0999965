"""Expressions of laws as C: each typed by Numba's own rules, and each operand cast to what those ask for."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple, NoReturn

import numpy as np

from palpate._jit.registry import parts
from palpate.native.source import refuse, syntax_of
from palpate.native.structs import by_pointer, c_name, is_struct, members, plain

CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, UNARY, ATOM = range(9)
"""How tightly C binds an expression."""
_BINARY = {
    ast.Add: ("+", operator.add, SUM), ast.Sub: ("-", operator.sub, SUM), ast.Mult: ("*", operator.mul, PRODUCT),
    ast.Div: ("/", operator.truediv, PRODUCT), ast.MatMult: ("@", operator.matmul, PRODUCT),
    ast.Mod: ("modulo", operator.mod, ATOM), ast.FloorDiv: ("floored", operator.floordiv, ATOM),
}  # fmt: skip
_COMPARE = {
    ast.Lt: ("<", operator.lt, ORDER), ast.LtE: ("<=", operator.le, ORDER), ast.Gt: (">", operator.gt, ORDER),
    ast.GtE: (">=", operator.ge, ORDER), ast.Eq: ("==", operator.eq, EQUAL), ast.NotEq: ("!=", operator.ne, EQUAL),
}  # fmt: skip
_LIBRARY = {
    math.sqrt: "sqrt", np.sqrt: "sqrt", math.floor: "floor", math.fabs: "fabs", math.isnan: "isnan", np.isnan: "isnan",
    math.isfinite: "isfinite", math.copysign: "copysign",
}  # fmt: skip
"""Functions that C's library computes as Python's does, to the last bit: IEEE defines them."""


class Value(NamedTuple):
    """An expression in C.

    Args:
        text: of it.
        type: Numba's.
        rank: how tightly it binds.
        place: "" for a value, "named" for one that has an address, "pointer" for the address of a struct.
    """

    text: str
    type: Any
    rank: int = ATOM
    place: str = ""

    def at(self, rank: int) -> str:
        """The text where C binds as tightly as `rank`."""
        text, own = (f"*{self.text}", UNARY) if self.place == "pointer" else (self.text, self.rank)
        return text if own >= rank else f"({text})"

    def member(self, name: str, kind: Any) -> Value:
        """A field of the struct."""
        if self.place == "pointer":
            return Value(f"{self.text}->{name}", kind, ATOM, "named")
        return Value(f"{self.at(ATOM)}.{name}", kind, ATOM, self.place)


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
    """Translates expressions of one function.

    Args:
        whole: the `Translation` that the function is part of.
        function: whose expressions these are.
    """

    def __init__(self, whole: Any, function: Callable[..., Any]):
        self.whole, self.function = whole, function
        self.variables: dict[str, Value] = {}
        self.writes = False
        self.scratch: set[str] = set()
        self._ordered: set[int] = set()
        self._conditions: set[int] = set()

    def refuse(self, node: ast.AST, fault: str, remedy: str) -> NoReturn:
        """Raises the refusal of a node of this function."""
        refuse(self.function, node, fault, remedy)

    def expression(self, node: ast.expr) -> Value:
        """The C of an expression.

        Raises:
            OutsideSubset: it has none.
        """
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.refuse(
                node, f"{type(node).__name__}", "use numbers, parts, arrays, operators and calls of laws"
            )
        value: Value = method(node)
        return value

    def statement_value(self, node: ast.expr) -> Value:
        """The C of an expression which is all of a statement, so that a call in it may write to an array."""
        self._ordered.add(id(node))
        return self.expression(node)

    def truth(self, node: ast.expr) -> Value:
        """The C of a condition."""
        self._conditions.add(id(node))
        return self.cast(self.statement_value(node), self.whole.boolean, node)

    def cast(self, value: Value, kind: Any, node: ast.AST) -> Value:
        """A value as one of another type."""
        if value.type == kind:
            return value
        name = self.whole.structs.name(kind)
        if kind == self.whole.boolean:
            return Value(f"{value.at(EQUAL + 1)} != 0", kind, EQUAL)
        if is_struct(value.type) or is_struct(kind):
            self.refuse(node, f"{value.type} where {kind} is asked for", "give all branches the same type")
        return Value(f"({name}){value.at(UNARY)}", kind, UNARY)

    def python_object(self, node: ast.expr) -> Any:
        """The Python object that a name, or a name in a module, stands for; None for a variable or a value."""
        if isinstance(node, ast.Name) and node.id not in self.variables:
            code = self.function.__code__
            cells = zip(code.co_freevars, self.function.__closure__ or (), strict=True)
            closure = {name: cell.cell_contents for name, cell in cells}
            for names in (closure, self.function.__globals__, vars(builtins)):
                if node.id in names:
                    return names[node.id]
            self.refuse(node, f"the name {node.id!r}", "assign it before, at every way to this line")
        if isinstance(node, ast.Attribute):
            module = self.python_object(node.value)
            return getattr(module, node.attr) if isinstance(module, ModuleType) else None
        return None

    def _constant(self, node: ast.Constant) -> Value:
        return self._literal(node.value, node)

    def _literal(self, value: Any, node: ast.AST) -> Value:
        kinds = {bool: self.whole.boolean, int: self.whole.integer, float: self.whole.real}
        if type(value) not in kinds:
            self.refuse(node, f"a {type(value).__name__}", "use a number or a truth")
        return Value(number(value), kinds[type(value)], UNARY if number(value).startswith("-") else ATOM)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.variables:
            return self.variables[node.id]
        value = self.python_object(node)
        file = self.function.__code__.co_filename
        if isinstance(value, float) and not math.isfinite(value):
            return self._literal(value, node)
        constant = self.whole.constants.value(node.id, value, file)
        return constant if constant is not None else self._literal(value, node)

    def _attribute(self, node: ast.Attribute) -> Value:
        fixed = self.python_object(node)
        if fixed is not None:
            return self._literal(float(fixed) if isinstance(fixed, float) else fixed, node)
        part = self.expression(node.value)
        fields = dict(members(part.type)) if is_struct(part.type) else {}
        name = c_name(node.attr, field=True)
        if name in fields:
            return part.member(name, fields[name])
        getter = inspect.getattr_static(getattr(part.type, "instance_class", None), node.attr, None)
        if not isinstance(getter, property) or getter.fget is None:
            self.refuse(node, f".{node.attr} of {part.type}", "use a field or a property of a part")
        return self._calling(getter.fget, [part], node)

    def _tuple(self, node: ast.Tuple) -> Value:
        from numba import types

        values = [self.statement_value(one) for one in node.elts]
        return self.struct(values, plain(types.Tuple([value.type for value in values])), node)

    def struct(self, values: list[Value], kind: Any, node: ast.AST) -> Value:
        """A struct made of its fields."""
        inner = zip(values, members(kind), strict=True)
        texts = (self.cast(value, one, node).at(CHOICE) for value, (_, one) in inner)
        return Value(f"({self.whole.structs.name(kind)}){{{', '.join(texts)}}}", kind)

    def _subscript(self, node: ast.Subscript) -> Value:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            array, place = self.expression(node.value.value), self._field_number(node.slice)
            return Value(f"{array.at(ATOM)}.shape[{place}]", self.whole.integer)
        table = None if isinstance(node.value, ast.Subscript) else self.python_object(node.value)
        if isinstance(table, np.ndarray) or (type(table) is tuple and isinstance(node.value, ast.Name)):
            name = self.whole.constants.table(ast.unparse(node.value), np.array(table), self.function)
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
        if len(indices) != len(lengths):
            self.refuse(node, "a row of a table", "index every dimension of the array")
        place = self._index(indices[0])
        for index, length in zip(indices[1:], lengths[1:], strict=True):
            place = Value(
                f"{place.at(PRODUCT)} * {length} + {self._index(index).at(PRODUCT)}", self.whole.integer, SUM
            )
        return Value(f"{name}[{place.at(CHOICE)}]", self.whole.real, ATOM, "named")

    def _index(self, node: ast.expr) -> Value:
        value = self.expression(node)
        if value.type != self.whole.integer or value.text.startswith("-"):
            self.refuse(node, f"the index {ast.unparse(node)}", "use an integer from 0 on: int(...)")
        return value

    def _view(self, array: Value, part: ast.Slice) -> Value:
        if part.step is not None or array.type.ndim != 1:
            self.refuse(part, "this slice", "slice one dimension, without a step")
        base = array.at(ATOM)
        start = self._index(part.lower) if part.lower else Value("0", self.whole.integer)
        stop = self._index(part.upper) if part.upper else Value(f"{base}.shape[0]", self.whole.integer)
        name = self.whole.structs.name(array.type)
        return Value(
            f"({name}){{{base}.at + {start.at(SUM + 1)}, {{{stop.at(SUM)} - {start.at(SUM + 1)}}}}}",
            array.type,
        )

    def _field_number(self, node: ast.expr) -> int:
        value = node.value if isinstance(node, ast.Constant) else None
        if not isinstance(value, int):
            self.refuse(node, f"the place {ast.unparse(node)}", "write the number of the field")
        return value

    def _field(self, base: Value, node: ast.Subscript) -> Value:
        inner = members(base.type)
        if isinstance(node.slice, ast.Constant):
            return base.member(*inner[self._field_number(node.slice)])
        if any(kind != inner[0][1] for _, kind in inner):
            self.refuse(node, "a field of a part by a variable", "name the field")
        return Value(
            f"{self.whole.selector(base.type)}({self.argument(base)}, {self._index(node.slice).text})",
            inner[0][1],
        )

    def _binop(self, node: ast.BinOp) -> Value:
        if isinstance(node.op, ast.Pow):
            return self._power(node)
        if type(node.op) not in _BINARY:
            self.refuse(node, f"the operator of {ast.unparse(node)}", "use + - * / // % ** and @")
        return self.binary(node.op, self.expression(node.left), self.expression(node.right), node)

    def binary(self, op: ast.operator, a: Value, b: Value, node: ast.AST) -> Value:
        """Two values joined by an operator."""
        sign, meaning, rank = _BINARY[type(op)]
        if is_struct(a.type) or is_struct(b.type):
            return self._calling_overload(meaning, [a, b], node)
        signature = self.whole.signature(meaning, (a.type, b.type))
        kinds = (self.whole.real, self.whole.real) if isinstance(op, ast.Div) else signature.args
        a, b = (self.cast(x, kind, node) for x, kind in zip((a, b), kinds, strict=True))
        if rank == ATOM:
            name = self.whole.helper(sign, signature.return_type)
            return Value(f"{name}({a.at(CHOICE)}, {b.at(CHOICE)})", signature.return_type)
        return Value(f"{a.at(rank)} {sign} {b.at(rank + 1)}", signature.return_type, rank)

    def _power(self, node: ast.BinOp) -> Value:
        base, exponent = self.expression(node.left), node.right
        value = exponent.value if isinstance(exponent, ast.Constant) else None
        if base.type != self.whole.real or value not in (0.5, 2, 3) or value is True:
            self.refuse(node, f"the power {ast.unparse(node)}", "write a product, or ** 0.5 for a root")
        if value == 0.5:
            return Value(f"{self.whole.helper('root', base.type)}({base.at(CHOICE)})", base.type)
        name = self.whole.helper("square" if value == 2 else "cube", base.type)
        return Value(f"{name}({base.at(CHOICE)})", base.type)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            self._ordered.add(id(node.operand))
            return Value(f"!{self.truth(node.operand).at(UNARY)}", self.whole.boolean, UNARY)
        value = self.expression(node.operand)
        if not isinstance(node.op, ast.USub):
            self.refuse(node, "this sign", "leave it out")
        if is_struct(value.type):
            return self._calling_overload(operator.neg, [value], node)
        return Value(f"-{value.at(ATOM)}", value.type, UNARY)

    def _boolop(self, node: ast.BoolOp) -> Value:
        sign, rank = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        values = [self.statement_value(one) for one in node.values]
        if id(node) not in self._conditions and any(value.type != self.whole.boolean for value in values):
            self.refuse(node, f"{ast.unparse(node)} as a value", "write a if b else c")
        texts = [self.cast(value, self.whole.boolean, node).at(EQUAL) for value in values]
        return Value(f" {sign} ".join(texts), self.whole.boolean, rank)

    def _compare(self, node: ast.Compare) -> Value:
        pairs = [node.left, *node.comparators]
        if len(node.ops) == 1 and isinstance(node.ops[0], ast.In | ast.NotIn):
            return self._among(node)
        texts = []
        for op, left, right in zip(node.ops, pairs, node.comparators, strict=False):
            if type(op) not in _COMPARE:
                self.refuse(node, f"the comparison {ast.unparse(node)}", "compare numbers")
            texts.append(self._comparison(op, self.expression(left), self.expression(right), node))
        if len(texts) == 1:
            return texts[0]
        if any(isinstance(one, ast.Call) for node in pairs[1:-1] for one in ast.walk(node)):
            self.refuse(node, "a call between two comparisons", "assign it to a name first")
        return Value(" && ".join(text.at(AND + 1) for text in texts), self.whole.boolean, AND)

    def _comparison(self, op: ast.cmpop, a: Value, b: Value, node: ast.AST) -> Value:
        sign, meaning, rank = _COMPARE[type(op)]
        if is_struct(a.type) or is_struct(b.type):
            self.refuse(node, "a comparison of parts", "compare their numbers")
        signature = self.whole.signature(meaning, (a.type, b.type))
        a, b = (self.cast(x, kind, node) for x, kind in zip((a, b), signature.args, strict=True))
        return Value(f"{a.at(SUM)} {sign} {b.at(SUM)}", self.whole.boolean, rank)

    def _among(self, node: ast.Compare) -> Value:
        values = node.comparators[0]
        if not isinstance(values, ast.Tuple):
            self.refuse(node, "in", "give a tuple of numbers")
        value, equal = self.expression(node.left), ast.Eq()
        texts = [self._comparison(equal, value, self.expression(one), node).at(EQUAL) for one in values.elts]
        either = Value(" || ".join(texts), self.whole.boolean, OR)
        if isinstance(node.ops[0], ast.In):
            return either
        return Value(f"!({either.text})", self.whole.boolean, UNARY)

    def _ifexp(self, node: ast.IfExp) -> Value:
        condition, a, b = (
            self.truth(node.test),
            self.statement_value(node.body),
            self.statement_value(node.orelse),
        )
        kind = a.type if a.type == b.type else plain(self.whole.typing.unify_types(a.type, b.type) or a.type)
        a, b = self.cast(a, kind, node), self.cast(b, kind, node)
        return Value(f"{condition.at(OR)} ? {a.at(OR)} : {b.at(CHOICE)}", kind, CHOICE)

    def _call(self, node: ast.Call) -> Value:
        callee = self.python_object(node.func)
        if callee is None and isinstance(node.func, ast.Attribute):
            part = self.expression(node.func.value)
            method = inspect.getattr_static(getattr(part.type, "instance_class", None), node.func.attr, None)
            if not inspect.isfunction(method):
                self.refuse(node, f".{node.func.attr}() of {part.type}", "call a method of a part, or a law")
            return self._calling(method, [part, *self._arguments(method, node, 1)], node)
        if isinstance(callee, type) and callee in parts:
            return self._construct(callee, node)
        if inspect.isfunction(callee):
            return self._calling_overload(callee, self._arguments(callee, node, 0), node)
        return self._built_in(callee, [self.expression(one) for one in node.args], node)

    def _arguments(self, callee: Callable[..., Any], node: ast.Call, known: int) -> list[Value]:
        """Values of a call in the order of the function's parameters, defaults where none is given."""
        parameters = list(inspect.signature(callee).parameters.values())[known:]
        given = dict(zip((p.name for p in parameters), node.args, strict=False))
        given.update({str(word.arg): word.value for word in node.keywords})
        if any(isinstance(one, ast.Starred) for one in node.args) or None in (w.arg for w in node.keywords):
            self.refuse(node, "a starred argument", "name each argument")
        return [
            self.expression(given[p.name]) if p.name in given else self._literal(p.default, node)
            for p in parameters
        ]

    def _construct(self, cls: type, node: ast.Call) -> Value:
        from numba import types

        values = self._arguments(cls, node, 0)
        signature = self.whole.typing.resolve_function_type(
            types.NamedTupleClass(cls), tuple(value.type for value in values), {}
        )
        return self.struct(values, plain(signature.return_type), node)

    def _built_in(self, callee: Any, values: list[Value], node: ast.Call) -> Value:
        """A call of one of Python's own functions, or of its mathematics."""
        texts = [value.at(CHOICE) for value in values]
        kind = values[0].type if values else None
        if callee is len:
            return Value(f"{values[0].at(ATOM)}.shape[0]", self.whole.integer)
        if callee is abs and is_struct(kind):
            return self._calling_overload(abs, values, node)
        if callee is abs and kind == self.whole.real:
            return Value(f"fabs({texts[0]})", kind)
        if callee in (min, max) and len(values) > 1:
            return self._extreme("larger" if callee is max else "smaller", values, node)
        if callee in (int, float, bool) and len(values) == 1:
            kinds = {int: self.whole.integer, float: self.whole.real, bool: self.whole.boolean}
            return self.cast(values[0], kinds[callee], node)
        if callee in _LIBRARY:
            result = plain(self.whole.signature(callee, tuple(value.type for value in values)).return_type)
            texts = [self.cast(value, self.whole.real, node).at(CHOICE) for value in values]
            value = Value(f"{_LIBRARY[callee]}({', '.join(texts)})", self.whole.real)
            if result == self.whole.boolean:
                return value._replace(type=result)
            return self.cast(value, result, node)
        name = ast.unparse(node.func)
        remedy = (
            "call palpate._jit.log, which C has too"
            if "log" in name
            else "call a law, or abs, min, max, sqrt"
        )
        return self.refuse(node, f"{name}()", remedy)

    def _extreme(self, name: str, values: list[Value], node: ast.AST) -> Value:
        kind = self.whole.typing.unify_types(*(value.type for value in values))
        helper, so_far = self.whole.helper(name, kind), self.cast(values[0], kind, node)
        for value in values[1:]:
            so_far = Value(f"{helper}({so_far.at(CHOICE)}, {self.cast(value, kind, node).at(CHOICE)})", kind)
        return so_far

    def _calling_overload(self, callee: Any, values: list[Value], node: ast.AST) -> Value:
        implementation = self.whole.implementation(callee, tuple(value.type for value in values))
        if implementation is None:
            kinds = ", ".join(str(value.type) for value in values)
            self.refuse(
                node, f"{getattr(callee, '__name__', callee)} of {kinds}", "mark the function with @law"
            )
        return self._calling(implementation, values, node)

    def _calling(self, function: Callable[..., Any], values: list[Value], node: ast.AST) -> Value:
        """A call of a function of Python, which is translated first; a lambda's expression stands in its place."""
        tree = syntax_of(function)
        if isinstance(tree, ast.Lambda):
            inner = Expressions(self.whole, function)
            inner.variables = dict(zip(function.__code__.co_varnames, values, strict=False))
            return inner.expression(tree.body)
        known = self.whole.function(function, tuple(value.type for value in values))
        if known.writes and id(node) not in self._ordered:
            self.refuse(
                node,
                f"{function.__name__}(), which writes to an array, in an expression",
                "assign its value to a name",
            )
        arrays = [value for value in values if getattr(value.type, "ndim", 0) or is_struct(value.type)]
        given = any(value.text not in self.scratch for value in arrays)
        self.writes = self.writes or (known.writes and given)
        return Value(f"{known.name}({', '.join(self.argument(value) for value in values)})", known.result)

    def argument(self, value: Value) -> str:
        """A value as the argument of a function: itself, or the address of a large struct."""
        if not by_pointer(value.type):
            return value.at(CHOICE)
        if value.place == "pointer":
            return value.text
        if value.place == "named":
            return f"&{value.at(UNARY)}"
        return f"({self.whole.structs.name(value.type)}[1]){{{value.text}}}"
