"""What every test may lean on: the project's folder, the measured logs, the program."""

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import settings

from palpate._jit import cache
from palpate._jit.cache import home_of
from palpate.cli import main
from palpate.plugins import consent

ROOT = Path(__file__).resolve().parent

# The same examples on every machine, and no failure because a machine was busy.
settings.register_profile("palpate", max_examples=50, deadline=None, derandomize=True, print_blob=True)
settings.load_profile("palpate")

os.environ.setdefault("MPLBACKEND", "Agg")
# What is started here buffers its output as it does for a user: a reader of a pipe must get a line when it is due.
os.environ.pop("PYTHONUNBUFFERED", None)
# What starts program and browser, for tests as for measurements.
sys.path.insert(0, str(ROOT / "benchmarks" / "live"))

# A shell that starts the tests in the background has Ctrl-C ignored, and whatever they start would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


# Thousands of tests are collected, each some objects, and nothing of them is garbage before the end.
gc.disable()


def pytest_collection_finish() -> None:
    """Collect garbage again, and look no more at what there is already."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process for each core: each collects all tests and imports all libraries for itself, and none waits long."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@pytest.fixture(autouse=True)
def _forgotten_afterwards(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Forgets what a test has registered from a module in a folder of its own.

    A kernel of the tests may call whatever is registered: each such module would have all that follow compiled anew.
    """
    registered = (cache.parts, cache.foreign_laws, cache.foreign_files)
    before = [set(known) for known in registered]
    yield
    own = tmp_path_factory.getbasetemp()
    for known, old in zip(registered, before, strict=True):
        for one in set(known) - old:
            home = one if isinstance(one, Path) else home_of(one)
            if own in home.parents or not home.is_file():
                known.pop(one) if isinstance(known, dict) else known.remove(one)


@pytest.fixture
def permitted() -> Iterator[None]:
    """Lets files name code of the tests."""
    with consent(lambda name: True):
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's folder."""
    return ROOT


@pytest.fixture(scope="session")
def measured() -> Path:
    """The folder of measured logs that lies beside the project; without it the test is skipped."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the measured logs (../shared/data) are not on this machine")
    return folder


@pytest.fixture
def program(capsys):
    """Run `palpate` with the given words, in this process; its exit code and what it printed."""

    def run(*words: object) -> SimpleNamespace:
        code = main(list(map(str, words)))
        printed = capsys.readouterr()
        return SimpleNamespace(returncode=code, stdout=printed.out, stderr=printed.err)

    return run


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium; skipped where there is none."""
    import headless

    pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if headless.chromium() is None:
        pytest.skip("there is no Chromium on this machine (Debian: apt-get install chromium)")
    with headless.browser() as own:
        yield own
