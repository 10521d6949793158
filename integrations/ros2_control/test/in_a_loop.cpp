// The controller in a loop of 1 kHz, some of whose periods are late, on stand-ins for ROS and an arm that does what it is
// told: it follows, loses a joint, stops when nobody asks for anything, and no joint ever breaks a limit.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <random>

#include "arm.h"
#include "ftqp_controller/ftqp_controller.hpp"

using namespace ftqp_controller;
using controller_interface::CallbackReturn;
using diagnostic_msgs::msg::DiagnosticStatus;
using diagnostic_msgs::msg::KeyValue;
using geometry_msgs::msg::PoseStamped;
using geometry_msgs::msg::TwistStamped;

static long allocations = 0;
void *operator new(std::size_t size) {
    allocations++;
    if (void *memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
void operator delete(void *memory) noexcept { std::free(memory); }
void operator delete(void *memory, std::size_t) noexcept { std::free(memory); }

namespace {

constexpr int N = FTQP_ARM_JOINTS;
int failures = 0;

void expect(bool holds, const char *what) {
    if (!holds) failures++;
    std::printf("%s  %s\n", holds ? "yes" : "NO ", what);
}

struct Arm {
    FtqpController controller;
    double q[N] = {}, sent[N] = {}, v[N] = {}, word[N] = {};
    int jammed = -1;  // a joint that stands although nobody says so
    double worst_speed = 0.0, worst_acceleration = 0.0;
    std::mt19937 random{1};
    bool late = false;
    long allocated = 0;  // in updates

    CallbackReturn configure(const std::string &file, unsigned int rate, const char *interface) {
        auto &params = ParamListener::given();
        params = {};
        params.arm_file = file;
        params.base_frame = "base";
        params.fault_interface = "fault";
        params.things = {"ball"};
        params.joints.assign(ftqp_arm_joints, ftqp_arm_joints + N);
        controller.init("ftqp", rate);
        const auto found = controller.on_configure({});
        if (found != CallbackReturn::SUCCESS) return found;
        std::vector<hardware_interface::LoanedCommandInterface> commands;
        std::vector<hardware_interface::LoanedStateInterface> states;
        for (int i = N - 1; i >= 0; i--) {  // in another order than the controller's
            commands.emplace_back(std::string(ftqp_arm_joints[i]) + "/" + interface, &sent[i]);
            states.emplace_back(std::string(ftqp_arm_joints[i]) + "/position", &q[i]);
            states.emplace_back(std::string(ftqp_arm_joints[i]) + "/fault", &word[i]);
        }
        for (int i = 0; i < N; i++) q[i] = sent[i] = ftqp_arm_neutral[i];
        controller.assign_interfaces(std::move(commands), std::move(states));
        return controller.on_activate({});
    }

    template <class Message> void tell(const char *topic, const Message &message) {
        controller.get_node()->deliver(topic, message);
    }

    // A command goes from tick to tick of the planner, also in the ticks that a late loop has missed.
    void run(double seconds, const PoseStamped *pose = nullptr, const TwistStamped *twist = nullptr) {
        for (double t = 0.0; t < seconds;) {
            const int ticks = late && random() % 20 == 0 ? 2 + static_cast<int>(random() % 4) : 1;
            const double period = ticks * FTQP_ARM_DT;
            if (pose) tell("~/target", *pose);
            if (twist) tell("~/target_twist", *twist);
            const long before = allocations;
            const auto found = controller.update(rclcpp::Time(), rclcpp::Duration::from_seconds(period));
            allocated += allocations - before;
            expect_quietly(found == controller_interface::return_type::OK);
            for (int i = 0; i < N; i++) {
                if (i == jammed) {
                    v[i] = 0.0;
                    continue;
                }
                const double speed = (sent[i] - q[i]) / period;
                worst_speed = std::max(worst_speed, std::fabs(speed) / ftqp_arm_v_max[i]);
                if (ticks == 1)
                    worst_acceleration = std::max(worst_acceleration, std::fabs(speed - v[i]) / FTQP_ARM_DT / ftqp_arm_a_max[i]);
                v[i] = speed;
                q[i] = sent[i];
            }
            t += period;
        }
    }
    void expect_quietly(bool holds) { failures += !holds; }

    double fastest() const {
        double most = 0.0;
        for (const double speed : v) most = std::max(most, std::fabs(speed));
        return most;
    }
    const DiagnosticStatus &status() const { return controller.get_node()->published<DiagnosticStatus>("~/status").last; }
    double error() const { return std::atof(status().values[0].value.c_str()); }
    const std::string &condition(int joint) const { return status().values[static_cast<std::size_t>(5 + joint)].value; }
};

PoseStamped pose_at(double dx, double dy, double dz) {
    PoseStamped message;
    const Quaternion turn = quaternion_of(ftqp_arm_tip);
    message.header.frame_id = "base";
    message.pose.position = {ftqp_arm_tip[3] + dx, ftqp_arm_tip[7] + dy, ftqp_arm_tip[11] + dz};
    message.pose.orientation = {turn[1], turn[2], turn[3], turn[0]};
    return message;
}

}  // namespace

int main(int count, char **arguments) {
    const std::string file = count > 1 ? arguments[1] : "arm.ftqp";
    {
        Arm arm;
        expect(arm.configure("no such file", 1000, "position") == CallbackReturn::FAILURE, "a file that is missing is refused");
        expect(arm.configure(file, 500, "position") == CallbackReturn::FAILURE, "a loop of another period is refused");
        std::printf("     %s\n", rclcpp::Logger::said().c_str());
        expect(arm.configure(file, 1000, "velocity") == CallbackReturn::ERROR, "interfaces of another kind are refused");
    }
    Arm arm;
    expect(arm.configure(file, 1000, "position") == CallbackReturn::SUCCESS, "it is configured and activated");
    arm.run(0.2);
    expect(arm.fastest() < 1e-12 && arm.status().message == "waits for a target", "without a target the arm stands");

    PoseStamped goal = pose_at(-0.05, 0.1, 0.05);
    arm.run(3.0, &goal);
    expect(arm.status().level == DiagnosticStatus::OK && arm.error() < 1e-4, "the tip goes to a pose that jumps");
    std::printf("     tip error %.2e m\n", arm.error());

    arm.late = true;
    arm.tell("~/fault", KeyValue{ftqp_arm_joints[2], "locked"});
    goal = pose_at(0.0, 0.0, 0.0);
    arm.run(0.2, &goal);
    arm.allocated = 0;
    arm.run(2.8, &goal);
    expect(arm.allocated == 0, "the loop allocates nothing");
    expect(arm.condition(2) == "locked" && arm.v[2] == 0.0, "a joint that locked stands, and the status names it");
    expect(arm.error() < 1e-4, "the tip goes on without it, in a loop with late periods");
    std::printf("     tip error %.2e m, %s late ticks\n", arm.error(), arm.status().values[1].value.c_str());
    arm.late = false;
    arm.tell("~/withdraw", std_msgs::msg::String{ftqp_arm_joints[2]});

    TwistStamped twist;
    twist.twist.linear.y = 0.1;
    arm.run(0.4, nullptr, &twist);
    expect(arm.fastest() > 1e-2, "the tip goes along a twist");
    arm.run(1.5);
    expect(arm.fastest() < 1e-9 && arm.status().message == "waits for a target", "a target that no longer comes stops the arm");
    arm.run(0.3, nullptr, &twist);
    expect(arm.fastest() > 1e-2, "the next one leads it again");

    arm.tell("~/stop", std_msgs::msg::Bool{true});
    arm.run(1.0, &goal);
    expect(arm.fastest() < 1e-9 && arm.status().level == DiagnosticStatus::ERROR, "a stop stops, whatever targets come");
    arm.tell("~/stop", std_msgs::msg::Bool{false});
    arm.run(2.0, &goal);
    expect(arm.status().level == DiagnosticStatus::OK, "and is released");

    const double before = arm.q[0];
    auto bad = goal;
    bad.header.frame_id = "camera";
    arm.tell("~/target", bad);
    bad = goal;
    bad.pose.position.x = NAN;
    arm.tell("~/target", bad);
    bad = goal;
    bad.pose.orientation = {0, 0, 0, 0};
    arm.tell("~/target", bad);
    arm.tell("~/fault", KeyValue{"elbow", "locked"});
    for (const char *words : {"", "broken", "locked mode=", "degraded velocity=x", "degraded velocity=0", "degraded torque=nan"})
        arm.tell("~/fault", KeyValue{ftqp_arm_joints[0], words});
    arm.run(0.3, &goal);
    expect(std::fabs(arm.q[0] - before) < 1e-3 && arm.condition(0) == "healthy", "what makes no sense changes nothing");

    arm.tell("~/stop", std_msgs::msg::Bool{true});
    arm.run(1.0);
    std::printf("     clearance %s m\n", arm.status().values[4].value.c_str());
    arm.tell("~/things/ball", pose_at(0.0, 0.3, 0.0));
    arm.run(0.2);
    expect(std::fabs(std::atof(arm.status().values[4].value.c_str()) - 0.1) < 0.1, "a thing that was moved is seen");
    arm.tell("~/things/ball", pose_at(0.0, 9.0, 0.0));
    geometry_msgs::msg::InertiaStamped load;
    load.inertia.m = 0.5;
    load.inertia.com = {0.0, 0.0, 0.05};
    arm.tell("~/load", load);
    PoseStamped tool;
    tool.pose.position = {0.0, 0.0, 0.1};
    arm.tell("~/tool", tool);
    arm.run(0.01);
    arm.tell("~/stop", std_msgs::msg::Bool{false});
    goal = pose_at(0.1 * ftqp_arm_tip[2], 0.1 * ftqp_arm_tip[6], 0.1 * ftqp_arm_tip[10]);
    arm.run(2.0, &goal);
    expect(arm.error() < 1e-4, "a tool and a load are counted on");

    arm.word[4] = 1.0;
    arm.run(0.001, &goal);
    arm.word[4] = 0.0;
    arm.run(0.2, &goal);
    expect(arm.condition(4) == "healthy", "what a drive says once is not believed");
    arm.word[4] = 1.0;
    arm.run(0.3, &goal);
    expect(arm.condition(4) == "locked", "a drive that says that its joint is locked is believed");
    arm.word[4] = 0.0;
    arm.run(0.2, &goal);
    expect(arm.condition(4) == "locked", "and not taken back because it no longer says so");
    arm.tell("~/withdraw", std_msgs::msg::String{ftqp_arm_joints[4]});
    arm.word[5] = 3.0;
    arm.run(0.2, &goal);
    expect(arm.condition(5) == "degraded" && arm.status().level == DiagnosticStatus::WARN, "a weak drive is spared");
    arm.word[5] = 9.0;
    arm.run(0.2, &goal);
    expect(arm.condition(5) == "degraded", "a word that nobody knows changes nothing");
    std::printf("     %s\n", rclcpp::Logger::said().c_str());
    arm.word[5] = 0.0;
    arm.tell("~/withdraw", std_msgs::msg::String{ftqp_arm_joints[5]});

    arm.jammed = 3;
    for (int k = 0; k < 8 && arm.condition(3) == "healthy"; k++) {
        goal = pose_at(0.0, k % 2 ? 0.1 : -0.1, 0.05 * k);
        arm.run(1.0, &goal);
    }
    expect(arm.condition(3) == "found locked", "a joint that stands unannounced is found, named and counted on");
    using diagnostic_msgs::msg::DiagnosticArray;
    const auto &all = arm.controller.get_node()->published<DiagnosticArray>("/diagnostics");
    expect(all.count > 5 && all.last.status.at(0).values.at(5 + 3).value == "found locked", "and so it is told on /diagnostics");

    arm.q[1] = NAN;
    arm.run(0.001, &goal);
    expect(std::isfinite(arm.sent[1]), "an encoder that says nothing is no command that is none");

    arm.tell("~/stop", std_msgs::msg::Bool{true});
    arm.run(1.0);
    expect(arm.controller.on_deactivate({}) == CallbackReturn::SUCCESS, "it is deactivated");
    std::printf("     largest share of a speed limit %.4f, of an acceleration limit %.4f\n", arm.worst_speed, arm.worst_acceleration);
    expect(arm.worst_speed <= 1.0 + 1e-9 && arm.worst_acceleration <= 1.0 + 1e-6, "every limit was kept");
    return failures ? EXIT_FAILURE : EXIT_SUCCESS;
}
