"""The field's terms, and no private words, in the names of files and in public names."""

import ast
import re
from itertools import pairwise

PRIVATE = {
    "air": "free_motion", "beforehand": "prior", "bordered": "four",
    "checking": "consistency", "choosing": "selection", "doubt": "error_covariance",
    "doubts": "plausibility", "evenly": "sample_faults", "explaining": "error_messages",
    "front_ends": "matched_channels",
    "held_out": "cross_validation", "identifying": "identify", "judging": "candidate", "knob": "nonlinear parameter",
    "linearising": "linearise", "presenting": "summary", "preparing": "problem", "probing": "network", "pulled": "bias",
    "refreshes": "sample_clock", "regain": "contact_loss", "running": "run_...", "said": "notes",
    "sized": "any_size", "still": "equilibrium", "telling": "describe", "timebase": "sampling",
    "told": "described, notes",
    "trees": "flatten", "unbroken": "interrupts", "undone": "bias_correction",
    "watching": "replay, change_detection", "watchman": "stop condition",
    "worlds": "conditions",
}  # fmt: skip
"""A private word, and the field's for it (CONVENTIONS.md)."""
WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


def words(name):
    """The words of a name, and each two that stand together: ``front_ends`` is one term."""
    single = [word.lower() for word in WORDS.findall(name)]
    return {*single, *(f"{a}_{b}" for a, b in pairwise(single))}


def public_names(tree):
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node.name
            if isinstance(node, ast.ClassDef):
                yield from public_names(node)


def private(path, tree):
    """The private words in the names of a file: its own, and the public ones in it."""
    names = [path.stem, *public_names(tree)]
    return [f"{name}: say {PRIVATE[word]}" for name in names for word in sorted(words(name) & PRIVATE.keys())]


def test_names_are_those_of_the_field(sources):
    found = {path: names for path, _, tree in sources if (names := private(path, tree))}
    assert not found, "\n".join(f"{path}: {', '.join(names)}" for path, names in found.items())


def test_a_docstring_names_the_thing(sources):
    found = [
        f"{path}: {line.strip()}"
        for path, text, _ in sources
        for line in text.splitlines()
        if '"""What ' in line
    ]
    assert not found, "\n".join(found)


def test_a_private_word_is_found_in_whatever_it_stands():
    assert words("front_ends") >= {"front_ends", "front", "ends"}
    assert words("Watchman") & PRIVATE.keys()
    assert words("ContactTelling") & PRIVATE.keys()
    assert not words("distilled") & PRIVATE.keys()
