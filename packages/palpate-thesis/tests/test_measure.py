"""Measuring the thesis: what is done stays done, what is wrong is one line, and no claim is forgotten."""

import json
import os
import re
import signal
import subprocess
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import palpate_thesis
from frozen import kept
from palpate.bench import load, with_values
from palpate.cli import main
from palpate.errors import InputError
from palpate.report.page import Table
from palpate_thesis.claims import VERDICTS, ThesisClaim, claim, figures, rows, spread, texts, verdict_of
from palpate_thesis.figure import studies, study
from palpate_thesis.measure import STATE, MeasurementFormat, chapter_of, measure
from palpate_thesis.runs import Runs

FIELDS = ["id", "source", "claim", "thesis", "measured", "tolerance", "verdict", "note", "of"]
CLAIMS = (
    "anti-alias-spectra", "anti-alias-components", "switch-at-5N", "force-noise",
    "least-squares-foam-settles", "least-squares-foam-level", "least-squares-raw-signals",
    "least-squares-rubber-settles", "least-squares-rubber-level", "network-learning-rate", "network-foam",
    "network-rubber", "hybrid-alone-falls-short", "neural-foam-steps", "neural-foam-sine",
    "neural-slow-rate", "neural-free-directions", "neural-rubber-steps", "neural-rubber-sine",
)  # fmt: skip
"""Every claim of the thesis that has a row."""
SEEDS = range(10)


def toy(number: str, done: list[str], fails: type[BaseException] | None = None) -> SimpleNamespace:
    """A study that says in `done` that it ran."""

    def run(runs: Runs) -> float:
        done.append(number)
        if fails is not None:
            raise fails
        return float(len(runs.seeds))

    def check(data: float) -> list[ThesisClaim]:
        return [
            ThesisClaim(
                f"T{number.replace('.', '-')}",
                "here",
                "<it> holds & is told",
                "1",
                f"{data}",
                "any",
                verdict_of(number, data > 0),
                "a note",
            )
        ]

    def plot(_: float):
        from palpate.report import style

        drawing, (axis,) = style.figure(1)
        axis.plot([0.0, 1.0], [0.0, 1.0])
        return drawing

    return SimpleNamespace(NUMBER=number, run=run, check=check, plot=plot)


def measured(numbers: list, folder: Path, **options):
    options = {"written": MeasurementFormat(options.pop("command", "palpate thesis")), **options}
    return measure(numbers, Runs(options.pop("seeds", SEEDS)), folder, **options)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def one_line(ran: subprocess.CompletedProcess) -> str:
    assert ran.returncode == 2, ran.stderr
    assert ran.stderr.startswith("palpate: ")
    assert ran.stderr.count("\n") == 1
    assert "Traceback" not in ran.stderr
    return ran.stderr


def test_a_measurement_is_claims_a_page_and_a_figure_each(tmp_path):
    folder = tmp_path / "runs" / "thesis"
    done = measured([toy("3.5", []), toy("3.7", [])], folder)
    assert [d.number for d in done] == ["3.5", "3.7"]
    assert names(folder) == {"claims.json", "index.html", STATE, "3.5.png", "3.7.png"}
    claims = json.loads((folder / "claims.json").read_text("utf-8"))
    assert [list(claim) for claim in claims] == [FIELDS, FIELDS]
    assert [claim["id"] for claim in claims] == ["T3-5", "T3-7"]
    assert {claim["verdict"] for claim in claims} <= set(VERDICTS)
    page = (folder / "index.html").read_text("utf-8")
    assert "&lt;it&gt; holds &amp; is told" in page
    assert page.count("data:image/png;base64,") == 2
    assert "://" not in re.sub(r"http://www\.w3\.org\S*|https://github\.com/leeoniya/uPlot", "", page), (
        "the page opens without a network"
    )


def test_the_page_names_the_laboratory_and_has_the_tables_of_a_figure(tmp_path):
    study = toy("4.5", [])
    study.check = lambda data: []
    study.tables = lambda data: [Table("side by side", ("method", "K"), [["squares", "1 (0 to 2, 3 seeds)"]])]
    written = MeasurementFormat("palpate thesis 4.5", "mine")
    done = measured([study], tmp_path / "t", written=written)
    page = (tmp_path / "t" / "index.html").read_text("utf-8")
    assert "Laboratory: <b>mine</b>" in page
    assert "<td>1 (0 to 2, 3 seeds)</td>" in page
    state = json.loads((tmp_path / "t" / STATE).read_text("utf-8"))
    assert state["done"]["4.5"]["tables"][0]["rows"] == [["squares", "1 (0 to 2, 3 seeds)"]]
    assert done[0].claims == []


