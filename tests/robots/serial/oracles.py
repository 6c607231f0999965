"""The same arm in two engines that know nothing of palpate's laws: MuJoCo and Pinocchio."""

from pathlib import Path

import numpy as np

from palpate.robots import SerialArm
from palpate.robots.serial.serial_arm import scene_of

NAMES = ("ur5e", "panda", "fr3", "iiwa14")
URDF = Path(__file__).with_name("gantry.urdf")


def every_arm():
    """The four arms by name, and a user's URDF with prismatic joints."""
    return {**{name: SerialArm.named(name) for name in NAMES}, "gantry": SerialArm.from_urdf(URDF, "probe")}


def states(arm, count, seed=0):
    g = np.random.default_rng(seed)
    for _ in range(count):
        yield g.uniform(-2.0, 2.0, arm.joints), g.normal(size=arm.joints)


class ByMuJoCo:
    def __init__(self, arm):
        import mujoco

        self.engine, self.scene = mujoco, scene_of(arm)
        self.data = mujoco.MjData(self.scene.model)

    def __call__(self, q, qd):
        """Tip, J, Jdot qd, M, h."""
        engine, model, data, dofs = self.engine, self.scene.model, self.data, self.scene.dofs
        data.qpos[self.scene.positions], data.qvel[dofs] = q, qd
        engine.mj_forward(model, data)
        M, J, Jd = np.zeros((model.nv, model.nv)), np.zeros((6, model.nv)), np.zeros((6, model.nv))
        engine.mj_fullM(model, data, M)
        at, axes = self.scene.tip(data)
        engine.mj_jac(model, data, J[:3], J[3:], at, self.scene.body)
        engine.mj_jacDot(model, data, Jd[:3], Jd[3:], at, self.scene.body)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = axes, at
        return pose, J, Jd @ data.qvel, M, np.array(data.qfrc_bias)


class ByPinocchio:
    """Built joint by joint from the numbers, or by Pinocchio's own reader of URDF."""

    def __init__(self, arm, urdf=None, frame=None):
        import pinocchio as pin

        self.engine = pin
        self.model = pin.buildModelFromUrdf(str(urdf)) if urdf else self.built(arm)
        self.model.gravity.linear = np.array(arm.chain.gravity)
        self.frame = self.model.getFrameId(frame or "tip")
        self.data = self.model.createData()

    def built(self, arm):
        pin, c, model, parent = self.engine, arm.chain, self.engine.Model(), 0
        for i, name in enumerate(arm.names):
            joint = pin.JointModelPZ() if c.slide[i] else pin.JointModelRZ()
            parent = model.addJoint(parent, joint, pin.SE3(c.turn[i], c.at[i]), name)
            body = pin.Inertia(c.mass[i], c.com[i], c.inertia[i])
            model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        model.armature = np.array(c.rotor)
        model.addFrame(pin.Frame("tip", parent, 0, pin.SE3(c.tip_turn, c.tip), pin.FrameType.OP_FRAME))
        return model

    def __call__(self, q, qd):
        pin, model, data = self.engine, self.model, self.data
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.computeAllTerms(model, data, q, qd)
        pin.forwardKinematics(model, data, q, qd, 0.0 * qd)
        pin.updateFramePlacements(model, data)
        bias = pin.getFrameClassicalAcceleration(model, data, self.frame, world).vector
        J = pin.computeFrameJacobian(model, data, q, self.frame, world)
        pin.crba(model, data, q)
        M = np.triu(data.M) + np.triu(data.M, 1).T
        return data.oMf[self.frame].homogeneous, J, bias, M, pin.nonLinearEffects(model, data, q, qd)
