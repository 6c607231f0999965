"""`palpate export`: an identified surface as the contact of a simulator's scene, or a law as C."""

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Literal

from palpate.cli.options.common import WRITTEN, FileOptions
from palpate.cli.options.values import FLAG, SIGNED, options
from palpate.errors import InputError


@options("The scene", 1)
class SceneOptions:
    """The scene and its contact."""

    to: Literal["mujoco", "drake", "newton", "mjcf-spring", "c"]
    """mujoco, drake, newton, mjcf-spring: a plate on a slide joint; or c: a law, with the gains of palpate
    tune."""
    model: Path | None = None
    "The scene: MJCF for mujoco, SDF or URDF for drake."
    geom: str | None = None
    "The surface: a geom of MJCF, a collision of SDF or URDF; without a scene, its name."
    probe: str | None = None
    "The probe, likewise; every geom that can touch the surface if not given."


@options("Given parameters", 2)
class GivenOptions:
    """Numbers in place of identified ones."""

    damping: Annotated[float | None, SIGNED] = None
    "B in N s/m, if it was not identified, or to override it; 0 for a pure spring."
    mass: Annotated[float | None, SIGNED] = None
    "M in kg of the plate of mjcf-spring, likewise."
    working_point: Annotated[bool, FLAG] = False
    """Use the stiffness at the working point instead of the model's K, for a surface that no linear model
    explains."""


@options("The law, of C", 3)
class LawOptions:
    """A law and its numbers."""

    law: str = "force-loop"
    """force-loop, of a gains file; sliding-loop, of one of palpate tune --slide; contact-identifier; or
    recursive-least-squares."""
    into: Annotated[str, SIGNED] = "0,0,-1"
    "Of sliding-loop: direction into the surface, x,y,z in the base's axes."
    parameters: Annotated[int, SIGNED] = 3
    "Of recursive-least-squares, 3 or 4."
    forgetting: Annotated[float, SIGNED] = 1.0
    "Of recursive-least-squares: its forgetting factor."
    low_pass: str = "butterworth3:120"  # noqa: S105 - a filter
    "Of contact-identifier: the force sensor's low-pass."
    rate: Annotated[float, SIGNED] = 1000.0
    "Of contact-identifier: ticks a second in Hz."
    lag: Annotated[float, SIGNED] = 0.003
    "Of contact-identifier: how late the force is, its low-pass included, in s."
    sampling: Annotated[float | None, SIGNED] = None
    "Of contact-identifier: samples of the force sensor a second in Hz, if not one a tick."


@options(WRITTEN)
class ExportOutput(FileOptions):
    """Where the scene or the law is written."""

    out: Path | None = None
    """The file; SCENE-GEOM beside the scene if not given. A comment in it, and FILE.json beside it, list
    intervals and assumptions. Of C the folder."""
    replace: Annotated[bool, FLAG] = False
    "Replace an earlier export."
    check: Annotated[bool, FLAG] = False
    """Press the contact in the simulator, and state the error in K and B; exit code 1 if one is above 0.1 %.
    Of C: compile it here, and repeat a million ticks of Python's; exit code 1 if one differs in a bit."""


def export(
    found: Path | None = None,
    /,
    *,
    scene: SceneOptions,
    given: GivenOptions | None = None,
    law: LawOptions | None = None,
    output: ExportOutput | None = None,
) -> int:
    """Write an identified surface as the contact of a simulator's scene, and press it there; or a law as C.

    palpate identify press.csv --time time_s --position position_mm:mm --force force_N:N --json > found.json

    palpate export found.json --to mujoco --model scene.xml --geom foam --check

    palpate export gains.toml --to c --out force_loop --check

    The scene's own file is not changed: the new file includes it (MuJoCo) or is a copy (Drake).

    Parameters
    ----------
    found
        The output of palpate identify --json; for a force loop in C the gains file of palpate tune.
    """
    given, output = given or GivenOptions(), output or ExportOutput()
    if scene.to == "c":
        return _exporter("law")(found, law or LawOptions(), output)
    return _exporter("scene")(found, scene, given, output)


_EXPORTERS = {"scene": ("a simulator", "palpate-export"), "law": ("C", "palpate-native")}
"""Target of each exporter, and the distribution that has it."""


def _exporter(name: str) -> Callable[..., int]:
    """The command of the distribution that exports a scene or a law."""
    for entry in entry_points(group="palpate.exports", name=name):
        return entry.load()
    to, distribution = _EXPORTERS[name]
    raise InputError(
        f"export to {to} is of {distribution}, which is not installed: pip install {distribution}"
    )
