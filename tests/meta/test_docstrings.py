"""Everything public says what it is."""

import ast

# The methods of every part, told once in docs/architecture.md; and what a part remembers, told by its fields.
METHODS_OF_A_PART = {"start", "start_at", "step"}


def undocumented(tree):
    if ast.get_docstring(tree) is None:
        yield "module"
    yield from nameless(tree, "")


def nameless(node, owner):
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if child.name.startswith("_"):
            continue
        told = child.name in METHODS_OF_A_PART if owner else child.name.endswith("State")
        if not told and ast.get_docstring(child) is None and not is_overload(child):
            yield f"{owner}{child.name}"
        if isinstance(child, ast.ClassDef):
            yield from nameless(child, f"{child.name}.")


def is_overload(node):
    return any(
        "overload" in ast.unparse(decorator) or "setter" in ast.unparse(decorator)
        for decorator in node.decorator_list
    )


def test_every_public_name_has_a_docstring(sources):
    found = []
    for path, _, tree in sources:
        # The operators of vectors are named by the arithmetic that they are.
        names = [] if path.name == "_vector.py" else undocumented(tree)
        found += [f"{path}: {name}" for name in names]
    assert not found, "\n".join(found)
