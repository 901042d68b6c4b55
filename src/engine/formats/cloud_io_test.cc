#include "formats/cloud_io.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

#include "core/source_dir_for_test.h"
#include "core/splat_comments.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/registry.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

std::string ReadError(const fs::path& path) {
  const auto cloud = ReadCloud(path);
  return cloud.ok() ? "accepted" : cloud.error().message;
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(CloudIo, PlyRoundTripOfEveryDegree) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    for (const int64_t n : {1, 2, 1000, 20'000}) {
      GaussianCloud cloud = RandomCloud(n, degree, static_cast<uint64_t>(n));
      cloud.comments = {"made by a test", "second: ä"};
      if (degree > 0) cloud.render_mode = kRenderModes[static_cast<size_t>(degree - 1)];
      const fs::path path = folder / "a.ply";
      const Status written = WriteCloud(path, cloud, {.overwrite = true});
      ASSERT_TRUE(written.ok()) << written.error().message;
      EXPECT_EQ(fs::file_size(path), PredictedPlySize(n, degree, cloud.render_mode, cloud.comments));
      const auto read = ReadCloud(path);
      ASSERT_TRUE(read.ok()) << read.error().message;
      ExpectSameCloud(*read, cloud);
    }
  }
}

TEST(CloudIo, SpecialValuesKeepTheirBits) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(5, 3, 1);
  uint32_t signalling = 0x7f800123u;  // a NaN that arithmetic would change
  std::memcpy(&cloud.means[4], &signalling, 4);
  cloud.quats[1] = -std::nanf("12");
  cloud.log_scales[2] = -std::numeric_limits<float>::infinity();
  cloud.sh[7] = -0.0f;
  cloud.opacity_logits[3] = std::numeric_limits<float>::denorm_min();
  ASSERT_TRUE(WriteCloud(folder / "a.ply", cloud).ok());
  const auto read = ReadCloud(folder / "a.ply");
  ASSERT_TRUE(read.ok());
  ExpectSameCloud(*read, cloud);
}

// The order that the INRIA code writes and that some readers take for granted.
TEST(CloudIo, PlyHeaderIsTheOneOfInria) {
  const TestFolder folder;
  ASSERT_TRUE(WriteCloud(folder / "a.ply", RandomCloud(3, 1, 1)).ok());
  std::string expected = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n";
  for (const char* name :
       {"x",        "y",        "z",        "nx",       "ny",       "nz",       "f_dc_0",   "f_dc_1",   "f_dc_2",
        "f_rest_0", "f_rest_1", "f_rest_2", "f_rest_3", "f_rest_4", "f_rest_5", "f_rest_6", "f_rest_7", "f_rest_8",
        "opacity",  "scale_0",  "scale_1",  "scale_2",  "rot_0",    "rot_1",    "rot_2",    "rot_3"}) {
    expected += std::string("property float ") + name + "\n";
  }
  expected += "end_header\n";
  std::ifstream in(folder / "a.ply", std::ios::binary);
  std::string found(expected.size(), '\0');
  in.read(found.data(), static_cast<std::streamsize>(found.size()));
  EXPECT_EQ(found, expected);
}

TEST(CloudIo, CommentsCannotBecomeHeaderLines) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(2, 0, 1);
  cloud.comments = {"innocent\nelement vertex 9\r\nend_header"};
  ASSERT_TRUE(WriteCloud(folder / "a.ply", cloud).ok());
  const auto read = ReadCloud(folder / "a.ply");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->comments, (std::vector<std::string>{"innocent element vertex 9  end_header"}));
  cloud.comments = {std::string(2 << 20, 'x')};
  const Status status = WriteCloud(folder / "b.ply", cloud);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
}

TEST(CloudIo, RefusesToOverwriteUnlessTold) {
  const TestFolder folder;
  const GaussianCloud one = RandomCloud(2, 0, 1), two = RandomCloud(3, 0, 2);
  ASSERT_TRUE(WriteCloud(folder / "a.ply", one).ok());
  const Status refused = WriteCloud(folder / "a.ply", two);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kExists);
  EXPECT_EQ(ReadCloud(folder / "a.ply")->size(), 2);
  ASSERT_TRUE(WriteCloud(folder / "a.ply", two, {.overwrite = true}).ok());
  EXPECT_EQ(ReadCloud(folder / "a.ply")->size(), 3);
}

