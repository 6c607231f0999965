"""The road of a log and of a tick: through how many files of palpate a command runs, and how many modules it loads."""

import inspect
import json
import subprocess
import sys
import threading

import pytest

RUNS = {"identify": 66, "run": 99, "press": 94}
"""Most files in which a function runs (its own body: that of a module or a class does not count): the measure by which
60, 100 and 80 are wanted. They may only fall."""
LOADS = {"identify": 100, "run": 177, "press": 159}
"""Most modules of palpate, and of the distributions beside it, in `sys.modules` after the command; likewise."""
IMPORTED = 87
"""Most modules that reading and identifying a log imports before it has one."""
ROOM = 1.01
COMMANDS = {
    "identify": "examples/data/press.csv --time time_s --position position_mm:mm --force force_N:N --figure {}/f.png",
    "run": "foam-hybrid --seed 1 --out {}/run",
    "press": "--arm fr3 --force 20:N --surface K=5000,B=50 --out {}/press",
}
"""As the README has them."""
INNER = {"<module>", "<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>"}
"""Names of code that is no function of its own."""


def road(arguments):
    """Files of palpate through which a command runs, and modules that it loads; in a process of its own."""
    codes = set()

    def note(frame, event, _):
        if event == "call":
            codes.add(frame.f_code)

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        from palpate.cli import main

        code = main(arguments)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    assert code == 0, f"palpate {' '.join(arguments)} ended with {code}"
    files = {own: module.__file__ for own, module in sys.modules.items() if own.startswith("palpate")}
    functions = [c for c in codes if c.co_flags & inspect.CO_OPTIMIZED and c.co_name not in INNER]
    return sorted({c.co_filename for c in functions} & {*files.values()}), sorted(files)


def of_process(root, *arguments):
    """Last line that a process of its own prints to standard error, from JSON."""
    ran = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True, cwd=root)
    return json.loads(ran.stderr.splitlines()[-1])


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_the_road_of_a_command_grows_no_longer(root, tmp_path, command):
    runs, loads = of_process(root, __file__, command, *COMMANDS[command].format(tmp_path).split())
    assert len(runs) <= ROOM * RUNS[command], "\n".join(runs)
    assert len(loads) <= ROOM * LOADS[command], "\n".join(loads)


def test_what_identifies_a_log_imports_no_more(root):
    code = "import palpate.cli.identify, palpate.from_log, json, sys; sys.stderr.write(json.dumps([*sys.modules]))"
    loads = [name for name in of_process(root, "-c", code) if name.startswith("palpate")]
    assert len(loads) <= ROOM * IMPORTED, "\n".join(loads)


def test_a_function_is_counted_where_it_stands(root):
    """A command that touches no log runs through the program alone, and loads it."""
    runs, loads = of_process(root, __file__, "--version")
    names = {path.rpartition("palpate/")[2] for path in runs}
    assert {"cli/__init__.py", "cli/_program.py"} <= names
    assert "cli/identify.py" not in names
    assert "palpate.cli._program" in loads
    assert "palpate.from_log" not in loads


if __name__ == "__main__":
    sys.stderr.write(json.dumps(road(sys.argv[1:])))
