#include "drivers/serial/device_name.hpp"

#include <algorithm>
#include <fstream>
#include <system_error>

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// The entries of a directory that may change or vanish meanwhile.
template <class OnEntry>
void for_each_entry(const fs::path& directory, OnEntry on_entry) {
  std::error_code failed;
  fs::directory_iterator entry(directory, failed);
  while (!failed && entry != fs::directory_iterator()) {
    on_entry(entry->path());
    entry.increment(failed);
  }
}

/// Where all links end; empty: nowhere.
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

std::optional<std::string> steady_name_of(const std::string& device, const fs::path& by_id) {
  const fs::path target = target_of(device);
  std::optional<std::string> name;
  for_each_entry(by_id, [&](const fs::path& link) {
    if (!target.empty() && target_of(link) == target) name = link;
  });
  return name;
}

std::optional<std::string> holder_of(const std::string& device) {
  const fs::path target = target_of(device);
  std::optional<std::string> holder;
  for_each_entry("/proc", [&](const fs::path& process) {
    const std::string id = process.filename();
    if (holder || !std::ranges::all_of(id, [](char c) { return c >= '0' && c <= '9'; })) return;
    if (!has_open(process, target)) return;
    std::string name;
    std::ifstream(process / "comm") >> name;
    holder = name + " (" + id + ")";
  });
  return holder;
}

std::string DeviceName::to_open() const {
  if (!steady_) return configured_;
  // Adapters without a serial number share one link. Where it points at another one now, the
  // configured device is the one without a link.
  const bool shared = !target_of(*steady_).empty() && !target_of(configured_).empty() &&
                      !steady_name_of(configured_, by_id_);
  return shared ? configured_ : *steady_;
}

void DeviceName::remember() {
  std::error_code failed;
  if (steady_ || fs::is_symlink(configured_, failed)) return;
  steady_ = steady_name_of(configured_, by_id_);
}

}  // namespace crepes
