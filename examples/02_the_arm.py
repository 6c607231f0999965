"""The thesis' arm on arrays: pose of the tip, torques of the motors, largest force."""

import numpy as np

from palpate.robots import Planar3R

robot = Planar3R()
pose = [0.454, 0.0, 0.0]  # x [m], y [m], phi [rad]: just in front of the wall

for elbow in (+1, -1):
    q = robot.inverse_kinematics(pose, elbow)
    print(
        f"elbow {elbow:+d}: joint angles {np.rad2deg(q).round(1)} deg, back to {robot.forward_kinematics(q)}"
    )

q = robot.inverse_kinematics(pose)
print("inertia [kg m^2]:")
print(robot.mass_matrix(q).round(4))

# A push of 20 N into the wall, at rest: the torque is J^T f.
torque = robot.inverse_dynamics(q, np.zeros(3), np.zeros(3), tip_wrench=[20.0, 0.0, 0.0])
print(f"torque for 20 N [N m]: {torque.round(3)}, limits {robot.torque_limits}")
largest = np.min(robot.torque_limits / (np.abs(torque) / 20.0 + 1e-12))
print(f"the largest push at this pose: {largest:.1f} N")
