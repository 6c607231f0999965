"""Record what palpate answers, and compare it with an earlier record: a restructuring must not change an answer.

    python benchmarks/answers.py OUT_DIR                      # record; answers that are there are skipped
    python benchmarks/answers.py OUT_DIR --against OLD_DIR    # record and compare; exit code 1 if an answer differs

Commands are those of `answers.toml`, and `run` and `thesis` of each name that they list. Each answer is one file,
OUT_DIR/PART/NAME.json: exit code and printed JSON (else the error) of each command, and the numbers that it wrote to
files; of generated C, and of the columns of a record, a digest. A command runs in a folder with its logs and nothing
else, so that no answer depends on the place of the checkout.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
DATA = (ROOT.parent / "shared" / "data", ROOT / "examples" / "data")
TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
UNCOMPARED = {"command", "version", "written_by"}
"""Keys whose values may differ between checkouts that answer alike."""
SIMULATED_LOGS, SEED, SHOWN_CHARACTERS = 100, 7, 150


class Case(NamedTuple):
    """Commands that run one after another in one folder, and the files there by name."""

    commands: tuple[str, ...]
    inputs: Mapping[str, bytes] = {}


def logs() -> Iterator[Case]:
    """Measured logs that are on this machine."""
    for *patterns, command in TABLE["logs"]:
        paths = sorted(path for folder in DATA for pattern in patterns for path in folder.glob(pattern))
        files = {path.name: path.read_bytes() for path in paths}
        for group in (
            [files] * bool(files) if "{logs}" in command else [{name: text} for name, text in files.items()]
        ):
            yield Case((re.sub("{logs?}", " ".join(group), command),), group)


def by_arm(part: str) -> Iterator[Case]:
    """Rows of a part, those with {arm} once for each arm."""
    for row in TABLE[part]:
        for arm in TABLE["arms"] if "{arm}" in row[0] else ("",):
            yield Case(tuple(command.format(arm=arm) for command in row))


def listed(command: str, arguments: str) -> Iterator[Case]:
    """A command for each name that its --list prints."""
    for line in palpate(f"{command} --list", ROOT).stdout.splitlines():
        yield Case((f"{command} {line.split()[0]}{arguments} --out results",))


def simulated() -> Iterator[Case]:
    """Logs of the foreign simulator, spread evenly over its cells."""
    sys.path.insert(0, str(ROOT / "tests" / "oracles"))
    from foreign.logs import CELLS, WORLD_CELLS, make_log

    cells = (*CELLS, *WORLD_CELLS)
    for i in range(SIMULATED_LOGS):
        cell = cells[i * len(cells) // SIMULATED_LOGS]
        log = make_log(cell, SEED)
        rows = zip(log.time, log.position, log.force, strict=True)
        text = "time_s,position_m,force_N\n" + "".join(f"{t:.9g},{x:.9g},{f:.9g}\n" for t, x, f in rows)
        name = f"{i:03}-{cell}.csv".replace("/", "-")
        yield Case((f"identify {name}{options(log.options)}",), {name: text.encode()})


def options(known: Mapping[str, Any]) -> str:
    """Keyword arguments of `palpate.identify` as options of the command."""
    words = " --bonded" if known.get("bonded") else ""
    for name, std in (("lag", "lag_std"), ("series_stiffness", "series_std"), ("force_filter", "")):
        if name in known:
            words += f" --{name.replace('_', '-')} {known[name]}"
            words += f":{known[std]}" if known.get(std) else ""
    return words


PARTS: dict[str, Callable[[], Iterator[Case]]] = {
    "logs": logs,
    "presses": partial(by_arm, "presses"),
    "c": partial(by_arm, "c"),
    "experiments": partial(listed, "run", " --seed 1"),
    "simulated": simulated,
    "claims": partial(listed, "thesis", ""),
}


def palpate(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run one command in a folder."""
    done = subprocess.run(  # noqa: S603 - the interpreter of this script
        [sys.executable, "-m", "palpate", *shlex.split(command)],
        cwd=folder, env=os.environ | TABLE["environment"], capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode not in {0, 1, 2}:
        raise SystemExit(f"palpate {command} ended with exit code {done.returncode}: {done.stderr[-500:]}")
    return done


def digest(content: bytes) -> str:
    return sha256(content).hexdigest()[:16]


def code_digest(path: Path) -> str:
    """Digest of C without its comments, which name lines of Python."""
    return digest(re.sub(rb"/\*.*?\*/", b"", path.read_bytes(), flags=re.DOTALL))


def columns(path: Path) -> dict[str, list[str]]:
    """Digest, mean and last value of each column of a record."""
    import polars

    table = polars.read_parquet(path)
    return {c.name: [digest(repr(c.to_list()).encode()), str(c.mean()), str(c[-1])] for c in table}


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": lambda path: json.loads(path.read_bytes()),
    ".toml": lambda path: tomllib.loads(path.read_text("utf-8")),
    ".parquet": columns,
    **dict.fromkeys((".csv", ".bin"), lambda path: digest(path.read_bytes())),
    **dict.fromkeys((".c", ".h"), code_digest),
}
"""Content of a written file by its ending; files with another one are pages and pictures."""


