#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "core/parallel.h"
#include "tensors/tensor_file.h"
#include "train/small_training_for_test.h"
#include "train/trainer.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

int FreePort() {
  const int socket_id = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  bind(socket_id, reinterpret_cast<sockaddr*>(&address), length);
  getsockname(socket_id, reinterpret_cast<sockaddr*>(&address), &length);
  close(socket_id);
  return ntohs(address.sin_port);
}

TrainRequest Request(const fs::path& data, const fs::path& config, const fs::path& out) {
  TrainRequest request;
  request.datasets = {data};
  request.config = config;
  request.out = out;
  request.steps = 4;
  return request;
}

// What each process of the test below runs; it is told where by the environment.
TEST(DataParallelProcess, DISABLED_Trains) {
  SetThreadCount(1);
  const auto report = Train(Request(std::getenv("TEST_DATA"), std::getenv("TEST_CONFIG"), std::getenv("TEST_OUT")));
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->steps, 4);
}

pid_t Start(int rank, int port, const fs::path& data, const fs::path& config, const fs::path& out) {
  const pid_t child = fork();
  if (child != 0) return child;
  setenv("WORLD_SIZE", "2", 1);
  setenv("RANK", std::to_string(rank).c_str(), 1);
  setenv("MASTER_ADDR", "127.0.0.1", 1);
  setenv("MASTER_PORT", std::to_string(port).c_str(), 1);
  setenv("TEST_DATA", data.c_str(), 1);
  setenv("TEST_CONFIG", config.c_str(), 1);
  setenv("TEST_OUT", out.c_str(), 1);
  execl("/proc/self/exe", "train_test", "--gtest_filter=DataParallelProcess.*", "--gtest_also_run_disabled_tests",
        static_cast<char*>(nullptr));
  _exit(127);
}

TEST(DataParallel, TwoProcessesAreOneWithTheDoubledBatch) {
  SetThreadCount(1);
  const test::SmallTrainingSet set;
  const auto config = [&](const std::string& name, int scenes) {
    const fs::path path = set / name;
    std::ofstream(path) << R"(
log_every = 1
[network]
kind = "compact"
copies = 2
hidden = 16
head_hidden = 16
[optimizer]
learning_rate = 1e-3
clip = 0.05
[augmentation]
mirror = true
[data]
views_per_object = 4
scenes_per_step = )" << scenes
                        << "\n";
    return path;
  };
  const fs::path one = config("one.toml", 1), two = config("two.toml", 2);
  const int port = FreePort();
  const pid_t children[2] = {Start(0, port, set.train(), one, set / "parallel"),
                             Start(1, port, set.train(), one, set / "parallel")};
  const auto alone = Train(Request(set.train(), two, set / "alone"));
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  const auto a = TensorFile::Open(set / "alone" / "checkpoint.safetensors");
  const auto b = TensorFile::Open(set / "parallel" / "checkpoint.safetensors");
  ASSERT_TRUE(a.ok() && b.ok());
  int compared = 0;
  double moved = 0;
  for (const TensorEntry& entry : a->tensors()) {
    if (!entry.name.starts_with("weights.")) continue;
    const auto first = CopyFloat32(entry), second = CopyFloat32(*b->Find(entry.name));
    ASSERT_TRUE(first.ok() && second.ok());
    ++compared;
    for (size_t i = 0; i < first->size(); ++i) {
      EXPECT_NEAR((*first)[i], (*second)[i], 1e-5) << entry.name;
      if (entry.name == "weights.out.strength.bias") moved = std::max(moved, std::fabs(double{(*first)[i]}));
    }
  }
  EXPECT_GT(compared, 20);
  EXPECT_GT(moved, 1e-4) << "training changes weights that begin at zero";
}

TEST(DataParallel, ABrokenEnvironmentIsSaid) {
  const test::SmallTrainingSet set;
  setenv("WORLD_SIZE", "2", 1);
  setenv("RANK", "2", 1);
  const auto report = Train(Request(set.train(), set.Config("x.toml", ""), set / "x"));
  unsetenv("WORLD_SIZE");
  unsetenv("RANK");
  ASSERT_FALSE(report.ok());
  EXPECT_TRUE(report.error().message.starts_with("environment: RANK is \"2\", expected")) << report.error().message;
}

}  // namespace
}  // namespace anchorsplat
