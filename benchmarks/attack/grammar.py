"""Inputs by grammar: flags of each command, dialects of text, trees of TOML, JSON and XML, names of files.

Where `mutate` spoils bytes, a grammar spoils meaning: each input is well formed for most of its length, and reaches what
lies behind the parser. The same seed gives the same input.
"""

from __future__ import annotations

import contextlib
import copy
import io
import json
import math
import random
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import surroundings
from samples import FORCE, NAMES, PLACE, ROOT, SAMPLES, TIME, sources

import instruments

Words = list[list[str]]
"""Commands to run, in this order, in the folder of the input."""
COLUMNS = (f"--time={NAMES[0]}", f"--position={NAMES[1]}:mm", f"--force={NAMES[2]}:N")

NUMBERS = (
    *"""
    0 -0 1 -1 5 0.1 1e-3 1e3 1e6 1e12 1e150 1e300 1e308 -1e308 1.8e308 nan inf -inf 1e-320 5e-324 1e5000 0x10
    1_000 １２ --5 1,5 2147483648 9223372036854775808 -9223372036854775809 True None 1+1 1e . +
    """.split(),  # noqa: SIM905 - a list of so many words is unreadable
    *("9" * 400, "", " "),
)  # fmt: skip
UNITS = ("", "", ":N", ":mm", ":m", ":s", ":N/m", ":kg", ":Hz", ":%", ":furlong", ":", "::", ":1", "\n:N")
WORDS = (
    *"""
    x position_mm:mm force_N base tool auto csv both all 1 K K=1e308,B=-1 K=5000,B=50 K= = K=nan,B=nan K=5%
    sphere:5:mm sphere:1e308:m butterworth3:120 butterworth999999999:1 ur5e thesis fr33 a:b:c:d student:A
    os:system - -- -1 1:2 2:1 0:0 500:20000 1e-300:1e300 nan:nan 0,0,1 0,0,0 1e308,1e308,1e308 1,2 <script>
    [bold] $x^{$ ' {} %s%n 😀 None true
    """.split(),  # noqa: SIM905 - a list of so many words is unreadable
    *("\x1b[2J", "\u202egnp", '"', "\\", "\udcff", "a\nb", "ä" * 50, "x" * 5000, "[" * 3000, "(" * 3000,
    "*" * 100, "0" * 5000, ",".join("1" * 500)),
)  # fmt: skip
PLACES = (
    *"""
    . .. no/such/folder/x.json /dev/full /dev/null /proc/self/mem /proc/none/x out out.json out.toml out.html
    out.png out.csv out.parquet [1].json -o whole.csv link folder folder/x.html whole.csv/x ~ $HOME empty.csv
    """.split(),  # noqa: SIM905 - a list of so many words is unreadable
    *("x" * 300, "\udcff.png", "a\nb.html"),
)  # fmt: skip
COMMANDS: dict[str, tuple[int, tuple[str, ...]]] = {
    "identify": (6, ("whole.csv", *COLUMNS)),
    "topics": (2, ("whole.csv",)),
    "payload": (2, ("whole.csv", *COLUMNS)),
    "excite": (
        3,
        ("--stiffness=5000", "--damping=100", "--force=15", "--peak=20", "--duration=2"),
    ),
    "tune": (3, ("--arm=ur5e", "--force=10", "--stiffness=500:20000")),
    "certify": (3, ("gains.toml", "--held-only")),
    "export": (2, ("found.json", "--to=mjcf-spring", "--damping=50", "--mass=0.01")),
    "press": (1, ("--arm=ur5e", "--force=20:N", "--surface=K=5000,B=50", "--seconds=0.05", "--out=pressed")),
    "slide": (1, ("--arm=ur5e", "--surface=K=5000,mu=0.3", "--path=line", "--seconds=1", "--out=slid")),
    "map": (1, ("--table=whole.csv",)),
    "run": (1, ("foam-hybrid", "--print")),
    "study": (1, ("learning-rate", "--print")),
    "live": (1, ("--arm=fr33",)),
    "checks": (1, ("student:A",)),
    "completion": (1, ("bash",)),
    "speed": (1, ("--help",)),
}
"""How often each is attacked, and words with which it does its work; those that take minutes, with words that end it."""
NEVER = {"--yes", "--wire", "--scheduler", "--open", "--plugins"}
"""Flags that reach beyond the machine."""


