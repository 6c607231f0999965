"""Block diagrams follow the program: a step that is renamed, added or left out changes the figure, or fails here."""

import inspect

import numpy as np
import pytest

from palpate.controllers import hybrid, neural
from palpate.identifiers import neural_probe
from palpate_thesis.blocks import blocks_of, read_blocks
from palpate_thesis.figures import fig_4_03_5_03 as diagrams

SOURCE = inspect.getsource(neural)


def test_arrows_are_the_values_that_each_step_uses():
    blocks = blocks_of(neural, "Neural.step")
    assert {"u_x", "u_f"} <= blocks["torque"].inputs
    assert {"torque", "sense.x", "state.x"} <= blocks["see"].inputs
    assert {"torque", "command"} == blocks["return"].inputs
    assert blocks["net.learn"].inputs == {"net.want"}
    assert [blocks[name].equation for name in ("u_x", "u_f", "torque")] == ["(4.19)", "(4.20)", "(4.18)"]


def test_the_identifier_learns_from_what_its_answer_lacks():
    blocks = blocks_of(neural_probe, "absorb")
    assert blocks["error"].inputs == {"y", "answer"}
    assert "error" in blocks["backward"].inputs
    assert list(blocks) == ["x, v, a", "answer", "error", "backward", "descend"]


@pytest.mark.parametrize(
    ("module", "function", "places"),
    [
        (neural, "Neural.step", diagrams.CONTROLLER),
        (neural_probe, "absorb", diagrams.IDENTIFIER),
        (hybrid, "Hybrid.step", diagrams.HYBRID),
    ],
)
def test_every_step_has_a_place_and_every_place_a_step(module, function, places):
    assert set(blocks_of(module, function)) == set(places)


def test_an_arrow_goes_with_the_value_that_a_step_no_longer_uses():
    changed = SOURCE.replace("task.f, u_f)  # (4.18)", "task.f, task.f)  # (4.18)")
    assert changed != SOURCE
    assert "u_f" not in read_blocks(changed, "Neural.step")["torque"].inputs


def test_a_new_step_is_a_new_block():
    changed = SOURCE.replace(
        "        see(memory.signals,", "        extra = 2.0 * torque\n        see(memory.signals,"
    )
    assert set(read_blocks(changed, "Neural.step")) == {*diagrams.CONTROLLER, "extra"}


def test_networks_are_drawn_with_all_their_neurons_and_inputs():
    for study, neurons, weights in (
        (diagrams.STUDIES[2], 24, 9 * 12 + 12 * 3),
        (diagrams.STUDIES[4], 8, 3 * 4 + 4),
    ):
        (axis,) = study.plot(None).axes
        dots = [line for line in axis.lines if line.get_marker() == "o"]
        assert sum(len(np.asarray(line.get_xdata())) for line in dots) == neurons
        assert len(axis.lines) - len(dots) == weights
