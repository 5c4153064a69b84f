#include "tests/fuzz/fuzz_targets.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "config/reading/config_file.hpp"
#include "drivers/detect_protocol.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/iio/scan_format.hpp"
#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/microstrain.hpp"
#include "drivers/imu/vectornav.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/xsens.hpp"
#include "drivers/serial/byte_fields.hpp"
#include "drivers/uwb/bu03.hpp"
#include "drivers/uwb/dwm1001.hpp"
#include "drivers/uwb/fira_uci.hpp"
#include "drivers/uwb/mauwb.hpp"
#include "drivers/uwb/nlink.hpp"
#include "drivers/uwb/range_line.hpp"
#include "estimator/core/contract.hpp"
#include "firmware/protocol/led_messages.h"
#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/subscription/subscription_service.hpp"
#include "tests/fuzz/mesh_target.hpp"
#include "tests/support/frame_damage.hpp"
#include "tests/support/places.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;

void check(const ImuSample& sample) {
  CREPES_EXPECT(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite(), "finite samples");
}

void check(const UwbRange& range) {
  CREPES_EXPECT(range.range_m > 0.0 && range.range_m <= 200.0, "ranges within bounds");
}

/// A stream in pieces, whose length is its first byte, yields the same frames as in one piece, and
/// their measurements are plausible.
template <class Parser>
void run_stream(Bytes data, Parser parser) {
  if (data.empty()) return;
  const Bytes stream = data.subspan(1);
  FrameDecoder<Parser> whole;
  FrameDecoder<Parser> pieces;
  const Frames frames = decode(whole, stream, std::max<std::size_t>(stream.size(), 1));
  CREPES_EXPECT(decode(pieces, stream, 1 + data[0] % 64U) == frames, "cuts change nothing");
  CREPES_EXPECT(pieces.counts().skipped_bytes == whole.counts().skipped_bytes, "all is counted");
  Timestamp arrival{milliseconds{1000}};
  for (const auto& frame : frames) {
    arrival += milliseconds{10};
    parser.parse(frame, arrival, [&](const auto& measurement) {
      CREPES_EXPECT(measurement.stamp <= arrival, "nothing arrives before it happened");
      check(measurement);
    });
  }
  static_cast<void>(parser.no_measurement_reason());
}

/// A frame or stream as `run_stream` takes it.
FuzzInput piece_by_piece(const std::vector<std::uint8_t>& stream) { return FuzzInput{16} + stream; }

std::vector<FuzzInput> recorded(const std::string& folder, const std::string& part) {
  std::vector<FuzzInput> seeds;
  for (const RecordedFrame& file : recorded_files(folder)) {
    if (file.name.find(part) == std::string::npos) continue;
    seeds.push_back(piece_by_piece(file.bytes + file.bytes));
  }
  return seeds;
}

template <class Parser>
void run_uwb(Bytes data) {
  UwbModules modules;
  for (std::uint16_t id = 0; id < 8; ++id) modules.emplace(id, RobotId{id});
  run_stream(data, Parser(modules, 200.0));
}

std::vector<FuzzInput> text_seed(std::string_view line) {
  const std::vector<std::uint8_t> bytes(line.begin(), line.end());
  return {piece_by_piece(bytes + bytes)};
}

/// A line with the type of an element, then scans of three of it and a stamp.
void run_iio_scan(Bytes data) {
  const auto end = std::ranges::find(data, std::uint8_t{'\n'});
  const std::string type(data.begin(), end);
  const Result<ScanElement> element = parse_scan_element(type);
  if (!element) return;
  const ScanElement stamp{std::endian::little, true, 64, 64, 0};
  const ScanLayout layout({*element, *element, *element, stamp});
  std::size_t at = type.size() + 1;
  for (; at + layout.size() <= data.size(); at += layout.size()) {
    const std::int64_t value = layout.value(data.subspan(at, layout.size()), 2);
    const unsigned bits = element->bits - (element->is_signed ? 1 : 0);
    if (bits >= 63) continue;
    CREPES_EXPECT(value < std::int64_t{1} << bits, "a number has the bits of its type");
    CREPES_EXPECT(value >= (element->is_signed ? -(std::int64_t{1} << bits) : 0), "and its sign");
  }
}