def flags(chance: random.Random, folder: Path) -> Words:
    """A command with one to three options of its own, each with a value that it may not expect."""
    names = list(COMMANDS)
    name = chance.choices(names, [COMMANDS[one][0] for one in names])[0]
    words = list(COMMANDS[name][1])
    options = _options(name)
    for _ in range(chance.choice((1, 1, 2, 3))):
        flag, switch = chance.choice(options)
        own = [word for word in words if word.partition("=")[0] != flag]
        words = [*own, flag] if switch else [*own, f"{flag}={_value(chance)}"]
    if chance.random() < 0.1:
        words.insert(chance.randrange(len(words) + 1), _value(chance))
    if chance.random() < 0.05 and words:
        words.pop(chance.randrange(len(words)))
    return [[name, *words]]


@cache
def _options(command: str) -> list[tuple[str, bool]]:
    """The flags of a command, each with whether it is a switch."""
    from palpate.cli._program import program

    arguments = program()[command].assemble_argument_collection()
    return [
        (name, one.hint is bool)
        for one in arguments
        for name in one.names
        if name.startswith("--") and name not in NEVER and one.hint is not None
    ] or [("--help", True)]


def _value(chance: random.Random) -> str:
    kind = chance.randrange(10)
    if kind < 4:
        return chance.choice(NUMBERS) + chance.choice(UNITS)
    if kind < 5:
        return ":".join(chance.choice(NUMBERS) for _ in range(chance.choice((2, 3))))
    if kind < 6:
        return ",".join(chance.choice(NUMBERS) for _ in range(chance.choice((2, 3, 4))))
    return chance.choice(WORDS if kind < 8 else PLACES)


def dialect(chance: random.Random, folder: Path) -> Words:
    """A text log of some dialect: comments, headings, units, quotes, decimal commas, gaps, encodings, broken rows."""
    delimiter = chance.choice((",", ";", "\t", " ", "  ", "|", ", ", ":", "\x1f", ",,"))
    decimal = chance.choice((".", ".", ".", ","))
    mark, end = (
        chance.choice(("#", "%", "//", "", "!", "'", '"')),
        chance.choice(("\n", "\n", "\r\n", "\r", "\n\n")),
    )
    lines = [
        chance.choice((mark, f"{mark} made by", f"{mark}" * 500, "", "sep=;", "[", "{"))
        for _ in range(chance.choice((0, 0, 1, 3)))
    ]
    names = list(NAMES)
    if chance.random() < 0.3:
        names[chance.randrange(3)] = chance.choice((*WORDS, *NUMBERS))
    heads = chance.choice((0, 1, 1, 1, 2, 3))
    lines += [
        delimiter.join(chance.choice((names, ["s", "mm", "N"], names)) if i else names) for i in range(heads)
    ]
    rows = [
        [_cell(chance, value, decimal) for value in row] for row in zip(TIME, 1e3 * PLACE, FORCE, strict=True)
    ]
    for _ in range(chance.choice((0, 0, 1, 2, 10))):
        row = rows[chance.randrange(len(rows))]
        chance.choice((
            lambda r=row: r.__setitem__(chance.randrange(len(r)) if r else slice(0, 0), chance.choice((*NUMBERS, *WORDS))),
            lambda r=row: r.append("7"),
            lambda r=row: r.clear(),
            lambda r=row: r.__setitem__(0, chance.choice(("2024-01-01", "start", "12:00:01.5", "2024-13-45T99:99:99", "end", "#"))) if r else None,
            lambda r=row: r.__delitem__(slice(1, None)),
        ))()  # fmt: skip
    if chance.random() < 0.1:
        rows[0][:1] = [chance.choice(("start", "2024-01-01 00:00", "t0", "#", "", "NaT"))]
    lines += [delimiter.join(row) + chance.choice(("", "", "", delimiter)) for row in rows]
    data = end.join(lines).encode(
        chance.choice(("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1", "cp037")), "replace"
    )
    path = folder / chance.choice(("log.csv", "log.txt", "log.dat", "log.tsv", "log", "LOG.CSV"))
    path.write_bytes(data[: chance.randrange(len(data))] if chance.random() < 0.05 else data)
    asked = COLUMNS if chance.random() < 0.7 else ("--time=0", "--position=1:mm", "--force=2:N")
    more = chance.choice(((), (), (f"--delimiter={delimiter}",), ("--missing=-1",), ("--max-seconds=5",)))
    return [["topics", path.name], ["identify", path.name, *asked, *more, "--json"]]


