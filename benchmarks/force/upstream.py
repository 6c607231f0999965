"""Answers of palpate certify --controller against upstream's own C++, on random parameter files.

    python benchmarks/force/upstream.py ros2-admittance --source CHECKOUT [--files 1000] [--root PREFIX]
        [--rows RESULTS --minutes 3]

CHECKOUT is a clone of ros-controls/ros2_controllers, or of fzi-forschungszentrum-informatik/cartesian_controllers for
`fzi`, or of utiasDSL/crisp_controllers for `crisp`; its commit is printed. A prefix other than /usr that holds Eigen
and KDL is given by --root. Without a checkout it says so and ends. A run with
--rows goes on where the last one stopped.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from upstream_judge import ADMITTANCE, CRISP, FZI, commit, compile_judge

from palpate.certify.controller_answer import ControllerRequest, certify_controller

TICKS = {"ros2-admittance": 16_000, "fzi": 5_000, "crisp": 6_000}
"""Ticks after which growth shows within a percent of the edge."""
LOW, HIGH = 10.0, 1e7
FREE = 0.1
"""Stiffness that stands for free motion [N/m]."""
LIMITS = (("grows", 0.5), ("overshoot", 0.1), ("unsettled", 0.1))
"""Of what the judge calls a good setting: neither growth nor overshoot, and settled in half of the run."""
SETTINGS_TRIED = 100
"""Numbers that the judge tries where palpate has none."""


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
    bench = (rng.choice([100, 125, 250, 500]), rng.uniform(0.0, 0.03), velocity, False)
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


def summary(rows):
    """Lines of figures about the files that were compared."""
    errors = np.array([row["error"] for row in rows])
    tried = [row for row in rows if row.get("correction", "stable") != "stable"]
    corrected = [row for row in tried if row["correction"] == "corrected"]
    others = sum(row["judge_corrects"] for row in tried if row["correction"] != "corrected")
    runs, grown = (sum(row[name] for row in rows) for name in ("runs", "falsified"))
    lines = [
        f"  edges: {np.mean(errors <= 0.02):.1%} within 2 %; median {np.median(errors):.2%}, most {errors.max():.2%}",
        f"  no edge from {LOW:g} to {HIGH:g} N/m, by either: {np.mean(errors == 0):.1%}",
        f"  proofs: {sum(row['runs'] > 0 for row in rows)}; {runs} runs of upstream inside them, {grown:.0f} grow",
    ]
    if tried:
        lines.append(
            f"  corrected: {len(corrected)} files, of which {sum(row['diverged'] for row in corrected)} diverge and "
            f"{sum(row['overshot'] for row in corrected)} overshoot by more than 10 %; not corrected: "
            f"{len(tried) - len(corrected)}, for {others} of which the judge finds numbers"
        )
    return "\n".join(lines)


def answer(text, kind, bench, mass=None, surfaces=None):
    """palpate's answer about a text, and the text of its correction."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        path.write_text(text)
        verdict = certify_controller(path, ControllerRequest(kind, bench[1], mass=mass, surfaces=surfaces))
    return verdict.answer, verdict.corrected


def compare(judge, kind, text, bench, numbers, rng):
    """Edge and proof of one file against the judge."""
    result, _ = answer(text, kind, bench, numbers[2] if kind == "crisp" else None)
    ticks = TICKS[kind]
    proved, ranges = result["proved"]["stiffness"], result["exact"]["ranges"]
    late = result["controllers"][0].get("if_only_the_force_is_late")
    if late is not None:
        proved, ranges = late["proved"], late["exact"]
    bench = (*bench[:3], late is not None)
    edge = judge.ask(("edge", LOW, HIGH, ticks), bench, numbers)
    first = next((end for begin, end in ranges if begin <= LOW < end), LOW)
    first = np.inf if first >= HIGH else first
    row = {"edge": edge, "palpate": first, "error": 0.0 if edge == first else abs(np.log(edge / first))}
    tried = [] if proved is None else [*np.exp(rng.uniform(*np.log(proved), 3)), proved[1]]
    grown = [
        judge.ask(("grows", K, 3 * ticks), (bench[0], bench[1] + more, *bench[2:]), numbers)
        for K in tried
        for more in (0.0, 1.0 / bench[0])
    ]
    return {**row, "runs": len(grown), "falsified": sum(grown)}


