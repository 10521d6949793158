// ftqp.hpp - ftqp.h for C++17: memory that frees itself, enumerations with names, arrays of any kind.
#ifndef FTQP_HPP
#define FTQP_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "ftqp.h"

namespace ftqp_cpp {

enum class Status : int {
    ok = FTQP_OK, relaxed = FTQP_RELAXED, scaled = FTQP_SCALED, lagging = FTQP_LAGGING, fallback = FTQP_FALLBACK,
    stopping = FTQP_STOPPING, stopped = FTQP_STOPPED, invalid_input = FTQP_INVALID_INPUT,
    held = FTQP_HELD
};

// A mistake of the program; what() is the library's sentence.
class Mistake : public std::runtime_error {
public:
    explicit Mistake(int code) : std::runtime_error(ftqp_status_name(code)), code_(code) {}
    Mistake(int code, const std::string &text) : std::runtime_error(text), code_(code) {}
    int code() const noexcept { return code_; }

private:
    int code_;
};

inline const char *name(Status status) noexcept { return ftqp_status_name(static_cast<int>(status)); }

// A planner and its memory. Making it allocates; nothing else does.
class Planner {
public:
    // From the bytes of arm.ftqp for the arm of arm.h: FTQP_ARM_JOINTS, FTQP_ARM_FINGERPRINT. Throws Mistake.
    Planner(const void *file, std::size_t bytes, int joints, std::uint64_t fingerprint) {
        make(file, bytes);
        check(ftqp_open_for(get(), file, bytes, joints, fingerprint));
    }

    // The same for whatever arm the file is of.
    Planner(const void *file, std::size_t bytes) {
        make(file, bytes);
        check(ftqp_open(get(), file, bytes));
    }

    // From a file. Throws Mistake, or std::runtime_error where it cannot be read.
    static Planner from_file(const std::string &path, int joints, std::uint64_t fingerprint) {
        const std::vector<char> bytes = read(path);
        return Planner(bytes.data(), bytes.size(), joints, fingerprint);
    }
    static Planner from_file(const std::string &path) {
        const std::vector<char> bytes = read(path);
        return Planner(bytes.data(), bytes.size());
    }

    // Another planner in the same state.
    Planner copy() const {
        Planner other;
        other.size_ = size_;
        other.memory_ = taken(size_);
        std::memcpy(other.memory_.get(), memory_.get(), size_);
        return other;
    }

    // Arrays are vectors, std::array, C arrays and the like, of joints() numbers, else Mistake is thrown; or pointers to
    // so many, which nobody checks. False warns of a start beyond the arm's limits, FTQP_BEYOND_LIMITS.
    template <class Q> bool reset(const Q &q) { return checked(ftqp_reset(get(), data(q), nullptr)) == 0; }
    template <class Q, class V> bool reset(const Q &q, const V &v) { return checked(ftqp_reset(get(), data(q), data(v))) == 0; }

    // One step. Throws Mistake only: what the world does is a status.
    template <class Q> Status step(const Q &q, const ftqp_target &target, int ticks = 1) {
        return status(ftqp_step(get(), data(q), nullptr, &target, ticks));
    }
    template <class Q, class V> Status step(const Q &q, const V &v, const ftqp_target &target, int ticks = 1) {
        return status(ftqp_step(get(), data(q), data(v), &target, ticks));
    }

    // The same along the path of the file.
    template <class Q> Status follow(const Q &q, int ticks = 1) { return status(ftqp_follow(get(), data(q), nullptr, ticks)); }
    void begin() { check(ftqp_begin(get())); }
    void speed(double share) { check(ftqp_speed(get(), share)); }
    double progress() const noexcept { return ftqp_progress(get()); }

