"""`palpate tune` and `palpate certify` as a user types them."""

from __future__ import annotations

import json
from math import inf

import numpy as np
import pytest
from msgspec.structs import replace

from cli import asked
from cli.asked import refused
from force.gained import gains_of, servo_gains
from force.test_inner_loop import TRUE
from force.test_inner_loop import log as loop_log
from force.test_servo import pushed_log
from palpate.cli import main
from palpate.force import Certificate, ForceLoop, known_from, load_arm, tune
from palpate.force.arm import ServoLoop
from palpate.force.gains import LAW
from palpate.units import quantity

CONTRACT = {
    "arm", "kind", "rate_hz", "theta_s", "gains", "approach_speed_m_s", "peak_N", "settling_s", "overshoot",
    "margins", "proved", "exact", "estimate", "warnings",
}  # fmt: skip
RANGE = ("--stiffness", "1e2:1e6", "--arm", "ur5e", "--force", "20")


def ask(capsys, *words):
    return asked.ask(capsys, "tune", *words)


def found(K=5000.0, half=200.0, unit="N/m", B=20.0, **others):
    def one(value, width, of):
        return {
            "value": value, "std": width / 2, "ci95": [value - width, value + width], "unit": of,
            "verdict": "identified", "reason": "",
        }  # fmt: skip

    return {
        "model": "kelvin-voigt",
        "parameters": {"K": one(K, half, unit), "B": one(B, 5.0, "N s/m")},
        **others,
    }


@pytest.mark.long
def test_the_contract_of_json(capsys, elsewhere):
    code, told = ask(capsys, *RANGE, "--out", "gains.toml", "--report", "page.html")
    assert code == 0
    assert set(told) >= CONTRACT
    assert set(told["margins"]) == {"gain", "phase_deg", "delay_s"}
    low, high = told["proved"]["stiffness"]
    assert low < 1e2
    assert high >= 1e6
    assert told["exact"]["stiffness"][1] >= high
    assert told["proved"]["jitter_ticks"] == 0
    assert told["proved"]["ages_ticks"] == [0, 2]  # the sensor's own are 0 to 1.04
    assert told["margins"]["gain"] > 3.0
    assert 0.0 < told["overshoot"] < 0.1
    assert told["domain"]["overshoot"] == 0.1
    assert 1e2 < told["domain"]["stiffness"][0] < 1e3
    assert told["domain"]["stiffness"][1] == 1e6
    page = (elsewhere / "page.html").read_text(encoding="utf-8")
    assert "not proved" in page.lower()
    loop = ForceLoop.load("gains.toml")
    assert 0.0 < loop.update(0.0, 0.0) <= told["approach_speed_m_s"]


