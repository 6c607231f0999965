"""The command line: reads arguments, prints, exits with a code; no arithmetic."""

import os
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command of the program `palpate`.

    Args:
        argv: the words after the program's name; those of this process when None.

    Returns:
        The exit code: 0 done; 1 ran, and the answer is no; 2 the input is wrong; 130 interrupted.
        Codes of the edge: 70 for a defect in palpate itself, 141 when the reader of the output has gone.
    """
    if argv is None:
        from palpate.cli import _streams

        _streams.keep()
        _streams.prepare()
        os.environ.setdefault(
            "OPENBLAS_NUM_THREADS", "1"
        )  # the matrices are many and small: more threads only spin
    import sys

    from palpate.cli._help import short_help
    from palpate.cli._program import COMMANDS, COMPANIONS, EXPANDED, TYPED, program
    from palpate.cli._streams import run_guarded
    from palpate.cli._terminal import print_lines
    from palpate.files.reading import check_address_space

    TYPED.set(tuple(sys.argv[1:] if argv is None else argv))

    def run() -> int:
        words = list(TYPED.get())
        app = program(*words[:1])
        check_address_space()
        if any(word.startswith(("--options", "--preset")) for word in words):
            from palpate.cli.options.kept import expand

            words = expand(words, app)
        if words[1:] == ["-h"] and words[0] in {*COMMANDS, *COMPANIONS}:
            print_lines(*short_help(app, words[0]))
            return 0
        EXPANDED.set(tuple(words))
        return app(words)

    return run_guarded(run)
