#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace anchorsplat {

// Category of a failure; the program maps each to an exit code (cli/exit_codes.h).
enum class ErrorCode {
  kBadArgument,  // the caller asked for something impossible
  kNotFound,     // a file or folder is not there
  kBadFile,      // a file is there but malformed, truncated, hostile or of an unsupported kind
  kExists,       // would overwrite a file without permission
  kIo,           // a system call to read or write failed
  kInterrupted,  // the user stopped it
};

// A failure, in one sentence that a user can act on: file, byte or line, property, what was expected.
struct Error {
  ErrorCode code = ErrorCode::kBadArgument;
  std::string message;
};

// A value or an Error. Accessing the absent one is a programming error (std::bad_variant_access).
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit on purpose
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return state_.index() == 0; }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

// Success or an Error.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return error_.value(); }

 private:
  std::optional<Error> error_;
};

}  // namespace anchorsplat

// Returns the error from the function if `expression` (a Status or Result) failed.
#define ANCHORSPLAT_RETURN_IF_ERROR(expression)                                                              \
  do {                                                                                                       \
    if (auto anchorsplat_status = (expression); !anchorsplat_status.ok()) return anchorsplat_status.error(); \
  } while (false)

#define ANCHORSPLAT_CONCAT_INNER(a, b) a##b
#define ANCHORSPLAT_CONCAT(a, b) ANCHORSPLAT_CONCAT_INNER(a, b)
// NOLINTBEGIN(bugprone-macro-parentheses): a declaration cannot stand in parentheses
#define ANCHORSPLAT_ASSIGN_OR_RETURN_INNER(result, declaration, expression) \
  auto result = (expression);                                               \
  if (!result.ok()) return result.error();                                  \
  declaration = *std::move(result)

// NOLINTEND(bugprone-macro-parentheses)

// ANCHORSPLAT_ASSIGN_OR_RETURN(auto cloud, ReadCloud(path)): declares `cloud` with the value, or returns the error.
#define ANCHORSPLAT_ASSIGN_OR_RETURN(declaration, expression) \
  ANCHORSPLAT_ASSIGN_OR_RETURN_INNER(ANCHORSPLAT_CONCAT(anchorsplat_result_, __LINE__), declaration, expression)
