// A stand-in, see README.md: only that the one class is a kind of the other.
#ifndef PLUGINLIB__CLASS_LIST_MACROS_HPP_
#define PLUGINLIB__CLASS_LIST_MACROS_HPP_
#include <type_traits>
#define PLUGINLIB_EXPORT_CLASS(Class, Base) static_assert(std::is_base_of_v<Base, Class>, "a plugin is a kind of its base");
#endif
