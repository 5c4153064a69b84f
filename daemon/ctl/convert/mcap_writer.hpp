/// Writes MCAP files (https://mcap.dev/spec): timestamped messages on topics, with an index.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/dataset/part_file.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Messages are JSON. They go into chunks of about 1 MiB, uncompressed, each with its checksum and
/// the places of its messages. The file has its name only when it is complete.
class McapWriter {
 public:
  /// `library` names the writer.
  [[nodiscard]] static Result<McapWriter> create(std::filesystem::path file,
                                                 std::string_view library);

  /// A kind of message, by JSON Schema. Returns its number.
  std::uint16_t add_schema(std::string_view name, std::string_view json_schema);
  /// A topic with messages of one kind. Returns its number.
  std::uint16_t add_channel(std::string_view topic, std::uint16_t schema);

  /// Adds a message; `time_ns` is not negative. Readers are fastest if times never decrease.
  void write(std::uint16_t channel, std::int64_t time_ns, std::string_view json);

  /// Completes the file; reports also what could not be written before.
  [[nodiscard]] Result<void> finish();

  [[nodiscard]] std::uint64_t messages() const { return all_.messages; }

 private:
  /// A message of the open chunk: when, and where in it.
  struct Place {
    std::uint64_t time_ns;
    std::uint64_t offset;
  };
  struct Span {
    std::uint64_t start_ns = 0;
    std::uint64_t end_ns = 0;
    std::uint64_t messages = 0;
    void add(std::uint64_t time_ns);
  };

  explicit McapWriter(PartFile file) : file_(std::move(file)) {}

  void put(std::string_view bytes);
  void close_chunk();
  void put_summary();

  PartFile file_;
  std::uint64_t position_ = 0;
  std::uint32_t data_crc_ = 0;
  std::string schemas_;  ///< all records so far: they are repeated in the summary
  std::string channels_;
  std::string chunk_indexes_;
  std::uint16_t schema_count_ = 0;
  std::uint16_t channel_count_ = 0;
  std::uint32_t chunk_count_ = 0;
  std::map<std::uint16_t, std::uint32_t> counts_;  ///< messages of each channel
  Span all_;
  std::string chunk_;
  Span chunk_span_;
  std::map<std::uint16_t, std::vector<Place>> places_;
};

}  // namespace crepes
