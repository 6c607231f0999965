"""The format of a log file, recognised by its first bytes, not by its name."""

from enum import Enum
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from palpate.errors import InputError


class Kind(Enum):
    """The kinds of logs that palpate reads, by what to call them in a sentence."""

    TEXT = "text"
    PARQUET = "Parquet"
    MAT = "a MATLAB file"
    SHEETS = "a spreadsheet"
    BAG1 = "a ROS 1 bag"
    MCAP = "MCAP"
    SQLITE = "a ROS 2 bag (sqlite3)"
    FOLDER = "a ROS 2 bag"

    @property
    def is_bag(self) -> bool:
        """Whether it holds messages by topic, each with times of its own."""
        return self in {Kind.BAG1, Kind.MCAP, Kind.SQLITE, Kind.FOLDER}


STORAGES = (".mcap", ".db3")
"""Suffixes of the files that a ROS 2 bag's folder holds its messages in."""
PACKED = ".zstd"
"""Suffix that follows it where the file was packed as a whole."""

_BEGINNINGS = {
    b"PAR1": Kind.PARQUET,
    b"#ROSBAG V": Kind.BAG1,
    b"\x89MCAP": Kind.MCAP,
    b"SQLite format 3\x00": Kind.SQLITE,
    b"MATLAB 5.0 MAT-file": Kind.MAT,
}
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n")


def kind_of(path: Path) -> Kind:
    """Look at a log.

    Raises:
        InputError: there is no such file; it is empty, a pipe, or a folder that is no bag; it is MATLAB's v7.3.
    """
    if _is_sheet(path):
        return Kind.SHEETS
    if not path.exists():
        raise InputError(f"there is no file {path}; check the path")
    if path.is_dir():
        if any(
            (path / "metadata.yaml").is_file() or {file.suffix, file.with_suffix("").suffix} & {*STORAGES}
            for file in path.iterdir()
        ):
            return Kind.FOLDER
        raise InputError(
            f"{path} is a folder and no ROS 2 bag; give a log file, or a bag's own folder (identify pools logs)"
        )
    if not path.is_file():
        raise InputError(f"{path} is a pipe or a device; a log is read more than once, so save it as a file")
    with path.open("rb") as file:
        begin = file.read(32)
    if not begin:
        raise InputError(f"{path} is empty; give a log with a row of numbers for each sample")
    if begin.startswith(_HDF5) and (begin.startswith(b"MATLAB") or path.suffix.lower() == ".mat"):
        raise InputError(f"{path} is a MATLAB file of version 7.3 (HDF5); save it in MATLAB with: save -v7")
    if begin.startswith(b"PK\x03\x04") and _is_spreadsheet(path):
        return Kind.SHEETS
    found = next((kind for magic, kind in _BEGINNINGS.items() if begin.startswith(magic)), Kind.TEXT)
    return Kind.MAT if found is Kind.TEXT and path.suffix.lower() == ".mat" else found


def _is_sheet(path: Path) -> bool:
    """Whether a path is `BOOK.xlsx/SHEET`, a sheet of a book."""
    return path.parent.is_file() and kind_of(path.parent) is Kind.SHEETS


def _is_spreadsheet(path: Path) -> bool:
    """Whether a zip archive holds the parts of a spreadsheet."""
    try:
        with ZipFile(path) as packed:
            return bool({"xl/workbook.xml", "xl/workbook.bin", "content.xml"} & set(packed.namelist()))
    except (BadZipFile, OSError, ValueError, NotImplementedError):
        return path.suffix.lower() in {".xlsx", ".xlsm", ".xlsb", ".ods"}
