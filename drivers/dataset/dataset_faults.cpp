#include "drivers/dataset/dataset_faults.hpp"

#include <fmt/core.h>

namespace crepes {

void DatasetFaults::add(const std::filesystem::path& file, std::size_t line,
                        std::string_view reason, std::string_view detail) {
  ++counts_[std::string(reason)];
  if (list_.size() >= kMaxListed) return;
  std::string text = file.string();
  if (line > 0) text += fmt::format(":{}", line);
  text.append(": ").append(reason);
  if (!detail.empty()) text.append(": ").append(detail);
  list_.push_back(std::move(text));
}

}  // namespace crepes
