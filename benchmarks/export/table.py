"""Errors in K and B of exported contacts that are pressed in the engines."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from export import scenes
from palpate.export import Request, contact_from, prepare


def main() -> None:
    """Print the table."""
    import mujoco

    argparse.ArgumentParser(description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = list(measured(Path(folder)))
    lines = [
        "| `--to` | probe | K [N/m] | error in K | B [N s/m] | error in B |",
        "|---|---|---|---|---|---|",
    ]
    table = "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
    note = f"MuJoCo {mujoco.__version__}, Drake {version('drake')}."
    print(f"{table}\n\n{note}")


def measured(folder: Path) -> Iterator[tuple[str, ...]]:
    """A row for each press."""
    slide, free = (scenes.SLIDE, "slide joint"), (scenes.FREE, "free joint")
    for mass, (joint, name) in ((0.5, slide), (2.0, free), (8.0, slide)):
        yield row(folder, "mujoco", f"sphere of {mass:g} kg, {name}", scenes.mjcf(folder, joint, mass=mass))
    pyramid = 'cone="pyramidal" timestep="0.001"'
    yield row(folder, "mujoco", "the same of 2 kg, pyramidal cone", scenes.mjcf(folder, options=pyramid))
    yield row(
        folder, "mujoco", "capsule of 2 kg, lying: two points", scenes.mjcf(folder, geom=scenes.CAPSULE)
    )
    for arm in ("ur5e", "panda"):
        yield row(folder, "mujoco", f"sphere at the tip of {arm}", scenes.arm_mjcf(folder, arm))
    for K, B in ((300.0, 5.0), (1e5, 300.0)):
        yield row(folder, "mujoco", "sphere of 2 kg, slide joint", scenes.mjcf(folder), K, B)
    for mass in (0.5, 8.0):
        yield row(folder, "drake", f"sphere of {mass:g} kg, SDF", scenes.sdf(folder, mass))
    yield row(folder, "drake", "sphere of 2 kg, URDF", scenes.urdf(folder))
    yield row(folder, "mjcf-spring", "the joint of the plate", None)


def row(
    folder: Path, to: str, what: str, model: Path | None, K: float = 5000.0, B: float = 50.0
) -> tuple[str, ...]:
    """Export, write, press."""
    contact = contact_from(scenes.found(K, B), "found.json", mass=0.05 if to == "mjcf-spring" else None)
    out = folder / f"out{model.suffix if model else '.txt'}"
    made = prepare(contact, Request(to, model, "foam"), out)
    out.write_text(made.text)
    (checked,) = made.check(out)
    assert checked.error_K is not None
    assert checked.error_B is not None
    return (
        f"`{to}`",
        what,
        f"{K:g}",
        f"{100 * checked.error_K:.1g} %",
        f"{B:g}",
        f"{100 * checked.error_B:.1g} %",
    )


if __name__ == "__main__":
    main()
