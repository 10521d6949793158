// A stand-in for what generate_parameter_library makes of src/ftqp_controller_parameters.yaml, see README.md.
#ifndef FTQP_CONTROLLER__FTQP_CONTROLLER_PARAMETERS_HPP_
#define FTQP_CONTROLLER__FTQP_CONTROLLER_PARAMETERS_HPP_
#include <memory>
#include <string>
#include <vector>
#include "rclcpp_lifecycle/lifecycle_node.hpp"
namespace ftqp_controller {
struct Params {
    std::vector<std::string> joints, things;
    std::string arm_file, base_frame, fault_interface;
    double target_timeout = 0.5;
    double max_linear_velocity = 0.25, max_linear_acceleration = 1.0;
    double max_angular_velocity = 1.0, max_angular_acceleration = 4.0;
    double status_rate = 10.0, weak_share = 0.5;
};
class ParamListener {
public:
    explicit ParamListener(const std::shared_ptr<rclcpp_lifecycle::LifecycleNode> &) {}
    Params get_params() const { return given(); }
    static Params &given() {  // what a test sets
        static Params params;
        return params;
    }
};
}  // namespace ftqp_controller
#endif
