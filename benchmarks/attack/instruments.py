"""Logs, arms and options written from nothing, as instruments, makers of arms and no one would write them.

`grammar.dialect` edits one valid log; here every part is drawn by itself: notation, quotes, preamble, lengths of cells.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

Words = list[list[str]]
LONG = (10, 300, 5_000, 100_000)


def instrument(chance: random.Random, folder: Path) -> Words:
    """A text log: preamble, header, units, rows in one notation, and strange lines between them."""
    mark = chance.choice((",", ";", "\t", " ", "|"))
    notation, quotes = (
        chance.choice(("plain", "thousands", "german", "spaced", "exponent")),
        chance.random() < 0.3,
    )
    count, width = chance.choice((0, 1, 3, 40, 400)), chance.choice((1, 2, 3, 3, 3, 13, 200))
    lines = [_preamble(chance, mark) for _ in range(chance.choice((0, 0, 1, 5)))]
    lines += [mark.join(_name(chance) for _ in range(width)) for _ in range(chance.choice((0, 1, 1, 1, 2)))]
    lines += [mark.join(chance.choice(("mm", "N", "s", "", "(kN)", "V/V")) for _ in range(width))] * (
        chance.random() < 0.2
    )
    for k in range(count):
        cells = [_number(chance, k * (1.0 + 100 * i), notation) for i in range(width)]
        if chance.random() < 0.03:
            cells[chance.randrange(width)] = _word(chance)
        lines.append(mark.join(f'"{cell}"' if quotes or mark in cell else cell for cell in cells))
        if chance.random() < 0.02:
            lines.append(_strange(chance, mark))
    path = folder / chance.choice(("i.csv", "i.tsv", "i.lvm", "i.ddf", "i.txt"))
    path.write_text(
        chance.choice(("\n", "\r\n", "\r")).join(lines),
        encoding=chance.choice(("utf-8", "cp1252")),
        errors="replace",
    )
    asked = [
        f"--{role}={chance.choice((str(i), 'Force', 'x'))}"
        for i, role in enumerate(("time", "position", "force"))
    ]
    return [["topics", path.name], ["identify", path.name, *asked, "--json"]]


def _number(chance: random.Random, value: float, notation: str) -> str:
    value += chance.gauss(0, 1)
    match notation:
        case "thousands":
            return f"{value:,.{chance.randrange(5)}f}"
        case "german":
            return f"{value:,.3f}".translate(str.maketrans(".,", ",."))
        case "spaced":
            return f"{value:,.2f}".replace(",", " ")
        case "exponent":
            return f"{value:.3E}"
    return f"{value:.4f}"


def _word(chance: random.Random) -> str:
    long = chance.choice(LONG)
    return chance.choice((
        "", "MISSING", "OVER", "-3.697314E+28", "NaN", "1e999", "2020-02-30T10:00:00", "25:61:61", "#", "//", '"',
        "'", "-", "+", "1" * long, "." * long, "[" * long, "(" * long, "1," * 20, "0x1f", "\x00", "\x1b]0;x\x07",
        "1_000", "١٢٣", "True",
    ))  # fmt: skip


def _name(chance: random.Random) -> str:
    long = chance.choice(LONG[:3])
    names = (
        "Time", "Extension (mm)", "Load (N)", "Force", "x", "t", "fz", "z", "Q0", "", "1", "a:b", "[mm]",
        "x" * long, "[" * long,
    )  # fmt: skip
    return chance.choice(names)


def _preamble(chance: random.Random, mark: str) -> str:
    long = chance.choice(LONG)
    return chance.choice((
        "#", "%", "//", ";", "# made", "Sample rate: 1000 Hz", "Sampling interval (s) 0,001", "sampl" + "_" * long,
        "Rate" + mark + "100", "***End_of_Header***", "Channel\tForce\tPos", "Units\tN\tmm", "Scale\t1e308\t0",
        "Offset\tx\t1", "volts", mark * long, "sep=" + mark,
    ))  # fmt: skip


def _strange(chance: random.Random, mark: str) -> str:
    return chance.choice(
        ("", "#", "%", "//", ";", mark, mark * 1000, _word(chance), f"{_word(chance)}{mark}1{mark}2", '"open')
    )


def model(chance: random.Random, folder: Path) -> Words:
    """An arm of MJCF from nothing: a chain of bodies, with assets, sizes and numbers of any kind."""
    body = '<site name="tip"/>'
    for k in range(chance.choice((1, 2, 6, 60))):
        kind = chance.choice((*["hinge", "slide"] * 20, "ball", "free", "x"))
        joint = f'<joint name="j{k}" type="{kind}" axis="{_triple(chance)}"/>'
        inertia = f'<inertial pos="{_triple(chance)}" mass="{_size(chance)}" diaginertia="0.1 0.1 {_size(chance)}"/>'
        kind = chance.choice(("sphere", "box", "mesh", "hfield"))
        shape = f'<geom type="{kind}" size="{_size(chance)}"/>' * (chance.random() < 0.02)
        turn = f"{_size(chance)} 0 0 {_size(chance)}"
        body = f'<body pos="{_triple(chance)}" quat="{turn}">{joint}{inertia}{shape}{body}</body>'
    memory, rows, wide = (
        chance.choice(many) for many in (("-1", "1K", "10G", "9999999999G"), (1, 9, 40_000), (0, 9, 99_999))
    )
    extra = chance.choice(
        (
            *([""] * 6),
            f'<size memory="{memory}"/>',
            f'<option timestep="{_size(chance)}" gravity="{_triple(chance)}"/>',
            f'<asset><hfield name="h" nrow="{rows}" ncol="40000" size="1 1 1 1"/></asset>',
            f'<asset><texture name="t" type="2d" builtin="flat" width="{wide}" height="99999"/></asset>',
            "<default><default/></default>",
            '<keyframe><key qpos="1"/></keyframe>',
            '<statistic extent="nan"/>',
        )
    )
    path = folder / "made.xml"
    path.write_text(f"<mujoco>{extra}<worldbody>{body}</worldbody></mujoco>")
    return [["@arm", path.name]]


def _size(chance: random.Random) -> str:
    if chance.random() < 0.97:
        return chance.choice(("1", "0.1", "0.01"))
    return chance.choice(("0", "-1", "1e-300", "1e200", "1e308", "nan", "inf", "", "x"))


def _triple(chance: random.Random) -> str:
    plain = ("0 0 0.1", "0.1 0.1 0.1") if chance.random() < 0.98 else None
    return (
        chance.choice(plain) if plain else " ".join(_size(chance) for _ in range(chance.choice((2, 3, 3, 4))))
    )


GRAMMARS: dict[str, tuple[int, Callable[[random.Random, Path], Words]]] = {
    "logs of instruments": (12, instrument),
    "models of arms": (4, model),
}
"""By kind: its share of the inputs, and what makes one."""
