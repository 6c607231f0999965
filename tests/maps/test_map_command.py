"""`palpate map`: tables and logs in, an answer, a page and files out; bad input in one line."""

import json
import shutil
from pathlib import Path

import numpy as np
import polars
import pytest
from matplotlib.colors import to_hex

from palpate.cli import main
from palpate.logs.tables.parquet import write_record
from palpate.maps.phantom import Phantom, PhantomLump, load_phantom
from palpate.maps.report import SHADES, scale
from palpate.records import Record
from report.test_look import ALL_GROUNDS, contrast

PRESS = Path(__file__).parents[2] / "examples" / "data" / "press.csv"
COLUMNS = ["--time", "time_s", "--position", "position_mm:mm", "--force-column", "force_N:N"]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "places.csv"
    rng = np.random.default_rng(2)
    places = np.vstack(
        [[[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]], rng.uniform(0.0, 60.0, (40, 2))]
    )
    value = 1.0 + 3.0 / (1.0 + np.exp((np.hypot(*(places - 30.0).T) - 14.0) / 2.0))
    value *= np.exp(0.02 * rng.normal(size=len(places)))
    rows = [f"{x:.3f},{y:.3f},{k:.5f},{0.04 * k:.5f}" for (x, y), k in zip(places, value, strict=True)]
    path.write_text("\n".join(["x_mm,y_mm,K_N/mm,half_N/mm", *rows]), encoding="utf-8")
    return path


