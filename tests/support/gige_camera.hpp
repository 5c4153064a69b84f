/// A GigE Vision camera of our own on loopback, in a network where nobody else is.
#pragma once

#include <arv.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "drivers/base/unique_fd.hpp"

namespace crepes {

/// Who is not root may have a network within a world of users of its own, where it goes on being
/// itself.
inline bool become_user_of_own_world() {
  const std::string user = std::to_string(::getuid());
  const std::string group = std::to_string(::getgid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  std::ofstream("/proc/self/uid_map") << user + " " + user + " 1";
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/gid_map") << group + " " + group + " 1";
  return true;
}

inline bool switch_loopback_on() {
  const UniqueFd socket{::socket(AF_INET, SOCK_DGRAM, 0)};
  ifreq request{.ifr_ifrn = {"lo"}, .ifr_ifru = {}};
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0) return false;
  request.ifr_flags |= IFF_UP;
  return ::ioctl(socket.get(), SIOCSIFFLAGS, &request) == 0;
}

/// Moves this thread, and those that it starts from now on, to a network with nothing but loopback:
/// GigE Vision's port is fixed. Once for a process; false where that is not allowed.
inline bool enter_own_network() {
  static const bool kEntered =
      (::unshare(CLONE_NEWNET) == 0 || become_user_of_own_world()) && switch_loopback_on();
  return kEntered;
}

/// Plugged in from construction to destruction; serves one reader at the rate that it asks for.
class GigeCamera {
 public:
  /// To be painted: `width` times `height` gray levels, row by row.
  struct Picture {
    std::uint8_t* pixels = nullptr;
    int width = 0;
    int height = 0;
    double exposure_us = 0.0;  ///< as set by the reader

    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(width * height); }
  };
  /// Writes the next picture, on a thread of the camera.
  using Paint = std::function<void(const Picture& picture)>;

  explicit GigeCamera(Paint paint, double lost_packets = 0.0)
      : paint_(std::move(paint)),
        camera_(ARV_GV_FAKE_CAMERA(g_object_new(ARV_TYPE_GV_FAKE_CAMERA, "interface-name", "lo",
                                                "serial-number", "GV01", "gvsp-lost-ratio",
                                                lost_packets, nullptr)),
                g_object_unref) {
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_.get()), paint_on,
                                     &paint_);
  }

  [[nodiscard]] bool is_running() const { return arv_gv_fake_camera_is_running(camera_.get()); }
  void lose_packets(double share) {
    g_object_set(camera_.get(), "gvsp-lost-ratio", share, nullptr);
  }

  static constexpr const char* kAddress = "127.0.0.1";
  static constexpr const char* kId = "Aravis-Fake-GV01";

 private:
  static void paint_on(ArvBuffer* buffer, void* paint, guint32 exposure_us, guint32 /*gain*/,
                       ArvPixelFormat /*format*/) {
    std::size_t size = 0;
    auto* pixels =
        static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
    (*static_cast<Paint*>(paint))({.pixels = pixels,
                                   .width = arv_buffer_get_image_width(buffer),
                                   .height = arv_buffer_get_image_height(buffer),
                                   .exposure_us = static_cast<double>(exposure_us)});
  }

  Paint paint_;
  std::unique_ptr<ArvGvFakeCamera, void (*)(gpointer)> camera_;
};

}  // namespace crepes
