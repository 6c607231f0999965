"""Laws of every identifier with a regressor and a force."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.testing.check import Check, require

TRUTH = np.array([0.1, 200.0, 5200.0])
"""M [kg], B [N s/m], K [N/m] of the foam that is pressed."""
NOISE = 0.6
"""Standard deviation of its force [N]."""
BAD: dict[str, tuple[Any, Any]] = {
    "short": ([1.0, 2.0], 1.0),
    "long": ([1.0, 2.0, 3.0, 4.0], 1.0),
    "in a frame": ([[1.0, 2.0, 3.0]], 1.0),
    "a number": (1.0, 1.0),
    "nothing": ([], 1.0),
    "words": (["a", "b", "c"], 1.0),
    "not a number": ([1.0, np.nan, 3.0], 1.0),
    "infinite": ([1.0, -np.inf, 3.0], 1.0),
    "force not a number": ([1.0, 2.0, 3.0], np.nan),
    "force infinite": ([1.0, 2.0, 3.0], np.inf),
    "force a word": ([1.0, 2.0, 3.0], "five"),
    "force missing": ([1.0, 2.0, 3.0], None),
}
"""Samples that are none."""


def identifier_checks(make: Callable[[], Any]) -> list[Check]:
    """The checks of an identifier.

    Args:
        make: makes one at its start: a class, or a function; it has ``update(regressor, force)`` and ``estimate()``.
    """
    return [Check(law, make) for law in LAWS]


def foam(samples: int, seed: int = 0) -> tuple[Array, Array]:
    """Acceleration, rate and penetration of three tones at 1 kHz, shape (n, 3), and the force of foam [N], (n,)."""
    random = np.random.default_rng(seed)
    t = np.arange(samples)[:, None] / 1000.0
    omega = 2 * np.pi * np.array([1.0, 7.0, 23.0])
    phase = random.uniform(0.0, 2 * np.pi, 3)
    amplitude = np.array([2e-3, 3e-4, 5e-5])
    kinds: tuple[tuple[int, Callable[[Array], Array]], ...] = (
        (2, lambda z: -np.sin(z)),
        (1, np.cos),
        (0, np.sin),
    )
    a, v, x = ((amplitude * omega**k * f(omega * t + phase)).sum(axis=1) for k, f in kinds)
    phi = np.column_stack([a, v, x + 3e-3])
    return phi, phi @ TRUTH + random.normal(0.0, NOISE, samples)


def answers(identifier: Any) -> Array:
    """All that an identifier says."""
    estimate = identifier.estimate()
    return np.concatenate([estimate.theta, np.ravel(estimate.covariance), [estimate.samples]])


def _same(first: Array, second: Array) -> bool:
    """Bit for bit; NaN equals NaN."""
    return np.array_equal(first, second, equal_nan=True)


def feed(identifier: Any, phi: Any, force: Any) -> Any:
    """The identifier after these samples, one by one."""
    for row, f in zip(phi, force, strict=True):
        identifier.update(row, f)
    return identifier


def estimate_is_finite(make: Callable[[], Any]) -> None:
    """Three parameters with a symmetric covariance, at any moment of a press."""
    identifier = make()
    for part in range(4):
        phi, force = foam(400)
        rows = slice(100 * part, 100 * part + 100)
        estimate = feed(identifier, phi[rows], force[rows]).estimate()
        theta = np.asarray(estimate.theta)
        P = np.asarray(estimate.covariance)
        require(theta.shape == (3,), f"theta has shape {theta.shape}, not (3,)")
        require(P.shape == (3, 3), f"the covariance has shape {P.shape}, not (3, 3)")
        require(np.isfinite(theta).all(), f"theta is {theta.tolist()}")


def stiffness_of_foam_is_found(make: Callable[[], Any]) -> None:
    """Two seconds of three tones identify the stiffness within a quarter."""
    phi, force = foam(2000)
    K = float(np.asarray(feed(make(), phi, force).estimate().theta)[2])
    require(
        abs(K - TRUTH[2]) <= 0.25 * TRUTH[2],
        f"after 2 s on a foam of {TRUTH[2]:g} N/m it estimates K = {K:.5g} N/m",
    )


def batch_update_equals_single_updates(make: Callable[[], Any]) -> None:
    """``update_many``, if there is one, equals repeated updates."""
    phi, force = foam(300)
    if not hasattr(make(), "update_many"):
        return
    single = feed(make(), phi, force)
    batch = make()
    mixed = make()
    batch.update_many(phi, force)
    mixed.update_many(phi[:100].tolist(), force[:100].tolist())
    mixed.update(list(phi[100]), force[100])
    mixed.update_many(np.asfortranarray(phi[101:]), force[101:])
    require(_same(answers(batch), answers(single)), "update_many differs from repeated updates")
    require(
        _same(answers(mixed), answers(single)),
        "alternating update and update_many differs from repeated updates",
    )


def regressor_may_be_any_sequence(make: Callable[[], Any]) -> None:
    """Lists, strided and read-only arrays, and whole numbers give one result."""
    phi = np.array([1.0, -2.0, 3.0])
    fixed = phi.copy()
    fixed.flags.writeable = False
    plain = feed(make(), [[1.0, -2.0, 3.0]], [4.0])
    for kind, row in (
        ("strided", np.repeat(phi, 2)[::2]),
        ("read-only", fixed),
        ("of integers", phi.astype(int)),
    ):
        require(
            _same(answers(feed(make(), [row], [4.0])), answers(plain)),
            f"a regressor {kind} gives another result",
        )


def equal_samples_give_equal_estimates(make: Callable[[], Any]) -> None:
    """Two instances agree: no memory outside the instance, no random numbers."""
    phi, force = foam(200)
    first = feed(make(), phi, force)
    second = feed(make(), phi, force)
    require(_same(answers(first), answers(second)), "two instances differ after the same samples")


def bad_samples_are_refused_without_effect(make: Callable[[], Any]) -> None:
    """A bad sample raises a ValueError or TypeError and changes nothing."""
    for kind, sample in BAD.items():
        refuses(make, kind, sample)


def refuses(make: Callable[[], Any], kind: str, sample: tuple[Any, Any]) -> None:
    """Check that a sample of this kind is refused and changes nothing."""
    phi, force = foam(120)
    bad = feed(make(), phi[:60], force[:60])
    good = feed(make(), phi[:60], force[:60])
    try:
        bad.update(*sample)
    except (ValueError, TypeError):
        pass
    else:
        raise AssertionError(f"a sample that is {kind}, {sample}, is accepted; raise a ValueError")
    same = _same(answers(feed(bad, phi[60:], force[60:])), answers(feed(good, phi[60:], force[60:])))
    require(same, f"a sample that is {kind} changes the state")


def copy_and_pickle_keep_the_state(make: Callable[[], Any]) -> None:
    """Copies are independent, and a pickle continues where the original was."""
    phi, force = foam(200)
    identifier = feed(make(), phi[:100], force[:100])
    copied, thawed = copy.deepcopy(identifier), pickle.loads(pickle.dumps(identifier))  # noqa: S301 - its own
    before = answers(identifier)
    feed(copied, phi[100:], force[100:])
    require(_same(answers(identifier), before), "an update of a copy changes the original")
    require(
        _same(answers(feed(thawed, phi[100:], force[100:])), answers(copied)),
        "a pickled copy continues differently",
    )


def no_estimate_before_the_first_sample(make: Callable[[], Any]) -> None:
    """A start is a guess."""
    estimate = make().estimate()
    verdicts = set(estimate.verdicts().values())
    require(verdicts == {"not identifiable"}, f"before its first sample it says {sorted(verdicts)}")
    require(estimate.samples == 0.0, f"before its first sample it counts {estimate.samples}")


LAWS = (
    estimate_is_finite,
    stiffness_of_foam_is_found,
    batch_update_equals_single_updates,
    regressor_may_be_any_sequence,
    equal_samples_give_equal_estimates,
    bad_samples_are_refused_without_effect,
    copy_and_pickle_keep_the_state,
    no_estimate_before_the_first_sample,
)
