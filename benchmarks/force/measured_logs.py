"""What `palpate tune` says for measured logs of four laboratories, one row each.

    python benchmarks/force/measured_logs.py FOLDER [--arm ur5e] [--force 20]

FOLDER is what benchmarks/identification/measured.py takes. The adapting law, which no surface enters, is left out of
the proof. A log that gives no stiffness in N/m is refused, with the reason.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from palpate.errors import InputError
from palpate.force import known_from, load_arm, tune
from palpate.force.tuning import Tuning
from palpate.identification import identify
from palpate.logs import read_log

sys.path.append(str(Path(__file__).parents[1] / "identification"))
from measured import LOGS

HEAD = (
    "log",
    "stiffness [N/m]",
    "cap [N/m]",
    "approach [mm/s]",
    "settling, known [s]",
    "proved [N/m]",
    "warnings",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--arm", default="ur5e")
    parser.add_argument("--force", type=float, default=20.0)
    asked = parser.parse_args()
    arm = load_arm(asked.arm)
    print("| " + " | ".join(HEAD) + " |", "|---" * len(HEAD) + "|", sep="\n")
    for log in LOGS:
        path = asked.folder / log.path
        name = path.name + (" bonded" if log.told.get("bonded") else "")
        try:
            found = identify(read_log(path, **log.columns), **log.told)
            told = tune(arm, asked.force, known_from(found.to_json(), name), prove_adapting=False)
        except (InputError, OSError) as error:
            print(f"| {name} | refused: {error}" + " |" * (len(HEAD) - 1), flush=True)
            continue
        print("| " + " | ".join((name, *row(told))) + " |", flush=True)


def row(told: Tuning) -> tuple[str, ...]:
    """The cells of one log."""
    assert told.known is not None
    low, high = told.known.stiffness
    proved = told.surface_stiffness("held")
    slowest = max(step.settling for step in told.steps)
    return (
        f"{low:.4g} to {high:.4g}",
        f"{told.gains.cap:.4g}",
        f"{1e3 * told.gains.approach:.3g}",
        f"{slowest:.3g}",
        "nothing" if proved is None else f"{proved[0]:.3g} to {proved[1]:.4g}",
        ", ".join(code for code, _ in told.warnings) or "none",
    )


if __name__ == "__main__":
    main()
