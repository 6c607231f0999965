"""An identification in a few lines: the stiffness and what would narrow it, then a row for each parameter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, sqrt
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from palpate.errors import InputError
from palpate.identification.causes import Cause, Code, cause_of
from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification import details, figure, words
from palpate.report.identification import page as pages
from palpate.report.page import CommandAnswer, as_html, console_text
from palpate.signals.types import NORMAL
from palpate.text import print_hanging, printable
from palpate.units import NONE, plain, quantity, with_half

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 14
"""Lines of an answer, which a reader sees at once."""
_BOUND = Text("! lower bound", style="yellow")
_BOUND_OF_SURFACE = Text("! lower bound of the surface", style="yellow")
_IN_DOUBT = Text("? in doubt, see above", style="yellow")
_REMEDIES = {
    "lag": "--lag SECONDS",
    "low-pass": "--force-filter",
    "noise": "press deeper or more often",
    "other forces": "begin and end in free motion",
    "touch": "approach more slowly",
    "octaves": "excite a wider band",
    "blocks": "press longer, at one depth",
    "repetition": "press more often",
    "unexplained": "keep near one depth",
    "curvature": "press about one force",
    "position noise": "a finer position",
    "calibration": "calibrate both scales",
    "unseen way": "log faster, or --bonded",
    "Poisson's ratio": "--poisson",
}
"""Remedies by cause, in a few letters; --verbose has them in full."""
_CAUSES = {
    "other forces": "drift or friction",
    "blocks": "parts of the log differ",
    "repetition": "parts of the log differ",
    "loadings": "loadings differ",
    "octaves": "frequencies differ",
    "touch": "the touch",
    "unseen way": "the first reading",
}
"""Causes whose names in a budget need an explanation."""
_PARTS = {
    "kelvin-voigt": "Spring and damper",
    "kelvin-voigt-mass": "Spring, damper and mass",
    "standard-linear-solid": "A spring, and a spring and damper in series, together",
    "hunt-crossley": "A power law with damping",
    "quasi-linear-viscoelastic": "Tissue that stiffens and relaxes",
}
_MINOR = {"Fc", "x0"}
"""Parameters that stand in the answer only if they are identified."""
_SHOWN_OTHERWISE = {
    Code.LAG_DAMPING_CONFOUNDED,
    Code.LOW_EXCITATION,
    Code.SERIES_COMPLIANCE,
    Code.UNIT_GUESS,
    Code.NO_CONTACT,
}


def show(
    found: Identification, name: str, console: Console, notes: Sequence[str] = (), end: str = ""
) -> None:
    """Print the answer in at most fourteen lines; the warnings that ask for a correction first.

    Args:
        found: what to print.
        name: of the log.
        console: where to; lines are wrapped at its width, but in a pipe or a file.
        notes: how the log was read, a sentence each.
        end: the last line.
    """
    printed = [*lines(found, name, notes), *([Text(printable(end))] if end else [])]
    if len(printed) > MOST:
        printed = [line for line in printed if line.plain]
    print_hanging(printed, console)


def answer_of(
    found: Identification,
    source: words.Source,
    places: Sequence[str],
    more: str,
    *,
    verbose: bool,
    budget: bool,
) -> CommandAnswer:
    """The answer of `palpate identify` for one log.

    Args:
        found: what the log gives.
        source: the log.
        places: of the written files.
        more: options by which all evidence is shown.
        verbose: whether all evidence is printed.
        budget: whether the uncertainty budgets are.
    """

    def display(console: Console) -> None:
        if not verbose:
            show(found, source.title, console, source.notes, "   ".join([*places, f"all evidence: {more}"]))
        else:
            details.show(found, source.title, console)
            for line in (*source.notes, *places):
                console.print(line, soft_wrap=True)
        if budget:
            details.show_budgets(found, console)

    file = {"file": source.file, "sha256": source.sha256}
    return CommandAnswer({"files": [file], **words.as_json(found, source)}, show=display)


def lines(found: Identification, name: str, notes: Sequence[str] = ()) -> Iterator[Text]:
    """The lines, with their styles."""
    for text in words.unit_warnings(found):
        yield Text(printable(f"! {text}"), style="bold yellow")
    point = found.working_point
    if found.slide is not None:
        yield Text(printable(f"{name}: {found.slide.sentence}"), style="bold")
        yield from (Text(printable(fact)) for fact in found.slide.facts)
        yield from _rows(found)
    elif not found.contacts or point is None:
        title = f"{name} shows no stiffness: no stretch in contact is long enough"
        if not found.contacts:
            title = words.no_contact_in(name, found)
        yield Text(printable(f"{title}."), style="bold")
        if found.contacts:
            yield Text("Log longer, or press deeper.")
        elif title.startswith(words.UNTOUCHED.partition("in")[0]):
            yield Text(words.ADVICE[Code.NO_CONTACT])
    else:
        modulus = found.parameters.get("E")
        if modulus is not None:
            mark = _IN_DOUBT if words.unit_warnings(found) else _mark(modulus)
            yield from _head(modulus, "Young's modulus", name, f"{_sentence(modulus.reason)}.", mark)
            name = ""
        yield from _stiffness(found, name)
        yield Text("")
        yield from _rows(found)
        yield from _reasons(found)
        yield Text("")
        yield Text(printable(_contact(found)))
        if point.source == "press" and found.press is not None and len(found.press.tangent) > 1:
            yield Text(printable(" ".join(words.press_facts(found))))
        if found.lag is not None and found.lag.kind == "prior" and found.n:
            yield Text(_assumed_lag(found))
    yield from _foot(found, notes)


def _stiffness(found: Identification, name: str) -> Iterator[Text]:
    point = found.working_point
    assert point is not None
    own, what, at = point.stiffness, "stiffness", words.place_of(found, point)
    lost = own.verdict is Verdict.NOT_IDENTIFIABLE and words.loss_of(found, point)
    if lost:
        at += f", beside {lost}"
    mark = _IN_DOUBT if words.unit_warnings(found) else _mark(own)
    detail = _limit(at, words.limited_by(found))
    if words.behind_the_arm(found):
        what, mark = "stiffness of surface and arm in series", _BOUND_OF_SURFACE
        detail = f"{at}. The arm's own compliance is inside: give --robot-stiffness."
    elif point.differs:
        text = f"{words.each_press(point)}   stiffness of each press   "
        line = Text(text, style="bold").append("? they differ", style=words.STYLES[own.verdict])
        yield line.append(printable(f"        {name}") if name else "")
        yield Text(printable(f"   {at}: {words.APART}."))
        return
    elif words.by_the_model(found):
        own, what = found.parameters["K"], f"stiffness by the model {found.model}"
        mark = _IN_DOUBT if words.unit_warnings(found) else _mark(own)
        detail = _limit(at, cause_of(next(iter(own.budget), None)))
    elif own.value is not None and own.ci95 is not None and own.ci95[1] < 0:
        detail = (
            f"{at}: the force falls as the probe goes in. The surface yields, or the probe's support moves."
        )
    elif own.value is None:
        detail = f"{at}: {_sentence(own.reason)}."
    yield from _head(own, what, name, detail, mark)


def _limit(at: str, cause: Cause) -> str:
    return f"{at}. Limited by {cause.described}: {cause.remedy}."


def _head(p: Parameter, what: str, name: str, detail: str, mark: Text) -> Iterator[Text]:
    """The value, what it is and its verdict; below, what it belongs to."""
    value = "no number" if p.value is None else words.full_number(p)
    line = Text(value, style="bold").append(f"   {what}   ").append(mark)
    yield line.append(printable(f"        {name}") if name else "")
    yield Text(printable(f"{' ' * (len(value) + 3)}{detail}"))


def _sentence(reason: str) -> str:
    """A reason up to its first remedy or comment."""
    return (
        reason.partition("; ")[0].partition(": ")[0]
        if not reason.startswith("95 %")
        else reason.partition(". ")[0]
    )


def _mark(p: Parameter) -> Text:
    return Text(f"{words.MARKS[p.verdict]} {p.verdict}", style=words.STYLES[p.verdict])


def _rows(found: Identification) -> Iterator[Text]:
    """A row a parameter: its interval, verdict, largest cause, and what makes it narrower."""
    cells = [[Text(title) for title in ("", "95 %", "verdict", "limited by", "remedy")]]
    for name, p in found.parameters.items():
        if name != "E" and (name not in _MINOR or p.verdict is Verdict.IDENTIFIED):
            cells.append(_cells(name, p, found))
    widths = [max(cell.cell_len for cell in column) for column in zip(*cells, strict=True)]
    for row in cells:
        line = Text()
        for cell, width in zip(row, widths, strict=True):
            line.append(cell).append(" " * (width - cell.cell_len + 3))
        line.rstrip()
        yield line


def _reasons(found: Identification) -> Iterator[Text]:
    """Why a parameter is rejected, each reason once."""
    names: dict[str, list[str]] = {}
    for name, p in found.parameters.items():
        if p.verdict is Verdict.REJECTED and name not in {*_MINOR, "E"}:
            names.setdefault(_sentence(p.reason), []).append(name)
    for reason, own in names.items():
        yield Text(printable(f"{', '.join(own)}: {reason}."))


def _cells(name: str, p: Parameter, found: Identification) -> list[Text]:
    bound = name == "K" and words.behind_the_arm(found)
    cause = next(iter(p.budget), "")
    why = (
        f"lag, ± {plain(1e3 * _lag_half(found), 2)} ms"
        if cause == "lag" and found.lag
        else _CAUSES.get(cause, cause)
    )
    remedy = "--robot-stiffness" if bound else _REMEDIES.get(cause, "")
    if p.verdict is not Verdict.NOT_IDENTIFIABLE:
        remedy = ""
    texts = (name, _interval(p, bound), "", why, remedy)
    cells = [Text(printable(text)) for text in texts]
    cells[2] = _BOUND if bound else _mark(p)
    if words.unit_warnings(found) and p.verdict is Verdict.IDENTIFIED:
        cells[2] = Text("? in doubt", style="yellow")
    return cells


def _interval(p: Parameter, bound: bool) -> str:
    if p.value is not None and (bound or p.verdict is Verdict.IDENTIFIED):
        return words.full_number(p)
    if p.ci95 is None or p.verdict is Verdict.REJECTED:
        return NONE
    low, high = p.ci95
    if low < 0 < high and p.unit in {"N/m", "N s/m", "kg", "Pa", "1"}:
        return f"below {quantity(high, p.unit, digits=2)}"
    return words.interval(p.ci95, p.unit)


def _lag_half(found: Identification) -> float:
    return 0.0 if found.lag is None else found.lag.bound or NORMAL * found.lag.std


def _contact(found: Identification) -> str:
    """When it touched, and how much of the force the model explains."""
    count = len(found.contacts)
    span = f"{plain(found.contacts[0][0], 2)} to {plain(found.contacts[-1][1], 2)} s"
    start = f"{'One contact' if count == 1 else f'{count} contacts'}, {span}."
    if not found.n:
        return start
    K = found.parameters.get("K")
    if K is not None and K.verdict is Verdict.REJECTED:
        return f"{start} {_PARTS.get(found.model, found.model)} do not describe the force ({found.model})."
    explained = 100 * max(found.r2, 0.0)
    share = f"{explained:.3g} %" if explained < 99.95 else "more than 99.9 %"
    parts = _PARTS.get(found.model, found.model)
    return f"{start} {parts} explain {share} of the force ({found.model})."


def _foot(found: Identification, notes: Sequence[str]) -> Iterator[Text]:
    """The other warnings, and how the log was read."""
    shown = {*_SHOWN_OTHERWISE, *words.UNIT_WARNINGS}
    others = dict.fromkeys(warn.code.word for warn in found.warnings if warn.code not in shown)
    if others:
        yield Text(f"Seen, too: {', '.join(others)} (--verbose explains each).", style="yellow")
    read = next((note for note in notes if note.startswith("read as ")), None)
    if read is not None:
        yield Text(printable(f"R{read[1:]}"))


_ONE_CLOCK = "Where one converter samples both channels, unfiltered: --lag 0:STD, STD the time of a row."


def _assumed_lag(found: Identification) -> str:
    """That the lag is assumed, what a calibration of it is worth, and the option for one clock of both channels."""
    lag = found.lag
    assert lag is not None
    text = f"The lag of the force sensor is assumed, {with_half(1e3 * lag.value, 1e3 * _lag_half(found))} ms"
    for name in ("B", "M"):
        p = found.parameters.get(name)
        if p is None or p.ci95 is None or next(iter(p.budget), "") != "lag":
            continue
        whole = hypot(*p.budget.values())
        rest = sqrt(max(whole**2 - p.budget["lag"] ** 2, 0.0))
        if rest:
            text += f": a calibration makes the {words.CALLED[name]}'s interval {plain(whole / rest, 2)} times narrower"
            break
    return f"{text}. {_ONE_CLOCK}"


NAME = "a record"
HEAD = ("parameter", "value", "verdict", "why")


def line(found: Identification) -> str:
    """The model, and each parameter with its verdict."""
    values = [f"{name} {_value(own)} {own.verdict}" for name, own in found.parameters.items()]
    return printable(f"{found.model}; {', '.join(values)}")


def text(found: Identification) -> str:
    """The output of `palpate identify`; `report` has all evidence."""
    return console_text(lambda console: show(found, NAME, console))


def html(found: Identification) -> str:
    """The sentence, a row a parameter, and the warnings."""
    rows = [HEAD, *(_row(name, parameter) for name, parameter in found.parameters.items())]
    return as_html(words.sentence(found), rows, [f"{warn.code.word}: {warn.text}" for warn in found.warnings])


def _row(name: str, own: Parameter) -> tuple[str, ...]:
    return name, _value(own), str(own.verdict), own.reason


def _value(own: Parameter) -> str:
    return "-" if own.value is None else words.full_number(own)


def draw(found: Identification) -> Figure:
    """The figure of `palpate identify`.

    Raises:
        InputError: its traces were left out.
    """
    if found.traces is None:
        raise InputError(
            "this identification holds no traces, as many logs' do not; identify its log alone to draw it"
        )
    return figure.draw(found, NAME)


def page(found: Identification) -> str:
    """The page of `palpate identify --report`."""
    return pages.page(found, words.Source(NAME, found.options, command="palpate.identify(...).report(...)"))
