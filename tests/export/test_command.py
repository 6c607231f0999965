"""`palpate export` as a user types it, and all that it refuses."""

import json

import pytest

from export import scenes
from palpate.cli import main
from palpate.export import Request, contact_from
from palpate.force import known_from, load_arm


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "found.json").write_text(json.dumps(scenes.found()))
    scenes.mjcf(tmp_path)
    scenes.sdf(tmp_path)
    return tmp_path


TO_MUJOCO = ("--to", "mujoco", "--model", "scene.xml", "--geom", "foam")
TO_DRAKE = ("--to", "drake", "--model", "scene.sdf", "--geom", "foam")


def run(capsys, *words):
    code = main(["export", "found.json", *words])
    return code, capsys.readouterr()


def refused(capsys, *words, left=("found.json", "scene.sdf", "scene.xml"), here=None):
    code, printed = run(capsys, *words)
    assert code == 2
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    if here is not None:
        assert sorted(path.name for path in here.iterdir()) == sorted(left)
    return printed.err


def test_a_scene_and_what_stands_beside_it(capsys, elsewhere):
    code, printed = run(capsys, *TO_MUJOCO, "--check")
    assert code == 0
    assert "passed" in printed.out
    text = (elsewhere / "scene-foam.xml").read_text()
    assert "4900 to 5100" in text
    assert "Made by palpate" in text
    beside = json.loads((elsewhere / "scene-foam.xml.json").read_text())
    assert beside["parameters"]["K"]["ci95"] == [4900.0, 5100.0]
    assert beside["check"][0]["passed"]
    assert beside["assumptions"]
    assert beside["command"] == "palpate export found.json " + " ".join((*TO_MUJOCO, "--check"))


def test_json_is_the_only_output(capsys, elsewhere):
    code, printed = run(capsys, *TO_DRAKE, "--json")
    told = json.loads(printed.out)
    assert code == 0
    assert told["numbers"] == {"point_contact_stiffness": 5000.0, "relaxation_time": 0.01}
    assert told["check"] is None
    assert told["file"] == "scene-foam.sdf"


def test_the_written_scene_is_named_from_another_folder(capsys, elsewhere):
    (elsewhere / "other").mkdir()
    assert run(capsys, *TO_MUJOCO, "--out", "other/mine.xml", "--check")[0] == 0
    assert '<include file="../scene.xml"/>' in (elsewhere / "other" / "mine.xml").read_text()


def test_a_check_that_fails_is_exit_code_1(capsys, elsewhere):
    scenes.mjcf(elsewhere, mass=1e-4)
    code, printed = run(capsys, *TO_MUJOCO, "--check")
    assert code == 1
    assert "unstable" in printed.out


@pytest.mark.parametrize(
    ("verdicts", "words", "said"),
    [
        ({"K": "rejected"}, (), "K is rejected (the log does not show it), and is not exported"),
        ({"K": "not identifiable"}, (), "take it with --working-point"),
        ({"B": "not identifiable"}, (), "give one with --damping"),
    ],
)
def test_what_is_not_identified_is_refused_with_the_reason(capsys, elsewhere, verdicts, words, said):
    (elsewhere / "found.json").write_text(json.dumps(scenes.found(verdicts=verdicts)))
    assert said in refused(capsys, *TO_MUJOCO, *words, here=elsewhere)


def test_a_model_that_no_simulator_has_is_refused(capsys, elsewhere):
    (elsewhere / "found.json").write_text(json.dumps(scenes.found(model="hunt-crossley")))
    assert "not K x + B v" in refused(capsys, *TO_MUJOCO)
    assert run(capsys, *TO_MUJOCO, "--working-point")[0] == 0
    assert "4500 N/m" in (elsewhere / "scene-foam.xml").read_text()


