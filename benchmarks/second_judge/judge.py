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


def misses(value: dict, truth: tuple[float, float], covers: bool) -> tuple[bool, float]:
    """Whether an interval holds, and the distance of its middle from the truth in half-widths."""
    low, high = value["ci95"]
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    if covers:
        return low <= truth[0] and truth[1] <= high, max(abs(end - middle) for end in truth) / half
    away = max(truth[0] - middle, middle - truth[1], 0.0)
    return away <= half, away / half


def judge(log: laboratory.Log, answer: dict, codes: tuple[int, int]) -> dict:
    """One row of results from an answer as `--json` prints it (empty after a crash), and the two exit codes."""
    scene, covers = log.scene, log.scene.truth == "covers"
    parameters, point = answer.get("parameters") or {}, answer.get("working_point")
    octave = bool(point) and point.get("source") == "octave"
    hertz = (point or {}).get("frequency_Hz") or 0.0
    force = abs(
        (point or {}).get("force_N") or float(np.max(laboratory.contact_force(scene, scene.p)[1])) / 2
    )
    depth = answer.get("depth_m")
    results, widths = [], []
    values = [(name, value) for name, value in parameters.items() if name in ("K", "B", "M", "n")]
    values += [("working point", point["stiffness"])] if point else []
    for name, value in values:
        if value.get("verdict") != "identified" or not value.get("ci95"):
            continue
        if name == "n":
            truth = (scene.p["n"],) * 2 if "n" in scene.p else None
        elif value.get("unit", "N/m").startswith("N/m^"):
            truth = None
        else:
            at = (
                float(laboratory.elastic(np.array([depth]), scene.p, scene)[0])
                if depth and name == "K"
                else force
            )
            of = "K at rest" if name == "K" and "K1" in parameters else name
            truth = laboratory.true_range(scene, of, at, hertz, octave)
        low, high = value["ci95"]
        if name == "K" or (name == "working point" and (scene.kind != "linear" or "r" in scene.p)):
            widths.append(0.5 * (high - low) / max(abs(0.5 * (high + low)), 1e-300))
        if truth is not None:
            holds, away = misses(value, truth, covers)
            results.append({"name": name, "said": value["ci95"], "true": truth, "holds": holds, "away": away})
    known = log.known <= KNOWN
    identified = any(v.get("verdict") == "identified" for _, v in values) or any(
        p.get("verdict") == "identified" for p in parameters.values()
    )
    doubtful = DOUBTFUL & {warning["code"] for warning in answer.get("warnings", ())}
    return {
        "world": log.name,
        "model": answer.get("model"),
        "results": results,
        "known": known,
        "sharp": known and any(w <= max(SHARP, SHARP_TIMES * log.known) for w in widths),
        "crash": 70 in codes,
        "exit": codes[0] != codes[1] or (codes[0] < 2 and (codes[0] == 0) != (identified and not doubtful)),
        "refused": codes[0] == 2,
    }


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
    return out | {
        key: sum(row[key] for row in rows) for key in ("known", "sharp", "crash", "exit", "refused")
    }


def table(rows: list[dict]) -> str:
    """One line a world and cause, and the sums."""

    def share(part: int, of: int) -> str:
        return f"{100 * part / of:.0f} %" if of else "-"

    head = "world | logs | answers | hold | wrong | known | sharp | points | hold | wrong | crash | exit | refused"
    lines = [f"| {head} |", "|---" * (head.count("|") + 1) + "|"]
    groups = [(name, [name]) for name in NAMES]
    groups += [
        ("all worlds", list(laboratory.WORLDS)),
        ("all causes", list(laboratory.CAUSES)),
        ("all", NAMES),
    ]
    for title, names in groups:
        chosen = [row for row in rows if row["world"] in names]
        if not chosen:
            continue
        c = tally(chosen)
        cells = [title.replace("_", " "), c["logs"], c["answers"], share(c["answers_hold"], c["answers"])]
        cells += [
            share(c["answers_wrong"], c["answers"]),
            c["known"],
            share(c["sharp"], c["known"]),
            c["points"],
        ]
        cells += [share(c["points_hold"], c["points"]), share(c["points_wrong"], c["points"])]
        cells += [c["crash"], c["exit"], c["refused"]]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
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
