// FZI's force and compliance controllers, as they are, on the spring: numbers P D ERROR_SCALE STIFFNESS ITERATIONS;
// a stiffness below 0 is the force controller.
#include <cartesian_compliance_controller/cartesian_compliance_controller.h>
#include <cartesian_controller_base/ForwardDynamicsSolver.h>
#include <cartesian_force_controller/cartesian_force_controller.h>

#include "spring_bench.hpp"

std::shared_ptr<cartesian_controller_base::IKSolver> cartesian_controller_base::make_solver(const std::string &)
{
  return std::make_shared<ForwardDynamicsSolver>();
}

int main()
{
  using Force = cartesian_force_controller::CartesianForceController;
  using Compliance = cartesian_compliance_controller::CartesianComplianceController;
  return serve([](double rate, bool velocity, std::istream & in) {
    double p, d, scale, stiffness, iterations;
    in >> p >> d >> scale >> stiffness >> iterations;
    return std::function<Tick()>([=] {
      std::shared_ptr<cartesian_controller_base::CartesianControllerBase> controller;
      if (stiffness < 0.0) controller = std::make_shared<Force>();
      else controller = std::make_shared<Compliance>();
      auto node = controller->get_node();
      const std::string kind = velocity ? "velocity" : "position";
      auto set = [&](const std::string & name, auto value) { node->parameters[name] = rclcpp::Parameter{value}; };
      for (auto name : {"robot_base_link", "ft_sensor_ref_link", "end_effector_link", "compliance_ref_link"})
        set(name, std::string(name == std::string("robot_base_link") ? "base" : "tool"));
      set("joints", std::vector<std::string>{"x"});
      set("command_interfaces", std::vector<std::string>{kind});
      set("pd_gains.trans_x.p", p);
      set("pd_gains.trans_x.d", d);
      set("solver.error_scale", scale);
      set("solver.iterations", iterations);
      set("stiffness.trans_x", std::max(0.0, stiffness));
      controller->command_interfaces_.emplace_back("x", kind);
      controller->state_interfaces_.emplace_back("x", "position");
      controller->on_init();
      controller->on_configure({});
      controller->on_activate({});
      auto wrench = std::make_shared<geometry_msgs::msg::WrenchStamped>();
      auto sensor = node->wrenches.at("controller/ft_sensor_wrench");
      // The spring of the compliance controller: KDL takes a displacement below 1e-6 m as none, upstream clamps at 1 m,
      // and the solver's position runs ahead of the tip by up to 30 times its motion in ten steps of 0.02 s.
      const double smallest = stiffness > 0.0 ? 1e-6 : 0.0, largest = stiffness > 0.0 ? 0.03 : 1e12;
      return Tick{[=](double x, double force) {
        controller->state_interfaces_[0].set_value(x);
        wrench->wrench.force.x = force;
        sensor->receive(wrench);
        controller->update({}, rclcpp::Duration::from_seconds(1.0 / rate));
        return controller->command_interfaces_[0].get_value();
      }, 0.0, smallest, largest};
    });
  });
}
