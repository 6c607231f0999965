"""Scenes in which a probe stands over foam, for the simulators; and what an identification of foam prints."""

from pathlib import Path

import numpy as np

SLIDE = '<joint type="slide" axis="0 0 1"/>'
FREE = "<freejoint/>"
SPHERE = '<geom name="tip" type="sphere" size=".02" mass="{mass}"/>'
CAPSULE = '<geom name="tip" type="capsule" euler="0 90 0" size=".02 .05" mass="{mass}"/>'
OPTIONS = 'cone="elliptic" timestep="0.001"'


def mjcf(folder: Path, joint=SLIDE, geom=SPHERE, mass=2.0, options=OPTIONS, foam="") -> Path:
    """A probe over a box of foam."""
    path = folder / "scene.xml"
    path.write_text(
        f'<mujoco model="bench"><option {options}/><worldbody>'
        f'<geom name="foam" type="box" size=".2 .2 .05" {foam}/>'
        f'<body name="probe" pos="0.02 0 .5">{joint}{geom.format(mass=mass)}</body>'
        "</worldbody></mujoco>"
    )
    return path


def arm_mjcf(folder: Path, name: str) -> Path:
    """A shipped arm in its home pose, a sphere at its tip, foam 5 cm before it."""
    import mujoco

    from palpate.robots import SerialArm
    from palpate.robots.serial.serial_arm import mjcf as arm_of

    arm = SerialArm.named(name)
    place = arm.forward_kinematics(arm.home)
    spec = mujoco.MjSpec.from_string(arm_of(arm))
    spec.compiler.balanceinertia = True  # a published link of the Panda is no body
    tip = next(site for site in spec.sites if site.name == "tip")
    tip.parent.add_geom(
        name="tip", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], pos=tip.pos, mass=0.1
    )
    where = place[:3, 3] + (0.02 + 0.05 + 0.05) * place[:3, 2]
    spec.worldbody.add_geom(
        name="foam",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[0.2, 0.2, 0.05],
        pos=where,
        quat=_quaternion(place[:3, :3]),
    )
    spec.add_key(name="home", qpos=np.asarray(arm.home))
    spec.compile()
    path = folder / f"{name}.xml"
    path.write_text(spec.to_xml())
    return path


def _quaternion(turn):
    import mujoco

    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(turn).ravel())
    return quat


LINKS = """<link name="plate"><collision name="foam"><pose>0 0 -.05 0 0 0</pose>
<geometry><box><size>.4 .4 .1</size></box></geometry>{foam}</collision></link>
<joint name="w" type="fixed"><parent>world</parent><child>plate</child></joint>
<link name="probe"><pose>0.02 0 .3 0 0 0</pose><inertial><mass>{mass}</mass></inertial>
<collision name="tip"><geometry><sphere><radius>.02</radius></sphere></geometry>{tip}</collision></link>
<joint name="s" type="prismatic"><parent>world</parent><child>probe</child><axis><xyz>0 0 1</xyz></axis></joint>"""


def sdf(folder: Path, mass=2.0, foam="", tip="") -> Path:
    """The same for Drake."""
    path = folder / "scene.sdf"
    body = LINKS.format(mass=mass, foam=foam, tip=tip)
    path.write_text(
        f'<?xml version="1.0"?>\n<sdf version="1.7"><!-- ours -->\n<model name="m">{body}</model></sdf>\n'
    )
    return path


def urdf(folder: Path) -> Path:
    """The same as URDF."""
    path = folder / "scene.urdf"
    path.write_text(
        '<robot name="m"><link name="world"/><link name="plate"><collision name="foam"><origin xyz="0 0 -0.05"/>'
        '<geometry><box size=".4 .4 .1"/></geometry></collision></link>'
        '<joint name="w" type="fixed"><parent link="world"/><child link="plate"/></joint>'
        '<link name="probe"><inertial><mass value="2"/><inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/>'
        '</inertial><collision name="tip"><geometry><sphere radius=".02"/></geometry></collision></link>'
        '<joint name="s" type="prismatic"><parent link="world"/><child link="probe"/><origin xyz="0 0 .3"/>'
        '<axis xyz="0 0 1"/><limit effort="1e9" velocity="1e9" lower="-1" upper="1"/></joint></robot>'
    )
    return path


def found(K=5000.0, B=50.0, M=None, model="kelvin-voigt", verdicts=(), point=True):
    """What `palpate identify --json` prints, as far as an export reads it."""
    values = {"K": (K, "N/m"), "B": (B, "N s/m"), **({"M": (M, "kg")} if M else {})}
    verdicts = dict(verdicts)
    at = {"stiffness": _one(0.9 * K, "N/m"), "force_N": 12.0, "depth_m": 0.0024, "frequency_Hz": 0.5}
    return {
        "model": model,
        "parameters": {n: _one(v, unit, verdicts.get(n, "identified")) for n, (v, unit) in values.items()},
        "working_point": at if point else None,
    }


def _one(value, unit, verdict="identified"):
    sure = verdict == "identified"
    return {
        "value": value if sure else None, "ci95": [0.98 * value, 1.02 * value] if sure else None, "unit": unit,
        "verdict": verdict, "reason": "known to 2 % (95 %)" if sure else "the log does not show it.",
    }  # fmt: skip
