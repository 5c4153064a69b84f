/// A request of a browser, and its answer.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace crepes {

/// The parts of a request that the page's server reads. Missing headers are empty.
struct HttpRequest {
  bool is_get = false;
  bool is_post = false;
  std::string path{};   ///< decoded, without the query
  std::string query{};  ///< as sent, without '?'
  std::string host{};
  std::string origin{};
  std::string authorization{};
};

/// The status, type and content of an answer.
struct HttpReply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  /// The reply stays open, and `publish` to this topic continues it.
  std::optional<std::size_t> topic{};
};

}  // namespace crepes
