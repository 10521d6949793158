// A stand-in, see README.md: a node whose topics are called by their names.
#ifndef RCLCPP_LIFECYCLE__LIFECYCLE_NODE_HPP_
#define RCLCPP_LIFECYCLE__LIFECYCLE_NODE_HPP_

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "rclcpp/rclcpp.hpp"
#include "rclcpp_lifecycle/state.hpp"

namespace rclcpp_lifecycle {

class LifecycleNode {
public:
    explicit LifecycleNode(std::string name) : name_(std::move(name)), clock_(std::make_shared<rclcpp::Clock>()) {}
    const char *get_name() const { return name_.c_str(); }
    rclcpp::Logger get_logger() const { return {}; }
    rclcpp::Clock::SharedPtr get_clock() const { return clock_; }
    rclcpp::Time now() const { return rclcpp::Time(); }

    template <class Message, class Callback>
    std::shared_ptr<rclcpp::Subscription<Message>> create_subscription(const std::string &topic, const rclcpp::QoS &,
                                                                       Callback callback) {
        auto made = std::make_shared<rclcpp::Subscription<Message>>(callback);
        subscriptions_[topic] = made;
        return made;
    }

    template <class Message>
    std::shared_ptr<rclcpp::Publisher<Message>> create_publisher(const std::string &topic, const rclcpp::QoS &) {
        auto made = std::make_shared<rclcpp::Publisher<Message>>();
        publishers_[topic] = made;
        return made;
    }

    // What a test does in the place of the network.
    template <class Message> void deliver(const std::string &topic, const Message &message) {
        std::static_pointer_cast<rclcpp::Subscription<Message>>(subscriptions_.at(topic))->callback(message);
    }
    template <class Message> const rclcpp::Publisher<Message> &published(const std::string &topic) const {
        return *std::static_pointer_cast<rclcpp::Publisher<Message>>(publishers_.at(topic));
    }

private:
    std::string name_;
    rclcpp::Clock::SharedPtr clock_;
    std::map<std::string, std::shared_ptr<rclcpp::SubscriptionBase>> subscriptions_;
    std::map<std::string, std::shared_ptr<void>> publishers_;
};

}  // namespace rclcpp_lifecycle
#endif
