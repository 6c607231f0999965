"""The program answers at once: nothing heavy is imported before it is needed."""

import json
import re
import resource
import subprocess
import sys

from palpate.cli._program import COMMANDS, added_commands

HEAVY = {"numba", "llvmlite", "scipy", "matplotlib", "polars", "jinja2", "pandas", "mujoco", "sympy"}


def modules_after(code: str) -> set[str]:
    """Top-level packages in sys.modules after the code has run in a fresh interpreter."""
    report = "print(json.dumps(sorted({name.split('.')[0] for name in sys.modules})), file=sys.stderr)"
    ran = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport json, sys\n{report}"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(json.loads(ran.stderr))


def seconds(*command: str) -> float:
    """Of the processor, the shortest of four runs: the cost itself, without what else the machine was doing."""

    def once() -> float:
        start = spent()
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        return spent() - start

    def spent() -> float:
        of_children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return of_children.ru_utime + of_children.ru_stime

    return min(once() for _ in range(4))


def test_help_imports_nothing_heavy():
    loaded = modules_after("from palpate.cli import main\nassert main(['--help']) == 0")
    assert "cyclopts" in loaded
    assert not loaded & (HEAVY | {"numpy"})


def test_importing_palpate_is_light():
    loaded = modules_after("import palpate")
    assert "palpate" in loaded
    assert not loaded & (HEAVY | {"numpy", "cyclopts", "rich"})


def test_importing_laws_does_not_import_numba():
    loaded = modules_after(
        "import palpate.controllers, palpate.identifiers, palpate.robots, palpate.environments"
    )
    assert "numpy" in loaded
    assert not loaded & HEAVY


def test_scipy_signal_and_stats_are_imported_by_no_short_command(root):
    """Their import costs as much as an identification; what else is left of them is slow by itself."""
    sources = (root / "src/palpate").rglob("*.py")
    users = {
        path.relative_to(root / "src/palpate").as_posix()
        for path in sources
        if re.search(
            r"from scipy\.(signal|stats) import|from scipy import (signal|stats)",
            path.read_text(encoding="utf-8"),
        )
    }
    assert users <= {
        "contact_frame/slide_log.py", "contact_frame/tool_payload.py", "studies/plan.py",
    }  # fmt: skip


def test_help_of_each_command_compiles_nothing():
    """All in one process: what one of them imports is still there after the last."""
    asked = "\n".join(
        f"assert main(['{command}', '--help']) == 0" for command in (*COMMANDS, *added_commands())
    )
    loaded = modules_after(f"from palpate.cli import main\n{asked}")
    assert "cyclopts" in loaded
    assert not loaded & HEAVY


def test_help_answers_within_four_bare_starts_and_a_quarter_of_a_second():
    bare = seconds(sys.executable, "-c", "pass")
    assert seconds(sys.executable, "-m", "palpate", "--help") <= 4 * bare + 0.25
