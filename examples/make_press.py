"""Make `data/press.csv`: a log such as a user would bring, from a press on simulated foam.

The arm presses between 10 and 20 N with a sine on top. Written down are the sensors' readings, not the truth, in
millimetres and newtons, from two seconds before the contact controller takes over.
The foam's truth: 5200 N/m, 200 N s/m, 0.1 kg.
"""

import csv
import sys
from pathlib import Path

import msgspec
import numpy as np

from palpate.bench import DesiredForce, Run, build, load


def main(path: Path) -> None:
    """Write the log."""
    experiment = msgspec.structs.replace(
        load("foam-hybrid"),
        run=Run(press=6.0),
        force=DesiredForce(first=10.0, second=20.0, period=1.0, amplitude=2.0, frequency=2.0),
    )
    record = build(experiment).run(experiment.run.duration, seed=7, press=experiment.run.press)
    contact = int(np.argmax(record["phase"] == 1.0))
    rows = slice(contact - 2000, None, 2)
    time = record["t"][rows] - record["t"][contact - 2000]
    position, force = 1e3 * record["x_measured"][rows], record["force_measured"][rows]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", "position_mm", "force_N"])
        writer.writerows(
            (f"{t:.3f}", f"{x:.4f}", f"{f:.3f}") for t, x, f in zip(time, position, force, strict=True)
        )
    print(f"{len(time)} rows in {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "data" / "press.csv")
