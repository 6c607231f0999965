"""The test of force control: its metrics on signals of known answer, its entries."""

import json

import numpy as np
import pytest

from palpate.benchmark.metrics import LINES, PERIOD, ForcePlan, bandwidth, response, run_metrics, step, touch
from palpate.benchmark.simulated import ForceEntry, ForceResult, Surfaces, load_entry, press_surfaces
from palpate.benchmark.summary import best_first, sentence
from palpate.cli import main
from palpate.errors import InputError
from palpate.plugins import permit

RATE = 1000.0
MINE = """
from typing import NamedTuple


class Integral(NamedTuple):
    gain: float
    tick: float
    theta: float

    def start(self):
        return 0.0

    def step(self, state, desired, force, position):
        return self.gain * (desired - force), state
"""


def exponential(final, begin, constant, seconds):
    t = np.arange(round(seconds * RATE)) / RATE
    return np.where(t < begin, 0.0, final * (1.0 - np.exp(-(t - begin) / constant)))


def test_an_exponential_settles_after_its_time_constant_times_ln_20():
    found = touch(exponential(20.0, 0.5, 0.1, 4.0), 20.0, RATE)
    assert found.settling == pytest.approx(0.1 * np.log(20.0), abs=2 / RATE)
    assert found.overshoot == pytest.approx(0.0, abs=1e-9)
    assert found.error == pytest.approx(0.0, abs=1e-6)
    assert (found.bounces, found.lost, found.passed) == (0, 0, True)


def test_losses_of_contact_are_told_by_half_of_the_force():
    force = np.full(4000, 20.0)
    force[:500], force[510:520], force[900:905] = 0.0, 0.0, 0.0
    force[500:510], force[520:600] = 3.0, 5.0
    found = touch(force, 20.0, RATE)
    assert (found.bounces, found.lost, found.passed) == (1, 1, False)
    assert touch(np.zeros(4000), 20.0, RATE).settling is None


def test_a_step_of_first_order_rises_in_its_time_constant_times_ln_9():
    t = np.arange(3000) / RATE
    for before, after in ((20.0, 25.0), (25.0, 20.0)):
        found = step(after - (after - before) * np.exp(-t / 0.08), before, after, RATE)
        assert found.rise == pytest.approx(0.08 * np.log(9.0), abs=2 / RATE)
        assert found.overshoot == 0.0
    ringing = 20.0 + 5.0 * (1.0 - np.exp(-4.0 * t) * np.cos(40.0 * t))
    w, z = np.hypot(4.0, 40.0), 4.0 / np.hypot(4.0, 40.0)
    assert step(ringing, 20.0, 25.0, RATE).overshoot == pytest.approx(
        np.exp(-np.pi * z / np.sqrt(1 - z * z)), rel=0.05
    )
    assert w > 40.0


def test_the_bandwidth_of_a_first_order_loop_is_its_corner():
    frequency, corner = np.array(LINES) / PERIOD, 3.0
    assert bandwidth(frequency, 1.0 / (1.0 + 1j * frequency / corner)) == pytest.approx(
        corner,
        rel=0.02,  # between two lines the logarithm is not quite straight
    )
    assert bandwidth(frequency, np.ones(len(frequency))) is None
    assert bandwidth(frequency, np.full(len(frequency), 0.5)) == frequency[0]


def test_a_delayed_copy_of_the_desired_force_has_its_response_and_rejects_nothing():
    plan, late = ForcePlan(20.0, RATE), 10
    wanted = plan.desired_force()
    force = np.concatenate([np.full(late, wanted[0]), wanted[:-late]])
    sines = plan.starts[2] + plan.ticks(PERIOD)
    ratio = response(force[sines:], wanted[sines:], LINES, 3)
    assert ratio == pytest.approx(np.exp(-2j * np.pi * np.array(LINES) / PERIOD * late / RATE), abs=1e-9)
    t = np.arange(len(plan.steady())) / RATE
    swayed = plan.steady() + 5.0 * np.sin(np.pi * t)
    hard, soft = (exponential(peak, 0.5, 0.1, 4.0) for peak in (60.0, 20.0))
    found = run_metrics(plan, force, swayed, 5.0, hard, soft)
    assert (found.layers.overshoot, found.layers.settling) == (pytest.approx(2.0), None)
    assert found.cable.settling == pytest.approx(0.1 * np.log(20.0), abs=2 / RATE)
    assert found.disturbance == pytest.approx(1.0, rel=1e-3)
    assert found.bandwidth is None
    assert found.resonance == pytest.approx(1.0)


