"""The lock pins everything with hashes, and says nothing about where it was made."""

import re
import tomllib
from importlib.metadata import version

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

LOCKS = ("run", "dev")


def pins(root, lock: str) -> dict[str, Requirement]:
    text = (root / "requirements" / f"{lock}.txt").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [re.sub(r"--hash=\S+", "", line) for line in text.splitlines() if line.strip()]
    requirements = [Requirement(line) for line in lines]
    return {canonicalize_name(requirement.name): requirement for requirement in requirements}


def declared(root) -> dict:
    return tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("lock", LOCKS)
def test_no_addresses_no_paths_no_options(root, lock):
    text = (root / "requirements" / f"{lock}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert not re.findall(r"(?m)^\s*(?:-[a-z]|#|--(?!hash=))", text)
    assert " @ " not in text


@pytest.mark.parametrize("lock", LOCKS)
def test_every_line_is_one_version_with_hashes(root, lock):
    text = (root / "requirements" / f"{lock}.txt").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = text.splitlines()
    assert len(lines) > 20
    for line in lines:
        assert re.match(r"[A-Za-z0-9_.-]+==[^ ]+ .*--hash=sha256:[0-9a-f]{64}", line), line


def test_the_lock_satisfies_what_is_declared(root):
    project, groups = declared(root)["project"], declared(root)["dependency-groups"]
    tools = [line for group in groups.values() for line in group if isinstance(line, str)]
    for lock, lines in (("run", project["dependencies"]), ("dev", project["dependencies"] + tools)):
        locked = pins(root, lock)
        for wanted in map(Requirement, lines):
            (pin,) = locked[canonicalize_name(wanted.name)].specifier
            assert wanted.specifier.contains(pin.version), f"{lock}: {wanted} against {pin}; run `make lock`"


def beside(root) -> dict[str, dict]:
    """The [project] table of each distribution beside palpate, by its folder."""
    files = sorted(root.glob("packages/*/pyproject.toml"))
    assert files
    return {file.parent.name: tomllib.loads(file.read_text(encoding="utf-8"))["project"] for file in files}


def test_what_the_distributions_beside_palpate_declare_is_in_its_lock(root):
    """So that one lock serves all of them."""
    palpate, all_beside, locked = declared(root)["project"], beside(root), pins(root, "run")
    for folder, project in all_beside.items():
        assert project["name"] == folder
        assert project["version"] == palpate["version"] == version("palpate")
        for wanted in map(Requirement, project["dependencies"]):
            ours = {"palpate": palpate, **all_beside}.get(wanted.name)
            if ours is not None:
                assert wanted.specifier.contains(ours["version"]), f"{folder}: {wanted}"
                continue
            (pin,) = locked[canonicalize_name(wanted.name)].specifier
            assert wanted.specifier.contains(pin.version), f"{folder}: {wanted} against {pin}"


def test_an_extra_of_palpate_asks_a_distribution_beside_it_for_its_own(root):
    all_beside = beside(root)
    for extra, lines in declared(root)["project"]["optional-dependencies"].items():
        for wanted in map(Requirement, lines):
            if wanted.name in all_beside:
                theirs = all_beside[wanted.name]
                assert wanted.specifier.contains(theirs["version"]), extra
                assert wanted.extras <= theirs.get("optional-dependencies", {}).keys(), extra


def test_developers_run_what_users_run(root):
    run, dev = pins(root, "run"), pins(root, "dev")
    assert run
    for name, requirement in run.items():
        assert dev[name].specifier == requirement.specifier, f"{name} differs; run `make lock`"


def test_what_breaks_by_majors_has_an_upper_bound(root):
    asked: set[str] = set()
    for project in (declared(root)["project"], *beside(root).values()):
        asked.update(project["dependencies"], *project.get("optional-dependencies", {}).values())
    assert {one for one in asked if "<" not in one.partition(";")[0]} == {"distributed>=2025.1"}


def test_the_licence_of_each_bundled_part_is_in_the_wheels_metadata(root):
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    named = {path for pattern in project["license-files"] for path in root.glob(pattern)}
    bundled = {
        path for path in (root / "src").rglob("*") if path.stem.upper() in {"LICENSE", "COPYING", "NOTICE"}
    }
    assert bundled < named
    assert {path.parent.name for path in bundled} == {"arms", "uplot"}
    heads = [path.read_text() for path in (root / "src/palpate/robots/serial/arms").glob("*.toml")]
    texts = (root / "src/palpate/robots/serial/arms/LICENSE").read_text()
    assert all(f"{path.name}" in texts for path in (root / "src/palpate/robots/serial/arms").glob("*.toml"))
    kinds = {"BSD-3-Clause", "Apache-2.0"}
    assert all(any(kind in head for kind in kinds) for head in heads)
    assert all(kind in project["license"] for kind in kinds)
