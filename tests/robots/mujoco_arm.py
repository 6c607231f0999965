"""The same numbers as a MuJoCo model: level plane, inertias written out, a site at the tip."""

import mujoco
import numpy as np

LINK = """<body pos="{origin:.17g} 0 0"><joint type="hinge" axis="0 0 1"/>
<inertial pos="{com:.17g} 0 0" mass="{mass:.17g}" diaginertia="{moment:.17g} {moment:.17g} {moment:.17g}"/>"""


def model_of(arm):
    origins = (0.0, arm.length.x, arm.length.y)
    links = "".join(
        LINK.format(origin=o, com=a + s, mass=m, moment=i)
        for o, a, s, m, i in zip(origins, arm.length, arm.com, arm.mass, arm.moment, strict=True)
    )
    tip = f'<site name="tip" pos="{arm.length.z:.17g} 0 0"/>'
    option = '<option gravity="0 0 0"/><compiler balanceinertia="false"/>'
    xml = f"<mujoco>{option}<worldbody>{links}{tip}{'</body>' * 3}</worldbody></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


class Oracle:
    """MuJoCo's answers at one state."""

    def __init__(self, arm, q, qd, qdd=(0.0, 0.0, 0.0)):
        self.model = model_of(arm)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = q, qd
        mujoco.mj_forward(self.model, self.data)
        self.data.qacc[:] = qdd
        mujoco.mj_inverse(self.model, self.data)

    @property
    def torque(self):
        return self.data.qfrc_inverse.copy()

    @property
    def bias(self):
        return self.data.qfrc_bias.copy()

    @property
    def mass_matrix(self):
        M = np.zeros((3, 3))
        mujoco.mj_fullM(self.model, self.data, M)
        return M

    @property
    def jacobian(self):
        linear, angular = np.zeros((3, 3)), np.zeros((3, 3))
        mujoco.mj_jacSite(self.model, self.data, linear, angular, self.model.site("tip").id)
        return np.vstack([linear[:2], angular[2:]])

    @property
    def position(self):
        return self.data.site("tip").xpos[:2].copy()
