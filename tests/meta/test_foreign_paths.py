"""No file of the project knows the machine it was written on."""

import re

FOLDERS = ("src", "packages", "tests", "docs", "examples", "benchmarks", "requirements", ".ci")
TEXT = {".py", ".md", ".toml", ".txt", ".in", ".json", ".html", ".css", ".js", ".csv", ".yml", ".yaml", ""}
MACHINE = re.compile(r"(?<![A-Za-z0-9.])/(?:home|Users|root|work|tmp|opt|mnt)/[A-Za-z0-9_.]")


def files(root):
    tops = [path for path in root.iterdir() if path.is_file() and not path.name.startswith(".")]
    inside = [path for folder in FOLDERS for path in (root / folder).rglob("*") if path.is_file()]
    made = re.compile(r"__pycache__|\.egg-info")
    return [path for path in tops + inside if path.suffix in TEXT and not made.search(str(path))]


def test_no_absolute_paths_of_a_machine(root):
    looked_at = files(root)
    assert root / "pyproject.toml" in looked_at
    found = [
        f"{path.relative_to(root)}:{number}: {line.strip()[:80]}"
        for path in looked_at
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if MACHINE.search(line)
    ]
    assert not found, "\n".join(found)


def test_the_pattern_finds_what_it_should():
    assert MACHINE.search("open('/ho" + "me/someone/data.csv')")
    assert not MACHINE.search("see examples/home/data.csv and m/s")
