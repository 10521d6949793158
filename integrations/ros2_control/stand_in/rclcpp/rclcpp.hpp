// A stand-in, see README.md: time, logging, publishers and subscriptions.
#ifndef RCLCPP__RCLCPP_HPP_
#define RCLCPP__RCLCPP_HPP_

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "std_msgs/msg/header.hpp"

namespace rclcpp {

class Time {
public:
    explicit Time(std::int64_t nanoseconds = 0) : nanoseconds_(nanoseconds) {}
    double seconds() const { return 1e-9 * static_cast<double>(nanoseconds_); }
    operator builtin_interfaces::msg::Time() const {
        return {static_cast<std::int32_t>(nanoseconds_ / 1000000000), static_cast<std::uint32_t>(nanoseconds_ % 1000000000)};
    }

private:
    std::int64_t nanoseconds_;
};

class Duration {
public:
    explicit Duration(std::int64_t nanoseconds) : nanoseconds_(nanoseconds) {}
    static Duration from_seconds(double seconds) { return Duration(static_cast<std::int64_t>(1e9 * seconds)); }
    double seconds() const { return 1e-9 * static_cast<double>(nanoseconds_); }

private:
    std::int64_t nanoseconds_;
};

class Clock {
public:
    using SharedPtr = std::shared_ptr<Clock>;
};

// Counts what is said; a test reads the last line.
class Logger {
public:
    void say(const std::string &text) const { said() = text; }
    static std::string &said() {
        static std::string last;
        return last;
    }
};

struct QoS {};
struct SystemDefaultsQoS : QoS {};

template <class Message> class Publisher {
public:
    using SharedPtr = std::shared_ptr<Publisher>;
    void publish(const Message &message) {
        last = message;
        count++;
    }
    Message last{};
    int count = 0;
};

class SubscriptionBase {
public:
    virtual ~SubscriptionBase() = default;
};

template <class Message> class Subscription : public SubscriptionBase {
public:
    using SharedPtr = std::shared_ptr<Subscription>;
    explicit Subscription(std::function<void(const Message &)> callback) : callback(std::move(callback)) {}
    std::function<void(const Message &)> callback;
};

}  // namespace rclcpp

#define RCLCPP_SAY_(logger, ...)                                   \
    do {                                                           \
        char text_[512];                                           \
        std::snprintf(text_, sizeof text_, __VA_ARGS__);           \
        (logger).say(text_);                                       \
    } while (false)
#define RCLCPP_ERROR(logger, ...) RCLCPP_SAY_(logger, __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) RCLCPP_SAY_(logger, __VA_ARGS__)
#define RCLCPP_ERROR_THROTTLE(logger, clock, milliseconds, ...) \
    do {                                                        \
        (void)(clock);                                          \
        (void)(milliseconds);                                   \
        RCLCPP_SAY_(logger, __VA_ARGS__);                       \
    } while (false)
#define RCLCPP_WARN_THROTTLE(logger, clock, milliseconds, ...) RCLCPP_ERROR_THROTTLE(logger, clock, milliseconds, __VA_ARGS__)
#endif
