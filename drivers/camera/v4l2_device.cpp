#include "drivers/camera/v4l2_device.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "drivers/serial/device_name.hpp"

namespace crepes {
namespace {

class KernelDevice final : public V4l2Device {
 public:
  explicit KernelDevice(UniqueFd fd) : fd_(std::move(fd)) {}
  KernelDevice(const KernelDevice&) = delete;
  KernelDevice& operator=(const KernelDevice&) = delete;
  KernelDevice(KernelDevice&&) = delete;
  KernelDevice& operator=(KernelDevice&&) = delete;
  ~KernelDevice() override {
    for (const auto& [start, length] : mapped_) ::munmap(start, length);
  }

  [[nodiscard]] int ioctl(unsigned long code, void* argument) override {
    int answer = 0;
    do {
      answer = ::ioctl(fd_.get(), code, argument);
    } while (answer != 0 && errno == EINTR);
    return answer == 0 ? 0 : errno;
  }

  [[nodiscard]] std::span<const std::uint8_t> map(std::size_t length, std::size_t offset) override {
    void* const start = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(),
                               static_cast<off_t>(offset));
    if (start == MAP_FAILED) return {};
    mapped_.emplace_back(start, length);
    return {static_cast<const std::uint8_t*>(start), length};
  }

  [[nodiscard]] bool wait(std::chrono::milliseconds timeout) override {
    pollfd waiting{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    return ::poll(&waiting, 1, static_cast<int>(timeout.count())) > 0;
  }

 private:
  UniqueFd fd_;
  std::vector<std::pair<void*, std::size_t>> mapped_;
};

/// The name of the device, if it captures frames.
std::optional<std::string> name_of_camera(const std::string& path) {
  const Result<std::unique_ptr<V4l2Device>> device = open_v4l2_device(path);
  v4l2_capability ability{};
  if (!device || (*device)->ioctl(VIDIOC_QUERYCAP, &ability) != 0) return std::nullopt;
  if ((ability.device_caps & V4L2_CAP_VIDEO_CAPTURE) == 0) return std::nullopt;
  const auto* const card = ability.card;
  return std::string(card, std::find(card, card + sizeof(ability.card), 0));
}

}  // namespace

Result<std::unique_ptr<V4l2Device>> open_v4l2_device(const std::string& path) {
  UniqueFd fd{::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)};
  if (fd) return std::make_unique<KernelDevice>(std::move(fd));
  const int error = errno;
  return fail(error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo,
              fmt::format("{}: {}", path, std::generic_category().message(error)));
}

std::vector<FoundCamera> find_v4l2_cameras(const std::filesystem::path& dev) {
  std::vector<FoundCamera> found;
  std::error_code failed;
  std::filesystem::directory_iterator entry(dev, failed);
  for (; !failed && entry != std::filesystem::directory_iterator(); entry.increment(failed)) {
    const std::string path = entry->path();
    if (!entry->path().filename().string().starts_with("video")) continue;
    if (const auto name = name_of_camera(path))
      found.push_back({by_id_link_of(path, dev / "v4l" / "by-id").value_or(path), *name});
  }
  return found;
}

}  // namespace crepes