std::vector<FuzzInput> iio_scan_seeds() {
  std::vector<FuzzInput> seeds;
  for (const std::string_view type : {"be:s16/16>>0\n", "le:u12/16>>4\n", "le:s24/32>>8\n"}) {
    FuzzInput seed(type.begin(), type.end());
    for (std::uint8_t byte = 0; byte < 96; ++byte) seed.push_back(byte * 37U & 0xffU);
    seeds.push_back(seed);
  }
  return seeds;
}

void run_detect_protocol(Bytes data) {
  const auto spoken = detect_protocol(data);
  CREPES_EXPECT(!spoken || !name_of(*spoken).empty(), "a detected protocol has a name");
}

std::vector<FuzzInput> detect_protocol_seeds() {
  std::vector<FuzzInput> seeds;
  for (const char* folder : {"imu", "nlink"}) {
    for (const RecordedFrame& file : recorded_files(folder))
      seeds.push_back(file.bytes + file.bytes + file.bytes);
  }
  return seeds;
}

/// Eight bytes of device time and two of how much later the next arrives.
void run_device_clock(Bytes data) {
  DeviceClock clock;
  Timestamp arrival{};
  Timestamp last{Duration::min()};
  for (std::size_t at = 0; at + 11 <= data.size(); at += 11) {
    const std::uint64_t count = unsigned_at(data, at, 8);
    const bool wraps = data[at + 8] % 2 != 0;
    arrival += std::chrono::microseconds{100} * unsigned_at(data, at + 9, 2);
    const Timestamp local = clock.to_local(
        wraps ? DeviceTime::ticks(count & 0xffffffffU, milliseconds{1}, 32) : DeviceTime{count, 0},
        arrival);
    CREPES_EXPECT(local <= arrival && local >= last, "stamps are in order and not of the future");
    last = local;
  }
}

std::vector<FuzzInput> device_clock_seeds() {
  FuzzInput steady;
  for (std::uint64_t i = 0; i < 200; ++i) {
    for (unsigned byte = 0; byte < 8; ++byte)
      steady.push_back(static_cast<std::uint8_t>(i * 10'000'000U >> 8U * byte));
    steady.insert(steady.end(), {0, 100, 0});  // 10 ms
  }
  return {steady};
}

void check(const PeerMessage& message) {
  for (const auto& bearing : message.report.bearings)
    CREPES_EXPECT(bearing.u_B.allFinite(), "finite bearings");
  for (const auto& range : message.report.ranges)
    CREPES_EXPECT(range.range_m > 0.0, "positive ranges");
  for (const auto& sample : message.report.imu)
    CREPES_EXPECT(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite(), "finite samples");
  for (const auto& estimate : message.report.estimates)
    CREPES_EXPECT(estimate.T_B_N.covariance.allFinite(), "finite covariances");
}

/// As it is, and with a valid checksum: otherwise only the first check would be reached.
void run_peer_message(Bytes data) {
  if (const auto message = decode_peer_message(data)) check(*message);
  if (data.size() < 4) return;
  FuzzInput mended(data.begin(), data.end());
  const std::uint32_t sum = crc32(Bytes(mended).first(mended.size() - 4));
  for (std::size_t i = 0; i < 4; ++i)
    mended[mended.size() - 4 + i] = static_cast<std::uint8_t>(sum >> 8U * i);
  if (const auto message = decode_peer_message(mended)) check(*message);
}

std::vector<FuzzInput> peer_message_seeds() {
  OutgoingPeerMessage message;
  message.sent = Timestamp{milliseconds{5000}};
  Report& report = message.report;
  report.sender = RobotId{1};
  report.stamp = message.sent;
  report.tilt = {message.sent, Eigen::Vector3d::UnitZ(), 0.01};
  const FuzzInput empty = encode_peer_message(message).bytes;
  message.echoes.push_back({RobotId{2}, 1'000'000, 2'000'000, 0.1, false});
  message.mark = 6;
  report.imu.push_back({message.sent, {0.1, 0.2, 0.3}, {0.0, 0.0, 9.8}});
  report.bearings.push_back(
      {message.sent, RobotId{2}, Eigen::Vector3d::UnitX(), {0.06, 0.0, 0.04}, 0.001});
  report.ranges.push_back({message.sent, RobotId{2}, 4.27, -85.0, -80.0});
  NeighborEstimate estimate;
  estimate.neighbor = RobotId{2};
  estimate.stamp = message.sent;
  estimate.T_B_N.covariance = 0.01 * Matrix6d::Identity();
  report.estimates.push_back(estimate);
  return {empty, encode_peer_message(message).bytes};
}

