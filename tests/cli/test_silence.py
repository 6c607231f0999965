"""Nothing of a library reaches a user's screen: the program's start closes every way to it."""

import subprocess
import sys

WAYS = {
    "warnings": "import warnings; warnings.simplefilter('always'); warnings.warn('library')",
    "arithmetic": "import numpy; numpy.float64(1e308) * numpy.float64(1e308)",
    "log": "import logging; logging.getLogger('websockets').critical('library')",
    "own handler": (
        "import logging; own = logging.getLogger('distributed'); own.addHandler(logging.StreamHandler());"
        "own.error('library')"
    ),
    "descriptor": "import os; os.write(2, b'library')",
    "child": "import subprocess; subprocess.run(['sh', '-c', 'echo library >&2'])",
    "thread": "import threading; t = threading.Thread(target=int, args=('library',)); t.start(); t.join()",
    "finaliser": "type('A', (), {'__del__': lambda self: int('library')})()",
    "event loop": (
        "import asyncio\nasync def main():\n"
        " asyncio.get_running_loop().call_exception_handler({'message': 'library'})\n"
        "asyncio.run(main())"
    ),
}
START = "from palpate.cli import _streams; _streams.keep(); _streams.prepare()\n"


def said(code, *options):
    ran = subprocess.run(
        [sys.executable, *options, "-c", f"{START}{code}\nimport sys; print('own', file=sys.stderr)"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stderr


def test_a_library_is_not_heard():
    assert said("\n".join(WAYS.values())) == "own\n"


def test_it_is_heard_by_who_develops():
    heard = said("\n".join(WAYS[way] for way in ("warnings", "descriptor", "finaliser")), "-X", "dev")
    assert heard.count("library") >= 3


def test_a_defect_in_a_thread_of_palpate_keeps_its_traceback():
    code = "import threading; from palpate.text import printable\n"
    code += "t = threading.Thread(target=printable, args=(3,)); t.start(); t.join()"
    assert "Traceback" in said(code)


def test_the_start_of_the_program_is_that_start():
    """`palpate` itself closes them, before it imports any library."""
    code = "import sys; sys.argv = ['palpate', '--version']; from palpate.cli import main; main()"
    ran = subprocess.run(
        [
            sys.executable,
            "-c",
            f"{code}; import os, warnings; os.write(2, b'library'); warnings.warn('library')",
        ],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ran.stderr == ""
    assert ran.stdout.strip()
