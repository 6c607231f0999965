"""Answers of palpate certify --controller against upstream's own C++, on random parameter files.

    python benchmarks/force/upstream.py ros2-admittance --source CHECKOUT [--files 1000] [--root PREFIX]

CHECKOUT is a clone of ros-controls/ros2_controllers, or of fzi-forschungszentrum-informatik/cartesian_controllers for
`fzi`, or of utiasDSL/crisp_controllers for `crisp`; its commit is printed. A
prefix other than /usr that holds Eigen and KDL is given by --root. Without a checkout it says so and ends.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from upstream_judge import ADMITTANCE, CRISP, FZI, commit, compile_judge

from palpate.certify.controller_answer import ControllerRequest, certify_controller

TICKS = {"ros2-admittance": 16_000, "fzi": 5_000, "crisp": 6_000}
"""Ticks after which growth shows within a percent of the edge."""
LOW, HIGH = 10.0, 1e7


def admittance_file(rng):
    """Text of a random file, bench, and the rule's numbers along x."""
    M, S, ratio = np.exp(rng.uniform(np.log([0.5, 10.0, 0.2]), np.log([30.0, 2000.0, 30.0])))
    S *= rng.random() > 0.1
    joint_damping = rng.choice([0.0, np.exp(rng.uniform(np.log(0.5), np.log(20.0)))], p=[0.2, 0.8])
    alpha = np.exp(rng.uniform(np.log(0.003), 0.0))
    bench = (rng.choice([100, 125, 250, 500, 1000]), rng.uniform(0.0, 0.05), rng.random() < 0.5, False)
    numbers = [float(f"{value:.6g}") for value in (M, S, ratio, joint_damping, alpha)]
    text = (
        f"controller_manager: {{ros__parameters: {{update_rate: {bench[0]}}}}}\n"
        f"a: {{ros__parameters: {{command_interfaces: [{'velocity' if bench[2] else 'position'}], "
        f"ft_sensor: {{filter_coefficient: {numbers[4]}}}, admittance: {{mass: {[numbers[0]] * 6}, "
        f"stiffness: {[numbers[1]] * 6}, damping_ratio: {[numbers[2]] * 6}, joint_damping: {numbers[3]}}}}}}}\n"
    )
    return text, bench, numbers


def fzi_file(rng):
    """Text of a random file, bench, and the controller's numbers along x."""
    compliance, velocity = rng.random() < 0.5, rng.random() < 0.7
    p = float(f"{np.exp(rng.uniform(np.log(0.002), np.log(0.5))):.6g}")
    d = float(f"{p * rng.choice([0.0, rng.uniform(0.0, 0.1)]):.6g}")
    scale = float(f"{rng.uniform(0.1, 1.5):.6g}")
    stiffness = float(f"{rng.uniform(20.0, 1000.0):.6g}") if compliance else -1.0
    iterations = int(rng.integers(1, 11)) if compliance else 1
    bench = (rng.choice([100, 125, 250, 500]), rng.uniform(0.0, 0.03), velocity, not velocity)
    gains = ", ".join(f"trans_{axis}: {{p: {p}, d: {d}}}" for axis in "xyz")
    springs = ", ".join(f"trans_{axis}: {stiffness}" for axis in "xyz")
    text = (
        f"controller_manager: {{ros__parameters: {{update_rate: {bench[0]}}}}}\n"
        f"a: {{ros__parameters: {{ft_sensor_ref_link: s, "
        f"command_interfaces: [{'velocity' if velocity else 'position'}], "
        f"solver: {{error_scale: {scale}, iterations: {iterations}}}, pd_gains: {{{gains}}}"
        + (f", stiffness: {{{springs}}}" if compliance else "")
        + "}}\n"
    )
    return text, bench, [p, d, scale, stiffness, iterations]


def crisp_file(rng):
    """Text of a random file, bench, and the numbers of the impedance along x."""
    k = float(f"{np.exp(rng.uniform(np.log(50.0), np.log(3000.0))):.6g}")
    d = float(f"{np.exp(rng.uniform(np.log(2.0), np.log(200.0))):.6g}") if rng.random() < 0.8 else -1.0
    mass, operational = float(f"{rng.uniform(1.0, 10.0):.6g}"), bool(rng.random() < 0.3)
    rate = rng.choice([500, 1000])
    bench = (rate, rng.uniform(0.0, 5.0) / rate, False, False)
    axes = "".join(f"task.k_pos_{axis}: {k}\ntask.d_pos_{axis}: {d}\n" for axis in "xyz")
    text = f"update_rate: {rate}\n{axes}use_operational_space: {str(operational).lower()}\n"
    return text, bench, [k, d, mass, operational]


KINDS = {
    "ros2-admittance": (ADMITTANCE, admittance_file),
    "fzi": (FZI, fzi_file),
    "crisp": (CRISP, crisp_file),
}


