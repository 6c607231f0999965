"""From one log of an arm to its gains, a proof, a press, a scene and a law: no number is typed twice."""

import json

import numpy as np
import pytest

from palpate.cli import main


def ur_log(path):
    """A press of a UR on 5000 N/m and 50 N s/m, as its recorder writes it."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 14.0, 2e-3)
    corners = [-3, -3, 0, 3, 3, 1.5, 3, 1.8, 3, 2, -1, -3, -3, -3]
    depth = 1e-3 * np.interp(time, [*range(13), 14], corners)
    depth += np.where((time > 6) & (time < 10), 0.15e-3 * np.sin(6 * np.pi * time), 0.0)
    depth = np.convolve(np.pad(depth, 12, "edge"), np.ones(25) / 25, "valid")
    force = np.where(depth > 0, np.maximum(5000 * depth + 50 * np.gradient(depth, time), 0.0), 0.0)
    columns = {"timestamp": time}
    for i in range(6):
        columns[f"actual_TCP_force_{i}"] = (force if i == 2 else 0.0) + 0.15 * rng.standard_normal(len(time))
    for i, value in enumerate((0.4, 0.1, 0.3 - depth, 0.0, np.pi, 0.0)):
        columns[f"actual_TCP_pose_{i}"] = value + 2e-6 * rng.standard_normal(len(time))
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, header=" ".join(columns), comments="", fmt="%.7f")


@pytest.mark.long
def test_the_walk(capsys, elsewhere):
    ur_log("ur.csv")
    code = main(["identify", "ur.csv", "--json"])  # 1: behind the arm its stiffness is a bound
    assert code == 1
    (elsewhere / "found.json").write_text(capsys.readouterr().out)
    for words, wanted in (
        (("tune", "found.json", "--arm", "ur5e", "--force", "15N", "--out", "gains.toml"), "proved stable"),
        (("certify", "gains.toml", "--out", "certificate.json"), "certificate holds"),
        (("press", "found.json", "--arm", "ur5e", "--gains", "gains.toml", "--out", "press"), "15"),
        (
            ("export", "found.json", "--arm", "ur5e", "--to", "mjcf-spring", "--mass", "50g"),
            "without the arm's",
        ),
        (("export", "gains.toml", "--to", "c", "--out", "law"), "palpate_force"),
    ):
        assert main(list(words)) == 0, words
        assert wanted in capsys.readouterr().out
    summary = json.loads((elsewhere / "press" / "summary.json").read_text())
    exported = json.loads((elsewhere / "surface-to_spring.xml.json").read_text())
    assert f"{exported['parameters']['K']['value']:.4g}"[:3] in json.dumps(summary)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("none.json", "--arm", "ur5e", "--force", "5N"), "none.json"),
        (("found.json", "--arm", "ur5e", "--surface", "K=1", "--force", "5N"), "not both"),
        (("found.json", "--wire", "sim:127.0.0.1:1"), "is the surface of a simulated press"),
        (("found.json", "--arm", "ur5e", "--force", "5N"), "give the surface with --surface"),
    ],
)
def test_what_press_does_not_take_from_an_identification(capsys, elsewhere, words, said):
    (elsewhere / "found.json").write_text('{"K": 1}')
    assert main(["press", *words]) == 2
    printed = capsys.readouterr()
    assert said in printed.err
    assert printed.err.count("\n") == 1
