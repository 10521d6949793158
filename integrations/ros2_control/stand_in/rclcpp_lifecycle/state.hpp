// A stand-in, see README.md.
#ifndef RCLCPP_LIFECYCLE__STATE_HPP_
#define RCLCPP_LIFECYCLE__STATE_HPP_
namespace rclcpp_lifecycle {
class State {};
}  // namespace rclcpp_lifecycle
#endif
