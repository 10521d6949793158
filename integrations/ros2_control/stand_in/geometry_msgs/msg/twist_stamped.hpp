// A stand-in, see README.md.
#ifndef GEOMETRY_MSGS__MSG__TWIST_STAMPED_HPP_
#define GEOMETRY_MSGS__MSG__TWIST_STAMPED_HPP_
#include "std_msgs/msg/header.hpp"
namespace geometry_msgs::msg {
struct Vector3 {
    double x = 0, y = 0, z = 0;
};
struct Twist {
    Vector3 linear, angular;
};
struct TwistStamped {
    std_msgs::msg::Header header;
    Twist twist;
};
}  // namespace geometry_msgs::msg
#endif
