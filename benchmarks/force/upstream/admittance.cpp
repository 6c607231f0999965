// The admittance rule of ros2_controllers, as it is, on the spring: numbers M S DAMPING_RATIO JOINT_DAMPING FILTER.
#include <admittance_controller/admittance_rule_impl.hpp>

#include "spring_bench.hpp"

int main()
{
  return serve([](double rate, bool velocity, std::istream & in) {
    auto listener = std::make_shared<admittance_controller::ParamListener>();
    auto & p = listener->params;
    in >> p.admittance.mass[0] >> p.admittance.stiffness[0] >> p.admittance.damping_ratio[0] >>
      p.admittance.joint_damping >> p.ft_sensor.filter_coefficient;
    return std::function<Tick()>([=] {
      auto rule = std::make_shared<admittance_controller::AdmittanceRule>(listener);
      rule->configure(std::make_shared<rclcpp_lifecycle::LifecycleNode>(), 1, "");
      trajectory_msgs::msg::JointTrajectoryPoint now, reference;
      for (auto * point : {&now, &reference}) point->positions = point->velocities = point->accelerations = {0.0};
      auto wanted = reference;
      return Tick{[=](double x, double force) mutable {
        geometry_msgs::msg::Wrench wrench;
        wrench.force.x = force;
        now.positions[0] = x;
        rule->update(now, wrench, reference, rclcpp::Duration(1.0 / rate), wanted);
        return velocity ? wanted.velocities[0] : wanted.positions[0];
      }};
    });
  });
}
