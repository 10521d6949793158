// lead.hpp - the target of every tick on the way to a goal, or along a twist: neither its speed nor its acceleration
// jumps beyond what is allowed, however goals jump.
#ifndef FTQP_CONTROLLER__LEAD_HPP_
#define FTQP_CONTROLLER__LEAD_HPP_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "ftqp.h"

namespace ftqp_controller {

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  // w, x, y, z

inline Vector plus(const Vector &a, const Vector &b, double s = 1.0) {
    return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}

inline double norm(const Vector &a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

inline Quaternion times(const Quaternion &a, const Quaternion &b) {
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

// Of length one; false where it is far from that, as zeros of a message that was not filled are.
inline bool normalise(Quaternion &a) {
    const double size = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
    if (!(std::fabs(size - 1.0) < 1e-2)) return false;
    for (double &part : a) part /= size;
    return true;
}

// The turn by a rotation vector.
inline Quaternion turn_by(const Vector &r) {
    const double angle = norm(r), s = angle > 1e-9 ? std::sin(0.5 * angle) / angle : 0.5;
    return {std::cos(0.5 * angle), s * r[0], s * r[1], s * r[2]};
}

// The rotation vector from one orientation to another, the short way.
inline Vector way(const Quaternion &from, const Quaternion &to) {
    Quaternion d = times(to, {from[0], -from[1], -from[2], -from[3]});
    if (d[0] < 0.0)
        for (double &part : d) part = -part;
    const double s = norm({d[1], d[2], d[3]}), f = s > 1e-12 ? 2.0 * std::atan2(s, d[0]) / s : 2.0;
    return {f * d[1], f * d[2], f * d[3]};
}

inline Quaternion quaternion_of(const double *pose) {
    const double *R = pose;
    const double trace = R[0] + R[5] + R[10];
    Quaternion q{};
    if (trace > 0.0) {
        const double s = 2.0 * std::sqrt(1.0 + trace);
        q = {0.25 * s, (R[9] - R[6]) / s, (R[2] - R[8]) / s, (R[4] - R[1]) / s};
    } else if (R[0] > R[5] && R[0] > R[10]) {
        const double s = 2.0 * std::sqrt(1.0 + R[0] - R[5] - R[10]);
        q = {(R[9] - R[6]) / s, 0.25 * s, (R[1] + R[4]) / s, (R[2] + R[8]) / s};
    } else if (R[5] > R[10]) {
        const double s = 2.0 * std::sqrt(1.0 + R[5] - R[0] - R[10]);
        q = {(R[2] - R[8]) / s, (R[1] + R[4]) / s, 0.25 * s, (R[6] + R[9]) / s};
    } else {
        const double s = 2.0 * std::sqrt(1.0 + R[10] - R[0] - R[5]);
        q = {(R[4] - R[1]) / s, (R[2] + R[8]) / s, (R[6] + R[9]) / s, 0.25 * s};
    }
    normalise(q);
    return q;
}

// A pose, 16 numbers by rows, of a place and a turn.
inline void write_pose(const Vector &place, const Quaternion &turn, double *pose) {
    const auto &[w, x, y, z] = turn;
    const double R[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                         2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
    for (std::size_t i = 0; i < 3; i++) {
        for (std::size_t k = 0; k < 3; k++) pose[4 * i + k] = R[3 * i + k];
        pose[4 * i + 3] = place[i];
        pose[12 + i] = 0.0;
    }
    pose[15] = 1.0;
}

// The greatest speed and acceleration of the target, of its place [m/s, m/s2] or its orientation [rad/s, rad/s2].
struct Pace {
    double speed, acceleration;
};

class Lead {
public:
    Lead() = default;
    Lead(const Pace &linear, const Pace &angular, double dt) : linear_(linear), angular_(angular), dt_(dt) {}

    // At rest at a pose, 16 numbers by rows.
    void begin(const double *pose) {
        place_ = goal_place_ = {pose[3], pose[7], pose[11]};
        turn_ = goal_turn_ = quaternion_of(pose);
        velocity_ = spin_ = acceleration_ = spin_up_ = wanted_velocity_ = wanted_spin_ = {};
        jogs_ = false;
    }

    void aim(const Vector &place, const Quaternion &turn) {
        goal_place_ = place;
        goal_turn_ = turn;
        jogs_ = false;
    }

    void jog(const Vector &velocity, const Vector &spin) {
        wanted_velocity_ = limited(velocity, linear_.speed);
        wanted_spin_ = limited(spin, angular_.speed);
        jogs_ = true;
    }

    // Go on by a period.
    void next() {
        const Vector v = jogs_ ? wanted_velocity_ : towards(plus(goal_place_, place_, -1.0), linear_);
        const Vector w = jogs_ ? wanted_spin_ : towards(way(turn_, goal_turn_), angular_);
        acceleration_ = gathered(velocity_, v, linear_);
        spin_up_ = gathered(spin_, w, angular_);
        velocity_ = plus(velocity_, acceleration_, dt_);
        spin_ = plus(spin_, spin_up_, dt_);
        place_ = plus(place_, velocity_, dt_);
        turn_ = times(turn_by({dt_ * spin_[0], dt_ * spin_[1], dt_ * spin_[2]}), turn_);
        normalise(turn_);
    }

    void write(ftqp_target &target) const {
        write_pose(place_, turn_, target.pose);
        for (std::size_t i = 0; i < 3; i++) {
            target.twist[i] = velocity_[i];
            target.twist[3 + i] = spin_[i];
            target.acceleration[i] = acceleration_[i];
            target.acceleration[3 + i] = spin_up_[i];
        }
        target.has_rotation = 1.0;
    }

private:
    static constexpr double SHARP = 5.0;  // 1/s: how the last of the way is gone

    static Vector limited(const Vector &a, double most) {
        const double size = norm(a), s = size > most ? most / size : 1.0;
        return {s * a[0], s * a[1], s * a[2]};
    }

    // The velocity from which the rest of the way still ends at rest, at half of the acceleration.
    static Vector towards(const Vector &gap, const Pace &pace) {
        const double far = norm(gap);
        if (!(far > 0.0)) return {};
        const double speed = std::min({pace.speed, std::sqrt(pace.acceleration * far), SHARP * far}) / far;
        return {speed * gap[0], speed * gap[1], speed * gap[2]};
    }

    Vector gathered(const Vector &now, const Vector &wanted, const Pace &pace) const {
        const Vector change = plus(wanted, now, -1.0);
        return limited({change[0] / dt_, change[1] / dt_, change[2] / dt_}, pace.acceleration);
    }

    Pace linear_{}, angular_{};
    double dt_ = 1e-3;
    bool jogs_ = false;
    Vector place_{}, goal_place_{}, velocity_{}, spin_{}, acceleration_{}, spin_up_{}, wanted_velocity_{}, wanted_spin_{};
    Quaternion turn_{1, 0, 0, 0}, goal_turn_{1, 0, 0, 0};
};

}  // namespace ftqp_controller
#endif
