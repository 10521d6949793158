#include "ftqp_controller/ftqp_controller.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <sstream>
#include <string_view>

#include "hardware_interface/types/hardware_interface_type_values.hpp"
#include "pluginlib/class_list_macros.hpp"

namespace ftqp_controller {

using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::interface_configuration_type;
using controller_interface::return_type;

namespace {

constexpr double LATE = 0.01;        // share by which the loop's period may differ from the planner's
constexpr int THROTTLED = 1000;      // milliseconds between two warnings of a kind
constexpr std::size_t ROOM = 160;    // letters of a text in the status, so that nothing is allocated in the loop
constexpr std::size_t FIRST_JOINT = 5;  // of the values of the status, behind those of the whole arm
constexpr const char *OF_ARM[FIRST_JOINT] = {"tip_error", "late_ticks", "stopped_because", "brakes", "clearance"};
constexpr double DIAGNOSTICS = 1.0;     // seconds between two messages on /diagnostics, as is usual there
// What a drive says in JOINT/fault_interface.
enum : int { WELL = 0, LOCKED = 1, FREE = 2, WEAK = 3, SENSOR = 4 };

void put(std::string &text, const char *form, double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, form, value);
    text.assign(digits);
}

}  // namespace

bool fault_from(const std::string &words, int joint, ftqp_fault &fault) {
    std::istringstream in(words);
    std::string kind, said;
    in >> kind;
    if (kind == "locked")
        fault = ftqp_locked(joint);
    else if (kind == "free_swinging")
        fault = ftqp_free_swinging(joint);
    else if (kind == "degraded")
        fault = ftqp_degraded(joint);
    else
        return false;
    while (in >> said) {
        const auto at = said.find('=');
        if (at == std::string::npos) return false;
        const std::string key = said.substr(0, at), value = said.substr(at + 1);
        if (key == "mode" && (value == "ramp" || value == "instant")) {
            fault.mode = value == "instant" ? FTQP_INSTANT : FTQP_RAMP;
            continue;
        }
        double number = 0.0;
        try {
            std::size_t used = 0;
            number = std::stod(value, &used);
            if (used != value.size()) return false;
        } catch (const std::exception &) {
            return false;
        }
        if (key == "deceleration") fault.deceleration = number;
        else if (key == "damping") fault.damping = number;
        else if (key == "friction") fault.friction = number;
        else if (key == "velocity") fault.velocity = number;
        else if (key == "acceleration") fault.acceleration = number;
        else if (key == "torque") fault.torque = number;
        else if (key == "q_min") fault.q_min = number;
        else if (key == "q_max") fault.q_max = number;
        else return false;
    }
    return true;
}

CallbackReturn FtqpController::on_init() {
    try {
        listener_ = std::make_shared<ParamListener>(get_node());
        given_ = listener_->get_params();
    } catch (const std::exception &error) {
        RCLCPP_ERROR(get_node()->get_logger(), "parameters: %s", error.what());
        return CallbackReturn::ERROR;
    }
    return CallbackReturn::SUCCESS;
}

std::vector<std::string> FtqpController::names(const std::string &interface) const {
    std::vector<std::string> found;
    for (const auto &joint : given_.joints) found.push_back(joint + "/" + interface);
    return found;
}

const char *FtqpController::sent_interface() const {
    switch (planner_->drive()) {
        case FTQP_SENDS_VELOCITIES: return hardware_interface::HW_IF_VELOCITY;
        case FTQP_SENDS_TORQUES: return hardware_interface::HW_IF_EFFORT;
        default: return hardware_interface::HW_IF_POSITION;
    }
}

InterfaceConfiguration FtqpController::command_interface_configuration() const {
    return {interface_configuration_type::INDIVIDUAL, names(sent_interface())};
}

InterfaceConfiguration FtqpController::state_interface_configuration() const {
    std::vector<std::string> wanted = names(hardware_interface::HW_IF_POSITION);
    if (!given_.fault_interface.empty())
        for (const auto &name : names(given_.fault_interface)) wanted.push_back(name);
    return {interface_configuration_type::INDIVIDUAL, wanted};
}

