"""The stiffness of a surface at every place, from presses at some: the names of the distribution palpate-maps."""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    if name[:2] == "__":
        raise AttributeError(name)
    try:
        return getattr(import_module("palpate_maps"), name)
    except ModuleNotFoundError:
        raise ImportError(
            "palpate.maps is of palpate-maps, which is not installed: pip install palpate[maps]"
        ) from None