std::string_view text_of(Bytes data) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): text is bytes.
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

FuzzInput input_of(std::string_view text) { return {text.begin(), text.end()}; }

void run_subscription(Bytes data) {
  SubscriptionService service({}, "0", [] { return SystemStatus{}; }, {});
  const Timestamp now{std::chrono::seconds{1}};
  const auto local = service.answer(Endpoint::ipv4({127, 0, 0, 1}, 4000), text_of(data), now);
  CREPES_EXPECT(!local || local->size() <= kMaxSubscriptionDatagram, "answers fit a datagram");
  const auto remote = service.answer(Endpoint::ipv4({10, 0, 0, 1}, 4000), text_of(data), now);
  CREPES_EXPECT(!remote || remote->size() <= data.size(), "nothing is amplified");
}

std::vector<FuzzInput> subscription_seeds() {
  return {input_of(R"({"class":"WATCH","enable":true,"rate_hz":10,"peers":[2,3]})"),
          input_of(R"({"class":"WATCH","enable":false})"), input_of(R"({"class":"POLL"})"),
          input_of(R"({"class":"POLL","peer":2,"cookie":"0123456789abcdef"})")};
}

/// A valid configuration is still valid after writing and reading it.
void run_config(Bytes data) {
  const CheckedConfig checked = check_config_text(std::string(text_of(data)), "file");
  if (!checked.faults.empty()) return;
  const CheckedConfig again = check_config_text(write_config(checked.config), "again");
  CREPES_EXPECT(again.faults.empty(), "what was written can be read");
}

std::vector<FuzzInput> config_seeds() {
  std::string keys;  // without comments: short inputs are mutated better
  std::istringstream lines(reference_config());
  for (std::string line; std::getline(lines, line);) {
    line.erase(std::min(line.find(" #"), line.size()));
    if (!line.starts_with('#') && !line.empty()) keys += line + '\n';
  }
  return {input_of(keys), input_of(reference_config())};
}

/// The host's side of the LED board's line.
void run_led(Bytes data) {
  led_receiver receiver{};
  for (const std::uint8_t byte : data) {
    led_receiver_push(&receiver, byte);
    led_frame frame{};
    while (led_receiver_next(&receiver, byte == 0, &frame)) {
      CREPES_EXPECT(frame.size <= LED_MAX_PAYLOAD, "payloads fit");
      std::array<std::uint8_t, LED_MAX_FRAME> again{};
      CREPES_EXPECT(
          led_frame_write(&frame, again.data()) == std::size_t{frame.size} + LED_FRAME_OVERHEAD,
          "frames can be written again");
      if (frame.size != LED_SETTINGS_SIZE) continue;
      const led_settings settings = led_settings_read(frame.payload);
      static_cast<void>(led_settings_fault(&settings));
    }
  }
}

std::vector<FuzzInput> led_seeds() {
  FuzzInput stream;
  for (const std::uint8_t size : {std::uint8_t{0}, std::uint8_t{LED_SETTINGS_SIZE}}) {
    const led_frame frame{.type = LED_SETTINGS, .size = size, .payload = {3, 0, 20, 1, 2, 3}};
    std::array<std::uint8_t, LED_MAX_FRAME> bytes{};
    const std::size_t length = led_frame_write(&frame, bytes.data());
    stream.insert(stream.end(), bytes.begin(), bytes.begin() + static_cast<long>(length));
  }
  return {stream};
}

