"""TOML files of experiments: shipped ones by name and the user's, tables of the user's parts, errors in its words.

The table of a part that the user brings is ``kind = "module:Class"``: its keys are the part's own fields.
"""

import inspect
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from types import NoneType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from palpate._jit import part as registered
from palpate._vector import Vec3
from palpate.controllers.controller import controller as registered_controller
from palpate.errors import InputError, unknown
from palpate.files import read_text
from palpate.plugins import Plugin, plugin, reason
from palpate.signals.types import Table, Triple, alike, triple

T = TypeVar("T")
_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "left out",
}
_LIMITS = {">": "above", ">=": "at least", "<": "below", "<=": "at most"}
_EXPECTED = re.compile(r"Expected `([^`]+)`(?: (>=|<=|>|<) (\S+)| of length (\d+))?(?:, got .*)?$")
_MISSING = re.compile(r"Object missing required field `(.+)`")
_UNKNOWN_KEY = re.compile(r"Object contains unknown field `(.+)`")


def explain(message: str, tables: Mapping[str, Any], kind: Any) -> str:
    """msgspec's message about a file in its user's words.

    Args:
        message: as msgspec has it.
        tables: what was given, without types.
        kind: the type that it should have had.
    """
    fault, _, path = message.partition(" - at `$")
    steps = re.findall(r"[^.\[\]`]+", path)
    if match := _UNKNOWN_KEY.match(fault):
        return _unknown("key", match[1], _keys(kind, tables, steps), _place(steps))
    if match := _MISSING.match(fault):
        choices = _choices(kind, tables, [*steps, match[1]])
        choice_hint = f"; it is one of: {', '.join(choices)}" if choices else ""
        return f"the key {match[1]!r} is missing{_place(steps)}{choice_hint}"
    given = _given_value(tables, steps)
    if fault.startswith("Invalid"):
        return _unknown(steps[-1], str(given), _choices(kind, tables, steps), _place(steps[:-1]))
    if match := _EXPECTED.match(fault):
        return f"{_name(steps)} must be {_allowed_value(*match.groups())}, got {given!r}"
    return f"{fault}{_place(steps)}"


def convert_table(tables: Any, kind: type[T]) -> T:
    """A table of a TOML file as a struct of this kind.

    Raises:
        InputError: a key that does not exist, or a value out of range.
    """
    try:
        return msgspec.convert(tables, kind)
    except msgspec.ValidationError as error:
        raise InputError(explain(str(error), tables, kind)) from error


def not_finite(tables: Any, steps: tuple[str, ...] = ()) -> str | None:
    """Message about the first number that is not finite; None if all are."""
    if isinstance(tables, float) and not math.isfinite(tables):
        return f"{_name(list(steps))} must be finite, got {tables}"
    pairs = (
        tables.items() if isinstance(tables, dict) else enumerate(tables) if isinstance(tables, list) else ()
    )
    return next(filter(None, (not_finite(value, (*steps, str(key))) for key, value in pairs)), None)


def _unknown(kind: str, name: str, known: list[str], place: str) -> str:
    return str(unknown(kind, name, known)).replace(";", f"{place};", 1)


def _allowed_value(kind: str, sign: str | None, limit: str | None, length: str | None) -> str:
    words = " or ".join(_KINDS.get(name, name) for name in kind.split(" | ") if name != "null")
    if length is not None:
        return f"{words} of {length}"
    return words if sign is None or limit is None else f"{words} {_LIMITS[sign]} {float(limit):g}"


def _name(steps: list[str]) -> str:
    """``coulomb[1] in [friction]`` of the steps friction, coulomb, 1."""
    keys = [step for step in steps if not step.isdigit()]
    index = "".join(f"[{step}]" for step in steps if step.isdigit())
    return f"{keys[-1] if keys else 'the file'}{index}{_place(keys[:-1])}"


def _place(steps: list[str]) -> str:
    return f" in [{'.'.join(steps)}]" if steps else ""


def _given_value(tables: Any, steps: list[str]) -> Any:
    for step in steps:
        tables = tables[int(step)] if isinstance(tables, list) else tables.get(step)
    return tables


def _keys(kind: Any, tables: Mapping[str, Any], steps: list[str]) -> list[str]:
    """The keys of a table, of the kind that it says it is."""
    structs = list(_structs(kind, tables, steps))
    tags = [s.__struct_config__.tag_field for s in structs if s.__struct_config__.tag_field]
    return sorted({f.encode_name for s in structs for f in msgspec.structs.fields(s)} | set(tags))


