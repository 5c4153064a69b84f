#include "drivers/dataset/dataset_faults.hpp"

#include <fmt/core.h>

namespace crepes {

void DatasetFaults::add(const std::filesystem::path& file, std::size_t line,
                        std::string_view reason, std::string_view detail) {
  ++counts_[std::string(reason)];
  last_ = file.string();
  if (line > 0) last_ += fmt::format(":{}", line);
  last_.append(": ").append(reason);
  if (!detail.empty()) last_.append(": ").append(detail);
  if (list_.size() < kMaxListed) list_.push_back(last_);
}

std::uint64_t DatasetFaults::total() const {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : counts_) sum += count;
  return sum;
}

}  // namespace crepes
