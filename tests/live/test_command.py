"""`palpate live`: its first line is its address, and what is wrong is a line and exit code 2."""

import re
from contextlib import contextmanager

import pytest

from cli import asked
from live.conftest import Stream, headless
from palpate import cli

ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/[\w-]{24}/")


def refused(capsys, *words):
    return asked.refused(capsys, "live", *words)


@contextmanager
def running(*words, lines=1):
    """The program, until the block ends; its first lines."""
    with headless.running(*words, lines=lines) as (process, said):
        yield said
    assert process.returncode == 130, process.said
    assert "Traceback" not in process.said[1]


@pytest.mark.long
def test_a_shared_page_has_an_address_that_steers_and_one_that_watches():
    """The audience's address is in the second line; the first works on this machine alone."""
    with running("--share", lines=2) as (address, second):
        assert ADDRESS.fullmatch(address)
        audience = second.removeprefix("audience, only watches: ")
        assert re.fullmatch(r"http://(?!127)[\d.]+:\d+/[\w-]{24}/", audience)
        watching = Stream(audience).until(lambda c: len(c.rows) > 20)
        watching.ask("pause", on=True)
        watching.until(lambda c: "refused" in c.kinds)
        host = Stream(address).until(lambda c: c.state and c.state["playing"])
        host.ask("pause", on=True)
        watching.until(lambda c: not c.state["playing"])
        watching.close()
        host.close()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--run", "foam-hybird"], "did you mean 'foam-hybrid'"),
        (["--arm", "fr3", "--run", "foam-hybrid"], "--run and --arm exclude each other"),
        (["--arm", "fr33"], "did you mean 'fr3'"),
        (["--arm", "absent.toml"], "absent.toml"),
        (["--arm", "fr3", "--whole-approach"], "--whole-approach is for an experiment"),
        (["--arm", "fr3", "--plugins"], "--plugins is for an experiment"),
        (["--port", "-1"], "--port must be from 0 to 65535"),
        (["--port", "many"], "port"),
        (["--seed", "-1"], "seed"),
    ],
)
def test_what_is_wrong_is_a_line(capsys, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    assert told in refused(capsys, *words)


def test_a_missing_library_is_named_with_its_remedy(monkeypatch, capsys):
    monkeypatch.setattr("palpate.cli.live.find_spec", lambda name: None)
    assert cli.main(["live"]) == 2
    assert capsys.readouterr().err.endswith(
        "websockets and segno: pip install '.[live]' in palpate's sources\n"
    )
