"""What a record says of its instruments: filter and delay of the force, to a microsecond."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lsim

from bench.quick import quick
from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.bench import build
from palpate.bench.force_input import ForceInput
from palpate.bench.plant import Plant
from palpate.environments import KelvinVoigt, StickSlip, SurfaceState, join
from palpate.friction import LuGre
from palpate.instruments import Converter, analog_filter_190, force_sensor
from palpate.logs.tables.parquet import read_record, write_record
from palpate.robots.arm3 import Arm3

RATE, STEPS, DEPTH = 20000, 20, 4e-3


@kernel
def shake(plant, line, state, base, swing, force, readings):
    """An arm that presses under a swinging torque: the true force at each step, and what a tick reads of it."""
    way = line.start()
    for k in range(len(force)):
        if k % 20 == 0:
            readings[k // 20] = line.reading(way)
        t = k / 20000.0
        torque = base + (math.sin(31.4 * t) + 0.3 * math.sin(199.0 * t)) * swing
        state, felt = plant.advance(state, torque, 1.0 / 20000.0)
        force[k] = felt.normal
        way = line.advance(way, felt.normal, k, 0.0)


@pytest.mark.long
@pytest.mark.parametrize("phase", [0.0, 7.3e-4])
def test_a_fresh_reading_is_the_filtered_force_of_its_instant(phase):
    """No noise and 32 bits: what is left is the true force, through a continuous Butterworth, so much earlier."""
    plant = Plant(
        Arm3().with_rotors(),
        LuGre().scaled_by(0.3),
        join(KelvinVoigt(5200, 200, 0.1)),
        StickSlip(5000, 20, 0.7),
        0.465,
    )
    state = plant.start_at(plant.arm.inverse(Vec3(0.465 + DEPTH, 0.0, 0.0), 1.0))
    state = state._replace(surface=SurfaceState(DEPTH, 0.0, 0.0, 1.0))
    push = plant.arm.jac(state.q).T
    sensor = force_sensor(noise=0.0, bits=32, phase=phase)
    line = ForceInput(sensor, analog_filter_190(float(RATE)), 0.0, Converter(32, 200.0))
    force, readings = np.empty(2 * RATE), np.empty(2 * RATE // STEPS)
    shake(plant, line, state, push @ Vec3(20.0, 0.0, 0.0), push @ Vec3(7.0, 0.0, 0.0), force, readings)
    assert force[RATE // 4 :].min() > 1.0

    time = np.arange(len(force)) / RATE
    smooth = CubicSpline(time, lsim(butter(3, 2 * np.pi * 120, analog=True), force, time)[1])
    clock = phase + np.arange(240, 950) / 480.0 + 1.0 / RATE
    fresh = readings[np.ceil(clock * 1000 - 1e-9).astype(int)]
    measured = clock - line.description()["delay_s"]
    off, slope = fresh - smooth(measured), smooth.derivative()(measured)
    assert abs(off @ slope) / (slope @ slope) < 1e-6, "the bilinear filter itself is 0.3 us off"
    # Sampling on steps of 50 us: uniform within them, 14 us rms.
    assert np.std(off) < 16e-6 * np.std(slope)


def test_a_record_carries_its_instruments_to_disk_and_back(tmp_path):
    record = build(quick("foam-hybrid", force_sensor={"phase": 5e-4})).run(0.3)
    told = record.meta["instruments"]
    assert told["position"] == {"lag_s": 0.0}
    assert told["force"]["filter"] == "butterworth3:120"
    assert told["force"]["sampling_Hz"] == 480.0
    assert told["force"]["delay_s"] == pytest.approx(1.0 / 480.0, abs=50e-6)
    assert read_record(write_record(record, tmp_path / "record.parquet")).meta["instruments"] == told


def test_a_line_with_a_filter_of_its_own_has_no_name():
    record = build(quick("foam-hybrid", force_sensor={"analog_filter": True})).run(0.01)
    assert record.meta["instruments"]["force"]["filter"] == "unknown"
