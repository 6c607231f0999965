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
from palpate.errors import how_to_install

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
    assert all(word in shown for word in ("identify", "run", "tune", "certify"))
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


LONG = {f"docs/{name}.md" for name in ("arms", "force", "online", "logs", "moving", "identify", "excite")}
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


def test_the_readme_shows_what_the_demo_prints(program, root, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (shown,) = blocks(root, "README.md", "text")
    assert "palpate demo" in commands(root, "README.md", "palpate")
    ran = program("demo")
    assert ran.returncode == 0
    assert [line.rstrip() for line in ran.stdout.splitlines()][
        : len(shown.splitlines())
    ] == shown.splitlines()
    (tmp_path / "press.csv").write_text("a log of somebody else")
    ran = program("demo")
    assert ran.returncode == 2
    assert "not the demo's" in ran.stderr
    assert (tmp_path / "press.csv").read_text() == "a log of somebody else"


def test_the_readme_shows_in_the_checkout():
    """Every link and picture is a file beside it, and the pictures are few and small."""
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert not [target for target in targets if "://" in target]
    pictures = [ROOT / target for target in targets if target.endswith((".png", ".svg"))]
    assert len(pictures) >= 5
    assert sum(path.stat().st_size for path in pictures) < 1_000_000


PICTURED = {
    "identify": ("identify press.csv --report page.html",),
    "tune": (
        "identify press.csv --json",
        "tune found.json --arm ur5e --force 15 --out gains.toml --report page.html",
    ),
}
"""Commands that made the page of a picture, as `make pictures` runs them."""


@pytest.mark.long
@pytest.mark.parametrize("name", PICTURED)
def test_a_picture_shows_the_numbers_that_the_program_prints(name, capsys, monkeypatch, tmp_path):
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "examples/data/press.csv", tmp_path)
    named = ["--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N"]
    for line in PICTURED[name]:
        words = line.split()
        main([*words, *(named if words[0] == "identify" else [])])
        (tmp_path / "found.json").write_text(capsys.readouterr().out)
    with Image.open(ROOT / "docs" / f"{name}.png") as image:
        shown = re.findall(r"\d[\d.]*(?: ± [\d.]+)? [A-Za-z/]+", image.text["Description"])
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(shown) > 5
    assert not [quantity for quantity in shown if quantity not in page], "make pictures"


KINDS = {".c", ".css", ".html", ".js", ".md", ".py", ".svg", ".toml", ".yaml", ".yml"}


def product_texts():
    """Text of each tracked file that users get or read, by its path; tests are for developers."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True
    ).stdout.decode()
    for name in listed.split("\0"):
        parts, path = Path(name).parts, ROOT / name
        if (
            path.is_file()
            and path.suffix in {".py", ".md", ".toml", ".html", ".js", ".c", ".svg"}
            and "tests" not in parts
        ):
            yield name, path.read_text(encoding="utf-8")


UNPUBLISHED = re.compile(
    r"(?:github\.com|githubusercontent\.com|gitlab\.com|pypi\.org/project)[/:]palpate\b"
    r"|palpate\.(?:readthedocs|github)\.io|://(?:www\.|docs\.)?palpate\."
)
"""Addresses of palpate's own on the web: none of them is there yet."""


def test_no_address_leads_to_what_is_not_published():
    found = [f"{name}: {match[0]}" for name, text in product_texts() for match in UNPUBLISHED.finditer(text)]
    assert not found


ARGUMENT = r"(?:'[^'\n]+'|\"[^\"\n]+\"|--?[\w-]+|[\w.\[][\w./\[\]-]*)"
INSTALLED = re.compile(rf"pip install\s+({ARGUMENT}(?: +{ARGUMENT})*)")


def folders_of_distributions():
    """Requirements of palpate's distributions, by the folder that pip is given."""
    projects = {}
    for file in [ROOT / "pyproject.toml", *ROOT.glob("packages/*/pyproject.toml")]:
        folder = "." if file.parent == ROOT else f"./packages/{file.parent.name}"
        projects[folder] = tomllib.loads(file.read_text(encoding="utf-8"))["project"]
    return projects


def needed_beside(project, folders):
    """Folders of other distributions that a distribution needs, but for palpate's, in alphabetical order."""
    names = ["./packages/" + re.split(r"[^\w-]", line)[0] for line in project["dependencies"]]
    own = {name for name in names if name in folders}
    return sorted(own.union(*(needed_beside(folders[name], folders) for name in own)))


def test_what_is_not_installed_is_named_with_all_that_it_needs():
    folders = folders_of_distributions()
    for folder, project in folders.items():
        words = ["pip", "install", *needed_beside(project, folders), folder]
        assert how_to_install(project["name"]) == f"{' '.join(words)} in palpate's sources"
    assert how_to_install("palpate[arms]") == "pip install '.[arms]' in palpate's sources"


def test_what_the_product_says_to_install_can_be():
    """A folder of the checkout, after those that it needs, with an extra that it has; or a library of others."""
    folders, wrong, count = folders_of_distributions(), [], 0
    lines = [
        line
        for project in folders.values()
        for extra in [project["dependencies"], *project.get("optional-dependencies", {}).values()]
        for line in extra
    ]
    libraries = {re.match(r"[\w.-]+", line)[0] for line in lines}
    for name, text in product_texts():
        for match in INSTALLED.finditer(text):
            words = [word.strip("'\"") for word in match[1].partition(" in ")[0].split() if word[0] != "-"]
            before: set[str] = set()
            for word in words:
                place, _, extra = word.removesuffix("]").partition("[")
                place = f"./{place}" if re.match(r"\w+/", place) else place
                own = folders.get(place)
                known = own is not None and (not extra or extra in own["optional-dependencies"])
                ready = known and before.issuperset(needed_beside(own, folders))
                if not (ready or (word in libraries and not word.startswith("palpate"))):
                    wrong.append(f"{name}: {match[0]}")
                before.add(place)
                count += 1
    assert not wrong, wrong
    assert count > 10
    extras = re.findall(
        r"how_to_install\(['\"]([\w-]+)\[(\w+)\]['\"]\)", "".join(t for _, t in product_texts())
    )
    assert len(extras) > 8
    for name, extra in extras:
        assert extra in folders["." if name == "palpate" else f"./packages/{name}"]["optional-dependencies"]


WRITES = ("--out", "--report", "--figure", "--table", "--save-options", ">", "export")
"""Words of a command before the name of what it makes."""


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/tutorial.md"])
def test_each_file_that_a_command_reads_is_in_the_checkout(root, page):
    """Or a command above it makes the file."""
    made, read = set(), []
    for line in commands(root, page, "palpate"):
        words = shlex.split(line)[2:]
        for before, word in zip(["", *words], words, strict=False):
            if before in WRITES:
                made.add(word)
            elif re.search(r"\.[a-z]\w*$|/", word.partition(":")[0]) and not word.startswith("--"):
                read.append(word)
                assert word in made or (root / word).exists(), f"{page}: {line}"
    assert read or page != "README.md"


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(root, page):
    text = (root / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert ((root / page).parent / target).exists(), f"{page}: {target}"
