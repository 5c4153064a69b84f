/// Aravis tells of failures through a GError; the project through a Result.
#pragma once

#include <arv.h>

#include <string>
#include <type_traits>
#include <utility>

#include "estimator/core/result.hpp"

namespace crepes {

/// `call(GError**)`, with the error as ours: "what: why".
template <class Call>
auto attempt(const std::string& what, Call call) -> Result<std::invoke_result_t<Call, GError**>> {
  GError* error = nullptr;
  const auto told = [&] {
    const bool absent = g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != 0;
    std::string why = what + ": " + error->message;
    g_error_free(error);
    return fail(absent ? ErrorCode::kNotFound : ErrorCode::kIo, std::move(why));
  };
  if constexpr (std::is_void_v<std::invoke_result_t<Call, GError**>>) {
    call(&error);
    if (error != nullptr) return told();
    return {};
  } else {
    auto value = call(&error);
    if (error != nullptr) return told();
    return value;
  }
}

}  // namespace crepes
