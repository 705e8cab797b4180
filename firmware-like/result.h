// Return type that holds a value or an error; the compiler warns if it is discarded.
#pragma once

#include <cassert>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace plumbline {

/// Reason for a failure, and what the user can do about it.
struct Error {
  std::string message;
};

/// Either a T or an Error. Accessing the alternative that is not present is a programming error
/// (asserted).
///
/// Propagate an error with `if (!a) return a.failure();`, or chain steps as with std::expected in
/// C++23: `Parse(text).and_then(Check).transform(Scaled)`.
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
  /// The error, to be returned from a function with another value type.
  const Error& failure() const {
    assert(!ok());
    return *std::get_if<Error>(&content_);
  }

  /// Applies `next`, which returns a Result, to the value; passes an error on unchanged.
  template <typename Next>
  auto and_then(Next&& next) && -> std::invoke_result_t<Next, T> {
    if (!ok()) return failure();
    return std::invoke(std::forward<Next>(next), std::move(*this).value());
  }
  /// Applies `next` to the value and wraps what it returns; passes an error on unchanged.
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
  /// Replaces the message of an error by next(message); passes a value on unchanged.
  template <typename Next>
  Result transform_error(Next&& next) && {
    if (ok()) return std::move(*this);
    return Error{std::invoke(std::forward<Next>(next), error())};
  }

 private:
  std::variant<T, Error> content_;
};

/// Success without a value, or an Error. `return {};` means success.
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
