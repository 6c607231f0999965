"""Shipped experiments, made short: the arm starts 1.5 mm before the wall and walks into it at once."""

import msgspec

from palpate.bench import load

PRESS, DURATION = 0.2, 1.5


def changed(struct, **tables):
    """An experiment with some keys of its tables replaced: ``changed(e, run={"press": 1.0})``."""
    replaced = {name: msgspec.structs.replace(getattr(struct, name), **keys) for name, keys in tables.items()}
    return msgspec.structs.replace(struct, **replaced)


def quick(name, **tables):
    """The experiment `name`, in contact after some 150 ms."""
    near = changed(
        load(name),
        run={"press": PRESS, "duration": DURATION},
        robot={"start": (0.4635, 0.0, 0.0)},
        approach={"hold": 0.05, "first": 0.470, "step": 0.002, "period": 0.1},
    )
    return changed(near, **tables)


def scaled(friction, factor):
    """The same friction of joints so many times as strong."""
    strengths = ("sigma0", "sigma1", "sigma2", "coulomb", "static")
    return friction._replace(**{name: factor * getattr(friction, name) for name in strengths})
