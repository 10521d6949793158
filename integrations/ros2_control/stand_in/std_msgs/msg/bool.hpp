// A stand-in, see README.md.
#ifndef STD_MSGS__MSG__BOOL_HPP_
#define STD_MSGS__MSG__BOOL_HPP_
#include <string>
namespace std_msgs::msg {
struct Bool {
    bool data{};
};
}  // namespace std_msgs::msg
#endif
