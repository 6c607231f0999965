"""Two simulators of a press along one axis, which share nothing but the drawn numbers: C, and MuJoCo."""

from __future__ import annotations

import ctypes
import math
import os
import subprocess
import tempfile
from collections import deque
from functools import cache
from pathlib import Path
from typing import NamedTuple

import mujoco
from press_draws import FULL_SCALE, RESOLUTION, Draw


class Sample(NamedTuple):
    """State after a tick."""

    reading: float  # N
    position: float  # of the encoders [m]
    tip: float  # true position [m]
    force: float  # true force on the surface [N]
    largest: float  # the same, its largest within the tick [N]
    error: float  # of the reading, without noise [N]


C_STEP = 1e-4
"""Step of the simulator in C [s]: an eightieth of the low-pass' period, less of a tip of 3 kg on 1e5 N/m."""
C_SOURCE = r"""
#include <math.h>
/* Semi-implicit Euler. p: w z K D_relative D_ground mass tool place tau low-pass period noise step layers scale,
   then pairs of depth and added stiffness, then the errors. s: y y' x x' f f' f'' clock reading time largest force
   error delay head, then the ring of commands. */
enum { RING = 512 };
static double reading_error(const double *e, double t, double x) {
    double end = x < e[3] ? x : e[3], cable = x > e[2] && x < e[4] ? e[1] * (end - e[2]) : 0;
    double ripple = e[5] * (sin(6.283185307179586 * x / e[6] + e[7]) - sin(e[7]));
    return e[0] + cable + ripple + e[8] * (t < e[9] ? t : e[9]);
}
void tick(double *s, const double *p, double command, int steps, double h, double normal) {
    int layers = (int)p[13];
    const double *surface = p + 15, *errors = surface + 2 * layers;
    s[10] = 0;
    for (int i = 0; i < steps; i++) {
        int head = (int)s[14];
        s[15 + head] = command;
        double late = s[15 + (head + RING - (int)s[13]) % RING];
        s[14] = (head + 1) % RING;
        if (p[0] > 0) {
            s[1] += h * (p[0] * p[0] * (late - s[0]) - 2 * p[1] * p[0] * s[1]);
            s[0] += h * s[1];
        } else {
            s[0] = late;
        }
        double depth = s[2] - p[7], stiffness = 0, force = 0;
        for (int k = 0; k < layers; k++)
            if (depth > surface[2 * k]) {
                stiffness += surface[2 * k + 1];
                force += surface[2 * k + 1] * (depth - surface[2 * k]);
            }
        force += p[8] * stiffness * s[3];
        if (force < 0) force = 0;
        double a = (p[2] * (s[0] - s[2]) + p[3] * (s[1] - s[3]) - p[4] * s[3] - force) / p[5];
        s[3] += h * a;
        s[2] += h * s[3];
        s[9] += h;
        s[11] = force;
        if (force > s[10]) s[10] = force;
        s[12] = reading_error(errors, s[9], s[2]);
        double w = p[9]; /* Butterworth of third order */
        s[6] += h * (w * w * w * (force + p[6] * a + s[12] - s[4]) - 2 * w * w * s[5] - 2 * w * s[6]);
        s[5] += h * s[6];
        s[4] += h * s[5];
        s[7] += h;
        if (s[7] >= p[10]) {
            s[7] -= p[10];
            s[8] = fmax(-p[14], fmin(p[14], p[12] * floor((s[4] + p[11] * normal) / p[12] + 0.5)));
        }
    }
}
"""


@cache
def compiled() -> ctypes.CDLL:
    """Load the simulator, compiled by $CC or cc."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "press.c"), Path(folder, "press.so")
        source.write_text(C_SOURCE, encoding="utf-8")
        compiler = [os.environ.get("CC", "cc"), "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
        subprocess.run([*compiler, source, "-o", library, "-lm"], check=True)  # noqa: S603 -- the user's compiler
        loaded = ctypes.CDLL(str(library))
    number, array = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
    loaded.tick.argtypes = [array, array, number, ctypes.c_int, number, number]
    loaded.tick.restype = None
    return loaded


def added_stiffness(draw: Draw) -> list[tuple[float, float]]:
    """Springs side by side that are the layers: the depth where each begins [m], and its stiffness [N/m]."""
    before = [0.0, *(stiffness for _, stiffness in draw.layers)]
    return [(depth, stiffness - b) for (depth, stiffness), b in zip(draw.layers, before, strict=False)]


class Axis:
    """Simulator in C. A spring between command and tip; the surface and the sensor in one loop over time."""

    def __init__(self, draw: Draw) -> None:
        arm, springs = draw.arm, added_stiffness(draw)
        damping = (arm.damping, 0.0) if arm.kind == "position" else (0.0, arm.damping)
        p = [arm.bandwidth, arm.ratio, arm.stiffness, *damping, arm.mass, arm.tool, draw.distance, draw.tau]
        p += [
            2 * math.pi * draw.low_pass,
            1 / draw.sampling,
            draw.noise,
            RESOLUTION,
            len(springs),
            FULL_SCALE,
        ]
        p += [number for spring in springs for number in spring] + [*draw.errors]
        self._parameters = (ctypes.c_double * len(p))(*p)
        self._state = (ctypes.c_double * (15 + 512))()
        self._state[13] = round(arm.delay / C_STEP)
        self._state[7] = (draw.seed % 97) / 97 / draw.sampling  # phase of the sensor's clock
        self._encoder = 0 if arm.kind == "position" else 2  # motors, or the tip
        self._tick = compiled().tick

    def tick(self, command: float, duration: float, noise: float) -> Sample:
        """Move for `duration` [s] under the commanded position [m]; `noise` is a standard normal draw."""
        s = self._state
        self._tick(s, self._parameters, command, round(duration / C_STEP), C_STEP, noise)
        return Sample(s[8], s[self._encoder], s[2], s[11], s[10], s[12])


MUJOCO_STEP = 2e-4
"""Step of MuJoCo [s]: a tick's jitter is one step."""
MOTOR = 1000.0
"""Mass of a position arm's motors [kg]: so heavy that the force moves them by less than a hundredth of the spring."""