def _choices(kind: Any, tables: Mapping[str, Any], steps: list[str]) -> list[str]:
    """Allowed words of a key."""
    *table, key = steps
    structs = list(_structs(kind, tables, table, of_any_kind=True))
    tags = [s.__struct_config__.tag for s in structs if s.__struct_config__.tag_field == key]
    fields = [f.type for s in structs for f in msgspec.structs.fields(s) if f.encode_name == key]
    words = [choice for f in fields if get_origin(f) is Literal for choice in get_args(f)]
    return [str(choice) for choice in tags or words]


def _structs(
    kind: Any, tables: Mapping[str, Any], steps: list[str], *, of_any_kind: bool = False
) -> Iterator[Any]:
    """The types that the table at these steps may have, or the one that its tag names."""
    for step in steps:
        kind = next(f.type for f in msgspec.structs.fields(kind) if f.encode_name == step)
    given = _given_value(tables, steps)
    for struct in get_args(kind) or (kind,):
        if struct is NoneType:  # a table that may be left out
            continue
        config = struct.__struct_config__
        if of_any_kind or config.tag_field is None or given.get(config.tag_field) in {config.tag, None}:
            yield struct


@dataclass(frozen=True)
class TomlFiles:
    """Files of one kind that come with palpate, and their folder.

    Args:
        kind: word for one file, as `experiment`.
        article: of that word.
        package: that holds the files.
        folder: in that package.
    """

    kind: str
    article: str
    package: str
    folder: str

    def names(self) -> list[str]:
        """Those that come with palpate."""
        return sorted(self._files())

    def _files(self) -> dict[str, Traversable]:
        """File of each name."""
        files = (resources.files(self.package) / self.folder).iterdir()
        return {p.name.removesuffix(".toml"): p for p in files if p.name.endswith(".toml")}

    def source(self, name: str) -> str:
        """The text of one that comes with palpate, or of a TOML file of the user's.

        Raises:
            InputError: no such name, no such file, or not a text.
        """
        shipped = self._files()
        if name in shipped:
            return shipped[name].read_text("utf-8")
        path = Path(name)
        if path.suffix != ".toml" and not path.exists():
            raise unknown(self.kind, name, self.names())
        if not path.exists():
            raise InputError(f"{name}: no such file; give {self.article} {self.kind}'s name or a TOML file")
        return read_text(path, f"{self.article} {self.kind}")


GIVEN = {"tick": "time between ticks [s]", "wall": "x of the surface [m]"}
"""Fields of a part that the bench fills in; they are no keys of its table."""
_FIELDS: dict[Any, Any] = {float: float, int: int, bool: bool, Vec3: float | Triple}


@dataclass(frozen=True)
class Role:
    """Role of a user's part in an experiment.

    Args:
        key: its table.
        methods: that it must have, each with the names of its arguments and what it returns.
        compiled: whether it runs inside the compiled loop, and so is a NamedTuple.
    """

    key: str
    methods: Mapping[str, tuple[str, str]]
    compiled: bool = True
    optional: Mapping[str, tuple[str, str]] = field(default_factory=dict)


CONTROLLER = Role(
    "controller",
    {"start": ("", "state"), "step": ("state, sense, task, model", "(torque, state)")},
    optional={
        "rest": ("state, sense", "state"),
        "report": ("state", "(Vec3, Vec3)"),
        "trouble": ("state", "text"),
    },
)
SURFACE = Role(
    "surface",
    {
        "start": ("", "SurfaceState"),
        "force": ("state, p, v", "force"),
        "relax": ("state, p, v, dt", "SurfaceState"),
        "free": ("state, dt", "SurfaceState"),
    },
    optional={"stored_energy": ("state", "energy"), "truth": ("", "{name: (value, unit)}")},
)
IDENTIFIER = Role(
    "identifier", {"update": ("regressor, force", "None"), "estimate": ("", "Estimate")}, compiled=False
)
ROLES = {role.key: role for role in (CONTROLLER, SURFACE, IDENTIFIER)}


