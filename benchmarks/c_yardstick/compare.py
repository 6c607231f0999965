"""The compiled tick against the same arithmetic written by hand in C: first that they agree, then what each costs.

foam-neural: arm, contact, LuGre friction, sensors, hybrid law, a 9-12-3 network that learns, three recursive least
squares and the row of the record. The C is built as it stands, IEEE: optimised, but no operation changed or left out.
Bursts of the two take turns, C before and after each of the kernel's, so that both have met the same machine.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate._vector import Vec3
from palpate.bench import build, load, start_at
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import Loop, compiled_march
from palpate.controllers import alone
from palpate.environments.surface import alone as alone_surface

HERE = Path(__file__).parent
FLAGS = "-O3 -march=native -ffp-contract=off -fno-math-errno -std=c11 -shared -fPIC"
"""The kernel is compiled for this machine's processor as well; -fno-math-errno changes no result."""
EXPERIMENT = "foam-neural"
WIDTH = len(COLUMNS)
AGREED = 1e-8
FINE_BITS, FINE_COUNTS = 50, 1e17
"""Bits of a converter, and counts per turn of an encoder, up to which rounding to steps is exact."""
TARGET, MOST = 1.2, 1.5
TICKS = 2000

Array = NDArray[np.float64]
March = Callable[[Array, Array], None]
"""Marches from where it stands: one tick for each number of noise, its row into the array."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--seconds", type=float, default=12.0, help="of the trajectory that both are compared on"
    )
    parser.add_argument("--bursts", type=int, default=41)
    given = parser.parse_args()
    compilers = [os.environ["CC"]] if "CC" in os.environ else [c for c in ("gcc", "clang") if shutil.which(c)]
    print(
        "| a tick of foam-neural | in C [us] | compiled by palpate [us] | times C (middle half of the bursts) |"
    )
    print("|---|---|---|---|")
    good = bool(compilers)
    for compiler in compilers:
        with library(compiler) as lib:
            apart = disagreement(lib, given.seconds)
            ratios, c, ours = bursts(lib, given.bursts)
        low, ratio, high = np.percentile(ratios, (25, 50, 75))
        print(
            f"| C by {compiler} -O3 | {1e6 * c:.2f} | {1e6 * ours:.2f} | **{ratio:.2f}** ({low:.2f} to {high:.2f}) |"
        )
        good = good and apart <= AGREED and ratio <= MOST
    title = f"trajectories of {given.seconds:g} s, without noise, by exact instruments"
    print(f"| {title}: largest difference, of each column's largest value | | {apart:.1e} | |")
    return 0 if good else 1


def disagreement(lib: ctypes.CDLL, duration: float) -> float:
    """The largest difference of the two trajectories, in terms of each column's largest number."""
    bench = build(load(EXPERIMENT))
    loop = exact(bench.loop)
    noise = np.zeros(round(duration / loop.tick))
    ours, theirs = np.empty((2, len(noise), WIDTH))
    in_kernel(loop, bench.q)(noise, ours)
    in_c(lib, loop, bench.q)(noise, theirs)
    scale = np.abs(ours).max(axis=0)
    apart = np.abs(ours - theirs).max(axis=0) / np.where(scale > 0.0, scale, 1.0)
    return float(apart.max())


def bursts(lib: ctypes.CDLL, count: int) -> tuple[Array, float, float]:
    """Ratios of the kernel to the C around it, shape (count,), and median times of a tick in C and here [s]."""
    bench = build(load(EXPERIMENT))
    noise, out = np.random.default_rng(0).standard_normal(TICKS), np.empty((TICKS, WIDTH))
    engines = in_c(lib, bench.loop, bench.q), in_kernel(bench.loop, bench.q)
    # Into contact and learning first, where a tick costs most.
    for engine in engines:
        for _ in range(round(10.0 / bench.loop.tick / TICKS)):
            engine(noise, out)
    times = [seconds(engines[i % 2], noise, out) / TICKS for i in range(2 * count + 1)]
    before, ours, after = (np.array(t) for t in (times[0:-1:2], times[1::2], times[2::2]))
    c = 0.5 * (before + after)
    return ours / c, float(np.median(c)), float(np.median(ours))