def test_a_table_is_answered_with_lumps_and_next_presses(table, capsys):
    assert main(["map", "--table", str(table), "--stiffer-than", "2:kN/m", "--until", "10"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "One lump is stiffer than 2000 N/m" in text
    assert "more presses bring ± 10 %" in text
    assert "next press" in text


def test_a_lone_stiff_press_is_a_lump_or_an_outlier(table, tmp_path, capsys):
    """Never a sure lump and a contradicted press at once."""
    rows = table.read_text(encoding="utf-8").splitlines()
    rows[4] = "60,60,9,0.04"  # a corner, far from the lump
    path = tmp_path / "lone.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    words = ["map", "--table", str(path), "--stiffer-than", "2:kN/m"]
    assert main([*words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["disagreeing"] == ["row 4"]
    assert [(lump["is_sure"], lump["unless"]) for lump in answer["lumps"]] == [(False, "row 4"), (True, "")]
    assert main(words) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "or row 4 is an outlier: press there again" in text
    assert "contradict" not in text


@pytest.mark.parametrize("name", SHADES)
def test_both_ends_of_a_scale_stand_out_on_light_and_dark_pages(name):
    soft, stiff = (to_hex(scale(name)(fraction)) for fraction in (0.0, 1.0))
    assert min(contrast(stiff, ground) for ground in ALL_GROUNDS) >= 3.0  # WCAG 2.2, 1.4.11
    assert min(contrast(soft, ground) for ground in ALL_GROUNDS) >= 1.4


def test_json_has_the_contract(table, capsys):
    assert main(["map", "--table", str(table), "--json", "--next", "3"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {"x", "y", "stiffness", "half"} <= set(answer["places"][0])
    assert {"x", "y", "expected_half"} <= set(answer["next"][0])
    assert len(answer["next"]) == 3
    assert all(row["low"] < row["stiffness"] < row["high"] for row in answer["map"])
    assert answer["places"][0]["stiffness"] == pytest.approx(1000.0, rel=0.2)  # N/mm were converted


def test_files_are_written_and_a_page_holds_the_numbers(table, tmp_path, capsys):
    names = {"--report": "map.html", "--csv": "map.csv", "--figure": "map.png"}
    words = [word for option, name in names.items() for word in (option, str(tmp_path / name))]
    assert main(["map", "--table", str(table), "--stiffer-than", "2000", *words]) == 0
    capsys.readouterr()
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    assert "One lump is stiffer than 2000 N/m" in page
    assert "All presses" in page
    grid = polars.read_csv(tmp_path / "map.csv")
    assert (grid["low"] < grid["stiffness"]).all()
    assert main(["map", "--table", str(table), *words]) == 0  # its own files are replaced


def test_logs_of_presses_are_identified_and_placed(tmp_path, capsys):
    press = polars.read_csv(PRESS)
    for i, (x, y) in enumerate([(0.0, 0.0), (20.0, 0.0), (0.0, 20.0), (20.0, 20.0)]):
        press.with_columns(polars.lit(x).alias("x_mm"), polars.lit(y).alias("y_mm")).write_csv(
            tmp_path / f"{i}.csv"
        )
    words = [*COLUMNS, "--place", "x_mm:mm,y_mm:mm"]
    assert main(["map", str(tmp_path), *words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [(row["x"], row["y"]) for row in answer["places"]] == [(0, 0), (0.02, 0), (0, 0.02), (0.02, 0.02)]
    assert answer["places"][0]["stiffness"] == pytest.approx(5240.0, rel=0.02)


@pytest.mark.long
def test_each_contact_of_a_log_is_a_press_at_its_own_place(tmp_path, capsys):
    """The same press four times in one log, a place each."""
    press = polars.read_csv(PRESS)
    length = press["time_s"][-1] + 0.002
    parts = [
        press.with_columns(
            (polars.col("time_s") + k * length), polars.lit(x).alias("x_mm"), polars.lit(y).alias("y_mm")
        )
        for k, (x, y) in enumerate([(0.0, 0.0), (20.0, 0.0), (0.0, 20.0)])
    ]
    polars.concat(parts).write_csv(tmp_path / "all.csv")
    words = [*COLUMNS, "--place", "x_mm,y_mm"]
    assert main(["map", str(tmp_path / "all.csv"), *words, "--each-contact", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [(row["x"], row["y"]) for row in answer["places"]] == [(0.0, 0.0), (0.02, 0.0), (0.0, 0.02)]
    for row in answer["places"]:
        assert row["stiffness"] == pytest.approx(5240.0, rel=0.02)


def test_logs_without_a_place_are_refused_in_one_line(tmp_path, capsys):
    shutil.copy(PRESS, tmp_path / "a.csv")
    assert main(["map", str(tmp_path / "a.csv")]) == 2
    error = capsys.readouterr().err
    assert "no place" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("x,y,K\n0,0,1\n", (), "no column half"),
        ("x,y,K,half\n0,0,1000,10\n", (), "not in one line"),
        ("x,y,K,half\n0,0,1000,10\n1,0,,10\n", (), "row 2 has no stiffness"),
        ("x,y,K,half\n0,0,500,5\n0,0,5000,5\n1,0,500,5\n0,1,510,5\n", (), "at one place"),
        ("a,b\n1,2\n", ("--columns", "a,b"), "--columns needs"),
        ("x,y,K,half\n0,0,1000,10\n", ("--columns", "x:N,y,K,half"), "unit of force"),
        ("x,y,K,half\n0,0,1000,10\n", ("--stiffer-than", "soft"), "needs a number"),
        ("x,y,K,half\n0,0,1000,10\n", ("--place", "x,y"), "--columns"),
        ("x,y,K,half\n0,0,1000,10\n", ("--next", "-1"), "--next"),
        ("x,y,K,half\n0,0,1000,10\n", ("--rate", "500"), "are of logs"),
        ("x,y,K,half\n0,0,1000,10\n", ("--wrench-frame", "base"), "are of logs"),
        (
            "x,y,K,half,frame_id\n0,0,1000,10,base\n1,1,1000,10,camera\n",
            (),
            "row 2 (line 3) in 'camera'; a map has one frame",
        ),
        ("x,y,K,half\n0,0,1000,10\n", ("--each-contact",), "are of logs"),
        ("x,y,K,half\n0,0,1000,10\n", ("--stiffer-than", "-1"), "--stiffer-than must be above 0"),
    ],
)
def test_a_bad_table_or_option_is_one_line(tmp_path, capsys, text, words, said):
    path = tmp_path / "places.csv"
    grown = text + ("" if "1000,10" not in text or not words else "1,0,1000,10\n0,1,1000,10\n1,1,1000,10\n")
    path.write_text(grown, encoding="utf-8")
    assert main(["map", "--table", str(path), *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_neither_logs_nor_table_is_said(capsys):
    assert main(["map"]) == 2
    assert "--table" in capsys.readouterr().err


PHANTOM = """size = [0.04, 0.04]
stiffness = 1000
damping = 8
[[lumps]]
at = [0.02, 0.02]
radius = [0.01, 0.01]
stiffness = 4000
"""


def test_a_phantom_is_stiff_in_its_lump_and_soft_beside_it():
    phantom = Phantom((0.04, 0.04), 1e3, 8.0, (PhantomLump((0.02, 0.02), (0.01, 0.005), 4e3),))
    at = np.array([[0.02, 0.02], [0.0, 0.0], [0.02, 0.025]])
    assert phantom.stiffness_at(at) == pytest.approx([4e3, 1e3, 2e3], rel=1e-3)


def test_a_phantom_comes_with_palpate_by_its_name(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert load_phantom(Path("phantom")).lumps
    Path("phantom").write_text(PHANTOM, encoding="utf-8")
    assert len(load_phantom(Path("phantom")).lumps) == 1  # a file is the user's own


@pytest.mark.parametrize("line", ["stiffness = -5", "colour = 3", "size = [0.04]", "stiffness = inf"])
def test_a_bad_phantom_is_one_line(tmp_path, capsys, line):
    path = tmp_path / "phantom.toml"
    key = line.split(" =", maxsplit=1)[0]
    rest = [own for own in PHANTOM.splitlines() if not own.startswith(f"{key} =")]
    path.write_text("\n".join([line, *rest]), encoding="utf-8")
    words = ["press", "--arm", "ur5e", "--force", "5:N", "--map", str(path), "--out", str(tmp_path / "o")]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert str(path) in error
    assert error.count("\n") == 1
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("words", [("--page", "map.html"), ("--presses", "20"), ("--stiffer-than", "2000")])
def test_options_of_a_phantom_need_a_phantom(capsys, words):
    assert main(["press", "--arm", "ur5e", "--force", "5:N", *words]) == 2
    assert "--map is missing" in capsys.readouterr().err


@pytest.mark.long
def test_an_arm_maps_a_phantom(tmp_path, capsys):
    path = tmp_path / "phantom.toml"
    path.write_text(PHANTOM, encoding="utf-8")
    load_phantom(path)
    words = ["--force", "5:N", "--seconds", "3", "--presses", "19", "--stiffer-than", "2:kN/m"]
    words += ["--page", str(tmp_path / "live.html"), "--out", str(tmp_path / "o")]
    assert main(["press", "--arm", "ur5e", "--map", str(path), *words]) == 0
    capsys.readouterr()
    assert main(["map", "--table", str(tmp_path / "o" / "places.csv"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    live = (tmp_path / "live.html").read_text(encoding="utf-8")
    assert "19 presses" in live
    assert 'http-equiv="refresh"' not in live
    phantom = load_phantom(path)
    for row in answer["places"]:
        true = phantom.stiffness_at(np.array([[row["x"], row["y"]]]))[0]
        assert abs(row["stiffness"] - true) < 2.0 * row["half"] + 0.03 * true
    stiffest = max(answer["map"], key=lambda row: row["stiffness"])
    assert np.hypot(stiffest["x"] - 0.02, stiffest["y"] - 0.02) < 0.012


@pytest.mark.long
def test_a_column_of_lines_and_a_folder_of_presses_are_read(table, tmp_path, capsys):
    """Lines of a table share an error; records of presses state their places."""
    rows = table.read_text(encoding="utf-8").splitlines()
    lines = [f"{row},{i // 11}" for i, row in enumerate(rows[1:])]
    wide = tmp_path / "lines.csv"
    wide.write_text("\n".join([f"{rows[0]},line", *lines]), encoding="utf-8")
    assert main(["map", "--table", str(wide), "--next", "0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["line_half"] > 0.0
    press = polars.read_csv(PRESS)
    columns = {
        "t": press["time_s"].to_numpy(),
        "x_measured": 1e-3 * press["position_mm"].to_numpy(),
        "force_sampled": press["force_N"].to_numpy(),
    }
    units = {"t": "s", "x_measured": "m", "force_sampled": "N"}
    for i, at in enumerate([(0.0, 0.0, 0.1), (0.02, 0.0, 0.1), (0.0, 0.02, 0.1)]):
        (tmp_path / f"p{i}").mkdir()
        record = Record(columns, units, {"place_m": list(at), "arm": "one"})
        write_record(record, tmp_path / f"p{i}" / "record.parquet")
    folders = [str(tmp_path / f"p{i}") for i in range(3)]
    assert main(["map", *folders, "--next", "0", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    places = [(row["x"], row["y"], row["z"]) for row in answer["places"]]
    assert places == [(0.0, 0.0, 0.1), (0.02, 0.0, 0.1), (0.0, 0.02, 0.1)]


def test_folders_with_a_table_of_places_are_lines(table, tmp_path, capsys):
    """Results of slides and of `palpate press --map`; places of two and of three coordinates are of two frames."""
    rows = table.read_text(encoding="utf-8").splitlines(keepends=True)
    for name, part in (("one", rows[1:20]), ("two", rows[20:])):
        (tmp_path / name).mkdir()
        (tmp_path / name / "places.csv").write_text("".join([rows[0], *part]), encoding="utf-8")
    folders = [str(tmp_path / name) for name in ("one", "two", "space")]
    assert main(["map", *folders[:2], "--json", "--next", "0"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["places"]) == len(rows) - 1
    assert answer["line_half"] > 0.0
    (tmp_path / "space").mkdir()
    (tmp_path / "space" / "places.csv").write_text("x,y,z,K,half\n0,0,0,1000,10\n", encoding="utf-8")
    assert main(["map", *folders]) == 2
    assert "two coordinates and some three" in capsys.readouterr().err


def test_presses_that_scatter_more_than_they_state_are_asked_for_repeats(table, tmp_path, capsys):
    rows = table.read_text(encoding="utf-8").splitlines()
    vain = [f"{row.rsplit(',', 1)[0]},0.001" for row in rows[1:]]
    path = tmp_path / "vain.csv"
    path.write_text("\n".join([rows[0], *vain]), encoding="utf-8")
    assert main(["map", "--table", str(path), "--next", "0"]) == 0
    assert "no place was pressed twice" in capsys.readouterr().out
    path.write_text("\n".join([rows[0], *vain, vain[7]]), encoding="utf-8")
    assert main(["map", "--table", str(path), "--next", "0"]) == 0
    assert "no place was pressed twice" not in capsys.readouterr().out
