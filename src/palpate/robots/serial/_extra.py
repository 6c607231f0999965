"""MuJoCo, where it is installed, and its refusals in one line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from palpate.errors import InputError


def mujoco() -> Any:
    """The package.

    Raises:
        InputError: it is not installed.
    """
    try:
        import mujoco as found
    except ImportError:
        raise InputError(
            "reading MJCF and URDF, and MuJoCo's physics, need MuJoCo; install it with: pip install 'palpate[arms]'"
        ) from None
    return found


@contextmanager
def refusals(where: str) -> Iterator[None]:
    """Turns what MuJoCo raises into one line that names the file; its warnings are dropped, not filed."""
    package = mujoco()
    package.set_mju_user_warning(lambda _: None)
    try:
        yield
    except InputError:
        raise
    except (ValueError, TypeError, package.FatalError) as error:
        raise InputError(f"{where}: MuJoCo refuses it: {' '.join(str(error).split())}") from None
    finally:
        package.set_mju_user_warning(None)
