#include "cli/verb.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "cli/table.h"
#include "cli/verb_tree.h"
#include "core/text.h"
#include "io/folder_for_test.h"
#include "model/model_method.h"

namespace anchorsplat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// All verbs that have options, those below other verbs too.
std::vector<DeclaredVerb> VerbsWithOptions() {
  CLI::App app{"", "anchorsplat"};
  Program program;
  AddVerbs(app, program);
  std::vector<DeclaredVerb> out, todo = DeclaredVerbs(app);
  while (!todo.empty()) {
    const DeclaredVerb verb = todo.back();
    todo.pop_back();
    todo.insert(todo.end(), verb.verbs.begin(), verb.verbs.end());
    if (verb.verbs.empty()) out.push_back(verb);
  }
  return out;
}

std::vector<std::string> HelpLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(CommandLine, Version) {
  const ProgramRun run = ExpectDone({"--version"});
  EXPECT_EQ(run.out, Cat("anchorsplat ", ANCHORSPLAT_VERSION, "\n"));
  EXPECT_THAT(run.err, IsEmpty());
}

TEST(CommandLine, HelpListsEveryVerbAndEachHasItsOwn) {
  const std::vector<DeclaredVerb> verbs = VerbsWithOptions();
  EXPECT_GE(verbs.size(), 20u);
  const std::string help = ExpectDone({"--help"}).out;
  for (const DeclaredVerb& verb : verbs) {
    EXPECT_THAT(help, HasSubstr("\n  " + verb.words[0] + " "));
    std::vector<std::string> words = verb.words;
    words.emplace_back("--help");
    const ProgramRun run = ExpectDone(words);
    EXPECT_THAT(run.out, AllOf(HasSubstr("Example:\n  anchorsplat " + verb.name()), HasSubstr("--json")));
    EXPECT_THAT(run.err, IsEmpty());
    EXPECT_LE(HelpLines(run.out).size(), 40u) << verb.name();
    for (const std::string& line : HelpLines(run.out))
      EXPECT_LE(DisplayWidth(line), 100u) << verb.name() << ": " << line;
    words.back() = "--help-all";
    const std::string all = ExpectDone(words).out;
    for (const DeclaredOption& option : verb.options) {
      EXPECT_THAT(all, HasSubstr(option.names.empty() ? option.positional : option.names.back())) << verb.name();
    }
  }
}

TEST(CommandLine, HelpOfEnhanceIsShortAndHelpAllHasGroups) {
  const std::string brief = ExpectDone({"enhance", "--help"}).out, all = ExpectDone({"enhance", "--help-all"}).out;
  for (const char* option : {"--output", "--upscale", "--quality", "--cameras", "--images", "--region",
                             "--max-gaussians", "--device", "--help-all"}) {
    EXPECT_THAT(brief, HasSubstr(option));
  }
  EXPECT_THAT(brief, Not(HasSubstr("--shuffles")));
  EXPECT_THAT(all, AllOf(HasSubstr("\nRefinement:\n"), HasSubstr("\nNetwork:\n"), HasSubstr("\nShared flags:\n")));
  const std::string script = all.substr(all.find("\nPublished network, as its script runs it:\n"));
  for (const char* option : {"--compat", "--normalisation", "--attention-rounding", "--curve-depth", "--shuffles"}) {
    EXPECT_LT(script.find(option), script.find("\n\n", 1)) << option;
  }
}

// Methods and command line describe the same options, both ways.
TEST(CommandLine, OptionsOfMethodsAreThoseOfEnhance) {
  const std::vector<DeclaredVerb> verbs = VerbsWithOptions();
  const auto enhance = std::ranges::find_if(verbs, [](const DeclaredVerb& verb) { return verb.name() == "enhance"; });
  ASSERT_NE(enhance, verbs.end());
  std::set<std::string> declared, declared_for_methods, of_methods;
  for (const DeclaredOption& option : enhance->options) {
    for (const std::string& name : option.names) {
      declared.insert(name);
      if (option.group == "Refinement" || option.group.find("etwork") != std::string::npos) {
        declared_for_methods.insert(name);
      }
    }
  }
  for (const EnhanceMethod& method : AllMethods()) {
    for (const MethodOption& option : method.options) of_methods.insert("--" + option.name);
  }
  for (const std::string& name : of_methods) EXPECT_TRUE(declared.contains(name)) << name;
  for (const std::string& name : declared_for_methods) EXPECT_TRUE(of_methods.contains(name)) << name;
}

TEST(CommandLine, HelpAllOfTheProgramHasEveryVerb) {
  const std::string all = ExpectDone({"--help-all"}).out;
  for (const DeclaredVerb& verb : VerbsWithOptions()) EXPECT_THAT(all, HasSubstr("Usage: anchorsplat " + verb.name()));
}

