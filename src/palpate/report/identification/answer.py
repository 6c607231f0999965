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
from palpate.report.identification import page as pages
from palpate.report.identification import words
from palpate.report.identification.page import budget_notes, budget_tables, facts, parameter_table
from palpate.report.page import Answer
from palpate.report.terminal import show_table
from palpate.signals.types import NORMAL
from palpate.text import print_hanging, printable
from palpate.units import NONE, plain, quantity, with_half

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_LINES = 14
"""Lines of an answer at most, to fit on a small terminal."""
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
    Code.NO_CONTACT,
    Code.FORCE_DROPS,
    Code.FORCE_FLOWS,
}


def show(
    result: Identification, name: str, console: Console, notes: Sequence[str] = (), end: str = ""
) -> None:
    """Print the answer in at most fourteen lines; the warnings that ask for a correction first.

    Args:
        result: what to print.
        name: of the log.
        console: where to; lines are wrapped at its width, but in a pipe or a file.
        notes: how the log was read, a sentence each.
        end: the last line.
    """
    printed = [*lines(result, name, notes), *([Text(printable(end))] if end else [])]
    if len(printed) > MAX_LINES:
        printed = [line for line in printed if line.plain]
    print_hanging(printed, console)


def build_answer(
    result: Identification,
    source: words.Source | None = None,
    evidence_options: str = "",
    *,
    verbose: bool = False,
    budget: bool = False,
) -> Answer:
    """The answer of `palpate identify` for one log.

    Args:
        result: what the log gives.
        source: the log; by default as Python knows it.
        evidence_options: options by which all evidence is shown.
        verbose: whether all evidence is printed.
        budget: whether the uncertainty budgets are.
    """
    source = source or _python_source(result)
    budgets = budget_tables(result) if budget else []
    budget_remarks = budget_notes(result) if budget else []

    def display(console: Console) -> None:
        show(
            result,
            source.title,
            console,
            source.notes,
            evidence_options and f"all evidence: {evidence_options}",
        )
        for table in budgets:
            show_table(console, table)
        for remark in budget_remarks:
            console.print(Text(remark), soft_wrap=True)

    file = {"file": source.file, "sha256": source.sha256}
    return Answer(
        {"files": [file], **words.as_json(result, source)},
        sentence="\n".join([words.sentence(result), *(facts(result, source.title) if verbose else [])]),
        tables=[parameter_table(result), *budgets],
        notes=[*words.reasons(result), *source.notes, *budget_remarks],
        show=None if verbose else display,
    )


def lines(result: Identification, name: str, notes: Sequence[str] = ()) -> Iterator[Text]:
    """The lines, with their styles."""
    for text in words.unit_warnings(result):
        yield Text(printable(f"! {text}"), style="bold yellow")
    for warn in result.warnings:
        if warn.code is Code.FORCE_DROPS:
            yield Text(printable(f"! {warn.text}."), style="bold yellow")
    point = result.working_point
    if result.slide is not None:
        yield Text(printable(f"{name}: {result.slide.sentence}"), style="bold")
        yield from (Text(printable(fact)) for fact in result.slide.facts)
        yield from _rows(result)
    elif not result.contacts or point is None:
        yield from _without_point(result, name)
    else:
        modulus = result.parameters.get("E")
        if modulus is not None:
            mark = _IN_DOUBT if words.unit_warnings(result) else _mark(modulus)
            yield from _head(modulus, "Young's modulus", name, f"{_sentence(modulus.reason)}.", mark)
            name = ""
        yield from _stiffness(result, name)
        yield Text("")
        yield from _rows(result)
        yield from _reasons(result)
        yield Text("")
        yield Text(printable(_contact(result)))
        if point.source == "press" and result.press is not None and len(result.press.tangent) > 1:
            yield Text(printable(" ".join(words.press_facts(result))))
        if result.lag is not None and result.lag.kind == "prior" and result.n:
            yield Text(_assumed_lag(result))
    yield from _foot(result, notes)


