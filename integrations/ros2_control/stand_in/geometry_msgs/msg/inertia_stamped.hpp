// A stand-in, see README.md.
#ifndef GEOMETRY_MSGS__MSG__INERTIA_STAMPED_HPP_
#define GEOMETRY_MSGS__MSG__INERTIA_STAMPED_HPP_
#include "geometry_msgs/msg/twist_stamped.hpp"
namespace geometry_msgs::msg {
struct Inertia {
    double m = 0.0;
    Vector3 com;
    double ixx = 0.0, ixy = 0.0, ixz = 0.0, iyy = 0.0, iyz = 0.0, izz = 0.0;
};
struct InertiaStamped {
    std_msgs::msg::Header header;
    Inertia inertia;
};
}  // namespace geometry_msgs::msg
#endif
