#include "daemon/stages/mesh_socket.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "config/keys/mesh_key.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::mesh_socket_test {
namespace {

using std::chrono::milliseconds;

NetConfig loopback() {
  NetConfig config;
  config.interface = "lo";
  config.port = free_port();
  return config;
}

TEST(MeshSocket, BacksOffWhileItOpensButCannotSend) {
  const LogSession log(LogLevel::kError);
  MeshSocket mesh(loopback());
  const Error refused{ErrorCode::kIo, "send: Operation not permitted"};
  Timestamp now{};
  ASSERT_NE(mesh.get(now), nullptr);
  mesh.close_for_retry(refused, now);
  now += milliseconds{100};
  ASSERT_NE(mesh.get(now), nullptr);
  EXPECT_EQ(mesh.fault(), refused.message);

  mesh.close_for_retry(refused, now);

  EXPECT_EQ(mesh.get(now + milliseconds{199}), nullptr);
  now += milliseconds{200};
  ASSERT_NE(mesh.get(now), nullptr);
  EXPECT_EQ(mesh.fault(), refused.message);

  mesh.end_fault();

  EXPECT_EQ(mesh.fault(), "");
  mesh.close_for_retry(refused, now);
  EXPECT_NE(mesh.get(now + milliseconds{100}), nullptr);
}

TEST(MeshSocket, IsWellOnceOpenThoughNothingIsSent) {
  const LogSession log(LogLevel::kError);
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  NetConfig config = loopback();
  config.key_file = scratch.path() / "mesh.key";
  MeshSocket mesh(config);
  ASSERT_EQ(mesh.get(Timestamp{}), nullptr);
  ASSERT_NE(mesh.fault(), "");
  ASSERT_TRUE(write_mesh_key(config.key_file));

  EXPECT_NE(mesh.get(Timestamp{milliseconds{100}}), nullptr);

  EXPECT_EQ(mesh.fault(), "");
}

}  // namespace
}  // namespace crepes::mesh_socket_test