def _without_point(result: Identification, name: str) -> Iterator[Text]:
    """The reason for no stiffness at a working point, and the parameters if a model identifies one all the same."""
    if not result.contacts:
        title = words.no_contact_in(name, result)
        yield Text(printable(f"{title}."), style="bold")
        if title.startswith(words.UNTOUCHED.partition("in")[0]):
            yield Text(words.ADVICE[Code.NO_CONTACT])
        return
    if Code.FORCE_FLOWS.word in result.codes:
        yield Text(printable(f"{name}: {words.FLOWS}"), style="bold")
        yield from _rows(result)
        return
    lacking = "no stiffness without a model" if result.identified else "no stiffness"
    text = f"{name} shows {lacking}: no stretch in contact is long enough."
    yield Text(printable(text), style="bold")
    yield Text("Log longer, or press deeper.")
    if result.identified:
        yield from _rows(result)


def _stiffness(result: Identification, name: str) -> Iterator[Text]:
    point = result.working_point
    assert point is not None
    stiffness, title, place = point.stiffness, "stiffness", words.point_place(result, point)
    loss = stiffness.verdict is Verdict.NOT_IDENTIFIABLE and words.loss_words(result, point)
    if loss:
        place += f", beside {loss}"
    mark = _IN_DOUBT if words.unit_warnings(result) else _mark(stiffness)
    detail = _limit(place, words.limited_by(result))
    if words.behind_the_arm(result):
        title, mark = "stiffness of surface and arm in series", _BOUND_OF_SURFACE
        detail = f"{place}. The arm's own compliance is inside: give --robot-stiffness."
    elif point.differs:
        text = f"{words.each_press(point)}   stiffness of each press   "
        line = Text(text, style="bold").append("? they differ", style=words.STYLES[stiffness.verdict])
        yield line.append(printable(f"        {name}") if name else "")
        yield Text(printable(f"   {place}: {words.APART}."))
        return
    elif words.by_the_model(result):
        stiffness, title = result.parameters["K"], f"stiffness by the model {result.model}"
        mark = _IN_DOUBT if words.unit_warnings(result) else _mark(stiffness)
        detail = _limit(place, cause_of(next(iter(stiffness.budget), None)))
    elif stiffness.value is not None and stiffness.ci95 is not None and stiffness.ci95[1] < 0:
        detail = f"{place}: the force falls as the probe goes in. The surface yields, or the probe's support moves."
    elif stiffness.value is None:
        detail = f"{place}: {_sentence(stiffness.reason)}."
    yield from _head(stiffness, title, name, detail, mark)


def _limit(place: str, cause: Cause) -> str:
    return f"{place}. Limited by {cause.described}: {cause.remedy}."


def _head(p: Parameter, title: str, name: str, detail: str, mark: Text) -> Iterator[Text]:
    """The value with its name and verdict; below, its place and largest cause."""
    value = "no number" if p.value is None else words.full_number(p)
    line = Text(value, style="bold").append(f"   {title}   ").append(mark)
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


def _rows(result: Identification) -> Iterator[Text]:
    """A row for each parameter: interval, verdict, largest cause, remedy."""
    cells = [[Text(title) for title in ("", "95 %", "verdict", "limited by", "remedy")]]
    for name, p in result.parameters.items():
        if name != "E" and (name not in _MINOR or p.verdict is Verdict.IDENTIFIED):
            cells.append(_cells(name, p, result))
    widths = [max(cell.cell_len for cell in column) for column in zip(*cells, strict=True)]
    for row in cells:
        line = Text()
        for cell, width in zip(row, widths, strict=True):
            line.append(cell).append(" " * (width - cell.cell_len + 3))
        line.rstrip()
        yield line


def _reasons(result: Identification) -> Iterator[Text]:
    """Reasons of rejected parameters, each reason once."""
    names: dict[str, list[str]] = {}
    for name, p in result.parameters.items():
        if p.verdict is Verdict.REJECTED and name not in {*_MINOR, "E"}:
            names.setdefault(_sentence(p.reason), []).append(name)
    for reason, rejected in names.items():
        yield Text(printable(f"{', '.join(rejected)}: {reason}."))


