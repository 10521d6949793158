// ftqp_controller.hpp - a controller of ros2_control over the library that `ftqp build` makes.
#ifndef FTQP_CONTROLLER__FTQP_CONTROLLER_HPP_
#define FTQP_CONTROLLER__FTQP_CONTROLLER_HPP_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "controller_interface/controller_interface.hpp"
#include "diagnostic_msgs/msg/diagnostic_array.hpp"
#include "diagnostic_msgs/msg/diagnostic_status.hpp"
#include "diagnostic_msgs/msg/key_value.hpp"
#include "ftqp.hpp"
#include "ftqp_controller/ftqp_controller_parameters.hpp"
#include "ftqp_controller/lead.hpp"
#include "ftqp_controller/orders.hpp"
#include "geometry_msgs/msg/inertia_stamped.hpp"
#include "geometry_msgs/msg/pose_stamped.hpp"
#include "geometry_msgs/msg/twist_stamped.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_lifecycle/state.hpp"
#include "realtime_tools/realtime_publisher.hpp"
#include "std_msgs/msg/bool.hpp"
#include "std_msgs/msg/string.hpp"

namespace ftqp_controller {

class FtqpController : public controller_interface::ControllerInterface {
public:
    controller_interface::CallbackReturn on_init() override;
    controller_interface::InterfaceConfiguration command_interface_configuration() const override;
    controller_interface::InterfaceConfiguration state_interface_configuration() const override;
    controller_interface::CallbackReturn on_configure(const rclcpp_lifecycle::State &previous) override;
    controller_interface::CallbackReturn on_activate(const rclcpp_lifecycle::State &previous) override;
    controller_interface::CallbackReturn on_deactivate(const rclcpp_lifecycle::State &previous) override;
    controller_interface::return_type update(const rclcpp::Time &time, const rclcpp::Duration &period) override;

private:
    using Status = diagnostic_msgs::msg::DiagnosticStatus;
    using Diagnostics = diagnostic_msgs::msg::DiagnosticArray;

    std::vector<std::string> names(const std::string &interface) const;
    const char *sent_interface() const;
    void subscribe();
    void tell(const Order &order);
    bool in_base(const std::string &frame) const;
    int joint_of(const std::string &name) const;
    void hear_pose(const geometry_msgs::msg::PoseStamped &message);
    void hear_twist(const geometry_msgs::msg::TwistStamped &message);
    void hear_fault(const diagnostic_msgs::msg::KeyValue &message);
    void hear_load(const geometry_msgs::msg::InertiaStamped &message);
    bool read_place(const geometry_msgs::msg::PoseStamped &message, Order &order) const;

    void read();
    void take_word(std::size_t i, double word);
    void look_at_joints();
    void fill(Status &message, int status) const;
    void obey(const Order &order);
    void follow();
    void rest();
    void send();
    void publish(int status);

    std::shared_ptr<ParamListener> listener_;
    Params given_;
    std::unique_ptr<ftqp_cpp::Planner> planner_;
    double dt_ = 1e-3;
    Ring<Order, 64> orders_;
    Lead lead_;
    ftqp_target target_{};
    std::vector<double> q_;
    std::vector<std::size_t> reads_, writes_, words_;  // where a joint's interfaces are
    std::vector<const char *> conditions_;      // what is believed of a joint
    std::vector<double> word_, counted_;        // what its drive said last, and what of it was acted upon
    std::vector<ftqp_finding> found_;
    std::vector<int> brakes_;
    bool follows_ = false, waits_ = false;      // a target leads; the arm rests because none does
    bool is_new_tool_ = false;                  // since the last step
    double since_target_ = 0.0, since_status_ = 0.0, since_diagnostics_ = 0.0;
    std::int64_t late_ = 0;

    rclcpp::Subscription<geometry_msgs::msg::PoseStamped>::SharedPtr pose_;
    rclcpp::Subscription<geometry_msgs::msg::TwistStamped>::SharedPtr twist_;
    rclcpp::Subscription<diagnostic_msgs::msg::KeyValue>::SharedPtr fault_;
    rclcpp::Subscription<std_msgs::msg::String>::SharedPtr withdraw_;
    rclcpp::Subscription<std_msgs::msg::Bool>::SharedPtr stop_;
    rclcpp::Subscription<geometry_msgs::msg::PoseStamped>::SharedPtr tool_;
    rclcpp::Subscription<geometry_msgs::msg::InertiaStamped>::SharedPtr load_;
    std::vector<rclcpp::Subscription<geometry_msgs::msg::PoseStamped>::SharedPtr> things_;
    std::unique_ptr<realtime_tools::RealtimePublisher<Status>> status_;
    std::unique_ptr<realtime_tools::RealtimePublisher<Diagnostics>> diagnostics_;
};

// A fault from words such as "locked", "locked mode=instant", "free_swinging damping=0.2" or
// "degraded velocity=0.5 torque=0.5"; false where they say none.
bool fault_from(const std::string &words, int joint, ftqp_fault &fault);

}  // namespace ftqp_controller
#endif