CallbackReturn FtqpController::on_configure(const rclcpp_lifecycle::State &) {
    const auto logger = get_node()->get_logger();
    given_ = listener_->get_params();
    try {
        planner_ = std::make_unique<ftqp_cpp::Planner>(ftqp_cpp::Planner::from_file(given_.arm_file));
    } catch (const std::exception &error) {
        RCLCPP_ERROR(logger, "arm_file '%s': %s", given_.arm_file.c_str(), error.what());
        return CallbackReturn::FAILURE;
    }
    const std::size_t n = static_cast<std::size_t>(planner_->joints());
    dt_ = planner_->dt();
    if (n != given_.joints.size()) {
        RCLCPP_ERROR(logger, "joints has %zu names, expected %zu, as arm_file has; see its arm.h", given_.joints.size(), n);
        return CallbackReturn::FAILURE;
    }
    const unsigned int rate = get_update_rate();
    if (rate != 0 && std::fabs(rate * dt_ - 1.0) > LATE) {
        RCLCPP_ERROR(logger, "the controller is updated %u times a second, expected %.6g, as arm_file was built; set update_rate",
                     rate, 1.0 / dt_);
        return CallbackReturn::FAILURE;
    }
    if (given_.things.size() > static_cast<std::size_t>(planner_->things())) {
        RCLCPP_ERROR(logger, "things has %zu names, expected at most %d, as arm_file has; see its arm.h", given_.things.size(),
                     planner_->things());
        return CallbackReturn::FAILURE;
    }
    q_.assign(n, 0.0);
    word_.assign(n, WELL);
    counted_.assign(n, WELL);
    conditions_.assign(n, "healthy");
    found_.resize(n);
    brakes_.assign(n, 0);
    subscribe();
    return CallbackReturn::SUCCESS;
}

void FtqpController::subscribe() {
    const auto node = get_node();
    const auto qos = rclcpp::SystemDefaultsQoS();
    pose_ = node->create_subscription<geometry_msgs::msg::PoseStamped>(
        "~/target", qos, [this](const geometry_msgs::msg::PoseStamped &message) { hear_pose(message); });
    twist_ = node->create_subscription<geometry_msgs::msg::TwistStamped>(
        "~/target_twist", qos, [this](const geometry_msgs::msg::TwistStamped &message) { hear_twist(message); });
    fault_ = node->create_subscription<diagnostic_msgs::msg::KeyValue>(
        "~/fault", qos, [this](const diagnostic_msgs::msg::KeyValue &message) { hear_fault(message); });
    withdraw_ = node->create_subscription<std_msgs::msg::String>(
        "~/withdraw", qos, [this](const std_msgs::msg::String &message) {
            Order order;
            order.kind = Order::Kind::withdraw;
            order.joint = joint_of(message.data);
            if (order.joint >= 0) tell(order);
        });
    stop_ = node->create_subscription<std_msgs::msg::Bool>("~/stop", qos, [this](const std_msgs::msg::Bool &message) {
        Order order;
        order.kind = message.data ? Order::Kind::stop : Order::Kind::resume;
        tell(order);
    });
    tool_ = node->create_subscription<geometry_msgs::msg::PoseStamped>(
        "~/tool", qos, [this](const geometry_msgs::msg::PoseStamped &message) {
            Order order;
            order.kind = Order::Kind::tool;
            if (read_place(message, order)) tell(order);
        });
    load_ = node->create_subscription<geometry_msgs::msg::InertiaStamped>(
        "~/load", qos, [this](const geometry_msgs::msg::InertiaStamped &message) { hear_load(message); });
    things_.clear();
    for (std::size_t k = 0; k < given_.things.size(); k++)
        things_.push_back(node->create_subscription<geometry_msgs::msg::PoseStamped>(
            "~/things/" + given_.things[k], qos, [this, k](const geometry_msgs::msg::PoseStamped &message) {
                Order order;
                order.kind = Order::Kind::thing;
                order.joint = static_cast<int>(k);
                if (in_base(message.header.frame_id) && read_place(message, order)) tell(order);
            }));
    status_ = std::make_unique<realtime_tools::RealtimePublisher<Status>>(node->create_publisher<Status>("~/status", qos));
    status_->lock();
    Status &message = status_->msg_;
    message.name = node->get_name();
    message.hardware_id = given_.arm_file;
    message.message.reserve(ROOM);
    message.values.resize(FIRST_JOINT + given_.joints.size());
    for (std::size_t k = 0; k < FIRST_JOINT; k++) message.values[k].key = OF_ARM[k];
    for (std::size_t i = 0; i < given_.joints.size(); i++) message.values[FIRST_JOINT + i].key = given_.joints[i];
    const Status empty = message;
    for (auto &value : message.values) value.value.reserve(ROOM);
    status_->unlock();
    diagnostics_ = std::make_unique<realtime_tools::RealtimePublisher<Diagnostics>>(
        node->create_publisher<Diagnostics>("/diagnostics", qos));
    diagnostics_->lock();
    diagnostics_->msg_.status.assign(1, empty);
    diagnostics_->msg_.status[0].message.reserve(ROOM);
    for (auto &value : diagnostics_->msg_.status[0].values) value.value.reserve(ROOM);
    diagnostics_->unlock();
}

