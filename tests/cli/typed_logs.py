"""Logs of tests, examples and laboratories, each with the words by which a person types its identification."""

from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
MEASURED = ROOT.parent / "shared" / "data"
CERTIFIED = ROOT / "src/palpate/certified_logs/logs"

_SKIN = "--time time_s --position position_mm:mm --force force_mN:mN"
_LATTICE = "--time 0 --position 3:mm --force 4:g"
_DAMPER = "--time Tout --position dist:mm --force forc:N"
_SILVERBOX = "--time time_s --position position_V:1 --force force_V:1"
_PNEUMATIC = "--time 0:ms --position 4:mm --force 6:N"
_SPECIMEN = "--time 0 --position 1:mm --force 2:N"
_OTHER_SPECIMEN = "--time 3 --position 4:mm --force 5:N"
_STAMPED = "--time Time(sec) --position Pos_Z(mm):mm --force Force_Z:N"
_GLUED = "--time 4 --position 0:m --force 1:N"
_FORCE_CURVE = "--rate 100 --position 0:nm --force 1:1"
_CELL = "--indenter sphere:10:um --poisson 0.5"
_RIPPLE = "--indenter sphere:4:mm --poisson 0.5"


class TypedLog(NamedTuple):
    """A log, and the words after its name on the command line."""

    path: Path
    words: str = ""

    @property
    def name(self) -> str:
        """Folder, file and words, by which a test is named."""
        return " ".join((f"{self.path.parent.name}/{self.path.name}", self.words)).strip()


def measured_logs() -> list[TypedLog]:
    """Logs of laboratories, with columns as their descriptions name them; empty where the folder is missing."""
    skin = [
        TypedLog(MEASURED / f"skin_indentation/press_{size}mN.csv", _SKIN)
        for size in (20, 40, 250, 400, 600, 800)
    ]
    damper = [TypedLog(MEASURED / f"mr_damper/ensaio{number}.mat", _DAMPER) for number in (3, 10)]
    reports = MEASURED / "reports"
    logs = [
        *skin,
        *damper,
        *(log._replace(words=f"{_DAMPER} --bonded") for log in damper),
        TypedLog(MEASURED / "skin_indentation/press_250mN.ddf", "--position AI0 --force AI1"),
        TypedLog(MEASURED / "lattice_probe/probe_states.csv", _LATTICE),
        TypedLog(MEASURED / "silverbox/schroeder_80mV.csv", _SILVERBOX),
        TypedLog(
            MEASURED / "silverbox/schroeder_80mV.csv", f"{_SILVERBOX} --start 17.343 --end 19.019 --bonded"
        ),
        TypedLog(MEASURED / "pneumatic_friction/Circle_3bar.csv", _PNEUMATIC),
        TypedLog(MEASURED / "pneumatic_friction/Circle_3bar.csv", f"{_PNEUMATIC} --bonded"),
        TypedLog(reports / "specimens_side_by_side.csv", _SPECIMEN),
        TypedLog(reports / "specimens_side_by_side.csv", _OTHER_SPECIMEN),
        TypedLog(reports / "repeated_stamps.csv", _STAMPED),
        TypedLog(reports / "names_glued.tab", _GLUED),
        TypedLog(reports / "afm_extend_retract.csv", _FORCE_CURVE),
        TypedLog(reports / "cell.csv", _CELL),
        TypedLog(reports / "cell.csv"),
        TypedLog(reports / "baseline_ripple.csv", _RIPPLE),
        TypedLog(reports / "baseline_ripple.csv"),
    ]
    others = {log.path for log in logs}
    logs += [TypedLog(path) for path in sorted(MEASURED.glob("*/*")) if path not in others]
    return [log for log in logs if log.path.exists()]


def logs_of_the_project() -> list[TypedLog]:
    """The example and the certified logs, whose names leave nothing to guess."""
    paths = [ROOT / "examples/data/press.csv", *sorted(CERTIFIED.glob("*.csv"))]
    return [TypedLog(path) for path in paths]
