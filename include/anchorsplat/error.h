#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace anchorsplat {

// Errors are values: nothing in this library throws, apart from std::bad_alloc of what is only memory (Splat's
// constructors, vectors that are returned).

enum class FailureKind {
  kBadArgument,  // asked for something impossible
  kNotFound,     // a file or folder is not there
  kBadFile,      // bytes that are malformed, truncated, hostile or of an unsupported kind
  kExists,       // would overwrite a file and was not told to
  kIo,           // the system refused to read, to write or to give memory
  kStopped,      // RunSettings::stop, where there is no result so far
};

// What went wrong, as one sentence for a person: file, byte or line, property, what was expected. Sentences call
// settings by the program's options ("--pixel-size").
struct Failure {
  FailureKind kind = FailureKind::kBadArgument;
  std::string message;
};

// A value or a Failure. Asking for the side that is not there throws std::bad_variant_access: look at ok() first.
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
