"""Quantity, axis and device of a column by its name alone."""

import re
from dataclasses import dataclass
from functools import lru_cache

from palpate.units import known_unit, unit

OTHER_UNITS = {
    "v", "mv", "uv", "kv", "a", "ma", "ua", "w", "°c", "c", "degc", "k", "%", "hex", "hz", "khz", "mhz", "pa", "kpa",
    "mpa", "gpa", "bar", "mbar", "psi", "rpm", "db", "t", "mt", "ohm", "counts", "count", "raw", "bits", "j", "mj",
}  # fmt: skip
"""Units of quantities that no contact is identified from, in lower case."""
_BRACKETS = re.compile(r"[\[(<]\s*([^\[\]()<>]{1,12}?)\s*[\])>]\s*$|[,/]\s*([^\s,/:]{1,6})\s*$")
_TOKEN = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+|[^\W\d_a-zA-Z]+")
_OPAQUE = re.compile(
    r"(?:ch(?:an(?:nel)?)?|a[io]|ain|col(?:umn)?|var|val(?:ue)?s?|data|dev|sensor|signal|input|out|port|unnamed|field|"
    r"[a-zA-Z]{1,2}|[XYxy]_value|\d+)"
)
"""Tokens that say nothing of a quantity."""
_WORDS = {
    "other": (
        r"vel|veloc|speed|twist|qd+|dq|ddq|acc|accel|acceleration|gyro|mag|imu|jerk|freq|strain|stress|modul|energy|work|"
        r"power|pwm|curr|volt|temp(?!s$)|humid|pressure|druck|gain|bias|offset|std|var$|cov|error|err$|residual|rate|"
        r"stiff|damp|slope|battery|e[kcm]g|peak|max$|min$|omega|[vwag][xyz]$"
    ),
    "torque": r"torq|moment(?!um)|drehm|tau$|t[xyz]$|m[xyz]$|tq$",
    "orientation": r"quat|orient|rot|roll$|pitch$|yaw$|euler|angle|winkel|rpy$|r[xyz]$|q[xyzw]$|theta$|phi$|psi$",
    "joint": r"joint|q$|j$|gelenk|achse$",
    "force": (
        r"forc|load|[a-z]*kraft|fuerza|forza|força|last$|weight|gewicht|scale$|newton|effort|thrust|力|荷重|負荷|"
        r"f[nxyzrt]?$"
    ),
    "position": (
        r"pos(?!t$)|disp|dist|depth|indent|height|travel|stroke|extens|elong|[a-z]*weg$|hub$|lvdt|verschieb|verform|traverse|"
        r"deplac|déplac|desplaz|spostam|deform|crosshead|separation|penetr|place$|path$|gap$|zsn|zsensor|位移|変位"
    ),
    "time": (
        r"time|stamp|zeit|temps$|tiempo|tempo$|tout$|clock|elapsed|epoch|n?secs?$|seconds|nanosec|millis|micros"
    ),
}
"""Beginnings of tokens, by quantity, in the order in which they decide; `$` ends the token."""
_PATTERNS = {kind: re.compile(rf"(?:{words})") for kind, words in _WORDS.items()}
_BOOKKEEPING = re.compile(
    r"(?:seq|count|index|idx$|id$|status|state|mode$|flag|code$|bits?$|label|frame|trigger|event|segment|phase|steps?$|"
    r"cycle|button|digital|output|safety|program|runtime|samples?$|row$|line$|packet|number$|no$|nr$|valid|quality|"
    r"confidence|script|register)"
)
"""Tokens of a counter or of a state; a column of a force or a position may have them, too."""
_COMMAND = re.compile(
    r"(?:target|desired|des$|ref$|reference|setpoint|set$|sp$|cmd|command|goal|soll|demand|nominal|planned|piezo)"
)
_PLACE = re.compile(
    r"(?:tcp|tip|ee$|eef$|effector|end|tool|pose|p$|probe|hand$|flange|cart|trans|point|path|stage|robot|o$|x$)"
)
"""Tokens of the things whose place is meant by an axis alone, as in `tcp_x`."""
_SHORT = re.compile(r"\b(For|Mom)(?=[XYZ]$)")
"""Words for a force and a moment in front of their axis, as gait laboratories write them: `FP1.ForY`."""
_TRANSFORM = re.compile(r"(?:^|[._/])(?:O|F|EE|NE)_(?:T|F|ddP|dP)_[A-Za-z]")
"""Element of a matrix or a vector of a robot's state in Franka's notation, which only the whole has a meaning."""
_VECTOR = re.compile(
    r"(?:^|(?<=[._/ ]))(?:(wrench|pose|ft|f_ext|force_torque)[._\[]|(pos|position|forces?)[.\[])"
    r"(\d)\]?$",
    re.IGNORECASE,
)
"""Number of a list, as `wrench.2`, `pose[0]` and `ee.pos.1`."""
_TIME_MEMBER = re.compile(r"[._](?:time|timestamp)$", re.IGNORECASE)
"""Time of a structure or a sensor, as `tcp_force.time`."""
_LENGTH_LIMIT = 60
"""Longest name that is looked at: others are text."""


@dataclass(frozen=True)
class ColumnName:
    """Statements of a column's name.

    Args:
        kind: `time`, `position`, `force`, `torque`, `orientation`, `joint`; `other` for any other quantity, a counter
            or a state; None if the name says nothing, as `AI0` or `c1`.
        axis: `x`, `y`, `z` or `w`; empty without one.
        stem: the tokens without axis and unit, in lower case.
        command: the value is desired, not measured.
        worded: a word of the name says the kind, not a unit.
    """

    kind: str | None
    axis: str
    stem: tuple[str, ...]
    command: bool
    worded: bool = True