    // To a posture, straight, or round what is kept, or to a pose: FTQP_MOVING and others say where the arm stands on its
    // way. The last two allocate memory of their own, at the first call.
    template <class Q> void go_to(const Q &goal) { check(ftqp_go_to(get(), data(goal))); }
    template <class Q> void go_round(const Q &goal) { check(ftqp_go_round(get(), search(), data(goal))); }
    void go_to_pose(const std::array<double, 16> &pose) { check(ftqp_go_to_pose(get(), search(), pose.data())); }
    template <class Q> Status go(const Q &q) { return status(ftqp_go(get(), data(q), nullptr)); }
    template <class Q, class V> Status go(const Q &q, const V &v) { return status(ftqp_go(get(), data(q), data(v))); }
    int arrived() const { return checked(ftqp_arrived(get())); }

    // A posture for a pose, in at most so many looks; empty where none was found. It allocates memory of its own.
    std::vector<double> posture(const std::array<double, 16> &pose, int looks = 10000) const {
        const Memory memory = taken(ftqp_search_size());
        ftqp_search *search = reinterpret_cast<ftqp_search *>(memory.get());
        std::vector<double> q(static_cast<std::size_t>(joints()));
        const int begun = ftqp_seek(get(), search, pose.data());
        const int found = begun ? begun : ftqp_find(search, looks, q.data());
        if (found == 0 || found == FTQP_NO_POSTURE) return {};
        checked(found);
        return q;
    }

    // Ways out of where the arm is stuck, all of them, in the order in which they are tried; a loop that must not wait calls
    // ftqp_ways_out and ftqp_try. out() goes one of a kind, by go(). It allocates memory of its own.
    template <class Q> std::vector<ftqp_way> ways_out(const Q &home) {
        if (!ways_) ways_ = taken(ftqp_ways_size(get()));
        check(ftqp_ways_out(get(), ways(), data(home)));
        std::vector<ftqp_way> found;
        ftqp_way way{};
        for (int code = 0; (code = ftqp_try(ways(), 10000, &way)) != FTQP_NO_WAY;)
            if (checked(code) == 1) found.push_back(way);
        return found;
    }
    void out(int kind) { check(ftqp_go_out(get(), ways(), kind)); }

    void report(const ftqp_fault &fault) { check(ftqp_report(get(), &fault)); }
    int believed(int joint) const { return checked(ftqp_believed(get(), joint)); }
    void withdraw(int joint) { check(ftqp_withdraw(get(), joint)); }
    void stop() { check(ftqp_stop(get())); }
    bool resume() { return checked(ftqp_resume(get())) == 1; }
    void carry(const ftqp_load &load) { check(ftqp_carry(get(), &load)); }
    void put_down() { check(ftqp_carry(get(), nullptr)); }
    void tool(const std::array<double, 16> &T) { check(ftqp_tool(get(), T.data())); }
    void own_tip() { check(ftqp_tool(get(), nullptr)); }
    void brake(int joint) { check(ftqp_brake(get(), joint)); }

    // Further tasks and things in the scene, by their numbers in arm.h. False: the target cannot be used, the last one stays.
    int tasks() const { return checked(ftqp_tasks(get())); }
    bool aim(int task, const ftqp_target &target) { return usable(ftqp_aim(get(), task, &target)); }
    template <class Q> bool aim_joints(int task, const Q &q) { return usable(ftqp_aim_joints(get(), task, data(q))); }
    void weight(int task, double weight) { check(ftqp_weight(get(), task, weight)); }
    std::array<double, 6> task_error(int task) const {
        std::array<double, 6> error{};
        check(ftqp_task_error(get(), task, error.data()));
        return error;
    }
    int things() const { return checked(ftqp_things(get())); }
    bool move(int thing, const std::array<double, 16> &pose) { return usable(ftqp_move(get(), thing, pose.data(), nullptr)); }
    bool move(int thing, const std::array<double, 16> &pose, const std::array<double, 6> &twist) {
        return usable(ftqp_move(get(), thing, pose.data(), twist.data()));
    }
    double clearance() const noexcept { return ftqp_clearance(get()); }

    // Whether the planner has something, FTQP_HAS_...
    bool has(int what) const { return checked(ftqp_has(get(), what)) == 1; }

