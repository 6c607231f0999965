"""A chart in a figure and in a page: the same lines, levels and marks, over the same axes."""

import numpy as np
import pytest

from palpate.report.chart import (
    ABSENT,
    COLOURS,
    KNOWN,
    MAX_POINTS,
    Band,
    Chart,
    Mark,
    Series,
    build_figure,
    panels,
)

T = np.linspace(0.0, 4.0, 40_001)


def opened(column):
    """As the page reads it; gaps and places that a line does not have are not numbers."""
    return np.array([np.nan if v in (ABSENT, None) else v for v in column], dtype=float)


def force():
    values = np.sin(T)
    values[12_345] = 9.0
    return Chart(
        "force [N]",
        [Series(T, values, "F", "true"), Series(T[::1000], T[::1000], "measured", "reading", dots=4.0)],
        [Band(0.5, 0.5, label="desired", **KNOWN), Band(-0.1, 0.1, "measured")],
        [Mark([(1.0, 1.0)], "fail"), Mark([(2.0, 3.0)], "warn", "slower")],
        xlim=(0.0, 3.5),
    )


def test_a_figure_and_a_page_show_the_same():
    chart, below = force(), Chart("depth [mm]", [Series(T, T, "K")], x="time [s]", xlim=(0.0, 3.5), log="y")
    axis, lower = build_figure([chart, below]).axes
    shown, under = panels([chart, below])
    spec, columns = shown["spec"], shown["columns"]
    t, true = opened(columns["t"]), opened(columns["c0"])
    assert len(t) <= 1.1 * MAX_POINTS
    assert np.nanmax(true) == pytest.approx(np.max(axis.lines[0].get_ydata()), abs=1e-3)  # its peak is kept
    assert axis.lines[0].get_color() == COLOURS[spec["series"][0]["colour"]]
    assert axis.get_xlim() == pytest.approx((t[0], t[-1]), abs=1e-3)
    assert axis.get_ylim() == pytest.approx(spec["range"])
    assert lower.get_ylim() == pytest.approx(under["spec"]["range"])
    assert lower.get_yscale() == "log"
    assert under["spec"]["log"] == "y"
    legend = [text.get_text() for text in axis.get_legend().get_texts()]
    named = [one["label"] for one in (*spec["series"], *spec["keys"]) if not one.get("silent")]
    assert legend == named == ["true", "reading", "desired", "slower"]
    assert spec["marks"] == [{"x": 1.0, "colour": "fail"}]
    assert spec["shades"] == [[2.0, 3.0, "warn"]]
    assert shown["group"] == under["group"]
    assert spec["x"] == under["spec"]["x"] == "time [s]"  # from the one that it is zoomed with
    assert (spec["unit"], under["spec"]["series"][0]["label"]) == ("s", "depth")


@pytest.mark.parametrize("offset", [0.0, 1e3, -1e-4])
def test_a_page_has_a_column_to_a_ten_thousandth_of_its_range(offset):
    y = offset + 1e-3 * np.sin(T[::100])
    (shown,) = panels([Chart("depth [m]", [Series(T[::100], y, "F")])])
    assert opened(shown["columns"]["c0"]) == pytest.approx(y, abs=1e-4 * np.ptp(y))


def test_a_page_tells_a_gap_from_a_place_that_a_line_lacks():
    whole, coarse = np.where(T > 3.0, np.nan, T), T[::1000]
    chart = Chart("force [N]", [Series(T, whole, "F"), Series(coarse, coarse, "measured")])
    columns = panels([chart])[0]["columns"]
    assert None in columns["c0"]
    assert ABSENT in columns["c1"]
    assert None not in columns["c1"]
