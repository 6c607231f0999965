"""What the bridge to Numba promises: one meaning, one cache that is never stale, any name for any part."""

import compileall
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import own_parts
import palpate
from palpate._jit import cache, kernel, law, part
from palpate._jit.cache import stamp_of
from palpate._vector import ZERO3, Mat3, solve, sqrt


@part
class Spring(NamedTuple):
    stiffness: float

    def step(self, state, v):
        return self.stiffness * v, state + v

    def pose(self, x, scale=2.0):
        return scale * self.stiffness * x

    @property
    def lag(self):
        return 2.0 * self.stiffness


@part
class Holder(NamedTuple):
    """Its fields bear names that are methods and properties elsewhere."""

    pose: float
    lag: float
    T: float

    def step(self, z, v, dt):
        return self.pose * v * dt + z


@part
class Delay(NamedTuple):
    """A method here is a property elsewhere."""

    base: float

    def lag(self, x):
        return self.base * x

    def step(self):
        return self.base


@part
class Nest(NamedTuple):
    inner: Spring

    def step(self, z):
        force, z = self.inner.step(z, 3.0)
        return force + self.inner.lag, z


@law
def with_defaults(a, b=3.0):
    return a - b


@kernel
def everything(spring, holder, delay, nest):
    calls = spring.step(1.0, 2.0), holder.step(1.0, 2.0, 3.0), delay.step(), nest.step(1.0)
    fields = holder.pose, holder.lag, holder.T
    names = spring.lag, delay.lag(2.0), spring.pose(2.0), spring.pose(2.0, 5.0), spring.pose(x=1.0, scale=4.0)
    return calls, fields, names, with_defaults(1.0), with_defaults(1.0, b=2.0)


def test_parts_share_names_with_their_own_signatures():
    arguments = Spring(2.0), Holder(3.0, 4.0, 5.0), Delay(6.0), Nest(Spring(7.0))
    assert everything(*arguments) == everything.plain(*arguments)
    assert everything(*arguments)[1] == (3.0, 4.0, 5.0)


@kernel
def dividing(a, A):
    return 1.0 / a, solve(A, ZERO3), sqrt(-1.0 - a)


def test_division_by_zero_and_root_of_a_negative_do_not_interrupt_a_kernel():
    inverse, x, root = dividing(0.0, Mat3(ZERO3, ZERO3, ZERO3))
    assert inverse == float("inf")
    assert x.x != x.x
    assert root != root


@kernel
def adding(state, n):
    for _ in range(n):
        state = state + 1.0
    return state


def test_an_integer_is_another_type_and_the_plain_function_stays():
    assert adding(1.0, 3) == adding.plain(1.0, 3) == 4.0
    assert adding.__name__ == "adding"


def test_a_user_kernel_depends_on_what_is_registered_outside_and_on_what_that_imports(monkeypatch):
    """Whatever else of the package this process has imported makes no kernel stale."""
    # What other tests of this process have registered is no part of the question.
    monkeypatch.setattr(cache, "parts", {})
    monkeypatch.setattr(cache, "foreign_laws", [])
    monkeypatch.setattr(cache, "foreign_files", set())

    def stamp_with(module):
        registered = type("Registered", (), {"__module__": module})
        with monkeypatch.context() as patch:
            patch.setitem(cache.parts, registered, None)
            return stamp_of(adding.plain, ())

    known = stamp_of(adding.plain, ())
    assert stamp_with("palpate.cli") == known
    assert stamp_with(own_parts.__name__) != known


def test_a_kernel_of_files_that_changed_since_they_were_imported_is_not_kept(monkeypatch):
    """Its code in memory is the old one, and its files are new: an upgrade under a running process."""
    monkeypatch.setattr(cache, "parts", {})
    monkeypatch.setattr(cache, "foreign_laws", [])
    monkeypatch.setattr(cache, "foreign_files", set())
    assert stamp_of(adding.plain, ()) is not None
    monkeypatch.setattr(cache, "STARTED", 0.0)
    assert stamp_of(adding.plain, ()) is None


CALLEE = """
from palpate._jit import law

@law
def twice(x):
    return {factor} * x
"""

ENTRY = """
from palpate._jit import kernel
from palpate.callee import twice

@kernel
def entry(part, x):
    return twice(part.step(x))
"""

MINE = """
from typing import NamedTuple

from helper import more
from palpate._jit import part

@part
class Mine(NamedTuple):
    gain: float

    def step(self, x):
        return more(self.gain * x) + {offset}
"""

HELPER = """
from palpate._jit import law

@law
def more(x):
    return x + {more}
"""

MAIN = """
import sys

from mine import Mine
from palpate.entry import entry

assert "numba" not in sys.modules, "registering must not import Numba"
print(entry(Mine(3.0), 5.0), entry.from_cache)
"""

OWN = """
from palpate._jit import kernel

@kernel
def mine(x):
    return x + {number}

print(mine(1.0), mine.from_cache)
"""


