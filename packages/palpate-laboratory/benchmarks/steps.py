"""Whether a laboratory may be looked for with fewer steps of the physics than the figures have: how many verdicts turn.

python packages/palpate-laboratory/benchmarks/steps.py --laboratories 16
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np

from palpate_laboratory.judge import FINE
from palpate_laboratory.laboratory import laboratory_at
from palpate_laboratory.sampler import Settings, prior
from palpate_laboratory.sentences import sentences_of_search, verdicts
from palpate_laboratory.trial import STEPS, Trial
from palpate_laboratory.unknowns import UNKNOWNS


def main() -> None:
    """Of laboratories of the prior: verdicts with few steps, and with other noise, against the figures'."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--laboratories", type=int, default=16)
    count = asked.parse_args().laboratories
    points = prior(Settings(particles=count, first=1), len(UNKNOWNS))
    of = sentences_of_search(calibrating=False)
    verdicts(Trial(laboratory_at(points[0].tolist())), of)  # compiles, or reads what is compiled
    found = {}
    for steps, seed in ((FINE, 0), (FINE, 1), (10, 0), (STEPS, 0)):
        begun = time.process_time()
        found[steps, seed] = np.array(
            [verdicts(Trial(laboratory_at(p.tolist()), seed, steps), of) for p in points]
        )
        seconds = (time.process_time() - begun) / count
        turned = int((found[steps, seed] != found[FINE, 0]).sum())
        true = found[steps, seed].sum(axis=1).mean()
        print(
            f"{steps:2d} steps, noise {seed}: {seconds:.2f} s a laboratory, {true:.1f} of {len(of)} true, "
            f"{turned} of {found[FINE, 0].size} verdicts are others than with {FINE} steps, noise 0"
        )


if __name__ == "__main__":
    warnings.simplefilter("ignore", RuntimeWarning)
    main()
