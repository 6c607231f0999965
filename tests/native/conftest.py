"""Laws in C that several tests compile."""

import pytest
from msgspec.structs import replace

from palpate.force import load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.native.exporting import exported_law


@pytest.fixture(scope="session")
def gains(tmp_path_factory):
    path = tmp_path_factory.mktemp("gains") / "gains.toml"
    path.write_text(gains_for(load_arm("ur5e"), 20.0, limit=60.0).to_toml())
    return path


@pytest.fixture(scope="session")
def force(gains):
    return exported_law(gains_file=gains)


@pytest.fixture(scope="session")
def slide(tmp_path_factory):
    path = tmp_path_factory.mktemp("gains") / "slide.toml"
    gains = gains_for(load_arm("ur5e"), 15.0, cap=4e4)
    path.write_text(replace(gains, slide=Slide(speed=0.03, mu_max=0.9)).to_toml())
    return exported_law("sliding-loop", path, into=(0.1, 0.0, -1.0))


@pytest.fixture(scope="session")
def squares():
    return exported_law("recursive-least-squares", forgetting=0.99)
