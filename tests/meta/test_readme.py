"""What the README and the pages tell the reader to type exists, and does what it says."""

import re
import runpy
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.cli._program import COMPANIONS, added_commands, program

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    *sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("packages/*/README.md")),
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
    """Lines of code blocks, fenced or indented, that begin with the word; a fenced `text` is output."""
    text = (root / page).read_text(encoding="utf-8")
    bodies = [body for name, body in FENCED.findall(text) if name not in ("python", "text")]
    fenced = [line for body in bodies for line in body.splitlines()]
    lines = fenced + INDENTED.findall(FENCED.sub("", text))
    return [line.split(" #")[0].strip() for line in lines if line.split()[:1] == [first]]


def test_the_readme_shows_the_program(root):
    shown = " ".join(commands(root, "README.md", "palpate"))
    assert all(word in shown for word in ("identify", "run", "speed"))
    assert "make demo" in commands(root, "README.md", "make")


@pytest.mark.parametrize("page", PAGES)
def test_palpate_understands_each_command(root, page):
    elsewhere = COMPANIONS.keys() - added_commands().keys()
    for line in commands(root, page, "palpate"):
        if (
            line.split()[1] in elsewhere
        ):  # its distribution is not installed; where it is, it has this test too
            continue
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


LONG = {
    f"docs/{name}.md"
    for name in ("arms", "force", "analysis", "online", "logs", "moving", "identify", "excite")
}
"""They identify, press, tune or prove for seconds."""


def give_logs(folder):
    """The files that the pages read: the log that comes with palpate, and the bag of its example."""
    shutil.copy(ROOT / "examples/data/press.csv", folder)
    bag = folder / "press.mcap"

    def make_bag():
        runpy.run_path(str(ROOT / "examples/10_identify_a_bag.py"))
        shutil.copy(next(Path("press").glob("*.mcap")), bag)

    return make_bag


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.long if page in LONG else ())
        for page in PAGES
        if page not in TYPED and blocks(ROOT, page, "python")
    ],
)
def test_python_of_the_pages_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_bag, names = give_logs(tmp_path), {}
    for code in blocks(ROOT, page, "python"):
        if "press.mcap" in code:
            make_bag()
        exec(compile(code, page, "exec"), names)


@pytest.mark.parametrize("page", PAGES)
def test_toml_of_the_pages_is_toml(page):
    for text in blocks(ROOT, page, "toml"):
        assert tomllib.loads(text), f"{page}: {text}"


@pytest.mark.parametrize("line", ["palpate run --list"])
def test_cheap_commands_of_the_readme_run(root, capsys, line):
    assert line in commands(root, "README.md", "palpate")
    assert main(shlex.split(line)[1:]) == 0
    assert "foam-hybrid" in capsys.readouterr().out


def test_the_log_of_the_readme_is_identified(root, capsys, monkeypatch, tmp_path):
    (line,) = [line for line in commands(root, "README.md", "palpate") if "identify examples" in line]
    words = shlex.split(line)[1:]
    words[1] = str(root / words[1])
    monkeypatch.chdir(tmp_path)
    assert main(words) in {0, 1}
    assert "K" in capsys.readouterr().out


def own_address(target):
    """A link to the project's own sources as its file; the package index has no files beside the README."""
    source = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]["Source"]
    raw = source.replace("github.com", "raw.githubusercontent.com") + "/main/"
    for base in (f"{source}/blob/main/", raw):
        if target.startswith(base):
            return str(ROOT / target.removeprefix(base))
    return target


def test_the_readme_shows_on_the_package_index():
    """Every link and picture is absolute, and the pictures are few and small."""
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert all("://" in target for target in targets), targets
    pictures = [Path(own_address(t)) for t in targets if t.endswith((".png", ".svg"))]
    assert len(pictures) >= 5
    assert sum(path.stat().st_size for path in pictures) < 1_000_000


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(root, page):
    text = (root / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        own = own_address(target)
        if "://" not in own:
            assert ((root / page).parent / own).exists(), f"{page}: {target}"
