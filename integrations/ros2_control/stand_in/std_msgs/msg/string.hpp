// A stand-in, see README.md.
#ifndef STD_MSGS__MSG__STRING_HPP_
#define STD_MSGS__MSG__STRING_HPP_
#include <string>
namespace std_msgs::msg {
struct String {
    std::string data{};
};
}  // namespace std_msgs::msg
#endif
