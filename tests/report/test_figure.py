"""The charts of an identification, and its picture: there whole or not at all."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.files import check_place
from palpate.report.identification.charts import build_charts, time_charts
from palpate.report.identification.page import draw, write_figure
from report.outcomes import OUTCOMES


@pytest.fixture(scope="module")
def found():
    return OUTCOMES["identified"]()


def by_title(charts):
    return {chart.title: chart for chart in charts}


def line_of(chart, label):
    (line,) = (series for series in chart.series if series.label == label)
    return line


def test_storage_and_loss_are_those_of_the_octaves(found):
    charts = by_title(build_charts(found, found.traces))
    for part in ("storage", "loss"):
        chart = charts[part.capitalize()]
        scale = 1e3 if "kN/m" in chart.y else 1.0
        shown = line_of(chart, "measured")
        octaves = {octave.frequency: octave for octave in found.dynamic_stiffness}
        assert len(shown.x) > 0
        (interval,) = chart.intervals
        for i, frequency in enumerate(shown.x):
            octave = octaves.pop(frequency)
            value, half = getattr(octave, part), getattr(octave, f"{part}_half")
            assert shown.y[i] == pytest.approx(value / scale)
            assert interval.low[3 * i] == pytest.approx((value - half) / scale)
            assert interval.high[3 * i + 1] == pytest.approx((value + half) / scale)
        hidden = [span for mark in chart.marks for span in mark.spans]
        assert len(hidden) == len(octaves)


def test_what_is_drawn_is_what_was_measured_and_fitted(found):
    force, misfit = time_charts(found, found.traces)
    assert np.array_equal(line_of(force, "measured").y, found.traces.force)
    model = line_of(force, "model").y
    assert np.array_equal(model[np.isfinite(model)], found.traces.predicted)
    left = line_of(misfit, "measured less model").y
    assert np.array_equal(left[np.isfinite(left)], found.traces.fitted_force - found.traces.predicted)


def test_a_line_is_broken_between_contacts(found):
    traces = found.traces
    half = len(traces.fitted_time) // 2
    moved = np.where(np.arange(len(traces.fitted_time)) < half, 0.0, 5.0) + traces.fitted_time
    force, _ = time_charts(found, replace(traces, fitted_time=moved))
    model = line_of(force, "model")
    (gap, _) = np.flatnonzero(np.isnan(model.y))
    assert model.x[gap + 1] - model.x[gap] > 5.0


def test_a_name_is_no_formula(found):
    """Matplotlib would take what stands between dollars for mathematics, and fail."""
    figure = draw(found, "a$x_{1$ \x1b[31m.csv")
    figure.canvas.draw()
    assert r"\$x_{1\$" in figure.get_suptitle()
    assert "\x1b" not in figure.get_suptitle()


LONG = [pytest.param(name, marks=pytest.mark.long) for name in ("not_identifiable", "volts")]


@pytest.mark.parametrize("outcome", ["with_its_touch", "no_contact", *LONG])
def test_every_outcome_has_a_picture(outcome, tmp_path):
    from matplotlib.image import imread

    path = write_figure(OUTCOMES[outcome](), tmp_path / "a.png", "log")
    picture = imread(path)
    assert picture.shape[1] == 1430
    assert picture[..., :3].std() > 0.05, "something is drawn"
    check_place(path, "--figure")
    assert list(tmp_path.iterdir()) == [path]


def test_without_traces_there_is_none(found, tmp_path):
    with pytest.raises(ValueError, match="without traces"):
        write_figure(replace(found, traces=None), tmp_path / "a.png", "log")
    assert not list(tmp_path.iterdir())
