"""Where serial arms come from: TOML, MJCF, URDF; and what is wrong with a stranger's."""

import sys

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.robots import SerialArm
from palpate.robots.serial.from_toml import parse
from palpate.robots.serial.serial_arm import scene_of
from robots.serial.oracles import URDF, ByMuJoCo, states

JOINT = '[[joint]]\nname = "one"\nat = [0, 0, 0.3]\nmass = 2\ncom = [0, 0.1, 0]\n'
PLAIN = 'title = "T"\nhome = [0]\n' + JOINT

#: A turned base, a joint with a reference, two joints in one body, a gripper beside the way, a tool without a joint.
CELL = """
<mujoco model="cell">
  <option gravity="0.3 0 -9.7"/>
  <worldbody>
    <body name="base" pos="0.1 0.2 0.3" euler="10 20 30">
      <geom type="box" size="0.1 0.1 0.1"/>
      <body name="a" pos="0 0 0.2">
        <joint name="j1" axis="0.2 0 1" pos="0 0.03 0" range="-170 170" ref="20"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.05"/>
        <body name="b" pos="0.3 0 0" quat="0.9 0.1 -0.2 0.3">
          <joint name="j2" type="slide" axis="0 1 1" ref="0.1" armature="0.5"/>
          <joint name="j3" axis="1 0 0" pos="0 0 0.02" armature="0.2"/>
          <inertial pos="0.05 0.01 0" mass="3" diaginertia="0.01 0.02 0.025"/>
          <body name="tool" pos="0 0 0.1" euler="0 40 0">
            <geom type="sphere" size="0.04"/>
            <site name="tip" pos="0 0 0.05" euler="5 0 0"/>
            <body name="finger" pos="0.02 0 0"><joint name="grip" type="slide" damping="{damping}"/>
              <geom type="box" size="0.01 0.01 0.03"/></body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def write(tmp_path):
    def written(text, name="arm.xml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return written


def test_mjcf_with_all_that_it_may_have(write):
    """The gripper is held, so what is compared is the arm with it shut."""
    arm = SerialArm.from_mujoco(write(CELL.format(damping=0)), "tip")
    assert arm.names == ("j1", "j2", "j3")
    assert any("grip" in note for note in arm.notes)
    oracle = ByMuJoCo(arm)
    for q, qd in states(arm, 10):
        pose, J, bias, M, h = oracle(q, qd)
        dofs = np.ix_(arm.scene.dofs, arm.scene.dofs)
        assert arm.forward_kinematics(q) == pytest.approx(pose, abs=1e-13)
        assert arm.jacobian(q) == pytest.approx(J[:, arm.scene.dofs], abs=1e-13)
        assert arm.jacobian_dot_qd(q, qd) == pytest.approx(bias, abs=1e-11)
        assert arm.mass_matrix(q) == pytest.approx(M[dofs], rel=1e-11, abs=1e-11)
        assert arm.bias_torque(q, qd) == pytest.approx(h[arm.scene.dofs], rel=1e-11, abs=1e-10)


def test_the_only_site_needs_no_name(write):
    arm = SerialArm.from_mujoco(write(CELL.format(damping=0)))
    assert arm.joints == 3


def test_a_model_in_memory_serves_as_its_file(write):
    path = write(CELL.format(damping=0))
    import mujoco

    arm = SerialArm.from_mujoco(mujoco.MjModel.from_xml_path(str(path)), "tool")
    assert arm.mass_matrix(arm.home) == pytest.approx(SerialArm.from_mujoco(path).mass_matrix(arm.home))


def test_what_its_own_laws_do_not_know_is_noted(write):
    text = CELL.format(damping=0).replace('armature="0.5"', 'armature="0.5" damping="3"')
    assert any("damping" in note for note in SerialArm.from_mujoco(write(text)).notes)


def test_frankas_published_link_is_taken_as_published():
    arm = SerialArm.named("panda")
    (note,) = arm.notes
    assert "joint4" in note
    assert "triangle inequality" in note
    scene = scene_of(arm)  # MuJoCo alone would refuse it, or change it
    principal = np.sort(np.linalg.eigvalsh(arm.chain.inertia[3]))
    assert np.sort(scene.model.body_inertia[4]) == pytest.approx(principal, rel=1e-12)
    assert principal[2] > principal[0] + principal[1]


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("home = [0]", "home = [0, 1]", "home needs 1 numbers"),
        ("mass = 2", "mass = -2", "Expected `float` >= 0"),
        ("mass = 2", "mass = nan", "a mass must be 0 kg or more|Expected"),
        ("mass = 2", "mass = 2\nweight = 3", "unknown field `weight`"),
        ("mass = 2", "mass = 2\ninertia = [1, 1, -1, 0, 0, 0]", "link one: its inertia is none"),
        ("mass = 2", "mass = 2\ninertia = [0.1, 0.1, 0.1, 1, 0, 0]", "the moment about one axis is -0.9"),
        ("mass = 2", "mass = 2\ninertia = [inf, 1, 1, 0, 0, 0]", "six finite numbers"),
        ("mass = 2", "mass = 2\nrange = [1, 1]", "the lower first"),
        ("mass = 2", 'mass = 2\nkind = "screw"', "Invalid enum value 'screw'"),
        ("mass = 2", "mass = 0", "not positive definite"),
        ("at = [0, 0, 0.3]", "at = [0, nan, 0.3]", "joint one: every number must be finite"),
        ("[[joint]]", "[[joint]", "not TOML"),
        (JOINT, "joint = []\n", "at least one joint|home needs 0"),
    ],
)
def test_toml_that_is_wrong(old, new, what):
    assert old in PLAIN
    with pytest.raises(InputError, match=what) as error:
        parse(PLAIN.replace(old, new), "mine.toml")
    assert str(error.value).startswith("mine.toml: ")
    assert "\n" not in str(error.value)


REFUSED = [
    (lambda t: "nonsense", None, "MuJoCo refuses it: XML parse error"),
    (lambda t: t.replace('type="slide"', 'type="foo"'), None, "invalid keyword: 'foo' Element 'joint', line"),
    (lambda t: t, "tap", "did you mean 'tip'"),
    (lambda t: t, "base", "no joint moves the tip"),
    (lambda t: t.replace("</site>", "").replace('<site name="tip"', '<site name="other"/><site name="tip"'), None,
     "which site is the tip"),
    (lambda t: t.replace('name="j1" ', 'name="j1" type="ball" ').replace('range="-170 170" ref="20"', ""), "tip",
     "ball or a free joint"),
    (lambda t: t.replace('diaginertia="0.01 0.02 0.025"', 'diaginertia="0.01 0.02 -0.025"'), "tip",
     "link b: its inertia is none|MuJoCo refuses it"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "site", "what"), REFUSED)
def test_mjcf_that_is_wrong(write, spoil, site, what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=what) as error:
        SerialArm.from_mujoco(write(spoil(CELL.format(damping=0))), site)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_mjcf_whose_inertia_no_body_has(write):
    text = CELL.format(damping=0).replace("0.01 0.02 0.025", "0.01 0.02 0.035")
    arm = SerialArm.from_mujoco(write(text), "tip")
    assert any("triangle inequality" in note for note in arm.notes)
    assert arm.scene.model.body("b").inertia.tolist() == [0.01, 0.02, 0.035]


def urdf():
    return URDF.read_text(encoding="utf-8")


def test_urdf_whose_inertia_no_body_has_moves_as_pinocchio_says(write):
    from robots.serial.oracles import ByPinocchio

    path = write(urdf().replace('izz="0.05"', 'izz="0.2"'), "odd.urdf")
    arm = SerialArm.from_urdf(path, "probe")
    assert any("carriage" in note for note in arm.notes)
    q, qd = next(states(arm, 1))
    assert arm.mass_matrix(q) == pytest.approx(ByPinocchio(arm, path, "probe")(q, qd)[3], rel=1e-12)
    assert arm.mass_matrix(q) == pytest.approx(ByMuJoCo(arm)(q, qd)[3], rel=1e-12)


@pytest.mark.parametrize(
    ("spoil", "link", "what"),
    [
        (lambda t: t, "prob", "did you mean 'probe'"),
        (lambda t: t, "rail", "no joint moves the tip"),
        (lambda t: t[:400], "probe", "not XML"),
        (lambda t: "<sdf/>", "probe", "not URDF, its first element is <sdf>"),
        (lambda t: t.replace('mass value="1.9"', 'mass value="-1.9"'), "probe", "a mass must be|MuJoCo refuses"),
        (lambda t: t.replace('<parent link="ram"/>', '<parent link="nowhere"/>'), "probe", "MuJoCo refuses it"),
        (lambda t: t.replace('type="prismatic"', 'type="floating"'), "probe", "ball or a free joint|refuses"),
    ],
)  # fmt: skip
def test_urdf_that_is_wrong(write, spoil, link, what):
    with pytest.raises(InputError, match=what) as error:
        SerialArm.from_urdf(write(spoil(urdf()), "arm.urdf"), link)
    assert "\n" not in str(error.value)


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"\.\[arms\]"):
        SerialArm.from_urdf(URDF, "probe")


MODEL = (
    "<mujoco>{size}<asset>{asset}</asset><worldbody>{extra}<body pos='{pos}'><inertial pos='0 0 .1' mass='{mass}'"
    " diaginertia='.1 .1 .1'/><joint axis='0 1 0'/><site name='tip'/></body></worldbody></mujoco>"
)
ORDINARY = {"size": "", "asset": "", "extra": "", "pos": "0 0 1", "mass": "1"}
FIELD = {
    "asset": "<hfield name='h' nrow='100000' ncol='100000' size='1 1 1 1'/>",
    "extra": "<geom type='hfield' hfield='h'/>",
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (FIELD, "more than 0.25 GB"),
        ({"size": "<size memory='100G'/>"}, "allocate memory"),
        ({"mass": "1e308"}, "mass must be within 1e.06 kg, got 1e.308"),
        ({"pos": "1e200 0 0"}, "must be within 1000 m"),
        ({"pos": "nan 0 0"}, "not finite"),
        pytest.param(
            {"extra": "<replicate count='100000000'><geom size='.1'/></replicate>"},
            "takes more than 25 s",
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_model_that_exhausts_the_machine(tmp_path, change, words):
    path = tmp_path / "arm.xml"
    path.write_text(MODEL.format(**ORDINARY))
    assert SerialArm.from_mujoco(path).joints == 1
    path.write_text(MODEL.format(**ORDINARY | change))
    with pytest.raises(InputError, match=words):
        SerialArm.from_mujoco(path)


@pytest.mark.parametrize(
    ("number", "words"),
    [
        ("mass = 1e307", "mass must be within"),
        ("at = [1e200, 0, 0]", "within 1000 m"),
        ("rotor = 1e300", "rotor inertia"),
    ],
)
def test_numbers_that_no_arm_has(tmp_path, number, words):
    text = 'title = "one"\nhome = [0.0]\n[[joint]]\nname = "a"\nat = [0, 0, 1]\nmass = 1\nrotor = 1\n'
    path = tmp_path / "arm.toml"
    path.write_text(text)
    assert SerialArm.from_toml(path).joints == 1
    key = number.partition(" ")[0]
    path.write_text(
        "".join(f"{number}\n" if line.startswith(f"{key} ") else f"{line}\n" for line in text.splitlines())
    )
    with pytest.raises(InputError, match=words):
        SerialArm.from_toml(path)
