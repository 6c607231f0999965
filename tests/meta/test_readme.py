"""What the README and the pages tell the reader to type exists, and does what it says."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.cli._program import program

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")),
]
TYPED = ("README.md", "docs/tutorial.md")
"""Whose Python and whose commands have tests of their own."""
FENCED = re.compile(r"(?ms)^```(\w*)\n(.*?)^```$")
INDENTED = re.compile(r"(?m)^    (\S.*)$")


def blocks(root, page: str, language: str) -> list[str]:
    text = (root / page).read_text(encoding="utf-8")
    return [body for name, body in FENCED.findall(text) if name == language]


def commands(root, page: str, first: str) -> list[str]:
    """Lines of code blocks, fenced or indented, that begin with the word."""
    text = (root / page).read_text(encoding="utf-8")
    fenced = [line for name, body in FENCED.findall(text) if name != "python" for line in body.splitlines()]
    lines = fenced + INDENTED.findall(FENCED.sub("", text))
    return [line.split(" #")[0].strip() for line in lines if line.split()[:1] == [first]]


def test_the_readme_shows_the_program(root):
    shown = " ".join(commands(root, "README.md", "palpate"))
    assert all(word in shown for word in ("identify", "run", "speed"))
    assert "make demo" in commands(root, "README.md", "make")


@pytest.mark.parametrize("page", PAGES)
def test_palpate_understands_each_command(root, page):
    for line in commands(root, page, "palpate"):
        _, bound, _ = program().parse_args(shlex.split(line)[1:])
        assert bound is not None, line


def test_make_knows_each_target(root):
    lines = {line for page in PAGES for line in commands(root, page, "make")}
    words = {word for line in lines for word in shlex.split(line)[1:]}
    assert {"test", "demo"} <= words
    ran = subprocess.run(
        ["make", "--dry-run", *sorted(words)], cwd=root, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr


def test_each_make_target_has_a_line_of_help(root):
    text = (root / "Makefile").read_text(encoding="utf-8")
    phony = re.search(r"(?m)^\.PHONY: (.*)$", text).group(1).split()
    shown = subprocess.run(["make", "help"], cwd=root, capture_output=True, text=True, check=True).stdout
    assert phony
    for target in phony:
        assert re.search(rf"make {target} +\S", shown), target


def test_python_of_the_readme_runs(root, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = blocks(root, "README.md", "python")
    assert shown
    for code in shown:
        exec(compile(code, "README.md", "exec"), {})


def alone(page):
    """Python of a page that reads no file of the reader's."""
    return [code for code in blocks(ROOT, page, "python") if not re.search(r"\bread_\w+\(", code)]


LONG = ("docs/arms.md", "docs/force.md", "docs/analysis.md", "docs/online.md")
"""They press, tune or prove for seconds."""


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.long if page in LONG else ())
        for page in PAGES
        if page not in TYPED and alone(page)
    ],
)
def test_python_of_the_pages_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for code in alone(page):
        exec(compile(code, page, "exec"), {})


@pytest.mark.parametrize("line", ["palpate run --list"])
def test_cheap_commands_of_the_readme_run(root, capsys, line):
    assert line in commands(root, "README.md", "palpate")
    assert main(shlex.split(line)[1:]) == 0
    assert "foam-hybrid" in capsys.readouterr().out


def test_the_log_of_the_readme_is_identified(root, capsys, monkeypatch, tmp_path):
    (line,) = [line for line in commands(root, "README.md", "palpate") if " identify " in line]
    words = shlex.split(line)[1:]
    words[1] = str(root / words[1])
    monkeypatch.chdir(tmp_path)
    assert main(words) in {0, 1}
    assert "K" in capsys.readouterr().out


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(root, page):
    text = (root / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert ((root / page).parent / target).exists(), f"{page}: {target}"
