"""Groups of options that several commands have: names, files to write, figures, consent to run code."""

# No annotations from the future: cyclopts looks at those of a base class in the module of whoever inherits them.
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from palpate.cli._terminal import confirmed, console, print_lines
from palpate.cli.options.values import FLAG, options
from palpate.errors import InputError
from palpate.files import check_place, read_bytes
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.bench.toml_parts import TomlFiles


QUIET = Parameter(show_choices=False)
"""An option whose names are completed, and not listed in the help."""
MODELS = (
    "kelvin-voigt",
    "kelvin-voigt-mass",
    "standard-linear-solid",
    "hunt-crossley",
    "quasi-linear-viscoelastic",
)
"""Those of `palpate.identification.models`, which the help does not import."""


def _known_names(*names: str) -> Any:
    """One of these names, or another."""
    return Literal[names] | str


def shipped_names(*folders: str, package: Path = Path(__file__).parents[2]) -> Any:
    """One of the names of the TOML files in some folders of a package, or another."""
    files = [path for folder in folders for path in (package / folder).glob("*.toml")]
    return _known_names(*sorted(path.stem for path in files))


if TYPE_CHECKING:
    Controller = str
    Experiment = str
    LoopArm = str
    Model = str
    Mode = str
    Physics = str
    Preset = str
    SerialArm = str
else:
    Controller = _known_names("cautious", "hybrid", "proportional-integral", "impedance")
    Experiment = shipped_names("bench/experiments", "bench/presses")
    LoopArm = shipped_names("force/arms")
    Model = _known_names(*MODELS)
    Mode = _known_names("torque", "position")
    Physics = _known_names("own", "mujoco")
    Preset = shipped_names("logs/presets")
    SerialArm = shipped_names("robots/serial/arms")


@options("Known names", 2)
class KnownOptions:
    """List or print, without a run."""

    list_: Annotated[bool, FLAG, Parameter(name="--list")] = False
    "List the known names and stop."
    print_: Annotated[bool, FLAG, Parameter(name="--print")] = False
    "Print the named file, to copy and edit, and stop."


@options("Output", 3)
class FolderOptions:
    """The folder of results."""

    out: Path | None = None
    "Folder for results; when left out, one in runs/ with the name of the run."
    replace: Annotated[bool, FLAG] = False
    "Replace existing results."
    json: Annotated[bool, FLAG] = False
    "Print the summary as JSON and nothing else."


def print_names(files: "TomlFiles", title: Callable[[str], str]) -> None:
    """Print the names that come with palpate, each with its title."""
    width = 2 + max(map(len, files.names()))
    for name in files.names():
        print_lines(f"{name:<{width}}{title(name)}")


def read_source(files: "TomlFiles", name: str | None, verb: str, printed: bool) -> str | None:
    """The text of the named file; None if it was only printed.

    Raises:
        InputError: no name, or an unknown one.
    """
    if name is None:
        raise InputError(
            f"no {files.kind} is named; name one (palpate {verb} --list lists them) or a TOML file"
        )
    source = files.source(name)
    if not printed:
        return source
    sys.stdout.write(printable(source))
    return None


WRITTEN = Group("Output", sort_key=6)


@options(WRITTEN)
class JsonOption:
    """An answer for programs."""

    json: Annotated[bool, FLAG] = False
    "Print one JSON object and nothing else."


@options(WRITTEN)
class ReportOption:
    """A page with all results."""

    report: Path | None = None
    "Where to write a page with all results, an HTML file."

    def page(self) -> Path | None:
        """Path of the page, checked before any work is done."""
        if self.report is not None:
            check_place(self.report, "--report", ending=".html")
        return self.report


@options(WRITTEN)
class FileOptions(JsonOption):
    """A file of results."""

    out: Path | None = None
    "Where to write the result."
    replace: Annotated[bool, FLAG] = False
    "Replace the file at --out."

    def check_new(self, path: Path | None, option: str = "--out", ending: str = "") -> None:
        """Check a path before any work is done; an existing file is refused unless it is to be replaced.

        Raises:
            InputError: in one line.
        """
        if path is None:
            return
        check_place(path, option, ending=ending)
        if path.exists() and not self.replace:
            raise InputError(f"{path} exists; choose another place, or add --replace")


