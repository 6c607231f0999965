"""Files in and out: logs of any origin become records; records are kept as Parquet.

Its names are looked up when they are first used: what reads one file in a process of its own waits for no other reader.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from palpate.files import whole

if TYPE_CHECKING:
    from palpate.logs.arm_logs import read_wrench_and_pose
    from palpate.logs.read import columns_of
    from palpate.logs.signals import read_log
    from palpate.logs.tables.parquet import read_record, write_record

__all__ = ["columns_of", "read_log", "read_record", "read_wrench_and_pose", "whole", "write_record"]

_HOME = {
    "columns_of": "read",
    "read_log": "signals",
    "read_record": "tables.parquet",
    "read_wrench_and_pose": "arm_logs",
    "write_record": "tables.parquet",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    return value
