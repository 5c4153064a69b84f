/// Converts the GError of an Aravis call to a Result.
#pragma once

#include <arv.h>
#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <utility>

#include "estimator/core/result.hpp"

namespace crepes {

/// Returns the result of `call(GError**)`, or the error as "what: reason".
template <class Call>
auto call_aravis(const std::string& what, Call call)
    -> Result<std::invoke_result_t<Call, GError**>> {
  GError* error = nullptr;
  const auto failed = [&] {
    const bool absent = g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != 0;
    std::string why = fmt::format("{}: {}", what, error->message);
    g_error_free(error);
    return fail(absent ? ErrorCode::kNotFound : ErrorCode::kIo, std::move(why));
  };
  if constexpr (std::is_void_v<std::invoke_result_t<Call, GError**>>) {
    call(&error);
    if (error != nullptr) return failed();
    return {};
  } else {
    auto value = call(&error);
    if (error != nullptr) return failed();
    return value;
  }
}

}  // namespace crepes
