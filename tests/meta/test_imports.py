"""The rooms, as the contract of `make lint` and docs/architecture.md have them."""

import ast
import re
import tomllib


def test_the_house_is_drawn_as_it_stands(root):
    """The drawing of the house, the contract of the imports and the folders name the same rooms, in the same order."""
    config = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    contract = config["tool"]["importlinter"]["contracts"][0]["layers"]
    layers = [set(re.findall(r"\w+", layer)) for layer in contract]
    text = (root / "docs" / "architecture.md").read_text(encoding="utf-8").split("## The house")[1]
    drawn = re.findall(r"(?m)^    ([\w|  ]*?\w)(?=  +|$)", text.split("Where does a file go?")[0])
    assert [set(re.findall(r"\w+", line)) for line in drawn] == layers
    package = root / "src" / "palpate"
    there = {p.stem for p in package.iterdir() if p.suffix == ".py" or (p / "__init__.py").exists()}
    assert set.union(*layers) == there - {"__init__", "__main__"}


def test_machine_code_is_called_through_the_typed_edge_alone(sources):
    for path, _, tree in sources:
        names = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        called = {
            node.func.attr
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        }
        if path.parent.name != "_jit":
            assert not names & {"entry_point", "overloads"}, path
            assert "compiled" not in called, path
