"""What every test of a wire stands in."""

from __future__ import annotations

import pytest

from wires.slow_cell import ADDRESSES, ALONE


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to work in; DDS, where it is used, keeps to the loopback."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLONEDDS_URI", ALONE)
    return tmp_path


@pytest.fixture
def address():
    """Of the loopback, of its own for each test."""
    return next(ADDRESSES)
