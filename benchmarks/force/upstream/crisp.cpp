// CRISP's Cartesian controller, as it is, on an arm that is a mass: numbers K D MASS OPERATIONAL; a damping of 0 or
// below is the default.
#include "crisp_stubs.hpp"

#include <src/cartesian_controller.cpp>

#include "spring_bench.hpp"

int main()
{
  return serve([](double, bool, std::istream & in) {
    double k, d, mass, operational;
    in >> k >> d >> mass >> operational;
    return std::function<Tick()>([=] {
      auto controller = std::make_shared<crisp_controllers::CartesianController>();
      auto node = controller->get_node();
      auto set = [&](const std::string & name, auto value) { node->parameters[name] = rclcpp::Parameter{value}; };
      set("robot_description", std::to_string(mass));
      set("task.k_pos_x", k);
      set("task.d_pos_x", d);
      set("use_operational_space", operational > 0.5);
      controller->command_interfaces_.emplace_back("x", "effort");
      for (auto kind : {"position", "velocity"}) controller->state_interfaces_.emplace_back("x", kind);
      controller->on_init();
      controller->on_configure({});
      controller->on_activate({});
      return Tick{[=](double x, double v) {
        controller->state_interfaces_[0].set_value(x);
        controller->state_interfaces_[1].set_value(v);
        controller->update({}, rclcpp::Duration{});
        return controller->command_interfaces_[0].get_value();
      }, mass};
    });
  });
}
