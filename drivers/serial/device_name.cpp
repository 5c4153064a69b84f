#include "drivers/serial/device_name.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// Visits the entries of a directory that may change or disappear meanwhile.
template <class OnEntry>
void for_each_entry(const fs::path& directory, OnEntry on_entry) {
  std::error_code failed;
  fs::directory_iterator entry(directory, failed);
  while (!failed && entry != fs::directory_iterator()) {
    on_entry(entry->path());
    entry.increment(failed);
  }
}

/// The path after resolving all links; empty if it does not exist.
fs::path target_of(const fs::path& path) {
  std::error_code failed;
  fs::path target = fs::canonical(path, failed);
  return failed ? fs::path() : target;
}

bool has_open(const fs::path& process, const fs::path& device) {
  bool found = false;
  for_each_entry(process / "fd", [&](const fs::path& descriptor) {
    std::error_code failed;
    found = found || fs::read_symlink(descriptor, failed) == device;
  });
  return found;
}

}  // namespace

std::optional<std::string> by_id_link_of(const std::string& device, const fs::path& by_id) {
  const fs::path target = target_of(device);
  std::optional<std::string> name;
  for_each_entry(by_id, [&](const fs::path& link) {
    if (!target.empty() && target_of(link) == target) name = link;
  });
  return name;
}

std::optional<std::string> process_using(const std::string& device) {
  const fs::path target = target_of(device);
  std::optional<std::string> holder;
  for_each_entry("/proc", [&](const fs::path& process) {
    const std::string id = process.filename();
    if (holder || !std::ranges::all_of(id, [](char c) { return c >= '0' && c <= '9'; })) return;
    if (!has_open(process, target)) return;
    std::string name;
    std::ifstream(process / "comm") >> name;
    holder = fmt::format("{} ({})", name, id);
  });
  return holder;
}

void DeviceName::configure(const std::string& configured) {
  if (configured == configured_) return;
  configured_ = configured;
  by_id_link_.reset();
}

std::string DeviceName::path_to_open() const {
  if (!by_id_link_) return configured_;
  // Adapters without a serial number share one link. If it now refers to another adapter, the
  // configured device is the one without a link.
  const bool shared = !target_of(*by_id_link_).empty() && !target_of(configured_).empty() &&
                      !by_id_link_of(configured_, by_id_);
  return shared ? configured_ : *by_id_link_;
}

void DeviceName::remember_link() {
  std::error_code failed;
  if (by_id_link_ || fs::is_symlink(configured_, failed)) return;
  by_id_link_ = by_id_link_of(configured_, by_id_);
}

}  // namespace crepes