def seconds(engine: March, noise: Array, out: Array) -> float:
    """Of the processor, in this thread: what else runs on the machine takes its turns outside."""
    begun = time.thread_time()
    engine(noise, out)
    return time.thread_time() - begun


def exact(loop: Loop) -> Loop:
    """The loop with instruments so fine that rounding does not split two trajectories."""
    sensor, fine = loop.force.sensor, {"bits": FINE_BITS}
    return loop._replace(
        encoder=loop.encoder._replace(counts=Vec3(FINE_COUNTS, FINE_COUNTS, FINE_COUNTS)),
        force=loop.force._replace(
            sensor=sensor._replace(converter=sensor.converter._replace(**fine)),
            converter=loop.force.converter._replace(**fine),
        ),
        output=loop.output._replace(full_scale=2.0 * loop.conditioning.arm.limits, **fine),
    )


def numbers_of(tree) -> Array:
    """The numbers of nested tuples in their order, shape (n,)."""
    parts = [
        numbers_of(branch) if isinstance(branch, tuple) else np.ravel(branch).astype(float) for branch in tree
    ]
    return np.concatenate(parts) if parts else np.zeros(0)


def in_kernel(loop: Loop, q) -> March:
    """The bench's own compiled loop."""
    state, done = start_at(loop, q), 0

    def march(noise: Array, out: Array) -> None:
        nonlocal state, done
        state = compiled_march(loop, state, done, noise, out)
        done += len(noise)

    return march


def in_c(lib: ctypes.CDLL, loop: Loop, q) -> March:
    """The same loop by hand."""
    numbers, weights = laid_out(loop, q)
    assert len(numbers) == lib.bench_numbers(), (len(numbers), lib.bench_numbers())
    bench, done = lib.bench_new(pointer(numbers), pointer(weights)), 0

    def march(noise: Array, out: Array) -> None:
        nonlocal done
        lib.bench_march(bench, done, len(noise), pointer(noise), pointer(out), WIDTH)
        done += len(noise)

    return march


def laid_out(loop: Loop, q) -> tuple[Array, Array]:
    """The loop's numbers in the order of `numbers` in parts.h, and the network's weights at the start."""
    plant, estimators, front = loop.plant, loop.estimators, loop.estimators.front
    (neural, _), schedule = alone(loop.controller, loop.controller.start()), loop.schedule
    assert len(schedule.wave) == 0
    sequence = loop.sequence
    parts = (
        (
            loop.start,
            plant.arm,
            plant.friction,
            alone_surface(plant.surface),
            plant.side,
            plant.wall,
            plant.mode,
            plant.beyond,
        ),
        loop.encoder,
        loop.force,
        loop.output,
        loop.conditioning,
        sequence,
        tuple(schedule)[:6],
        loop.approach,
        (
            neural.kp,
            neural.kv,
            neural.kf,
            neural.offset,
            neural.network.amplitude,
            neural.network.learning_rate,
        ),
        loop.compensation,
        (estimators.thesis, estimators.raw, estimators.matched, front, estimators.centring, estimators.touch),
        (loop.tick, loop.steps, q),
    )
    return numbers_of(parts), np.ascontiguousarray(neural.network.weights)


def pointer(array: Array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@contextmanager
def library(compiler: str) -> Iterator[ctypes.CDLL]:
    """The C as a compiler of the machine makes it."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "tick.so"
        command = [compiler, *shlex.split(FLAGS), str(HERE / "tick.c"), "-o", str(target), "-lm"]
        try:
            subprocess.run(command, check=True)  # noqa: S603 - the machine's compiler on our own source
        except FileNotFoundError:
            sys.exit(f"no C compiler: {command[0]} is not there; install one, or name it in CC")
        lib = ctypes.CDLL(str(target))
        number, numbers = ctypes.c_long, ctypes.POINTER(ctypes.c_double)
        lib.bench_new.restype, lib.bench_new.argtypes = ctypes.c_void_p, [numbers, numbers]
        lib.bench_numbers.restype = ctypes.c_ulong
        lib.bench_march.restype = None
        lib.bench_march.argtypes = [ctypes.c_void_p, number, number, numbers, numbers, number]
        yield lib


if __name__ == "__main__":
    sys.exit(main())