TEST(CommandLine, WordsThatAreNoVerb) {
  ExpectRefused({}, ErrorCode::kBadArgument, {"'anchorsplat' needs a verb"});
  ExpectRefused(
      {"convrt", "x.ply"}, ErrorCode::kBadArgument,
      {"did you mean 'convert'?", "enhance, info, render, convert, compare, upscale, eval, view, views, fit, dataset"});
  ExpectRefused({"dataset", "chekc", "x"}, ErrorCode::kBadArgument, {"did you mean 'check'?"});
  const ProgramRun far = ExpectRefused({"xyzzyxyzzy", "--json"}, ErrorCode::kBadArgument);
  EXPECT_EQ(far.json()["error"]["code"], "bad_argument");
  EXPECT_THAT(far.err, Not(HasSubstr("did you mean")));
  EXPECT_EQ(ExpectRefused({"enhance", "--json"}, ErrorCode::kBadArgument).json()["error"]["code"], "bad_argument");
  ExpectRefused({"info", "x.ply", "--colour"}, ErrorCode::kBadArgument, {"--colour", "--help shows how"});
  ExpectRefused({"enhance", "--upscal", "4"}, ErrorCode::kBadArgument, {"did you mean '--upscale'?"});
  ExpectRefused({"enhance", "x.ply", "-o", "y.ply", "--quality", "bst"}, ErrorCode::kBadArgument,
                {"--quality: must be fast, good or best, found 'bst'; did you mean 'best'?"});
  ExpectRefused({"enhance", "x.ply", "-o", "y.ply", "--precision", "double"}, ErrorCode::kBadArgument,
                {"must be fp32 or bf16, found 'double' (--help"});
}

// Finite ones, whatever the option; whole ones have 64 bits. The message names the option and stays readable.
TEST(CommandLine, NumbersAreNumbers) {
  int options = 0;
  for (const DeclaredVerb& verb : VerbsWithOptions()) {
    for (const DeclaredOption& option : verb.options) {
      if (option.value != "FLOAT" && option.value != "INT" && option.value != "UINT") continue;
      ++options;
      const auto by_name = std::ranges::find_if(option.names, [](const auto& n) { return n.starts_with("--"); });
      const std::string name = by_name == option.names.end() ? option.positional : *by_name;  // old names stand behind
      ASSERT_TRUE(name.starts_with("--")) << verb.name() << ' ' << name;
      const std::vector<std::string> values =
          option.value == "FLOAT" ? std::vector<std::string>{"nan", "inf", "-inf", "1e39", "-nan"}
                                  : std::vector<std::string>{"99999999999999999999", "-99999999999999999999"};
      for (const std::string& value : values) {
        std::vector<std::string> words = verb.words;
        words.push_back(Cat(name, "=", value));
        const ProgramRun run = ExpectRefused(words, ErrorCode::kBadArgument, {name + ": "});
        EXPECT_LT(run.err.size(), 200u) << run.err;
      }
    }
  }
  EXPECT_GE(options, 100);
}

TEST(CommandLine, TheLargestSeed) {
  const TestFolder folder;
  const std::string scan = WriteScan(folder / "scan.ply");
  ExpectDone({"convert", scan, folder / "out.ply", "--seed", "18446744073709551615"});
  ExpectRefused({"convert", scan, folder / "no.ply", "--seed", "-1"}, ErrorCode::kBadArgument, {"--seed"});
}

TEST(CommandLine, QuietSaysNothingAndJsonNothingElse) {
  const TestFolder folder;
  const std::string scan = WriteScan(folder / "scan.ply");
  const ProgramRun quiet = ExpectDone({"convert", scan, folder / "a.ply", "-q"});
  EXPECT_THAT(quiet.out, IsEmpty());
  EXPECT_THAT(quiet.err, IsEmpty());
  EXPECT_TRUE(ExpectJson({"convert", scan, folder / "b.ply"}).is_array());
  // Warnings are said all the same.
  EXPECT_THAT(ExpectDone({"convert", scan, folder / "c.splat", "-q"}).err, HasSubstr("warning: "));
}

// For programs that start this one: nothing but lines of JSON on stderr, steps among them.
TEST(CommandLine, ProgressAsJson) {
  const TestFolder folder;
  const std::string scan = WriteScan(folder / "scan.ply");
  const auto events = [](const ProgramRun& run) {
    std::vector<nlohmann::json> lines;
    std::istringstream text(run.err);
    for (std::string line; std::getline(text, line);) {
      lines.push_back(nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false));
      EXPECT_TRUE(lines.back().is_object()) << line;
    }
    return lines;
  };
  const auto steps = events(
      ExpectDone({"render", scan, "-o", folder / "views", "--orbit", "3", "--size", "32x32", "--progress", "json"}));
  ASSERT_GE(steps.size(), 2u);
  EXPECT_EQ(steps.front(), (nlohmann::json{{"task", "render"}, {"done", 0}, {"total", 3}}));
  EXPECT_EQ(steps.back()["done"], 3);
  const auto warned = events(ExpectDone({"convert", scan, folder / "c.splat", "-q", "--progress", "json"}));
  ASSERT_FALSE(warned.empty());
  EXPECT_EQ(warned[0]["level"], "warning");
  const auto failed =
      events(ExpectRefused({"info", folder / "none\x1b.ply", "--progress", "json"}, ErrorCode::kNotFound, {"u001b"}));
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_EQ(failed[0]["level"], "error");
}

