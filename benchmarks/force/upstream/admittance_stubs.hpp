// What the admittance rule of ros2_controllers includes of ROS 2, as far as one prismatic joint along x needs it.
#pragma once
#include <Eigen/Dense>
#include <memory>
#include <string>
#include <vector>

#define RCLCPP_ERROR(...)

namespace rclcpp
{
class Duration
{
public:
  explicit Duration(double s) : seconds_(s) {}
  double seconds() const { return seconds_; }

private:
  double seconds_;
};
}  // namespace rclcpp
namespace rclcpp_lifecycle
{
struct LifecycleNode
{
  int get_node_parameters_interface() { return 0; }
};
}  // namespace rclcpp_lifecycle
namespace controller_interface
{
enum class return_type { OK, ERROR };
}
namespace geometry_msgs::msg
{
struct Vector3 { double x = 0, y = 0, z = 0; };
struct Quaternion { double x = 0, y = 0, z = 0, w = 1; };
struct Wrench { Vector3 force, torque; };
struct Twist { Vector3 linear, angular; };
struct Header { std::string frame_id; };
struct WrenchStamped { Header header; Wrench wrench; };
struct TwistStamped { Header header; Twist twist; };
struct TransformStamped { Header header; std::string child_frame_id; };
}  // namespace geometry_msgs::msg
namespace trajectory_msgs::msg
{
struct JointTrajectoryPoint { std::vector<double> positions, velocities, accelerations; };
}  // namespace trajectory_msgs::msg
namespace control_msgs::msg
{
template <class T>
struct Data { T data; };
struct JointState { std::vector<std::string> name; std::vector<double> position, velocity, effort; };
struct AdmittanceControllerState
{
  Data<std::vector<double>> mass, damping, stiffness;
  Data<std::vector<bool>> selected_axes;
  Data<std::string> ft_sensor_frame;
  geometry_msgs::msg::TransformStamped admittance_position, ref_trans_base_ft;
  geometry_msgs::msg::TwistStamped admittance_velocity, admittance_acceleration;
  geometry_msgs::msg::WrenchStamped wrench_base;
  geometry_msgs::msg::Quaternion rot_base_control;
  JointState joint_state;
};
}  // namespace control_msgs::msg
namespace tf2
{
inline geometry_msgs::msg::TransformStamped eigenToTransform(const Eigen::Isometry3d &) { return {}; }
}  // namespace tf2
namespace filters
{
// control_toolbox: the newest value weighs the coefficient, the last smoothed one the rest.
template <class T>
T exponentialSmoothing(T raw, T smoothed, double coefficient)
{
  return coefficient * raw + (1.0 - coefficient) * smoothed;
}
}  // namespace filters
namespace kinematics_interface
{
class KinematicsInterface
{
public:
  bool initialize(const std::string &, int, const std::string &) { return true; }
  bool calculate_link_transform(const std::vector<double> & q, const std::string & link, Eigen::Isometry3d & out)
  {
    return place(q[0], link, out);
  }
  bool calculate_link_transform(const Eigen::VectorXd & q, const std::string & link, Eigen::Isometry3d & out)
  {
    return place(q[0], link, out);
  }
  bool convert_cartesian_deltas_to_joint_deltas(
    const Eigen::VectorXd &, const Eigen::Matrix<double, 6, 1> & delta, const std::string &, Eigen::VectorXd & out)
  {
    out[0] = delta[0];
    return true;
  }
  bool convert_joint_deltas_to_cartesian_deltas(
    const Eigen::VectorXd &, const Eigen::VectorXd & delta, const std::string &, Eigen::Matrix<double, 6, 1> & out)
  {
    out.setZero();
    out[0] = delta[0];
    return true;
  }

private:
  static bool place(double q, const std::string & link, Eigen::Isometry3d & out)
  {
    out = Eigen::Isometry3d::Identity();
    if (link != "base") out.translation()[0] = q;
    return true;
  }
};
}  // namespace kinematics_interface
namespace pluginlib
{
struct PluginlibException { const char * what() const { return ""; } };
template <class T>
struct ClassLoader
{
  ClassLoader(const std::string &, const std::string &) {}
  T * createUnmanagedInstance(const std::string &) { return new T; }
};
}  // namespace pluginlib
namespace admittance_controller
{
struct Frame { std::string id = "tool"; };
struct Framed { Frame frame; };
struct Params
{
  std::vector<std::string> joints{"x"};
  struct { std::string plugin_name = "one", plugin_package = "one", base = "base", tip = "tool"; double alpha = 0.01; } kinematics;
  struct { std::string name; Frame frame; double filter_coefficient = 0.05; } ft_sensor;
  Framed control;
  struct { Frame frame{"base"}; } fixed_world_frame;
  struct { Frame frame; struct { std::vector<double> pos{0, 0, 0}; double force = 0; } CoG; } gravity_compensation;
  struct
  {
    std::vector<bool> selected_axes = std::vector<bool>(6, true);
    std::vector<double> mass = std::vector<double>(6, 1.0), damping_ratio = std::vector<double>(6, 1.0),
                        stiffness = std::vector<double>(6, 1.0);
    double joint_damping = 5;
  } admittance;
  bool enable_parameter_update_without_reactivation = false;
};
struct ParamListener
{
  Params params;
  Params get_params() { return params; }
  bool try_get_params(Params & out) { out = params; return true; }
};
}  // namespace admittance_controller
