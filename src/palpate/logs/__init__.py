"""Files in and out: logs of any origin become records; records are kept as Parquet.

Its names are looked up when they are first used: what reads one file in a process of its own waits for no other reader.
"""

from typing import TYPE_CHECKING

from palpate.files import whole
from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.logs.arm_logs import read_wrench_and_pose
    from palpate.logs.read import columns_of
    from palpate.logs.signals import read_log
    from palpate.logs.tables.parquet import read_record, write_record

__all__ = ["columns_of", "read_log", "read_record", "read_wrench_and_pose", "whole", "write_record"]

__getattr__ = importer(
    __name__,
    {
        "arm_logs": ("read_wrench_and_pose",),
        "read": ("columns_of",),
        "signals": ("read_log",),
        "tables.parquet": ("read_record", "write_record"),
    },
)
