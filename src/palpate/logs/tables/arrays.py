"""Arrays of HDF5 (MATLAB's v7.3 too), NumPy, TDMS and AFM files as columns, by their maintained readers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from pickletools import genops
from types import MappingProxyType
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from palpate.arrays import AnyArray
from palpate.errors import InputError, how_to_install
from palpate.files.confined import read_confined
from palpate.files.reading import ReadingBudget
from palpate.logs.tables.matlab import columns_of_arrays, finite_cells
from palpate.logs.tables.sheet import Cells, Sheet, Stated, as_counts
from palpate.units import known_unit

_EXTRAS = {"HDF5": ("h5py", "hdf5"), "TDMS": ("npTDMS", "tdms"), "AFM": ("afmformats", "afm")}
"""Library and extra of each format."""
_MAX_OBJECTS = 10_000
"""Most groups and datasets, or channels, that are looked at."""
_NANOSECONDS = 1e9


def read_arrays(path: Path, kind: str, what: str, budget: ReadingBudget) -> Sheet:
    """The columns of a file of arrays, with the units, rate and spring constant that it states.

    Args:
        path: the file.
        kind: `HDF5`, `NPZ`, `TDMS` or `AFM`.
        what: to call it in an error.
        budget: of the log.

    Raises:
        InputError: it cannot be read, holds no numbers in columns, or its library is not installed.
    """
    arrays, about = read_confined(__name__, path, what, budget, kind)
    names = list(arrays)
    if not names:
        raise InputError(
            f"{path} holds no array of numbers with a value for each sample; export its signals as CSV"
        )
    return Sheet(
        path,
        names,
        lambda places, missing: ([_cells(arrays[names[i]], missing) for i in places], []),
        lambda index: as_counts(arrays[names[index]]),
        {name: Stated(symbol, "the file") for name, symbol in about["units"].items() if symbol.strip()},
        about.get("rate"),
        about.get("left_out", {}),
        clocks={name for name, column in arrays.items() if column.dtype.kind == "M"},
        spring=about.get("spring"),
    )


def _cells(column: AnyArray, missing: Any) -> Cells:
    if column.dtype.kind == "M":
        return Cells(column.astype("datetime64[ns]").astype(np.int64) / _NANOSECONDS, clock=True)
    return finite_cells(column, missing)


def unpack(path: Path, size: int, question: str) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """All columns of a file, and its statements. Runs in a process of its own."""
    try:
        return {"HDF5": _hdf5, "NPZ": _numpy, "TDMS": _tdms, "AFM": _afm}[question](path, size)
    except ImportError:
        library, extra = _EXTRAS[question]
        raise InputError(
            f"{path} needs the library {library}: {how_to_install(f'palpate[{extra}]')}"
        ) from None


def _take(size: float, wanted: float) -> float:
    """The bytes that are left.

    Raises:
        MemoryError: there are not as many.
    """
    if wanted > size:
        raise MemoryError
    return size - wanted


def _hdf5(path: Path, size: float) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Datasets by their paths with points; links and data in other files are not followed."""
    import h5py

    arrays: dict[str, AnyArray] = {}
    units: dict[str, str] = {}
    left_out: dict[str, str] = {}
    count = 0

    def take(place: str, node: Any) -> None:
        nonlocal size, count
        count += 1
        if count > _MAX_OBJECTS:
            raise MemoryError
        skipped = place.startswith("#") or "/_i_" in place  # of MATLAB, of PyTables' index
        if skipped or not isinstance(node, h5py.Dataset) or node.dtype.kind not in "biufV":
            return
        name = place.replace("/", ".")
        if node.is_virtual or node.external:
            left_out[name] = "kept in another file; copy it into this one"
            return
        if _text(node.attrs, "MATLAB_class") in {"char", "cell"} or node.size in {None, 0}:
            return
        size = _take(size, node.size * node.dtype.itemsize)
        labels = {
            field: _pickled_texts(_text(node.attrs, f"{field}_kind")) for field in node.dtype.names or ()
        }
        for title, column in _fields(name, np.asarray(node[()]), labels):
            arrays[title] = column
            units[title] = _text(node.attrs, "units") or _text(node.attrs, "unit")

    with h5py.File(path, "r") as file:
        file.visititems(take)
    columns, images = columns_of_arrays({name: array.squeeze() for name, array in arrays.items()})
    stated = {name: symbol for name in columns if known_unit(symbol := units.get(name, ""))}
    return columns, {"units": stated, "left_out": left_out | images}


def _text(attributes: Any, name: str) -> str:
    """An attribute of a dataset if it is a text; empty otherwise."""
    try:
        value = attributes.get(name, "")
    except (OSError, TypeError, ValueError):  # of a type that has no equivalent here
        return ""
    return (
        value.decode(errors="replace")
        if isinstance(value, bytes)
        else value
        if isinstance(value, str)
        else ""
    )


