"""How often what `ContactIdentifier` calls identified holds the truth, on presses of a foreign simulator with faults.

    python benchmarks/online/contacts.py                   # 40 presses a fault: a minute
    python benchmarks/online/contacts.py --presses 200 --first 1000

The presses are those of `tests/identifiers/foreign_contacts.py`, NumPy alone; a fault at a time. A parameter that is
called identified holds if its 95 % interval does; it is confidently wrong if it is more than 25 % off, or more than
three half-widths and 2 %.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "identifiers"))
from foreign_contacts import FAULTS, Press, press

from palpate.identifiers import ContactIdentifier
from palpate.signals.types import Estimate

NAMES = ("M", "B", "K")


def identified(made: Press) -> Estimate:
    """What is known at the end of a press."""
    contact = ContactIdentifier(made.low_pass, made.rate, made.lag, sampling=made.sampling)
    contact.update_many(made.position, made.force)
    return contact.estimate()


def judged(made: Press, found: Estimate) -> dict[str, tuple[bool, bool, bool, float]]:
    """By parameter: identified, its interval holds the truth, confidently wrong; and its error in half-widths."""
    verdicts, out = found.verdicts(), {}
    for name in NAMES:
        i = found.names.index(name)
        value, half = float(found.theta[i]), 1.96 * float(found.std[i])
        low, high = made.truth[name]
        error = max(low - value, value - high, 0.0)
        scale = max(abs(low), 1e-12)
        wrong = error > 0.25 * scale or (error > 3 * half and error > 0.02 * scale)
        out[name] = verdicts[name] == "identified", error <= half, wrong, error / half if half else np.inf
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--presses", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="seed of the first press")
    parser.add_argument("--fault", choices=FAULTS)
    parser.add_argument("--show", action="store_true", help="each press that is wrong")
    asked = parser.parse_args()
    print(f"{'':18}" + "".join(f"{name + ': identified, hold, wrong':>30}" for name in NAMES) + "   refused")
    total = np.zeros(3)
    for fault in [asked.fault] if asked.fault else FAULTS:
        counts, refused = {name: np.zeros(3) for name in NAMES}, 0
        for seed in range(asked.first, asked.first + asked.presses):
            made = press(seed, fault)
            found = identified(made)
            refused += bool(getattr(found, "rejected", ""))
            for name, (known, holds, wrong, far) in judged(made, found).items():
                counts[name] += known * np.array([1, holds, wrong])
                if asked.show and known and not holds:
                    i = found.names.index(name)
                    half = 1.96 * found.std[i]
                    print(
                        f"   {seed} {name} {found.theta[i]:.5g} +- {half:.3g}, {far:.1f} half-widths off",
                        made.recipe,
                    )
        row = f"{fault:18}"
        for name in NAMES:
            known, holds, wrong = counts[name]
            total += counts[name]
            row += f"{int(known):>14}, {100 * holds / max(known, 1):5.1f} %, {int(wrong):4}"
        print(f"{row}   {refused}", flush=True)
    known, holds, wrong = total
    shares = (
        f"{100 * holds / max(known, 1):.1f} % hold, {100 * wrong / max(known, 1):.2f} % confidently wrong"
    )
    print(f"all: {int(known)} identified, {shares}")


if __name__ == "__main__":
    main()
