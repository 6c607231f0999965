"""What an update of recursive least squares costs, against the cheapest call of a compiled function."""

import numba
import numpy as np
from stopwatch import best

from palpate.identifiers import RecursiveLeastSquares

SAMPLES = 20_000


@numba.njit
def nothing(state, phi, y, forgetting, limit):
    return True


def main() -> None:
    random = np.random.default_rng(0)
    for n in (3, 5):
        phi, y = random.standard_normal((SAMPLES, n)), random.standard_normal(SAMPLES)
        rows, forces = list(phi), [float(v) for v in y]
        estimator = RecursiveLeastSquares(np.zeros(n), 1e6 * np.eye(n), 0.999)
        state = np.zeros(100)

        def each(estimator=estimator, rows=rows, forces=forces):
            for row, force in zip(rows, forces, strict=True):
                estimator.update(row, force)

        def bare(state=state, rows=rows, forces=forces):
            for row, force in zip(rows, forces, strict=True):
                nothing(state, row, force, 0.999, 1.0)

        update, call = best(each) / SAMPLES, best(bare) / SAMPLES
        many = best(lambda e=estimator, p=phi, f=y: e.update_many(p, f)) / SAMPLES
        print(
            f"{n} parameters: update {1e9 * update:.0f} ns, {update / call:.1f} bare calls of {1e9 * call:.0f} ns; ",
            end="",
        )
        print(f"a sample of update_many {1e9 * many:.0f} ns")


if __name__ == "__main__":
    main()
