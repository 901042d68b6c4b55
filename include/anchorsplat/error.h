#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace anchorsplat {

// Errors are values: nothing in this library throws, except std::bad_alloc where only memory is concerned (Splat's
// constructors, returned vectors).

enum class FailureKind {
  kBadArgument,  // an impossible request
  kNotFound,     // a missing file or folder
  kBadFile,      // malformed, truncated, hostile or unsupported contents
  kExists,       // the file exists and overwriting was not allowed
  kIo,           // the system failed to read, write or provide memory
  kStopped,      // stopped by RunSettings::stop without a result
};

// What went wrong, as one sentence for people: file, byte or line, property, what was expected. Settings are called by
// the program's option names ("--pixel-size").
struct Failure {
  FailureKind kind = FailureKind::kBadArgument;
  std::string message;
};

// A value or a Failure. Check ok() first: accessing the absent side throws std::bad_variant_access.
template <typename T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) : state_(std::in_place_index<0>, std::move(value)) {}            // NOLINT: implicit on purpose
  Expected(Failure failure) : state_(std::in_place_index<1>, std::move(failure)) {}  // NOLINT: implicit on purpose

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& operator*() & { return std::get<0>(state_); }
  const T& operator*() const& { return std::get<0>(state_); }
  T&& operator*() && { return std::get<0>(std::move(state_)); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const Failure& failure() const { return std::get<1>(state_); }

 private:
  std::variant<T, Failure> state_;
};

// Success or a Failure.
template <>
class [[nodiscard]] Expected<void> {
 public:
  Expected() = default;
  Expected(Failure failure) : failure_(std::move(failure)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !failure_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Failure& failure() const { return failure_.value(); }

 private:
  std::optional<Failure> failure_;
};

}  // namespace anchorsplat
