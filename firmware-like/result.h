// A value or the reason why there is none; the compiler warns where the answer is ignored.
#pragma once

#include <cassert>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace plumbline {

/// Why something could not be done, in words that tell the reader what to do.
struct Error {
  std::string message;
};

/// Either a T or an Error. Asking for the one that is not there is a programming error.
///
/// An error is passed on by `if (!a) return a.failure();`, or where one step follows another by
/// `Parse(text).and_then(Check).transform(Scaled)`, as std::expected of C++23 has it.
template <typename T>
class [[nodiscard]] Result {
 public:
  using value_type = T;

  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return std::holds_alternative<T>(content_); }
  explicit operator bool() const { return ok(); }

  const T& value() const& {
    assert(ok());
    return *std::get_if<T>(&content_);
  }
  T& value() & {
    assert(ok());
    return *std::get_if<T>(&content_);
  }
  T value() && {
    assert(ok());
    return std::move(*std::get_if<T>(&content_));
  }
  const T& operator*() const& { return value(); }
  const T* operator->() const { return &value(); }

  const std::string& error() const { return failure().message; }
  /// The error itself, for a function that returns another kind of result.
  const Error& failure() const {
    assert(!ok());
    return *std::get_if<Error>(&content_);
  }

  /// What `next` makes of the value, itself a Result; or the error.
  template <typename Next>
  auto and_then(Next&& next) && -> std::invoke_result_t<Next, T> {
    if (!ok()) return failure();
    return std::invoke(std::forward<Next>(next), std::move(*this).value());
  }
  /// What `next` makes of the value, as a Result; or the error.
  template <typename Next>
  auto transform(Next&& next) && -> Result<std::invoke_result_t<Next, T>> {
    if (!ok()) return failure();
    if constexpr (std::is_void_v<std::invoke_result_t<Next, T>>) {
      std::invoke(std::forward<Next>(next), std::move(*this).value());
      return {};
    } else {
      return std::invoke(std::forward<Next>(next), std::move(*this).value());
    }
  }
  /// The value; or the error with the message that `next` makes of the message.
  template <typename Next>
  Result transform_error(Next&& next) && {
    if (ok()) return std::move(*this);
    return Error{std::invoke(std::forward<Next>(next), error())};
  }

 private:
  std::variant<T, Error> content_;
};

/// Whether something worked, or the Error why not. `return {};` says that it did.
template <>
class [[nodiscard]] Result<void> {
 public:
  using value_type = void;

  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }

  void value() const { assert(ok()); }

  const std::string& error() const { return failure().message; }
  const Error& failure() const {
    assert(!ok());
    return *error_;
  }

  template <typename Next>
  auto and_then(Next&& next) && -> std::invoke_result_t<Next> {
    if (!ok()) return failure();
    return std::invoke(std::forward<Next>(next));
  }
  template <typename Next>
  auto transform(Next&& next) && -> Result<std::invoke_result_t<Next>> {
    if (!ok()) return failure();
    if constexpr (std::is_void_v<std::invoke_result_t<Next>>) {
      std::invoke(std::forward<Next>(next));
      return {};
    } else {
      return std::invoke(std::forward<Next>(next));
    }
  }
  template <typename Next>
  Result transform_error(Next&& next) && {
    if (ok()) return std::move(*this);
    return Error{std::invoke(std::forward<Next>(next), error())};
  }

 private:
  std::optional<Error> error_;
};

}  // namespace plumbline
