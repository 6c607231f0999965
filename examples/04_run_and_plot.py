"""Run an experiment that comes with palpate, look at its numbers, and plot a column."""

from pathlib import Path

from matplotlib.figure import Figure

from palpate.bench import build, load, summarise

experiment = load("foam-hybrid")  # or the path of a TOML file of your own
record = build(experiment).run(experiment.run.duration, seed=1, press=experiment.run.press)
summary = summarise(record)

found, truth = summary["identified"], summary["truth"]
print(f"{len(record)} ticks, contact at {summary['contact_at_s']:.3f} s, {record.meta['end']}")
print(
    f"error in the last second {summary['force']['error_N']:+.3f} N of {summary['force']['desired_N']:.0f} N"
)
for name, std in found["matched_std"].items():
    value, unit = truth[name]["value"], truth[name]["unit"]
    print(f"{name} = {found['matched'][name]:.4g} +- {1.96 * std:.2g} {unit}, in truth {value:g}")

pressing = record["phase"] == 1.0
figure = Figure(figsize=(7, 3), layout="constrained")
axes = figure.subplots()
axes.plot(record["t"][pressing], record["force_measured"][pressing], lw=0.5, label="measured")
axes.plot(record["t"][pressing], record["force"][pressing], label="true")
axes.plot(record["t"][pressing], record["force_desired"][pressing], label="desired")
axes.set(xlabel=f"time [{record.units['t']}]", ylabel=f"force [{record.units['force']}]")
axes.legend()
figure.savefig("force.png")
print(f"plotted to {Path('force.png').resolve().name}")
