#include "net/mesh/locked_key.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"

namespace crepes::locked_key_test {
namespace {

#if defined(CREPES_TSAN) || defined(CREPES_ASAN)
constexpr bool kLocksMemory = false;  // sanitizers turn mlock into nothing
#else
constexpr bool kLocksMemory = true;
#endif

/// The flags of the memory at `place` (proc(5), smaps); empty where there is none.
std::string flags_of(const void* place) {
  const auto wanted = reinterpret_cast<std::uintptr_t>(place);
  std::ifstream maps("/proc/self/smaps");
  bool is_it = false;
  for (std::string line; std::getline(maps, line);) {
    const std::size_t dash = line.find('-');
    const std::size_t space = line.find(' ');
    if (dash < space && line.find(':') > space)
      is_it = std::stoull(line.substr(0, dash), nullptr, 16) <= wanted &&
              wanted < std::stoull(line.substr(dash + 1, space - dash - 1), nullptr, 16);
    if (is_it && line.starts_with("VmFlags:")) return line + " ";
  }
  return "";
}

TEST(LockedKey, IsNeitherSwappedNorDumpedAndGoneAtTheEnd) {
  LockedKey<MeshKey> own = locked(MeshKey{{1, 2, 3}});
  const void* const place = own.key.get();
  EXPECT_EQ(*own.key, (MeshKey{{1, 2, 3}}));
  EXPECT_TRUE(own.is_locked);
  EXPECT_NE(flags_of(place).find(" dd "), std::string::npos) << flags_of(place);
  EXPECT_TRUE(!kLocksMemory || flags_of(place).find(" lo ") != std::string::npos);

  own.key.reset();  // sodium_free overwrites before it returns the page

  EXPECT_EQ(flags_of(place), "");
}

TEST(LockedKey, TellsThatTheSystemRefusesToLock) {
  if (!kLocksMemory) GTEST_SKIP() << "sanitizers turn mlock into nothing";
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    const rlimit none{0, 0};
    const bool is_limited =
        ::setrlimit(RLIMIT_MEMLOCK, &none) == 0 && (::getuid() != 0 || ::setuid(kNobody) == 0);
    const PacketSeal seal(MeshKey{{1}});
    const PacketSigner signer(robot_key_of(std::array<std::uint8_t, 32>{2}));
    ::_exit(is_limited && !seal.is_locked() && !signer.is_locked() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_TRUE(PacketSeal(MeshKey{{1}}).is_locked());
}

/// The bytes in which a key was, after its end.
template <class Key>
std::array<std::byte, sizeof(Key)> remains_of(const Key& key) {
  alignas(Key) std::array<std::byte, sizeof(Key)> memory{};
  auto* const copy = new (memory.data()) Key(key);
  copy->~Key();
  std::array<std::byte, sizeof(Key)> remains{};
  const volatile std::byte* const bytes = memory.data();
  for (std::size_t i = 0; i < remains.size(); ++i) remains.at(i) = bytes[i];
  return remains;
}

TEST(LockedKey, LeavesNothingOfItsCopies) {
  MeshKey shared;
  shared.bytes.fill(0x5a);
  RobotKey own;
  own.bytes.fill(0x5a);

  EXPECT_EQ(std::ranges::count(remains_of(shared), std::byte{0}), 32);
  EXPECT_EQ(std::ranges::count(remains_of(own), std::byte{0}), 64);
}

}  // namespace
}  // namespace crepes::locked_key_test