class Workshop:
    """A copy of the bridge with a law and a kernel of its own, and a user's part outside it."""

    def __init__(self, folder):
        self.folder, self.package, self.user = folder, folder / "lib" / "palpate", folder / "user"
        self.package.mkdir(parents=True)
        self.user.mkdir()
        here = Path(palpate.__file__).parent
        (self.package / "__init__.py").write_text("")
        (self.package / "_jit").mkdir()
        for name in ("_vector.py", *(f"_jit/{file.name}" for file in (here / "_jit").glob("*.py"))):
            (self.package / name).write_text((here / name).read_text())
        compileall.compile_dir(self.package, quiet=1)  # of these files, which stay as they are
        (self.package / "entry.py").write_text(ENTRY)
        (self.user / "main.py").write_text(MAIN)
        self.write(factor=2.0, offset=0.0, more=0.0)

    def write(self, **numbers):
        files = {"factor": (self.package / "callee.py", CALLEE), "offset": (self.user / "mine.py", MINE)}
        files["more"] = (self.user / "helper.py", HELPER)
        for name, value in numbers.items():
            path, text = files[name]
            path.write_text(text.format(**{name: value}))

    def run(self, main="main.py"):
        return self.finished(self.started(main))

    def started(self, main="main.py"):
        return subprocess.Popen(
            [sys.executable, "-B", str(self.user / main)],
            env={"PYTHONPATH": str(self.package.parent), "PATH": ""},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def finished(self, process):
        printed, said = process.communicate(timeout=60)
        assert process.returncode == 0, said
        value, cached = printed.split()
        return float(value), cached == "True"


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    return Workshop(tmp_path_factory.mktemp("workshop"))


@pytest.mark.long
def test_of_processes_that_start_together_one_compiles(workshop):
    """And each lets the next one in, also one that lives on."""
    workshop.write(factor=3.0, offset=0.0, more=0.0)
    (workshop.user / "staying.py").write_text(MAIN + "sys.stdout.flush()\nsys.stdin.read()\n")
    together = [workshop.started("staying.py") for _ in range(3)]
    first = sorted(process.stdout.readline() for process in together)
    assert first == ["45.0 False\n", "45.0 True\n", "45.0 True\n"]
    for process in together:
        process.communicate()
        assert process.returncode == 0


def runs(workshop, *, factor, offset, more):
    """What a process of its own gives with these numbers in the files, and whether the kernel was cached."""
    workshop.write(factor=factor, offset=offset, more=more)
    return workshop.run()


LEAVING = """
import sys

from mine import Mine
from palpate._vector import Vec3
from palpate.entry import entry

try:
    entry.compiled(Vec3(1.0, 2.0, 3.0), 5.0)  # no part that has a step
except Exception as error:
    print("refused", flush=True)
    sys.stdin.read()
print(1.0, False)
"""


@pytest.mark.long
def test_who_fails_to_compile_keeps_nobody_waiting(workshop):
    (workshop.user / "leaving.py").write_text(LEAVING)
    failed = workshop.started("leaving.py")
    assert failed.stdout.readline() == "refused\n"
    assert runs(workshop, factor=5.0, offset=0.0, more=0.0) == (75.0, False)
    workshop.finished(failed)


def test_the_cache_is_used_and_never_stale(workshop):
    assert runs(workshop, factor=4.0, offset=0.0, more=0.0) == (60.0, False)
    # A callee in another file of the package; a law in another file of the user's; nothing.
    assert runs(workshop, factor=10.0, offset=0.0, more=0.0) == (150.0, False)
    assert runs(workshop, factor=10.0, offset=0.0, more=2.0) == (170.0, False)
    assert runs(workshop, factor=10.0, offset=0.0, more=2.0) == (170.0, True)


@pytest.mark.long
def test_a_part_that_changed_and_a_law_that_changed_back_are_compiled_anew(workshop):
    runs(workshop, factor=11.0, offset=0.0, more=2.0)
    assert runs(workshop, factor=11.0, offset=1.0, more=2.0) == (198.0, False)
    assert runs(workshop, factor=11.0, offset=1.0, more=0.0) == (176.0, False)


@pytest.mark.long
def test_a_user_kernel_goes_stale_with_its_own_file(workshop):
    for number, expected in ((1.0, (2.0, False)), (1.0, (2.0, True)), (5.0, (6.0, False))):
        (workshop.user / "own.py").write_text(OWN.format(number=number))
        assert workshop.run("own.py") == expected


FULL = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))
"""


@pytest.mark.long
def test_where_there_is_no_room_for_the_cache_every_process_compiles(workshop):
    (workshop.user / "full.py").write_text(FULL + OWN.format(number=7.0))
    for _ in range(2):
        assert workshop.run("full.py") == (8.0, False)


STRANGER = """
from palpate._vector import Vec3
from palpate.entry import entry

try:
    entry(Vec3(1.0, 2.0, 3.0), 5.0)
except Exception as error:
    assert "step" in str(error), error  # no part that has it: the cache was read, the compiler asked
