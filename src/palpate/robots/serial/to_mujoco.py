"""A serial arm as a MuJoCo model: its own where it was read from one, else one made of its numbers."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.arrays import Array
from palpate.robots.serial._extra import mujoco, refusals
from palpate.robots.serial._loading import compiled
from palpate.robots.serial.serial_arm import Scene, SerialArm


def scene_of(arm: SerialArm) -> Scene:
    """The model in which the arm stands; needs the extra `arms`.

    Raises:
        InputError: MuJoCo is not installed, or refuses the arm's numbers.
    """
    return arm.scene or _make_scene(arm)


def _make_scene(arm: SerialArm) -> Scene:
    with refusals(arm.title):
        model, _ = compiled(mujoco().MjSpec.from_string(mjcf(arm)))
    n = np.arange(arm.joints)
    return Scene(model, 0, int(model.site_bodyid[0]), n, n)


def mjcf(arm: SerialArm) -> str:
    """The arm as MJCF: no shapes, no motors, a site `tip`."""
    root = ElementTree.Element("mujoco", model=arm.title)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
    ElementTree.SubElement(root, "option", gravity=_text(arm.chain.gravity))
    body = ElementTree.SubElement(root, "worldbody")
    for i, name in enumerate(arm.names):
        body = _link(arm, i, name, body)
    ElementTree.SubElement(
        body, "site", name="tip", pos=_text(arm.chain.tip), quat=_text(_quaternion(arm.chain.tip_turn))
    )
    return ElementTree.tostring(root, encoding="unicode")


def _link(arm: SerialArm, i: int, name: str, parent: ElementTree.Element) -> ElementTree.Element:
    c = arm.chain
    body = ElementTree.SubElement(
        parent, "body", name=f"link{i + 1}", pos=_text(c.at[i]), quat=_text(_quaternion(c.turn[i]))
    )
    kind = "slide" if c.slide[i] else "hinge"
    ElementTree.SubElement(
        body, "joint", name=name, type=kind, axis="0 0 1", armature=repr(float(c.rotor[i]))
    )
    moment = c.inertia[i]
    ElementTree.SubElement(
        body,
        "inertial",
        pos=_text(c.com[i]),
        mass=repr(float(c.mass[i])),
        fullinertia=_text(moment[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
    )
    return body


def _quaternion(turn: Array) -> Array:
    quat = np.zeros(4)
    mujoco().mju_mat2Quat(quat, np.ascontiguousarray(turn).ravel())
    return quat


def _text(numbers: Any) -> str:
    return " ".join(repr(float(v)) for v in numbers)
