// A stand-in, see README.md.
#ifndef DIAGNOSTIC_MSGS__MSG__KEY_VALUE_HPP_
#define DIAGNOSTIC_MSGS__MSG__KEY_VALUE_HPP_
#include <string>
namespace diagnostic_msgs::msg {
struct KeyValue {
    std::string key, value;
};
}  // namespace diagnostic_msgs::msg
#endif