print(1.0, False)
"""

SCRIPT = """
from typing import NamedTuple

from palpate._jit import part
from palpate.entry import entry

@part
class Here(NamedTuple):
    gain: float

    def step(self, x):
        return self.gain * x

print(entry(Here(3.0), 5.0), entry.from_cache)
"""


@pytest.mark.long
def test_the_cache_can_be_read_where_a_users_part_is_not(workshop):
    """What was compiled for a part of one project must not stand in the way of another."""
    workshop.run()
    (workshop.user / "mine.py").rename(workshop.user / "elsewhere.txt")
    try:
        (workshop.user / "stranger.py").write_text(STRANGER)
        assert workshop.run("stranger.py") == (1.0, False)
    finally:
        (workshop.user / "elsewhere.txt").rename(workshop.user / "mine.py")
    assert workshop.run()[1]


@pytest.mark.long
def test_a_part_of_a_script_leaves_nothing_in_the_cache(workshop):
    """It would be another class at each run, and the cache would grow for ever."""
    workshop.run()
    cache = workshop.package / "__pycache__"
    before = {path.name: path.stat().st_size for path in cache.iterdir()}
    (workshop.user / "script.py").write_text(SCRIPT)
    for _ in range(2):
        assert workshop.run("script.py")[1] is False
    assert {path.name: path.stat().st_size for path in cache.iterdir()} == before


@part
class Trace(NamedTuple):
    """A part with an array in it, beside parts of plain numbers only."""

    place: Mat3
    kept: np.ndarray

    def renewed(self, x):
        """With another array, each number of it greater by x."""
        greater = np.zeros(len(self.kept))
        for i in range(len(greater)):
            greater[i] = self.kept[i] + x
        return Trace(self.place, greater)


@kernel
def renewing(trace, n):
    for _ in range(n):
        trace = trace.renewed(1.0)
    return trace


@pytest.fixture
def allocations():
    """Numba's own account of its arrays, while a test runs."""
    from numba.core.runtime import _nrt_python, rtsys

    _nrt_python.memsys_enable_stats()
    yield rtsys.get_allocation_stats
    _nrt_python.memsys_disable_stats()


def test_arrays_in_parts_live_as_long_as_they_are_held_and_no_longer(allocations):
    """Numba counts references only where there are any; the count has to be right all the same."""
    trace = Trace(Mat3(ZERO3, ZERO3, ZERO3), np.arange(3.0))
    before = allocations()
    for _ in range(100):
        renewed = renewing(trace, 10)
    np.testing.assert_array_equal(renewed.kept, np.arange(3.0) + 10.0)
    np.testing.assert_array_equal(trace.kept, np.arange(3.0))
    del renewed
    after = allocations()
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free >= 1000


def test_a_stamp_follows_imports_in_the_file_of_a_companion(tmp_path):
    """A package beside palpate, as palpate_thesis is: what its files import of it counts."""
    package = tmp_path / "palpate_beside"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "loop.py").write_text("from palpate_beside.laws import law\n")
    (package / "laws.py").write_text("law = 1\n")
    before = cache.sources_stamp(package / "loop.py")
    (package / "laws.py").write_text("law = 2\n")
    assert cache.sources_stamp(package / "loop.py") != before


SPOILED = {
    "cut short": lambda data: data[: len(data) // 2],
    "empty": lambda data: b"",
    "a bit in the middle": lambda data: flipped(data, len(data) // 2),
    "the first byte": lambda data: flipped(data, 0),
    "the last byte": lambda data: flipped(data, len(data) - 1),
    "zeros": lambda data: bytes(len(data)),
}


def flipped(data, at):
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


@pytest.mark.parametrize(
    "how", [pytest.param(h, marks=pytest.mark.long if h != "zeros" else ()) for h in SPOILED]
)
def test_a_spoiled_cache_is_compiled_again_and_never_executed(workshop, how):
    """The index, and then the machine code that it names."""
    (workshop.user / "own.py").write_text(OWN.format(number=9.0))
    assert workshop.run("own.py")[0] == 10.0
    for ending in ("nbi", "nbc"):
        (file,) = (workshop.user / "__pycache__").glob(f"own.mine*.{ending}")
        file.write_bytes(SPOILED[how](file.read_bytes()))
        assert workshop.run("own.py") == (10.0, False)
        assert workshop.run("own.py") == (10.0, True)


def test_a_kernel_of_other_sources_is_not_taken_for_one_of_these(workshop):
    """A power cut between two writes leaves an index of the new sources and machine code of the old ones."""
    held = {}
    for number in (1.0, 2.0):
        (workshop.user / "own.py").write_text(OWN.format(number=number))
        assert workshop.run("own.py") == (number + 1.0, False)
        (file,) = (workshop.user / "__pycache__").glob("own.mine*.nbc")
        held[number] = file.read_bytes()
    file.write_bytes(held[1.0])
    assert workshop.run("own.py") == (3.0, False)
