#include "tests/firmware/qemu_board.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

namespace crepes {
namespace {

constexpr const char* kQemu = CREPES_QEMU;
constexpr const char* kImage = CREPES_LED_IMAGE;
const std::array<const char*, LED_FLASH_PAGES> kPageAddresses{"0x08004000", "0x08004800"};
constexpr int kLogPatienceMs = 20'000;

struct Pipe {
  UniqueFd read;
  UniqueFd write;
};

Result<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return fail(ErrorCode::kIo, "pipe");
  return Pipe{UniqueFd{ends[0]}, UniqueFd{ends[1]}};
}

/// Writes a page of flash to `folder` and returns the option with which QEMU loads it.
std::string loader(RamFlash& flash, int page, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / ("page_" + std::to_string(page));
  std::ofstream out(path, std::ios::binary);
  for (std::size_t i = 0; i < RamFlash::kHalfWords; ++i) {
    out.put(static_cast<char>(flash.at(page, i) & 0xFF));
    out.put(static_cast<char>(flash.at(page, i) >> 8));
  }
  return "loader,force-raw=on,file=" + path.string() +
         ",addr=" + kPageAddresses.at(static_cast<std::size_t>(page));
}

Result<pid_t> spawn(std::vector<std::string> words, int in, int out, int log) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, in, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, log, STDERR_FILENO);
  pid_t pid = 0;
  const int error = ::posix_spawn(&pid, kQemu, &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return fail(ErrorCode::kIo, fmt::format("{}: cannot be started", kQemu));
  return pid;
}

bool is_readable(int fd, int timeout_ms) {
  pollfd waiting{.fd = fd, .events = POLLIN, .revents = 0};
  return ::poll(&waiting, 1, timeout_ms) > 0;
}

}  // namespace

std::string why_no_board() {
  if (!std::filesystem::exists(kImage)) return "no image: is gcc-arm-none-eabi installed?";
  if (!std::filesystem::exists(kQemu)) return "qemu-system-arm is not installed";
  return "";
}

Result<QemuBoard> QemuBoard::start(RamFlash& flash, const std::vector<std::string>& options) {
  Result<Pipe> in = make_pipe();
  Result<Pipe> out = make_pipe();
  Result<Pipe> log = make_pipe();
  if (!in || !out || !log) return fail(ErrorCode::kIo, "no pipes");
  std::string name = (std::filesystem::temp_directory_path() / "led_board_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return fail(ErrorCode::kIo, name + ": cannot be made");

  std::vector<std::string> words{kQemu,
                                 "-M",
                                 "stm32vldiscovery",
                                 "-display",
                                 "none",
                                 "-monitor",
                                 "none",
                                 "-serial",
                                 "stdio",
                                 "-kernel",
                                 kImage,
                                 "-device",
                                 loader(flash, 0, name),
                                 "-device",
                                 loader(flash, 1, name)};
  words.insert(words.end(), options.begin(), options.end());
  const Result<pid_t> pid = spawn(words, in->read.get(), out->write.get(), log->write.get());
  if (!pid) return tl::unexpected(pid.error());
  return QemuBoard(*pid, name, std::move(in->write), std::move(out->read), std::move(log->read));
}

QemuBoard::QemuBoard(pid_t pid, std::filesystem::path folder, UniqueFd in, UniqueFd out,
                     UniqueFd log)
    : pid_(pid),
      folder_(std::move(folder)),
      in_(std::move(in)),
      out_(std::move(out)),
      log_(std::move(log)) {}

QemuBoard::QemuBoard(QemuBoard&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      folder_(std::move(other.folder_)),
      in_(std::move(other.in_)),
      out_(std::move(other.out_)),
      log_(std::move(other.log_)),
      pending_(std::move(other.pending_)),
      read_to_(other.read_to_) {}

QemuBoard::~QemuBoard() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::optional<std::string> QemuBoard::log_line() {
  std::size_t end = pending_.find('\n', read_to_);
  while (end == std::string::npos) {
    pending_.erase(0, std::exchange(read_to_, 0));
    if (!is_readable(log_.get(), kLogPatienceMs)) return std::nullopt;
    std::array<char, 65536> chunk{};
    const ssize_t count = ::read(log_.get(), chunk.data(), chunk.size());
    if (count <= 0) return std::nullopt;
    pending_.append(chunk.data(), static_cast<std::size_t>(count));
    end = pending_.find('\n', read_to_);
  }
  std::string line = pending_.substr(read_to_, end - read_to_);
  read_to_ = end + 1;
  return line;
}

void QemuBoard::send(std::span<const std::uint8_t> bytes) const {
  if (::write(in_.get(), bytes.data(), bytes.size()) < 0) std::perror("led board");
}

std::optional<std::uint8_t> QemuBoard::receive(std::chrono::milliseconds timeout) const {
  std::uint8_t byte = 0;
  if (!is_readable(out_.get(), static_cast<int>(timeout.count()))) return std::nullopt;
  if (::read(out_.get(), &byte, 1) != 1) return std::nullopt;
  return byte;
}

}  // namespace crepes
