"""Marginal posterior of each unknown of the thesis' laboratory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.thesis.inference.sampler import Sample
from palpate.thesis.laboratory.unknowns import LAWS, LISTING, UNKNOWNS, Unknown

TOLD, HARDLY = 0.5, 0.8
"""The middle nine tenths of the posterior take at most this share of the prior's: told; hardly; beyond, not told."""
MIDDLE = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Marginal:
    """One unknown.

    Args:
        unknown: which.
        low, middle, high: its value at 5, 50 and 95 % of the posterior; of one of a few, the likeliest in `middle`.
        width: of the middle nine tenths, as a share of the prior's; of one of a few, the share of the likeliest.
    """

    unknown: Unknown
    low: float
    middle: float
    high: float
    width: float

    @property
    def verdict(self) -> str:
        """Whether the thesis determines it, in a word."""
        if self.unknown.prior == "any seed":
            return "not told"
        if self.unknown.choices:
            even = 1.0 / len(self.unknown.choices)
            gained = (self.width - even) / (1.0 - even)
            return "told" if gained >= 1.0 - 0.5 * TOLD else "hardly told" if gained >= TOLD else "not told"
        return "told" if self.width <= TOLD else "hardly told" if self.width <= HARDLY else "not told"

    def in_words(self) -> str:
        """Value and range, with its unit."""
        unit = f" {self.unknown.unit}".rstrip()
        if self.unknown.prior == "any seed":
            return "any"
        if self.unknown.choices:
            return f"{named(self.unknown, self.middle)}{unit} ({100 * self.width:.0f} %)"
        low, middle, high = (f"{float(f'{v:.3g}'):g}" for v in (self.low, self.middle, self.high))
        return f"{middle} ({low} to {high}){unit}"


def worth(sample: Sample) -> Array:
    """As many independent laboratories would know the mean of each unknown as well, shape (d,).

    The variance of a mean is estimated by families, the particles of one ancestor, which are taken to be independent of
    each other and of nothing else (Chan and Lai, 2013): many moves make relatives strangers, few do not.
    """
    away = sample.visited - sample.visited.mean(axis=0)
    families = np.array([away[sample.ancestors == one].sum(axis=0) for one in np.unique(sample.ancestors)])
    most, count = len(away), len(families)
    if count == 1:
        return np.ones(away.shape[1])
    between = (families**2).sum(axis=0) * count / (count - 1.0)
    within = (away**2).sum(axis=0)
    return np.clip(np.where(between > 0.0, most * within / np.maximum(between, 1e-300), most), 1.0, most)


def named(unknown: Unknown, value: float) -> str:
    """A value of one of a few in words."""
    if unknown.name == "foam_law":
        return LAWS[value]
    if unknown.name == "controller_weights":
        return "the listing's" if value == LISTING else f"seed {value:g}"
    return f"{value:g}"


def marginals(points: Array) -> list[Marginal]:
    """Of each unknown, from points of the posterior in shares of the prior, shape (n, d)."""
    return [_marginal(unknown, points[:, i]) for i, unknown in enumerate(UNKNOWNS)]


def _marginal(unknown: Unknown, shares: Array) -> Marginal:
    if unknown.choices:
        values, counts = np.unique([unknown.at(float(s)) for s in shares], return_counts=True)
        best = int(np.argmax(counts))
        value = float(values[best])
        return Marginal(unknown, value, value, value, float(counts[best] / len(shares)))
    low, middle, high = (float(q) for q in np.quantile(shares, MIDDLE))
    return Marginal(unknown, unknown.at(low), unknown.at(middle), unknown.at(high), (high - low) / 0.9)
