/// Failures of the outside world as values.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace crepes {

/// The kind of a failure.
enum class ErrorCode {
  kIo,        ///< a device, file or socket failed
  kFormat,    ///< bytes or text that do not parse
  kConfig,    ///< a setting is missing, unknown or out of bounds
  kUsage,     ///< the caller of a program asked for something that does not exist
  kNotFound,  ///< a file, device or robot that is not there
  kBusy,      ///< the system accepts no more at present; earlier requests are not affected
};

/// Why something failed, in words, with the context of its callers.
struct Error {
  ErrorCode code;
  std::string message;

  /// The same error with the context of the caller: "context: message".
  [[nodiscard]] Error with_context(std::string_view context) && {
    return {code, std::string(context) + ": " + std::move(message)};
  }
};

template <class T>
using Result = tl::expected<T, Error>;

/// A failure that converts to any `Result`.
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace crepes
