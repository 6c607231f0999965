"""What `.ci/run` does about an attack that finds something: it fails, with a seed that the commit determines."""

import os
import shutil
import subprocess

import pytest

ATTACK = """#!/bin/sh
echo "attack: $*"
case "$*" in *"--minutes 2"*) exit $(cat found) ;; esac
"""


@pytest.mark.parametrize("found", [0, 1])
def test_a_fresh_attack_that_finds_something_fails_the_run(root, tmp_path, found):
    """Programs that a machine may lack, and everything that takes long, are stand-ins that succeed."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(root / ".ci" / "run", tmp_path / ".ci" / "run")
    (tmp_path / "found").write_text(str(found))
    for name, text in {
        ".venv/bin/python": ATTACK,
        "bin/make": "#!/bin/sh\n",
        "bin/apt-get": "#!/bin/sh\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    git = ("git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b.c")
    subprocess.run([*git, "init", "--quiet"], check=True)
    subprocess.run([*git, "commit", "--quiet", "--allow-empty", "--message", "Begin"], check=True)
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout
    environment = os.environ | {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
    run = subprocess.run(
        ["bash", ".ci/run"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == found, run.stderr
    assert f"--minutes 2 --seed {int(commit[:7], 16)}\n" in run.stdout
    assert ("broke a promise" in run.stdout) == bool(found)