class OwnTable(Table, frozen=True):
    """A table of an experiment that asks for a part of the user's; one class for each plug-in is derived from it."""

    plugin: ClassVar[Plugin]
    role: ClassVar[Role]
    part: ClassVar[Any]

    shares_loop: ClassVar[bool] = False

    def build(self, tick: float = 0.0, wall: float = 0.0) -> Any:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m].

        Raises:
            InputError: the part itself refuses its numbers.
        """
        given = {"tick": float(tick), "wall": float(wall)}
        values = {
            name: given[name] if name in given else _value(getattr(self, name), kind)
            for name, kind in _kinds(self.part, self.role).items()
        }
        try:
            return self.part(**values)
        except Exception as error:
            raise InputError(
                f"{self.plugin.name} refuses the values of [{self.role.key}]: {reason(error)}"
            ) from error

    def __reduce__(self) -> Any:
        values = {f.name: getattr(self, f.name) for f in msgspec.structs.fields(self)}
        return _restore, (self.role.key, self.plugin, values)


def _restore(role: str, known: Plugin, values: dict[str, Any]) -> OwnTable:
    """Restore a pickled table in another process."""
    known.value()
    return plugin_table(ROLES[role], known.name)(**values)


def plugin_table(role: Role, name: str) -> Any:
    """The type of the table that asks for a plug-in.

    Raises:
        InputError: it cannot be imported, or is no such part.
    """
    return _plugin_table(role.key, plugin(name))


@cache
def _plugin_table(key: str, known: Plugin) -> Any:
    role, part = ROLES[key], known.value()
    check_protocol(role, part, known.name)
    if role.compiled:
        (registered_controller if role is CONTROLLER else registered)(part)
    fields = [
        (name, _field(known, name, kind), *_default(part, role, name))
        for name, kind in _kinds(part, role).items()
        if name not in GIVEN
    ]
    return msgspec.defstruct(
        part.__name__,
        sorted(fields, key=len),  # those without a default first
        bases=(OwnTable,),
        namespace={"plugin": known, "role": role, "part": part},
        tag_field="kind",
        tag=known.name,
        frozen=True,
        forbid_unknown_fields=True,
    )


def find_role(name: str) -> Role:
    """Role of a plug-in, from its methods.

    Raises:
        InputError: it cannot be imported, or is no part.
    """
    can = set(dir(plugin(name).value()))
    for role, marks in ((CONTROLLER, {"step"}), (IDENTIFIER, {"update"}), (SURFACE, {"relax"})):
        if marks <= can:
            return role
    raise InputError(
        f"{name} is no part: a controller has start and step, a surface start, force, relax and free, an identifier "
        "update and estimate"
    )


def check_protocol(role: Role, part: Any, name: str) -> None:
    """Refuses a class that is no part of this role, before it is made.

    Args:
        role: what it is to be.
        part: a class.
        name: by which the user knows it.

    Raises:
        InputError: not a class, not a NamedTuple where it is compiled, a method missing or with other arguments.
    """
    a = f"{'an' if role.key[0] in 'aei' else 'a'} {role.key}"
    if not inspect.isclass(part):
        raise InputError(f"{name} is a {type(part).__name__}; {a} is a class")
    if role.compiled and not (issubclass(part, tuple) and hasattr(part, "_fields")):
        raise InputError(f"{name} is no NamedTuple; {a} is one: class {part.__name__}(NamedTuple)")
    if role is SURFACE and not hasattr(part, "mass"):
        raise InputError(f"{name} has no mass [kg]; a surface states it: give it a field 'mass: float = 0.0'")
    for method, (arguments, result) in {**role.methods, **role.optional}.items():
        function, signature = (
            getattr(part, method, None),
            f"{method}(self{', ' if arguments else ''}{arguments})",
        )
        if function is None:
            if method in role.methods:
                raise InputError(f"{name} has no method {method}; {a} has {signature} -> {result}")
            continue
        try:
            inspect.signature(function).bind(None, *filter(None, arguments.split(", ")))
        except (TypeError, ValueError):
            got = inspect.signature(function) if callable(function) else "no function"
            raise InputError(f"{method} of {name} is {got}; it must be {signature} -> {result}") from None


def _kinds(part: Any, role: Role) -> dict[str, Any]:
    """The fields of a part and their types."""
    if role.compiled:
        hints = get_type_hints(part)
        return {name: hints.get(name, Any) for name in part._fields}
    parameters = inspect.signature(part).parameters.values()
    return {p.name: Any for p in parameters if p.kind in {p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY}}


def _field(known: Plugin, name: str, kind: Any) -> Any:
    if kind is Any:
        return Any
    if kind not in _FIELDS:
        type_name = getattr(kind, "__name__", str(kind))
        raise InputError(
            f"the field {name} of {known.name} is of type {type_name}; it may be float, int, bool or Vec3"
        )
    return _FIELDS[kind]


def _default(part: Any, role: Role, name: str) -> tuple[Any, ...]:
    if not role.compiled:
        value = inspect.signature(part).parameters[name].default
        return () if value is inspect.Parameter.empty else (msgspec.field(default_factory=lambda: value),)
    if name not in part._field_defaults:
        return ()
    value = part._field_defaults[name]
    return (tuple(map(float, value)) if isinstance(value, Vec3) else value,)


def _value(value: Any, kind: Any) -> Any:
    """Convert a value to the field's type: an integer would be another type to the compiler."""
    if kind is Vec3:
        return alike(value) if isinstance(value, int | float) else triple(value)
    return float(value) if kind is float else value
