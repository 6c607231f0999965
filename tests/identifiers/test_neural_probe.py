"""The network beside the surface: what it learns, what it answers, and when its answer is doubted."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identifiers import NeuralProbe, watch
from palpate.identifiers.neural_probe import SETTINGS
from palpate.records import Record

K, B, M = 5000.0, 300.0, 3.0

FOAM = SETTINGS["foam"]


def pressing(n, seed=0):
    """Displacement, velocity and acceleration within a foam's ranges, each on its own, and the force of (5.1)."""
    generator = np.random.default_rng(seed)
    phi = generator.uniform((0.5e-3, -0.01, -1.0), (3e-3, 0.02, 1.5), (n, 3))
    return phi, phi @ (K, B, M)


def test_it_finds_a_spring_damper_and_mass_that_are_well_excited():
    phi, force = pressing(200_000)
    probe = NeuralProbe.thesis("foam", amplitude=60.0, learning_rate=3e-5, thresholds=False)
    probe.update_many(phi, force)
    found = probe.probe()
    assert found.stiffness == pytest.approx(K, rel=0.1)
    assert found.damping == pytest.approx(B, rel=0.3)
    assert found.mass == pytest.approx(M, rel=0.3)
    assert found.warnings == ()
    assert found.force_at_zero == 0.0


def test_a_probe_outside_what_was_learned_is_warned_of():
    phi, force = pressing(500)
    probe = NeuralProbe.thesis("foam")
    assert [code for code, _ in probe.probe().warnings] == ["probe-outside-learned"]
    probe.update_many(phi, force)
    assert probe.probe().warnings == ()
    codes = probe.probe(displacement=4e-3, acceleration=-1.2).warnings
    assert [code for code, _ in codes] == ["probe-outside-learned"] * 2
    assert "displacement 0.004 m" in codes[0][1]
    assert "acceleration -1.2 m/s^2" in codes[1][1]


def test_it_never_claims_to_have_identified():
    probe = NeuralProbe.thesis("foam")
    probe.update_many(*pressing(500))
    estimate = probe.estimate()
    assert estimate.names == ("K", "B", "M")
    assert set(estimate.verdicts().values()) == {"not identifiable"}
    assert estimate.theta[0] == probe.probe().stiffness


def test_watch_takes_a_run_s_contact_only():
    phi, force = pressing(300)
    phase = np.repeat([0.0, 1.0, 2.0], 100)
    columns = dict(zip(("displacement", "vx_raw", "ax_measured"), phi.T.copy(), strict=True))
    columns |= {"t": np.arange(300) * 1e-3, "phase": phase, "force_measured": force}
    record = Record(columns, dict.fromkeys(columns, "1"), {"seed": 5})
    probe, own = NeuralProbe.thesis("foam"), NeuralProbe.thesis("foam")
    answers = watch(record, probe)
    own.update_many(phi[100:200], force[100:200])
    assert len(answers) == 100
    assert answers["t"][0] == 0.0
    assert answers["K"][-1] == pytest.approx(own.probe().stiffness)
    assert answers.units["B"] == "N s/m"
    assert answers.meta["seed"] == 5
    without = Record({**columns, "phase": np.zeros(300)}, dict.fromkeys(columns, "1"))
    with pytest.raises(InputError, match="no contact"):
        watch(without, probe)


@pytest.mark.parametrize(
    "wrong",
    [
        {"setting": FOAM._replace(values=(0.0, 0.01, 1.0))},
        {"setting": FOAM._replace(values=(0.002, 0.01))},
        {"setting": FOAM._replace(scale=(1.0, np.inf, 1.0))},
        {"amplitude": -1.0},
        {"learning_rate": 0.0},
        {"layers": (0,)},
    ],
)
def test_numbers_out_of_range_are_refused(wrong):
    with pytest.raises(InputError):
        NeuralProbe(**{"setting": FOAM, **wrong})
