"""How values are shown: `palpate` itself says by which module, so that no value names the report."""

from collections.abc import Callable
from typing import Any

report: Callable[[], Any]
"""Imports the module that shows values: `line`, `html`, `view_of`, `write_figure` and `write_page`."""
