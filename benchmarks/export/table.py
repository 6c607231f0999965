"""Errors in K and B of exported contacts that are pressed in the engines."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "packages" / "palpate-export" / "tests"))

from export import scenes
from palpate_export import Request, contact_from, prepare

ENGINES = {"mujoco": "MuJoCo", "mjcf-spring": "MuJoCo", "drake": "Drake", "newton": "Newton"}


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = list(measured(Path(folder)))
    lines = [
        "| `--to` | probe | K [N/m] | error in K | B [N s/m] | error in B |",
        "|---|---|---|---|---|---|",
    ]
    table = "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
    note = f"MuJoCo {engine_version('mujoco')}, Drake {version('drake')}, Newton {engine_version('newton')}."
    print(f"{table}\n\n{note}")


def engine_version(name: str) -> str:
    """As the package says it; which of two packages of one name is loaded, only it knows."""
    try:
        if name == "mujoco":
            import mujoco

            return str(mujoco.__version__)
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def measured(folder: Path) -> Iterator[tuple[str, ...]]:
    """A row for each press."""
    for mass in (0.5, 2.0, 8.0):
        for joint, name in ((scenes.SLIDE, "slide joint"), (scenes.FREE, "free joint")):
            yield row(
                folder, "mujoco", f"sphere of {mass:g} kg, {name}", scenes.mjcf(folder, joint, mass=mass)
            )
    pyramid = 'cone="pyramidal" timestep="0.001"'
    yield row(folder, "mujoco", "the same of 2 kg, pyramidal cone", scenes.mjcf(folder, options=pyramid))
    yield row(
        folder, "mujoco", "capsule of 2 kg, lying: two points", scenes.mjcf(folder, geom=scenes.CAPSULE)
    )
    for arm in ("ur5e", "panda"):
        yield row(folder, "mujoco", f"sphere at the tip of {arm}", scenes.arm_mjcf(folder, arm))
    for K, B in ((300.0, 5.0), (1e5, 300.0)):
        yield row(folder, "mujoco", "sphere of 2 kg, slide joint", scenes.mjcf(folder), K, B)
    for mass in (0.5, 2.0, 8.0):
        yield row(folder, "drake", f"sphere of {mass:g} kg, SDF", scenes.sdf(folder, mass))
    yield row(folder, "drake", "sphere of 2 kg, URDF", scenes.urdf(folder))
    yield row(folder, "mjcf-spring", "sphere of 1 kg on the plate", None)
    yield row(folder, "newton", "sphere of 1 kg, SolverSemiImplicit, loading", None)


def row(
    folder: Path, to: str, what: str, model: Path | None, K: float = 5000.0, B: float = 50.0
) -> tuple[str, ...]:
    """Export, write, press."""
    contact = contact_from(scenes.found(K, B), "found.json", mass=0.05 if to == "mjcf-spring" else None)
    out = folder / f"out{model.suffix if model else '.txt'}"
    made = prepare(contact, Request(to, model, "foam"), out)
    out.write_text(made.text)
    if to == "newton" and engine_version("newton") == "not installed":
        return f"`{to}`", what, f"{K:g}", "not pressed", f"{B:g}", "not pressed"
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
