#include "daemon/ctl/convert/mcap_writer.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "drivers/serial/device_request.hpp"
#include "net/mesh/crc32.hpp"

namespace crepes {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
constexpr std::size_t kChunkBytes = 1U << 20U;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// The content of a record, field by field; integers are little-endian.
class RecordFields {
 public:
  template <class Integer>
  RecordFields& number(Integer value) {
    static_assert(std::is_unsigned_v<Integer>);
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      bytes_ += static_cast<char>((value >> (8 * i)) & 0xFFU);
    return *this;
  }
  RecordFields& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    return raw(text);
  }
  RecordFields& raw(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string record(Opcode opcode, std::string_view content) {
  RecordFields whole;
  whole.number(static_cast<std::uint8_t>(opcode)).number(std::uint64_t{content.size()});
  return whole.raw(content).bytes();
}

std::string record(Opcode opcode, const RecordFields& fields) {
  return record(opcode, fields.bytes());
}

std::uint32_t crc_of(std::string_view text, std::uint32_t before = 0) {
  return crc32(bytes_of_text(text), before);
}

}  // namespace

Result<McapWriter> McapWriter::create(std::filesystem::path file, std::string_view library) {
  auto part = PartFile::create(std::move(file), "");
  if (!part) return tl::unexpected(part.error());
  McapWriter writer(std::move(*part));
  writer.put(kMagic);
  writer.put(record(Opcode::kHeader, RecordFields().text("").text(library)));
  return writer;
}

void McapWriter::Span::add(std::uint64_t time_ns) {
  start_ns = messages == 0 ? time_ns : std::min(start_ns, time_ns);
  end_ns = std::max(end_ns, time_ns);
  ++messages;
}

void McapWriter::put(std::string_view bytes) {
  file_.text() += bytes;
  file_.flush_if_large();
  position_ += bytes.size();
  data_crc_ = crc_of(bytes, data_crc_);
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view json_schema) {
  const std::string schema = record(
      Opcode::kSchema,
      RecordFields().number(++schema_count_).text(name).text("jsonschema").text(json_schema));
  schemas_ += schema;
  chunk_ += schema;
  return schema_count_;
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::uint16_t schema) {
  const std::string channel = record(
      Opcode::kChannel,
      RecordFields().number(++channel_count_).number(schema).text(topic).text("json").text(""));
  channels_ += channel;
  chunk_ += channel;
  return channel_count_;
}

void McapWriter::write(std::uint16_t channel, std::int64_t time_ns, std::string_view json) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(0, time_ns));
  places_[channel].push_back({time, chunk_.size()});
  chunk_ += record(Opcode::kMessage, RecordFields()
                                         .number(channel)
                                         .number(counts_[channel]++)
                                         .number(time)
                                         .number(time)
                                         .raw(json));
  chunk_span_.add(time);
  all_.add(time);
  if (chunk_.size() >= kChunkBytes) close_chunk();
}

/// The chunk, the index of its messages by channel, and its entry of the summary.
void McapWriter::close_chunk() {
  if (chunk_.empty()) return;
  const std::uint64_t start = position_;
  put(record(Opcode::kChunk, RecordFields()
                                 .number(chunk_span_.start_ns)
                                 .number(chunk_span_.end_ns)
                                 .number(std::uint64_t{chunk_.size()})
                                 .number(crc_of(chunk_))
                                 .text("")
                                 .number(std::uint64_t{chunk_.size()})
                                 .raw(chunk_)));
  const std::uint64_t end = position_;
  RecordFields offsets;
  for (const auto& [channel, places] : places_) {
    RecordFields entries;
    for (const Place& place : places) entries.number(place.time_ns).number(place.offset);
    offsets.number(channel).number(position_);
    put(record(Opcode::kMessageIndex, RecordFields().number(channel).text(entries.bytes())));
  }
  chunk_indexes_ += record(Opcode::kChunkIndex, RecordFields()
                                                    .number(chunk_span_.start_ns)
                                                    .number(chunk_span_.end_ns)
                                                    .number(start)
                                                    .number(end - start)
                                                    .text(offsets.bytes())
                                                    .number(position_ - end)
                                                    .text("")
                                                    .number(std::uint64_t{chunk_.size()})
                                                    .number(std::uint64_t{chunk_.size()}));
  ++chunk_count_;
  chunk_.clear();
  chunk_span_ = {};
  places_.clear();
}

/// Schemas, channels, chunks and statistics, where each group begins, and the footer.
void McapWriter::put_summary() {
  RecordFields counts;
  for (const auto& [channel, count] : counts_) counts.number(channel).number(std::uint64_t{count});
  const std::string statistics =
      record(Opcode::kStatistics, RecordFields()
                                      .number(all_.messages)
                                      .number(schema_count_)
                                      .number(std::uint32_t{channel_count_})
                                      .number(std::uint32_t{0})
                                      .number(std::uint32_t{0})
                                      .number(chunk_count_)
                                      .number(all_.start_ns)
                                      .number(all_.end_ns)
                                      .text(counts.bytes()));
  const std::uint64_t start = position_;
  std::string summary;
  std::string offsets;
  for (const auto& [opcode, group] :
       {std::pair{Opcode::kSchema, &std::as_const(schemas_)},
        std::pair{Opcode::kChannel, &std::as_const(channels_)},
        std::pair{Opcode::kChunkIndex, &std::as_const(chunk_indexes_)},
        std::pair{Opcode::kStatistics, &statistics}}) {
    if (group->empty()) continue;
    offsets += record(Opcode::kSummaryOffset, RecordFields()
                                                  .number(static_cast<std::uint8_t>(opcode))
                                                  .number(start + summary.size())
                                                  .number(std::uint64_t{group->size()}));
    summary += *group;
  }
  const std::uint64_t offsets_start = start + summary.size();
  // The checksum covers the footer up to itself.
  constexpr std::uint64_t kFooterBytes = 20;
  RecordFields head;
  head.number(static_cast<std::uint8_t>(Opcode::kFooter)).number(kFooterBytes);
  head.number(start).number(offsets_start);
  const std::string checked = summary + offsets + head.bytes();
  put(checked);
  put(RecordFields().number(crc_of(checked)).bytes());
}

Result<void> McapWriter::finish() {
  close_chunk();
  put(record(Opcode::kDataEnd, RecordFields().number(data_crc_)));
  put_summary();
  put(kMagic);
  return file_.publish();
}

}  // namespace crepes
