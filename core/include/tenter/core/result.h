// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace tenter {

/// What went wrong, as the command line reports it: the value is the exit code.
enum class ErrorKind {
  kUsage = 2,
  kBadInput = 3,
  kCalibrationRejected = 4,
  kNotConverged = 5,
  kHardware = 6,
  kInterlock = 7,
};

/// An error of the world's doing: what, where, and what to do about it.
struct Error {
  ErrorKind kind = ErrorKind::kBadInput;
  std::string file;    ///< File or folder it is about; may be empty.
  std::string place;   ///< Line, field, row or element inside it; may be empty.
  std::string reason;  ///< One sentence without a full stop.
  std::string advice;  ///< What the user can do; may be empty.

  /// "file: place: reason (advice)", leaving out what is empty.
  std::string message() const;

  /// The same error, said of a file that the place where it arose did not know.
  Error in(std::string file_name) const&;
};

Error badInput(std::string file, std::string place, std::string reason, std::string advice = "");
Error notConverged(std::string reason, std::string advice = "");
Error usageError(std::string reason, std::string advice = "");

/// A value or the error that stands in its place. GCC 12 has no std::expected.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return std::holds_alternative<T>(content_); }
  explicit operator bool() const { return ok(); }

  /// Precondition: ok(); otherwise throws std::logic_error with the error's message.
  T& value() & {
    check();
    return std::get<T>(content_);
  }
  const T& value() const& {
    check();
    return std::get<T>(content_);
  }
  T&& value() && {
    check();
    return std::get<T>(std::move(content_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  /// Precondition: !ok().
  const Error& error() const { return std::get<Error>(content_); }

 private:
  void check() const {
    if (!ok()) throw std::logic_error("Result without a value: " + error().message());
  }
  std::variant<T, Error> content_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

/// A caller's bug: throws std::invalid_argument with the message. Never for bad files or failed
/// solves.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument(message);
}

}  // namespace tenter
