"""Files that palpate writes: atomically, and never over a file of another origin."""

from palpate.files.reading import open_file, read_bytes, read_table, read_text, read_toml, read_yaml
from palpate.files.writing import (
    FORCE,
    MADE,
    RECORD,
    SIGNATURE,
    WRITTEN,
    as_json,
    check_kept_folder,
    check_place,
    fresh_folder,
    kept_folder,
    ours,
    whole,
    with_author,
    write_json,
    write_text,
)

__all__ = [
    "FORCE",
    "MADE",
    "RECORD",
    "SIGNATURE",
    "WRITTEN",
    "as_json",
    "check_kept_folder",
    "check_place",
    "fresh_folder",
    "kept_folder",
    "open_file",
    "ours",
    "read_bytes",
    "read_table",
    "read_text",
    "read_toml",
    "read_yaml",
    "whole",
    "with_author",
    "write_json",
    "write_text",
]
