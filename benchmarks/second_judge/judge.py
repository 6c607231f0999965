"""Second judge of `palpate identify`: worlds and causes of time of an author who has not read the estimator.

    benchmarks/second_judge/judge.py [--logs 20] [--seed 1] [--worlds sphere tap] [--jobs 2] [--out FILE] [--json]

Every log is typed with `--json`, and as a person does (`--plain`). An interval *holds* if it meets the truth (several
definitions of one stiffness make a range; of two surfaces it must contain both); it is *wrong* if the truth is
further than three half-widths away. *Known* logs are those whose K an estimator that knows the world has to 5 %;
*sharp* ones of them have K identified to max(1 %, three times that estimator's half-width): on a curved or relaxing
surface K or the stiffness at the working point. Under *exit*: exit codes against the verdicts, or two codes for one
log. Seeds 1 to 9 compare versions; seed 1 is quoted. `--out` keeps each log's result, and resumes.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import laboratory

JUDGED = ("K", "B", "M", "n", "working point")
WRONG = 3.0
"""Half-widths between value and truth beyond which an answer is confidently wrong."""
KNOWN, SHARP_TIMES, SHARP = 0.05, 3.0, 0.01
DOUBTFUL = {"unit-guess", "unit-doubtful", "time-doubtful", "columns-swapped"}
"""Warnings that make the exit code 1 whatever is identified."""
NAMES = [*laboratory.WORLDS, *laboratory.CAUSES]


def typed(words: list[str]) -> tuple[int, str]:
    """Exit code and standard output of a command, in this process."""
    from palpate.cli import main

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        try:
            code = main(words)
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 1
    return int(code or 0), out.getvalue()


def command(path: str, options: dict[str, str]) -> list[str]:
    names = {"force": "force-column"}
    flags = [
        f"--{names.get(k, k).replace('_', '-')}" + ("" if v == "True" else f"={v}")
        for k, v in options.items()
    ]
    return ["identify", path, *flags]


def misses(low: float, high: float, truth: tuple[float, float], covers: bool) -> tuple[bool, float]:
    """Whether an interval holds, and the distance of its middle from the truth in half-widths."""
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    if covers:
        return bool(low <= truth[0] and truth[1] <= high), float(
            max(abs(end - middle) for end in truth) / half
        )
    away = float(max(truth[0] - middle, middle - truth[1], 0.0))
    return away <= half, away / half


def true_range(name: str, value: dict, answer: dict, scene: laboratory.Scene) -> tuple[float, float] | None:
    """Truth of a parameter or of the working point at the force and frequency of the answer; None: not judged."""
    if name == "n":
        return (scene.p["n"], scene.p["n"]) if "n" in scene.p else None
    if value.get("unit", "N/m").startswith("N/m^"):
        return None
    point, depth = answer.get("working_point") or {}, answer.get("depth_m")
    force = abs(point.get("force_N") or 0.5 * float(laboratory.contact_force(scene, scene.p)[1].max()))
    if name == "K" and depth:
        force = float(laboratory.elastic(np.array([depth]), scene.p, scene)[0])
    of = "K at rest" if name == "K" and "K1" in answer["parameters"] else name
    return laboratory.true_range(
        scene, of, force, point.get("frequency_Hz") or 0.0, point.get("source") == "octave"
    )


def judge(log: laboratory.Log, answer: dict, codes: tuple[int, int]) -> dict:
    """One row of results from an answer as `--json` prints it (empty after a crash), and the two exit codes."""
    scene, point, results, width = log.scene, answer.get("working_point"), [], np.inf
    values = dict(answer.get("parameters") or {}) | ({"working point": point["stiffness"]} if point else {})
    identified = {name: value for name, value in values.items() if value.get("verdict") == "identified"}
    for name in [name for name in JUDGED if name in identified]:
        low, high = identified[name]["ci95"]
        if name == "K" or (name == "working point" and (scene.kind != "linear" or "r" in scene.p)):
            width = min(width, (high - low) / max(abs(high + low), 1e-300))
        truth = true_range(name, identified[name], answer, scene)
        if truth is not None:
            holds, away = misses(low, high, truth, scene.truth == "covers")
            results.append({"name": name, "said": (low, high), "true": truth, "holds": holds, "away": away})
    doubtful = DOUBTFUL & {warning["code"] for warning in answer.get("warnings", ())}
    known, expected = log.known <= KNOWN, 0 if identified and not doubtful else 1
    row = {"world": log.name, "model": answer.get("model"), "results": results, "known": bool(known)}
    row |= {"sharp": bool(known and width <= max(SHARP, SHARP_TIMES * log.known)), "crash": 70 in codes}
    wrong_code = codes[0] != codes[1] or (codes[0] < 2 and codes[0] != expected)
    return row | {"exit": wrong_code, "refused": codes[0] == 2}


def run(name: str, seed: int, index: int, plain: int) -> dict:
    """Draw one log, type the command with `--json` (the first `plain` ones as a person does, too), judge the answer."""
    log, home = laboratory.draw(name, index, seed), Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        try:
            os.chdir(folder)
            Path("press.csv").write_text(log.text, encoding="ascii")
            words, start = command("press.csv", log.options), time.perf_counter()
            code, out = typed([*words, "--json"])
            seconds = time.perf_counter() - start
            answer = json.loads(out) if code < 2 else {}
            codes = (code, typed(words)[0] if index < plain else code)
        finally:
            os.chdir(home)
    stored = {key: answer.get(key) for key in ("parameters", "working_point", "depth_m", "lag_s", "warnings")}
    row = {
        "seed": seed,
        "index": index,
        "seconds": round(seconds, 2),
        "words": " ".join(words),
        "codes": codes,
    }
    return row | judge(log, answer, codes) | {"answer": stored}


def tally(rows: list[dict]) -> dict:
    """Counts of a table's line."""
    marks = [r for row in rows for r in row["results"]]
    fits, points = ([r for r in marks if (r["name"] == "working point") == w] for w in (False, True))
    out = {"logs": len(rows)}
    for key, part in (("answers", fits), ("points", points)):
        out |= {key: len(part), f"{key}_hold": sum(r["holds"] for r in part)}
        out[f"{key}_wrong"] = sum(r["away"] > WRONG for r in part)
    flags = ("known", "sharp", "crash", "exit", "refused")
    return out | {key: sum(row[key] for row in rows) for key in flags}


