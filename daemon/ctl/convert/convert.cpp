#include "daemon/ctl/convert/convert.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <queue>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/ctl/convert/mcap_writer.hpp"
#include "daemon/ctl/convert/replay_streams.hpp"
#include "daemon/ctl/convert/swarm_streams.hpp"
#include "daemon/ctl/replaceable.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/version.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// Merges streams into a file.
class Conversion {
 public:
  Conversion(McapWriter writer, const std::vector<MessageStream>& streams)
      : writer_(std::move(writer)), streams_(streams) {
    for (std::size_t i = 0; i < streams.size(); ++i) {
      total_ += streams[i].size;
      channels_.push_back(streams[i].size > 0 ? channel_of(streams[i]) : 0);
      enqueue(i, 0);
    }
  }

  Result<ConvertSummary> run(const std::function<void(double)>& on_progress) {
    std::size_t done = 0;
    for (; !due_.empty(); ++done) {
      const Due next = due_.top();
      due_.pop();
      if (auto written = write(next); !written) return tl::unexpected(written.error());
      enqueue(next.stream, next.message + 1);
      constexpr std::size_t kReportEvery = 1000;
      if (on_progress && done % kReportEvery == 0)
        on_progress(static_cast<double>(done) / static_cast<double>(total_));
    }
    summary_.messages = writer_.messages();
    summary_.topics = topics_.size();
    if (auto finished = writer_.finish(); !finished) return tl::unexpected(finished.error());
    return summary_;
  }

 private:
  struct Due {
    std::int64_t time_ns;
    std::size_t stream;
    std::size_t message;
    /// The earliest first; of the same time, in the order of the streams.
    bool operator<(const Due& other) const {
      return std::pair(time_ns, stream) > std::pair(other.time_ns, other.stream);
    }
  };

  /// Streams may share a topic.
  std::uint16_t channel_of(const MessageStream& stream) {
    const auto [topic, is_new] = topics_.try_emplace(stream.topic, 0);
    if (!is_new) return topic->second;
    const auto [schema, is_new_kind] = schemas_.try_emplace(stream.kind.name, 0);
    if (is_new_kind) schema->second = writer_.add_schema(stream.kind.name, stream.kind.json_schema);
    return topic->second = writer_.add_channel(stream.topic, schema->second);
  }

  void enqueue(std::size_t stream, std::size_t message) {
    if (message >= streams_[stream].size) return;
    due_.push({std::llround(1e9 * streams_[stream].time_s(message)), stream, message});
  }

  Result<void> write(const Due& due) {
    if (due.time_ns < 0) {
      ++summary_.before_start;
      return {};
    }
    const auto json = streams_[due.stream].json(due.message, due.time_ns);
    if (!json) return tl::unexpected(json.error());
    if (!json->empty()) writer_.write(channels_[due.stream], due.time_ns, *json);
    return {};
  }

  McapWriter writer_;
  const std::vector<MessageStream>& streams_;
  std::size_t total_ = 0;
  std::vector<std::uint16_t> channels_;  ///< one for each of streams_
  std::map<std::string, std::uint16_t> topics_;
  std::map<std::string, std::uint16_t> schemas_;
  std::priority_queue<Due> due_;
  ConvertSummary summary_;
};

Result<ConvertSummary> convert_streams(const ConvertOptions& options,
                                       const std::vector<MessageStream>& streams) {
  auto writer = McapWriter::create(options.out, "crepes " + std::string(kVersion));
  if (!writer) return tl::unexpected(writer.error());
  return Conversion(std::move(*writer), streams).run(options.on_progress);
}

void append(std::vector<MessageStream>& streams, std::vector<MessageStream> more) {
  for (MessageStream& stream : more) streams.push_back(std::move(stream));
}

/// The truth of a data set, if it has any.
Result<std::optional<SwarmTruth>> truth_of(const fs::path& swarm, const SwarmManifest& manifest) {
  std::error_code status;
  if (!fs::exists(swarm / "truth", status)) return std::nullopt;
  return SwarmTruth::load(swarm, manifest).map([](SwarmTruth&& truth) {
    return std::optional(std::move(truth));
  });
}

Result<ConvertSummary> convert_swarm(const ConvertOptions& options) {
  const auto dataset = load_swarm(options.source);
  if (!dataset) return tl::unexpected(dataset.error());
  const auto truth = truth_of(options.source, dataset->manifest);
  if (!truth) return tl::unexpected(truth.error());
  std::vector<MessageStream> streams = swarm_streams(*dataset);
  if (*truth) append(streams, truth_streams(dataset->manifest, **truth));
  return convert_streams(options, streams).map([&](ConvertSummary summary) {
    summary.faults = dataset->faults;
    return summary;
  });
}

Result<ConvertSummary> convert_replay(const ConvertOptions& options) {
  std::optional<SwarmManifest> manifest;
  std::optional<SwarmTruth> truth;
  if (!options.swarm.empty()) {
    auto read = load_manifest(options.swarm);
    if (!read) return tl::unexpected(read.error());
    if (auto same = check_same_recording(options.source, *read); !same)
      return tl::unexpected(same.error());
    manifest = std::move(*read);
    auto found = truth_of(options.swarm, *manifest);
    if (!found) return tl::unexpected(found.error());
    truth = std::move(*found);
  }
  const auto pairs = read_replay(options.source, manifest ? &*manifest : nullptr);
  if (!pairs) return tl::unexpected(pairs.error());
  std::vector<MessageStream> streams = replay_streams(*pairs, truth ? &*truth : nullptr);
  if (truth) append(streams, truth_streams(*manifest, *truth));
  return convert_streams(options, streams);
}

}  // namespace

Result<ConvertSummary> convert_to_mcap(const ConvertOptions& options) {
  if (!options.force)
    if (auto free = check_replaceable(options.out, "\x89MCAP"); !free)
      return tl::unexpected(free.error());
  std::error_code status;
  const bool is_swarm = fs::exists(options.source / "swarm.yaml", status);
  if (is_swarm && !options.swarm.empty())
    return fail(ErrorCode::kUsage, "--truth belongs to a replay; a recording has its own");
  return is_swarm ? convert_swarm(options) : convert_replay(options);
}

}  // namespace crepes
