// A stand-in, see README.md.
#ifndef DIAGNOSTIC_MSGS__MSG__DIAGNOSTIC_ARRAY_HPP_
#define DIAGNOSTIC_MSGS__MSG__DIAGNOSTIC_ARRAY_HPP_
#include <vector>
#include "diagnostic_msgs/msg/diagnostic_status.hpp"
#include "std_msgs/msg/header.hpp"
namespace diagnostic_msgs::msg {
struct DiagnosticArray {
    std_msgs::msg::Header header;
    std::vector<DiagnosticStatus> status;
};
}  // namespace diagnostic_msgs::msg
#endif