    // After each step: 0 quiet, 1 a suspicion, 2 something was found, or withdrawn.
    int watch() { return checked(ftqp_watch(get(), nullptr)); }
    template <class Tau> int watch(const Tau &tau) { return checked(ftqp_watch(get(), data(tau))); }
    std::vector<ftqp_finding> findings() {
        std::vector<ftqp_finding> found(static_cast<std::size_t>(joints()));
        found.resize(static_cast<std::size_t>(checked(ftqp_detect(get(), found.data(), joints()))));
        return found;
    }

    const double *q() const noexcept { return ftqp_q(get()); }
    const double *v() const noexcept { return ftqp_v(get()); }
    const double *a() const noexcept { return ftqp_a(get()); }
    const double *tau() const noexcept { return ftqp_tau(get()); }
    // After each step: which joints ask for their brakes, 1 each into an array of ints; how many.
    template <class Asks> int brakes(Asks &asks) const { return checked(ftqp_brakes(get(), data(asks))); }
    int brakes() const { return checked(ftqp_brakes(get(), nullptr)); }

    // Why a stop is latched, FTQP_STOP_...; and its sentence.
    int stop_reason() const { return checked(ftqp_stop_reason(get())); }
    const char *stopped_because() const noexcept { return ftqp_stop_reason_name(ftqp_stop_reason(get())); }
    double error() const noexcept { return ftqp_error(get()); }
    double dt() const noexcept { return ftqp_dt(get()); }
    int drive() const noexcept { return ftqp_drive(get()); }
    int joints() const noexcept { return ftqp_joints(get()); }
    std::array<double, 16> tip() const {
        std::array<double, 16> pose{};
        check(ftqp_tip(get(), pose.data()));
        return pose;
    }

    // The planner as the functions of ftqp.h take it.
    ftqp *get() noexcept { return reinterpret_cast<ftqp *>(memory_.get()); }
    const ftqp *get() const noexcept { return reinterpret_cast<const ftqp *>(memory_.get()); }

private:
    Planner() = default;
    struct Free {
        void operator()(unsigned char *memory) const noexcept {
            ::operator delete(memory, std::align_val_t{FTQP_ALIGNMENT});
        }
    };
    using Memory = std::unique_ptr<unsigned char, Free>;
    static Memory taken(std::size_t bytes) {
        return Memory(static_cast<unsigned char *>(::operator new(bytes, std::align_val_t{FTQP_ALIGNMENT})));
    }
    static std::vector<char> read(const std::string &path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) throw std::runtime_error(path + " cannot be read");
        return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }
    void make(const void *file, std::size_t bytes) {
        check(ftqp_size(file, bytes, &size_));
        memory_ = taken(size_);
    }
    template <class T> auto data(T &numbers) const {
        if constexpr (std::is_pointer_v<T> || std::is_null_pointer_v<T>) {
            return numbers;
        } else {
            if (std::size(numbers) != static_cast<std::size_t>(joints()))
                throw Mistake(FTQP_BAD_LENGTH, "an array has " + std::to_string(std::size(numbers)) + " numbers, expected " +
                                                   std::to_string(joints()) + ", one a joint");
            return std::data(numbers);
        }
    }
    static int checked(int code) {
        if (code < 0) throw Mistake(code);
        return code;
    }
    static void check(int code) { checked(code); }
    static bool usable(int code) { return code == FTQP_NO_POSE ? false : checked(code) == 0; }
    static Status status(int code) { return static_cast<Status>(checked(code)); }

    std::size_t size_ = 0;
    ftqp_search *search() {
        if (!search_) search_ = taken(ftqp_search_size());
        return reinterpret_cast<ftqp_search *>(search_.get());
    }
    ftqp_ways *ways() { return reinterpret_cast<ftqp_ways *>(ways_.get()); }
    Memory memory_, search_, ways_;
};

}  // namespace ftqp_cpp
#endif
