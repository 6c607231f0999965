"""Options that several commands have, or too many for a command's own file; a dataclass is a group of the help."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, dataclass_transform

from cyclopts import Group, Parameter

_Options = TypeVar("_Options")


@dataclass_transform(frozen_default=True, kw_only_default=True)
def options(group: str | Group, rank: int = 0) -> Callable[[type[_Options]], type[_Options]]:
    """Makes a class a frozen dataclass of keyword options, under a heading of the help.

    Args:
        group: the heading, or a group that several classes share.
        rank: of a new heading among those of a command.
    """
    heading = Group(group, sort_key=rank) if isinstance(group, str) else group
    return lambda cls: Parameter(name="*", group=heading)(dataclass(frozen=True, kw_only=True)(cls))
