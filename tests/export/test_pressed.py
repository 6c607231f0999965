"""What is exported has its K and B when it is pressed in the engine: 0.1 % is promised, and a spoiled export fails."""

import re

import numpy as np
import pytest

from export import scenes
from palpate.export import TOLERANCE, Request, contact_from, prepare

FORCE = 12.0


def exported(folder, to, model=None, K=5000.0, B=50.0, M=None, probe=None, name="out", text=None):
    """Write an export, and press what is in the file."""
    contact = contact_from(scenes.found(K, B, M), "found.json")
    request = Request(to, model, "foam", probe)
    out = folder / f"{name}{model.suffix if model else '.sdf'}"
    made = prepare(contact, request, out)
    written = made.with_comment("Made by palpate")
    out.write_text(text(written) if text else written)
    made.validate(out)
    return made, made.check(out)


def within(checked):
    return [max(one.error_K, one.error_B) for one in checked]


@pytest.mark.parametrize("mass", [0.5, *(pytest.param(m, marks=pytest.mark.long) for m in (8.0, 2.0))])
@pytest.mark.parametrize("joint", [scenes.SLIDE, scenes.FREE])
def test_mujoco_whatever_presses(tmp_path, mass, joint):
    _, checked = exported(tmp_path, "mujoco", scenes.mjcf(tmp_path, joint, mass=mass))
    (error,) = within(checked)
    assert error < 1e-4  # the impedance: the largest share that a contact of this softness loses


@pytest.mark.parametrize("dimensions", [3, *(pytest.param(d, marks=pytest.mark.long) for d in (6, 1, 4))])
@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_mujoco_whatever_cone(tmp_path, cone, dimensions):
    scene = scenes.mjcf(tmp_path, options=f'cone="{cone}" timestep="0.001"', foam=f'condim="{dimensions}"')
    _, checked = exported(tmp_path, "mujoco", scene)
    assert within(checked)[0] < 1e-4


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_mujoco_shares_the_force_among_points(tmp_path, cone):
    scene = scenes.mjcf(tmp_path, geom=scenes.CAPSULE, options=f'cone="{cone}" timestep="0.001"')
    made, checked = exported(tmp_path, "mujoco", scene)
    assert made.numbers["pairs"]["tip"]["points"] == 2
    assert any("2 points" in note for note in made.notes)
    assert within(checked)[0] < 1e-4


@pytest.mark.long
@pytest.mark.parametrize("arm", ["ur5e", "panda"])
def test_mujoco_under_an_arm(tmp_path, arm):
    """Six and seven joints, no weight taken off by hand: the press is led along the normal."""
    _, checked = exported(tmp_path, "mujoco", scenes.arm_mjcf(tmp_path, arm))
    assert within(checked)[0] < TOLERANCE


def test_what_everyone_writes_is_refused_by_the_check(tmp_path):
    """solref = (-K, -B) is another contact by far; the check is no formality."""

    def naive(text):
        return re.sub(r' solref="[^"]*"', ' solref="-5000 -50"', text)

    _, (checked,) = exported(tmp_path, "mujoco", scenes.mjcf(tmp_path), text=naive)
    assert checked.error_K > 0.5
    assert not checked.within_tolerance


def test_an_export_for_one_mass_fails_under_another(tmp_path):
    """R belongs to the bodies: a scene whose probe is changed afterwards is another contact."""
    scene = scenes.mjcf(tmp_path, mass=2.0)
    contact = contact_from(scenes.found(), "found.json")
    made = prepare(contact, Request("mujoco", scene, "foam"), tmp_path / "out.xml")
    (tmp_path / "out.xml").write_text(made.text)
    scenes.mjcf(tmp_path, mass=0.5)
    (checked,) = made.check(tmp_path / "out.xml")
    assert checked.error_K == pytest.approx(0.75, abs=0.01)  # four times as soft


def test_friction_of_the_scene_is_kept(tmp_path):
    made, _ = exported(tmp_path, "mujoco", scenes.mjcf(tmp_path, foam='friction="0.3 0.01 0.001" condim="4"'))
    friction = re.search(r'friction="([^"]*)"', made.text).group(1)
    assert [float(mu) for mu in friction.split()][:2] == [
        1.0,
        1.0,
    ]  # the larger of foam's 0.3 and the tip's 1
    assert 'condim="4"' in made.text


