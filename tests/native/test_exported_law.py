"""A law in C is the law in Python, to the last bit; and a law that is changed is not."""

import argparse
import dataclasses
import importlib.util
import json
import math
import shutil
import subprocess
from pathlib import Path

import msgspec
import numpy as np
import pytest

from palpate._jit import kernel, law
from palpate._jit.elementary import exp, log
from palpate.cli import main
from palpate.native.exporting import exported_law
from palpate.native.replay import write_rows

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")


@needs_compiler
@pytest.mark.parametrize("name", ["force", "squares", pytest.param("slide", marks=pytest.mark.long)])
def test_no_tick_differs_in_a_bit(name, request):
    assert request.getfixturevalue(name).check(20_000) == (20_000, 0)


@needs_compiler
@pytest.mark.long
def test_no_tick_of_four_parameters_differs_in_a_bit():
    law = exported_law("recursive-least-squares", parameters=4, forgetting=0.98)
    assert law.check(100_000) == (100_000, 0)


@needs_compiler
def test_a_law_that_differs_by_one_operator_fails_the_check(squares):
    text = squares.sources.source
    changed = text.replace("double a = r + ", "double a = r - ")
    assert changed != text
    other = dataclasses.replace(squares, sources=dataclasses.replace(squares.sources, source=changed))
    assert other.check(4_000)[1] > 3_000


@needs_compiler
@pytest.mark.parametrize("name", ["squares", pytest.param("slide", marks=pytest.mark.long)])
def test_the_strictest_compiler_finds_nothing(name, request, tmp_path):
    exported = request.getfixturevalue(name)
    exported.write(tmp_path / "law", replace=False)
    own = exported.module.name
    subprocess.run(
        ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror",
         "-fsanitize=address,undefined", "-fno-sanitize-recover", "-I.", f"{own}.c", "test/replay.c", "-lm", "-o", "r"],
        cwd=tmp_path / "law", check=True,
    )  # fmt: skip
    write_rows(tmp_path / "rows", exported.recording.presses(8_000, 3))
    run = subprocess.run(
        [tmp_path / "law" / "r", tmp_path / "rows"], capture_output=True, text=True, check=False
    )
    assert (run.stdout, run.stderr) == ("ticks 8000 unequal 0\n", "")


@needs_compiler
@pytest.mark.skipif(shutil.which("cmake") is None, reason="there is no CMake")
def test_the_folder_builds_installs_and_passes_its_own_test(force, tmp_path):
    def run(*words):
        subprocess.run(words, cwd=tmp_path, check=True, capture_output=True)

    force.write(tmp_path / "law", replace=False)
    run("cmake", "-S", "law", "-B", "build", "-DCMAKE_INSTALL_PREFIX=there")
    run("cmake", "--build", "build")
    run("ctest", "--test-dir", "build")
    run("cmake", "--install", "build")
    (tmp_path / "use").mkdir()
    (tmp_path / "use" / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(use C CXX)\nfind_package(palpate_force REQUIRED)\n"
        "set(CMAKE_CXX_STANDARD 17)\nadd_executable(use use.cpp)\n"
        "target_link_libraries(use palpate_force::palpate_force)\n"
    )
    (tmp_path / "use" / "use.cpp").write_text(
        "#include <palpate_force.h>\n"
        "int main() {\n"
        "    const palpate_force_gains *gains = &palpate_force_default_gains;\n"
        "    palpate_force_state state;\n"
        "    palpate_force_init(gains, &state);\n"
        "    return palpate_force_update(gains, &state, 20.0, 0.0, 0.0, 0.0) > 0.0 ? 0 : 1;\n"
        "}\n"
    )
    run("cmake", "-S", "use", "-B", "used", f"-DCMAKE_PREFIX_PATH={tmp_path / 'there'}")
    run("cmake", "--build", "used")
    run("used/use")


