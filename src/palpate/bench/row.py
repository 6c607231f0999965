"""Record of one tick: one row, every column a number with a unit."""

from palpate._jit import law

#: Name and unit of every column, in the order of `tick.write`.
COLUMNS = {
    "t": "s",
    "phase": "1",  # 0 approach, 1 contact, 2 lost contact
    **{f"q{i}": "rad" for i in (1, 2, 3)},  # true joint angles
    **{f"qd{i}": "rad/s" for i in (1, 2, 3)},
    "x": "m",  # true pose of the tip
    "y": "m",
    "phi": "rad",
    "x_measured": "m",  # as the controller computes it from the encoders
    "y_measured": "m",
    "phi_measured": "rad",
    "vx_measured": "m/s",  # filtered
    "vy_measured": "m/s",
    "vphi_measured": "rad/s",
    "vx_raw": "m/s",  # first difference
    "ax_raw": "m/s^2",  # second difference
    "ax_measured": "m/s^2",  # filtered
    "x_desired": "m",
    "y_desired": "m",
    "phi_desired": "rad",
    "force": "N",  # true normal force during the step before, positive when pressed
    "force_side": "N",  # true force along y
    "force_sampled": "N",
    "force_measured": "N",  # filtered: what the controller sees
    "force_desired": "N",
    **{f"torque{i}": "N m" for i in (1, 2, 3)},  # as applied
    **{f"saturated{i}": "1" for i in (1, 2, 3)},  # 1 where the limit held the torque back
    **{f"friction{i}": "N m" for i in (1, 2, 3)},
    "penetration": "m",  # true
    "touching": "1",  # true
    "displacement": "m",  # measured x from where the contact controller took over
    **{
        f"{name}_{front}": unit
        for front in ("thesis", "raw", "matched")
        for name, unit in (("M", "kg"), ("B", "N s/m"), ("K", "N/m"))
    },
    "M_matched_std": "kg",
    "B_matched_std": "N s/m",
    "K_matched_std": "N/m",
    "memory_fx": "N",  # the force command that the controller has gathered or learned
    "memory_fy": "N",
    "memory_moment": "N m",
    # What an adaptive controller reports of itself; zero for others.
    **{f"adapted{i}": "1" for i in (1, 2, 3)},
}


@law
def put(out, at, vector):
    """Writes a vector's three components into out from column `at` on; the next free column."""
    out[at], out[at + 1], out[at + 2] = vector.x, vector.y, vector.z
    return at + 3
