"""From a log to numbers with verdicts: `palpate identify` from Python."""

from pathlib import Path

import palpate

log = Path(__file__).parent / "data" / "press.csv"
record = palpate.read_log(log, time="time_s", position="position_mm:mm", force="force_N")
found = palpate.identify(record)

point = found.working_point
if point is not None and point.stiffness.ci95 is not None:
    low, high = point.stiffness.ci95
    print(
        f"{low:.4g} ... {high:.4g} N/m at {point.force_N:.3g} N and {point.frequency_Hz:.2g} Hz, whatever the model"
    )
late = "unknown" if found.lag is None else f"{1e3 * found.lag.value:.1f} ± {1e3 * found.lag.bound:.1f} ms"
print(f"{found.model}, {len(found.contacts)} contact, force behind position by {late}")
for name, parameter in found.parameters.items():
    if parameter.value is None:
        print(f"{name}: {parameter.verdict}: {parameter.reason}")
    else:
        low, high = parameter.ci95
        print(
            f"{name} = {parameter.value:.4g} {parameter.unit}, 95 % {low:.4g} ... {high:.4g}: {parameter.verdict}"
        )
for warning in found.warnings:
    print(f"{warning.code}: {warning.text}")
