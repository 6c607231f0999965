"""Every distribution as users get it: the wheel has the files of its sources, installs alone, its commands start."""

import fcntl
import os
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = [ROOT, *sorted(path.parent for path in ROOT.glob("packages/*/pyproject.toml"))]
MODULES: dict[str, str] = {}
"""Modules that users start where a distribution adds no command."""
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet", "--no-input")
pytestmark = pytest.mark.long


def project(folder):
    return tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def tracked(folder="."):
    """Files that git knows and that are there, from the project's folder on."""
    listed = subprocess.run(["git", "ls-files", "-z", folder], cwd=ROOT, capture_output=True, check=True)
    return [path for path in listed.stdout.decode().split("\0") if path and (ROOT / path).is_file()]


def run(*words, cwd=None):
    """Run words without a way to the sources: no PYTHONPATH, and an empty folder unless one is named."""
    env = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PIP_"))}
    ran = subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={**env, "PYTHONSAFEPATH": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, f"{' '.join(map(str, words))}\n{ran.stdout}\n{ran.stderr}"
    return ran.stdout


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Folder of the wheels of all distributions, built once, whichever processes of this run ask for it."""
    shared = "PYTEST_XDIST_TESTRUNUID" in os.environ
    place = tmp_path_factory.getbasetemp().parent if shared else tmp_path_factory.mktemp("built")
    with (place / "wheels.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (place / "wheels").exists():
            build_wheels(tmp_path_factory.mktemp("copy"), place / "wheels")
    return place / "wheels"


def build_wheels(copy, built):
    """Build the wheel of each distribution from a copy of the tracked files alone."""
    for path in tracked():
        (copy / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, copy / path)
    folders = [f"./{folder.relative_to(ROOT)}" for folder in FOLDERS]
    words = ("wheel", "--no-deps", "--no-build-isolation", "-w", copy / "wheels", *folders)
    run(sys.executable, *PIP, *words, cwd=copy)
    (copy / "wheels").rename(built)


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """Folder of the libraries of this environment, without palpate's distributions and their way to the sources."""
    folder = tmp_path_factory.mktemp("libraries")
    for place in {path for path in map(Path, sys.path) if path.name == "site-packages"}:
        for path in place.iterdir():
            if not path.name.startswith(("palpate", "__editable__")) and path.suffix != ".pth":
                (folder / path.name).symlink_to(path)
    return folder


def wheel_of(wheels, name):
    (path,) = wheels.glob(f"{name.replace('-', '_')}-*.whl")
    return path


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: project(folder)["name"])
def test_a_wheel_has_the_files_of_its_sources_and_no_others(wheels, folder):
    source = (folder / "src").relative_to(ROOT).as_posix()
    wanted = {path.removeprefix(f"{source}/") for path in tracked(source)}
    with zipfile.ZipFile(wheel_of(wheels, project(folder)["name"])) as wheel:
        packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert wanted
    assert packed == wanted, f"lacking: {sorted(wanted - packed)}, extra: {sorted(packed - wanted)}"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: project(folder)["name"])
def test_a_distribution_installs_alone_and_its_commands_start(wheels, libraries, tmp_path, folder):
    """pip takes palpate's distributions from the wheels alone, and finds the libraries installed."""
    own, place, empty = project(folder), tmp_path / "venv", tmp_path / "empty"
    empty.mkdir()
    venv.create(place, with_pip=False, symlinks=True)
    python = next(place.glob("bin/python"), place / "Scripts" / "python.exe")
    (site,) = place.rglob("site-packages")
    (site / "libraries.pth").write_text(f"{libraries}\n", encoding="utf-8")
    links = ("--no-index", "--no-compile", "--find-links", wheels)
    run(python, *PIP, "install", *links, own["name"], cwd=empty)
    where = "import palpate, pathlib; print(pathlib.Path(palpate.__file__).parents[1])"
    assert Path(run(python, "-c", where, cwd=empty).strip()).samefile(site)
    program = python.with_name("palpate")
    for command in own.get("entry-points", {}).get("palpate.commands", {}):
        assert f"palpate {command}" in run(program, command, "--help", cwd=empty)
    if own["name"] in MODULES:
        assert "--port" in run(python, "-m", MODULES[own["name"]], "--help", cwd=empty)
    modules = [path.relative_to(folder / "src").as_posix() for path in (folder / "src").glob("*/__init__.py")]
    run(python, "-c", f"import {modules[0].split('/')[0]}", cwd=empty)
    if own["name"] == "palpate":
        printed = run(program, "demo", cwd=empty)
        assert "✓ identified" in printed
        shown = [line.split()[1:] for line in printed.splitlines() if line.startswith("  palpate ")]
        assert [words[0] for words in shown] == ["identify", "tune", "press"]
        for words in shown:
            run(program, *words, cwd=empty)
        assert "foam-hybrid" in run(program, "run", "--list", cwd=empty)
