"""`palpate speed`: time of one tick of the closed loop on this machine."""

from typing import Annotated

from cyclopts import Parameter

from palpate.cli._program import print_answer
from palpate.cli._terminal import COMPILING, print_lines, say
from palpate.cli.options.common import WRITTEN


def speed(*, json: Annotated[bool, Parameter(negative="", group=WRITTEN)] = False) -> int:
    """Measure the time of one tick of the closed loop: sensors, estimators, controller and physics.

    palpate speed --json

    Parameters
    ----------
    json
        Print ns_per_tick, ticks_per_s, cores and times_real_time as JSON and nothing else.
    """
    from palpate.bench.speed import EXPERIMENT, STEPS, measure

    figures = measure(waiting=lambda: say(COMPILING))
    if json:
        print_answer(figures)
        return 0
    print_lines(
        f"one tick of {EXPERIMENT}, pressing and learning, {STEPS} steps of the physics included: "
        f"{figures['ns_per_tick'] / 1e3:.2f} us on one core",
        f"{figures['times_real_time']:.0f} times real time; {figures['ticks_per_s']:.3g} ticks a second "
        f"on all {figures['cores']} cores",
    )
    return 0