@needs_compiler
def test_the_example_presses_with_the_desired_force(force, tmp_path):
    force.write(tmp_path / "law", replace=False)
    words = ["cc", "-std=c99", "-O2", "-I.", "example/press.c", "palpate_force.c", "-lm", "-o", "press"]
    subprocess.run(words, cwd=tmp_path / "law", check=True)
    lines = subprocess.run([tmp_path / "law" / "press"], capture_output=True, text=True, check=True).stdout
    *rows, last = lines.splitlines()
    assert all(abs(float(row.split()[2]) - 20.0) < 1.0 for row in rows[3:])
    assert "locked" in rows[-1]
    assert 3000.0 < float(last.split()[1]) < 6000.0


def test_a_certificate_of_a_press_says_nothing_of_a_slide(slide):
    assert "// law: " not in slide.sources.header
    assert "// gains: " in slide.sources.header


def test_the_state_has_four_kilobytes_at_most(force):
    assert 8 * force.sources.numbers <= 4096


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_code_has_35_kilobytes_at_most(compiler, force, tmp_path):
    if not (shutil.which(compiler) and shutil.which("size")):
        pytest.skip(f"there is no {compiler}, or no size")
    (tmp_path / "palpate_force.c").write_text(force.sources.source)
    (tmp_path / "palpate_force.h").write_text(force.sources.header)
    words = (
        f"{compiler} -std=c99 -O2 -ffp-contract=off -fno-asynchronous-unwind-tables -I. -c palpate_force.c"
    )
    subprocess.run(words.split(), cwd=tmp_path, check=True)
    sizes = subprocess.run(
        ["size", "palpate_force.o"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    assert int(sizes.stdout.split()[6]) < 35_000


def test_a_certificate_knows_the_header_of_its_gains(force, gains, tmp_path, capsys):
    from palpate.force import Certificate, load_gains
    from palpate.force.certificate import FORM

    header, proof = tmp_path / "palpate_force.h", tmp_path / "proof.json"
    header.write_text(force.sources.header)
    own = load_gains(gains)

    def answer(of):
        Certificate(FORM, of, ()).save(proof)
        code = main(["certify", str(header), "--check", str(proof)])
        return code, capsys.readouterr().err

    assert answer(own) == (1, ""), "it is of this law and these gains, and claims nothing"
    code, says = answer(msgspec.structs.replace(own, cap=0.9 * own.cap))
    assert (code, says.count("\n")) == (2, 1)
    assert "other gains" in says
    header.write_text(force.sources.header.replace(f"law: {own.law}", "law: cautious adaptive control 6"))
    assert "another law" in answer(own)[1]
    header.write_text("int main(void);")
    assert "no header" in answer(own)[1]


@pytest.mark.long
@needs_compiler
def test_the_command_writes_checks_and_answers(gains, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("palpate.native.exporting.ExportedLaw.check", lambda law: (7, 0))
    assert main(["export", str(gains), "--to", "c", "--out", "law", "--check", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["check"]["unequal"] == 0
    assert answer["state_bytes"] <= 4096
    assert main(["export", str(gains), "--to", "c", "--out", "law", "--replace"]) == 0
    assert (tmp_path / "law" / "palpate_force.c").is_file()
    monkeypatch.setattr("palpate.native.exporting.ExportedLaw.check", lambda law: (7, 1))
    assert main(["export", str(gains), "--to", "c", "--check"]) == 1


def refused(capsys, *words):
    assert main(["export", *words]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    return printed.err


def test_bad_input_is_one_line(gains, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = str(gains)
    assert "nothing to do" in refused(capsys, own, "--to", "c")
    assert "gains file of palpate tune" in refused(capsys, "--to", "c", "--out", "a").replace(
        "the file", "gains file"
    )
    assert "takes no gains" in refused(
        capsys, own, "--to", "c", "--law", "recursive-least-squares", "--out", "a"
    )
    assert "did you mean" in refused(capsys, own, "--to", "c", "--law", "force-lop", "--out", "a")
    assert "3 or 4" in refused(
        capsys, "--to", "c", "--law", "recursive-least-squares", "--parameters", "7", "--out", "a"
    )
    older = tmp_path / "older.toml"
    older.write_text(gains.read_text().replace("adaptive control", "adaptive control of old"))
    assert "tune again" in refused(capsys, str(older), "--to", "c", "--out", "a")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("mine")
    assert "exists" in refused(capsys, own, "--to", "c", "--out", "mine")
    assert "thesis.tex" in refused(capsys, own, "--to", "c", "--out", "mine", "--replace")
    (tmp_path / "file").write_text("mine")
    assert "file: File exists" in refused(capsys, own, "--to", "c", "--out", "file/law")
    monkeypatch.setenv("CC", "no-such-compiler")
    assert "install gcc or clang" in refused(capsys, own, "--to", "c", "--check")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "mine", "older.toml"]


def equality():
    """The benchmark that asks every compiler."""
    path = Path(__file__).parents[2] / "benchmarks" / "native" / "equality.py"
    spec = importlib.util.spec_from_file_location("equality", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("compiler", "name"),
    [("clang", "slide"), ("aarch64-linux-gnu-gcc", "slide"), ("arm-none-eabi-gcc, Cortex-M7", "force")],
)
def test_no_tick_differs_by_other_compilers_and_processors(compiler, name, request, tmp_path):
    """The sliding loop has the laws of the press in it; all pairs are those of the benchmark, and of its figure."""
    bench, law = equality(), request.getfixturevalue(name)
    given = argparse.Namespace(ticks=2000, emulated=2000, m7=2000)
    builds = [build for build in bench.builds(given) if build[0] == compiler]
    if not builds:
        pytest.skip(f"there is no {compiler}, or no emulator for it")
    bench.write_sources(law, tmp_path)
    for _, _, build, run, ticks in builds[-1:]:
        measured = bench.Bench(tmp_path / "out", tmp_path)
        assert measured.unequal(build, run, law, ticks, 1) == [2000, 0]


@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("grows", "test_exported_law.py:"),
        ("joins", "a law, or abs"),
        ("raises_to", "** 0.5 for a root"),
        ("prints_into", "a number or a truth"),
        ("walks_over", "count with range"),
        ("names_an_argument", "all its arguments in order"),
        ("writes_on_the_way", "alone in a statement"),
        ("adds_a_text", "no type that Numba infers"),
        ("goes_on", "continue has no C"),
    ],
)
def test_a_law_outside_the_subset_is_refused_with_file_line_and_remedy(function, says):
    from numba import types

    from palpate.native.source import OutsideSubset
    from palpate.native.translation import Translation

    with pytest.raises(OutsideSubset, match=r"test_exported_law\.py:\d+: ") as refusal:
        Translation("palpate_test").function(globals()[function], (types.float64,))
    assert says in str(refusal.value)
    assert "\n" not in str(refusal.value)


@law
def grows(x):
    """A law with a list."""
    values = [x, x]
    return values[0]


@law
def joins(x):
    """A law with a function that compilers compute differently."""
    return np.tan(x)


@law
def raises_to(x):
    """A law with a general power."""
    return x**1.7


@law
def prints_into(x):
    """A law with a text."""
    unit = "N"
    return x if len(unit) > 0 else 0.0


@law
def walks_over(x):
    """A law with a loop over a tuple."""
    total = 0.0
    for y in (x, x):
        total += y
    return total


@law
def product(x, y=2.0):
    """A law with a default."""
    return x * y


@law
def names_an_argument(x):
    """A law that names an argument of another."""
    return product(x, y=3.0)


@law
def puts(a, x):
    """A law that writes to an array."""
    a[0] = x
    return x


@law
def writes_on_the_way(x):
    """A law with a call that writes, in an expression that reads: C has no order of the two."""
    a = np.zeros(2)
    b = a
    return puts(b, x) + a[0]


@law
def adds_a_text(x):
    """A law that Numba refuses."""
    return x + "N"


@law
def goes_on(x):
    """A law with a statement that the subset has not."""
    for _ in range(3):
        if x > 1.0:
            continue
        x = x + 1.0
    return x


@needs_compiler
def test_the_operators_of_python_are_those_of_c(tmp_path):
    """Remainder, quotient and extremes of Python by numbers of either sign, zeros and numbers that are none."""
    from palpate.native.translation import OPERATORS

    values = [0.0, -0.0, 1.0, -1.0, 2.5, -7.5, 1e300, -1e-300, 3.0, 0.1, 0.3, 21.0]
    values += [2.0**52 + 1.0, 2.0**53, 1e15]
    values += [1.0 - 2.0**-53, 7.0 * (1.0 + 2.0**-52), float("inf"), float("-inf"), float("nan")]
    compiled = {"modulo": remainder, "floored": quotient, "larger": larger, "smaller": smaller}
    cases = [(name, a, b) for name in compiled for a in values for b in values]
    calls = "".join(f'    printf("%a\\n", {name}({spelled(a)}, {spelled(b)}));\n' for name, a, b in cases)
    functions = "".join(
        (OPERATORS.get((name, "double")) or OPERATORS[name, "TYPE"]).replace("TYPE", "double") + "\n"
        for name in compiled
    )
    headers = "#include <math.h>\n#include <stdint.h>\n#include <stdio.h>\n"
    text = f"{headers}{functions}int main(void) {{\n{calls}    return 0;\n}}\n"
    (tmp_path / "operators.c").write_text(text)
    words = ["cc", "-std=c99", "-ffp-contract=off", "operators.c", "-lm", "-o", "operators"]
    subprocess.run(words, cwd=tmp_path, check=True)
    lines = subprocess.run(
        [tmp_path / "operators"], capture_output=True, text=True, check=True
    ).stdout.split()
    for (name, a, b), line in zip(cases, lines, strict=True):
        ours, theirs = compiled[name](a, b), float("nan") if "nan" in line else float.fromhex(line)
        assert ours.hex() == theirs.hex() or (ours != ours and theirs != theirs), (name, a, b)


@needs_compiler
def test_the_quotients_of_whole_numbers_are_those_of_c(tmp_path):
    """Remainder and quotient of Python by whole numbers of either sign."""
    from palpate.native.translation import OPERATORS

    cases = [(a, b) for a in range(-7, 8) for b in (-7, -3, -2, -1, 1, 2, 3, 7)]
    functions = "\n".join(OPERATORS[name, "int64_t"] for name in ("modulo", "floored"))
    calls = "".join(
        f"    if (modulo({a}, {b}) != {a % b} || floored({a}, {b}) != {a // b}) return 1;\n" for a, b in cases
    )
    text = f"#include <stdint.h>\n{functions}\nint main(void) {{\n{calls}    return 0;\n}}\n"
    (tmp_path / "whole.c").write_text(text)
    subprocess.run(["cc", "-std=c99", "whole.c", "-o", "whole"], cwd=tmp_path, check=True)
    subprocess.run([tmp_path / "whole"], check=True)


def spelled(x):
    return "NAN" if x != x else ("-" if x < 0.0 else "") + "INFINITY" if abs(x) == float("inf") else repr(x)


@kernel
def remainder(a, b):
    return a % b


@kernel
def quotient(a, b):
    return a // b


@kernel
def larger(a, b):
    return max(a, b)


@kernel
def smaller(a, b):
    return min(a, b)


@pytest.mark.parametrize("span", [1.0, 700.0, 745.0])
def test_the_exponential_of_both_languages_is_right_to_a_unit_in_the_last_place(span):
    for x in np.linspace(-span, min(span, 709.78), 4001).tolist():
        assert abs(exp(x) - math.exp(x)) <= math.ulp(math.exp(x)), x
    assert (exp(0.0), exp(-math.inf), exp(math.inf), exp(709.79)) == (1.0, 0.0, math.inf, math.inf)
    assert math.isnan(exp(math.nan))


def test_the_logarithm_of_both_languages_is_right_to_a_unit_in_the_last_place():
    numbers = np.concatenate([10.0 ** np.linspace(-320.0, 308.0, 4001), 1.0 + np.linspace(-0.3, 0.5, 4001)])
    for x in numbers.tolist():
        assert abs(log(x) - math.log(x)) <= math.ulp(math.log(x)), x
    assert log(0.0) == -math.inf
    assert log(math.inf) == math.inf
    assert log(1.0) == 0.0
    assert math.isnan(log(-1.0))
    assert math.isnan(log(math.nan))