_QUANTITIES = {
    "time": "time",
    "length": "position",
    "force": "force",
    "torque": "torque",
    "angle": "orientation",
}


@lru_cache(maxsize=20_000)
def read_name(name: str, stated: str = "") -> ColumnName:
    """Read a column's name, and the unit that the file states for it; the unit decides between quantities."""
    plain, symbol = _part_unit(name[:_LENGTH_LIMIT])
    if _TRANSFORM.search(plain):
        return ColumnName("other", "", (), False)
    vector = _VECTOR.search(plain)
    if vector:
        return _component((vector[1] or vector[2]).lower(), int(vector[3]), plain[: vector.start()])
    plain = _SHORT.sub(lambda match: {"For": "Force", "Mom": "Moment"}[match[1]], plain)
    tokens = [token for token in _TOKEN.findall(plain) if token not in {"header", "field", "actual"}]
    lower = [token.lower() for token in tokens]
    ending = re.search(r"_([A-Za-z\u00b5\u03bc]{1,4})$", plain)
    suffix = ending[1] if ending and known_unit(ending[1]) else ""
    if "current" in lower and (_now(lower) or _quantity(suffix) in {"position", "force"}):
        lower.remove("current")
    kind = "time" if _TIME_MEMBER.search(plain) else _kind(lower)
    worded = kind is not None
    quantity = _quantity(stated or symbol)
    if not quantity and kind in {None, "time"} and suffix:  # AI0_mm; force_mN has a word
        quantity = _quantity(suffix)
    if kind is None or (quantity and quantity != "other" and kind != "other"):
        kind = quantity or kind
    axis, stem = _axis(lower)
    if kind is None and axis and (not stem or any(_PLACE.match(token) for token in stem)):
        kind = "position"
    counter = any(_BOOKKEEPING.match(token) for token in lower)
    if kind is None and (counter or not all(_OPAQUE.fullmatch(token) for token in lower)):
        kind = "other"
    return ColumnName(kind, axis, stem, any(_COMMAND.match(token) for token in lower), worded)


def _now(tokens: list[str]) -> bool:
    """True if a current value is the present one of a quantity, and no electric current."""
    kinds = ("force", "position", "orientation")
    return any(_PATTERNS[kind].match(token) for token in tokens for kind in kinds)


def _component(vector: str, place: int, device: str) -> ColumnName:
    """The name of one number of a list: of a wrench the force first, of a pose the position."""
    kinds = {"pose": ("position", "orientation"), "wrench": ("force", "torque")}
    whole = {"pos": "position", "position": "position", "force": "force", "forces": "force"}
    first, second = kinds.get(vector, kinds["wrench"]) if vector not in whole else (whole[vector], "other")
    if place > 5 or (place > 2 and second != "torque"):
        return ColumnName("other", "", (device, vector), False)
    kind = first if place < 3 else second
    return ColumnName(kind, "xyz"[place % 3], (device, vector, kind), bool(_COMMAND.search(device.lower())))


def _part_unit(name: str) -> tuple[str, str]:
    """A name without the unit in brackets or behind a comma or a slash; and that unit."""
    match = _BRACKETS.search(name.strip())
    symbol = (match[1] or match[2]) if match else ""
    if match is None or not (known_unit(symbol) or symbol.lower() in OTHER_UNITS):
        return name, ""
    return name.strip()[: match.start()], symbol


def _quantity(symbol: str) -> str | None:
    """Kind of column that a unit's quantity belongs to; None without a unit."""
    if not symbol:
        return None
    quantity = unit(symbol).quantity if known_unit(symbol) else "other"
    return None if quantity == "number" else _QUANTITIES.get(quantity, "other")


def _kind(tokens: list[str]) -> str | None:
    """Kind of column by the tokens of its name."""
    matches = [
        (kind, token) for kind, pattern in _PATTERNS.items() for token in tokens if pattern.match(token)
    ]
    kinds = [kind for kind, _ in matches]
    if any(_BOOKKEEPING.match(token) for token in tokens) and all(len(token) < 3 for _, token in matches):
        return "other" if matches else None
    if (
        not matches
        and tokens
        and tokens[0] in _TIME_ALONE
        and all(not t.isalpha() or known_unit(t) for t in tokens[1:])
    ):
        return "time"
    if {*kinds} == {"force", "position"}:  # the position of a load cell
        return max(matches, key=lambda match: tokens.index(match[1]))[0]
    if {*kinds} & {"torque", "orientation", "joint"} and "other" not in kinds:
        return next(kind for kind in kinds if kind in {"torque", "orientation", "joint"})
    return kinds[0] if kinds else None


_TIME_ALONE = {"t", "ts", "ms", "us", "ns"}
"""Names of a time that say nothing within a longer name."""


def _axis(tokens: list[str]) -> tuple[str, tuple[str, ...]]:
    """The axis that a name ends in or begins with, and the other tokens; `fx` is f along x."""
    for place in (len(tokens) - 1, 0):
        if tokens and tokens[place] in {"x", "y", "z", "w"}:
            return tokens[place], tuple(tokens[:place] + tokens[place + 1 :])
    for place in range(len(tokens) - 1, -1, -1):
        match = re.fullmatch(r"(f|t|m|p|q|r|pos|force|torque|tcp|ee)([xyzw])", tokens[place])
        if match:
            return match[2], (*tokens[:place], match[1], *tokens[place + 1 :])
    return "", tuple(tokens)
