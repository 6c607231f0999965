"""The figures of a run: files, captions, and what is drawn."""

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build, summarise
from palpate.records import Record
from palpate.report.run.figures import write_report


@pytest.fixture(scope="module")
def record():
    return build(quick("foam-hybrid")).run(1.5, press=0.4)


@pytest.fixture(scope="module")
def summary(record):
    return {**summarise(record), "command": "palpate run", "seed": 0, "not_identified": ""}


def write(record, summary, folder):
    return write_report(record, summary, None, "the experiment's file", folder, (".png",))


def pixels(path):
    from matplotlib.image import imread

    return imread(path)


def test_every_figure_is_a_picture_with_a_caption(record, summary, tmp_path):
    captions = write(record, summary, tmp_path)
    assert list(captions) == ["approach.png", "force.png", "identification.png", "torque.png"]
    assert {path.name for path in tmp_path.iterdir()} == {*captions, "report.html"}, (
        "no half-written file is left"
    )
    for name, caption in captions.items():
        assert caption.endswith(".")
        picture = pixels(tmp_path / name)
        assert picture.shape[1] > 800
        assert picture[..., :3].std() > 0.05, "something is drawn"


def test_without_contact_there_is_nothing_to_show_of_it(record, summary, tmp_path):
    air = Record({**record.columns, "phase": np.zeros(len(record))}, record.units, record.meta)
    assert list(write(air, {**summary, "force": None}, tmp_path)) == ["approach.png", "torque.png"]


@pytest.mark.parametrize(
    "rows", [1, pytest.param(2, marks=pytest.mark.long), pytest.param(250, marks=pytest.mark.long)]
)
def test_a_short_record_is_drawn(record, summary, tmp_path, rows):
    """An interrupted run has whatever it has."""
    short = Record(
        {name: column[:rows] for name, column in record.columns.items()}, record.units, record.meta
    )
    assert write(short, summary, tmp_path)
