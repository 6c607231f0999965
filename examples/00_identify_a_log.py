"""From a log to numbers with verdicts: what `palpate identify` does, from Python."""

from pathlib import Path

import palpate

log = Path(__file__).parent / "data" / "press.csv"
record = palpate.read_log(log, time="time_s", position="position_mm:mm", force="force_N")
found = palpate.identify(record)

print(f"{found.model}, {len(found.contacts)} contact, force behind position by {1e3 * found.lag[0]:.1f} ms")
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
