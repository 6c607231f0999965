"""Variables of RTDE and their types, as the tables of UR's guide to the Real-Time Data Exchange interface have them."""

CODES = {
    "VECTOR6D": "6d", "VECTOR3D": "3d", "VECTOR6INT32": "6i", "UINT64": "Q", "UINT32": "I", "INT32": "i", "UINT8": "B",
    "BOOL": "?", "DOUBLE": "d",
}  # fmt: skip
"""Of `struct`, big-endian."""
_OUTPUTS = {
    "VECTOR6D": "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current"
    " actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed"
    " actual_TCP_force target_TCP_pose target_TCP_speed joint_temperatures actual_joint_voltage payload_inertia"
    " ft_raw_wrench wrench_calc_from_currents tcp_offset",
    "VECTOR3D": "actual_tool_accelerometer elbow_position elbow_velocity payload_cog",
    "VECTOR6INT32": "joint_mode",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits",
    "UINT32": "runtime_state robot_status_bits safety_status_bits analog_io_types euromap67_input_bits"
    " euromap67_output_bits tool_mode tool_analog_input_types output_bit_registers0_to_31 output_bit_registers32_to_63"
    " input_bit_registers0_to_31 input_bit_registers32_to_63 script_control_line",
    "INT32": "robot_mode safety_mode safety_status tool_output_voltage time_scale_source encoder0_raw encoder1_raw",
    "UINT8": "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
    "DOUBLE": "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage"
    " actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 standard_analog_output0"
    " standard_analog_output1 io_current euromap67_24V_voltage euromap67_24V_current tool_analog_input0"
    " tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar payload joint_position_deviation_ratio"
    " collision_detection_ratio",
}
_INPUTS = {
    "VECTOR6D": "external_force_torque",
    "UINT32": "speed_slider_mask input_bit_registers0_to_31 input_bit_registers32_to_63",
    "UINT8": "standard_digital_output_mask configurable_digital_output_mask standard_digital_output"
    " configurable_digital_output standard_analog_output_mask standard_analog_output_type",
    "DOUBLE": "speed_slider_fraction standard_analog_output_0 standard_analog_output_1",
}


def _with_registers(kinds: dict[str, str], *ways: str) -> dict[str, str]:
    """Type of each name, the registers of these ways included: bits 64 to 127, integers and doubles 0 to 47."""
    types = {name: kind for kind, names in kinds.items() for name in names.split()}
    for way in ways:
        types |= {f"{way}_bit_register_{i}": "BOOL" for i in range(64, 128)}
        types |= {
            f"{way}_{a}_register_{i}": k
            for a, k in (("int", "INT32"), ("double", "DOUBLE"))
            for i in range(48)
        }
    return types


OUTPUTS = _with_registers(_OUTPUTS, "output", "input")
"""Type of each variable that a client may ask for."""
INPUTS = _with_registers(_INPUTS, "input")
"""Type of each variable that a client may set."""
UNKNOWN = "NOT_FOUND"
"""Type of a variable that is none."""
