"""Commands typed in this process: what they answer, how they refuse, and what their pages would fetch."""

import json
from html.parser import HTMLParser

from palpate.cli import main


def ask(capsys, *words):
    """Run a command with --json; the exit code and the object."""
    code = main([*map(str, words), "--json"])
    printed = capsys.readouterr()
    assert printed.err == ""
    return code, json.loads(printed.out)


def refused(capsys, *words):
    """Run a command that is refused; its one line on standard error."""
    assert main(list(map(str, words))) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("palpate: ")
    assert printed.err.count("\n") == 1
    return printed.err


class References(HTMLParser):
    """Whatever a page would fetch."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found += [v for k, v in attrs if k in {"src", "href", "srcset", "data", "action"}]