def test_there_is_one_count_of_claims(tmp_path, capsys):
    """The page's sentence, its buttons and its articles, claims.json and the terminal."""
    assert main(["thesis", "3.7", "--out", str(tmp_path / "t")]) == 0
    told = capsys.readouterr().out
    claims = json.loads((tmp_path / "t" / "claims.json").read_text("utf-8"))
    good = sum(claim["verdict"] == "reproduced" for claim in claims)
    page = (tmp_path / "t" / "index.html").read_text("utf-8")
    assert (
        f"{len(claims)} sentences about the set-up and the schemes that it cites: {good} reproduced" in told
    )
    assert (
        f"{len(claims)} sentences about the set-up and the schemes that it cites: {good} reproduced" in page
    )
    assert f"Verdicts of all claims: {len(claims)}" in page
    assert page.count('<article class="claim"') == len(claims)
    for row in claims:
        assert f'id="{row["id"]}"' in page


@pytest.mark.parametrize(
    ("number", "chapter"),
    [("3.7", "The bench"), ("6.9", "Neural identifier"), ("6.10", "Force control"), ("7.1", "Conclusions"),
     ("why-negative-mass", "Explanations")],
)  # fmt: skip
def test_figures_stand_in_their_chapters(number, chapter):
    assert chapter_of(number) == chapter


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_what_is_done_is_kept_and_not_done_again(tmp_path, error):
    folder, done = tmp_path / "thesis", []
    with pytest.raises(error):
        measured([toy("3.5", done), toy("3.7", done, error), toy("4.2", done)], folder)
    assert done == ["3.5", "3.7"]
    assert [c["id"] for c in json.loads((folder / "claims.json").read_text())] == ["T3-5"]
    assert "Unfinished" in (folder / "index.html").read_text("utf-8")
    measured([toy("3.5", done), toy("3.7", done), toy("4.2", done)], folder)
    assert done == ["3.5", "3.7", "3.7", "4.2"]
    assert "Unfinished" not in (folder / "index.html").read_text("utf-8")
    assert len(json.loads((folder / "claims.json").read_text())) == 3


def test_other_seeds_or_figures_are_another_measurement(tmp_path):
    folder, done = tmp_path / "thesis", []
    with pytest.raises(KeyboardInterrupt):
        measured([toy("3.5", done), toy("3.7", done, KeyboardInterrupt)], folder)
    before = (folder / "claims.json").read_bytes()
    with pytest.raises(InputError, match="--replace"):
        measured([toy("3.5", done), toy("3.7", done)], folder, seeds=range(12))
    with pytest.raises(InputError, match="--replace"):
        measured([toy("3.5", done)], folder)
    assert (folder / "claims.json").read_bytes() == before
    assert done == ["3.5", "3.7"]


def test_a_finished_measurement_is_replaced_only_when_asked(tmp_path):
    folder, done = tmp_path / "thesis", []
    measured([toy("3.5", done)], folder)
    with pytest.raises(InputError, match="--replace"):
        measured([toy("3.5", done)], folder)
    measured([toy("3.5", done)], folder, replace=True)
    assert done == ["3.5", "3.5"]


@pytest.mark.parametrize("replace", [False, True])
def test_a_folder_of_something_else_is_never_touched(tmp_path, replace):
    (tmp_path / "letters.txt").write_text("dear")
    done = []
    with pytest.raises(InputError, match="palpate did not write" if replace else "holds other files"):
        measured([toy("3.5", done)], tmp_path, replace=replace)
    assert names(tmp_path) == {"letters.txt"}
    assert not done


@pytest.mark.parametrize("content", ["", "{}", "[1, 2]", "\x00\xff"])
def test_a_broken_state_is_no_measurement(tmp_path, content):
    (tmp_path / STATE).write_text(content, encoding="latin-1")
    with pytest.raises(InputError, match="palpate did not write it"):
        measured([toy("3.5", [])], tmp_path)


@pytest.mark.parametrize(
    "rest", ["", ', "stamp": 3', ', "stamp": "s", "wanted": [], "command": "", "done": [1]']
)
def test_a_spoiled_state_is_no_measurement(tmp_path, rest):
    (tmp_path / STATE).write_text(f'{{"written_by": "palpate 0.1.0"{rest}}}')
    with pytest.raises(InputError, match="another --out"):
        measured([toy("3.5", [])], tmp_path)


def test_a_file_in_the_place_is_refused(tmp_path):
    (tmp_path / "thesis").touch()
    with pytest.raises(InputError, match="not a folder"):
        measured([toy("3.5", [])], tmp_path / "thesis")


@pytest.mark.parametrize(
    ("name", "said"), [("6.99", "6.9"), ("why-negativ-mass", "why-negative-mass"), ("x", "3.5")]
)
def test_an_unknown_figure_is_answered_with_the_nearest_and_a_list(program, tmp_path, name, said):
    line = one_line(program("thesis", name, "--out", tmp_path / "t"))
    assert said in line
    assert "there are: 3.5, 3.7, " in line
    assert not (tmp_path / "t").exists()


@pytest.mark.parametrize("seeds", ["9", "0", "-1", "many", "1001"])
def test_seeds_out_of_range_are_refused(program, tmp_path, seeds):
    line = one_line(program("thesis", "3.7", "--seeds", seeds, "--out", tmp_path / "t"))
    assert "seeds" in line.lower()


