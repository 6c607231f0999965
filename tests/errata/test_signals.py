"""Chapter 3, appendix B, and the filters and instruments of the listing."""

import numpy as np
from scipy import signal

from errata.derivation import LENGTH, START, derivative, pose
from errata.page import fails, holds
from palpate.instruments import sallen_key
from palpate.references import ForceSchedule
from palpate.signals.filters import butterworth2

RATE = 1000.0
B_120, A_120 = (0.0913, 0.1826, 0.0913), (1.0, -0.9824, 0.3477)
FREQUENCIES = np.linspace(0.0, 499.0, 49901)


def response(b, a):
    return signal.freqz(b, a, worN=FREQUENCIES, fs=RATE)[1]


def corner(b, a):
    """Where the gain has fallen by 3 dB [Hz]."""
    gain = np.abs(response(b, a))
    return FREQUENCIES[np.argmax(gain < gain[0] / np.sqrt(2.0))]


def lag(b, a):
    """Phase over angular frequency at 1 Hz [s]."""
    return -np.angle(response(b, a)[100]) / (2.0 * np.pi)


def test_E49_butterworth_coefficients():
    printed = {120.0: (B_120, A_120), 35.0: ((0.0104, 0.0209, 0.0104), (1.0, -1.691, 0.7327))}
    for cutoff, (b, a) in printed.items():
        book_b, book_a = signal.butter(2, cutoff, fs=RATE)
        holds(np.subtract(b, book_b), 0.6e-4)
        holds(np.subtract(a, book_a), 0.6e-4)
        used = butterworth2(cutoff, RATE)
        holds(np.subtract((used.b0, used.b1, used.b2), book_b), 1e-12)


def test_E50_the_force_filter_feeds_on_itself():
    """The numerator's old samples are the filter's own output: its weights move into the denominator."""
    printed = (B_120[0],), (1.0, A_120[1] - B_120[1], A_120[2] - B_120[2])
    holds(corner(B_120, A_120) - 120.0, 0.5)
    holds(lag(B_120, A_120) - 1.79e-3, 0.02e-3)
    fails(corner(*printed) - 120.0, 95.0)
    holds(corner(*printed) - 21.9, 0.2)
    fails(lag(*printed) - 1.79e-3, 5e-3)
    holds(lag(*printed) - 7.1e-3, 0.1e-3)


def listing_filter(u, twice):
    """The filter with its samples put right; `twice` also repeats the shift after the new sample has come in."""
    y, u_1, u_2, y_1, y_2, now, out = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, []
    for sample in u:
        u_2, u_1, y_2, y_1 = u_1, now, y_1, y
        now = sample
        y = B_120[0] * now + B_120[1] * u_1 + B_120[2] * u_2 - A_120[1] * y_1 - A_120[2] * y_2
        if twice:
            u_1 = now
        out.append(y)
    return np.array(out)


def test_E51_the_sample_is_shifted_twice():
    """At 480 Hz the two old samples are then one and the same, and the filter's zero at 500 Hz is gone."""
    t = np.arange(2000) / RATE
    tone = np.sin(2.0 * np.pi * 480.0 * t)
    holds(np.std(listing_filter(tone, twice=False)[500:]) * np.sqrt(2.0), 1e-3)
    fails(np.std(listing_filter(tone, twice=True)[500:]) * np.sqrt(2.0), 0.07)


def test_E52_the_determinant():
    a1, a2, _ = LENGTH
    det = np.linalg.det(derivative(pose, START))
    holds(a1 * a2 * np.sin(START[1]) / det - 1.0, 1e-12)
    fails(a1 * START[1] * np.sin(START[1]) / det - 1.0, 7.0)


def test_E53_the_resolvers_are_swapped():
    """The listing divides counts by three constants in proportion to counts a turn, whatever the converter's unit."""
    motor_1, motor_2, motor_3 = 0.0116578, 0.00776, 3.794865e-5
    chapter_3, appendix_b = (614400.0, 409600.0, 2000.0), (409600.0, 614400.0, 2000.0)

    def off(counts):
        measured = np.array([motor_1, motor_2]) / motor_3
        return measured / (np.array(counts[:2]) / counts[2]) - 1.0

    holds(off(chapter_3), 0.002)
    fails(off(appendix_b), 0.3)
    holds(off(chapter_3)[0], 1e-5)
    # Motor 2's constant has three digits only: its angles come out 0.15 % too far from the start.
    holds(off(chapter_3)[1] + 0.0015, 1e-4)


def test_E54_inertia_is_no_force_times_area():
    """Dimensions as exponents of (mass, length, time), and the size that each reading would give the rotor."""
    kilogram, metre, newton = np.array([1, 0, 0]), np.array([0, 1, 0]), np.array([1, 1, -2])
    torque, acceleration = newton + metre, np.array([0, 0, -2])
    fails(newton + 2 * metre - (torque - acceleration), 1)
    holds(kilogram + 2 * metre - (torque - acceleration), 0)
    # Read as kgf m s^2 it would be 9.8 times as much: radii of gyration of 18 and 12 cm with the whole motor's mass.
    for inertia, mass in ((0.084, 24.0), (0.009, 6.5)):
        holds(np.sqrt(inertia / mass), 0.06)
        fails(np.sqrt(9.80665 * inertia / mass), 0.115)


