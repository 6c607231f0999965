"""The documentation's pages: each is in the menu, each room in the reference, and the tutorial does what it says."""

import ast
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import pytest

from meta.test_readme import blocks, commands
from palpate.cli import main


def menu(entries):
    """The pages of a menu, however deep."""
    for entry in entries:
        for value in entry.values():
            yield from [value] if isinstance(value, str) else menu(value)


def config(root):
    return tomllib.loads((root / "zensical.toml").read_text(encoding="utf-8"))["project"]


def test_each_page_is_in_the_menu_once(root):
    pages = sorted(str(path.relative_to(root / "docs")) for path in (root / "docs").rglob("*.md"))
    assert sorted(menu(config(root)["nav"])) == pages


def test_the_menu_begins_with_what_a_user_does_and_ends_with_its_background(root):
    chapters = [next(iter(entry)) for entry in config(root)["nav"]]
    assert chapters == ["palpate", "Guide", "Simulate", "Reference", "Background"]


def test_each_room_that_offers_names_is_in_the_reference(root):
    rooms = {
        path.parent.name
        for path in (root / "src" / "palpate").glob("*/__init__.py")
        if "__all__" in path.read_text(encoding="utf-8") and not path.parent.name.startswith("_")
    }
    inside = {
        "cli",
        "errors",
        "files",
        "identification",
        "logs",
        "signals",
    }
    shown = {path.stem for path in (root / "docs" / "reference").glob("*.md")}
    assert (rooms | {"press", "report"}) - inside - shown == set()


def test_each_example_is_shown(root):
    page = (root / "docs" / "examples.md").read_text(encoding="utf-8")
    shown = re.findall(r'--8<-- "examples/(.*?)"', page)
    assert sorted(shown) == sorted(path.name for path in (root / "examples").glob("[0-9]*.py"))
    for name in shown:
        first = ast.get_docstring(ast.parse((root / "examples" / name).read_text(encoding="utf-8")))
        assert first.splitlines()[0] in page


@pytest.mark.long
def test_the_tutorial_goes_from_a_log_to_a_certified_loop(root, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(root / "examples" / "data", tmp_path / "examples" / "data")
    lines = commands(root, "docs/tutorial.md", "palpate")
    assert len(lines) == 8
    for line in lines:
        words, _, file = line.partition(" > ")
        if words.startswith("palpate live"):  # it serves until it is ended, and is tested by its own package
            continue
        assert main(shlex.split(words)[1:]) == 0, line
        told = capsys.readouterr().out
        if file:
            (tmp_path / file).write_text(told, encoding="utf-8")
    for name in ("press.html", "gains.toml", "certificate.json", "press/report.html"):
        assert (tmp_path / name).stat().st_size > 0
    (code,) = blocks(root, "docs/tutorial.md", "python")
    exec(compile(code, "docs/tutorial.md", "exec"), {})
    assert "move to" in capsys.readouterr().out


@pytest.mark.long
def test_the_site_is_built_without_a_complaint_and_asks_no_other_host(root, tmp_path):
    pytest.importorskip("zensical", reason="zensical builds the site: it comes with `make docs`")
    for name in ("docs", "examples", "packages", "src"):
        shutil.copytree(root / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "zensical.toml").write_bytes((root / "zensical.toml").read_bytes())
    command = [sys.executable, "-m", "zensical", "build", "--clean"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0
    assert "No issues found" in ran.stdout + ran.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > len(list(menu(config(root)["nav"])))
    for page in pages:
        fetched = re.findall(
            r'(?:src|srcset)="(https?:[^"]*)"|<link[^>]*href="(https?:[^"]*)"', page.read_text()
        )
        assert not fetched, page
    reference = (tmp_path / "site" / "reference" / "identifiers" / "index.html").read_text(encoding="utf-8")
    assert "RecursiveLeastSquares" in reference
    assert "forgetting" in reference