class Tally:
    """Counts of one run."""

    def __init__(self):
        self.errors, self.proofs, self.falsified, self.runs = [], 0, 0, 0
        self.corrected, self.diverged, self.overshot, self.uncorrected = 0, 0, 0, 0

    def summary(self):
        """Three lines of figures."""
        errors = np.array(self.errors)
        return (
            f"  edges: {np.mean(errors <= 0.02):.1%} within 2 %, median {np.median(errors):.2%}, largest "
            f"{errors.max():.2%}; of them {np.mean(errors == 0):.1%} without an edge from {LOW:g} to {HIGH:g} N/m\n"
            f"  proofs: {self.proofs}, {self.runs} runs of upstream inside them, {self.falsified:.0f} grow\n"
            f"  corrected: {self.corrected} files, of which {self.diverged} diverge and {self.overshot} overshoot by "
            f"more than 10 %; not corrected: {self.uncorrected}"
        )


def answer(text, kind, bench, mass=None, surfaces=None):
    """palpate's answer about a text, and the text of its correction."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        path.write_text(text)
        verdict = certify_controller(path, ControllerRequest(kind, bench[1], mass=mass, surfaces=surfaces))
    return verdict.answer, verdict.corrected


def compare(judge, kind, text, bench, numbers, rng, tally):
    """Edge and proof of one file against the judge."""
    result, _ = answer(text, kind, bench, numbers[2] if kind == "crisp" else None)
    ticks = TICKS[kind]
    proved, ranges = result["proved"]["stiffness"], result["exact"]["ranges"]
    late = result["controllers"][0].get("if_only_the_force_is_late")
    if bench[3] and late is not None:
        proved, ranges = late["proved"], late["exact"]
    edge = judge.ask(("edge", LOW, HIGH, ticks), bench, numbers)
    first = next((end for begin, end in ranges if begin <= LOW < end), LOW)
    first = np.inf if first >= HIGH else first
    same = edge == first
    tally.errors.append(0.0 if same else abs(np.log(edge / first)))
    if proved is not None:
        tally.proofs += 1
        inside = np.exp(rng.uniform(np.log(proved[0]), np.log(proved[1]), 3))
        for K in (*inside, proved[1]):
            for more in (0.0, 1.0 / bench[0]):
                tally.runs += 1
                tally.falsified += judge.ask(
                    ("grows", K, 3 * ticks), (bench[0], bench[1] + more, *bench[2:]), numbers
                )
    return edge, first


def correct(judge, kind, text, bench, numbers, rng, tally):
    """Correction of one file, tried by the judge on surfaces between those that palpate tried."""
    high = np.exp(rng.uniform(np.log(2e3), np.log(3e4)))
    surfaces = (high / rng.uniform(2.0, 20.0), high)
    result, corrected = answer(text, kind, bench, surfaces=surfaces)
    if corrected is None:
        stable = result["not_corrected_because"].startswith("the loop is stable")
        tally.uncorrected += not stable
        return
    tally.corrected += 1
    if kind == "fzi":
        numbers = [numbers[0], numbers[1], next(iter(result["corrected"].values())), *numbers[3:]]
    else:
        new = {name.rpartition(".")[2]: value[0] for name, value in result["corrected"].items()}
        numbers = [new["mass"], new["stiffness"], new["damping_ratio"], *numbers[3:]]
    stiffness = np.exp(rng.uniform(*np.log(surfaces), 3))
    tally.diverged += any(
        judge.ask(("grows", K, TICKS[kind]), bench, numbers) for K in (*surfaces, *stiffness)
    )
    tally.overshot += any(
        judge.ask(("overshoot", K, 5 * TICKS[kind]), bench, numbers) > 0.1 for K in (*surfaces, *stiffness)
    )


def main():
    """Compare and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("controller", choices=KINDS)
    parser.add_argument("--source", type=Path)
    parser.add_argument("--root", action="append", default=[])
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--corrections", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.source is None or not options.source.is_dir():
        print("skipped: no --source with a checkout of upstream")
        return 0
    kind, make = KINDS[options.controller]
    judge = compile_judge(kind, options.source, [*options.root, "/usr"])
    rng, tally = np.random.default_rng(options.seed), Tally()
    for i in range(options.files):
        text, bench, numbers = make(rng)
        edge, first = compare(judge, options.controller, text, bench, numbers, rng, tally)
        if tally.errors[-1] > 0.02:
            print(f"  file {i}: upstream {edge:.6g}, palpate {first:.6g} N/m; {bench} {numbers}")
        if i < options.corrections and options.controller != "crisp":
            correct(judge, options.controller, text, bench, numbers, rng, tally)
        if (i + 1) % 100 == 0 or i + 1 == options.files:
            print(f"{options.controller}, upstream's commit {commit(options.source)}, {i + 1} random files")
            print(tally.summary(), flush=True)
    return 1 if tally.falsified or tally.diverged or max(tally.errors) > 0.02 else 0


if __name__ == "__main__":
    sys.exit(main())
