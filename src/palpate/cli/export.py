"""`palpate export`: an identified surface as the contact of a simulator's scene, or a law as C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from palpate.cli._export_law import LawOptions, export_law
from palpate.cli.options.flags import FLAG, SIGNED
from palpate.cli.options.written import WRITTEN, FileOptions
from palpate.errors import InputError


@Parameter(name="*", group=Group("The scene", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """The scene and its contact.

    Parameters
    ----------
    to
        mujoco, drake, newton, mjcf-spring: a plate on a slide joint; or c: a law, with the gains of palpate tune.
    model
        The scene: MJCF for mujoco, SDF or URDF for drake.
    geom
        The surface: a geom of MJCF, a collision of SDF or URDF; without a scene, its name.
    probe
        The probe, likewise; every geom that can touch the surface if not given.
    """

    to: Literal["mujoco", "drake", "newton", "mjcf-spring", "c"]
    model: Path | None = None
    geom: str | None = None
    probe: str | None = None


@Parameter(name="*", group=Group("Given parameters", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class GivenOptions:
    """Numbers in place of identified ones.

    Parameters
    ----------
    damping
        B in N s/m, if it was not identified, or to override it; 0 for a pure spring.
    mass
        M in kg of the plate of mjcf-spring, likewise.
    working_point
        Use the stiffness at the working point instead of the model's K, for a surface that no linear model explains.
    """

    damping: Annotated[float | None, SIGNED] = None
    mass: Annotated[float | None, SIGNED] = None
    working_point: Annotated[bool, FLAG] = False


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class ExportOutput(FileOptions):
    """Files to write.

    Parameters
    ----------
    out
        The file; SCENE-GEOM beside the scene if not given. A comment in it, and FILE.json beside it, list intervals
        and assumptions. Of C the folder.
    replace
        Replace an earlier export.
    check
        Press the contact in the simulator, and state the error in K and B; exit code 1 if one is above 0.1 %. Of C:
        compile it here, and repeat a million ticks of Python's; exit code 1 if one differs in a bit.
    """

    out: Path | None = None
    replace: Annotated[bool, FLAG] = False
    check: Annotated[bool, FLAG] = False


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
        return export_law(found, law or LawOptions(), output)
    return _scene_writer()(found, scene, given, output)


def _scene_writer() -> Callable[[Path | None, SceneOptions, GivenOptions, ExportOutput], int]:
    """The command of the distribution that writes scenes."""
    for entry in entry_points(group="palpate.exports", name="scene"):
        return entry.load()
    raise InputError(
        "export to a simulator is of palpate-export, which is not installed: pip install palpate-export"
    )
