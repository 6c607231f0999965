"""What every test of a wire stands in."""

from __future__ import annotations

import pytest

from wires.slow_cell import ADDRESSES, ALONE, cell, slower_cell


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


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A cell of 100 Hz."""
    made = tmp_path_factory.mktemp("cell")
    cell(made)
    return made


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Two cells, of 100 Hz and of libfranka's 1 kHz; both so slow that a busy machine is in time."""
    made = {rate: tmp_path_factory.mktemp(f"at{rate}") for rate in (100, 1000)}
    for rate, folder in made.items():
        slower_cell(folder, rate)
    return made