def test_an_unstable_time_step_is_named_and_fails(tmp_path):
    scene = scenes.mjcf(tmp_path, mass=0.01, options='cone="elliptic" timestep="0.005"')
    made, (checked,) = exported(tmp_path, "mujoco", scene, K=5e4)
    assert any("unstable" in note for note in made.notes)
    assert not checked.within_tolerance


@pytest.mark.parametrize("mass", [0.5, pytest.param(8.0, marks=pytest.mark.long)])
def test_drake(tmp_path, mass):
    _, (checked,) = exported(tmp_path, "drake", scenes.sdf(tmp_path, mass))
    assert within([checked])[0] < 1e-6  # K over the probe's stiffness, and rounding


@pytest.mark.long
def test_drake_urdf(tmp_path):
    _, (checked,) = exported(tmp_path, "drake", scenes.urdf(tmp_path))
    assert within([checked])[0] < 1e-6


@pytest.mark.long
def test_drake_without_a_scene(tmp_path):
    _, (checked,) = exported(tmp_path, "drake")
    assert within([checked])[0] < 1e-6


@pytest.mark.long
def test_drake_replaces_what_was_said_of_the_contact_and_keeps_the_rest(tmp_path):
    foam = (
        "<drake:proximity_properties><drake:compliant_hydroelastic/><drake:mu_static>0.7</drake:mu_static>"
        "<drake:relaxation_time>3</drake:relaxation_time></drake:proximity_properties>"
    )
    tip = "<drake:proximity_properties/>"
    made, (checked,) = exported(tmp_path, "drake", scenes.sdf(tmp_path, foam=foam, tip=tip))
    assert "mu_static>0.7<" in made.text
    assert "<!-- ours -->" in made.text
    assert "hydroelastic" not in made.text
    assert made.text.count("relaxation_time>") == 4
    assert checked.within_tolerance


@pytest.mark.long
def test_drake_fails_where_the_probe_is_left_as_it_was(tmp_path):
    """Its own relaxation time, Drake's default of 0.1 s, adds to the surface's."""

    def one_sided(text):
        head, tail = text.rsplit("<drake:proximity_properties>", 1)
        return head + tail.partition("</drake:proximity_properties>")[2]

    _, (checked,) = exported(tmp_path, "drake", scenes.sdf(tmp_path), text=one_sided)
    assert not checked.within_tolerance


def test_a_plate_on_a_spring(tmp_path):
    _, (checked,) = exported(tmp_path, "mjcf-spring", M=0.05)
    assert within([checked])[0] < 1e-9


@pytest.mark.parametrize("K", [pytest.param(300.0, marks=pytest.mark.long), 1e5])
def test_soft_and_stiff(tmp_path, K):
    _, (checked,) = exported(tmp_path, "mujoco", scenes.mjcf(tmp_path), K=K, B=np.sqrt(K))
    assert within([checked])[0] < 1e-4


@pytest.mark.long
def test_a_surface_that_moves_too(tmp_path):
    """Foam on a rail of its own: R is of both bodies, the penetration of both places."""
    scene = tmp_path / "both.xml"
    rail = '<joint type="slide" axis="0 0 1"/>'
    foam = f'<body>{rail}<geom name="foam" type="box" size=".2 .2 .05" mass="3"/></body>'
    tip = f'<body pos="0 0 .5">{rail}<geom name="tip" type="sphere" size=".02" mass="2"/></body>'
    scene.write_text(f"<mujoco><option {scenes.OPTIONS}/><worldbody>{foam}{tip}</worldbody></mujoco>")
    made, (checked,) = exported(tmp_path, "mujoco", scene)
    assert made.numbers["pairs"]["tip"]["mass_kg"] == pytest.approx(1.2)  # 1 / (1/2 + 1/3)
    assert within([checked])[0] < 1e-4


@pytest.mark.long
def test_a_plane_and_a_flat_probe(tmp_path):
    scene = tmp_path / "plane.xml"
    scene.write_text(
        f'<mujoco><option {scenes.OPTIONS}/><worldbody><geom name="foam" type="plane" size="1 1 .1"/>'
        '<body pos="0 0 .5"><joint type="slide" axis="0 0 1"/>'
        '<geom name="tip" type="box" size=".02 .02 .02" mass="2"/></body></worldbody></mujoco>'
    )
    made, (checked,) = exported(tmp_path, "mujoco", scene)
    assert made.numbers["pairs"]["tip"]["points"] == 4
    assert within([checked])[0] < 1e-3  # the impedance adds for each of four points
