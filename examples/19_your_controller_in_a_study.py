"""Your own controller and metric in a study: which law is better, on the same random surfaces?

`student.py` is in the same folder. A study's TOML file uses the same names, and `palpate study mine.toml --plugins`
finds the module beside that file. A study is data: code that it names runs only if you permit it.
"""

from student import Damped

from palpate.plugins import permit
from palpate.studies import comparisons, parse, plan_runs, run
from palpate.testing import controller_checks, outcomes

STUDY = """
title = "Damped push or PI, on random foam"
experiment = "foam-pi"
samples = 24                      # surfaces, drawn by Sobol's sequence
metrics = ["force_rms", "overshoot", "student:jerk"]
best = { least = "force_rms" }

[fixed]                           # the arm starts near the wall
run = { press = 2.0, duration = 6.0 }
robot.start = [0.462, 0.0, 0.0]
approach = { hold = 0.3, first = 0.467 }

[parameters]
"surface.stiffness" = { log = [1000.0, 20000.0], random = true, label = "stiffness [N/m]" }
"surface.damping" = { log = [40.0, 400.0], random = true, label = "damping [N s/m]" }

[parameters.law.cases]
damped = { controller = { kind = "student:Damped", ki = 5.0 } }
PI = { controller = { kind = "proportional-integral", ki = 5.0 } }
"""

permit("student:Damped", "student:jerk")

for check in outcomes(controller_checks(Damped())):
    print(f"{check.sentence:36} {check.failed or 'holds'}")

frame = run(STUDY, "a-study")  # tried before the first run; killed half-way, it goes on from there
for found in comparisons(frame, plan_runs(parse(STUDY, "study"))):
    best, other = found.entrants
    pair = found.behind[1]
    print(
        f"{found.metric:12} {best.name} is better than {other.name} on {100 * pair.lost:3.0f} % of {pair.surfaces} "
        f"surfaces; the median difference is {pair.median:.3g} ({pair.low:.3g} to {pair.high:.3g})"
    )
