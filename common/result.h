// Result<T>: how every module reports bad input. Nothing throws across a module's edge; an Error carries the exit code
// of the program that meets it and a message that names the file, the value found and what follows from it.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace scree {

/// The exit codes that users script against (docs/architecture.md, "Exit codes").
enum class ErrorCode : int {
    check_failed = 1,  ///< a checked promise failed (verify, audit)
    usage = 2,         ///< the command line does not make sense
    input = 3,         ///< an input is missing or cannot be used
    store = 4,         ///< damaged, not a store, or of a newer format
    io = 5,            ///< I/O error or disk full
    display = 6,       ///< no display or no OpenGL 4.5
    interrupted = 130  ///< stopped by the user
};

struct Error {
    ErrorCode code = ErrorCode::io;
    std::string message;
};

template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    bool ok() const { return state_.index() == 0; }
    explicit operator bool() const { return ok(); }

    T& value() {
        assert(ok());
        return *std::get_if<0>(&state_);
    }
    const T& value() const {
        assert(ok());
        return *std::get_if<0>(&state_);
    }
    T& operator*() { return value(); }
    const T& operator*() const { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }

    const Error& error() const {
        assert(!ok());
        return *std::get_if<1>(&state_);
    }

private:
    std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
public:
    Result() = default;
    Result(Error error) : error_(std::move(error)), ok_(false) {}

    bool ok() const { return ok_; }
    explicit operator bool() const { return ok_; }
    const Error& error() const {
        assert(!ok_);
        return error_;
    }

private:
    Error error_;
    bool ok_ = true;
};

}  // namespace scree