def test_the_list_has_a_line_for_every_study(program):
    ran = program("thesis", "--list")
    assert ran.returncode == 0
    listed = [line.split()[0] for line in ran.stdout.splitlines()]
    assert listed == [s.NUMBER for s in studies()]


def test_one_figure_is_measured_by_the_program(program, tmp_path):
    folder = tmp_path / "t"
    ran = program("thesis", "3.7", "--out", folder)
    assert ran.returncode == 0, ran.stderr
    assert names(folder) == {"claims.json", "index.html", STATE, "3.7.png"}
    assert "217 Hz" in ran.stdout
    assert "--replace" in one_line(program("thesis", "3.7", "--out", folder))


def test_figures_are_written_as_asked(program, tmp_path):
    told = program(
        "thesis", "3.7", "--out", tmp_path / "t", "--figures", "svg", "--figures", "pdf", "--dpi", "60"
    )
    assert told.returncode == 0
    assert {"3.7.png", "3.7.svg", "3.7.pdf"} <= names(tmp_path / "t")
    assert "png, svg, pdf" in one_line(program("thesis", "3.7", "--out", tmp_path / "u", "--figures", "bmp"))
    assert not (tmp_path / "u").exists()


def test_every_study_offers_what_the_protocol_asks_for():
    found = studies()
    assert len({s.NUMBER for s in found}) == len(found)
    for one in found:
        assert study(one.NUMBER) is one
        title, caption = texts(one.NUMBER)
        assert title
        assert "\n" not in title
        assert caption.endswith((".", ")"))
        assert all(callable(getattr(one, what)) for what in ("run", "check", "plot"))


def test_figures_come_in_the_thesis_order():
    numbers = [tuple(map(int, s.NUMBER.split("."))) for s in studies() if re.fullmatch(r"\d+\.\d+", s.NUMBER)]
    assert numbers == sorted(numbers)
    assert {(3, 5), (3, 7), (4, 2), (4, 4), *((6, i) for i in range(1, 18))} <= set(numbers)


def test_no_claim_of_the_thesis_is_left_out():
    """The table of texts has each claim, or its parts, and each of its rows was measured."""
    assert {row.partition(".")[0] for row in rows()} >= set(CLAIMS)
    assert set(rows()) == {name for claims in kept().values() for name in claims}
    assert set(figures()) == set(kept())


def test_a_text_is_filled_with_numbers_and_takes_what_it_lacks_from_another():
    first, other = (
        claim(f"least-squares-rubber-settles.{key}", key == "K", key=key, limit=0.05, half=0.005, surface="rubber",
              values=f"rubber {spread([1.0, 2.0], 's')}")
        for key in "KM"
    )  # fmt: skip
    assert first.measured == other.measured == "rubber 1.5 s (1 to 2, 2 seeds)"
    assert (first.verdict, other.verdict) == ("reproduced", "reproduced in a plausible laboratory")
    assert first.claim != other.claim
    assert first.tolerance.endswith("most seeds, rubber")
    with pytest.raises(KeyError, match="limit"):
        claim("least-squares-rubber-settles.K", True, key="K")


def test_a_spread_is_median_range_and_seeds():
    assert spread([1.0, 2.0, 4.0], "kg") == "2 kg (1 to 4, 3 seeds)"
    assert spread([1.0, float("nan"), 3.0]) == "2 (1 to 3, 3 seeds, 1 without a value)"
    assert spread([float("nan")] * 2) == "never (2 seeds)"


def test_runs_keep_the_order_of_their_cases_and_pass_errors_on():
    runs = Runs(SEEDS)
    assert runs.map(lambda x: x * x, list(range(20))) == [x * x for x in range(20)]
    assert runs.map(lambda x: x, []) == []
    with pytest.raises(ZeroDivisionError):
        runs.map(lambda x: 1 / (x - 5), list(range(10)))


@pytest.mark.long
def test_ctrl_c_stops_the_runs_of_all_threads():
    """Hours of simulated time are under way on other threads; they end within a look."""
    experiment = with_values(load("foam-hybrid"), {"run.press": 3000.0, "run.duration": 3600.0})
    runs = Runs()
    runs.record(with_values(experiment, {"run.press": 0.1}))  # compiles
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    before, begun = threading.active_count(), time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        runs.map(lambda seed: runs.record(experiment, seed), range(4))
    timer.join()
    assert time.monotonic() - begun < 20.0
    assert threading.active_count() <= before


def test_the_program_says_that_it_goes_on(tmp_path, capsys, monkeypatch):
    """After a Ctrl-C where what is done is, and at the next start how much of it there is."""
    done = []
    toys = [toy("3.5", done), toy("3.7", done, KeyboardInterrupt)]
    monkeypatch.setattr(palpate_thesis.figure, "studies", lambda: toys)
    assert main(["thesis", "--out", str(tmp_path / "t")]) == 130
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "are saved in" in told
    assert "the same command resumes" in told
    toys[1] = toy("3.7", done)
    assert main(["thesis", "--out", str(tmp_path / "t")]) == 0
    assert "1 of 2 are measured already" in " ".join(capsys.readouterr().out.split())
    assert done == ["3.5", "3.7", "3.7"]
