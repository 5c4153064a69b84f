#include "daemon/recording/unix_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::unix_socket_test {
namespace {

TEST(UnixSocket, ReplacesASocketThatNobodyListensOn) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::filesystem::path path = scratch.path() / "record";
  ASSERT_TRUE(listen_unix(path));  // and closed: the file stays
  ASSERT_TRUE(std::filesystem::is_socket(path));

  const Result<UniqueFd> listener = listen_unix(path);

  ASSERT_TRUE(listener) << listener.error().message;
  const Result<UniqueFd> second = listen_unix(path);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another daemon listens there"), std::string::npos);
}

TEST(UnixSocket, NeverWaitsForAnotherDaemonThatAcceptsNobody) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::filesystem::path path = scratch.path() / "record";
  const Result<UniqueFd> listener = listen_unix(path);
  ASSERT_TRUE(listener);
  std::vector<UniqueFd> waiting;
  for (auto one = connect_unix(path, SOCK_NONBLOCK); one; one = connect_unix(path, SOCK_NONBLOCK))
    waiting.push_back(std::move(*one));
  ASSERT_FALSE(waiting.empty());

  const Result<UniqueFd> second = listen_unix(path);

  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another daemon listens there"), std::string::npos);
}

TEST(UnixSocket, LeavesFilesThatAreNoSockets) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::filesystem::path path = scratch.path() / "notes";
  std::ofstream(path) << "precious";

  const Result<UniqueFd> listener = listen_unix(path);

  ASSERT_FALSE(listener);
  EXPECT_EQ(listener.error().code, ErrorCode::kConfig);
  EXPECT_EQ(listener.error().message, path.string() + ": is there and is no socket");
  EXPECT_EQ(read_text(path), "precious");
}

}  // namespace
}  // namespace crepes::unix_socket_test
