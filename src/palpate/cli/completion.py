"""`palpate completion`: what makes a shell complete palpate's commands, options and files."""

from __future__ import annotations

from typing import Literal

from palpate.cli._program import program
from palpate.cli._terminal import print_lines

_MORE = {
    "bash": (),
    # What zsh loads from fpath becomes the completing function itself: it has to complete, not only to define how.
    "zsh": ("", '_cyclopts_palpate "$@"'),
    # In the place of a command stands no file.
    "fish": ("complete -c palpate -n __fish_use_subcommand -f",),
}
"""What a shell needs beside the script that is generated, lines at its end."""


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print what makes a shell complete commands, options and files.

    Once, then in each new shell:

    palpate completion bash > ~/.local/share/bash-completion/completions/palpate

    palpate completion zsh > ~/.zfunc/_palpate

    palpate completion fish > ~/.config/fish/completions/palpate.fish

    The folder has to be there; zsh looks into ~/.zfunc if fpath+=(~/.zfunc) stands before compinit in ~/.zshrc.

    Parameters
    ----------
    shell
        Which shell.
    """
    print_lines(program().generate_completion(prog_name="palpate", shell=shell).rstrip("\n"), *_MORE[shell])
    return 0