def table(rows: list[dict]) -> str:
    """One line a world and cause, and the sums."""

    def share(part: int, of: int) -> str:
        return f"{100 * part / of:.0f} %" if of else "-"

    head = "world | logs | answers | hold | wrong | known | sharp | points | hold | wrong | crash | exit | refused"
    lines = [f"| {head} |", "|---" * (head.count("|") + 1) + "|"]
    groups = {name: [name] for name in NAMES}
    groups |= {"all worlds": [*laboratory.WORLDS], "all causes": [*laboratory.CAUSES], "all": NAMES}
    for title, names in groups.items():
        c = tally([row for row in rows if row["world"] in names])
        cells = [title.replace("_", " "), c["logs"]]
        for key, middle in (("answers", (c["known"], share(c["sharp"], c["known"]))), ("points", ())):
            cells += [c[key], share(c[f"{key}_hold"], c[key]), share(c[f"{key}_wrong"], c[key]), *middle]
        if c["logs"]:
            lines.append("| " + " | ".join(map(str, [*cells, c["crash"], c["exit"], c["refused"]])) + " |")
    return "\n".join(lines)


def worst(rows: list[dict], count: int) -> str:
    """The answers that are furthest from the truth, a line each."""
    marks = [(r["away"], row, r) for row in rows for r in row["results"] if r["away"] > WRONG]
    return "\n".join(
        f"{row['world']} {row['index']} of seed {row['seed']}: {r['name']} {r['said'][0]:.4g} to {r['said'][1]:.4g}, "
        f"true {r['true'][0]:.4g} to {r['true'][1]:.4g}, {away:.0f} half-widths, {row['model']}"
        for away, row, r in sorted(marks, key=lambda m: -m[0])[:count]
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--logs", type=int, default=20, help="of each world and cause")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worlds", nargs="+", default=NAMES, choices=NAMES, metavar="NAME")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--worst", type=int, default=10, help="single answers to name")
    parser.add_argument("--plain", type=int, default=sys.maxsize, help="of each, typed without --json, too")
    parser.add_argument("--out", type=Path, help="a file of results, one JSON object a line")
    parser.add_argument("--json", action="store_true", help="counts by world as JSON")
    given = parser.parse_args()
    stored = given.out.read_text(encoding="utf-8").splitlines() if given.out and given.out.exists() else []
    rows = [row for row in map(json.loads, stored) if row["seed"] == given.seed]
    done = {(row["world"], row["index"]) for row in rows}
    tasks = [(name, k) for k in range(given.logs) for name in given.worlds if (name, k) not in done]
    with ProcessPoolExecutor(given.jobs) as pool, contextlib.ExitStack() as stack:
        file = stack.enter_context(given.out.open("a", encoding="utf-8")) if given.out else None
        for row in (
            pool.map(run, *zip(*[(name, given.seed, k, given.plain) for name, k in tasks], strict=True))
            if tasks
            else ()
        ):
            rows.append(row)
            if file:
                print(json.dumps(row), file=file, flush=True)
    rows = [row for row in rows if row["world"] in given.worlds and row["index"] < given.logs]
    if given.json:
        print(json.dumps({name: tally([r for r in rows if r["world"] == name]) for name in given.worlds}))
        return
    print(table(rows))
    print(worst(rows, given.worst))


if __name__ == "__main__":
    main()