class Engine:
    """MuJoCo: slide joints with a position actuator; each layer is a tendon that is slack until its depth."""

    def __init__(self, draw: Draw) -> None:
        arm = draw.arm
        position = arm.kind == "position"
        joint = (
            f"stiffness='{arm.stiffness}' damping='{arm.damping}'" if position else f"damping='{arm.damping}'"
        )
        tip = f"<joint name='tip' type='slide' axis='1 0 0' {joint}/><geom size='.01' mass='{arm.mass}'/>"
        motor = "<joint name='motor' type='slide' axis='1 0 0'/><geom size='.01' mass='1000'/>"
        body = f"<body>{motor}<body>{tip}</body></body>" if position else f"<body>{tip}</body>"
        w, driven = arm.bandwidth, "motor" if position else "tip"
        kp, kv = (MOTOR * w * w, 2 * MOTOR * arm.ratio * w) if position else (arm.stiffness, 0.0)
        coordinates = "".join(
            f"<joint joint='{name}' coef='1'/>" for name in ("motor", "tip") if f"'{name}'" in body
        )
        springs = added_stiffness(draw)
        tendons = "".join(
            f"<fixed springlength='-1 {draw.distance + depth}' stiffness='{stiffness}'>{coordinates}</fixed>"
            for depth, stiffness in springs
        )
        self._model = mujoco.MjModel.from_xml_string(
            f"<mujoco><option timestep='{MUJOCO_STEP}' gravity='0 0 0' integrator='implicitfast'>"
            f"<flag contact='disable'/></option><worldbody>{body}</worldbody><tendon>{tendons}</tendon>"
            f"<actuator><position joint='{driven}' kp='{kp}' kv='{kv}'/></actuator></mujoco>"
        )
        self._data = mujoco.MjData(self._model)
        self._draw = draw
        self._springs = [(draw.distance + depth, stiffness) for depth, stiffness in springs]
        steps = round(arm.delay / MUJOCO_STEP)
        self._late = deque([0.0] * (steps + 1), maxlen=steps + 1)
        self._filter = (0.0, 0.0, 0.0)
        self._clock, self._reading = (draw.seed % 89) / 89 / draw.sampling, 0.0

    def tick(self, command: float, duration: float, noise: float) -> Sample:
        """Move for `duration` [s] under the commanded position [m]; `noise` is a standard normal draw."""
        data, largest, force, error = self._data, 0.0, 0.0, 0.0
        for _ in range(round(duration / MUJOCO_STEP)):
            self._late.append(command)
            data.ctrl[0] = self._late[0]
            force = self._touch(sum(data.qpos.tolist()), sum(data.qvel.tolist()))
            mujoco.mj_step(self._model, data)
            largest = max(largest, force)
            error = self._sense(force, sum(data.qpos.tolist()), sum(data.qacc.tolist()), noise)
        position, *swing = data.qpos.tolist()
        return Sample(self._reading, position, sum(swing, position), force, largest, error)

    def _touch(self, x: float, speed: float) -> float:
        """Give the surface its damping while it is touched, which a tendon has always; the force [N]."""
        touched = [(x - begin, stiffness) for begin, stiffness in self._springs if x > begin]
        force, damping = sum(p * k for p, k in touched), self._draw.tau * sum(k for _, k in touched)
        damping = damping if force + damping * speed > 0 else 0.0
        self._model.tendon_damping[0] = damping
        return force + damping * speed

    def _sense(self, force: float, x: float, acceleration: float, noise: float) -> float:
        """Pass the force, the tool's inertia and the error through the low-pass; sample it; the error [N]."""
        draw, e = self._draw, self._draw.errors
        cable = e.cable * (min(x, e.slips) - e.begin) if e.begin < x < e.ends else 0.0
        ripple = e.ripple * (math.sin(2 * math.pi * x / e.wave + e.phase) - math.sin(e.phase))
        error = e.bias + cable + ripple + e.drift * min(float(self._data.time), e.settles)
        # A first-order section before one of second order with damping 0.5: Butterworth of third order.
        w, h = 2 * math.pi * draw.low_pass, MUJOCO_STEP
        first, second, rate = self._filter
        first += h * w * (force + draw.arm.tool * acceleration + error - first)
        rate += h * (w * w * (first - second) - w * rate)
        second += h * rate
        self._filter = first, second, rate
        self._clock += h
        if self._clock >= 1 / draw.sampling:
            self._clock -= 1 / draw.sampling
            reading = RESOLUTION * round((second + draw.noise * noise) / RESOLUTION)
            self._reading = max(-FULL_SCALE, min(FULL_SCALE, reading))
        return error


SIMULATORS = {"axis": Axis, "mujoco": Engine}
