/// A folder with the files that the kernel shows of IIO devices, and FIFOs as their character
/// devices.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "drivers/iio/iio_devices.hpp"

namespace crepes {

/// Bytes of a scan, in the device's byte order.
class ScanBytes {
 public:
  explicit ScanBytes(std::endian order = std::endian::little) : order_(order) {}

  ScanBytes& add(std::int64_t value, std::size_t size) { return add(value, size, order_); }
  ScanBytes& add(std::int64_t value, std::size_t size, std::endian order) {
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t byte = order == std::endian::big ? size - 1 - i : i;
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> 8U * byte));
    }
    return *this;
  }
  ScanBytes& triad(std::int64_t x, std::int64_t y, std::int64_t z) {
    return add(x, 2).add(y, 2).add(z, 2);
  }
  /// The stamp, aligned to its own eight bytes; the kernel writes it in the machine's order.
  ScanBytes& stamp(std::int64_t ns) {
    while (bytes_.size() % 8 != 0) bytes_.push_back(0xaa);
    return add(ns, 8, std::endian::little);
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::endian order_;
  std::vector<std::uint8_t> bytes_;
};

/// The machine of a test. Device n is `iio:device<n>`.
class FakeIio {
 public:
  FakeIio() {
    std::string root = testing::TempDir() + "crepes-iio-XXXXXX";
    if (::mkdtemp(root.data()) == nullptr) std::abort();
    root_ = root;
    paths_ = {.devices = root_ / "sys", .dev = root_ / "dev"};
    std::filesystem::create_directories(paths_.devices);
    std::filesystem::create_directories(paths_.dev);
  }
  FakeIio(const FakeIio&) = delete;
  FakeIio& operator=(const FakeIio&) = delete;
  FakeIio(FakeIio&&) = delete;
  FakeIio& operator=(FakeIio&&) = delete;
  ~FakeIio() { std::filesystem::remove_all(root_); }

  [[nodiscard]] const IioPaths& paths() const { return paths_; }
  [[nodiscard]] std::filesystem::path folder(int n) const {
    return paths_.devices / ("iio:device" + std::to_string(n));
  }

  void write(int n, const std::string& name, const std::string& text) const {
    write(folder(n) / name, text);
  }
  static void write(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << '\n';
  }
  [[nodiscard]] std::string read(int n, const std::string& name) const {
    std::string text;
    std::getline(std::ifstream(folder(n) / name), text);
    return text;
  }
  void remove(int n, const std::string& name) const { std::filesystem::remove(folder(n) / name); }

  /// Three channels of `quantity` from `first_index` on, without a buffer.
  void add_quantity(int n, const std::string& quantity, const std::string& scale) const {
    write(n, "in_" + quantity + "_scale", scale);
    for (const char* axis : {"_x", "_y", "_z"}) write(n, "in_" + quantity + axis + "_raw", "0");
  }
  void add_to_buffer(int n, const std::string& quantity, int first_index,
                     const std::string& type) const {
    for (const char* axis : {"_x", "_y", "_z"})
      add_channel(n, "in_" + quantity + axis, first_index++, type);
  }
  void add_channel(int n, const std::string& name, int index, const std::string& type) const {
    const std::string base = "scan_elements/" + name;
    write(n, base + "_en", "0");
    write(n, base + "_index", std::to_string(index));
    write(n, base + "_type", type);
  }
  /// The buffer's own files and the character device, to which the test holds the other end.
  void add_buffer(int n, int stamp_index) {
    add_channel(n, "in_timestamp", stamp_index, "le:s64/64>>0");
    write(n, "buffer/enable", "0");
    write(n, "buffer/length", "2");
    write(n, "buffer/watermark", "1");
    write(n, "current_timestamp_clock", "realtime");
    const std::string fifo = paths_.dev / ("iio:device" + std::to_string(n));
    ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    ends_[n] = UniqueFd(::open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    ASSERT_TRUE(ends_[n]);
  }

  void send(int n, const std::vector<std::uint8_t>& bytes) {
    ASSERT_EQ(::write(ends_[n].get(), bytes.data(), bytes.size()),
              static_cast<ssize_t>(bytes.size()));
  }
  void unplug(int n) { ends_.erase(n); }

 private:
  std::filesystem::path root_;
  IioPaths paths_;
  std::map<int, UniqueFd> ends_;
};

/// ICM-42688: two devices of one driver, big-endian; sets gyroscope 0 and accelerometer 1.
inline void add_icm42688(FakeIio& machine) {
  for (const auto& [n, quantity] : {std::pair(0, "anglvel"), std::pair(1, "accel")}) {
    const bool is_gyro = n == 0;
    machine.write(n, "name", is_gyro ? "icm42688-gyro" : "icm42688-accel");
    machine.add_quantity(n, quantity, is_gyro ? "0.001" : "0.01");
    machine.add_to_buffer(n, quantity, 0, "be:s16/16>>0");
    machine.add_channel(n, "in_temp", 3, "be:s16/16>>0");
    machine.add_buffer(n, 4);
    const std::string rate = "in_" + std::string(quantity) + "_sampling_frequency";
    machine.write(n, rate, "50.000000");
    machine.write(n, rate + "_available", "12.5 25.0 50.0 100.0 200.0 500.0 1000.0");
  }
}

/// A chip with both in one device, little-endian, 12 bits at the top, with a trigger of its own.
inline void add_one_chip(FakeIio& machine) {
  machine.write(0, "name", "mpu6500");
  machine.add_quantity(0, "accel", "0.5");
  machine.add_quantity(0, "anglvel", "0.25");
  machine.add_to_buffer(0, "accel", 0, "le:s12/16>>4");
  machine.add_to_buffer(0, "anglvel", 4, "le:s12/16>>4");
  machine.add_channel(0, "in_temp", 3, "le:s16/16>>0");
  machine.add_buffer(0, 7);
  machine.write(0, "sampling_frequency", "50");
}

}  // namespace crepes
