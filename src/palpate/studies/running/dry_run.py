"""One run of each case before a study's hundreds: what fails at once, fails before them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from palpate.bench.sequence import NO_CONTACT
from palpate.errors import InputError
from palpate.studies.definition.plan import MAIN, Plan, Setting
from palpate.studies.running.run_one import FAILED, REFUSED, Job, run_one

MANY = 100
"""Runs from which on each case is tried first."""
USELESS = {NO_CONTACT, REFUSED, FAILED}
"""Results that say nothing of what is studied."""


def check_cases(plan: Plan, waiting: Callable[[], None] | None = None) -> None:
    """Runs each case of a long study once.

    Args:
        plan: of the study.
        waiting: called when a loop has to be compiled first.

    Raises:
        InputError: a case touches nothing, is refused or fails; one line says which and why.
    """
    if len(plan) < MANY or plan.study.search is not None:
        return
    for name, setting in _cases(plan):
        row, _ = run_one(
            Job(setting, tuple(plan.study.metrics), plan.study.window, False, plan.plugins), waiting=waiting
        )
        if row.result in USELESS:
            raise InputError(
                f"the first run{name}, a try before {len(plan):,} runs, ends so: {row.why}; --yes does them all"
            )


def _cases(plan: Plan) -> Iterator[tuple[str, Setting]]:
    """The middle setting of each part for each of its cases."""
    for part in plan.parts:
        middle = {a.name: a.between(0.5) if a.drawn else a.settings[len(a.settings) // 2] for a in part.axes}
        own = "" if part.name == MAIN else f" of {part.name}"
        cases = next((a for a in part.axes if a.parameter.cases is not None), None)
        if cases is None:
            yield own, part.setting(0, middle, part.seeds[0], False)
            continue
        for value, label in zip(cases.settings, cases.labels(), strict=True):
            yield (
                f"{own} with {cases.name} {label}",
                part.setting(0, middle | {cases.name: value}, part.seeds[0], False),
            )
