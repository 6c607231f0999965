"""A tuned force loop: its lines on a terminal, its page, its views in Python and in a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.text import Text

from palpate.force.describe import UNCOVERED, sentence
from palpate.force.expected import BAND, OVERSHOOT, STIFFENING_AT, settling_bound, stiffening
from palpate.force.tuning import RIGID, Tuning
from palpate.report import page as pages
from palpate.report.chart import KNOWN, Band, Chart, Series, figure_of, panels
from palpate.text import print_hanging, printable
from palpate.units import plain, quantity, quantity_between

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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


def answer_of(
    told: Tuning, inner: dict[str, object] | None, written: Sequence[object], *, verbose: bool
) -> pages.CommandAnswer:
    """The answer of `palpate tune`.

    Args:
        told: the tuned loop.
        inner: the arm's inner loop, if a log of it was given.
        written: paths of the written files.
        verbose: whether a terminal shows everything.
    """
    json, slide = told.to_json() | {"inner_loop": inner}, ""
    if told.gains.slide is not None:
        from palpate.force.sliding.slide_domain import slide_json, slide_sentence

        json |= {"slide": slide_json(told.gains)}
        slide = f"Slide: {slide_sentence(told.gains)}."

    def display(console: Console) -> None:
        if verbose:
            show_all(told, console)
        else:
            show(told, console, written)
        for line in (*filter(None, [slide]), *(f"written: {path}" for path in written if verbose)):
            console.print(line, soft_wrap=True)

    return pages.CommandAnswer(json, show=display)


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


def line(told: Tuning) -> str:
    """The arm, the force, and whether anything is proved."""
    proved = "proved" if told.proved else "nothing proved"
    return printable(f"{told.gains.arm.title}, {told.gains.force:g} N, {proved}")


def text(told: Tuning) -> str:
    """Output of `palpate tune`."""
    return pages.console_text(lambda console: show(told, console))


def html(told: Tuning) -> str:
    """The same as a table."""
    table = [("", f"A force loop for {told.gains.arm.title}"), *rows(told)]
    return pages.as_html("Tuning", table, [text for _, text in told.warnings])


def page(told: Tuning, command: str = "palpate.force.tune(...).report(...)") -> str:
    """The page of `palpate tune --report`; `command` is what made it."""
    gains = told.gains
    answer = pages.PageAnswer(
        title=f"Gains for {gains.arm.title}, {quantity(gains.force, 'N')}",
        sentence=tuning_sentence(told),
        about=f"For surfaces up to {quantity(gains.cap, 'N/m')} (K + B/theta), with a lag theta of "
        f"{quantity(gains.theta, 's')}.",
        alerts=pages.warning_alerts(text for _, text in told.warnings),
        cards={"": _cards(told)},
        lower={"Margins on the stiffest surface": _margins(told)},
        scale=_scale(told),
        figures=[{"panels": panels([touch_chart(told)]), "caption": _touch_caption(told)}],
        folds=[
            ("All numbers", "and the proof's own statements", rows(told)),
            ("Not proved", f"{len(UNCOVERED)} cases", [(text,) for text in UNCOVERED]),
        ],
        source=("The gains", gains.to_toml()),
    )
    return pages.answer_page(answer, room="tune", command=command)


def tuning_sentence(told: Tuning) -> str:
    """Whether it is proved, how high a first touch goes, and how soon it settles."""
    bound, slowest = told.peak_bound, _slowest(told)
    proved = "Proved stable." if told.proved else "Nothing is proved."
    peak = f"The first touch peaks at {quantity(told.peak, 'N')}"
    below = f", by proof below {quantity(bound, 'N')}" if bound is not None else ""
    settles = f", and settles within {quantity(slowest, 's')}" if isfinite(slowest) else ""
    return f"{proved} {peak}{below}{settles}."


def _ends(low: float, high: float) -> str:
    """Both ends in three digits, each with its own unit: a bound is no value with an uncertainty."""
    return f"{quantity(low, 'N/m')} to {quantity(high, 'N/m')}"


def _slowest(told: Tuning) -> float:
    return max(step.settling for step in told.steps)


def _cards(told: Tuning) -> list[pages.Card]:
    gains, held = told.gains, told.surface_stiffness("held")
    number, _, unit = _ends(*held).rpartition(" ") if held else ("", "", "")
    cards = [
        pages.Card(
            "Stable, proved", number, unit, why="stiffness of the surface, with constant gain",
            tone="ok" if held else "fail", verdict="proved" if held else "nothing",
        ),
        pages.Card("Approach", plain(1e3 * gains.approach, 3), "mm/s", why="at most, before a force is felt"),
        pages.Card("Gain", plain(1e3 * gains.gain, 3), "mm/s per N", why="on the stiffest surface"),
    ]  # fmt: skip
    known = told.known
    if known is not None:
        number, _, unit = quantity_between(*known.stiffness, "N/m").rpartition(" ")
        why = "given" if known.source == "told" else f"from {known.source}"
        cards.append(pages.Card("Surface", number, unit, why=why, colour="K"))
    return cards


def _margins(told: Tuning) -> list[pages.Card]:
    at = told.margins
    cards = [pages.Card("Gain", f"× {plain(at.gain, 3)}", why="the gain may be so many times as high")]
    if isfinite(at.phase):
        cards.append(pages.Card("Phase", f"{at.phase:.0f}°", why="until it rings for ever"))
    if isfinite(at.delay):
        cards.append(
            pages.Card(
                "Delay", plain(1e3 * at.delay, 3), "ms", why="so much more lag before it rings for ever"
            )
        )
    return cards


def _scale(told: Tuning) -> dict[str, object]:
    """Every bound on one axis: stiffness of the surface itself."""
    extents = []
    if told.known is not None:
        low, high = told.known.stiffness
        extents.append(
            pages.Extent("this surface", low, high, "estimate", quantity_between(low, high, "N/m"))
        )
        if told.gains.cap > high:
            upper = quantity(told.gains.cap, "N/m")
            extents.append(
                pages.Extent(
                    "assumed for its damping", high, told.gains.cap, "assumed", f"K + B/theta up to {upper}"
                )
            )
    held, adapting = told.surface_stiffness("held"), told.surface_stiffness("adapting")
    if held is not None:
        extents.append(pages.Extent("proved, constant gain", *held, "proved", _ends(*held)))
    if adapting is not None and told.gains.arm.kind == "position":
        extents.append(
            pages.Extent("proved, while the gain adapts", 0.0, inf, "proved", "any constant stiffness")
        )
    elif adapting is not None:
        text = quantity_between(*adapting, "N/m")
        extents.append(pages.Extent("proved, while the gain adapts", *adapting, "proved", text))
    low, high = told.exact
    high = inf if high >= RIGID else high
    unstable = f"unstable from {quantity(high, 'N/m')}" if isfinite(high) else "never unstable"
    extents.append(pages.Extent("stable, exact, without damping", low, high, "exact", unstable))
    caption = "The dashed line is the stiffest surface that the gains are made for; at an arrowhead nothing bounds it."
    return pages.log_scale("Where it is stable", caption, "N/m", extents, told.gains.cap)


def draw(told: Tuning) -> Figure:
    """The chart of the first touch as a figure."""
    return figure_of([touch_chart(told)])


def touch_chart(told: Tuning) -> Chart:
    """The force after the touch on the softest and on the stiffest surface, and the proved bound of its peak."""
    force, bound = told.gains.force, told.peak_bound
    looks = zip(told.steps, ("softest", "stiffest"), ("measured", "F"), strict=True)
    longest = max(step.settling if isfinite(step.settling) else 0.0 for step in told.steps)
    bands = [
        Band(force, force, label="desired", **KNOWN),
        Band(force * (1.0 - BAND), force * (1.0 + BAND), "measured"),
        *([] if bound is None else [Band(bound, bound, "ink", "proved: below", 1.6)]),
    ]
    return Chart(
        "force [N]",
        [Series(step.time, force * step.force, colour, name) for step, name, colour in looks],
        bands, x="time from the touch [s]", xlim=(0.0, max(2.5 * longest, 0.1)),
        ylim=(0.0, 1.15 * max(bound or 0.0, told.peak)), height=2.9,
    )  # fmt: skip


def _touch_caption(told: Tuning) -> str:
    over = 100.0 * float(np.max([told.overshoot, 0.0]))
    return f"The first touch, its stiffness known: at most {plain(over, 2)} % over. Grey: within 5 % of the force."
