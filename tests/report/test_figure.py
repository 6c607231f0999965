"""The picture of an identification: its panels, and that it is there whole or not at all."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.files import check_place
from palpate.report.identification.figure import draw, write_figure
from palpate.report.identification.words import full_number, sentence
from palpate.report.style import with_peaks
from report.outcomes import OUTCOMES


@pytest.fixture(scope="module")
def found():
    return OUTCOMES["identified"]()


def axes_of(figure):
    return {axis.get_title("left"): axis for axis in figure.axes}


def quantity_of(axis):
    """What lies above an axis."""
    return axis.texts[0].get_text() if axis.texts else ""


def test_the_panels_and_what_they_measure(found):
    pressed = replace(OUTCOMES["not_identifiable"](), dynamic_stiffness=found.dynamic_stiffness)
    axes = axes_of(draw(pressed, "press.csv"))
    labels = {title: (axis.get_xlabel(), quantity_of(axis)) for title, axis in axes.items() if title}
    assert labels == {
        "Dynamic stiffness": ("", "storage [kN/m]"),
        "Press": ("depth from touch [mm]", "force [N]"),
        "Force": ("", "force [N]"),
        "Misfit": ("time [s]", "misfit [N]"),
        "Is the misfit noise?": ("frequency [Hz]", "misfit [N/√Hz]"),
    }
    assert list(labels)[:2] == ["Dynamic stiffness", "Press"], "what the log shows stands before the model"


def test_a_log_without_a_way_in_says_so(found):
    bare = replace(found, press=None)
    assert "no loading in this log" in quantity_of(axes_of(draw(bare, "log"))["Press"])


def test_storage_and_loss_are_those_of_the_octaves(found):
    above, below = draw(found, "press.csv").axes[:2]
    for axis, part in ((above, "storage"), (below, "loss")):
        drawn = np.concatenate(
            [line.get_ydata() for line in axis.lines if line.get_marker() == "o" and line.get_ms() < 6]
        )
        own = [getattr(octave, part) / 1e3 for octave in found.dynamic_stiffness]
        assert sorted(drawn) == pytest.approx(sorted(own))


def test_what_is_drawn_is_what_was_measured_and_fitted(found):
    axis = axes_of(draw(found, "press.csv"))["Force"]
    lines = {line.get_label(): line.get_xydata() for line in axis.lines}
    assert np.array_equal(lines["measured"][:, 1], found.traces.force)
    model = lines["model"]
    assert np.array_equal(model[np.isfinite(model[:, 1]), 1], found.traces.predicted)


def test_the_sentence_and_the_verdicts_stand_above_the_panels(found):
    figure = draw(found, "press.csv")
    written = " ".join(" ".join(text.get_text() for part in figure.subfigs for text in part.texts).split())
    assert "press.csv" in written
    assert sentence(found) in written
    for name, p in found.parameters.items():
        assert f"{name} {full_number(p)}" in written
    assert written.index(sentence(found)) < written.index("K ")


def test_a_name_is_no_formula(found):
    """Matplotlib would take what stands between dollars for mathematics, and fail."""
    figure = draw(found, "a$x_{1$ \x1b[31m.csv")
    figure.canvas.draw()
    assert "$x_{1$" in figure.subfigs[0].texts[0].get_text()
    assert "\x1b" not in figure.subfigs[0].texts[0].get_text()


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


def test_without_a_contact_the_force_is_shown_alone():
    (axis,) = draw(OUTCOMES["no_contact"](), "log").axes
    assert quantity_of(axis) == "force [N]"


def test_without_traces_there_is_none(found, tmp_path):
    with pytest.raises(ValueError, match="without traces"):
        write_figure(replace(found, traces=None), tmp_path / "a.png", "log")
    assert not list(tmp_path.iterdir())


def test_a_long_log_is_thinned_without_losing_a_peak():
    time = np.arange(100_000) / 1000
    values = np.zeros(len(time))
    values[54_321] = 7.0
    values[77_777] = -3.0
    at, kept = with_peaks(time, values, 2400)
    assert len(kept) < 5000
    assert (np.diff(at) >= 0).all()
    assert (kept.max(), kept.min()) == (7.0, -3.0)
    assert at[kept.argmax()] == time[54_321]
