"""Answer about a controller of others: lines for a terminal, and a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from palpate.force.describe import UNCOVERED as CASES
from palpate.force.describe import bounds
from palpate.force.sliding.slide_proof import slide_proof
from palpate.force.tuning import RIGID, surface_ends
from palpate.report.chart import KNOWN, Band, Chart, Mark, Series, panels
from palpate.report.page import Card, Extent, PageAnswer, answer_page, log_scale
from palpate.text import printable
from palpate.units import quantity
from palpate_certify.controller_file import UNCOVERED, ControllerVerdict
from palpate_certify.delayed_contact import DelayedContact

if TYPE_CHECKING:
    from palpate.force import Certificate
    from palpate.force.certificate import CertificateVerdict

DELAYS = np.geomspace(0.25, 4.0, 33)
"""Of the delay, for which the edge is drawn."""


def lines(answer: dict[str, Any], written: Sequence[Path] = ()) -> Iterator[str]:
    """The answer, a line each."""
    proved, better = answer["proved"]["stiffness"], answer["corrected"]
    yield sentence(answer)
    yield f"Proved stable: {_span(*proved)}." if proved else "Nothing could be proved."
    place = f"   written: {', '.join(map(str, written))}" if written else ""
    if better is None:
        yield f"No numbers of this controller were found that are stable on the surfaces asked for.{place}"
        return
    most = "any stiffness" if better["exact"][1] is None else quantity(better["exact"][1], "N/m")
    what = ", ".join(better["changed"]) + (place or "; --out writes them")
    what = what if better["changed"] else f"none is needed{place}"
    yield f"Corrected for {_span(*better['stiffness'])} (unstable from {most}): {what}"


def sentence(answer: dict[str, Any]) -> str:
    """From where on it is unstable."""
    first, delay = answer["first_unstable"], quantity(answer["delay_s"], "s")
    if first is None:
        return f"Stable on every surface, with a delay of {delay}."
    if first["stiffness"] == 0.0:
        return f"Unstable without contact ({first['axis']}), with a delay of {delay}."
    return f"Unstable from {quantity(first['stiffness'], 'N/m')} ({first['axis']}), with a delay of {delay}."


def _span(low: float, high: float) -> str:
    return f"{quantity(low, 'N/m')} to {quantity(high, 'N/m')}"


def page(verdict: ControllerVerdict, path: Path, command: str) -> str:
    """The page of `palpate certify FILE --controller ... --report`; `command` is what made it."""
    answer = verdict.answer
    longest = answer["damping_times_s"][-1]
    damping = (
        f"surfaces with B/K of 0 to {quantity(longest, 's')}, in {len(answer['damping_times_s'])} steps"
        if longest
        else "surfaces without damping"
    )
    return answer_page(
        PageAnswer(
            title=f"{path.name} as {answer['controller']}",
            sentence=sentence(answer),
            about=f"One axis at a time, everything that is late in one delay of {quantity(answer['delay_s'], 's')}, on "
            f"{damping}. Asked for: up to {quantity(answer['asked'], 'N/m')}.",
            cards={"": _cards(answer)},
            scale=_scale(answer),
            figures=[
                {
                    "panels": panels([edge_chart(verdict)]),
                    "caption": "From which stiffness on the first axis is unstable, by the delay. Dashed: the delay "
                    "given, and the stiffest surface asked for.",
                }
            ],
            folds=[
                (
                    "Every axis",
                    "unstable from",
                    [(name, _from(end)) for name, end in answer["axes"].items()],
                ),
                ("Not covered", f"{len(UNCOVERED)} cases", [(text,) for text in UNCOVERED]),
            ],
            source=("The file with corrected numbers", verdict.text) if answer["corrected"] else ("", ""),
        ),
        room="certify",
        command=command,
    )


def _from(end: float | None) -> str:
    return "never" if end is None else quantity(end, "N/m")


def _cards(answer: dict[str, Any]) -> list[Card]:
    proved, better, asked = answer["proved"]["stiffness"], answer["corrected"], answer["asked"]
    far = proved is not None and proved[1] >= asked
    number, _, unit = quantity(proved[1], "N/m").rpartition(" ") if proved else ("", "", "")
    cards = [
        Card(
            "Stable, proved, up to", number, unit, why="as the file stands",
            tone="ok" if far else "fail", verdict="as far as asked" if far else "not as far as asked",
        )
    ]  # fmt: skip
    if better is None:
        why = "no numbers of this controller were found that are stable on the surfaces asked for"
        return [*cards, Card("Corrected", why=why, tone="fail", verdict="none")]
    number, _, unit = quantity(better["stiffness"][1], "N/m").rpartition(" ")
    changed = ", ".join(better["changed"]) or "nothing has to be changed"
    return [
        *cards,
        Card("Corrected, proved up to", number, unit, why=changed, tone="ok", verdict="proved"),
    ]


def _scale(answer: dict[str, Any]) -> Any:
    proved, better = answer["proved"]["stiffness"], answer["corrected"]
    extents = [
        Extent(name, 0.0, inf if end is None else end, "exact", f"unstable from {_from(end)}")
        for name, end in answer["axes"].items()
        if end != 0.0
    ]
    for name, ends in (("as it stands", proved), ("corrected", better and better["stiffness"])):
        if ends:
            low, high = ends
            extents.append(Extent(f"proved, {name}", low, high, "proved", f"to {quantity(high, 'N/m')}"))
    if not extents:
        return None
    caption = "The dashed line is the stiffest surface asked for; at an arrowhead nothing bounds it."
    return log_scale("Where it is stable", caption, "N/m", extents, answer["asked"])


def edge_chart(verdict: ControllerVerdict) -> Chart:
    """The edge of the first axis by the delay, as the file stands and corrected."""
    answer = verdict.answer
    delays, asked, given = answer["delay_s"] * DELAYS, 1e-3 * answer["asked"], 1e3 * answer["delay_s"]
    loops = ((verdict.before, "as it stands", "F"), (verdict.after, "corrected", "measured"))
    series = [
        Series(
            1e3 * delays, np.array([1e-3 * _edge_at(loop, float(delay)) for delay in delays]), colour, name
        )
        for loop, name, colour in loops
        if loop is not None
    ]
    bands, marks = [Band(asked, asked, **KNOWN)], [Mark([(given, given)], "ink")]
    chart = Chart("unstable from [kN/m]", series, bands, marks, x="delay [ms]", log="y", height=2.9)
    low, high = np.log10(chart.range)
    return replace(chart, ylim=(10.0 ** np.floor(low), 10.0 ** np.ceil(high)))


def _edge_at(loop: DelayedContact, delay: float) -> float:
    """Stiffness from which a loop is unstable with another delay [N/m]; not a number where none or all are."""
    found = replace(loop, delay=delay).first_unstable()
    return found if isfinite(found) and found > 0.0 else float("nan")


def proof_lines(
    certificate: Certificate, verdict: CertificateVerdict, written: Path | None = None
) -> Iterator[Text]:
    """A certificate: whether it holds, and the surfaces that each of its claims covers, a line each."""
    gains, place = certificate.gains, f"   written: {written}" if written else ""
    if not certificate.claims:
        yield Text("✕ Nothing could be proved.", "bold red")
    elif verdict.holds:
        title = (
            f"✓ The certificate holds: {verdict.cells} cells, each contracts by more than its rounding error."
        )
        yield Text(title, "bold green").append(printable(place), "default")
        yield Text(f"Stable on surfaces with K + B/theta (theta {1e3 * gains.theta:.2g} ms) of")
    else:
        yield Text(printable(f"✕ The certificate does not hold: {verdict.why}."), "bold red")
    for i, claim in enumerate(certificate.claims):
        if claim.kind == "held" and i > 0:
            continue  # that of a slide, below
        low, high = surface_ends(gains.arm, claim.low, claim.high)
        times, span = "", _stretch(low, high)
        if claim.kind == "one-sided":
            span = (
                f"up to {quantity(high, 'N/m')}, over gaps of up to {quantity(gains.force / claim.low, 'm')}"
            )
        elif claim.kind == "adapting":
            least, most = bounds(claim, gains)
            end = f" to {most:.3g}" if isfinite(most) else " and more"
            times = (
                f", K_u {least:.3g}{end} times theirs, readings {claim.ages[0]} to {claim.ages[1]} ticks old"
            )
            span = "any stiffness" if gains.arm.kind == "position" else span
        if claim.kind != "adapting" and claim.shares[1] > 1.0:
            times = f", at up to {claim.shares[1]:g} times the gain"
        damping = f"; B/K up to {quantity(claim.most, 's')}" if claim.most else "; B = 0"
        yield Text(f"  {_CLAIMS[claim.kind]:24}{span}{times}{damping}")
    if (slide := slide_proof(certificate)) is not None:
        ends, (least, most) = slide["felt_stiffness"], slide["gain_factor"]
        span = "no surface" if ends is None else _stretch(*surface_ends(gains.arm, *ends))
        off = (
            f"normal off by up to {slide['angle_deg']:g}\N{DEGREE SIGN}, friction up to {slide['friction']:g}"
        )
        yield Text(f"  {'slide':24}{span}, {off}, both changing (gain x {least:.2g} to {most:.3g}); B = 0")
    yield Text(f"Not covered: {len(CASES)} cases, which --verbose lists.")


_CLAIMS = {"held": "constant gain", "one-sided": "contact lost and found", "adapting": "adapting gain"}


def _stretch(low: float, high: float) -> str:
    end = "up" if high >= RIGID else f"to {quantity(high, 'N/m')}"
    return f"{quantity(low, 'N/m')} {end}"
