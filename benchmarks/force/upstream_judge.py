"""Upstream's own controllers, compiled as they are, on a spring with a delay; nothing here knows of palpate.

The sources of ROS that they include are replaced by the stubs in `upstream/`; each include that the compiler asks for
becomes a file that includes the stubs. Eigen and, for FZI, KDL are the real ones; CRISP's pinocchio is one joint.
"""

# ruff: noqa: S603, S607 -- it starts the compiler, and what that has made

import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).parent / "upstream"
ADMITTANCE = {
    "main": "admittance.cpp",
    "stubs": "admittance_stubs.hpp",
    "folders": ["admittance_controller/include"],
    "sources": [],
    "libraries": [],
}
BASE = (
    "ForwardDynamicsSolver",
    "IKSolver",
    "PDController",
    "SpatialPDController",
    "cartesian_controller_base",
)
PACKAGES = ("cartesian_force_controller", "cartesian_motion_controller", "cartesian_compliance_controller")
FZI = {
    "main": "fzi.cpp",
    "stubs": "fzi_stubs.hpp",
    "folders": [f"{name}/include" for name in ("cartesian_controller_base", *PACKAGES)],
    "sources": [
        *(f"cartesian_controller_base/src/{name}.cpp" for name in BASE),
        *(f"{name}/src/{name}.cpp" for name in PACKAGES),
    ],
    "libraries": ["-lorocos-kdl"],
}

CRISP = {
    "main": "crisp.cpp",
    "stubs": "crisp_stubs.hpp",
    "folders": [".", "include"],
    "sources": [],
    "libraries": [],
}


def commit(checkout):
    """Commit of a checkout of upstream."""
    ran = subprocess.run(
        ["git", "-C", checkout, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
    )
    return ran.stdout.strip()


def compile_judge(kind, checkout, roots):
    """Compile a checkout's controller with the bench; the program.

    Args:
        kind: ADMITTANCE, FZI or CRISP.
        checkout: of upstream.
        roots: prefixes that hold include/eigen3, include/kdl and lib, as /usr does.
    """
    folder = Path(tempfile.mkdtemp(prefix="upstream-"))
    includes = [folder, HERE, *(Path(checkout) / name for name in kind["folders"])]
    includes += [Path(root) / name for root in roots for name in ("include/eigen3", "include")]
    libraries = [
        path for root in roots for path in Path(root).glob("lib/*/") if list(path.glob("liborocos-kdl.so"))
    ]
    compiler = ["g++", "-O2", "-std=c++17", *(f"-I{path}" for path in includes)]
    sources = [HERE / kind["main"], *(Path(checkout) / name for name in kind["sources"])]
    included = subprocess.run([*compiler, "-M", "-MG", *sources], capture_output=True, text=True, check=True)
    for name in included.stdout.split():
        if not name.endswith((":", "\\")) and not Path(name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f'#include "{kind["stubs"]}"\n')
    linked = [f"-{flag}{path}" for path in libraries for flag in ("L", "Wl,-rpath,")]
    subprocess.run([*compiler, *sources, *linked, *kind["libraries"], "-o", folder / "judge"], check=True)
    return Judge(folder / "judge")


class Judge:
    """A compiled controller on the bench: tasks in, numbers out.

    Args:
        program: of `compile_judge`.
    """

    def __init__(self, program):
        self._process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, task, bench, numbers):
        """Answer to one task.

        Args:
            task: words and numbers, as `edge 10 1e7 16000`.
            bench: rate [Hz], delay [s], whether it commands a velocity, whether the force alone is late.
            numbers: of the controller.
        """
        words = [*task, *(format(float(value), ".17g") for value in (*bench, *numbers))]
        self._process.stdin.write(" ".join(map(str, words)) + "\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())
