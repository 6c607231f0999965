"""`palpate completion`: a shell's completion script for palpate's commands, options and files."""

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
"""Lines at the end of the generated script, by shell."""


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a shell's completion script for commands, options and files.

    Run one of these once; each new shell loads it:

    palpate completion bash > ~/.local/share/bash-completion/completions/palpate

    palpate completion zsh > ~/.zfunc/_palpate

    palpate completion fish > ~/.config/fish/completions/palpate.fish

    The folder has to exist; zsh searches ~/.zfunc if fpath+=(~/.zfunc) comes before compinit in ~/.zshrc.

    Parameters
    ----------
    shell
        Which shell.
    """
    print_lines(program().generate_completion(prog_name="palpate", shell=shell).rstrip("\n"), *_MORE[shell])
    return 0