def test_the_sum_of_sines_stays_in_contact_and_under_a_quarter():
    plan = ForcePlan(20.0, 500.0)
    assert np.abs(plan.sines()).max() < 0.25 * plan.force
    assert len(plan.desired_force()) == plan.starts[-1]


def test_every_entry_gets_the_same_presses_and_the_law_passes_where_an_integral_does_not(tmp_path):
    (tmp_path / "entrant.py").write_text(MINE)
    (tmp_path / "entry.toml").write_text('[controller]\nkind = "entrant:Integral"\ngain = 1e-4\n')
    permit("entrant:Integral")
    entry = load_entry(tmp_path / "entry.toml")
    gains = entry.gains(20.0)
    law = entry.build(gains).law
    assert (law.gain, law.tick, law.theta) == (1e-4, gains.arm.tick, gains.theta)
    surfaces = Surfaces(1e3, 1e5, count=2, repeats=1)
    cautious, again = (press_surfaces(ForceEntry({"kind": "cautious"}), 20.0, surfaces) for _ in range(2))
    assert cautious.runs == again.runs
    assert cautious.passes == 2
    integral = press_surfaces(entry, 20.0, surfaces)
    for runs in (cautious.runs, integral.runs):
        assert runs[1].layers.overshoot == pytest.approx(
            runs[1].touch.overshoot, abs=0.02
        )  # the hardest hides none
    assert (
        cautious.runs[0].touch.overshoot + 0.2 < cautious.runs[0].layers.overshoot < 4.0
    )  # F_max is five times 20 N
    assert integral.passes < 2
    assert best_first([integral, cautious])[0] is cautious
    assert "2 of 2 presses" in sentence([integral, cautious])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[controller]\nkind = "nobody"\n', "unknown controller"),
        ('[controller]\nkind = "cautious"\nmass = 2.0\n', "takes no numbers"),
        ("[controller]\ngain = 2.0\n", "needs kind"),
        ('arm = "ur6"\n[controller]\nkind = "cautious"\n', "ur6"),
        ('speed = 1\n[controller]\nkind = "cautious"\n', "speed"),
        ('[controller]\nkind = "entrant:Integral"\ngain = 1.0\nkp = 2.0\n', "kp"),
        ('[controller]\nkind = "entrant:Integral"\n', "needs gain"),
    ],
)
def test_a_wrong_entry_is_one_line(tmp_path, capsys, text, words):
    module = f"entrant_{abs(hash(text))}"
    (tmp_path / f"{module}.py").write_text(MINE)
    (tmp_path / "entry.toml").write_text(text.replace("entrant", module))
    assert main(["benchmark", "force", str(tmp_path / "entry.toml"), "--plugins"]) == 2
    message = capsys.readouterr().err.strip()
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "words",
    [["--stiffness", "5:1"], ["--stiffness", "0"], ["--repeats", "0"], ["--force", "1e9"], ["nothing.toml"]],
)
def test_wrong_options_end_with_exit_code_2(capsys, words):
    assert main(["benchmark", "force", *words]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_command_prints_its_numbers(capsys):
    assert main(["benchmark", "force", "--surfaces", "2", "--repeats", "1", "--json"]) == 0
    entry = json.loads(capsys.readouterr().out)["entries"][0]
    assert entry["passed"] == entry["presses"] == 2
    assert [row["stiffness_N_per_m"] for row in entry["surfaces"]] == pytest.approx([1e3, 1e5])


def test_a_result_is_ranked_by_its_failures_first():
    plan = ForcePlan(20.0, RATE)
    good, bad = exponential(20.0, 0.2, 0.1, 18.0), exponential(16.0, 0.2, 0.01, 18.0)
    results = [
        ForceResult(name, "arm", plan, {1e3: (run_metrics(plan, force, plan.steady(), 1.0, force, force),)})
        for name, force in (("bad", bad), ("good", good))
    ]
    assert [one.name for one in best_first(results)] == ["good", "bad"]


def test_surfaces_refuse_what_is_no_range():
    with pytest.raises(InputError, match="LOW:HIGH"):
        Surfaces(2.0, 1.0)
