"""The command line: reads arguments, prints, exits with a code; no arithmetic."""

import os
from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command of the program `palpate`.

    Args:
        argv: the words after the program's name; those of this process when None.

    Returns:
        The exit code: 0 done; 1 ran, and the answer is no; 2 the input is wrong; 130 interrupted.
        Codes of the edge: 70 for a defect in palpate itself, 141 when the reader of the output has gone.
    """
    from palpate.cli import _streams

    if argv is None:
        from palpate.files.reading import check_open_files

        if code := _streams.run_guarded(check_open_files):
            return code
        _streams.keep()
        _streams.prepare()
        os.environ.setdefault(
            "OPENBLAS_NUM_THREADS", "1"
        )  # the matrices are many and small: more threads only spin
        os.environ["MPLBACKEND"] = (
            "Agg"  # figures are files: a user's backend may need a screen, or not exist
        )
    _streams.forget_impossible_numbers()
    import sys

    from palpate.cli._program import EXPANDED, TYPED, program
    from palpate.files.reading import check_address_space

    TYPED.set(tuple(sys.argv[1:] if argv is None else argv))

    def run() -> int:
        words = list(TYPED.get())
        app = program(*words[:1])
        check_address_space()
        if any(word.startswith(("--options", "--preset")) for word in words):
            from palpate.cli.options.kept import expand

            words = expand(words, app)
        EXPANDED.set(tuple(words))
        return app(words)

    return _streams.run_guarded(run)
