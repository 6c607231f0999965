"""Files that palpate writes: whole or not at all, and never over a file that it did not write itself."""

from __future__ import annotations

from palpate.files.folders import fresh_folder, kept_folder
from palpate.files.ownership import FORCE, MADE, SIGNATURE, WRITTEN, check_place, ours
from palpate.files.reading import read_bytes
from palpate.files.writing import signed, whole, write_json, write_text

__all__ = [
    "FORCE",
    "MADE",
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