void FtqpController::tell(const Order &order) {
    if (!orders_.push(order))
        RCLCPP_WARN_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), THROTTLED,
                             "the loop does not listen; is the controller active?");
}

bool FtqpController::in_base(const std::string &frame) const {
    if (frame.empty() || given_.base_frame.empty() || frame == given_.base_frame) return true;
    RCLCPP_WARN_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), THROTTLED,
                         "a target is in frame '%s', expected '%s'; it is not followed", frame.c_str(),
                         given_.base_frame.c_str());
    return false;
}

int FtqpController::joint_of(const std::string &name) const {
    const auto found = std::find(given_.joints.begin(), given_.joints.end(), name);
    if (found != given_.joints.end()) return static_cast<int>(found - given_.joints.begin());
    RCLCPP_WARN(get_node()->get_logger(), "'%s' is not among the joints of this controller", name.c_str());
    return -1;
}

void FtqpController::hear_pose(const geometry_msgs::msg::PoseStamped &message) {
    if (!in_base(message.header.frame_id)) return;
    Order order;
    order.kind = Order::Kind::pose;
    if (read_place(message, order)) tell(order);
}

bool FtqpController::read_place(const geometry_msgs::msg::PoseStamped &message, Order &order) const {
    const auto &[position, orientation] = message.pose;
    order.place = {position.x, position.y, position.z};
    order.turn = {orientation.w, orientation.x, orientation.y, orientation.z};
    if (std::isfinite(norm(order.place)) && normalise(order.turn)) return true;
    RCLCPP_WARN_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), THROTTLED,
                         "a message is no pose: numbers must be finite and the quaternion of length 1");
    return false;
}

// About the centre of mass, along the axes of the arm's own tip, as geometry_msgs/Inertia has it; a mass of 0 puts it down.
void FtqpController::hear_load(const geometry_msgs::msg::InertiaStamped &message) {
    const auto &I = message.inertia;
    Order order;
    order.kind = Order::Kind::load;
    order.load = {I.m, {I.com.x, I.com.y, I.com.z}, {I.ixx, I.ixy, I.ixz, I.ixy, I.iyy, I.iyz, I.ixz, I.iyz, I.izz}};
    tell(order);
}

void FtqpController::hear_twist(const geometry_msgs::msg::TwistStamped &message) {
    if (!in_base(message.header.frame_id)) return;
    const auto &[linear, angular] = message.twist;
    Order order;
    order.kind = Order::Kind::twist;
    order.twist = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
    for (const double number : order.twist)
        if (!std::isfinite(number)) return;
    tell(order);
}