TEST(CommandLine, VerbsOfThePythonPackageSayWhereTheyAre) {
  EXPECT_THAT(ExpectDone({"--help"}).out,
              AllOf(HasSubstr("\n  serve "), HasSubstr("\n  batch "), HasSubstr("\n  manual ")));
  EXPECT_THAT(ExpectDone({"serve", "--help"}).out, HasSubstr("Usage: anchorsplat serve"));
  ExpectRefused({"serve"}, ErrorCode::kBadArgument, {"pip install '.[serve]'"});
  ExpectRefused({"serve", "--port", "1", "x"}, ErrorCode::kBadArgument, {"pip install '.[serve]'"});
  ExpectRefused({"batch", "enhance", "a.ply", "--out", "b"}, ErrorCode::kBadArgument, {"'.[batch]'"});
}

TEST(CommandLine, ErrorsAreDocumentsToo) {
  const TestFolder folder;
  const ProgramRun run = ExpectRefused({"info", folder / "none.ply", "--json"}, ErrorCode::kNotFound, {"none.ply"});
  EXPECT_EQ(run.json()["error"]["code"], "not_found");
  EXPECT_THAT(run.json()["error"]["message"].get<std::string>(), HasSubstr("none.ply"));
}

TEST(CommandLine, AnyNumberOfThreadsMakesTheSamePicture) {
  const TestFolder folder;
  const std::string scan = WriteScan(folder / "scan.ply", 2000, 1);
  for (const std::string threads : {"1", "3"}) {
    ExpectDone(
        {"render", scan, "-o", folder / (threads + ".png"), "--orbit", "1", "--size", "200x150", "--threads", threads});
  }
  EXPECT_EQ(FileBytes(folder / "1.png"), FileBytes(folder / "3.png"));
}

// A batch in which one input fails is done for the others; one in which all do has the code of the last.
TEST(CommandLine, OneBadInputDoesNotStopTheOthers) {
  const TestFolder folder;
  const std::string scan = WriteScan(folder / "scan.ply"), other = WriteScan(folder / "other.spz");
  const std::vector<std::string> words = {
      "convert", scan, folder / "none.ply", other, "--out-dir", folder / "out", "--to", ".glb", "--json"};
  const ProgramRun run = RunWords(words);
  EXPECT_EQ(run.code, kPartialExitCode);
  EXPECT_THAT(run.err, HasSubstr("1 of 3 files"));
  const nlohmann::json rows = run.json();
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0]["gaussians"]["out"], 200);
  EXPECT_EQ(rows[1]["failure"]["code"], "not_found");
  EXPECT_EQ(rows[2]["gaussians"]["out"], 200);

  WriteText(folder / "text.ply", "# Read me\n");
  WriteText(folder / "cameras.ply", "{}");
  for (const std::string verb : {"convert", "enhance"}) {
    ExpectRefused({verb, folder / "cameras.ply", folder / "text.ply", "--out-dir", folder / "none"},
                  ErrorCode::kBadFile, {"all 2 inputs failed"});
  }
}

TEST(CommandLine, ManualPageAndCompletionsKnowTheVerbs) {
  for (const auto& [kind, beginning] :
       {std::pair<std::string, std::string>{"man", ".TH"}, {"bash", ""}, {"zsh", "#compdef"}}) {
    const ProgramRun run = ExpectDone({"manual", kind});
    EXPECT_THAT(run.out, AllOf(HasSubstr(beginning), HasSubstr("enhance"), HasSubstr("prune"))) << kind;
  }
  ExpectRefused({"manual", "fish"}, ErrorCode::kBadArgument, {"fish"});
  ExpectRefused({"manual"}, ErrorCode::kBadArgument, {"kind"});
}

// What the program changes for the whole process, these tests put back.
TEST(CommandLine, ARunLeavesTheProcessAsItWas) {
  class Counting : public LogSink {
   public:
    void Message(LogLevel, const std::string&) override { ++messages; }
    void TaskBegin(const std::string&, int64_t) override {}
    void TaskProgress(int64_t, const std::string&) override {}
    void TaskEnd() override {}
    int messages = 0;
  };
  const auto sink = std::make_shared<Counting>();
  const auto before = SetLogSink(sink);
  std::streambuf* const console = std::cout.rdbuf();
  const int threads = ThreadCount();
  struct sigaction then {
  }, now{};
  sigaction(SIGXFSZ, nullptr, &then);
  ExpectRefused({"info", "/none.ply", "--threads", "1"}, ErrorCode::kNotFound);
  EXPECT_EQ(sink->messages, 0);
  LogWarning("after");
  EXPECT_EQ(sink->messages, 1);
  SetLogSink(before);
  EXPECT_EQ(std::cout.rdbuf(), console);
  EXPECT_EQ(ThreadCount(), threads);
  sigaction(SIGXFSZ, nullptr, &now);
  EXPECT_EQ(now.sa_handler, then.sa_handler);
}

}  // namespace
}  // namespace anchorsplat
