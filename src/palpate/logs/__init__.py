"""Files in and out: logs of any origin become records; records are kept as Parquet."""

from __future__ import annotations

from palpate.files import whole
from palpate.logs.arm_logs import read_wrench_and_pose
from palpate.logs.read import columns_of, read_log
from palpate.logs.store import read_record, write_record

__all__ = ["columns_of", "read_log", "read_record", "read_wrench_and_pose", "whole", "write_record"]
