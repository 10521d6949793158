// orders.hpp - what callbacks of ROS tell the loop: a ring between one writer and one reader, without locks.
#ifndef FTQP_CONTROLLER__ORDERS_HPP_
#define FTQP_CONTROLLER__ORDERS_HPP_

#include <array>
#include <atomic>
#include <cstddef>

#include "ftqp.h"

namespace ftqp_controller {

// One thing that the loop is told.
struct Order {
    enum class Kind { pose, twist, fault, withdraw, stop, resume, tool, load, thing } kind = Kind::stop;
    std::array<double, 3> place{};           // of a pose, a tool or a thing [m]
    std::array<double, 4> turn{1, 0, 0, 0};  // the same: w, x, y, z
    std::array<double, 6> twist{};           // linear, then angular, along the base frame
    ftqp_fault fault{};
    ftqp_load load{};  // no mass: none
    int joint = 0;     // or the number of a thing
};

// Callbacks of one node that are not reentrant come one after the other, so that there is one writer.
template <class T, std::size_t N> class Ring {
public:
    // False where the reader is so far behind that there is no room.
    bool push(const T &item) {
        const std::size_t at = written_.load(std::memory_order_relaxed);
        if (at - read_.load(std::memory_order_acquire) == N) return false;
        items_[at % N] = item;
        written_.store(at + 1, std::memory_order_release);
        return true;
    }

    // False where nothing is left.
    bool pop(T &item) {
        const std::size_t at = read_.load(std::memory_order_relaxed);
        if (at == written_.load(std::memory_order_acquire)) return false;
        item = items_[at % N];
        read_.store(at + 1, std::memory_order_release);
        return true;
    }

private:
    std::array<T, N> items_{};
    std::atomic<std::size_t> written_{0}, read_{0};
};

}  // namespace ftqp_controller
#endif
