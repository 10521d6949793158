// The same in C++17: the end effector holds its place while a joint locks and is repaired.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <vector>

#include "arm.h"
#include "ftqp.hpp"

int main(int count, char **arguments) {
    try {
        auto planner = ftqp_cpp::Planner::from_file(count > 1 ? arguments[1] : "../arm.ftqp", FTQP_ARM_JOINTS, FTQP_ARM_FINGERPRINT);
        std::vector<double> q(std::begin(ftqp_arm_neutral), std::end(ftqp_arm_neutral));
        if (!planner.reset(q)) throw std::runtime_error("the arm is beyond its limits");
        std::vector<int> brakes(q.size());
        ftqp_target target{};
        std::copy(std::begin(ftqp_arm_tip), std::end(ftqp_arm_tip), target.pose);
        target.has_rotation = FTQP_ARM_ROTATES;
        double worst = 0.0;
        auto status = ftqp_cpp::Status::ok;
        for (int k = 0; k < 1000; k++) {
            if (k == 300) planner.report(ftqp_locked(0));
            if (k == 600) planner.withdraw(0);
            status = planner.step(q, target);
            if (planner.brakes(brakes) > 0) throw std::runtime_error(planner.stopped_because());  // close them
            worst = std::max(worst, planner.error());
            std::copy_n(planner.q(), q.size(), q.begin());
        }
        std::printf("1000 steps, worst error %.4f mm, at the end: %s\n", 1e3 * worst, ftqp_cpp::name(status));
    } catch (const std::exception &mistake) {
        std::fprintf(stderr, "%s\n", mistake.what());
        return 1;
    }
    return 0;
}