def test_a_damping_that_is_given_is_said_to_be_given(capsys, elsewhere):
    (elsewhere / "found.json").write_text(json.dumps(scenes.found(verdicts={"B": "not identifiable"})))
    assert run(capsys, *TO_MUJOCO, "--damping", "0", "--check")[0] == 0
    assert "B = 0 N s/m (given, not identified)" in (elsewhere / "scene-foam.xml").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--to", "mujoco", "--model", "scene.xml", "--geom", "foma"),
            "did you mean 'foam'? there are: foam, tip",
        ),
        (
            ("--to", "mujoco", "--model", "scene.xml", "--geom", "probe"),
            "'probe' is a body; name one of its geoms: tip",
        ),
        ((*TO_MUJOCO, "--probe", "tipp"), "did you mean 'tip'?"),
        ((*TO_MUJOCO, "--probe", "foam"), "cannot touch"),
        (("--to", "mujoco", "--geom", "foam"), "--model"),
        (("--to", "mujoco", "--model", "scene.sdf", "--geom", "foam"), "no MJCF"),
        (("--to", "mujoco", "--model", "none.xml", "--geom", "foam"), "none.xml"),
        (
            ("--to", "drake", "--model", "scene.sdf", "--geom", "fom"),
            "there are: m::plate::foam, m::probe::tip",
        ),
        (
            ("--to", "drake", "--model", "scene.sdf", "--geom", "plate"),
            "is a link; name one of its collisions: foam",
        ),
        (("--to", "drake", "--model", "scene.xml", "--geom", "foam"), "begins with <mujoco>"),
        ((*TO_DRAKE, "--probe", "foam"), "is the surface itself"),
        (("--to", "mjcf-spring", "--model", "scene.xml"), "takes none"),
        (("--to", "mjcf-spring"), "give a small one with --mass"),
        (("--to", "gazebo"), "gazebo"),
        ((*TO_MUJOCO, "--damping", "-1"), "--damping must be 0 or more"),
        ((*TO_MUJOCO, "--damping", "nan"), "--damping needs a number"),
        (("--to", "mjcf-spring", "--mass", "0"), "--mass must be above 0"),
        ((*TO_MUJOCO, "--out", "scene.xml"), "is the scene itself"),
        ((*TO_MUJOCO, "--out", "nowhere/a.xml"), "there is no folder"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(capsys, elsewhere, words, said):
    assert said in refused(capsys, *words, here=elsewhere)


def test_a_scene_that_mujoco_refuses_keeps_mujocos_line(capsys, elsewhere):
    (elsewhere / "scene.xml").write_text(
        '<mujoco><worldbody><geom name="foam" size="-1"/></worldbody></mujoco>'
    )
    said = refused(capsys, *TO_MUJOCO, here=elsewhere)
    assert "scene.xml: MuJoCo refuses it" in said
    assert "line 1" in said or "size" in said


def test_a_scene_with_a_pair_of_its_own_is_refused(capsys, elsewhere):
    text = (elsewhere / "scene.xml").read_text()
    pair = '<contact><pair geom1="tip" geom2="foam"/></contact></mujoco>'
    (elsewhere / "scene.xml").write_text(text.replace("</mujoco>", pair))
    assert "it has a <pair> of 'foam' and 'tip' already" in refused(capsys, *TO_MUJOCO, here=elsewhere)


def test_nothing_that_moves_is_refused(capsys, elsewhere):
    scenes.mjcf(elsewhere, joint="")
    assert "nothing that has a name can touch 'foam'" in refused(capsys, *TO_MUJOCO, here=elsewhere)


def test_several_collisions_ask_which_presses(capsys, elsewhere):
    more = '<link name="hand"><inertial><mass>1</mass></inertial><collision name="palm"><geometry><sphere>'
    more += "<radius>.01</radius></sphere></geometry></collision></link></model>"
    text = (elsewhere / "scene.sdf").read_text()
    (elsewhere / "scene.sdf").write_text(text.replace("</model>", more))
    assert "the probe with --probe: m::probe::tip, m::hand::palm" in refused(capsys, *TO_DRAKE)


def test_what_stands_there_is_kept_unless_it_is_ours_and_replace_is_said(capsys, elsewhere):
    assert run(capsys, *TO_MUJOCO)[0] == 0
    before = (elsewhere / "scene-foam.xml").read_bytes()
    assert "add --replace" in refused(capsys, *TO_MUJOCO)
    assert run(capsys, *TO_MUJOCO, "--replace", "--damping", "7")[0] == 0
    assert (elsewhere / "scene-foam.xml").read_bytes() != before
    (elsewhere / "scene-foam.xml").write_text("<mujoco/>")
    assert "palpate did not write it" in refused(capsys, *TO_MUJOCO, "--replace")


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"parameters": 3}', '{"logs": []}', "\xff", '{"parameters": {}}']
)
def test_a_file_that_is_no_identification_is_refused(capsys, elsewhere, text):
    (elsewhere / "found.json").write_text(text, encoding="latin-1")
    assert "found.json" in refused(capsys, *TO_MUJOCO, here=elsewhere)


def test_an_xml_bomb_is_not_unfolded(capsys, elsewhere):
    bomb = '<?xml version="1.0"?><!DOCTYPE sdf [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><sdf>&b;</sdf>'
    (elsewhere / "scene.sdf").write_text(bomb)
    assert "declares entities" in refused(capsys, *TO_DRAKE)


def test_a_name_from_a_file_cannot_end_the_comment(capsys, elsewhere):
    hostile = "x--><evil>\x1b[31m.json"
    (elsewhere / "found.json").rename(elsewhere / hostile)
    assert main(["export", hostile, *TO_MUJOCO]) == 0
    text = (elsewhere / "scene-foam.xml").read_text()
    assert text.index("-->") > text.index("N/m")
    assert "\x1b" not in text + capsys.readouterr().out


def test_pooled_logs_are_exported():
    pooled = {"logs": [{}], "pooled": {**scenes.found(), "working_point": None}}
    del pooled["pooled"]["model"]
    assert contact_from(pooled, "found.json").stiffness.value == 5000.0


def test_only_what_a_target_takes():
    with pytest.raises(ValueError, match="did you mean 'drake'"):
        Request("darke")


