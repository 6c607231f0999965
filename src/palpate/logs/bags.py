"""Bags of messages by topic: the reader is the distribution palpate-bags."""

from importlib import import_module
from typing import Any, TypeAlias

from palpate.errors import InputError

Bag: TypeAlias = Any
"""A `palpate_bags.Bag`, open within `with`."""
Topic: TypeAlias = Any
"""A `palpate_bags.Topic`."""


def bag_reader() -> Any:
    """The package `palpate_bags`: its `Bag`, `from_bag` and `leaves`.

    Raises:
        InputError: it is not installed.
    """
    try:
        return import_module("palpate_bags")
    except ModuleNotFoundError as error:
        if error.name != "palpate_bags":
            raise
        raise InputError(
            "bags are read by palpate-bags, which is not installed: pip install 'palpate[bags]'"
        ) from None
