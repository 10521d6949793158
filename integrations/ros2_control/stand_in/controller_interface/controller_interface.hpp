// A stand-in, see README.md: what a controller manager calls, and interfaces that are numbers.
#ifndef CONTROLLER_INTERFACE__CONTROLLER_INTERFACE_HPP_
#define CONTROLLER_INTERFACE__CONTROLLER_INTERFACE_HPP_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"
#include "rclcpp_lifecycle/lifecycle_node.hpp"

namespace hardware_interface {

class LoanedInterface {
public:
    LoanedInterface(std::string name, double *value) : name_(std::move(name)), value_(value) {}
    LoanedInterface(LoanedInterface &&) = default;
    LoanedInterface(const LoanedInterface &) = delete;
    const std::string &get_name() const { return name_; }
    double get_value() const { return *value_; }
    [[nodiscard]] bool set_value(double value) {
        *value_ = value;
        return true;
    }

private:
    std::string name_;
    double *value_;
};
using LoanedStateInterface = LoanedInterface;
using LoanedCommandInterface = LoanedInterface;

}  // namespace hardware_interface

namespace controller_interface {

enum class CallbackReturn : std::uint8_t { SUCCESS = 97, FAILURE = 98, ERROR = 99 };
enum class return_type : std::uint8_t { OK = 0, ERROR = 1 };
enum class interface_configuration_type : std::uint8_t { ALL = 0, INDIVIDUAL = 1, NONE = 2 };

struct InterfaceConfiguration {
    interface_configuration_type type;
    std::vector<std::string> names = {};
};

class ControllerInterface {
public:
    virtual ~ControllerInterface() = default;
    virtual CallbackReturn on_init() = 0;
    virtual InterfaceConfiguration command_interface_configuration() const = 0;
    virtual InterfaceConfiguration state_interface_configuration() const = 0;
    virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &previous) = 0;
    virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &previous) = 0;
    virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State &previous) = 0;
    virtual return_type update(const rclcpp::Time &time, const rclcpp::Duration &period) = 0;

    std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }
    unsigned int get_update_rate() const { return update_rate_; }

    // What a controller manager does.
    CallbackReturn init(const std::string &name, unsigned int update_rate) {
        node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>(name);
        update_rate_ = update_rate;
        return on_init();
    }
    void assign_interfaces(std::vector<hardware_interface::LoanedCommandInterface> &&commands,
                           std::vector<hardware_interface::LoanedStateInterface> &&states) {
        command_interfaces_ = std::move(commands);
        state_interfaces_ = std::move(states);
    }

protected:
    std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
    std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

private:
    std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_;
    unsigned int update_rate_ = 0;
};

}  // namespace controller_interface
#endif