@pytest.mark.long
def test_gains_certificate_and_check(capsys, elsewhere):
    (elsewhere / "gains.toml").write_text(gains_of(cap=2e4).to_toml())
    assert main(["certify", "gains.toml", "--held-only", "--out", "proof.json", "--json"]) == 0
    capsys.readouterr()
    assert main(["certify", "--check", "proof.json", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["holds"] is True
    assert told["contraction"] > 1e2 * told["rounding"]
    assert main(["certify", "gains.toml", "--check", "proof.json"]) == 0
    holds, surfaces, constant, *_ = capsys.readouterr().out.splitlines()
    assert holds.startswith("✓ The certificate holds: ")
    assert "K + B/theta" in surfaces
    (held, _) = told["claims"]
    low, high = held["felt_stiffness"]
    assert gains_of(cap=2e4).arm.surface(high) > 1e9, "as much as the arm alone has: the surface may be rigid"
    assert f" {quantity(low, 'N/m')} up; B/K" in constant
    assert main(["certify", "gains.toml", "--check", "proof.json", "--verbose"]) == 0
    assert "Not covered: " in capsys.readouterr().out
    (elsewhere / "other.toml").write_text(gains_of(cap=1e4).to_toml())
    assert "another cap" in refused(capsys, "certify", "other.toml", "--check", "proof.json")
    spoiled = json.loads((elsewhere / "proof.json").read_text())
    spoiled["claims"][0]["shares"] = [1.0, 3.0]
    (elsewhere / "spoiled.json").write_text(json.dumps(spoiled))
    assert main(["certify", "--check", "spoiled.json"]) == 1
    assert "✕ The certificate does not hold: " in capsys.readouterr().out
    (elsewhere / "none.json").write_text("{}")
    capsys.readouterr()
    assert "no certificate" in refused(capsys, "certify", "--check", "none.json")


@pytest.mark.long
def test_what_cannot_be_proved_is_exit_code_1(capsys, elsewhere):
    (elsewhere / "gains.toml").write_text(gains_of(cap=1e4).to_toml())
    assert (
        main(["certify", "gains.toml", "--held-only", "--stiffness", "1e4:2e5", "--out", "proof.json"]) == 1
    )
    assert [c.kind for c in Certificate.load(elsewhere / "proof.json").claims] == ["one-sided"]


@pytest.mark.long
def test_an_adapting_gain_that_is_not_proved_is_exit_code_1(capsys, elsewhere):
    """Of a servo, on surfaces above its cap: the gain of the cap is stable there, the adapting gain is not proved."""
    (elsewhere / "gains.toml").write_text(replace(servo_gains(), cap=1e4).to_toml())
    assert main(["certify", "gains.toml", "--stiffness", "9e4:1e5", "--damping-time", "0:0"]) == 1
    assert "Not proved: the adapting gain." in capsys.readouterr().out


def test_from_what_identify_printed(capsys, elsewhere):
    """With its warnings: an untared, saturated or wrongly signed sensor is found out there."""
    warnings = [{"code": "saturated", "text": "the force stands at its end"}]
    (elsewhere / "found.json").write_text(json.dumps(found(warnings=warnings)))
    code, told = ask(capsys, "found.json", "--arm", "ur5e", "--force", "20")
    assert code == 0
    assert set(told) >= CONTRACT
    assert told["warnings"] == warnings
    assert told["estimate"]["stiffness"] == 5000.0
    assert told["gains"]["stiffness_cap"] == pytest.approx(5200.0 + 25.0 / told["theta_s"])
    low, high = told["proved"]["stiffness"]
    assert low < 4800.0
    assert high > 5200.0


def unbounded(**given):
    own = found()
    own["parameters"]["B"] = {
        "value": None,
        "ci95": None,
        "verdict": "rejected",
        "reason": "the lag",
        **given,
    }
    return own


def test_a_damping_that_nothing_bounds_is_asked_for(capsys, elsewhere):
    (elsewhere / "found.json").write_text(json.dumps(unbounded()))
    words = ("tune", "found.json", "--arm", "ur5e", "--force", "20")
    said = refused(capsys, *words)
    assert "does not bound the damping B (the lag)" in said
    assert "--damping-max" in said
    assert "0 N s/m or more" in refused(capsys, *words, "--damping-max", "-1")
    code, told = ask(capsys, *words[1:], "--damping-max", "200")
    assert code == 0
    assert told["assumed"] == {}
    assert told["gains"]["stiffness_cap"] == pytest.approx(5200.0 + 200.0 / told["theta_s"])


@pytest.mark.parametrize(
    ("B", "high"),
    [
        ({"ci95": [-24.0, 205.0], "unit": "N s/m", "verdict": "not identifiable"}, 205.0),
        ({"value": 100.0, "ci95": [20.0, 180.0], "unit": "N s/m", "verdict": "not identifiable"}, 180.0),
        ({"ci95": [-24.0, -3.0], "unit": "N s/m", "verdict": "not identifiable"}, 0.0),
        ({"ci95": [-24.0, 205.0], "unit": "N s/m^2.5"}, inf),
    ],
)
def test_a_damping_that_is_not_identified_counts_at_its_upper_end(B, high):
    known = known_from(unbounded(**B), "found.json")
    assert known.damping[1] == high
    assert known.assumed["damping"].value == high
    whole = {"logs": [unbounded(**B), found()], "pooled": {"parameters": {"K": found()["parameters"]["K"]}}}
    assert known_from(whole, "found.json").damping[1] == max(high, 25.0)


def test_the_answer_is_a_few_lines_and_all_evidence_a_flag_away(capsys, elsewhere):
    B = {"ci95": [-24.0, 205.0], "unit": "N s/m", "verdict": "not identifiable"}
    (elsewhere / "found.json").write_text(json.dumps(unbounded(**B)))
    words = ["tune", "found.json", "--arm", "ur5e", "--force", "20"]
    assert main([*words, "--out", "gains.toml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 14
    assert "surfaces up to 10.9 kN/m.   ✓ proved stable   written: gains.toml" in lines[0]
    assert (
        "! B is unknown: 205 N s/m assumed (the upper end of its 95 % interval, -24 to 205 N s/m)." in lines
    )
    assert main([*words, "--verbose"]) == 0
    assert "not covered by a proof: " in capsys.readouterr().out


def test_far_beyond_the_force_of_the_log_the_arm_s_own_cap_holds():
    arm, point = load_arm("ur5e"), {"force_N": 4.0}
    known = known_from(found(8000.0, 0.0, B=40.0, working_point=point), "found.json")
    near, far = (tune(arm, force, known, prove_adapting=False) for force in (8.0, 8.1))
    assert near.gains.cap < 2e4
    assert far.gains.cap == arm.limits.stiffness
    assert next(code for code, _ in far.warnings) == "force-beyond-log"
    assert tune(arm, 8.1, known, cap=2e4, prove_adapting=False).gains.cap == 2e4


def test_a_mass_of_the_surface_is_in_no_proof_and_said():
    mass = {"value": 2.0, "ci95": [1.5, 2.5], "unit": "kg", "verdict": "identified"}
    whole = found(8000.0, 0.0, B=40.0)
    whole["parameters"]["M"] = mass
    assert "surface-mass" in dict(known_from(whole, "found.json").warnings)


def test_a_surface_behind_a_compliant_arm_is_stiffer_than_the_log(capsys, elsewhere):
    warnings = [{"code": "series-compliance", "text": "the pose comes from the joints"}]
    arm = load_arm("ur5e")
    known = known_from(found(8000.0, 0.0, B=40.0, warnings=warnings), "found.json").beyond(arm)
    assert known.stiffness == pytest.approx((8000.0, arm.surface(8000.0)))
    assert known.damping[1] == pytest.approx(45.0 * (arm.surface(8000.0) / 8000.0) ** 2)
    assert known.beyond(arm) == known
    stiff = known_from(found(6e4, 0.0, warnings=warnings), "found.json").beyond(arm)
    assert stiff.stiffness[1] == arm.limits.stiffness


@pytest.mark.long
def test_the_working_point_goes_first_and_what_is_rough_is_said(capsys, elsewhere, root):
    """An estimate as wide as the margin, and a delay that is no whole number of ticks."""
    stiffness = {"value": 7000.0, "ci95": [6900.0, 7100.0], "prediction95": [1000.0, 9000.0], "unit": "N/m"}
    (elsewhere / "found.json").write_text(json.dumps(found(working_point={"stiffness": stiffness})))
    (elsewhere / "mine.toml").write_text(arm_text(root, "delay = 0.01", "delay = 0.0113"))
    told = ask(capsys, "found.json", "--arm", "mine.toml", "--force", "20")[1]
    assert told["estimate"]["stiffness_interval"] == [1000.0, 9000.0]
    wide, rounded = told["warnings"]
    assert wide["code"] == "wide-estimate"
    assert "palpate excite --stiffness 1e+03:9e+03" in wide["text"]
    assert "11.3 ms is no whole number of ticks; 6 were taken" in rounded["text"]


@pytest.mark.long
def test_straight_from_a_log(capsys, root):
    log = root / "examples" / "data" / "press.csv"
    code, told = ask(
        capsys, log, "--time", "time_s", "--position", "position_mm:mm", "--force", "20", "--arm", "ur5e",
        "--force-column", "force_N:N",
    )  # fmt: skip
    assert code == 0
    low, high = told["estimate"]["stiffness_interval"]
    assert 0.0 < low < told["estimate"]["stiffness"] < high


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--arm", "ur5e", "--force", "20"), "the surface is missing"),
        (("--stiffness", "1e4:1e2", "--arm", "ur5e", "--force", "20"), "interval"),
        (("--stiffness", "0:1e4", "--arm", "ur5e", "--force", "20"), "above 0"),
        (("--stiffness", "-5:1e4", "--arm", "ur5e", "--force", "20"), "above 0"),
        (("--stiffness", "1e2:nan", "--arm", "ur5e", "--force", "20"), "number"),
        (("--stiffness", "1e2:1e300", "--arm", "fr3", "--force", "20"), "between 1e-15 and 1e+12"),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "0"), "above 0 N"),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "-20"), "above 0 N"),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "0.5"), "noise"),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "200"), "full scale"),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "20:parsec"), "unit"),
        (("--stiffness", "1e2:1e4", "--arm", "r2d2", "--force", "20"), "unknown arm"),
        (("--stiffness", "1e2:1e4", "--arm", "no.toml", "--force", "20"), "no.toml"),
        (
            ("--stiffness", "1e2:1e4", "--stiffness-cap", "1e3", "--arm", "ur5e", "--force", "20"),
            "below what",
        ),
        (
            ("--stiffness", "1e2:1e6", "--force-max", "20.5", "--arm", "ur5e", "--force", "20"),
            "must be above 22.4 N",
        ),
        (("--stiffness", "1e2:1e4", "--arm", "ur5e", "--force", "20", "--out", "g.json"), "toml"),
        (("missing.json", "--arm", "ur5e", "--force", "20"), "missing.json"),
        (("x.json", "--stiffness", "1:2", "--arm", "ur5e", "--force", "20"), "not both"),
    ],
)
def test_bad_input_is_one_line(capsys, words, says):
    assert says in refused(capsys, "tune", *words)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[1, 2]", "identify"),
        ("{}", "identify"),
        ("{", "JSON"),
        (json.dumps({"parameters": {"B": {}}}), "no interval"),
        (
            json.dumps({"parameters": {"K": {"value": None, "ci95": None, "reason": "too little moved"}}}),
            "too little moved",
        ),
        (json.dumps(found(unit="1/m")), "1/m"),
        (json.dumps(found(K=-500.0, half=10.0)), "press on"),
        (json.dumps({"logs": [], "pooled": None}), "identify"),
        (json.dumps({"logs": [], "pooled": [1]}), "identify"),
        (
            json.dumps({"parameters": {"K": {"value": 1e3, "ci95": [500, True], "unit": "N/m"}}}),
            "no interval",
        ),
    ],
)
def test_a_bad_identification_is_one_line(capsys, elsewhere, text, says):
    (elsewhere / "found.json").write_text(text)
    assert says in refused(capsys, "tune", "found.json", "--arm", "ur5e", "--force", "20")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "nothing to certify"),
        (("gains.toml", "--jitter", "-1"), "jitter"),
        (("gains.toml", "--stiffness", "5:1"), "lower end"),
        (("gains.toml", "--damping-time", "0.1:0.2"), "0:T"),
        (("gains.toml", "--out", "proof.txt"), "json"),
        (("bad.toml",), "law"),
        (("hasty.toml",), "faster than the arm's limit"),
        (("none.toml",), "none.toml"),
    ],
)
def test_bad_words_to_certify(capsys, elsewhere, words, says):
    (elsewhere / "gains.toml").write_text(gains_of("fr3").to_toml())
    text = (elsewhere / "gains.toml").read_text()
    (elsewhere / "bad.toml").write_text(text.replace(LAW, "another law"))
    (elsewhere / "hasty.toml").write_text(text.replace("approach = ", "approach = 1"))
    assert says in refused(capsys, "certify", *words)


