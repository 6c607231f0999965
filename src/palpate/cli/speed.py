"""`palpate speed`."""

from __future__ import annotations

import json as json_format
import sys
from typing import Annotated

from cyclopts import Parameter


def speed(*, json: Annotated[bool, Parameter(negative=())] = False) -> int:
    """Measure what one tick of the closed loop costs here.

    Runs the experiment foam-hybrid several times: sensing, control, estimators, physics and recording.

    Args:
        json: Print one JSON object and nothing else on standard output.
    """
    from palpate.bench import build, load
    from palpate.bench.speed import measure

    found = measure(build(load("foam-hybrid")), waiting=_say_compiling)
    sys.stdout.write(json_format.dumps(found) + "\n" if json else _table(found))
    return 0


def _say_compiling() -> None:
    sys.stderr.write("palpate: compiling the loop: some ten seconds, once after installation\n")
    sys.stderr.flush()


def _table(found: dict[str, float]) -> str:
    return (
        f"one tick               {found['ns_per_tick'] / 1e3:10.2f} us\n"
        f"one run                {found['times_real_time']:10.0f} times real time\n"
        f"all cores ({found['cores']:3.0f})        {found['ticks_per_s']:10.3g} ticks/s\n"
    )