def _pickled_texts(text: str) -> list[str]:
    """The texts in a pickle, as pandas keeps the names of a block of columns; nothing in it is run."""
    try:
        operations = list(genops(text.encode()))
    except ValueError:
        return []
    return [str(word) for operation, word, _ in operations if "UNICODE" in operation.name]


def _fields(
    name: str, values: AnyArray, labels: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> Iterator[tuple[str, AnyArray]]:
    """An array of numbers, or the fields of a structured one; a field of several columns by its labels."""
    for field in values.dtype.names or ():
        block = values[field]
        if block.dtype.kind in "biuf" and block.ndim == 2 and block.shape[1] == len(labels.get(field, ())):
            group = name.removesuffix(".table")
            yield from ((f"{group}.{label}", block[:, i]) for i, label in enumerate(labels[field]))
        elif block.dtype.kind in "biufV":
            yield from _fields(f"{name}.{field}" if name else field, values[field])
    if values.dtype.names is None and values.dtype.kind in "biuf":
        yield name, values


def _numpy(path: Path, size: float) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Arrays of an .npz file, or of an .npy file; those of Python objects are refused by NumPy."""
    if is_zipfile(path):
        with ZipFile(path) as packed:
            _take(size, sum(part.file_size for part in packed.infolist()))
    loaded = np.load(path, allow_pickle=False)
    named: Mapping[str, AnyArray] = {"": loaded} if isinstance(loaded, np.ndarray) else loaded
    arrays: dict[str, AnyArray] = {}
    left_out = {}
    for name in named:
        try:
            arrays |= dict(_fields(name, named[name]))
        except ValueError as error:
            if "pickle" not in str(error):
                raise
            left_out[name] = "an array of Python objects, which is not loaded: it could run code"
    columns, images = columns_of_arrays({name: array.squeeze() for name, array in arrays.items()})
    return {name.lstrip("."): column for name, column in columns.items()}, {
        "units": {},
        "left_out": left_out | images,
    }


def _tdms(path: Path, size: float) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Channels of LabVIEW's TDMS, scaled; of the longest ones the increment gives the rate."""
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        if len(channels) > _MAX_OBJECTS:
            raise MemoryError
        several = len(file.groups()) > 1
        columns, units, steps = {}, {}, []
        for channel in channels:
            size = _take(size, 8.0 * len(channel))
            if len(channel) < 2 or channel.dtype.kind not in "biufM":
                continue
            name = f"{channel.group_name}.{channel.name}" if several else channel.name
            columns[name] = channel[:]
            units[name] = str(channel.properties.get("unit_string", ""))
            steps.append((len(channel), channel.properties.get("wf_increment")))
    usual = [step for length, step in steps if length == max(steps)[0]] if steps else []
    step = usual[0] if usual and len({*usual}) == 1 else None
    rate = 1 / step if isinstance(step, float) and step > 0 else None
    return columns, {"units": {name: u for name, u in units.items() if known_unit(u)}, "rate": rate}


def _afm(path: Path, size: float) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Curves of an atomic force microscope in SI, approach and retraction one after the other."""
    import afmformats

    if is_zipfile(path):
        with ZipFile(path) as packed:
            _take(size, sum(part.file_size for part in packed.infolist()))
    unstated: dict[str, float] = {}
    try:
        curves = afmformats.load_data(path)
    except afmformats.errors.MissingMetaDataError as missing:
        unstated = dict.fromkeys(missing.meta_keys, 1.0)
        curves = afmformats.load_data(path, meta_override=unstated)
    if not curves:
        raise InputError(f"{path} holds no force curve; export it as text")
    columns, units = {}, {}
    for number, curve in enumerate(curves, 1):
        for title in ("time", "force", "height (measured)", "height (piezo)"):
            if title in curve:
                name = "deflection" if title == "force" and unstated else title
                name = name if len(curves) == 1 else f"curve {number}.{name}"
                columns[name] = np.asarray(curve[title], float)
                size = _take(size, columns[name].nbytes)
                units[name] = {"time": "s", "force": "" if unstated else "N"}.get(title, "m")
    length = max(map(len, columns.values()), default=0)
    columns = {
        name: np.pad(column, (0, length - len(column)), constant_values=np.nan)
        for name, column in columns.items()
    }
    about = curves[0].metadata
    timed = any(name.endswith("time") for name in columns)
    rate = None if timed else about.get("rate approach")
    lacking = f"the file does not state: {', '.join(unstated)}; the deflection is listed without it"
    spring = None if "spring constant" in unstated else about.get("spring constant")
    left_out = {"force": lacking} if unstated else {}
    return columns, {"units": units, "rate": rate, "spring": spring, "left_out": left_out}