def arm_text(root, old, new, arm="ur5e"):
    text = (root / f"src/palpate/force/arms/{arm}.toml").read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("delay = 0.01", ""), "no lag to tune for"),
        (("bandwidth = 10 ", "# "), "--loop-from"),
        (("stiffness = 5e4", "# "), "something rigid"),
        (("noise = 0.1", "# "), "in free motion"),
        (("sampling = 480", "sampling = 50"), "faster sensor"),
        (("bandwidth = 10 ", "bandwidth = 1e-5 "), "run the force loop slower"),
        (("rate = 500", "rate = 500\nsurface = 1"), "surface"),
        (("damping = 0.9", "damping = 0.9\ndamping_interval = [1.0, 2.0]"), "interval around"),
        (("delay = 0.01", "delay = 0.01\ndelay_interval = [0.0, 1.0]"), "ticks"),
        (("mass = 3", "# mass", "fr3"), "J M^-1 J^T"),
    ],
)
def test_an_arm_that_lacks_a_number_says_how_to_get_it(capsys, elsewhere, root, change, says):
    (elsewhere / "mine.toml").write_text(arm_text(root, *change))
    assert says in refused(capsys, "tune", "--stiffness", "1e2:1e4", "--arm", "mine.toml", "--force", "20")


LOOP = ("--time", "t", "--command", "target:mm", "--position", "actual:mm")


