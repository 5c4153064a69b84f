/// The faults of a data set's rows. A bad row is refused; all other rows count.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// Refused rows, counted by reason; the first ones are also listed.
class DatasetFaults {
 public:
  static constexpr std::size_t kMaxListed = 1000;

  /// `line` counts from 1; 0 means the file as a whole. `detail` may be empty.
  void add(const std::filesystem::path& file, std::size_t line, std::string_view reason,
           std::string_view detail = {});

  /// "file:line: reason: detail", in order of reading; at most kMaxListed.
  [[nodiscard]] const std::vector<std::string>& list() const { return list_; }
  [[nodiscard]] const std::map<std::string, std::uint64_t, std::less<>>& counts() const {
    return counts_;
  }
  /// Refused rows in all.
  [[nodiscard]] std::uint64_t total() const;
  /// The latest one, as in `list`; empty without any.
  [[nodiscard]] const std::string& last() const { return last_; }
  [[nodiscard]] bool empty() const { return counts_.empty(); }

 private:
  std::vector<std::string> list_;
  std::string last_;
  std::map<std::string, std::uint64_t, std::less<>> counts_;
};

}  // namespace crepes
