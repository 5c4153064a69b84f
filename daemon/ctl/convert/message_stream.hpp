/// One topic of a converted recording.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/ctl/convert/foxglove.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The messages of a topic in order of time, made one by one: a recording need not fit into memory
/// a second time as text. The rows that they are made of must outlive the stream.
struct MessageStream {
  std::string topic;
  MessageKind kind;
  std::size_t size = 0;
  std::function<double(std::size_t)> time_s;  ///< from the recording's start
  /// Of a message whose time in nanoseconds is given; empty: there is none after all.
  std::function<Result<std::string>(std::size_t, std::int64_t)> json;
};

/// Of `rows`; `time_s(row)` and `json(time_ns, row)`.
template <class Row, class Time, class Json>
MessageStream stream_of(const std::string& topic, const MessageKind& kind,
                        const std::vector<Row>& rows, const Time& time_s, const Json& json) {
  return {.topic = topic,
          .kind = kind,
          .size = rows.size(),
          .time_s = [&rows, time_s](std::size_t i) { return time_s(rows[i]); },
          .json = [&rows, json](std::size_t i, std::int64_t time_ns) -> Result<std::string> {
            return json(time_ns, rows[i]);
          }};
}

}  // namespace crepes
