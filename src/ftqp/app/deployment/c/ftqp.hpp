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
#include <vector>

#include "ftqp.h"

namespace ftqp_cpp {

enum class Status : int {
    ok = FTQP_OK, relaxed = FTQP_RELAXED, scaled = FTQP_SCALED, lagging = FTQP_LAGGING, fallback = FTQP_FALLBACK,
    stopping = FTQP_STOPPING, stopped = FTQP_STOPPED, invalid_input = FTQP_INVALID_INPUT
};

// A mistake of the program; what() is the library's sentence.
class Mistake : public std::runtime_error {
public:
    explicit Mistake(int code) : std::runtime_error(ftqp_status_name(code)), code_(code) {}
    int code() const noexcept { return code_; }

private:
    int code_;
};

inline const char *name(Status status) noexcept { return ftqp_status_name(static_cast<int>(status)); }

// A planner and its memory. Making it allocates; nothing else does.
class Planner {
public:
    // From the bytes of arm.ftqp. Throws Mistake.
    Planner(const void *file, std::size_t bytes) {
        std::size_t need = 0;
        check(ftqp_size(file, bytes, &need));
        size_ = need;
        memory_.reset(static_cast<unsigned char *>(::operator new(need, std::align_val_t{FTQP_ALIGNMENT})));
        check(ftqp_open(get(), file, bytes));
    }

    // From a file. Throws Mistake, or std::runtime_error where it cannot be read.
    static Planner from_file(const std::string &path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) throw std::runtime_error(path + " cannot be read");
        const std::vector<char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
        return Planner(bytes.data(), bytes.size());
    }

    // Another planner in the same state.
    Planner copy() const {
        Planner other;
        other.size_ = size_;
        other.memory_.reset(static_cast<unsigned char *>(::operator new(size_, std::align_val_t{FTQP_ALIGNMENT})));
        std::memcpy(other.memory_.get(), memory_.get(), size_);
        return other;
    }

    template <class Q> void reset(const Q &q) { check(ftqp_reset(get(), data(q), nullptr)); }
    template <class Q, class V> void reset(const Q &q, const V &v) { check(ftqp_reset(get(), data(q), data(v))); }

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

    void report(const ftqp_fault &fault) { check(ftqp_report(get(), &fault)); }
    void withdraw(int joint) { check(ftqp_withdraw(get(), joint)); }
    void stop() { check(ftqp_stop(get())); }
    bool resume() { return checked(ftqp_resume(get())) == 1; }
    void carry(const ftqp_load &load) { check(ftqp_carry(get(), &load)); }
    void put_down() { check(ftqp_carry(get(), nullptr)); }

    // After each step, in a library with a detector: 0 quiet, 1 a suspicion, 2 a finding.
    int watch(const double *tau = nullptr) { return checked(ftqp_watch(get(), tau)); }
    std::vector<ftqp_finding> findings() {
        std::vector<ftqp_finding> found(static_cast<std::size_t>(joints()));
        found.resize(static_cast<std::size_t>(checked(ftqp_detect(get(), found.data(), joints()))));
        return found;
    }

    const double *q() const noexcept { return ftqp_q(get()); }
    const double *v() const noexcept { return ftqp_v(get()); }
    const double *a() const noexcept { return ftqp_a(get()); }
    const double *tau() const noexcept { return ftqp_tau(get()); }
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
    static const double *data(const double *numbers) noexcept { return numbers; }
    template <class T> static const double *data(const T &numbers) noexcept { return std::data(numbers); }
    static int checked(int code) {
        if (code < 0) throw Mistake(code);
        return code;
    }
    static void check(int code) { checked(code); }
    static Status status(int code) { return static_cast<Status>(checked(code)); }

    std::size_t size_ = 0;
    std::unique_ptr<unsigned char, Free> memory_;
};

}  // namespace ftqp_cpp
#endif
