#include <cstdlib>

#include "cli/run_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Where LPIPS looks for its weights, for as long as the object lives.
class LpipsFolderVariable {
 public:
  explicit LpipsFolderVariable(const std::string& folder) {
    if (const char* now = std::getenv("ANCHORSPLAT_LPIPS")) before_ = now;
    setenv("ANCHORSPLAT_LPIPS", folder.c_str(), 1);
  }
  ~LpipsFolderVariable() { before_ ? setenv("ANCHORSPLAT_LPIPS", before_->c_str(), 1) : unsetenv("ANCHORSPLAT_LPIPS"); }
  LpipsFolderVariable(const LpipsFolderVariable&) = delete;
  LpipsFolderVariable& operator=(const LpipsFolderVariable&) = delete;

 private:
  std::optional<std::string> before_;
};

// Every part has a state, and what is missing comes with a command. (What it says of an installed program is in
// behaviour/install_test.sh.)
TEST(DoctorVerb, EveryPartHasAState) {
  const TestFolder folder;
  const LpipsFolderVariable none(folder.path());
  const nlohmann::json json = ExpectJson({"doctor", "--threads", "1"});
  EXPECT_EQ(json["version"], ANCHORSPLAT_VERSION);
  EXPECT_EQ(json["threads"], 1);
  EXPECT_GT(json["memory_bytes"], 0);
  EXPECT_FALSE(json["simd"].get<std::string>().empty());
  ASSERT_EQ(json["parts"].size(), 5u);
  for (const auto& [name, part] : json["parts"].items()) {
    EXPECT_EQ(part["state"] == "ready", !part.contains("command")) << name;
  }
  EXPECT_EQ(json["parts"]["model"]["state"], "ready");
  EXPECT_EQ(json["parts"]["LPIPS weights"]["state"], "missing");
  EXPECT_EQ(json["parts"]["GPU"]["state"] == "missing", json["gpu"]["adapters"].empty());
  const ProgramRun run = ExpectDone({"doctor"});
  EXPECT_THAT(run.out, AllOf(HasSubstr("anchorsplat    "), HasSubstr("processor"), HasSubstr("SIMD"),
                             HasSubstr("built in, 4 Gaussians for each"), HasSubstr("fetch-lpips.sh")));
  EXPECT_THAT(run.err, IsEmpty());
}

// Weights that are there and cannot be read are an illness, not an absence.
TEST(DoctorVerb, DamagedWeights) {
  const TestFolder folder;
  WriteText(folder / "alex.safetensors", "nothing");
  const LpipsFolderVariable damaged(folder.path());
  const ProgramRun run = RunWords({"doctor"});
  EXPECT_EQ(run.code, kPartialExitCode);
  EXPECT_THAT(run.out, HasSubstr("broken: " + (folder / "alex.safetensors").string()));
  EXPECT_EQ(RunWords({"doctor", "--json"}).json()["parts"]["LPIPS weights"]["state"], "broken");
}

}  // namespace
}  // namespace anchorsplat
