"""Certificates of random arms and forgeries of them: both checks decide, and loops drawn within a claim are the truth.

    python benchmarks/force/forgeries.py --certificates 10000

An arm of a random kind has random numbers; one claim about it of a random kind is proved where it can be. Of each
certificate eight forgeries change one number: an end of the claim or of a cell, a share, an age, a norm, a number of
the arm or of the law. The check of norms and the independent one, which share no code, decide on each. Of what passes
ten loops are drawn within the claim, and have to be stable. Exit code 1 if a forgery passes the check of norms alone,
or if one that passes both is not true.
"""

from __future__ import annotations

import argparse
import copy
import json
from collections import Counter
from typing import Any

import msgspec
import numpy as np

from palpate.certify.force_certificate import RefusedError, check
from palpate.errors import InputError
from palpate.force.arm import Arm, Limits, PositionLoop, Sensor, ServoLoop, TorqueLoop
from palpate.force.boundary import radius
from palpate.force.certificate import FORM, Certificate
from palpate.force.certifying import proved_claim
from palpate.force.claims import Claim, adapting_claims, held_claim, one_sided_claim
from palpate.force.gains import Gains, gains_for
from palpate.force.sampled_loop import SampledLoop, law_for

FORGERIES, LOOPS = 8, 10
"""Of each certificate, and drawn within each claim that passes."""
File = dict[str, Any]


def random_arm(rng: np.random.Generator) -> Arm:
    """Position, torque or servo, with few delays, so that its matrices are small."""
    kind, rate = rng.integers(3), float(rng.choice([250.0, 500.0, 1000.0]))
    delay = float(rng.uniform(0.0, 2.0) / rate)
    inner: Any
    if kind == 0:
        inner = PositionLoop(
            bandwidth=float(rng.uniform(3.0, 30.0)), damping=float(rng.uniform(0.6, 1.2)), delay=delay,
            stiffness=float(np.exp(rng.uniform(9.0, 13.0))),
        )  # fmt: skip
    else:
        mass, stiffness = float(rng.uniform(1.0, 8.0)), float(np.exp(rng.uniform(6.5, 9.0)))
        damping = rng.uniform(0.7, 2.0) * 2.0 * np.sqrt(mass * stiffness)
        kind_of = TorqueLoop if kind == 1 else ServoLoop
        inner = kind_of(mass=mass, stiffness=stiffness, damping=float(damping), delay=delay)
    low_pass = str(rng.choice(["none", "butterworth1:60", "butterworth2:100"]))
    sensor = Sensor(sampling=rate, noise=0.1, full_scale=200.0, low_pass=low_pass)
    limits = Limits(speed=0.25, stiffness=float(10.0 ** rng.uniform(3.5, 5.0)))
    return Arm(title="a", rate=rate, inner=inner, sensor=sensor, limits=limits)


def random_claim(rng: np.random.Generator, gains: Gains) -> Claim:
    """What is to be proved of it: surfaces over an octave or two, some with damping, and sometimes a margin."""
    cap = gains.seen_cap
    high = cap * float(rng.uniform(0.1, 0.9))
    low, most = high * float(rng.uniform(0.3, 0.9)), float(rng.choice([0.0, 0.3, 1.0])) * gains.theta
    kinds = {
        "position": ("held", "one-sided", "adapting"),
        "torque": ("held", "adapting"),
        "servo": ("held", "adapting"),
    }
    kind = rng.choice(kinds[gains.arm.kind])
    if kind == "one-sided":
        return one_sided_claim(gains, most)
    if kind == "adapting":
        lists = adapting_claims(gains, low, most if gains.arm.kind == "position" else 0.0)
        claim = lists[0][-1]
        return claim if gains.arm.kind == "position" else msgspec.structs.replace(claim, high=high)
    shares = 1.0, float(rng.choice([1.0, 1.5]))
    return msgspec.structs.replace(held_claim(gains, low, high, most), shares=shares)


def certificate(rng: np.random.Generator) -> File | None:
    """Of one claim about one arm, as its file; None if there are no gains, or no proof."""
    try:
        gains = gains_for(random_arm(rng), 20.0)
        claim = proved_claim(gains, random_claim(rng, gains))
    except InputError:
        return None
    if claim is None or len(claim.cells) > 6:
        return None
    made = Certificate(form=FORM, gains=gains, claims=(claim,))
    return json.loads(msgspec.json.encode(made, enc_hook=float))


def forged(file: File, path: tuple[Any, ...], value: Any) -> File:
    """The file with another number, or with that of a function of the number there."""
    made = copy.deepcopy(file)
    place = made
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value(place[path[-1]]) if callable(value) else value
    return made