void FtqpController::hear_fault(const diagnostic_msgs::msg::KeyValue &message) {
    Order order;
    order.kind = Order::Kind::fault;
    const int joint = joint_of(message.key);
    if (joint < 0) return;
    if (!fault_from(message.value, joint, order.fault)) {
        RCLCPP_WARN(get_node()->get_logger(),
                    "'%s' says no fault; expected locked, free_swinging or degraded, then words such as velocity=0.5",
                    message.value.c_str());
        return;
    }
    tell(order);
}

CallbackReturn FtqpController::on_activate(const rclcpp_lifecycle::State &) {
    const auto logger = get_node()->get_logger();
    given_ = listener_->get_params();  // what may be changed is taken over here, where memory may be asked for
    lead_ = Lead({given_.max_linear_velocity, given_.max_linear_acceleration},
                 {given_.max_angular_velocity, given_.max_angular_acceleration}, dt_);
    const auto places = [](const auto &interfaces, const std::vector<std::string> &names, std::vector<std::size_t> &found) {
        found.clear();
        for (const auto &name : names)
            for (std::size_t k = 0; k < interfaces.size(); k++)
                if (interfaces[k].get_name() == name) found.push_back(k);
        return found.size() == names.size();
    };
    if (!places(state_interfaces_, names(hardware_interface::HW_IF_POSITION), reads_) ||
        !places(command_interfaces_, names(sent_interface()), writes_)) {
        RCLCPP_ERROR(logger, "not every joint has the interfaces position (state) and %s (command)", sent_interface());
        return CallbackReturn::ERROR;
    }
    words_.clear();
    if (!given_.fault_interface.empty() && !places(state_interfaces_, names(given_.fault_interface), words_)) {
        RCLCPP_ERROR(logger, "not every joint has the interface %s (state), which fault_interface names",
                     given_.fault_interface.c_str());
        return CallbackReturn::ERROR;
    }
    for (std::size_t i = 0; i < q_.size(); i++) q_[i] = state_interfaces_[reads_[i]].get_value();
    try {
        if (!planner_->reset(q_)) RCLCPP_WARN(logger, "the arm's positions: %s", ftqp_status_name(FTQP_BEYOND_LIMITS));
    } catch (const ftqp_cpp::Mistake &mistake) {
        RCLCPP_ERROR(logger, "the arm's positions: %s", mistake.what());
        return CallbackReturn::ERROR;
    }
    for (Order order; orders_.pop(order);) {
        if (order.kind == Order::Kind::fault || order.kind == Order::Kind::withdraw) obey(order);
    }
    target_ = {};
    target_.pose[0] = target_.pose[5] = target_.pose[10] = target_.pose[15] = target_.has_rotation = 1.0;
    follows_ = waits_ = false;
    since_target_ = since_status_ = 0.0;
    std::fill(word_.begin(), word_.end(), static_cast<double>(WELL));
    counted_ = word_;
    late_ = 0;
    rest();
    return CallbackReturn::SUCCESS;
}

// No more cycles come after this: what moves then is braked by the drives. Stop first, by ~/stop, or by waiting for
// target_timeout.
CallbackReturn FtqpController::on_deactivate(const rclcpp_lifecycle::State &) {
    double fastest = 0.0;
    for (std::size_t i = 0; i < q_.size(); i++) fastest = std::max(fastest, std::fabs(planner_->v()[i]));
    if (fastest > 1e-3)
        RCLCPP_WARN(get_node()->get_logger(), "deactivated while a joint moves at %.3g; stop the arm first, by ~/stop", fastest);
    for (std::size_t i = 0; i < q_.size(); i++) {
        if (planner_->drive() == FTQP_SENDS_VELOCITIES) (void)command_interfaces_[writes_[i]].set_value(0.0);
        if (planner_->drive() == FTQP_SENDS_POSITIONS) (void)command_interfaces_[writes_[i]].set_value(q_[i]);
    }
    follows_ = false;
    return CallbackReturn::SUCCESS;
}

