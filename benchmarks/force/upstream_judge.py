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

CRISP = {
    "main": "crisp.cpp",
    "stubs": "crisp_stubs.hpp",
    "folders": [".", "include"],
    "sources": [],
    "libraries": [],
    "replaced": """controller_interface/controller_interface.hpp controller_interface/controller_interface_base.hpp
        rclcpp/rclcpp.hpp rclcpp/logging.hpp geometry_msgs/msg/pose_stamped.hpp geometry_msgs/msg/wrench_stamped.hpp
        sensor_msgs/msg/joint_state.hpp realtime_tools/realtime_buffer.hpp fmt/format.h pluginlib/class_list_macros.hpp
        cartesian_impedance_controller_parameters.hpp pinocchio/fwd.hpp pinocchio/multibody/fwd.hpp
        pinocchio/algorithm/model.hpp pinocchio/algorithm/aba.hpp pinocchio/algorithm/compute-all-terms.hpp
        pinocchio/algorithm/frames.hxx pinocchio/algorithm/rnea.hpp pinocchio/algorithm/kinematics.hpp
        pinocchio/parsers/urdf.hpp pinocchio/spatial/explog.hpp pinocchio/spatial/fwd.hpp""",
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
