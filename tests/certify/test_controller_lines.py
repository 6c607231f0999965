"""Lines of a terminal about other projects' controllers."""

from palpate.certify.controller_lines import answer_lines, span

AXIS = {"ranges": [(1.0, 2e3), (4e3, 1e7)], "proved": (2.0, 1.9e3), "reason": "", "overshoot": 0.31}
STILL = {"ranges": None, "proved": None, "reason": "gain 0", "overshoot": None}
ANSWER = {
    "controller": "fzi",
    "source": {"repository": "a/b", "commit": "0123456789abcdef", "file": "c.cpp"},
    "proved": {"stiffness": (2.0, 1.9e3)},
    "exact": {"stiffness": (1.0, 2e3), "ranges": [(1.0, 2e3), (4e3, 1e7)], "points_per_decade": 80},
    "controllers": [
        {
            "node": "n", "rate_hz": 500.0, "delay_s": 0.01, "interface": "position",
            "axes": {"x": AXIS, "y": AXIS, "z": STILL},
            "left_out": {"solver.iterations": 1}, "notes": ["a note"],
            "if_only_the_force_is_late": {"exact": [], "proved": None},
        }
    ],
    "passed_over": ["m: no force"],
    "unused": ["n.a.b", "n.a.c"],
    "corrected": {"n.solver.error_scale": 0.25},
    "not_modelled": "six axes",
}  # fmt: skip


def test_every_part_of_an_answer_is_said():
    text = "\n".join(answer_lines(ANSWER, None))
    for part in (
        "c.cpp of a/b, 0123456789ab", "Proved stable on surfaces of 2 N/m to 1.9 kN/m, in exact",
        "Not modelled: six axes",
        "  x, y: stable on 1 N/m to 2 kN/m and 4 kN/m to 10 MN/m; proved on 2 N/m to 1.9 kN/m; overshoot up to 31 %",
        "  z: gain 0", "only the force is late: stable on no surface", "solver.iterations 1", "Note: a note",
        "Passed over: m: no force", "does not use: n.a.(b, c)", "n.solver.error_scale 0.25 (--out FILE.yaml",
    ):  # fmt: skip
        assert part in text


def test_eigenvalues_alone_are_not_called_a_proof():
    none = {"proved": {"stiffness": None}, "corrected": None, "not_corrected_because": "of this"}
    text = "\n".join(answer_lines(ANSWER | none, None))
    assert "Not proved. Computed without a proof, by eigenvalues" in text
    assert "Proved" not in text
    assert "No corrected numbers: of this." in text
    assert span((0.5, 2.5e6)) == "0.5 N/m to 2.5 MN/m"