def _cell(chance: random.Random, value: float, decimal: str) -> str:
    text = f"{value:.7g}".replace(".", decimal)
    return f'"{text}"' if chance.random() < 0.01 else text


def names(chance: random.Random, folder: Path) -> Words:
    """A log of a name that shells, globs, parsers or terminals take for something else."""
    parts = (
        "[1]", '["whole.csv"]', "-x", "--help", "a\nb", "$(id)", "{}", "%s", "\udcff\udcfe", "<b>", "'", "ä",
        "\x1b[2J", "*", "~", ".", " ", "x" * 200,
    )  # fmt: skip
    name = "".join(chance.choice(parts) for _ in range(chance.choice((1, 1, 2)))) + chance.choice(
        (".csv", "", ".CSV", ".txt")
    )
    (folder / "named").mkdir(exist_ok=True)
    path = folder / "named" / name  # of the name ".", the folder
    _copied(folder / "whole.csv", path)
    said = str(path) if chance.random() < 0.5 else f"named/{name}"
    more = chance.choice(
        (
            (),
            ("--report=r.html",),
            ("--figure=f.png",),
            ("--save-options=o.toml",),
        )
    )
    return [["topics", said], ["identify", said, *COLUMNS, *more]]


def _copied(source: Path, path: Path) -> None:
    try:
        path.write_bytes(source.read_bytes())
    except OSError:  # no such name on this file system
        source.exists()


LEAVES: tuple[Any, ...] = (
    0, 1, -1, 10**30, -(10**400), 0.0, -0.0, 1e-320, 1e150, 1e308, -1e308, math.nan, math.inf, -math.inf, True,
    False, "", "x", "\x1b[2J", "<script>alert(1)</script>", "student:A", "os:system", "x" * 5000,
    "../../etc/passwd", "ä😀\u202e", "*/ int x; /*", "1", "nan", [], [1], [[]], [1, "x"], [1e308] * 3, [0.0] * 3, {},
    {"kind": "x"}, {"a": {"b": {"c": 1}}}, [0] * 10000, None,
)  # fmt: skip


def edited(tree: Any, chance: random.Random) -> Any:
    """A tree of tables and lists after one to four changes: a value, a key, a branch."""
    tree = copy.deepcopy(tree)
    for _ in range(chance.choice((1, 1, 2, 4))):
        nodes = list(_nodes(tree))
        if not nodes:
            return tree
        holder, key = chance.choice(nodes)
        kind = chance.randrange(8)
        if kind < 5:
            holder[key] = copy.deepcopy(chance.choice(LEAVES))
        elif kind == 5:
            del holder[key]
        elif kind == 6 and isinstance(holder, dict):
            holder[chance.choice((f"{key}x", "", "a b", "\x1b", "ä", "kind", "x" * 300))] = holder.pop(key)
        else:
            holder[key] = _deep(holder[key], chance.choice((1, 3, 30, 60)))
    return tree


def _nodes(tree: Any) -> Any:
    if isinstance(tree, dict | list):
        for key, value in list(tree.items() if isinstance(tree, dict) else enumerate(tree)):
            yield tree, key
            yield from _nodes(value)


def _deep(value: Any, levels: int) -> Any:
    for level in range(levels):
        value = [value] if level % 2 else {"a": value}
    return value


