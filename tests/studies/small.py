"""Studies made small: in contact after some 150 ms, for 0.2 s; and a runner that needs no bench."""

import msgspec

from palpate.studies.journal import Row
from palpate.studies.plan import plan_runs
from palpate.studies.run_study import table
from palpate.studies.study import parse

NEAR = """
[fixed]
run = { press = 0.2, duration = 1.5 }
robot.start = [0.4635, 0.0, 0.0]
approach = { hold = 0.05, first = 0.470, step = 0.002, period = 0.1 }
"""

SMALL = f"""
title = "Small"
experiment = "foam-pi"
metrics = ["force_rms", "peak_force", "K_error_matched"]
seeds = 2
best = {{ least = "force_rms" }}
{NEAR}
[parameters]
"controller.ki" = {{ log = [1.0, 100.0], points = 3 }}
"surface.damping" = [60.0, 200.0]
"""


def text(parameters, *, head="", tail="", metrics='["force_rms"]', fixed=NEAR):
    """A study's file with these parameters, TOML lines."""
    top = f'title = "T"\nexperiment = "foam-pi"\nmetrics = {metrics}'
    return f"{top}\n{head}\n{fixed}\n{tail}\n[parameters]\n{parameters}\n"


def planned(source):
    """The plan of a study's file."""
    return plan_runs(parse(source, "T"))


def table_of(plan, formula, failing=lambda at: False):
    """The table of a plan whose runs' metrics are a formula of their parameters, or none where they fail."""
    rows = []
    for run in range(len(plan)):
        at = plan.setting(run).at
        bad = failing(at)
        values = (None,) * len(plan.study.metrics) if bad else formula(at)
        rows.append(Row(run, at, "lost contact" if bad else "done", "", values, 0.0))
    return table(plan, rows)


class Formula:
    """A runner whose metrics are a formula of the parameters: what is tested is what happens around the runs."""

    def __init__(self, formula, *, stops_after=None, backwards=False):
        self.formula, self.left, self.backwards = formula, stops_after, backwards
        self.ran = []

    def run(self, jobs):
        """Each job's row; KeyboardInterrupt after so many."""
        jobs = reversed(list(jobs)) if self.backwards else jobs
        for job in jobs:
            if self.left is not None and len(self.ran) == self.left:
                raise KeyboardInterrupt
            setting = job.setting
            self.ran.append(setting.run)
            values = tuple(self.formula(setting.at) for _ in job.metrics)
            yield Row(setting.run, setting.at, "done", "", values, 1.0 / (1 + setting.run))


def tables(path):
    """A TOML or JSON file's content."""
    return (msgspec.toml if path.suffix == ".toml" else msgspec.json).decode(path.read_bytes())
