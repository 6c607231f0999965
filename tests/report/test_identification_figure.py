"""The picture of an identification: its panels, and that it is there whole or not at all."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.files import check_place
from palpate.report.identification import draw, write_figure
from report.outcomes import OUTCOMES


@pytest.fixture(scope="module")
def found():
    return OUTCOMES["identified"]()


def axes_of(figure):
    return {axis.get_title("left"): axis for axis in figure.axes}


def test_the_panels_and_what_they_measure(found):
    axes = axes_of(draw(found, "press.csv"))
    labels = {title: (axis.get_xlabel(), axis.get_ylabel()) for title, axis in axes.items() if title}
    assert labels == {
        "Force against penetration": ("position from touch [mm]", "force [N]"),
        "Force over time": ("time [s]", "force [N]"),
        "What the model leaves": ("time [s]", "misfit [N]"),
        "Is it noise?": ("frequency [Hz]", "misfit [N/√Hz]"),
        "How the estimates settled": ("", "K [N/m]"),
        "What was excited": ("", "force by third-octave band [N]"),
    }


def test_the_settling_of_each_parameter_and_the_shares_have_their_panels(found):
    labels = [axis.get_ylabel() for axis in draw(found, "press.csv").axes]
    for label in ("K [N/m]", "B [N s/m]", "M [kg]", "share [%]"):
        assert label in labels


def test_what_is_drawn_is_what_was_measured_and_fitted(found):
    axis = axes_of(draw(found, "press.csv"))["Force over time"]
    lines = {line.get_label(): line.get_xydata() for line in axis.lines}
    assert np.array_equal(lines["measured"][:, 1], found.traces.force)
    model = lines["model"]
    assert np.array_equal(model[np.isfinite(model[:, 1]), 1], found.traces.predicted)


def test_the_verdicts_stand_above_the_panels(found):
    figure = draw(found, "press.csv")
    written = " ".join(text.get_text() for part in figure.subfigs for text in part.texts)
    assert "press.csv" in written
    assert written.count("identified") == 3 + 1  # each parameter's, and the headline's
    assert f"{found.parameters['K'].value:.0f}" in written


@pytest.mark.parametrize("outcome", ["not_identifiable", "with_its_touch", "no_contact", "volts"])
def test_every_outcome_has_a_picture(outcome, tmp_path):
    from matplotlib.image import imread

    path = write_figure(OUTCOMES[outcome](), tmp_path / "a.png", "log")
    picture = imread(path)
    assert picture.shape[1] == 1430
    assert picture[..., :3].std() > 0.05, "something is drawn"
    check_place(path)
    assert list(tmp_path.iterdir()) == [path]


def test_without_a_contact_the_force_is_shown_alone():
    (axis,) = draw(OUTCOMES["no_contact"](), "log").axes
    assert axis.get_ylabel() == "force [N]"


def test_without_traces_there_is_none(found, tmp_path):
    with pytest.raises(ValueError, match="without traces"):
        write_figure(replace(found, traces=None), tmp_path / "a.png", "log")
    assert not list(tmp_path.iterdir())


def test_a_stiffness_of_dots_is_drawn_for_a_log_that_would_fill_the_panel(found):
    """The measured force less damping and mass lies nearer to the spring than the force itself."""
    axis = axes_of(draw(found, "log"))["Force against penetration"]
    lines = {line.get_label(): line.get_xydata() for line in axis.lines}
    spring = lines["model's spring"]
    left = {
        name: np.std(own[:, 1] - np.interp(own[:, 0], spring[:, 0], spring[:, 1]))
        for name, own in lines.items()
    }
    assert left["less damping, mass"] < 0.5 * left["measured"]