TEST(CloudIo, RefusesWhatItCannotWrite) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(2, 0, 1);
  EXPECT_CONTAINS(WriteCloud(folder / "a.obj", cloud).error().message, "no splat extension; supported: ");
  EXPECT_CONTAINS(WriteCloud(folder / "a.ksplat", cloud).error().message, "which cannot be written");
  EXPECT_CONTAINS(WriteCloud(folder / "a.ply", GaussianCloud{}).error().message, "no Gaussians to write");
  cloud.quats.pop_back();
  EXPECT_CONTAINS(WriteCloud(folder / "a.ply", cloud).error().message, "quats has 7 values");
  EXPECT_EQ(folder.Entries(), 0);
}

// Killed somewhere in the middle of writing: there is no file under the final name, whole or half.
TEST(CloudIo, AKilledRunLeavesNoHalfFile) {
  const TestFolder folder;
  const fs::path path = folder / "a.ply";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // Another process of ours cannot know when the middle is; a limit on the file's size can.
    rlimit limit{100'000, 100'000};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(1);
    std::signal(SIGXFSZ, [](int) { ::kill(::getpid(), SIGKILL); });
    GaussianCloud cloud = RandomCloud(2000, 3, 1);
    (void)WriteCloud(path, cloud);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  EXPECT_FALSE(fs::exists(path));
  EXPECT_LE(folder.Entries(), 1);  // the hidden part, where the system has no files without names
}

TEST(CloudIo, NamesWhatIsNotAReadableFile) {
  const TestFolder folder;
  const auto missing = ReadCloud(folder / "none.ply");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  const auto directory = ReadCloud(folder.path());
  ASSERT_FALSE(directory.ok());
  EXPECT_EQ(directory.error().code, ErrorCode::kBadFile);
  EXPECT_CONTAINS(directory.error().message, "is a folder without a meta.json");
  EXPECT_CONTAINS(ReadError("/dev/zero"), "is a device");
}

TEST(CloudIo, ReadsFromAPipe) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(20'000, 1, 3);
  ASSERT_TRUE(WriteCloud(folder / "a.ply", cloud).ok());
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] {
    std::ifstream in(folder / "a.ply", std::ios::binary);
    std::ofstream(pipe, std::ios::binary) << in.rdbuf();
  });
  const auto read = ReadCloud(pipe);
  writer.join();
  ASSERT_TRUE(read.ok()) << read.error().message;
  ExpectSameCloud(*read, cloud);
}

TEST(CloudIo, AFileCutWhileItIsReadIsAnError) {
  const TestFolder folder;
  ASSERT_TRUE(WriteCloud(folder / "a.ply", RandomCloud(1000, 3, 1)).ok());
  const auto file = InputFile::Open(folder / "a.ply");
  ASSERT_TRUE(file.ok());
  fs::resize_file(folder / "a.ply", 100'000);
  const auto read = Formats()[1].read(*file, {});
  ASSERT_FALSE(read.ok());
  EXPECT_CONTAINS(read.error().message, "byte 100,000: the file ends before its data does");
}

TEST(Registry, ContentGoesBeforeExtension) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(2, 0, 1);
  ASSERT_TRUE(WriteCloud(folder / "a.ply", cloud).ok());
  fs::copy_file(folder / "a.ply", folder / "misnamed.spz");
  EXPECT_EQ(ReadError(folder / "misnamed.spz"), "accepted");
  ASSERT_TRUE(WriteWholeFile(folder / "b.ply", "something else", false).ok());
  EXPECT_CONTAINS(ReadError(folder / "b.ply"), "is not a PLY file");
  ASSERT_TRUE(WriteWholeFile(folder / "b.txt", "something else", false).ok());
  EXPECT_CONTAINS(ReadError(folder / "b.txt"), "is not in a known splat format");
  ASSERT_TRUE(WriteWholeFile(folder / "empty.ply", "", false).ok());
  EXPECT_CONTAINS(ReadError(folder / "empty.ply"), "is empty");
}

