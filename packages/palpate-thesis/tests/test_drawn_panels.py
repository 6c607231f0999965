"""Figures as panels: lines become charts with every peak, all else stays a picture, and dark pages turn its ink."""

import base64

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from palpate.report import style
from palpate.report.chart import MOST, panel_scripts
from palpate.report.look.assets import GAP, NO_PLACE
from palpate_thesis.drawn_panels import panels_of, plain

T = np.linspace(0.0, 4.0, 40_001)


def drawn(panels=1):
    with style.ink():
        figure = Figure(layout="constrained")
        return figure, list(np.atleast_1d(figure.subplots(1, panels)))


def codes(column):
    return np.frombuffer(base64.b64decode(column["b"]), "<i2")


def opened(column):
    """As the page unpacks it."""
    if isinstance(column, list):
        return np.array([np.inf if v == "absent" else np.nan if v is None else v for v in column])
    numbers = codes(column)
    values = (numbers.astype(float) + 32500) * column["s"] + column["o"]
    values[numbers == GAP], values[numbers == NO_PLACE] = np.nan, np.inf
    return values


def test_a_line_is_a_chart_that_keeps_its_peak_and_its_gap():
    values = np.sin(T)
    values[12_345], values[20_000:20_100] = 9.0, np.nan
    figure, (axis,) = drawn()
    axis.plot(T, values, color=style.K, label="$K_e$")
    axis.set(xlabel="time [s]", ylabel="$K_e$ [kN/m]")
    (panel,) = panels_of(figure)
    spec, columns = panel["spec"], panel["columns"]
    assert (spec["x"], spec["unit"], spec["y"]) == ("time [s]", "s", "Kₑ [kN/m]")
    assert (spec["series"][0]["colour"], spec["series"][0]["label"]) == ("K", "Kₑ")
    t, y = opened(columns["t"]), opened(columns["c0"])
    assert len(t) <= 1.1 * MOST
    assert np.nanmax(y) == pytest.approx(9.0, abs=1e-3)
    assert t[np.nanargmax(y)] == pytest.approx(T[12_345], abs=1e-4)
    assert np.isnan(y).any()


def test_lines_of_other_places_share_one_axis_and_are_not_interpolated():
    figure, (axis,) = drawn()
    axis.plot(T[::1000], T[::1000], label="coarse")
    axis.plot(T[::900] + 1e-3, -T[::900], label="fine")
    (panel,) = panels_of(figure)
    t, coarse, fine = (opened(panel["columns"][name]) for name in ("t", "c0", "c1"))
    assert (np.isinf(coarse) ^ np.isinf(fine)).all()
    assert coarse[np.isfinite(coarse)] == pytest.approx(t[np.isfinite(coarse)], abs=2e-4)
    assert fine[np.isfinite(fine)] == pytest.approx(1e-3 - t[np.isfinite(fine)], abs=2e-4)


def test_levels_moments_and_stretches_are_told_from_lines():
    figure, (axis,) = drawn()
    axis.plot(T, np.sin(T), label="force")
    axis.axhline(0.5, **style.KNOWN, label="desired")
    axis.axhspan(-0.1, 0.1, color=style.OK, alpha=0.1)
    axis.axvline(1.0, color=style.FAIL)
    axis.axvspan(2.0, 3.0, color=style.MEASURED, label="lost")
    limited = {"transform": axis.get_xaxis_transform(), "color": style.FAIL, "label": "at its limit"}
    axis.fill_between(T, 0.0, 0.03, where=(T > 1.5) & (T < 1.75), **limited)
    (panel,) = panels_of(figure)
    spec = panel["spec"]
    assert [one["label"] for one in spec["series"]] == ["force", "desired", ""]
    level = panel["columns"][spec["series"][1]["of"]]
    assert (level["o"], np.ptp(codes(level))) == (0.5, 0)
    assert spec["marks"] == [{"x": 1.0, "colour": "fail"}]
    stretches = {colour: (low, high) for low, high, colour in spec["shades"]}
    assert stretches["measured"] == pytest.approx((2.0, 3.0))
    assert stretches["fail"] == pytest.approx((1.5, 1.75), abs=1e-3)
    assert {one["label"] for one in spec["keys"]} == {"lost", "at its limit"}


@pytest.mark.parametrize(
    "draw",
    [
        lambda axis: axis.scatter([1, 2], [1, 2]),
        lambda axis: axis.imshow([[1, 2], [3, 4]]),
        lambda axis: axis.plot(np.cos(T), np.sin(T)),  # x goes back
        lambda axis: axis.text(0.5, 0.5, "a word at a place"),
        lambda axis: axis.plot(T, T, color="red"),  # no token: it could not be turned to dark
        lambda axis: axis.set_yscale("symlog"),
        lambda axis: axis.set_xticks([0, 1], ["foam", "rubber"]),
        lambda axis: axis.invert_yaxis(),
        lambda axis: axis.bar([0, 1], [1, 2]),
    ],
)
def test_what_is_more_than_lines_stays_a_picture_beside_charts(draw):
    figure, (left, right) = drawn(2)
    for axis in (left, right):
        axis.plot(T, T)
    draw(right)
    right.set_title("right", loc="left")
    chart, picture = panels_of(figure)
    assert "spec" in chart
    assert picture["title"] == "right"
    text = base64.b64decode(picture["picture"].split(",")[1]).decode()
    assert "prefers-color-scheme:dark" in text
    assert all(axis.get_visible() for axis in (left, right))


def test_panels_over_one_axis_are_zoomed_together_and_named_alike():
    figure, (left, right) = drawn(2)
    left.plot(T, T, label="network")
    right.plot(T, -T)
    right.set_xlabel("time [s]")
    one, other = panels_of(figure)
    assert one["group"] == other["group"]
    assert one["spec"]["x"] == "time [s]"
    assert other["spec"]["series"][0]["label"] == "network"  # by its colour and style


def test_powers_of_ten_are_kept_to_five_digits():
    figure, (axis,) = drawn()
    x = np.logspace(-6, 6, 50)
    axis.loglog(x, 1.0 / x)
    (panel,) = panels_of(figure)
    assert panel["spec"]["log"] == "xy"
    assert opened(panel["columns"]["t"]) == pytest.approx(x, rel=1e-4)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=12, max_size=300))
def test_any_line_keeps_its_ends_within_a_step(points):
    x, y = np.array(sorted(points)).T
    figure, (axis,) = drawn()
    axis.plot(x, y)
    for panel in panels_of(figure):
        if "spec" in panel:
            values = opened(panel["columns"]["c0"])
            values, step = values[np.isfinite(values)], 1.01 * (np.ptp(y) or 1.0) / 65000
            assert values.max() <= y.max() + step
            assert values.min() >= y.min() - step


def test_labels_are_plain():
    assert plain(r"$\eta$ of $K_{e}$") == "η of Kₑ"
    assert plain("$f_d$ [N]") == "f_d [N]"


def test_the_scripts_draw_nothing_from_elsewhere():
    assert all("http://" not in code.replace("http://www.w3.org", "") for code in panel_scripts())
