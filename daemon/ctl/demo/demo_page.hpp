/// The page of a demo: crepesctl view of all its robots, as a process of its own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/base/child_process.hpp"

namespace crepes {

class DemoPage {
 public:
  /// Serves at `listen` (ADDRESS:PORT) the robots whose subscriptions are at `first_port` and the
  /// ports that follow, and whose configurations are DIR/<robot>.yaml. The log goes to `dir`.
  [[nodiscard]] static Result<DemoPage> start(const std::filesystem::path& tool,
                                              const std::filesystem::path& dir,
                                              const std::string& listen, std::uint16_t first_port,
                                              const std::vector<std::string>& robots);

  /// Where a daemon of the demo serves its pictures.
  [[nodiscard]] static std::string socket_of(const std::filesystem::path& dir,
                                             const std::string& robot) {
    return dir / (robot + ".socket");
  }

  /// An error if it has ended.
  [[nodiscard]] Result<void> check();
  /// Its address, as it printed it; empty until then.
  [[nodiscard]] std::string url() const;

 private:
  DemoPage(ChildProcess process, std::filesystem::path log)
      : process_(std::move(process)), log_(std::move(log)) {}

  ChildProcess process_;
  std::filesystem::path log_;
};

}  // namespace crepes
