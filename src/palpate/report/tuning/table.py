"""Output of `palpate tune` and `palpate certify`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from rich.text import Text

from palpate.force.describe import UNCOVERED, bounds, sentence
from palpate.force.expected import OVERSHOOT, STIFFENING_AT, settling_bound, stiffening
from palpate.force.sliding.slide_proof import slide_proof
from palpate.force.tuning import RIGID, Tuning, surface_ends
from palpate.report.numbers import quantity
from palpate.report.terminal import print_hanging
from palpate.text import printable

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from palpate.force import Certificate
    from palpate.force.certificate import Verdict


def rows(told: Tuning) -> list[tuple[str, str]]:
    """Results as pairs of name and value."""
    gains, arm = told.gains, told.gains.arm
    slowest = max(step.settling for step in told.steps)
    (low, high), at = told.exact, told.margins
    found = [
        ("arm", f"{arm.title} ({arm.kind}, {arm.rate:g} Hz)"),
        ("lag theta", f"{1e3 * gains.theta:.3g} ms"),
        ("force", f"{gains.force:g} N"),
        ("stiffest surface", f"{gains.cap:.4g} N/m (K + B/theta)"),
        ("gain on it", f"{1e3 * gains.gain:.4g} mm/s per N"),
        ("approach", f"at most {1e3 * gains.approach:.3g} mm/s"),
        ("peak at touch", _peak(told)),
        ("settling", f"{slowest:.3g} s with known stiffness" if isfinite(slowest) else "-"),
        ("overshoot", f"{100 * told.overshoot:.2g} % with known stiffness"),
        ("margins", f"gain {at.gain:.3g}, phase {at.phase:.3g} deg, delay {1e3 * at.delay:.3g} ms"),
        ("stable, exact", f"{low:.4g} to {high:.4g} N/m with constant gain, B = 0"),
    ]
    found += [("first touches", _domain(told)), ("stiffening", _stiffening(told))]
    if told.known is not None:
        a, b = told.known.stiffness
        source = "given" if told.known.source == "told" else told.known.source
        found.append(("surface", f"{a:.4g} to {b:.4g} N/m ({source})"))
    found += [("proved", sentence(c, gains)) for c in told.certificate.claims] or [("proved", "nothing")]
    return found


def _domain(told: Tuning) -> str:
    if told.domain is None:
        return "noise hides a touch at the approach speed: overshoot and settling are not predicted"
    low, high = told.domain
    seconds = settling_bound(told.gains, high)
    return (
        f"{low:.4g} to {high:.4g} N/m: overshoot below {100.0 * OVERSHOOT:g} % in 99.9 %, settling below "
        f"{seconds:.3g} s + F/(K v_max) + 4 B/K in 99 %; softer surfaces are detected later"
    )


def _stiffening(told: Tuning) -> str:
    near, half = (stiffening(told.gains, told.steps[1], e) for e in STIFFENING_AT)
    return (
        f"a surface that stiffens in a press by more than {near:.2g} times while the force error is "
        f"{100.0 * STIFFENING_AT[0]:g} %, or {half:.2g} times half-way up, overshoots by over {100.0 * OVERSHOOT:g} %"
    )


def _peak(told: Tuning) -> str:
    bound = told.peak_bound
    if bound is None:
        return f"{told.peak:.4g} N predicted (no bound)"
    return f"{told.peak:.4g} N predicted; at most {bound:.4g} N for K_u >= K, without noise and damping"


def show(told: Tuning, console: Console, written: Sequence[object] = ()) -> None:
    """Print the answer: the surfaces that the proof covers, the first touch, the margins, what is assumed."""
    print_hanging(lines(told, written), console)


def lines(told: Tuning, written: Sequence[object] = ()) -> Iterator[Text]:
    """The answer, a line each."""
    gains, at = told.gains, told.margins
    places = f"   written: {', '.join(map(str, written))}" if written else ""
    title = f"Gains for {gains.arm.title}: {quantity(gains.force, 'N')}, surfaces up to {quantity(gains.cap, 'N/m')}."
    mark = Text("✓ proved stable", "green") if told.proved else Text("✕ nothing could be proved", "red")
    yield Text(printable(f"{title}   "), "bold").append(mark).append(printable(places))
    slowest = max(step.settling for step in told.steps)
    bound = "" if told.peak_bound is None else f" (proved below {quantity(told.peak_bound, 'N')})"
    touch = [
        f"at most {quantity(gains.approach, 'm')}/s",
        f"peak {quantity(told.peak, 'N')}{bound}",
        f"settles in {slowest:.2g} s" if isfinite(slowest) else "does not settle",
        f"overshoot {100 * told.overshoot:.2g} %",
    ]
    yield Text(f"First touch: {', '.join(touch)}.")
    delay = f"{1e3 * at.delay:.3g} ms" if isfinite(at.delay) else "any"
    phase = f"{at.phase:.3g}°" if isfinite(at.phase) else "any"
    yield Text(f"Margins on the stiffest surface: gain × {at.gain:.2g}, phase {phase}, delay {delay}.")
    held = told.surface_stiffness("held")
    if held is not None:
        theta = f"(theta {1e3 * gains.theta:.2g} ms)"
        yield Text(f"Proved for surfaces with K + B/theta from {_span(*held)} {theta}.")
    for name, assumed in (told.known.assumed if told.known else {}).items():
        value = f"{quantity(assumed.value, assumed.unit)} assumed" if isfinite(assumed.value) else "no bound"
        why = {"damping": "B is unknown", "stiffness": "K of the surface alone is unknown"}.get(name, name)
        yield Text(printable(f"! {why}: {value} ({assumed.why})."), "yellow")
    codes = dict.fromkeys(code for code, _ in told.warnings)
    if codes:
        yield Text(printable(f"Seen, too: {', '.join(codes)} (--verbose explains each)."), "yellow")
    yield Text(f"Not proved: {len(UNCOVERED)} cases, which --verbose lists.")


def _span(low: float, high: float) -> str:
    end = "up" if high >= RIGID else f"to {quantity(high, 'N/m')}"
    return f"{quantity(low, 'N/m')} {end}"


def proof_lines(certificate: Certificate, verdict: Verdict, written: Path | None = None) -> Iterator[Text]:
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
        times, span = "", _span(low, high)
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
        span = "no surface" if ends is None else _span(*surface_ends(gains.arm, *ends))
        off = (
            f"normal off by up to {slide['angle_deg']:g}\N{DEGREE SIGN}, friction up to {slide['friction']:g}"
        )
        yield Text(f"  {'slide':24}{span}, {off}, both changing (gain x {least:.2g} to {most:.3g}); B = 0")
    yield Text(f"Not covered: {len(UNCOVERED)} cases, which --verbose lists.")


_CLAIMS = {"held": "constant gain", "one-sided": "contact lost and found", "adapting": "adapting gain"}


def show_all(told: Tuning, console: Console) -> None:
    """Print every figure, warning and case that no proof covers."""
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    for name, value in rows(told):
        table.add_row(name, value)
    console.print(table)
    for code, text in told.warnings:
        console.print(f"{code}: {text}")
    console.print("not covered by a proof: " + "; ".join(UNCOVERED))
