"""An arm of position servos in MuJoCo: links and actuators, a sensor, and a one-sided surface or a hand that pushes.

Nothing of that world is palpate's but the tables of the links: MuJoCo moves the joints, and all else is written here
again. `arm_of` is the same arm as palpate describes it, in one direction.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files

import numpy as np
from scipy.signal import butter, tf2ss

from palpate.force.arm import Arm, Limits, Sensor, ServoLoop
from palpate.robots import SerialArm

SERVOS = {
    "ur5e": ((2000, 2000, 2000, 500, 500, 500), (400, 400, 400, 100, 100, 100)),
    "iiwa14": ((2000,) * 7, (200,) * 7),
}
"""kp [N m/rad] and kd [N m s/rad] of the joints of MuJoCo menagerie's models."""
RATE, STEPS = 500.0, 8
"""Ticks a second, and steps of the physics in a tick."""


def arm_of(name: str) -> Arm:
    """The tip of an arm at home, along its own z, as a servo of one direction: K_s and D of all joints in series."""
    robot, (kp, kd) = SerialArm.named(name), SERVOS[name]
    q = np.array(robot.home)
    along = robot.forward_kinematics(q)[:3, 2] @ robot.jacobian(q)[:3]
    stiffness, damping = (1.0 / float(along**2 @ (1.0 / np.array(gain))) for gain in (kp, kd))
    mass = 1.0 / float(along @ np.linalg.solve(robot.mass_matrix(q), along))
    return Arm(
        title=f"{name}, servos of MuJoCo menagerie", rate=RATE,
        inner=ServoLoop(mass=mass, stiffness=stiffness, damping=damping, delay=0.008),
        sensor=Sensor(low_pass="butterworth3:120", sampling=480.0, noise=0.1, full_scale=100.0),  # noqa: S106
        limits=Limits(speed=0.25, stiffness=2e5),
    )  # fmt: skip