def toml(value: Any) -> str:
    """A tree as TOML, inline from the second level on, however wrong it is."""
    if not isinstance(value, dict):
        return f"x = {_inline(value)}\n"
    return "".join(f"{json.dumps(key)} = {_inline(one)}\n" for key, one in value.items())


def _inline(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value).replace("inf", "inf") if math.isfinite(value) else str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {_inline(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, int):
        return _digits(value)
    return json.dumps("" if value is None else value)


def _digits(value: int) -> str:
    return str(value) if abs(value) < 10**4000 else "9" * 5000


def tree_of(kind: str) -> Callable[[random.Random, Path], Words]:
    """Edits of a valid file of that kind, and the commands that read it."""

    def make(chance: random.Random, folder: Path) -> Words:
        import tomllib

        name, ask = TREES[kind]
        source = (folder / name).read_text(encoding="utf-8")
        path = folder / f"edited{Path(name).suffix}"
        if path.suffix == ".json":
            text = json.dumps(edited(json.loads(source), chance))
        else:
            text = toml(edited(tomllib.loads(source), chance))
        if chance.random() < 0.05:
            text = text.replace("=", chance.choice(("==", "", ":")), 1).replace(
                ":", chance.choice((":", "", "::")), 1
            )
        path.write_text(text, encoding="utf-8", errors="replace")
        return [[word.replace("FILE", path.name) for word in ask]]

    return make


TREES: dict[str, tuple[str, tuple[str, ...]]] = {
    "arm of TOML": ("arm.toml", ("@arm", "FILE")),
    "force arm": ("forcearm.toml", ("tune", "--arm=FILE", "--force=10", "--stiffness=500:20000")),
    "options": ("options.toml", ("identify", "whole.csv", "--options=FILE", "--json")),
    "payload": ("payload.toml", ("identify", "whole.csv", *COLUMNS, "--payload=FILE", "--json")),
    "FOUND, exported": ("found.json", ("export", "FILE", "--to=mjcf-spring", "--damping=50", "--mass=0.01", "--out=o.xml", "--replace")),
    "FOUND, tuned": ("found.json", ("tune", "FILE", "--arm=ur5e", "--force=10")),
    "gains, certified": ("gains.toml", ("certify", "FILE", "--held-only", "--json")),
    "certificate, checked": ("certificate.json", ("certify", "--check", "FILE")),
    "experiment, edited": ("experiment.toml", ("@experiment", "FILE")),
    "study, edited": ("study.toml", ("@study", "FILE")),
}  # fmt: skip


def xml(chance: random.Random, folder: Path) -> Words:
    """A scene of MJCF or a URDF, its numbers, tags and references edited."""
    import re

    name = chance.choice(("scene.xml", "arm.urdf"))
    text = (folder / name).read_text(encoding="utf-8")
    for _ in range(chance.choice((1, 1, 2, 4))):
        kind = chance.randrange(6)
        if kind < 3:
            found = list(re.finditer(r'"([^"]*)"', text))
            at = chance.choice(found)
            text = (
                text[: at.start(1)]
                + chance.choice((*NUMBERS, "0 0 0", "1e308 1e308 1e308", "x", "../../x"))
                + text[at.end(1) :]
            )
        elif kind == 3:
            found = list(re.finditer(r"<[^?!]", text))
            at = chance.choice(found).start()
            text = text[:at] + chance.choice(XML) + text[at:]
        elif kind == 4:
            tags = list(re.finditer(r"<(/?)(\w+)", text))
            at = chance.choice(tags)
            text = (
                text[: at.start(2)]
                + chance.choice(("body", "joint", "link", "x", "include", "mesh", ""))
                + text[at.end(2) :]
            )
        else:
            begin = chance.randrange(len(text))
            text = text[:begin] + text[begin + chance.choice((1, 10, 100)) :]
    path = folder / f"edited{Path(name).suffix}"
    path.write_text(text, encoding="utf-8", errors="replace")
    return [["@arm", path.name]]


XML = (
    *('<include file="/etc/passwd"/>', '<include file="edited.xml"/>', "<!-- --", "<![CDATA[", "<body/>" * 300, "<body>" * 300),
    *('<replicate count="100000000" offset="1 0 0">', '<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>'),
    *('<asset><mesh name="m" file="/dev/zero"/></asset>', '<option timestep="0"/>', '<size memory="100G"/>', "&x;", "\x00", "\ufffe"),
    '<!DOCTYPE l [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
)  # fmt: skip

ARM = """<mujoco><worldbody><body name="a"><joint name="j1" type="hinge" axis="0 0 1" range="-3 3"/>
<geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.3"/><body name="b" pos="0 0 0.3"><joint name="j2" axis="0 1 0" range="-3 3"/>
<geom type="capsule" size="0.04" fromto="0 0 0 0 0 0.3"/><body name="c" pos="0 0 0.3"><joint name="j3" axis="0 1 0" range="-3 3"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.2"/><site name="tip" pos="0 0 0.2"/></body></body></body></worldbody></mujoco>
"""
URDF = """<robot name="r"><link name="base"/><link name="l1"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="l2"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="50" velocity="2"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0 0.3" rpy="0 1.5 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="50" velocity="2"/></joint></robot>
"""


def prepare(folder: Path) -> None:
    """The valid files that the grammars begin with; they are made once for the same sources."""
    kept = ROOT / "build" / f"attack-{sources()}"
    if not kept.is_dir():
        kept.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=kept.parent) as made:
            _make(Path(made, "inputs"))
            with contextlib.suppress(OSError):  # another process has made them meanwhile
                Path(made, "inputs").rename(kept)
    shutil.copytree(kept, folder, symlinks=True, dirs_exist_ok=True)


