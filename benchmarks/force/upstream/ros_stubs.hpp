// What controllers include of ROS 2, as far as one prismatic joint along x needs it.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#define RCLCPP_ERROR(...)
#define RCLCPP_INFO(...)
#define RCLCPP_ERROR_STREAM(...)
#define RCLCPP_ERROR_STREAM_ONCE(...)
#define RCLCPP_INFO_STREAM(...)
#define RCLCPP_INFO_STREAM_THROTTLE(...)
#define RCLCPP_WARN_THROTTLE(logger, clock, ...) (void)(clock)
#define RCLCPP_WARN_STREAM_THROTTLE(logger, clock, ...) (void)(clock)
#define PLUGINLIB_EXPORT_CLASS(derived, base)

namespace rclcpp
{
class Duration
{
public:
  Duration() = default;
  static Duration from_seconds(double s) { Duration d; d.nanoseconds_ = static_cast<long long>(s * 1e9 + 0.5); return d; }
  double seconds() const { return 1e-9 * static_cast<double>(nanoseconds_); }
  bool operator==(const Duration & other) const { return nanoseconds_ == other.nanoseconds_; }

private:
  long long nanoseconds_ = 0;
};
struct Time { long long nanoseconds() const { return 0; } };
struct Clock { Time now() const { return {}; } };
struct QoS { QoS(int) {} };
struct Logger {};
class Node {};
template <class T>
struct Subscription
{
  using SharedPtr = std::shared_ptr<Subscription<T>>;
  std::function<void(std::shared_ptr<T>)> receive;
};
template <class T>
struct Publisher {};
struct Parameter
{
  std::variant<double, std::string, bool, std::vector<std::string>> value;
  double as_double() const { return std::get<double>(value); }
  long as_int() const { return static_cast<long>(std::get<double>(value)); }
  bool as_bool() const { return std::get<bool>(value); }
  std::string as_string() const { return std::get<std::string>(value); }
  std::vector<std::string> as_string_array() const { return std::get<std::vector<std::string>>(value); }
};
}  // namespace rclcpp
namespace geometry_msgs::msg
{
struct Vector3 { double x = 0, y = 0, z = 0; };
struct Quaternion { double x = 0, y = 0, z = 0, w = 1; };
struct Header { std::string frame_id; rclcpp::Time stamp; };
struct Pose { Vector3 position; Quaternion orientation; };
struct Wrench { Vector3 force, torque; };
struct Twist { Vector3 linear, angular; };
struct PoseStamped { using SharedPtr = std::shared_ptr<PoseStamped>; Header header; Pose pose; };
struct WrenchStamped { using SharedPtr = std::shared_ptr<WrenchStamped>; Header header; Wrench wrench; };
struct TwistStamped { using SharedPtr = std::shared_ptr<TwistStamped>; Header header; Twist twist; };
}  // namespace geometry_msgs::msg
namespace trajectory_msgs::msg
{
struct JointTrajectoryPoint
{
  std::vector<double> positions, velocities, accelerations;
  rclcpp::Duration time_from_start;
};
}  // namespace trajectory_msgs::msg
namespace rclcpp_lifecycle
{
struct State {};
class LifecycleNode
{
public:
  std::map<std::string, rclcpp::Parameter> parameters;
  std::map<std::string, rclcpp::Subscription<geometry_msgs::msg::WrenchStamped>::SharedPtr> wrenches;

  bool has_parameter(const std::string & name) const { return parameters.count(name) > 0; }
  rclcpp::Parameter get_parameter(const std::string & name) const { return parameters.at(name); }
  bool get_parameter(const std::string & name, double & out) const
  {
    out = parameters.at(name).as_double();
    return true;
  }
  template <class T>
  T declare_parameter(const std::string & name, const T & value)
  {
    if constexpr (std::is_same_v<T, int>) parameters.try_emplace(name, rclcpp::Parameter{double(value)});
    else parameters.try_emplace(name, rclcpp::Parameter{value});
    return value;
  }
  std::string get_name() const { return "controller"; }
  rclcpp::Logger get_logger() const { return {}; }
  std::shared_ptr<rclcpp::Clock> get_clock() const { return std::make_shared<rclcpp::Clock>(); }
  rclcpp::Time now() const { return {}; }
  void shutdown() {}
  std::vector<int> get_publishers_info_by_topic(const std::string &) const { return {}; }
  template <class T, class F>
  std::shared_ptr<rclcpp::Subscription<T>> create_subscription(const std::string & topic, rclcpp::QoS, F && receive)
  {
    auto made = std::make_shared<rclcpp::Subscription<T>>();
    made->receive = receive;
    if constexpr (std::is_same_v<T, geometry_msgs::msg::WrenchStamped>) wrenches[topic] = made;
    return made;
  }
  template <class T>
  std::shared_ptr<rclcpp::Publisher<T>> create_publisher(const std::string &, int)
  {
    return std::make_shared<rclcpp::Publisher<T>>();
  }
};
namespace node_interfaces
{
struct LifecycleNodeInterface
{
  enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
  virtual ~LifecycleNodeInterface() = default;
  virtual CallbackReturn on_configure(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_activate(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_deactivate(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_shutdown(const State &) { return CallbackReturn::SUCCESS; }
};
}  // namespace node_interfaces
}  // namespace rclcpp_lifecycle
namespace hardware_interface
{
constexpr char HW_IF_POSITION[] = "position";
constexpr char HW_IF_VELOCITY[] = "velocity";
class Handle
{
public:
  Handle(std::string joint, std::string kind) : joint_(std::move(joint)), kind_(std::move(kind)) {}
  double get_value() const { return value_; }
  bool set_value(double value) { value_ = value; return true; }
  std::string get_interface_name() const { return kind_; }
  std::string joint() const { return joint_; }

private:
  std::string joint_, kind_;
  double value_ = 0.0;
};
struct LoanedStateInterface : Handle { using Handle::Handle; };
struct LoanedCommandInterface : Handle { using Handle::Handle; };
}  // namespace hardware_interface
namespace controller_interface
{
enum class return_type { OK, ERROR };
enum class interface_configuration_type { ALL, INDIVIDUAL, NONE };
struct InterfaceConfiguration { interface_configuration_type type; std::vector<std::string> names; };
using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;
class ControllerInterface : public rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface
{
public:
  using LifecycleNodeInterface = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface;
  virtual CallbackReturn on_init() = 0;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }
  std::string get_robot_description() const { return "one joint"; }
  template <class T>
  void auto_declare(const std::string & name, const T & value)
  {
    node_->declare_parameter<T>(name, value);
  }
  void release_interfaces() {}

  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};
template <class T>
bool get_ordered_interfaces(
  std::vector<T> & all, const std::vector<std::string> & joints, const std::string & kind,
  std::vector<std::reference_wrapper<T>> & out)
{
  out.clear();
  for (const auto & joint : joints)
    for (auto & handle : all)
      if (handle.joint() == joint && handle.get_interface_name() == kind) out.push_back(std::ref(handle));
  return out.size() == joints.size();
}
}  // namespace controller_interface
namespace realtime_tools
{
template <class T>
struct RealtimePublisher
{
  explicit RealtimePublisher(std::shared_ptr<rclcpp::Publisher<T>>) {}
  bool trylock() { return false; }
  void unlockAndPublish() {}
  T msg_;
};
template <class T>
using RealtimePublisherSharedPtr = std::shared_ptr<RealtimePublisher<T>>;
}  // namespace realtime_tools