// What people try all the same.
TEST(CloudIo, SaysWhatSomethingElseIs) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(10, 0, 1);
  ASSERT_TRUE(WriteCloud(folder / "a.npz", cloud).ok());
  fs::copy_file(folder / "a.npz", folder / "scan.bin");
  for (const char* name : {"a.npz", "scan.bin"}) {
    EXPECT_CONTAINS(ReadError(folder / name), "is an NPZ file, which can be written but not read");
    EXPECT_CONTAINS(ReadError(folder / name), "pass the splat it was made from, as compressed PLY");
  }
  ASSERT_TRUE(WriteCloud(folder / "a.csv", cloud).ok());
  EXPECT_CONTAINS(ReadError(folder / "a.csv"), "is a CSV file");
  const auto other = [&](const char* bytes) {
    EXPECT_TRUE(WriteWholeFile(folder / "other", bytes, true).ok());
    return ReadError(folder / "other");
  };
  EXPECT_CONTAINS(other("\x89PNG\r\n\x1a\n"), "is a PNG picture, not a splat");
  EXPECT_CONTAINS(other("<!DOCTYPE html>"), "is a web page, not a splat");
  EXPECT_CONTAINS(other("x"), "byte 0: is not in a known splat format: found \"x\"");
  EXPECT_CONTAINS(other("\x01\x02\x03\x80"), "are recognised by name only");
  EXPECT_CONTAINS(other("{\"camera_angle_x\": 0.7, \"frames\": []}"),
                  "looks like a camera file, not a splat; pass cameras with");
  ASSERT_TRUE(WriteWholeFile(folder / "images.bin", std::string_view("\0\1", 2), true).ok());
  EXPECT_CONTAINS(ReadError(folder / "images.bin"), "looks like part of a COLMAP model");
  fs::create_directories(folder / "scan/sparse");
  EXPECT_CONTAINS(ReadError(folder / "scan"), "looks like a project with cameras, not a splat; pass");
}

TEST(Registry, RowsAreConsistent) {
  for (const SplatFormat& format : Formats()) {
    EXPECT_FALSE(format.name.empty());
    ASSERT_FALSE(format.extensions.empty());
    for (const std::string_view extension : format.extensions) {
      EXPECT_EQ(FormatOfExtension((extension.starts_with('.') ? "A File" : "a/") + std::string(extension)), &format);
    }
  }
  EXPECT_EQ(FormatOfExtension("A.COMPRESSED.PLY")->name, "compressed PLY");
  EXPECT_EQ(FormatOfExtension("compressed.ply")->name, "PLY");
  EXPECT_EQ(FormatOfExtension("plain"), nullptr);
  EXPECT_EQ(FormatOfExtension("not-meta.json"), nullptr);
  EXPECT_EQ(FormatOfName("lod-meta.json")->name, "streamed SOG");
  EXPECT_EQ(FormatOfName("sog")->name, "SOG");
  EXPECT_EQ(FormatOfName("json"), nullptr);
  EXPECT_EQ(FormatOfFile("ply\nformat binary_little_endian 1.0\nelement chunk 3\n", "a.ply")->name, "compressed PLY");
  EXPECT_EQ(FormatOfFile("NGSP", "a.ply")->name, "SPZ");
}

TEST(CloudIo, ReadsThePublishedExample) {
  const auto cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->size(), 20'000);
  EXPECT_EQ(cloud->sh_degree, 3);
  // Each says where up is; the tankard lies in its photographs.
  EXPECT_EQ(UpOf(cloud->comments), (std::array<double, 3>{0, 1, 0}));
  const auto tankard = ReadCloud(SourceDirForTest() / "examples/tankard/input.ply");
  ASSERT_TRUE(tankard.ok()) << tankard.error().message;
  ASSERT_TRUE(UpOf(tankard->comments).has_value());
  EXPECT_LT((*UpOf(tankard->comments))[0], -0.98);
}

}  // namespace
}  // namespace anchorsplat
