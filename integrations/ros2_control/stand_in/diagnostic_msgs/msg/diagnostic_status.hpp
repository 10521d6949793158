// A stand-in, see README.md.
#ifndef DIAGNOSTIC_MSGS__MSG__DIAGNOSTIC_STATUS_HPP_
#define DIAGNOSTIC_MSGS__MSG__DIAGNOSTIC_STATUS_HPP_
#include <vector>
#include "diagnostic_msgs/msg/key_value.hpp"
namespace diagnostic_msgs::msg {
struct DiagnosticStatus {
    static constexpr unsigned char OK = 0, WARN = 1, ERROR = 2, STALE = 3;
    unsigned char level = OK;
    std::string name, message, hardware_id;
    std::vector<KeyValue> values;
};
}  // namespace diagnostic_msgs::msg
#endif
