// What CRISP includes besides ROS 2: pinocchio's arm as one joint that moves along x and weighs what its description
// says, and the parameters with the defaults of cartesian_impedance_controller.yaml.
#pragma once
#include <Eigen/Dense>
#include <unordered_map>

#include "ros_stubs.hpp"

namespace sensor_msgs::msg
{
struct JointState { std::vector<std::string> name; std::vector<double> position, velocity; };
}  // namespace sensor_msgs::msg
namespace realtime_tools
{
template <class T>
struct RealtimeBuffer
{
  T value{};
  void writeFromNonRT(const T & given) { value = given; }
  T * readFromRT() { return &value; }
};
}  // namespace realtime_tools
namespace rclcpp
{
struct Text { std::string text; std::string value_to_string() const { return text; } };
struct Future { std::vector<Text> texts; std::vector<Text> get() const { return texts; } };
struct AsyncParametersClient
{
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node;
  AsyncParametersClient(std::shared_ptr<rclcpp_lifecycle::LifecycleNode> given, const std::string &) : node(given) {}
  void wait_for_service() {}
  Future get_parameters(const std::vector<std::string> & names)
  {
    return {{{node->get_parameter(names[0]).as_string()}}};
  }
};
}  // namespace rclcpp
namespace pinocchio
{
using JointIndex = size_t;
using Vector6 = Eigen::Matrix<double, 6, 1>;
enum class ReferenceFrame { WORLD, LOCAL };
class SE3
{
public:
  SE3(const Eigen::Matrix3d & turn = Eigen::Matrix3d::Identity(), const Eigen::Vector3d & place = Eigen::Vector3d::Zero())
  : turn_(turn), place_(place) {}
  static SE3 Identity() { return {}; }
  const Eigen::Matrix3d & rotation() const { return turn_; }
  const Eigen::Vector3d & translation() const { return place_; }

private:
  Eigen::Matrix3d turn_;
  Eigen::Vector3d place_;
};
struct Joint
{
  std::string shortname() const { return "JointModelRZ"; }  // the controller takes no other than turning joints
  int idx_q() const { return 0; }
};
struct Model
{
  int nq = 1, nv = 1, njoints = 2;
  double mass = 1.0;
  std::vector<std::string> names{"universe", "x"};
  std::vector<Joint> joints{2};
  Eigen::VectorXd lowerPositionLimit = Eigen::VectorXd::Constant(1, -1e15),
                  upperPositionLimit = Eigen::VectorXd::Constant(1, 1e15), velocityLimit, effortLimit;
  bool existJointName(const std::string & name) const { return name == "x"; }
  JointIndex getJointId(const std::string &) const { return 1; }
  int getFrameId(const std::string &) const { return 0; }
};
struct Data
{
  using Matrix6x = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  std::vector<SE3> oMf{1};
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(1, 1), Minv = M;
  Data() = default;
  explicit Data(const Model &) {}
};
inline void forwardKinematics(const Model &, Data & data, const Eigen::VectorXd & q, const Eigen::VectorXd &)
{
  data.oMf[0] = SE3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(q[0], 0.0, 0.0));
}
inline void updateFramePlacements(const Model &, Data &) {}
inline void computeFrameJacobian(
  const Model &, Data &, const Eigen::VectorXd &, int, ReferenceFrame, Data::Matrix6x & J)
{
  J(0, 0) = 1.0;
}
inline void computeMinverse(const Model & model, Data & data, const Eigen::VectorXd &) { data.Minv(0, 0) = 1.0 / model.mass; }
inline void computeAllTerms(const Model &, Data &, const Eigen::VectorXd &, const Eigen::VectorXd &) {}
inline Eigen::MatrixXd computeCoriolisMatrix(const Model &, Data &, const Eigen::VectorXd &, const Eigen::VectorXd &)
{
  return Eigen::MatrixXd::Zero(1, 1);
}
inline Eigen::VectorXd computeGeneralizedGravity(const Model &, Data &, const Eigen::VectorXd &)
{
  return Eigen::VectorXd::Zero(1);
}
// The arm does not turn, so that the logarithm of a pose is its place.
inline Vector6 log6(const SE3 & pose)
{
  Vector6 out = Vector6::Zero();
  out.head(3) = pose.translation();
  return out;
}
inline SE3 exp6(const Vector6 & motion) { return SE3(Eigen::Matrix3d::Identity(), motion.head(3)); }
inline Eigen::Vector3d log3(const Eigen::Matrix3d &) { return Eigen::Vector3d::Zero(); }
namespace urdf
{
inline void buildModelFromXML(const std::string & text, Model & model) { model.mass = std::stod(text); }
}  // namespace urdf
inline Model buildReducedModel(const Model & model, const std::vector<JointIndex> &, const Eigen::VectorXd &)
{
  return model;
}
}  // namespace pinocchio
namespace cartesian_impedance_controller
{
struct Weight { double value = 1.0; };
struct Params
{
  std::vector<std::string> joints{"x"};
  std::string end_effector_frame = "tool", base_frame;
  bool use_operational_space = false, use_friction = false, use_coriolis_compensation = false,
       use_gravity_compensation = false, use_local_jacobian = false, stop_commands = false;
  // Both limits are on by default; they hide growth and are not part of what is judged.
  bool limit_error = false, limit_torques = false;
  double max_delta_tau = 0.5;
  struct
  {
    double k_pos_x = 500.0, k_pos_y = 500.0, k_pos_z = 500.0, k_rot_x = 30.0, k_rot_y = 30.0, k_rot_z = 30.0;
    double d_pos_x = -1.0, d_pos_y = -1.0, d_pos_z = -1.0, d_rot_x = -1.0, d_rot_y = -1.0, d_rot_z = -1.0;
    struct { double x = 0.1, y = 0.1, z = 0.1, rx = 0.5, ry = 0.5, rz = 0.5; } error_clip;
  } task;
  struct
  {
    double stiffness = 1.0, damping = -1.0, regularization = 1e-6, max_tau = 5.0;
    std::string projector_type = "kinematic";
    struct { std::map<std::string, Weight> joints_map{{"x", {}}}; } weights;
  } nullspace;
  struct { double target_pose = 0.1, q = 1.0, dq = 1.0, output_torque = 1.0; } filter;
  struct { std::vector<double> fp1{0.5}, fp2{5.0}, fp3{0.04}; } friction;
  struct
  {
    bool enabled = false, robot_state = false, control_values = false, controller_parameters = false, limits = false,
         computed_torques = false, dynamic_params = false, timing = false;
  } log;
};
class ParamListener
{
public:
  explicit ParamListener(std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node)
  {
    node->get_parameter("task.k_pos_x", params_.task.k_pos_x);
    node->get_parameter("task.d_pos_x", params_.task.d_pos_x);
    params_.use_operational_space = node->get_parameter("use_operational_space").as_bool();
  }
  void refresh_dynamic_parameters() {}
  Params get_params() const { return params_; }

private:
  Params params_;
};
}  // namespace cartesian_impedance_controller