def _cells(name: str, p: Parameter, result: Identification) -> list[Text]:
    bound = name == "K" and words.behind_the_arm(result)
    cause = next(iter(p.budget), "")
    limit = (
        f"lag, ± {plain(1e3 * _lag_half(result), 2)} ms"
        if cause == "lag" and result.lag
        else words.CAUSES.get(cause, cause)
    )
    remedy = "--robot-stiffness" if bound else _REMEDIES.get(cause, "")
    if p.verdict is not Verdict.NOT_IDENTIFIABLE:
        remedy = ""
    texts = (name, _interval(p, bound), "", limit, remedy)
    cells = [Text(printable(text)) for text in texts]
    cells[2] = _BOUND if bound else _mark(p)
    if words.unit_warnings(result) and p.verdict is Verdict.IDENTIFIED:
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


def _lag_half(result: Identification) -> float:
    return 0.0 if result.lag is None else result.lag.bound or NORMAL * result.lag.std


def _contact(result: Identification) -> str:
    """Time of the contacts, and the fraction of the force that the model explains."""
    count = len(result.contacts)
    span = f"{plain(result.contacts[0][0], 2)} to {plain(result.contacts[-1][1], 2)} s"
    start = f"{'One contact' if count == 1 else f'{count} contacts'}, {span}."
    if not result.n:
        return start
    K = result.parameters.get("K")
    if K is not None and K.verdict is Verdict.REJECTED:
        return f"{start} {_PARTS.get(result.model, result.model)} do not describe the force ({result.model})."
    explained = 100 * max(result.r2, 0.0)
    fraction = f"{explained:.3g} %" if explained < 99.95 else "more than 99.9 %"
    parts = _PARTS.get(result.model, result.model)
    return f"{start} {parts} explain {fraction} of the force ({result.model})."


def _foot(result: Identification, notes: Sequence[str]) -> Iterator[Text]:
    """The other warnings, and how the log was read."""
    shown_codes = {*_SHOWN_OTHERWISE, *words.UNIT_WARNINGS}
    other_codes = dict.fromkeys(warn.code.word for warn in result.warnings if warn.code not in shown_codes)
    if other_codes:
        yield Text(f"Also noted: {', '.join(other_codes)} (--verbose explains each).", style="yellow")
    read = next((note for note in notes if note.startswith("read as ")), None)
    if read is not None and Code.SIGNALS_GUESSED.word not in result.codes:
        yield Text(printable(f"R{read[1:]}"))


_ONE_CLOCK = (
    "If one A/D converter samples both channels unfiltered, give --lag 0:STD, where STD is the sample period."
)


def _assumed_lag(result: Identification) -> str:
    """The assumed lag in words: its interval, the gain of a calibration, the option for one clock of both channels."""
    lag = result.lag
    assert lag is not None
    text = f"The lag of the force sensor is assumed, {with_half(1e3 * lag.value, 1e3 * _lag_half(result))} ms"
    for name in ("B", "M"):
        p = result.parameters.get(name)
        if p is None or p.ci95 is None or next(iter(p.budget), "") != "lag":
            continue
        total = hypot(*p.budget.values())
        without_lag = sqrt(max(total**2 - p.budget["lag"] ** 2, 0.0))
        if without_lag:
            gain = plain(total / without_lag, 2)
            text += f": a calibration makes the {words.CALLED[name]}'s interval {gain} times narrower"
            break
    return f"{text}. {_ONE_CLOCK}"


def line(result: Identification) -> str:
    """The model, and each parameter with its verdict."""
    values = [f"{name} {_value(p)} {p.verdict}" for name, p in result.parameters.items()]
    return f"{result.model}; {', '.join(values)}"


def _value(p: Parameter) -> str:
    return "-" if p.value is None else words.full_number(p)


def draw(result: Identification) -> Figure:
    """The figure of `palpate identify`.

    Raises:
        InputError: its traces were left out.
    """
    if result.traces is None:
        raise InputError(
            "this identification holds no traces, as many logs' do not; identify its log alone to draw it"
        )
    return pages.draw(result, result.source)


def page(result: Identification) -> str:
    """The page of `palpate identify --report`."""
    return pages.page(result, _python_source(result))


def _python_source(result: Identification) -> words.Source:
    return words.Source(result.source, dict(result.options), command="palpate.identify(...).report(...)")
