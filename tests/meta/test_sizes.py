"""No function is so long, or takes so much, that nobody reads it; unless a comment above it says why."""

import ast

LINES, ARGUMENTS = 60, 7
LONG, WIDE = "# More than sixty lines:", "# More than seven arguments:"


def functions(tree):
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def lines(function):
    """Lines of a function beside its docstring."""
    told = ast.get_docstring(function, clean=False)
    return function.end_lineno - function.lineno + 1 - (told.count("\n") + 1 if told else 0)


def arguments(function):
    names = [a.arg for a in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return len([name for name in names if name not in {"self", "cls"}])


def law(function):
    """A law takes what the equation of the book takes."""
    return any(ast.unparse(decorator) == "law" for decorator in function.decorator_list)


def reasons(lines, function):
    """The comments right above a function."""
    above = lines[: min([function.lineno, *(d.lineno for d in function.decorator_list)]) - 1]
    found = []
    while above and above[-1].strip().startswith("#"):
        found.append(above.pop().strip())
    return found


def unexplained(text, tree=None):
    written = text.splitlines()
    for function in functions(tree or ast.parse(text)):
        too_much = {
            LONG: lines(function) > LINES,
            WIDE: arguments(function) > ARGUMENTS and not law(function),
        }
        for begins, holds in too_much.items():
            if holds and not any(
                len(r) > len(begins) and r.startswith(begins) for r in reasons(written, function)
            ):
                yield f"{function.name}: {begins.strip('# :').lower()}; divide it, or write above it: {begins} why"


def test_a_function_is_short_and_takes_little_or_says_why(sources):
    found = [f"{path}: {one}" for path, text, tree in sources for one in unexplained(text, tree)]
    assert not found, "\n".join(found)


def test_what_is_too_long_or_too_wide_is_found():
    body = "\n".join(["    pass"] * 60)
    wide = "def f(a, b, c, d, e, f, g, *, h):\n    pass"
    assert not list(unexplained(f"def f(self, a, b, c, d, e, f, g):\n{body[:-9]}"))
    assert len(list(unexplained(f"def f():\n{body}"))) == 1
    assert len(list(unexplained(wide))) == 1
    assert not list(unexplained(f"# More than seven arguments: the equation has them.\n{wide}"))
    assert not list(unexplained(f"# More than seven arguments: the equation has them.\n@other\n{wide}"))
    assert not list(unexplained(f"@law\n{wide}"))
    assert len(list(unexplained(f"# More than seven arguments:\n{wide}"))) == 1
