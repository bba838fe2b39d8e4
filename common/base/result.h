#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace radbake {

/// What kind of failure an Error is. The first names map to gRPC status codes of the same name.
enum class ErrorCode {
  kInvalidArgument,     ///< the caller's input is wrong
  kNotFound,            ///< a named thing is not there
  kAlreadyExists,       ///< a name is taken
  kFailedPrecondition,  ///< right input, wrong state: blobs missing, version mismatch
  kResourceExhausted,   ///< above a limit or quota
  kDataLoss,            ///< bytes are not what they claim to be
  kUnavailable,         ///< a service cannot be reached
  kCancelled,           ///< stopped because somebody asked for it
  kInternal,            ///< our own fault or the machine's: disk, memory
};

/// Name of a code in lower case, e.g. "invalid_argument".
const char* error_code_name(ErrorCode code);

/// Bad input or environment. The message names the thing and the value and is written for users.
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
};

inline Error invalid_argument(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }
inline Error internal_error(std::string message) { return {ErrorCode::kInternal, std::move(message)}; }

/// A value or an Error. Nothing throws across a module: functions that can fail return one of these.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// Precondition: ok().
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  /// Precondition: !ok().
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error, for functions without a value.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  /// Precondition: !ok().
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace radbake

/// Returns the error of a Result from the enclosing function, if it holds one.
#define RADBAKE_RETURN_IF_ERROR(expression)                         \
  do {                                                              \
    if (auto radbake_status = (expression); !radbake_status.ok()) { \
      return radbake_status.error();                                \
    }                                                               \
  } while (false)

/// Declares `variable` with the value of a Result, or returns its error from the enclosing function.
#define RADBAKE_ASSIGN_OR_RETURN(variable, expression) \
  RADBAKE_ASSIGN_OR_RETURN_IMPL(RADBAKE_CONCAT(radbake_result_, __LINE__), variable, expression)
#define RADBAKE_ASSIGN_OR_RETURN_IMPL(result, variable, expression) \
  auto result = (expression);                                       \
  if (!result.ok()) return result.error();                          \
  variable = std::move(result).value()
#define RADBAKE_CONCAT(a, b) RADBAKE_CONCAT_IMPL(a, b)
#define RADBAKE_CONCAT_IMPL(a, b) a##b
