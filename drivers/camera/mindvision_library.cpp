#include "drivers/camera/mindvision_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

namespace crepes {
namespace {

/// Looks up functions until one is missing.
class Symbols {
 public:
  explicit Symbols(void* library) : library_(library) {}

  template <class Function>
  void find(const char* name, Function*& function) {
    void* const found = ::dlsym(library_, name);
    if (found == nullptr && missing_.empty()) missing_ = name;
    // POSIX guarantees that the result of dlsym can be converted to a function pointer.
    function = reinterpret_cast<Function*>(found);  // NOLINT(*-reinterpret-cast)
  }
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  void* library_;
  std::string missing_;
};

}  // namespace

Result<MindVisionLibrary> MindVisionLibrary::load(const std::string& file) {
  // Never unloaded, because it runs its own threads.
  void* const handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (handle == nullptr) {
    const std::string why = ::dlerror();  // NOLINT(concurrency-mt-unsafe): glibc's is one a thread
    return fail(ErrorCode::kNotFound,
                fmt::format("MindVision's library cannot be loaded: install the vendor's SDK, or "
                            "set library to its file ({})",
                            why));
  }
  MindVisionLibrary library;
  Symbols symbols(handle);
  symbols.find("CameraSdkInit", library.init);
  symbols.find("CameraEnumerateDevice", library.enumerate);
  symbols.find("CameraInit", library.open);
  symbols.find("CameraPlay", library.play);
  symbols.find("CameraGetImageBuffer", library.get_frame);
  symbols.find("CameraReleaseImageBuffer", library.release_frame);
  symbols.find("CameraUnInit", library.close);
  symbols.find("CameraSetAeState", library.set_auto_exposure);
  symbols.find("CameraSetExposureTime", library.set_exposure_us);
  symbols.find("CameraSetFrameRate", library.set_frame_rate);
  symbols.find("CameraSetTriggerMode", library.set_trigger_mode);
  if (!symbols.missing().empty()) {
    return fail(ErrorCode::kFormat, fmt::format("{}: no library of MindVision, {} is not in it",
                                                file, symbols.missing()));
  }
  return library;
}

}  // namespace crepes
