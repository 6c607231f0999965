// What FZI's cartesian_controllers include besides ROS 2; KDL is the real one.
#pragma once
#include <kdl/chain.hpp>
#include <kdl/frames.hpp>
#include <kdl/joint.hpp>
#include <kdl/segment.hpp>
#include <kdl/tree.hpp>

#include "ros_stubs.hpp"

#define CARTESIAN_CONTROLLERS_JAZZY

namespace cartesian_controller_base
{
class IKSolver;
std::shared_ptr<IKSolver> make_solver(const std::string & name);
}  // namespace cartesian_controller_base
namespace pluginlib
{
struct PluginlibException { const char * what() const { return ""; } };
template <class T>
struct ClassLoader
{
  ClassLoader(const std::string &, const std::string &) {}
  std::shared_ptr<T> createSharedInstance(const std::string & name)
  {
    return cartesian_controller_base::make_solver(name);
  }
};
}  // namespace pluginlib
namespace urdf
{
struct JointLimits { double lower = -1e15, upper = 1e15; };
struct Joint
{
  enum Type { PRISMATIC, CONTINUOUS };
  Type type = PRISMATIC;
  std::shared_ptr<JointLimits> limits = std::make_shared<JointLimits>();
};
struct Model
{
  bool initString(const std::string &) { return true; }
  std::shared_ptr<Joint> getJoint(const std::string &) const { return std::make_shared<Joint>(); }
};
}  // namespace urdf
namespace kdl_parser
{
inline bool treeFromUrdfModel(const urdf::Model &, KDL::Tree & tree)
{
  tree = KDL::Tree("base");
  tree.addSegment(KDL::Segment("tool", KDL::Joint("x", KDL::Joint::TransX)), "base");
  return true;
}
}  // namespace kdl_parser