constexpr std::array kTargets{
    FuzzTarget{"nlink", &run_uwb<NlinkParser>, [] { return recorded("nlink", ""); }},
    FuzzTarget{"range_line", &run_uwb<RangeLineParser>,
               [] { return text_seed("range 3 4.27 -91.5 -80\n"); }},
    FuzzTarget{"dwm1001", &run_uwb<Dwm1001ShellParser>,
               [] {
                 return text_seed(
                     "DIST,1,AN0,0005,1.7,4.5,2.3,1.61,POS,1,2,3,4\r\n"
                     "0005[1.75,4.55,2.33]=1.61 le_us=3082 est[1,2,3,4]\r\n");
               }},
    FuzzTarget{"dwm1001_tlv", &run_uwb<Dwm1001TlvParser>,
               [] {
                 return std::vector<FuzzInput>{piece_by_piece(bytes_of(
                     "40 01 00 41 0d 4b 0a 00 00 1f 0e 00 00 9c 0f 00 00 40 48 0e 01 05 00 "
                     "34 12 00 00 ca de 39 05 00 00 64"))};
               }},
    FuzzTarget{
        "mauwb", &run_uwb<MaUwbParser>,
        [] { return text_seed("AT+RANGE=tid:7,mask:0F,seq:1,range:(997,0),ancid:(0,1)\n"); }},
    FuzzTarget{
        "fira_uci", &run_uwb<FiraUciParser>,
        [] {
          FuzzInput frame = bytes_of(
              "62 00 00 38 10 00 00 00 11 00 00 00 00 c8 00 00 00 01 00 00 00 00 00 00 00 00 "
              "00 00 01 01 00 00 00 99 00");
          frame.resize(60);
          return std::vector<FuzzInput>{piece_by_piece(frame)};
        }},
    FuzzTarget{"bu03", &run_uwb<Bu03Parser>,
               [] {
                 FuzzInput frame = bytes_of("aa 25 01 ee 07 00 00 d8 04 00 00");
                 frame.resize(37);
                 frame.back() = 0x55;
                 return std::vector<FuzzInput>{piece_by_piece(frame)};
               }},
    FuzzTarget{"witmotion", [](Bytes data) { run_stream(data, WitMotionParser()); },
               [] { return recorded("imu", "witmotion_hwt905"); }},
    FuzzTarget{"witmotion_ble", [](Bytes data) { run_stream(data, WitMotionBleParser()); },
               [] { return recorded("imu", "witmotion_ble"); }},
    FuzzTarget{"hipnuc", [](Bytes data) { run_stream(data, HipnucParser()); },
               [] { return recorded("imu", "hipnuc"); }},
    FuzzTarget{"xsens", [](Bytes data) { run_stream(data, XsensParser()); },
               [] { return recorded("imu", "xsens"); }},
    FuzzTarget{"mavlink", [](Bytes data) { run_stream(data, MavlinkParser()); },
               [] { return recorded("imu", "mavlink"); }},
    FuzzTarget{"vectornav", [](Bytes data) { run_stream(data, VectorNavParser()); },
               [] { return recorded("imu", "vectornav"); }},
    FuzzTarget{"microstrain", [](Bytes data) { run_stream(data, MicroStrainParser()); },
               [] { return recorded("imu", "microstrain"); }},
    FuzzTarget{"iio_scan", &run_iio_scan, &iio_scan_seeds},
    FuzzTarget{"detect_protocol", &run_detect_protocol, &detect_protocol_seeds},
    FuzzTarget{"device_clock", &run_device_clock, &device_clock_seeds},
    FuzzTarget{"peer_message", &run_peer_message, &peer_message_seeds},
    FuzzTarget{"mesh", &run_mesh, &mesh_seeds, 40},
    FuzzTarget{"subscription", &run_subscription, &subscription_seeds},
    FuzzTarget{"config", &run_config, &config_seeds},
    FuzzTarget{"led", &run_led, &led_seeds}};

std::string corpus_file(std::string_view target) {
  return source_dir() + "/tests/fuzz/corpus/" + std::string(target) + ".hex";
}

}  // namespace

std::span<const FuzzTarget> fuzz_targets() { return kTargets; }

const FuzzTarget& fuzz_target(std::string_view name) {
  const auto* const found = std::ranges::find(kTargets, name, &FuzzTarget::name);
  CREPES_EXPECT(found != kTargets.end(), "a target of this name");
  return *found;
}

std::string hex_of(std::span<const std::uint8_t> input) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : input) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

std::vector<FuzzInput> read_hex_lines(const std::string& file_name) {
  std::vector<FuzzInput> inputs;
  std::ifstream file(file_name);
  for (std::string line; std::getline(file, line);) {
    FuzzInput input;
    for (std::size_t at = 0; at + 2 <= line.size(); at += 2)
      input.push_back(static_cast<std::uint8_t>(std::stoul(line.substr(at, 2), nullptr, 16)));
    inputs.push_back(std::move(input));
  }
  return inputs;
}

std::vector<FuzzInput> kept_inputs(std::string_view target) {
  return read_hex_lines(corpus_file(target));
}

void keep_inputs(std::string_view target, std::vector<FuzzInput> inputs) {
  std::ranges::sort(inputs, [](const FuzzInput& a, const FuzzInput& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  });
  std::ofstream file(corpus_file(target));
  for (const FuzzInput& input : inputs) file << hex_of(input) << '\n';
}

}  // namespace crepes
