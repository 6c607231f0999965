"""Upstream's own controllers, compiled as they are, on a spring with a delay; nothing here knows of palpate.

The sources of ROS that they include are replaced by the stubs in `upstream/`; each include that the compiler asks for
becomes a file that includes the stubs. Eigen and, for FZI, KDL are the real ones. CRISP's is simulated.
"""

# ruff: noqa: S603, S607 -- it starts the compiler, and what that has made

import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent / "upstream"
ADMITTANCE = {
    "main": "admittance.cpp",
    "stubs": "admittance_stubs.hpp",
    "folders": ["admittance_controller/include"],
    "sources": [],
    "libraries": [],
    "replaced": """admittance_controller/admittance_controller_parameters.hpp
        control_msgs/msg/admittance_controller_state.hpp controller_interface/controller_interface_base.hpp
        kinematics_interface/kinematics_interface.hpp pluginlib/class_loader.hpp control_toolbox/filters.hpp
        trajectory_msgs/msg/joint_trajectory_point.hpp tf2_eigen/tf2_eigen.hpp rclcpp/duration.hpp""",
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
    "replaced": """rclcpp/rclcpp.hpp rclcpp/node.hpp rclcpp/clock.hpp rclcpp/duration.hpp
        rclcpp_lifecycle/lifecycle_node.hpp rclcpp_lifecycle/node_interfaces/lifecycle_node_interface.hpp
        hardware_interface/loaned_command_interface.hpp hardware_interface/loaned_state_interface.hpp
        hardware_interface/types/hardware_interface_type_values.hpp controller_interface/controller_interface.hpp
        controller_interface/helpers.hpp geometry_msgs/msg/pose_stamped.hpp geometry_msgs/msg/twist_stamped.hpp
        geometry_msgs/msg/wrench_stamped.hpp geometry_msgs/msg/detail/pose_stamped__struct.hpp
        geometry_msgs/msg/detail/twist_stamped__struct.hpp trajectory_msgs/msg/joint_trajectory_point.hpp
        pluginlib/class_loader.hpp pluginlib/class_list_macros.hpp realtime_tools/realtime_publisher.h urdf/model.h
        urdf_model/joint.h kdl_parser/kdl_parser.hpp cartesian_controller_base/ROS2VersionConfig.h
        ROS2VersionConfig.h""",
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
        kind: ADMITTANCE or FZI.
        checkout: of upstream.
        roots: prefixes that hold include/eigen3, include/kdl and lib, as /usr does.
    """
    folder = Path(tempfile.mkdtemp(prefix="upstream-"))
    for name in kind["replaced"].split():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f'#include "{kind["stubs"]}"\n')
    includes = [folder, HERE, *(Path(checkout) / name for name in kind["folders"])]
    includes += [Path(root) / name for root in roots for name in ("include/eigen3", "include")]
    libraries = [
        path for root in roots for path in Path(root).glob("lib/*/") if list(path.glob("liborocos-kdl.so"))
    ]
    command = ["g++", "-O2", "-std=c++17", *(f"-I{path}" for path in includes), HERE / kind["main"]]
    command += [Path(checkout) / name for name in kind["sources"]]
    command += [f"-{flag}{path}" for path in libraries for flag in ("L", "Wl,-rpath,")]
    subprocess.run([*command, *kind["libraries"], "-o", folder / "judge"], check=True)
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


class ImpedanceSimulator:
    """One axis of CRISP's impedance, read from its source, on an arm whose mass is moved in small steps.

    Its C++ needs pinocchio and a robot's description. All stiffnesses of a task are simulated at once.
    """

    SUBSTEPS = 40

    def ask(self, task, bench, numbers):
        """Answer to one task, as that of a compiled judge; the delay must be a whole number of substeps.

        Args:
            task: `edge LOW HIGH TICKS` or `grows K TICKS`.
            bench: rate [Hz], delay [s], and two unused flags.
            numbers: stiffness, damping, mass, and 1 for an operational-space controller.
        """
        name, *ends, ticks = task
        if name == "grows":
            return float(self._grow(np.array(ends), ticks, bench, numbers)[0])
        low, high = ends
        for count in (200, 60):
            grid = np.geomspace(low, high, count)
            grows = self._grow(grid, ticks, bench, numbers)
            if not grows.any():
                return np.inf
            first = int(np.argmax(grows))
            if first == 0:
                return low
            low, high = grid[first - 1], grid[first]
        return low

    def _grow(self, stiffness, ticks, bench, numbers):
        """True for each stiffness on which the second differences of the position grow."""
        k, d, mass, operational = numbers
        step = 1.0 / bench[0] / self.SUBSTEPS
        late = round(bench[1] / step)
        x, v = np.zeros_like(stiffness), np.full_like(stiffness, 1e-3)
        given = [np.zeros_like(stiffness)] * (late // self.SUBSTEPS + 2)
        first, second, peaks = x, x, np.zeros((2, len(stiffness)))
        for tick in range(ticks):
            given = [(mass if operational else 1.0) * (k * -x - d * v), *given[:-1]]
            for i in range(self.SUBSTEPS):
                force = given[(late - i + self.SUBSTEPS - 1) // self.SUBSTEPS]
                v = v + 0.5 * step * (force - stiffness * x) / mass
                x = x + step * v
                v = v + 0.5 * step * (force - stiffness * x) / mass
            if tick >= ticks // 2:
                half = int(tick >= 3 * ticks // 4)
                peaks[half] = np.maximum(peaks[half], abs(x - 2.0 * first + second))
            first, second = x, first
            x, v = (np.clip(value, -1e12, 1e12) for value in (x, v))
        return (peaks[1] > peaks[0]) | (abs(x) > 1e9)