def write_loop(path, kind):
    t, command, position = loop_log(0, kind=kind, noise={"steps": 1e-6, "slow": 1e-4}[kind])
    table = np.column_stack([t, 1e3 * command, 1e3 * position])
    np.savetxt(path, table, delimiter=",", header="t,target,actual", comments="")


@pytest.mark.long
def test_the_inner_loop_from_a_log_widens_what_is_proved(capsys, elsewhere):
    write_loop(elsewhere / "loop.csv", "steps")
    asked = ("--stiffness", "1e3:1e4", "--arm", "ur5e", "--force", "20")
    code, told = ask(capsys, *asked, "--loop-from", "loop.csv", *LOOP, "--out", "gains.toml")
    assert code == 0
    low, high = told["inner_loop"]["bandwidth_hz"]["ci95"]
    assert low < TRUE["bandwidth"] < high
    assert low < told["inner_loop"]["bandwidth_hz"]["value"] < high
    assert "loop.csv" in told["arm"]
    assert told["proved"]["stiffness"][1] >= 1e4
    assert ForceLoop.load("gains.toml").gains.arm.inner.bandwidth_interval == (low, high)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--arm", "ur5e", "--loop-from", "slow.csv", *LOOP), "a sweep"),
        (("--arm", "fr3", "--loop-from", "loop.csv", *LOOP), "by position"),
        (("--arm", "ur5e", "--loop-from", "loop.csv", *LOOP[:4]), "--position"),
        (("--arm", "ur5e", "--loop-from", "loop.csv", *LOOP[2:]), "--time (or --rate)"),
        (("--arm", "ur5e", "--loop-from", "none.csv", *LOOP), "none.csv"),
        (("--arm", "ur5e", "--loop-from", "loop.csv", *LOOP[:3], "nothing:mm", *LOOP[4:]), "nothing"),
    ],
)
def test_bad_logs_of_an_inner_loop(capsys, elsewhere, words, says):
    write_loop(elsewhere / "loop.csv", "steps")
    write_loop(elsewhere / "slow.csv", "slow")
    assert says in refused(capsys, "tune", "--stiffness", "1e3:1e4", "--force", "20", *words)