// Brake within limits and hold, until a target comes.
void FtqpController::rest() {
    const int status = ftqp_status(planner_->get());
    waits_ = waits_ || (status != FTQP_STOPPING && status != FTQP_STOPPED);  // else it stopped of its own accord
    planner_->stop();
    follows_ = false;
}

void FtqpController::follow() {
    since_target_ = 0.0;
    if (follows_ || is_new_tool_) return;
    std::array<double, 16> tip{};
    if (!waits_ || ftqp_tip(planner_->get(), tip.data())) return;  // stopped otherwise, or before the first step
    if (!planner_->resume()) return;
    waits_ = false;
    lead_.begin(tip.data());
    follows_ = true;
}

void FtqpController::obey(const Order &order) {
    switch (order.kind) {
        case Order::Kind::pose:
            follow();
            lead_.aim(order.place, order.turn);
            break;
        case Order::Kind::twist:
            follow();
            lead_.jog({order.twist[0], order.twist[1], order.twist[2]}, {order.twist[3], order.twist[4], order.twist[5]});
            break;
        case Order::Kind::fault:
            (void)ftqp_report(planner_->get(), &order.fault);
            break;
        case Order::Kind::withdraw:
            (void)ftqp_withdraw(planner_->get(), order.joint);
            break;
        case Order::Kind::stop:
            planner_->stop();
            waits_ = false;
            follows_ = false;
            break;
        case Order::Kind::resume:
            if (waits_ || !planner_->resume()) break;
            planner_->stop();
            waits_ = true;
            break;
        case Order::Kind::thing: {
            double pose[16];
            write_pose(order.place, order.turn, pose);
            (void)ftqp_move(planner_->get(), order.joint, pose, nullptr);
            break;
        }
        case Order::Kind::tool: {
            double T[16];
            write_pose(order.place, order.turn, T);
            if (ftqp_status(planner_->get()) == FTQP_STOPPED) is_new_tool_ = ftqp_tool(planner_->get(), T) == 0;
            break;
        }
        case Order::Kind::load:
            if (ftqp_status(planner_->get()) == FTQP_STOPPED)
                (void)ftqp_carry(planner_->get(), order.load.mass == 0.0 ? nullptr : &order.load);
            break;
    }
}

// What is measured, and what drives say of themselves; a joint whose sensor is lost gives no number.
void FtqpController::read() {
    for (std::size_t i = 0; i < q_.size(); i++) q_[i] = state_interfaces_[reads_[i]].get_value();
    for (std::size_t i = 0; i < words_.size(); i++) {
        const double word = state_interfaces_[words_[i]].get_value();
        if (word == word_[i] && word != counted_[i]) take_word(i, word);
        word_[i] = word;
        if (counted_[i] == SENSOR) q_[i] = std::nan("");
    }
}

// What a drive has said in two periods. That it is well again withdraws nothing: that is a person's to say, ~/withdraw.
void FtqpController::take_word(std::size_t i, double word) {
    const int joint = static_cast<int>(i);
    Order order;
    order.kind = Order::Kind::fault;
    order.fault = word == FREE ? ftqp_free_swinging(joint) : word == WEAK ? ftqp_degraded(joint) : ftqp_locked(joint);
    order.fault.velocity = order.fault.acceleration = order.fault.torque = word == WEAK ? given_.weak_share : 1.0;
    if (word == LOCKED || word == FREE || word == WEAK) {
        if (word == FREE && !planner_->has(FTQP_HAS_FREE_JOINTS)) order.fault = ftqp_locked(joint);
        obey(order);
    } else if (word != WELL && word != SENSOR) {
        RCLCPP_WARN_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), THROTTLED,
                             "the drive of %s says %g in %s, expected 0 to 4", given_.joints[i].c_str(), word,
                             given_.fault_interface.c_str());
        return;
    }
    counted_[i] = word;
}