def spectrum(samples):
    """Amplitudes by frequency, one bin a hertz, of one second at 1 kHz."""
    return 2.0 * np.abs(np.fft.rfft(samples)) / len(samples)


def test_E55_480_hertz_does_not_fold():
    t = np.arange(1000) / RATE
    at_480, at_960 = (spectrum(np.sin(2.0 * np.pi * f * t)) for f in (480.0, 960.0))
    holds(at_480[480] - 1.0, 1e-9)
    fails(at_480[40] - 1.0, 0.999)  # nothing of it where an alias would be
    holds(at_960[40] - 1.0, 1e-9)
    # A 20 Hz force, held at 480 Hz: the images beyond 500 Hz, 940 and 1940 above all, fold to 60 Hz: 3 per cent.
    fine = np.arange(48_000) / 48_000
    held = np.sin(2.0 * np.pi * 20.0 * np.floor(fine * 480.0 + 1e-9) / 480.0)
    seen = spectrum(held[::48])
    holds(seen[60] - 0.032, 0.003)
    holds(seen[20] - 1.0, 0.03)


def low_pass(f, r1=100.0, r2=1.5, c1=470e-6, c2=10e-6):
    """The transfer function of section 3 at f [Hz]."""
    s, w2 = 2j * np.pi * f, 1.0 / (r1 * r2 * c1 * c2)
    return w2 / (s * s + (r1 + r2) / (r1 * r2 * c1) * s + w2)


def test_E56_190_hertz_is_not_where_3_db_are_lost():
    f = np.linspace(100.0, 300.0, 20001)
    half_power = f[np.argmax(np.abs(low_pass(f)) < np.sqrt(0.5))]
    fails(half_power - 190.0, 25.0)
    holds(half_power - 216.5, 0.2)
    natural = f[np.argmax(np.angle(low_pass(f)) < -np.pi / 2)]
    holds(natural - 189.6, 0.1)
    holds(np.abs(low_pass(189.55)) - 0.827, 0.001)  # the gain at the natural frequency is Q
    used = sallen_key(100.0, 1.5, 470e-6, 10e-6, rate=200e3)
    z = np.exp(-2j * np.pi * f / used.rate)
    digital = (used.b0 + used.b1 * z + used.b2 * z * z) / (1.0 + used.a1 * z + used.a2 * z * z)
    holds(np.abs(digital) - np.abs(low_pass(f)), 1e-3)


def test_E57_ohms_and_microfarads():
    """Kiloohms and nanofarads give the same filter; the printed ones draw a hundred milliamperes."""
    f = np.linspace(1.0, 1000.0, 500)
    thousandfold = low_pass(f, 100e3, 1.5e3, 470e-9, 10e-9)
    holds(thousandfold / low_pass(f) - 1.0, 1e-12)

    def current(r1, r2, c1, c2):
        """Into R1 at 10 V and 480 Hz [A], output buffered: the node behind R1 is u (1 + s R2 C2) H."""
        s = 2j * np.pi * 480.0
        return abs(10.0 * (1.0 - (1.0 + s * r2 * c2) * low_pass(480.0, r1, r2, c1, c2)) / r1)

    fails(current(100.0, 1.5, 470e-6, 10e-6), 0.1)  # an amplifier gives some 20 mA
    holds(current(100e3, 1.5e3, 470e-9, 10e-9), 2e-4)


def test_E58_the_sine_starts_anew():
    """4 sin(pi t) against the listing's counter, which goes back to zero each five seconds."""
    text = ForceSchedule(20.0, 10.0, 2.5, 4.0, 0.5, 0.0)
    listing = ForceSchedule(20.0, 10.0, 2.5, 4.0, 0.5, 5.0)

    def off(schedule, times):
        level = [20.0 if int(t / 2.5) % 2 == 0 else 10.0 for t in times]
        return [schedule.force(t) - at - 4.0 * np.sin(np.pi * t) for t, at in zip(times, level, strict=True)]

    first, second = np.arange(0.005, 5.0, 0.01), np.arange(5.005, 10.0, 0.01)
    holds(off(text, np.concatenate([first, second])), 1e-9)
    holds(off(listing, first), 1e-9)
    fails(off(listing, second), 7.9)


def test_E59_the_zero_of_another_channel():
    """-200 N/V times (reading - zero), the zero taken once at the start."""
    offsets = {0x1F: 0.025, 0x10: -0.004}  # V, of two inputs of a converter

    def force(zero_from, newtons=0.0):
        return -200.0 * ((offsets[0x1F] - newtons / 200.0) - offsets[zero_from])

    holds(force(0x1F, 20.0) - 20.0, 1e-12)
    assert abs(force(0x10, 20.0) - 20.0) > 5.0


def test_E60_the_timer_starts_before_the_zero_is_read():
    """Force that the first three ticks see of a sensor at rest whose output stands at 25 mV."""

    def felt(zero_read_at):
        zero, forces = 0.0, []
        for tick in range(3):
            if tick >= zero_read_at:
                zero = 0.025
            forces.append(-200.0 * (0.025 - zero))
        return forces

    holds(felt(0), 0.0)
    fails(felt(1), 4.9)
