/// Changes fields of a datagram's contents, as integers before they are coded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "net/mesh/peer_message_code.hpp"

namespace crepes {

/// The bytes of an input, zeros after its end.
class FuzzBytes {
 public:
  explicit FuzzBytes(std::span<const std::uint8_t> data) : data_(data) {}

  [[nodiscard]] bool is_empty() const { return at_ >= data_.size(); }
  std::uint8_t next() { return is_empty() ? std::uint8_t{0} : data_[at_++]; }

 private:
  std::span<const std::uint8_t> data_;
  std::size_t at_ = 0;
};

/// A stream of `wire::code_body`. For each change the input has a byte with how many fields to
/// pass, a byte with what becomes of the next one, and two bytes for its value if it needs one.
class BodyChanger {
 public:
  BodyChanger(FuzzBytes& input, int changes) : input_(input), left_(changes) {}

  template <class Value>
  void bits(Value& value, unsigned count) {
    constexpr unsigned kMostOfASign = 62;
    if (!is_next()) return;
    const std::int64_t most = std::int64_t{1} << std::min(count, kMostOfASign);
    const wire::Bounds bounds{count > kMostOfASign ? -most : 0, most - 1};
    const auto bits = static_cast<std::uint64_t>(changed(static_cast<std::int64_t>(value), bounds));
    value = static_cast<Value>(count < 64 ? bits & ((std::uint64_t{1} << count) - 1) : bits);
  }
  template <class Value>
  void number(Value& value, unsigned /*k*/) {
    constexpr std::int64_t kMost = 70000;  // more than any id
    auto number = static_cast<std::int64_t>(value);
    if (is_next()) number = changed(number, {0, kMost});
    // There is no code for the step back to an item that was repeated.
    value = static_cast<Value>(std::max<std::int64_t>(0, number));
  }
  void delta(std::int64_t& value, std::int64_t /*predicted*/, unsigned /*k*/, wire::Bounds bounds,
             PeerMessageError /*outside*/) {
    if (is_next()) value = changed(value, bounds);
  }
  /// Items are left out, or the last one is repeated.
  template <class Item>
  void size(std::vector<Item>& items, unsigned /*k*/) {
    constexpr std::size_t kMost = 12;
    if (is_next()) items.resize(input_.next() % kMost, items.empty() ? Item{} : items.back());
  }
  template <class Item>
  void presence(std::optional<Item>& item) {
    if (is_next()) item = item ? std::nullopt : std::optional(Item{});
  }
  void expect(bool /*holds*/, PeerMessageError /*fault*/) {}

 private:
  [[nodiscard]] bool is_next() {
    if (left_ == 0) return false;
    if (!pass_) pass_ = input_.next();
    if ((*pass_)-- > 0) return false;
    pass_.reset();
    --left_;
    return true;
  }

  /// Never far beyond the bounds: the layout computes with the values.
  [[nodiscard]] std::int64_t changed(std::int64_t value, wire::Bounds bounds) {
    constexpr std::int64_t kDrawn = 65536;
    const int kind = input_.next() % 8;
    const std::int64_t high = input_.next();
    const std::int64_t drawn = high * 256 + input_.next();
    const auto from_kind = [&] {
      switch (kind) {
        case 0:
          return bounds.min;
        case 1:
          return bounds.max;
        case 2:
          return std::int64_t{0};
        case 3:
          return value + drawn - kDrawn / 2;
        case 4:
          return value + (drawn - kDrawn / 2) * 1000;
        case 5:  // no encoder writes it
          return bounds.max + 1 + drawn;
        case 6:
          return value ^ (std::int64_t{1} << (drawn % 60));
        default:
          return bounds.min + (bounds.max / kDrawn - bounds.min / kDrawn) * drawn;
      }
    };
    return std::clamp(from_kind(), bounds.min - kDrawn, bounds.max + kDrawn);
  }

  FuzzBytes& input_;
  int left_;
  std::optional<int> pass_;  ///< fields until the next change
};

}  // namespace crepes