// What is believed of each joint, and whether the planner has found that by itself.
void FtqpController::look_at_joints() {
    static constexpr const char *believed[] = {"healthy", "locked", "free_swinging", "degraded"};
    for (std::size_t i = 0; i < conditions_.size(); i++)
        conditions_[i] = believed[planner_->believed(static_cast<int>(i))];
    if (!planner_->has(FTQP_HAS_DETECTOR)) return;
    const int count = ftqp_detect(planner_->get(), found_.data(), static_cast<int>(found_.size()));
    for (int k = 0; k < count; k++) {
        const auto &one = found_[static_cast<std::size_t>(k)];
        conditions_[static_cast<std::size_t>(one.joint)] = one.kinds & FTQP_FOUND_LOCKED          ? "found locked"
                                                           : one.kinds & FTQP_FOUND_FREE_SWINGING ? "found free_swinging"
                                                           : one.kinds & FTQP_FOUND_RUNAWAY       ? "found running away"
                                                                                                  : "found without sensor";
    }
}

return_type FtqpController::update(const rclcpp::Time &, const rclcpp::Duration &period) {
    read();
    const int ticks = std::clamp(static_cast<int>(std::lround(period.seconds() / dt_)), 1, FTQP_MOST_TICKS);
    late_ += ticks - 1;
    since_target_ += period.seconds();
    since_status_ += period.seconds();
    since_diagnostics_ += period.seconds();
    for (Order order; orders_.pop(order);) obey(order);
    if (follows_ && given_.target_timeout > 0.0 && since_target_ > given_.target_timeout) rest();
    if (follows_) {
        for (int k = 0; k < ticks; k++) lead_.next();
        lead_.write(target_);
    }
    const int status = ftqp_step(planner_->get(), q_.data(), nullptr, &target_, ticks);
    if (status < 0) {
        RCLCPP_ERROR_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), THROTTLED, "%s", ftqp_status_name(status));
        return return_type::ERROR;
    }
    is_new_tool_ = false;
    send();
    if (since_status_ * given_.status_rate >= 1.0) publish(status);
    return return_type::OK;
}

void FtqpController::send() {
    const int drive = planner_->drive();
    const double *command = drive == FTQP_SENDS_POSITIONS    ? planner_->q()
                            : drive == FTQP_SENDS_VELOCITIES ? planner_->v()
                                                             : planner_->tau();
    for (std::size_t i = 0; i < q_.size(); i++) (void)command_interfaces_[writes_[i]].set_value(command[i]);
}

void FtqpController::publish(int status) {
    look_at_joints();
    if (status_->trylock()) {
        since_status_ = 0.0;
        fill(status_->msg_, status);
        status_->unlockAndPublish();
    }
    if (since_diagnostics_ >= DIAGNOSTICS && diagnostics_->trylock()) {
        since_diagnostics_ = 0.0;
        fill(diagnostics_->msg_.status[0], status);
        diagnostics_->msg_.header.stamp = get_node()->now();
        diagnostics_->unlockAndPublish();
    }
}

void FtqpController::fill(Status &message, int status) const {
    message.level = waits_ || status == FTQP_OK ? Status::OK : status >= FTQP_FALLBACK && status != FTQP_HELD ? Status::ERROR : Status::WARN;
    for (const char *condition : conditions_)
        if (message.level == Status::OK && std::string_view(condition) != "healthy") message.level = Status::WARN;
    message.message.assign(waits_ ? "waits for a target" : ftqp_status_name(status));
    put(message.values[0].value, "%.6g", follows_ ? planner_->error() : 0.0);
    put(message.values[1].value, "%.0f", static_cast<double>(late_));
    message.values[2].value.assign(waits_ ? "" : planner_->stop_reason() ? planner_->stopped_because() : "");
    put(message.values[3].value, "%.0f", static_cast<double>(planner_->brakes()));
    put(message.values[4].value, "%.4g", planner_->clearance());
    for (std::size_t i = 0; i < q_.size(); i++) message.values[FIRST_JOINT + i].value.assign(conditions_[i]);
}

}  // namespace ftqp_controller

PLUGINLIB_EXPORT_CLASS(ftqp_controller::FtqpController, controller_interface::ControllerInterface)