def exceeds(judge, kind, task, limit, bench, numbers, surfaces):
    """True if a task's number exceeds the limit on some of the surfaces.

    Growth is tried in free motion too, and for one tick more of delay, which each answer promises.
    """
    later = (bench[0], bench[1] + 1.0 / bench[0], *bench[2:])
    if task != "grows":
        return any(judge.ask((task, K, 5 * TICKS[kind]), bench, numbers) > limit for K in surfaces)
    return any(
        judge.ask((task, K, TICKS[kind]), b, numbers) > limit
        for K in (*surfaces, FREE)
        for b in (bench, later)
    )


def correct(judge, kind, text, bench, numbers, rng):
    """Correction of one file, tried by the judge on the surfaces asked for and on others between them."""
    high = np.exp(rng.uniform(np.log(2e3), np.log(3e4)))
    surfaces = (high / rng.uniform(2.0, 20.0), high)
    between = np.exp(rng.uniform(*np.log(surfaces), 3))
    result, corrected = answer(text, kind, bench, numbers[2] if kind == "crisp" else None, surfaces)
    if corrected is not None:
        new = {name.rpartition(".")[2]: value for name, value in result["corrected"].items()}
        if kind == "crisp":
            numbers = [numbers[0], new["d_pos_x"], *numbers[2:]]
        elif kind == "fzi":
            numbers = [*numbers[:2], new["error_scale"], *numbers[3:]]
        else:
            numbers = [*(new[name][0] for name in ("mass", "stiffness", "damping_ratio")), *numbers[3:]]
        diverged, overshot = (
            exceeds(judge, kind, *limit, bench, numbers, (*surfaces, *between)) for limit in LIMITS[:2]
        )
        return {"correction": "corrected", "diverged": diverged, "overshot": overshot}
    why = result["not_corrected_because"]
    if why.startswith("the loop is stable"):
        return {"correction": "stable"}
    finds = next(
        (
            other
            for other in other_numbers(kind, numbers, rng)
            if not any(
                exceeds(judge, kind, *limit, bench, other, (high, *between, surfaces[0])) for limit in LIMITS
            )
        ),
        None,
    )
    return {"correction": why, "judge_corrects": finds is not None, "judge_numbers": finds}


def other_numbers(kind, numbers, rng):
    """Numbers that the judge tries in a file that was not corrected, at random; the same entries may change."""
    for _ in range(SETTINGS_TRIED):
        if kind == "crisp":
            yield [numbers[0], np.exp(rng.uniform(0.0, np.log(5e3))), *numbers[2:]]
        elif kind == "fzi":
            yield [*numbers[:2], numbers[2] * np.exp(rng.uniform(np.log(1e-6), 0.0)), *numbers[3:]]
        else:
            mass, damping = np.exp(rng.uniform(np.log([1e-2, 1.0]), np.log([1e5, 1e5])))
            stiffness = numbers[1] or 1.0
            yield [mass, stiffness, damping / (2.0 * np.sqrt(mass * stiffness)), *numbers[3:]]


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
    parser.add_argument("--rows", type=Path, help="file of results: what it holds is not run again")
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after these; go on with --rows")
    options = parser.parse_args()
    if options.source is None or not options.source.is_dir():
        print("skipped: no --source with a checkout of upstream")
        return 0
    kind, make = KINDS[options.controller]
    run = f"{options.controller}, upstream's commit {commit(options.source)}, seed {options.seed}"
    lines = options.rows.read_text().splitlines() if options.rows and options.rows.exists() else [run]
    if lines[0] != run:
        parser.error(f"{options.rows} holds the results of another run: {lines[0]}")
    rows = [json.loads(line) for line in lines[1:]]
    judge = compile_judge(kind, options.source, [*options.root, "/usr"])
    stop = time.monotonic() + 60.0 * options.minutes
    for i in range(len(rows), options.files):
        if time.monotonic() > stop:
            break
        rng = np.random.default_rng([options.seed, i])
        text, bench, numbers = make(rng)
        row = compare(judge, options.controller, text, bench, numbers, rng)
        if i < options.corrections:
            row |= correct(judge, options.controller, text, bench, numbers, rng)
        rows.append(row)
        if row["error"] > 0.02 or row["falsified"] or row.get("judge_corrects"):
            print(f"  file {i}: {row}; {bench} {numbers}", flush=True)
        if options.rows:
            options.rows.write_text("\n".join([run, *map(json.dumps, rows)]) + "\n")
    print(f"{run}, {len(rows)} of {options.files} random files")
    print(summary(rows))
    return 1 if any(r["error"] > 0.02 or r["falsified"] or r.get("diverged") for r in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
