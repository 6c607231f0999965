"""Lines of a terminal about another project's controller: what is claimed, then the axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from palpate.certify.controller_file import named, shown

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def answer_lines(answer: dict[str, Any], written: Path | None) -> list[str]:
    """The answer in lines.

    Args:
        answer: of `certify_controller`.
        written: corrected file; None without one.
    """
    source = answer["source"]
    lines = [
        f"{answer['controller']}, modelled from {source['file']} of {source['repository']}, {source['commit'][:12]}.",
        _claim(answer),
        *(line for node in answer["controllers"] for line in _node_lines(node)),
    ]
    lines += [f"Passed over: {text}." for text in answer["passed_over"]]
    if answer["unused"]:
        lines.append(f"Entries of the file that the model does not use: {named(answer['unused'])}.")
    if answer["corrected"] is not None:
        values = ", ".join(f"{shown(name)} {shown(value)}" for name, value in answer["corrected"].items())
        place = f"written to {written}" if written is not None else "--out FILE.yaml writes them"
        lines.append(
            f"Corrected, read back and judged again, overshoot at most 10 % on the surfaces that were tried: {values} "
            f"({place})."
        )
    else:
        lines.append(f"No corrected numbers: {answer['not_corrected_because']}.")
    return lines


def _claim(answer: dict[str, Any]) -> str:
    """The proof, the result of computation alone, and the limits of the model."""
    proved, exact = answer["proved"]["stiffness"], answer["exact"]["stiffness"]
    model = (
        "The model is one axis that presses a spring without damping. Not modelled: "
        f"{answer['not_modelled']}."
    )
    axes = [axis for node in answer["controllers"] for axis in node["axes"].values()]
    if all(axis["ranges"] is None for axis in axes):
        reasons = dict.fromkeys(axis["reason"] for axis in axes)
        return f"Nothing to prove, because no axis has a force loop: {'; '.join(reasons)}. {model}"
    claim = (
        f"Proved stable on surfaces of {span(proved)}, in exact arithmetic, for the delay and for one tick more"
        if proved
        else "Not proved"
    )
    stable = f"stable on {span(exact)}" if exact else "not stable on any surface"
    return (
        f"{claim}. Computed without a proof, by eigenvalues at {answer['exact']['points_per_decade']} stiffnesses a "
        f"decade from 1 N/m to 10 MN/m: {stable}. {model}"
    )


def _node_lines(node: dict[str, Any]) -> Iterator[str]:
    name = f"{node['node']}: " if node["node"] else ""
    yield f"{name}{node['rate_hz']:g} Hz, delay {node['delay_s'] * 1e3:g} ms, {node['interface']} interface."
    alike: dict[str, list[str]] = {}
    for axis, result in node["axes"].items():
        parts = []
        if result["ranges"]:
            parts.append("stable on " + " and ".join(span(r) for r in result["ranges"]))
        if result["proved"]:
            parts.append(f"proved on {span(result['proved'])}")
        if result["overshoot"] is not None:
            parts.append(f"overshoot up to {100 * result['overshoot']:.0f} %")
        alike.setdefault("; ".join([*parts, *filter(None, [result["reason"]])]), []).append(axis)
    yield from (f"  {', '.join(axes)}: {text}" for text, axes in alike.items())
    late = node.get("if_only_the_force_is_late")
    if late:
        exact = " and ".join(span(r) for r in late["exact"]) or "no surface"
        proved = f", proved on {span(late['proved'])}" if late["proved"] else ""
        yield f"  If the arm follows within a tick and only the force is late: stable on {exact}{proved}."
    if node["left_out"]:
        values = ", ".join(f"{name} {shown(value)}" for name, value in node["left_out"].items())
        yield f"  Not in the file, taken as: {values}."
    for note in node["notes"]:
        yield f"  Note: {note}."


def span(ends: tuple[float, float]) -> str:
    """An interval of stiffness, as 9.24 N/m to 8.82 kN/m."""
    return " to ".join(_stiffness(value) for value in ends)


def _stiffness(value: float) -> str:
    for factor, unit in ((1e6, "MN/m"), (1e3, "kN/m")):
        if value >= factor:
            return f"{value / factor:.3g} {unit}"
    return f"{value:.3g} N/m"