def forgery(rng: np.random.Generator, file: File) -> tuple[str, File]:
    """One number changed, by a factor between a half and two or by ticks; and which."""
    factor, claim = float(np.exp(rng.uniform(-0.7, 0.7))), ("claims", 0)
    cells = file["claims"][0]["cells"]
    cell = (*claim, "cells", int(rng.integers(len(cells))))
    i = int(rng.integers(len(cells[0]["norm"])))
    groups = {
        "claim": [(*claim, k) for k in ("low", "high", "least", "most")],
        "share": [(*claim, "shares", k) for k in (0, 1)],
        "ages": [(*claim, "ages", k) for k in (0, 1)],
        "cell": [(*cell, k) for k in ("low", "high", "most")],
        "norm": [(*cell, "norm", i, k) for k in range(i + 1)],
        "units": [(*claim, "units", k) for k in ("w0", "k0")],
        "law": [("gains", k) for k in ("theta", "cap", "alpha")],
        "arm": [
            ("gains", "arm", "inner", k) for k, v in file["gains"]["arm"]["inner"].items() if isinstance(v, float)
        ],
    }  # fmt: skip
    name = str(rng.choice(list(groups)))
    path = groups[name][int(rng.integers(len(groups[name])))]
    ticks = int(rng.choice([-2, -1, 1, 2]))
    return name, forged(file, path, (lambda v: max(v + ticks, 0)) if name == "ages" else lambda v: v * factor)


def verdicts(made: File) -> tuple[bool, bool]:
    """Of the check of norms, and of the independent one."""
    text = json.dumps(made)
    try:
        own = msgspec.json.decode(text, type=Certificate).check().holds
    except (msgspec.DecodeError, InputError):
        own = False
    try:
        check(text)
    except RefusedError:
        return own, False
    return own, True


def is_true(made: File, rng: np.random.Generator) -> bool:
    """Whether loops drawn within what a certificate says are stable."""
    told = msgspec.json.decode(json.dumps(made), type=Certificate)
    gains, claim = told.gains, told.claims[0]
    for _ in range(LOOPS):
        time, share = rng.uniform(claim.least, claim.most), rng.uniform(*claim.shares)
        bound = claim.low * (claim.high / claim.low) ** rng.uniform() if claim.low else claim.high
        K = bound / (1.0 + time / gains.theta)
        gain = share * gains.gain
        used = gains.seen_cap
        if claim.kind == "adapting" and gains.arm.kind == "servo":
            used = bound / share
            gain = gains.gain_at(used)
        elif claim.kind == "adapting":
            gain = share * gains.alpha / gains.theta * (gains.compliance + 1.0 / bound)
        age = int(rng.integers(claim.ages[0], claim.ages[1] + 1))
        loop = SampledLoop(gains.arm, claim.jitter(gains))
        law = law_for(gains.arm, gain, used)
        if radius(loop.phi(K, time * K, law, loop.lines[0] - age)) >= 1.0:
            return False
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--certificates", type=int, default=10000, help="with their forgeries")
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    rng = np.random.default_rng(told.seed)
    kinds: Counter[str] = Counter()
    counts: dict[str, Counter[str]] = {}
    done = wrong = 0
    while done < told.certificates:
        file = certificate(rng)
        if file is None:
            continue
        kinds[f"{file['gains']['arm']['inner']['kind']}, {file['claims'][0]['kind']}"] += 1
        for name, made in [("none", file), *(forgery(rng, file) for _ in range(FORGERIES))]:
            own, other = verdicts(made)
            truth = is_true(made, rng) if own or other else None
            word = {
                (True, True): "both",
                (False, False): "neither",
                (False, True): "second",
                (True, False): "first",
            }
            counts.setdefault(name, Counter())[word[own, other]] += 1
            if truth is False or (own and not other) or (name == "none" and not own):
                wrong += 1
                print(f"wrong: {name}, {own}, {other}, {truth}, certificate {done}")
            done += 1
    print("certificates: " + ", ".join(f"{n} {kind}" for kind, n in sorted(kinds.items())))
    heads = ("passed by both", "by neither", "by the second alone", "by the first alone")
    print("changed  " + "  ".join(f"{head:>19}" for head in heads))
    for name, count in counts.items():
        cells = [count[k] for k in ("both", "neither", "second", "first")]
        print(f"{name:8} " + "  ".join(f"{cell:19}" for cell in cells))
    print(
        f"of {done} files {wrong} are decided wrongly; all that pass are true of {LOOPS} loops drawn within each"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
