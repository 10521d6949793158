// A stand-in, see README.md: publishes at once.
#ifndef REALTIME_TOOLS__REALTIME_PUBLISHER_HPP_
#define REALTIME_TOOLS__REALTIME_PUBLISHER_HPP_

#include <memory>

#include "rclcpp/rclcpp.hpp"

namespace realtime_tools {

template <class Message> class RealtimePublisher {
public:
    explicit RealtimePublisher(std::shared_ptr<rclcpp::Publisher<Message>> publisher) : publisher_(publisher) {}
    void lock() {}
    void unlock() {}
    bool trylock() { return true; }
    void unlockAndPublish() { publisher_->publish(msg_); }
    Message msg_{};

private:
    std::shared_ptr<rclcpp::Publisher<Message>> publisher_;
};

}  // namespace realtime_tools
#endif
