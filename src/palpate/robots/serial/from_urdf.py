"""A serial arm from URDF, read by MuJoCo; meshes are left out, which say nothing of how an arm moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from palpate.errors import InputError, unknown
from palpate.files import read_bytes
from palpate.robots.serial._loading import load_mjcf
from palpate.robots.serial.from_mujoco import arm_of
from palpate.robots.serial.serial_arm import SerialArm

_LARGEST = 1 << 24
"""Bytes of a file."""
_SEEN = ("visual", "collision")


def from_urdf(path: Path, link: str) -> SerialArm:
    """See `SerialArm.from_urdf`."""
    root = _robot(path)
    links = [one.get("name", "") for one in root.iter("link")]
    if link not in links:
        raise unknown(f"link in {path}", link, links)
    for part in root.iter("link"):
        for seen in [child for child in part if child.tag in _SEEN]:
            part.remove(seen)
    for own in root.findall("mujoco"):
        root.remove(own)
    options = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(options, "compiler", fusestatic="false", discardvisual="false")
    model, notes = load_mjcf(path, ElementTree.tostring(root, encoding="unicode"))
    arm = arm_of(model, link, str(path), notes)
    speeds = _speeds(root)
    return replace(
        arm,
        title=root.get("name") or arm.title,
        speed=np.array([speeds.get(name, np.inf) for name in arm.names]),
    )


def _robot(path: Path) -> ElementTree.Element:
    data = read_bytes(path, _LARGEST, "an arm")
    try:
        root = ElementTree.fromstring(data)  # noqa: S314 - Python's expat bounds what entities may grow to
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not XML: {error}") from None
    if root.tag != "robot":
        raise InputError(
            f"{path}: not URDF, its first element is <{root.tag}>; MJCF is read by its ending .xml"
        )
    return root


def _speeds(root: ElementTree.Element) -> dict[str, float]:
    """Limits of the joints' rates, which MuJoCo does not keep; 0 and what is no number are none."""
    found = {}
    for joint in root.iter("joint"):
        limit = joint.find("limit")
        try:
            value = float(limit.get("velocity", "0")) if limit is not None else 0.0
        except ValueError:
            value = 0.0
        if value > 0.0:
            found[joint.get("name", "")] = value
    return found