def model_of(name: str, gains):
    """MuJoCo's model of an arm: links of the tables, an actuator of these kp and kd a joint, a site at the flange."""
    import mujoco

    arm = tomllib.loads(
        files("palpate.robots.serial").joinpath("arms", f"{name}.toml").read_text(encoding="utf-8")
    )
    bodies, actuators = "", ""
    for joint, kp, kd in zip(arm["joint"], *gains, strict=True):
        xx, yy, zz, xy, xz, yz = joint["inertia"]
        bodies += (
            f'<body pos="{_text(joint["at"])}" euler="{_text(joint["turn"])}">'
            f'<joint name="{joint["name"]}" axis="0 0 1" armature="{joint["rotor"]}"/>'
            f'<inertial pos="{_text(joint["com"])}" mass="{joint["mass"]}" '
            f'fullinertia="{_text([xx, yy, zz, xy, xz, yz])}"/>'
        )
        actuators += f'<position joint="{joint["name"]}" kp="{kp}" kv="{kd}"/>'
    bodies += f'<site name="tip" pos="{_text(arm["flange"])}"/>' + "</body>" * len(arm["joint"])
    xml = (
        f'<mujoco><compiler angle="degree" eulerseq="XYZ"/>'
        f'<option timestep="{1.0 / RATE / STEPS:.17g}" integrator="implicitfast"/>'
        f"<worldbody>{bodies}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(xml), np.array(arm["home"], dtype=float)


def _text(numbers) -> str:
    return " ".join(f"{n:.17g}" for n in numbers)


class ServoWorld:
    """An arm at home whose tip is commanded along its own z, tick by tick.

    Args:
        name: of the arm.
        offset: of the joints from home [rad], shape (n,).
        gains: kp [N m/rad] and kd [N m s/rad] of its joints.
        delay: from command to actuator [s], whole steps of the physics.
        stiffness: of a surface without damping, `gap` before the tip [N/m]; none for 0.
        phase: when the sensor samples first [s].
        cutoff: of the sensor's low-pass, third order [Hz].
        sampling: of the sensor [Hz].
    """

    def __init__(
        self, name: str, offset, gains, delay: float, stiffness: float = 0.0, gap: float = 0.003, phase: float = 0.0,
        cutoff: float = 120.0, sampling: float = 480.0,
    ):  # fmt: skip
        import mujoco

        self._engine, (self.model, home) = mujoco, model_of(name, gains)
        home += offset
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = home
        mujoco.mj_forward(self.model, self.data)
        kp = np.array(gains[0], dtype=float)
        self._sag = self.data.qfrc_bias / kp  # the arm hangs in its servos
        self.setpoint, self._plan, self._quat = home + self._sag, mujoco.MjData(self.model), np.empty(4)
        self.normal = self.data.site("tip").xmat.reshape(3, 3)[:, 2].copy()
        self._site, self._start = self.model.site("tip").id, self.data.site("tip").xpos.copy()
        self._goal, self._turn = self._start.copy(), self.data.site("tip").xmat.reshape(3, 3).copy()
        self._stiffness, self._gap, self._h = stiffness, gap, 1.0 / RATE / STEPS
        self._line = [self.setpoint.copy()] * round(delay / self._h)
        A, b, c, _ = tf2ss(*butter(3, 2.0 * np.pi * cutoff, analog=True))
        middle = np.linalg.inv(np.eye(3) - 0.5 * self._h * A)  # trapezoidal rule
        self._E, self._e, self._c = middle @ (np.eye(3) + 0.5 * self._h * A), middle @ b[:, 0] * self._h, c[0]
        self._z, self._sampling, self._next, self._steps = np.zeros(3), sampling, phase, 0
        self._jacp, self._jacr = np.zeros((2, 3, self.model.nv))
        self.reading, self.samples = 0.0, 0

    @property
    def position(self) -> float:
        """Of the tip along its normal, from its start [m], as the joints' encoders have it."""
        return float(self.normal @ (self.data.site_xpos[self._site] - self._start))

    def tick(self, way: float, push: float = 0.0) -> float:
        """Moves the command by a way [m] for a tick, under a hand's force [N]; the mean force on the surface [N]."""
        self._goal += way * self.normal
        self._follow()
        total, along = 0.0, self._along()
        for _ in range(STEPS):
            self._line.append(self.setpoint)
            self.data.ctrl[:] = self._line.pop(0)
            self._engine.mj_step1(self.model, self.data)
            force = max(self._stiffness * (self.position - self._gap), 0.0)
            self.data.qfrc_applied[:] = -(force + push) * along
            self._engine.mj_step2(self.model, self.data)
            self._sense(force + push)
            total += force
        return total / STEPS

    def _along(self):
        """Row of the Jacobian along the normal, shape (n,)."""
        self._engine.mj_jacSite(self.model, self.data, self._jacp, self._jacr, self._site)
        return self.normal @ self._jacp

    def _follow(self) -> None:
        """Moves the joints' set-points such that their tip is at the goal and keeps its turn, by least motion."""
        self._plan.qpos[:] = self.setpoint - self._sag
        self._engine.mj_kinematics(self.model, self._plan)
        self._engine.mj_comPos(self.model, self._plan)
        self._engine.mj_jacSite(self.model, self._plan, self._jacp, self._jacr, self._site)
        miss, turn = self._goal - self._plan.site_xpos[self._site], np.zeros(3)
        self._engine.mju_mat2Quat(
            self._quat, (self._turn @ self._plan.site_xmat[self._site].reshape(3, 3).T).ravel()
        )
        self._engine.mju_quat2Vel(turn, self._quat, 1.0)
        self.setpoint = self.setpoint + np.linalg.pinv(np.vstack([self._jacp, self._jacr])) @ np.append(
            miss, turn
        )

    def _sense(self, force: float) -> None:
        self._z = self._E @ self._z + self._e * force
        self._steps += 1
        if self._steps * self._h >= self._next:
            self.reading, self._next = float(self._c @ self._z), self._next + 1.0 / self._sampling
            self.samples += 1
