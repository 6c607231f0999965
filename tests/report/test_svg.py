"""A figure as SVG: the same picture gives the same bytes."""

import matplotlib.pyplot as plt
import pytest

from palpate.report.style import svg


def drawn(left: float) -> bytes:
    """A line in axes, which clip it."""
    figure = plt.figure()
    try:
        figure.add_axes((left, 0.1, 0.8, 0.8)).plot([0.0, 1.0], [0.0, 1.0])
        return svg(figure)
    finally:
        plt.close(figure)


@pytest.mark.parametrize("left", [0.1, 0.12])
def test_the_last_bit_of_a_layout_changes_no_byte(left):
    assert drawn(left) == drawn(left * (1.0 + 1e-15))
    assert drawn(left) != drawn(left + 0.01)