@options(WRITTEN)
class FigureFile(JsonOption):
    """A figure, and an answer for programs."""

    figure: Path | None = None
    json: Annotated[bool, FLAG] = False
    "Print one JSON object and nothing else."

    def picture(self, endings: tuple[str, ...] = (".png",)) -> Path | None:
        """Path of the figure, checked before any work is done; None where none is asked for."""
        if self.figure is not None:
            ending = self.figure.suffix.lower()
            check_place(self.figure, "--figure", ending=ending if ending in endings else endings[0])
        return self.figure


DRAWN = Group("Figures", sort_key=4)


@options(DRAWN)
class FigureOptions:
    """Formats and resolution of figures."""

    figures: Annotated[tuple[str, ...], Parameter(negative=(), consume_multiple=True)] = ()
    "Also write the charts as files: png, svg, pdf, one or more."
    dpi: int | None = None
    "Resolution of a PNG; 110 if not given."

    @property
    def endings(self) -> tuple[str, ...]:
        """Endings of the figures' files."""
        return tuple(f".{kind.lower().lstrip('.')}" for kind in self.figures)

    def check(self) -> None:
        """Check that the figures can be written, before any work is done."""
        from palpate.report.style import FORMATS, check_dpi

        check_dpi(self.dpi)
        for ending in self.endings:
            if ending not in FORMATS:
                raise InputError(
                    f"--figures must be of {', '.join(kind[1:] for kind in FORMATS)}, got {ending[1:]!r}"
                )


@options("Your own code", 2)
class PluginOptions:
    """Consent to run code."""

    plugins: Annotated[bool, FLAG] = False
    """Import and run the code that the file names, kind = "module:Class", with your rights. Without it, a
    question is asked at a terminal; elsewhere such a file is refused."""

    @property
    def words(self) -> str:
        """The option as it is typed behind a command, with a space; empty if it is not given."""
        return " --plugins" if self.plugins else ""

    @contextmanager
    def consent(self, given: str = "") -> Iterator[None]:
        """Within the block, names of code are imported if the user agrees.

        Args:
            given: a name on the command line itself, which is the user's own word.
        """
        from palpate.plugins import consent

        with consent(lambda name: self.plugins or name == given or _asked(name)):
            yield


def _asked(name: str) -> bool:
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    return confirmed(
        console(stderr=True), f"the file names code, {name}, which runs with your rights. Run it?"
    )


_LARGEST = 1 << 26
"""Largest size in bytes: the output for a thousand contacts is a hundredth of it."""


_DIGITS = 18
"""Digits of a whole number that surely fits into 64 bits: 10^18 < 2^63 < 10^19. A longer one is read as a float."""


def read_found(path: Path) -> dict[str, Any]:
    """The object in a file.

    Raises:
        InputError: it is too large, no JSON, or no object.
        OSError: no such file.
    """
    try:
        value = json.loads(read_bytes(path, _LARGEST, "the output of palpate identify"), parse_int=_whole)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}; give the output of palpate identify --json") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: not the output of palpate identify --json")
    return value


def _whole(text: str) -> int | float:
    """A whole number; one of more than 64 bits is what it is to most programs, a double, and infinite at last."""
    return int(text) if len(text) <= _DIGITS else float(text)


@options("Options from a file", 7)
class CellOptions:
    """Options saved in a file."""

    options: Path | None = None
    'A TOML file with options of this command, such as wrench-frame = "tool"; the command line overrides it.'
    preset: Annotated[Preset | None, QUIET] = None
    """ur-rtde, franka or ros2: the columns or topics, units and frames of these drivers; --options overrides
    it."""
    save_options: Path | None = None
    "TOML file to write the typed options to, for a later --options."

    def check(self) -> None:
        """Check the path before any work is done."""
        if self.save_options is not None:
            check_place(self.save_options, "--save-options", ending=".toml")

    def save(self, parts: Iterable[Any], command: str = "") -> None:
        """Write the options, if requested.

        Args:
            parts: dataclasses of options.
            command: whose options they are; options of a single call are not saved.
        """
        if self.save_options is not None:
            from palpate.cli.options.kept import save_options

            save_options(self.save_options, parts, command)