@pytest.mark.long
def test_a_log_with_a_push_makes_a_servo_of_any_arm(capsys, elsewhere):
    inner = ServoLoop(mass=6.6, stiffness=4800.0, damping=480.0, delay=0.008)
    rows = np.column_stack(pushed_log(inner))
    np.savetxt(elsewhere / "log.csv", rows, delimiter=",", header="t,u,x,f", comments="")
    log = ("--loop-from", "log.csv", "--time", "t", "--command", "u", "--position", "x", "--push", "f")
    words = ("--stiffness", "1e3:1e5", "--arm", "iiwa14", "--force", "15")
    code, told = ask(capsys, *words, *log, "--out", "gains.toml")
    assert code == 0
    assert told["kind"] == "servo"
    low, high = told["inner_loop"]["stiffness_N_m"]["ci95"]
    assert low < 4800.0 < high
    assert told["theta_s"] == told["inner_loop"]["theta_s"]["ci95"][1]
    assert ForceLoop.load("gains.toml").gains.arm.kind == "servo"
    assert "--loop-from" in refused(capsys, "tune", *words, "--push", "f")
    assert main(["certify", "gains.toml", "--stiffness", "9e4:1e5", "--damping-time", "0:0"]) == 0
    assert "K_u 0.667 to 2 times theirs" in capsys.readouterr().out


def test_what_stands_there_is_not_replaced_unasked(capsys, elsewhere):
    (elsewhere / "gains.toml").write_text("mine")
    assert "did not write it" in refused(capsys, "tune", *RANGE, "--out", "gains.toml")
    assert (elsewhere / "gains.toml").read_text() == "mine"


def test_bounds_of_the_force_state_their_condition(capsys, elsewhere):
    assert main(["tune", *RANGE, "--slide"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "N on springs, settles" in text
    assert "on springs no normal, right or wrong" in text


def test_a_number_of_a_slide_without_a_slide_is_refused(capsys, elsewhere):
    assert "--mu-max is for a slide; add --slide" in refused(capsys, "tune", *RANGE, "--mu-max", "0.8")
