"""The test of force control: its metrics on signals of known answer, its entries, its page."""

import json

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate.logs import write_record
from palpate.plugins import permit
from palpate.records import Record
from palpate_benchmark.entry import ForceEntry, load_entry, shipped_controllers
from palpate_benchmark.metrics import bandwidth, of_run, response, settling_time, step, touch
from palpate_benchmark.plan import LINES, PERIOD, ForcePlan
from palpate_benchmark.recorded import judge
from palpate_benchmark.simulated import ForceResult, OnSurface, Surfaces, press_surfaces
from palpate_benchmark.summary import best_first, sentence
from wires.slow_cell import WORDS, arm, cell

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
    assert settling_time(np.full(1000, 18.0), 20.0, RATE) is None


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
    found = of_run(plan, force, swayed, at_rest=5.0)
    assert found.disturbance == pytest.approx(1.0, rel=1e-3)
    assert found.bandwidth is None
    assert found.resonance == pytest.approx(1.0)


def test_the_sum_of_sines_stays_in_contact_and_under_a_quarter():
    plan = ForcePlan(20.0, 500.0)
    assert np.abs(plan.sines()).max() < 0.25 * plan.force
    assert len(plan.desired_force()) == plan.starts[-1]


def test_every_entry_gets_the_same_presses_and_the_law_passes_where_an_integral_does_not(tmp_path):
    surfaces = Surfaces(1e3, 1e5, count=2, repeats=1)
    own, again = (press_surfaces(ForceEntry({"kind": "cautious"}), 20.0, surfaces) for _ in range(2))
    assert own.runs == again.runs
    assert own.passes == 2
    other = press_surfaces(ForceEntry({"kind": "fixed integral, 7 kN/m"}), 20.0, surfaces)
    assert other.passes < 2
    assert best_first([other, own])[0] is own
    assert "2 of 2 presses" in sentence([own, other])


def test_a_plug_in_enters_by_a_file(tmp_path):
    (tmp_path / "entrant.py").write_text(MINE)
    text = '[controller]\nkind = "entrant:Integral"\ngain = 1e-4\n'
    (tmp_path / "entry.toml").write_text(text)
    permit("entrant:Integral")
    entry = load_entry(tmp_path / "entry.toml")
    gains = entry.gains(20.0)
    law = entry.build(gains, 0).law
    assert (law.gain, law.tick, law.theta) == (1e-4, gains.arm.tick, gains.theta)
    surfaces = Surfaces(1e4, 1e4, count=1, repeats=1)
    same = press_surfaces(ForceEntry({"kind": "fixed integral, stiffest"}), 20.0, surfaces)
    gain = ForceEntry({"kind": "fixed integral, stiffest"}).build(gains, 0).law.gain
    plugged = ForceEntry({"kind": "entrant:Integral", "gain": gain})
    assert press_surfaces(plugged, 20.0, surfaces).runs == same.runs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[controller]\nkind = "nobody"\n', "unknown controller"),
        ('[controller]\nkind = "impedance"\nmass = 2.0\n', "takes no numbers"),
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
    [
        ["--stiffness", "5:1"],
        ["--stiffness", "0"],
        ["--repeats", "0"],
        ["--force", "1e9"],
        ["--record", "nowhere"],
        ["nothing.toml"],
        ["--record", "nowhere", "--shipped"],
    ],
)
def test_wrong_options_end_with_exit_code_2(capsys, words):
    assert main(["benchmark", "force", *words]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_command_writes_a_page_and_its_numbers(tmp_path, capsys):
    out = tmp_path / "board"
    words = ["benchmark", "force", "--surfaces", "2", "--repeats", "1", "--out", str(out), "--json"]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["entries"][0]["passed"] == found["entries"][0]["presses"] == 2
    assert [own["stiffness_N_per_m"] for own in found["entries"][0]["surfaces"]] == pytest.approx([1e3, 1e5])
    assert json.loads((out / "result.json").read_text())["entries"] == found["entries"]
    page = (out / "report.html").read_text()
    assert "Test of force control" in page
    assert "<script>alert" not in page
    assert main(words) == 2


def test_ablations_of_the_law_are_not_shipped_as_entries():
    names = shipped_controllers("ur5e")
    assert "cautious" in names
    assert "impedance" in names
    assert not [name for name in names if name.startswith("cautious,")]


@pytest.mark.parametrize(("noise", "theta"), [(0.0, 0.0), (0.5, 0.04)])
def test_recorded_presses_are_judged_as_simulated_ones(tmp_path, noise, theta):
    """Noise of 2.5 % of the force is none of it: the mean over the lag has settled when the force has."""
    rate, hold = 500.0, 6.0
    t = np.arange(round((0.5 + hold) * rate)) / rate
    since = np.maximum(t - 0.5, 0.0)
    third, sixth = hold / 3.0, hold / 18.0
    lowered = (since >= third) & (since < 2 * third) & (((since - third) // sixth) % 2 == 0)
    wanted = 20.0 * (1.0 - 0.2 * lowered)
    force, state = np.zeros(len(t)), 0.0
    for k in range(len(t)):
        state += (wanted[k] * (t[k] >= 0.5) - state) / rate / 0.05
        force[k] = state
    force = force + noise * np.random.default_rng(3).standard_normal(len(t))
    columns = {"t": t, "force_sampled": force, "phase": (t >= 0.5) * 1.0}
    about = {"title": "an arm", "desired_N": 20.0, "hold_s": hold, "probe": 0.2, "theta_s": theta}
    write_record(
        Record(columns, {"t": "s", "force_sampled": "N", "phase": "1"}, {"wire": about}),
        tmp_path / "record.parquet",
    )
    result = judge((tmp_path / "record.parquet",))
    (run,) = result.runs
    assert run.touch.settling == pytest.approx(0.05 * np.log(20.0), abs=0.01 + theta)
    if noise == 0.0:
        assert run.touch.passed
        assert run.up.rise == pytest.approx(0.05 * np.log(9.0), abs=0.01)
        assert run.down.rise == pytest.approx(0.05 * np.log(9.0), abs=0.01)
    assert run.bandwidth is None
    assert "an arm: 1 of 1 presses" in sentence([result])


def test_a_result_is_ranked_by_its_failures_first():
    plan = ForcePlan(20.0, RATE)
    good, bad = exponential(20.0, 0.2, 0.1, 18.0), exponential(16.0, 0.2, 0.01, 18.0)
    results = [
        ForceResult(name, "arm", plan, (OnSurface(1e3, (of_run(plan, force, None, 1.0),), force),))
        for name, force in (("bad", bad), ("good", good))
    ]
    assert [one.name for one in best_first(results)] == ["good", "bad"]


@pytest.mark.long
def test_a_press_over_a_wire_is_judged_by_its_record(tmp_path, capsys):
    """A simulated arm in a process of its own, in real time, of a lag that a busy machine keeps to."""
    gains, record = cell(tmp_path), tmp_path / "first"
    with arm(tmp_path) as (_, address):
        press = ["press", "--wire", address, "--gains", str(gains), *WORDS]
        press += ["--probe", "0.2", "--seconds", "14"]
        assert main([*press, "--yes", "--record", str(record)]) == 0
    capsys.readouterr()
    assert main(["benchmark", "force", "--record", str(record), "--json"]) in {0, 1}
    found = json.loads(capsys.readouterr().out)["entries"][0]
    assert found["settled"] == 1
    assert found["step_rise_s"] is not None


def test_surfaces_refuse_what_is_no_range():
    with pytest.raises(InputError, match="LOW:HIGH"):
        Surfaces(2.0, 1.0)
