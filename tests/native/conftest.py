"""Laws in C that several tests compile."""

import pytest

from palpate.force import load_arm
from palpate.force.gains import gains_for
from palpate.native.exporting import LawRequest, exported_law


@pytest.fixture(scope="session")
def gains(tmp_path_factory):
    path = tmp_path_factory.mktemp("gains") / "gains.toml"
    path.write_text(gains_for(load_arm("ur5e"), 20.0, limit=60.0).to_toml())
    return path


@pytest.fixture(scope="session")
def force(gains):
    return exported_law(LawRequest(gains=gains))


@pytest.fixture(scope="session")
def squares():
    return exported_law(LawRequest("recursive-least-squares", forgetting=0.99))
