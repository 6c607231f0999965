"""A state of nested NamedTuples as one flat vector, and back: what linear algebra needs of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from palpate.arrays import Array


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a tree with its path: ("plant.q.x", 0.1); the elements of arrays are leaves of their own."""
    for name, branch in _branches(tree):
        inside = f"{path}.{name}" if path else name
        if isinstance(branch, tuple | np.ndarray):
            yield from leaves(branch, inside)
        else:
            yield inside, float(branch)


def rebuilt(tree: Any, numbers: Iterator[float]) -> Any:
    """A tree of the same shape with other numbers, in the order of `leaves`; its arrays are new ones."""
    if isinstance(tree, np.ndarray):
        return np.array([next(numbers) for _ in range(tree.size)]).reshape(tree.shape)
    if not isinstance(tree, tuple):
        return next(numbers)
    parts = [rebuilt(branch, numbers) for _, branch in _branches(tree)]
    return tree._make(parts) if hasattr(tree, "_make") else tuple(parts)


def vector(tree: Any) -> Array:
    """The numbers of a tree in the order of `leaves`, shape (n,)."""
    numbers: list[float] = []
    _gather(tree, numbers)
    return np.array(numbers)


def _gather(tree: Any, numbers: list[float]) -> None:
    for branch in tree:
        if isinstance(branch, tuple):
            _gather(branch, numbers)
        elif isinstance(branch, np.ndarray):
            numbers.extend(branch.ravel().tolist())
        else:
            numbers.append(branch)


def _branches(tree: Any) -> list[tuple[str, Any]]:
    if isinstance(tree, np.ndarray):
        return [(str(i), number) for i, number in enumerate(tree.ravel())]
    return list(zip(getattr(tree, "_fields", map(str, range(len(tree)))), tree, strict=True))
