"""Every figure of the documents that stands between marks: make those whose sources have changed, or try all of them.

    python benchmarks/figures.py                    # make what is not of today's sources; resumable
    python benchmarks/figures.py --only touches     # by name, whatever its sources are
    python benchmarks/figures.py --smoke            # the small run of each, which writes nothing
    python benchmarks/figures.py --list             # name, page, state, command

`figures.toml` names each figure's page, its command, a small run of the same script (`smoke`), and the sources that
decide its numbers. A command prints the figure; here it is put between its marks, with the version of palpate and a
digest of the sources: of their syntax, so that comments, docstrings and layout change nothing. Where only the digest
has changed and the small run still prints what it printed when the figure was made, the figure stands, and gets the new
digest. A figure of times is made again; its small run is compared by its words alone. A script without a page makes no
figure: its small run alone is kept and compared. Exit code 1 if a command fails, or, with `--smoke`, if a small run
prints anything else than it did.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import hashlib
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

import msgspec
from rich.progress import track

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
TABLE, SMOKES = HERE / "figures.toml", HERE / "smokes"
LETTERS = 12
"""Of a digest: two of 1000 differing sources are equal by chance once in 6e8."""


class Figure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One figure of a document.

    Attributes:
        name: between its marks, and of the file of its small run.
        page: that it stands in, from the project's root; empty for a script that makes no figure.
        command: that prints it; a Python script and its arguments, from the project's root.
        smoke: arguments of the small run of the same script.
        sources: files and folders that decide its numbers, from the project's root. The script is one, too. None: the
            figure is of a day, and no digest tells when it is of the past.
        fenced: whether it is text with columns, rather than Markdown.
        times: whether it holds times, or what rounding decides, which no other machine prints again.
        needs: programs, and files from the project's root, without which the small run is left out, and the figure not
            made.
    """

    name: str
    page: str
    command: str
    smoke: str
    sources: tuple[str, ...] = ()
    fenced: bool = False
    times: bool = False
    needs: tuple[str, ...] = ()

    @property
    def marks(self) -> tuple[str, str]:
        """What stands before and after it in its page."""
        return f"<!-- figure {self.name}: begin -->", f"<!-- figure {self.name}: end -->"

    @property
    def script(self) -> str:
        """File of the script, from the project's root."""
        return shlex.split(self.command)[0]

    @property
    def lacking(self) -> list[str]:
        """Needed programs and files that are not on this machine."""
        return [need for need in self.needs if not shutil.which(need) and not (ROOT / need).exists()]


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`figures.toml`: groups of sources, and figures whose sources may name a group as `@NAME`."""

    groups: dict[str, tuple[str, ...]]
    figure: tuple[Figure, ...]

    def paths(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Files and folders for names of them and of groups."""
        found = (self.paths(self.groups[name[1:]]) if name.startswith("@") else (name,) for name in names)
        return tuple(dict.fromkeys(itertools.chain.from_iterable(found)))


def figures() -> dict[str, Figure]:
    """All of `figures.toml`, by name."""
    table = msgspec.toml.decode(TABLE.read_bytes(), type=Table)
    return {f.name: msgspec.structs.replace(f, sources=table.paths(f.sources)) for f in table.figure}


def digest(figure: Figure) -> str:
    """Of the sources that decide its numbers; empty if the figure is of a day."""
    if not figure.sources:
        return ""
    found = hashlib.sha256(figure.command.encode())
    for path in files(figure):
        found.update(path.relative_to(ROOT).as_posix().encode())
        found.update(content(path))
    return found.hexdigest()[:LETTERS]


def files(figure: Figure) -> Iterator[Path]:
    """The script, and the sources with the files of folders, in a fixed order."""
    for name in (figure.script, *figure.sources):
        path = ROOT / name
        if path.is_dir():
            yield from sorted(f for f in path.rglob("*") if f.suffix in {".py", ".toml", ".h", ".c"})
        else:
            yield path


def content(path: Path) -> bytes:
    """What can change a number: the syntax of a module without its docstrings, or the bytes of another file."""
    return path.read_bytes() if path.suffix != ".py" else syntax(path.read_text(encoding="utf-8"))


@cache
def syntax(source: str) -> bytes:
    """That of a module without its docstrings; many figures are of one module."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not is_text(line)]
    return ast.dump(tree).encode()


def is_text(node: ast.stmt) -> bool:
    """Whether a statement is a bare text, as docstrings are."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def body_of(figure: Figure) -> str:
    """What stands between the marks of a figure.

    Raises:
        ValueError: if its page has not both marks, once.
    """
    text = (ROOT / figure.page).read_text(encoding="utf-8")
    begin, end = figure.marks
    if text.count(begin) != 1 or text.count(end) != 1:
        raise ValueError(f"{figure.page} has not once {begin} and {end}")
    return text.partition(begin)[2].partition(end)[0]


def text_of(figure: Figure) -> str:
    """What its command printed, without the line that says so; empty if it has never been made."""
    return body_of(figure).rpartition("`python ")[0].strip()


def stamp_of(figure: Figure) -> str:
    """The digest that stands with a figure; empty where there is none, or no figure."""
    found = re.search(r"sources ([0-9a-f]{12})", body_of(figure))
    return found[1] if found and text_of(figure) else ""


def is_fresh(figure: Figure) -> bool:
    """Whether a figure is of today's sources; a script without a page has none to be older."""
    return not figure.sources or stamp_of(figure) == digest(figure)


