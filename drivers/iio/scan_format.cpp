#include "drivers/iio/scan_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/base/number_text.hpp"
#include "drivers/serial/byte_fields.hpp"

namespace crepes {
namespace {

std::size_t bytes_of_element(const ScanElement& element) { return element.storage_bits / 8; }

/// Takes `text` up to `end`, and `end`; false if it is not there.
bool take_number(std::string_view& text, std::string_view end, unsigned& value) {
  const std::size_t at = end.empty() ? text.size() : text.find(end);
  if (at == std::string_view::npos || !parse_number(text.substr(0, at), value).empty())
    return false;
  text.remove_prefix(at + end.size());
  return true;
}

bool parse_element(std::string_view text, ScanElement& element) {
  if (!text.starts_with("le:") && !text.starts_with("be:")) return false;
  element.order = text.starts_with("be:") ? std::endian::big : std::endian::little;
  text.remove_prefix(3);
  if (!text.starts_with('s') && !text.starts_with('u')) return false;
  element.is_signed = text.starts_with('s');
  text.remove_prefix(1);
  if (!take_number(text, "/", element.bits)) return false;
  if (text.find(">>") == std::string_view::npos) return take_number(text, "", element.storage_bits);
  return take_number(text, ">>", element.storage_bits) && take_number(text, "", element.shift);
}

bool is_possible(const ScanElement& element) {
  const unsigned storage = element.storage_bits;
  return (storage == 8 || storage == 16 || storage == 32 || storage == 64) && element.bits > 0 &&
         element.bits <= storage && element.shift <= storage - element.bits;
}

}  // namespace

Result<ScanElement> parse_scan_element(std::string_view text) {
  ScanElement element;
  if (parse_element(text, element) && is_possible(element)) return element;
  return fail(ErrorCode::kFormat, fmt::format("unknown type of scan element \"{}\"", text));
}

ScanLayout::ScanLayout(std::vector<ScanElement> elements) : elements_(std::move(elements)) {
  std::size_t largest = 1;
  const auto align = [](std::size_t at, std::size_t size) { return (at + size - 1) / size * size; };
  for (const ScanElement& element : elements_) {
    const std::size_t size = bytes_of_element(element);
    offsets_.push_back(align(size_, size));
    size_ = offsets_.back() + size;
    largest = std::max(largest, size);
  }
  size_ = align(size_, largest);
}

std::int64_t ScanLayout::value(Bytes scan, std::size_t index) const {
  const ScanElement& element = elements_[index];
  const std::uint64_t raw =
      unsigned_at(scan, offsets_[index], bytes_of_element(element), element.order) >> element.shift;
  // Up to the highest bit and down again: that fills with zeros, or with the sign.
  const unsigned unused = 64 - element.bits;
  const std::uint64_t high = raw << unused;
  return element.is_signed ? static_cast<std::int64_t>(high) >> unused
                           : static_cast<std::int64_t>(high >> unused);
}

}  // namespace crepes