def answer(case: Case) -> dict[str, Any]:
    """Run the commands of a case, and collect what they print and write."""
    printed: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in case.inputs.items():
            (folder / file).write_bytes(content)
        for command in case.commands:
            done = palpate(command if command.startswith("thesis") else f"{command} --json", folder)
            error = done.stderr.splitlines()[-1:] if done.returncode else None
            said = json.loads(done.stdout) if done.stdout.startswith("{") else error
            printed[command] = {"exit code": done.returncode, "answer": said}
        paths = [path for path in sorted(folder.rglob("*")) if path.suffix in READERS]
        new = [path for path in paths if path.name not in {*case.inputs, "thesis.json"}]
        written = {path.relative_to(folder).as_posix(): READERS[path.suffix](path) for path in new}
    return {"printed": printed, "written": written}


def record(part: str, out: Path, pattern: str, case: Case) -> None:
    """Write the answer of a case, if it is not there and its name fits the pattern."""
    name = re.sub(r"[^\w.,=+-]+", "_", " ".join(case.commands)).replace("_--", "_")[:200]
    path = out / part / f"{name}.json"
    if path.exists() or not re.search(pattern, name):
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(answer(case), indent=1)
    path.with_suffix(".part").write_text(text, "utf-8")
    path.with_suffix(".part").replace(path)
    print(f"{part}/{name}: {digest(text.encode())}", flush=True)


def differences(old: Any, new: Any, where: str) -> Iterator[str]:
    """A line for each value that differs, with its path."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted((old.keys() | new.keys()) - UNCOMPARED):
            yield from differences(old.get(key, "(absent)"), new.get(key, "(absent)"), f"{where}/{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, f"{where}/{i}")
    elif (a := json.dumps(old)) != (b := json.dumps(new)):
        yield f"{where}: {a[:SHOWN_CHARACTERS]} -> {b[:SHOWN_CHARACTERS]}"


def answers_in(folder: Path, parts: Iterable[str]) -> dict[str, Any]:
    """Answers of a folder by part and name."""
    paths = [path for part in parts for path in (folder / part).glob("*.json")]
    return {f"{path.parent.name}/{path.stem}": json.loads(path.read_bytes()) for path in paths}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("out", type=Path, help="folder of the answers")
    parser.add_argument("--against", type=Path, help="folder of earlier answers to compare with")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="parts to record")
    parser.add_argument("--match", default="", help="regular expression that the names of answers fit")
    parser.add_argument("--jobs", type=int, default=1, help="commands at a time")
    given = parser.parse_args()
    if given.against and not given.against.is_dir():
        parser.error(f"--against: {given.against} is no folder of answers")
    with ThreadPoolExecutor(given.jobs) as pool:
        for part in given.only:
            done = list(pool.map(partial(record, part, given.out, given.match), PARTS[part]()))
            print(f"{part}: {len(done)} answers", flush=True)
    if given.against:
        old, new = (answers_in(folder, given.only) for folder in (given.against, given.out))
        old = {name: answer for name, answer in old.items() if re.search(given.match, name.split("/")[1])}
        lines = list(differences(old, new, ""))
        print(*lines, f"{len(new)} answers, {len(old)} earlier ones: {len(lines)} differences", sep="\n")
        sys.exit(bool(lines))


if __name__ == "__main__":
    main()
