"""A tuned force loop: its lines on a terminal, its page, its views in Python and in a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from palpate.force.describe import UNCOVERED, claim_scope, claim_title
from palpate.force.expected import BAND, OVERSHOOT, STIFFENING_AT, settling_bound, stiffening
from palpate.force.tuning import RIGID, Tuning
from palpate.report.chart import KNOWN, Band, Chart, Mark, Series, build_figure, panels
from palpate.report.page import Answer, Table, answer_page
from palpate.text import print_hanging, printable
from palpate.units import plain, quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console


def rows(tuning: Tuning) -> list[tuple[str, str]]:
    """Results as pairs of name and value."""
    gains, arm = tuning.gains, tuning.gains.arm
    slowest = _slowest(tuning)
    (low, high), at = tuning.exact, tuning.margins
    pairs = [
        ("arm", f"{arm.title} ({arm.kind}, {arm.rate:g} Hz)"),
        ("lag theta", f"{1e3 * gains.theta:.3g} ms"),
        ("force", f"{gains.force:g} N"),
        ("stiffest surface", f"{gains.cap:.4g} N/m (K + B/theta)"),
        ("gain on it", f"{1e3 * gains.gain:.4g} mm/s per N"),
        ("approach", f"at most {1e3 * gains.approach:.3g} mm/s"),
        ("peak at touch", f"{tuning.peak:.4g} N predicted (no bound)"),
        ("F_max", _force_max(tuning)),
        ("settling", f"{slowest:.3g} s with known stiffness" if isfinite(slowest) else "-"),
        ("overshoot", f"{100 * tuning.overshoot:.2g} % with known stiffness"),
        ("margins", f"gain {at.gain:.3g}, phase {at.phase:.3g} deg, delay {1e3 * at.delay:.3g} ms"),
        ("stable, exact", f"{low:.4g} to {high:.4g} N/m with constant gain, B = 0"),
    ]
    pairs += [("first touches", _domain(tuning)), ("stiffening", _stiffening(tuning))]
    if tuning.known is not None:
        a, b = tuning.known.stiffness
        source = "given" if tuning.known.source == "told" else tuning.known.source
        pairs.append(("surface", f"{a:.4g} to {b:.4g} N/m ({source})"))
    proved = [f"{claim_title(c)}: {claim_scope(c, gains)}" for c in tuning.certificate.claims]
    return [*pairs, *(("proved", text) for text in proved or ["nothing"])]


def _domain(tuning: Tuning) -> str:
    if tuning.domain is None:
        return "noise hides a touch at the approach speed: overshoot and settling are not predicted"
    low, high = tuning.domain
    seconds = settling_bound(tuning.gains, high)
    return (
        f"{low:.4g} to {high:.4g} N/m: overshoot below {100.0 * OVERSHOOT:g} % in 99.9 %, settling below "
        f"{seconds:.3g} s + F/(K v_max) + 4 B/K in 99 %; softer surfaces are detected later"
    )


def _stiffening(tuning: Tuning) -> str:
    near, half = (stiffening(tuning.gains, tuning.steps[1], e) for e in STIFFENING_AT)
    return (
        f"a surface that stiffens in a press by more than {near:.2g} times while the force error is "
        f"{100.0 * STIFFENING_AT[0]:g} %, or {half:.2g} times half-way up, overshoots by over {100.0 * OVERSHOOT:g} %"
    )


def _force_max(tuning: Tuning) -> str:
    """Bound of the force on layers, and its price in time."""
    gains, price = tuning.gains, tuning.price
    if price is None:
        return "none: a hard surface behind a soft layer is met at the arm's speed (--force-max bounds the force)"
    cost = f"{1e3 * gains.speed:.3g} mm/s, which costs {price[0]:.2g} s"
    return f"at most {gains.force_max:g} N even on a hard layer, as the speed is at most {cost}; {tuning.soft_press}"


def build_answer(
    tuning: Tuning,
    inner: dict[str, object] | None = None,
    written: Sequence[object] = (),
    *,
    verbose: bool = False,
) -> Answer:
    """The answer of `palpate tune`.

    Args:
        tuning: the tuned loop.
        inner: the arm's inner loop, if a log of it was given.
        written: paths of the written files.
        verbose: whether a terminal shows everything.
    """
    json, slide = tuning.to_json() | {"inner_loop": inner}, ""
    if tuning.gains.slide is not None:
        from palpate.force.sliding.slide_domain import slide_json, slide_sentence

        json |= {"slide": slide_json(tuning.gains)}
        slide = f"Slide: {slide_sentence(tuning.gains)}."

    def display(console: Console) -> None:
        print_hanging([*lines(tuning, written), *([Text(slide)] if slide else [])], console)

    return Answer(
        json,
        f"Gains for {tuning.gains.arm.title}, {quantity(tuning.gains.force, 'N')}",
        sentence=tuning_sentence(tuning),
        tables=[Table("", ("", "value"), rows(tuning))],
        notes=[
            *(f"{code}: {text}" for code, text in tuning.warnings),
            *([slide] if slide else []),
            *([f"not covered by a proof: {'; '.join(UNCOVERED)}"] if verbose else []),
            *(f"written: {path}" for path in written),
        ],
        show=None if verbose else display,
    )


def lines(tuning: Tuning, written: Sequence[object] = ()) -> Iterator[Text]:
    """The answer, a line each."""
    gains, at = tuning.gains, tuning.margins
    places = f"   written: {', '.join(map(str, written))}" if written else ""
    title = f"Gains for {gains.arm.title}: {quantity(gains.force, 'N')}, surfaces up to {quantity(gains.cap, 'N/m')}."
    mark = Text("✓ proved stable", "green") if tuning.proved else Text("✕ nothing could be proved", "red")
    yield Text(printable(f"{title}   "), "bold").append(mark).append(printable(places))
    slowest = _slowest(tuning)
    touch = [
        f"at most {quantity(gains.approach, 'm')}/s",
        f"peak {quantity(tuning.peak, 'N')} on springs",
        f"settles in {slowest:.2g} s" if isfinite(slowest) else "does not settle",
        f"overshoot {100 * tuning.overshoot:.2g} %",
    ]
    yield Text(f"First touch: {', '.join(touch)}.")
    yield Text(f"F_max: {_force_max(tuning)}.")
    delay = f"{1e3 * at.delay:.3g} ms" if isfinite(at.delay) else "any"
    phase = f"{at.phase:.3g}°" if isfinite(at.phase) else "any"
    yield Text(f"Margins on the stiffest surface: gain × {at.gain:.2g}, phase {phase}, delay {delay}.")
    proved = tuning.surface_stiffness("held")
    if proved is not None:
        theta = f"(theta {1e3 * gains.theta:.2g} ms)"
        yield Text(f"Proved for surfaces with K + B/theta from {_span(*proved)} {theta}.")
    for name, assumed in (tuning.known.assumed if tuning.known else {}).items():
        value = f"{quantity(assumed.value, assumed.unit)} assumed" if isfinite(assumed.value) else "no bound"
        reason = {"damping": "B is unknown", "stiffness": "K of the surface alone is unknown"}.get(name, name)
        yield Text(printable(f"! {reason}: {value} ({assumed.why})."), "yellow")
    codes = dict.fromkeys(code for code, _ in tuning.warnings)
    if codes:
        yield Text(printable(f"Also noted: {', '.join(codes)} (--verbose explains each)."), "yellow")
    yield Text(f"Not proved: {len(UNCOVERED)} cases, which --verbose lists.")


def line(tuning: Tuning) -> str:
    """The arm, the force, and whether anything is proved."""
    proved = "proved" if tuning.proved else "nothing proved"
    return f"{tuning.gains.arm.title}, {tuning.gains.force:g} N, {proved}"


def page(tuning: Tuning, command: str = "palpate.force.tune(...).report(...)") -> str:
    """The page of `palpate tune --report`; `command` is what made it."""
    gains = tuning.gains
    answer = replace(
        build_answer(tuning),
        about=f"For surfaces up to {quantity(gains.cap, 'N/m')} (K + B/theta), with a lag theta of "
        f"{quantity(gains.theta, 's')}.",
        figures=[
            {"panels": panels([_stability_chart(tuning)]), "caption": _STABILITY},
            {"panels": panels([touch_chart(tuning)]), "caption": _touch_caption(tuning)},
        ],
        alerts=[{"tone": "warn", "title": code, "text": text} for code, text in tuning.warnings],
        tables=(),
        folds=[
            ("All numbers", "and the proof's own statements", rows(tuning)),
            ("Not proved", f"{len(UNCOVERED)} cases", [(text,) for text in UNCOVERED]),
        ],
        source=("The gains", gains.to_toml()),
    )
    return answer_page(answer, room="tune", command=command)


def tuning_sentence(tuning: Tuning) -> str:
    """The proof, the peak of a first touch, and its settling in words."""
    slowest = _slowest(tuning)
    proved = "Proved stable." if tuning.proved else "Nothing is proved."
    peak = f"The first touch peaks at {quantity(tuning.peak, 'N')}"
    settles = f", and settles within {quantity(slowest, 's')}" if isfinite(slowest) else ""
    layers = f" F_max: {_force_max(tuning)}." if tuning.price is not None else ""
    return f"{proved} {peak}{settles}.{layers}"


def _slowest(tuning: Tuning) -> float:
    return max(step.settling for step in tuning.steps)


_STABILITY = "Stiffness of the surface alone. Dashed: the stiffest surface for which the gains are made."


def _stability_chart(tuning: Tuning) -> Chart:
    """Every range of stiffness in a row: the known surface, the proofs, the exact limit of stability."""
    ranges = [] if tuning.known is None else [("this surface", "K", *tuning.known.stiffness)]
    for name, colour, kind in (
        ("proved, constant gain", "ok", "held"),
        ("proved, while the gain adapts", "s2", "adapting"),
    ):
        proved = tuning.surface_stiffness(kind)
        if proved is not None:
            every = kind == "adapting" and tuning.gains.arm.kind == "position"
            ranges.append((name, colour, *((0.0, RIGID) if every else proved)))
    ranges.append(("stable, exact, without damping", "measured", *tuning.exact))
    cap = tuning.gains.cap
    ends = [end for *_, low, high in ranges for end in (low, high) if 0.0 < end < RIGID] + [cap]
    lower, upper = 10.0 ** floor(log10(min(ends))), 10.0 ** ceil(log10(max(ends)) + 0.01)
    series = []
    for i, (name, colour, low, high) in enumerate(ranges):
        x, y = np.array([max(low, lower), min(high, upper)]), np.full(2, float(len(ranges) - i))
        label = "any" if low <= 0.0 and high >= RIGID else _span(low, high)
        series.append(Series(x, y, colour, f"{name}: {label}", 6.0))
    return Chart(
        "",
        series,
        marks=[Mark([(cap, cap)], "ink")],
        x="stiffness [N/m]",
        title="Where it is stable",
        xlim=(lower, upper),
        ylim=(0.5, len(ranges) + 0.5),
        log="x",
        height=1.9,
    )


def _span(low: float, high: float) -> str:
    end = "up" if high >= RIGID else f"to {quantity(high, 'N/m')}"
    return f"{quantity(low, 'N/m')} {end}"


def draw(tuning: Tuning) -> Figure:
    """The chart of the first touch as a figure."""
    return build_figure([touch_chart(tuning)])


def touch_chart(tuning: Tuning) -> Chart:
    """The force after the touch on the softest and on the stiffest surface."""
    force = tuning.gains.force
    looks = zip(tuning.steps, ("softest", "stiffest"), ("measured", "F"), strict=True)
    longest = max(step.settling if isfinite(step.settling) else 0.0 for step in tuning.steps)
    bands = [
        Band(force, force, label="desired", **KNOWN),
        Band(force * (1.0 - BAND), force * (1.0 + BAND), "measured"),
    ]
    return Chart(
        "force [N]",
        [Series(step.time, force * step.force, colour, name) for step, name, colour in looks],
        bands,
        x="time from the touch [s]",
        xlim=(0.0, max(2.5 * longest, 0.1)),
        ylim=(0.0, 1.15 * tuning.peak),
        height=2.9,
    )


def _touch_caption(tuning: Tuning) -> str:
    over = 100.0 * float(np.max([tuning.overshoot, 0.0]))
    return (
        f"First touch, known stiffness: overshoot at most {plain(over, 2)} %. Grey: within 5 % of the force."
    )
