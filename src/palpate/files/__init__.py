"""Files that palpate writes: atomically, and never over a file of another origin."""

from __future__ import annotations

from palpate.files.folders import RECORD, fresh_folder, kept_folder
from palpate.files.ownership import FORCE, MADE, SIGNATURE, WRITTEN, check_place, ours
from palpate.files.reading import read_bytes
from palpate.files.writing import signed, whole, write_json, write_text

__all__ = [
    "FORCE",
    "MADE",
    "RECORD",
    "SIGNATURE",
    "WRITTEN",
    "check_place",
    "fresh_folder",
    "kept_folder",
    "ours",
    "read_bytes",
    "signed",
    "whole",
    "write_json",
    "write_text",
]