def test_what_is_out_of_reach_is_not_pressed_and_does_not_fail_the_check(capsys, elsewhere):
    """A scene has geoms, such as an arm's base, that no joint brings to the surface."""
    ball = '<geom name="far" type="sphere" size=".02" mass="1"/>'
    far = f'<body pos="1 0 .5"><joint type="slide" axis="0 1 0"/>{ball}</body>'
    text = (elsewhere / "scene.xml").read_text()
    (elsewhere / "scene.xml").write_text(text.replace("</worldbody>", f"{far}</worldbody>"))
    code, printed = run(capsys, *TO_MUJOCO, "--check")
    assert code == 0
    assert "not pressed" in printed.out
    assert run(capsys, *TO_MUJOCO, "--check", "--probe", "far", "--replace")[0] == 1  # nothing was pressed


def test_a_file_that_is_no_utf8_is_refused(capsys, elsewhere):
    (elsewhere / "scene.sdf").write_bytes(b"<sdf>\xff</sdf>")
    assert "not UTF-8" in refused(capsys, *TO_DRAKE)


def behind_the_arm(elsewhere, B=(0.0, 60.0)):
    """An identification in which the arm gives way too: K is a lower bound, B an interval."""
    answer = scenes.found(verdicts={"K": "not identifiable", "B": "not identifiable"})
    answer["parameters"]["K"]["reason"] = "a lower bound of the surface's stiffness; give --robot-stiffness."
    answer["parameters"]["B"]["ci95"] = list(B)
    answer["working_point"]["stiffness"] |= {
        "value": None,
        "verdict": "not identifiable",
        "ci95": [4900.0, 5100.0],
    }
    answer["warnings"] = [{"code": "series-compliance", "text": "the arm gives way"}]
    (elsewhere / "found.json").write_text(json.dumps(answer))
    return answer


def test_numbers_without_a_log(capsys, elsewhere):
    numbers = ("--stiffness", "20kN/m", "--damping", "50")
    assert main(["export", *numbers, *TO_MUJOCO, "--check", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["check"][0]["passed"]
    assert {name: p["value"] for name, p in answer["parameters"].items()} == {"K": 20000.0, "B": 50.0}
    assert {p["origin"] for p in answer["parameters"].values()} == {"given, not identified"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "or --stiffness and --damping (0 for a pure spring)"),
        (("--stiffness", "2e4"), "or --stiffness and --damping (0 for a pure spring)"),
        (("--stiffness", "-1", "--damping", "0"), "--stiffness must be above 0"),
        (("--stiffness", "2e4:kg", "--damping", "0"), "unknown unit of stiffness in --stiffness 'kg'"),
    ],
)
def test_numbers_that_are_no_contact_are_one_line(capsys, elsewhere, words, said):
    assert main(["export", *words, *TO_DRAKE]) == 2
    assert said in capsys.readouterr().err


def test_the_remedies_are_options_of_this_command(capsys, elsewhere):
    behind_the_arm(elsewhere)
    said = refused(capsys, *TO_DRAKE, here=elsewhere)
    assert "name the arm with --arm, or give one with --stiffness" in said
    assert "--robot-stiffness" not in said
    (elsewhere / "found.json").write_text('{"K": 20000, "B": 50}')
    assert "give one with --stiffness" in refused(capsys, *TO_DRAKE, here=elsewhere)


def test_the_arm_of_the_log_is_taken_out_as_tune_does(capsys, elsewhere):
    answer = behind_the_arm(elsewhere)
    arm = load_arm("ur5e")
    assert run(capsys, *TO_DRAKE, "--arm", "ur5e")[0] == 0
    parameters = json.loads((elsewhere / "scene-foam.sdf.json").read_text())["parameters"]
    known = known_from(answer, "found.json").beyond(arm)
    assert parameters["K"]["ci95"] == list(known.stiffness)
    assert parameters["K"]["value"] == pytest.approx(1 / (1 / 5100.0 - 1 / arm.series))
    assert parameters["B"]["value"] == known.damping[1]
    assert "assumed" in parameters["B"]["origin"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("found.json", "--to", "c"), "add --arm and --force"),
        (("--stiffness", "2e4", "--to", "c", "--arm", "ur5e"), "add --arm and --force"),
        (("found.json", *TO_DRAKE, "--force", "15N"), "--force is for a law; add --to c"),
        (("gains.toml", "--to", "c", "--damping", "3"), "--damping is for a scene; leave out --to c"),
    ],
)
def test_a_law_is_of_gains(capsys, elsewhere, words, said):
    assert main(["export", *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.long
def test_a_law_of_numbers_is_that_of_their_gains(capsys, elsewhere):
    tuned = ("--stiffness", "20kN/m", "--arm", "ur5e", "--force", "15N")
    assert main(["tune", *tuned, "--damping-max", "50", "--out", "gains.toml"]) == 0
    assert main(["export", "gains.toml", "--to", "c", "--out", "of-gains"]) == 0
    assert main(["export", *tuned, "--damping", "50", "--to", "c", "--out", "of-numbers"]) == 0
    texts = [(elsewhere / place / "palpate_force.c").read_text() for place in ("of-gains", "of-numbers")]
    assert texts[0] == texts[1]
