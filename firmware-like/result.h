// A value or the reason why there is none; the compiler warns where the answer is ignored.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace plumbline {

/// Why something could not be done, in words that tell the reader what to do.
struct Error {
  std::string message;
};

/// Either a T or an Error. Asking for the one that is not there is a programming error.
template <typename T>
class [[nodiscard]] Result {
 public:
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

  const std::string& error() const {
    assert(!ok());
    return std::get_if<Error>(&content_)->message;
  }

 private:
  std::variant<T, Error> content_;
};

}  // namespace plumbline