def _make(folder: Path) -> None:
    from importlib.resources import files

    folder.mkdir()

    for name, kind in (("whole.csv", "CSV"), ("gains.toml", "gains"), ("certificate.json", "certificate"),
                       ("experiment.toml", "experiment"), ("study.toml", "study")):  # fmt: skip
        SAMPLES[kind][1](folder / name)
    (folder / "arm.toml").write_text(files("palpate.robots.serial.arms").joinpath("ur5e.toml").read_text())
    (folder / "forcearm.toml").write_text(files("palpate.force.arms").joinpath("ur5e.toml").read_text())
    (folder / "options.toml").write_text(
        'time = "time_s"\nposition = "position_mm:mm"\nforce = "force_N:N"\nmodel = "kelvin-voigt"\nstart = 0.0\n'
        'max-size = 1.0\nmissing = ["-1"]\ntool-mass = "0.1"\n'
    )
    (folder / "payload.toml").write_text(_payload())
    (folder / "found.json").write_text(_found(folder))
    (folder / "scene.xml").write_text(ARM)
    (folder / "arm.urdf").write_text(URDF)
    (folder / "empty.csv").write_text("")
    (folder / "folder").mkdir(exist_ok=True)
    (folder / "link").symlink_to("link")


def _payload() -> str:
    """A payload's file, as palpate writes it."""
    numbers = {"mass": 0.5, "mass_std": 0.01, "weight_std": 0.1, "bias_std": 0.05, "noise": 0.1}
    vectors = {"weight": [0.0, 0.0, 4.9], "bias": [0.1, 0.2, 0.3]}
    return toml({**numbers, **vectors, "wrench_frame": "base"})


def _found(folder: Path) -> str:
    from palpate.cli import main

    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
        main(["identify", str(folder / "whole.csv"), *COLUMNS, "--json"])
    return said.getvalue()


GRAMMARS: dict[str, tuple[int, Callable[[random.Random, Path], Words]]] = {
    "flags": (24, flags),
    "text dialects": (12, dialect),
    "names of files": (4, names),
    "MJCF and URDF": (6, xml),
    **instruments.GRAMMARS,
    **surroundings.GRAMMARS,
    **{kind: (1 if kind == "FOUND, tuned" else 4, tree_of(kind)) for kind in TREES},
}
"""By kind: its share of the inputs, and what makes one."""