def output(command: str) -> str:
    """What a script prints.

    Raises:
        RuntimeError: with its last line, if it fails; or if it prints nothing, which is no figure.
    """
    # One thread, and the same kernels of algebra on every processor: others round otherwise.
    algebra = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OPENBLAS_CORETYPE": "Haswell"}
    environment = os.environ | algebra | {"COLUMNS": "200"}
    done = subprocess.run(  # noqa: S603 -- the project's own scripts
        [sys.executable, *shlex.split(command)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip() or "no word").splitlines()[-1]
        raise RuntimeError(f"`python {command}` ended with exit code {done.returncode}: {last}")
    if not done.stdout.strip():
        raise RuntimeError(f"`python {command}` printed nothing")
    return "\n".join(line.rstrip() for line in done.stdout.splitlines() if line.strip())


def smoke(figure: Figure) -> str:
    """What the small run prints; of a figure of times its words alone, however wide its columns are."""
    with tempfile.TemporaryDirectory() as folder:
        text = output(f"{figure.script} {figure.smoke.replace('{tmp}', folder)}".strip()).replace(folder, "")
    return re.sub(r" +", " ", re.sub(r"[-+]?\d[\d.e+-]*", "#", text)) if figure.times else text


def smoke_file(figure: Figure) -> Path:
    """Where the output of the small run is kept."""
    return SMOKES / f"{figure.name}.txt"


def kept(figure: Figure) -> str:
    """What the small run printed when the figure was made; empty if it never ran."""
    path = smoke_file(figure)
    return path.read_text(encoding="utf-8").rstrip("\n") if path.exists() else ""


def put(figure: Figure, text: str) -> None:
    """Write a figure between its marks, with the command, the version, the digest and the day."""
    made = [f"`python {figure.command}`", f"palpate {version('palpate')}"]
    made += [f"sources {digest(figure)}"] if figure.sources else []
    shown = f"```text\n{text}\n```" if figure.fenced else apart(text)
    write(figure, f"\n\n{shown}\n\n{', '.join(made)}, {datetime.now(UTC):%Y-%m-%d}.\n\n")


def apart(text: str) -> str:
    """Markdown with a blank line before and after each table, without which a page shows it as a paragraph."""
    return re.sub(r"(?m)^(\|.*)\n(?=[^|\n])|^([^|\n].*)\n(?=\|)", lambda line: f"{line[0]}\n", text)


def write(figure: Figure, body: str) -> None:
    """Replace what stands between the marks of a figure."""
    page = ROOT / figure.page
    begin, end = figure.marks
    head, _, rest = page.read_text(encoding="utf-8").partition(begin)
    page.write_text(f"{head}{begin}{body}{end}{rest.partition(end)[2]}", encoding="utf-8")


def renew(figure: Figure, forced: bool) -> str:
    """Make a figure again, or only its digest where the small run prints what it printed; says which.

    Raises:
        RuntimeError: where a program is lacking, without which the figure would lose a row.
    """
    if figure.lacking:
        raise RuntimeError(f"needs {', '.join(figure.lacking)}: install what is lacking, then make it again")
    today = smoke(figure)
    if figure.page and not forced and not figure.times and stamp_of(figure) and today == kept(figure):
        write(figure, body_of(figure).replace(f"sources {stamp_of(figure)}", f"sources {digest(figure)}"))
        return "stands: the small run prints what it printed"
    if figure.page:
        put(figure, output(figure.command))
    SMOKES.mkdir(exist_ok=True)
    smoke_file(figure).write_text(today + "\n", encoding="utf-8")
    return "made"


def difference(figure: Figure) -> str:
    """How the small run differs from what it printed; empty if it does not, or if its programs are not here."""
    if figure.lacking:
        return ""
    lines = difflib.unified_diff(
        kept(figure).splitlines(), smoke(figure).splitlines(), "kept", "now", lineterm="", n=0
    )
    return "\n".join(lines)


def caught(task: partial[str]) -> str | RuntimeError:
    """The task's answer, or the error of its script."""
    try:
        return task()
    except RuntimeError as error:
        return error


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="figures, or folders of the benchmarks")
    parser.add_argument("--smoke", action="store_true", help="run the small run of each, and write nothing")
    parser.add_argument("--list", action="store_true", help="say what there is")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="small runs at once")
    given = parser.parse_args()
    every = figures()
    chosen = [
        f for f in every.values() if not given.only or {f.name, Path(f.script).parent.name} & {*given.only}
    ]
    if not chosen:
        parser.error(f"no such figure: {' '.join(given.only)}; --list names them")
    if given.list:
        for figure in chosen:
            print(f"{figure.name:34} {figure.page:26} {'' if is_fresh(figure) else 'old':4} {figure.command}")
        return
    sys.exit(try_all(chosen, given.jobs) if given.smoke else make(chosen, forced=bool(given.only)))


def try_all(chosen: list[Figure], jobs: int) -> int:
    """Run the small runs, some at once; the exit code."""
    with ThreadPoolExecutor(jobs) as pool:
        found = pool.map(lambda figure: caught(partial(difference, figure)), chosen)
        answers = list(track(found, "figures", total=len(chosen), transient=True))
    for figure, answer in zip(chosen, answers, strict=True):
        if answer:
            print(f"{figure.name} of {figure.page or figure.script}: {answer}")
            print(f"  python benchmarks/figures.py --only {figure.name}")
    print(
        f"{sum(not answer for answer in answers)} of {len(chosen)} figures: their small runs print what they printed"
    )
    return int(any(answers))


def make(chosen: list[Figure], forced: bool) -> int:
    """Make what is not of today's sources, one after the other; the exit code."""
    code = 0
    for figure in [f for f in chosen if forced or not is_fresh(f)]:
        answer = caught(partial(renew, figure, forced))
        print(f"{figure.name} of {figure.page or figure.script}: {answer}", flush=True)
        code |= isinstance(answer, RuntimeError)
    return code


if __name__ == "__main__":
    main()
