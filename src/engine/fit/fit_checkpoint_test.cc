#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/run_context.h"
#include "fit/fit.h"
#include "fit/fitter.h"
#include "fit/small_fits_for_test.h"
#include "formats/cloud_io.h"
#include "formats/random_cloud_for_test.h"
#include "io/flip_bit_for_test.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_checksum.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

class InterruptedFits : public SmallFits {
 protected:
  InterruptedFits() : SmallFits(24) {}
};

TEST_F(InterruptedFits, AnInterruptionLosesNothing) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{false};
  FitControl control;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  control.observe = [&](const Fitter& fitter) { stop = fitter.step() >= 31; };
  const auto first = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(first->report.interrupted);
  EXPECT_EQ(first->report.steps, 31);
  EXPECT_TRUE(Validate(first->cloud).ok());
  EXPECT_TRUE(std::filesystem::exists(control.checkpoint));

  control.observe = nullptr;
  stop = false;
  control.resume = true;
  const auto second = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_FALSE(second->report.interrupted);
  EXPECT_EQ(second->report.resumed_at, 31);
  EXPECT_EQ(second->report.steps, 60);
  ExpectSameCloud(second->cloud, whole->cloud);
  EXPECT_FALSE(std::filesystem::exists(control.checkpoint)) << "a finished fit has no state to keep";
}

TEST_F(InterruptedFits, AnInterruptionWhileItIsMeasuredLosesNothing) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{false};
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.deliver = [&](const Fitted&) -> Status {
    stop = true;
    return {};
  };
  const RunScope run({.stop = &stop});
  const auto first = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_TRUE(first->report.interrupted);
  EXPECT_EQ(first->report.steps, 60);
  EXPECT_EQ(first->report.kept_step, 60);
  EXPECT_EQ(first->report.train.views, 0);
  ExpectSameCloud(first->cloud, whole->cloud);

  control.deliver = nullptr;
  stop = false;
  control.resume = true;
  const auto second = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_FALSE(second->report.interrupted);
  EXPECT_EQ(second->report.train.psnr, whole->report.train.psnr);
  ExpectSameCloud(second->cloud, whole->cloud);
  EXPECT_FALSE(std::filesystem::exists(control.checkpoint));
}

// What an interruption left may be replaced when the run goes on; another file of the name, or one that somebody wrote
// to, may not.
TEST_F(InterruptedFits, WhatItLeftIsKnownAgain) {
  std::atomic<bool> stop{true};
  const RunScope run({.stop = &stop});
  const auto left = folder_ / "left.ply", other = folder_ / "other.ply";
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.outputs = {left, other};
  control.deliver = [&](const Fitted& fitted) { return WriteCloud(left, fitted.cloud, {.overwrite = true}); };
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  EXPECT_EQ(FilesLeftWith(control.checkpoint), std::vector<std::string>{AbsoluteName(left)});

  std::filesystem::copy_file(left, other);  // it never wrote this one
  EXPECT_EQ(FilesLeftWith(control.checkpoint), std::vector<std::string>{AbsoluteName(left)});
  const auto aside = folder_ / "aside.ply";
  std::filesystem::copy_file(left, aside);
  std::filesystem::remove(left);
  std::filesystem::copy_file(aside, left);  // the same bytes, but somebody put them there
  EXPECT_TRUE(FilesLeftWith(control.checkpoint).empty());
  ASSERT_TRUE(NoteFilesLeft(control.checkpoint).ok());
  EXPECT_EQ(FilesLeftWith(control.checkpoint).size(), 2u);
  std::ofstream(left, std::ios::app) << "more";
  EXPECT_EQ(FilesLeftWith(control.checkpoint), std::vector<std::string>{AbsoluteName(other)});

  stop = false;
  control.resume = true;
  control.deliver = nullptr;
  EXPECT_TRUE(Fit(views_, Initial(), options_, control).ok()) << "its checksum is right, too";
}

TEST_F(InterruptedFits, CheckpointsComeInTime) {
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.checkpoint_every = 25;
  std::vector<int64_t> seen;
  control.observe = [&](const Fitter& fitter) {
    if (std::filesystem::exists(control.checkpoint)) seen.push_back(fitter.step());
  };
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.front(), 26);
}

TEST_F(InterruptedFits, ACheckpointOfAnotherFitIsRefused) {
  std::atomic<bool> stop{true};
  FitControl control;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  control.resume = true;
  options_.densification.grow_grad2d = 0.0003;
  auto fitted = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(fitted.ok());
  EXPECT_EQ(fitted.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(fitted.error().message, HasSubstr("its --grow-grad2d is 0.0002, here 0.0003"));
  options_.densification.grow_grad2d = 0.0002;
  views_.train.pop_back();
  EXPECT_THAT(Fit(views_, Initial(), options_, control).error().message, HasSubstr("its set of cameras differs"));
}

// The same numbers and names of everything are not the same fit.
TEST_F(InterruptedFits, AContinuationHasTheSameCamerasPicturesAndStart) {
  std::atomic<bool> stop{true};
  FitControl control;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  stop = false;
  control.resume = true;
  const auto refusal = [&](const TrainingViews& views, const GaussianCloud& initial) {
    const auto fitted = Fit(views, initial, options_, control);
    if (fitted.ok()) return std::string("none");
    EXPECT_EQ(fitted.error().code, ErrorCode::kBadArgument);
    return fitted.error().message;
  };
  TrainingViews moved = views_;
  moved.train[3].world_to_camera.translation[0] += 1e-9;
  EXPECT_THAT(refusal(moved, Initial()), HasSubstr("its set of cameras differs"));
  moved = views_;
  moved.scene_scale *= 1.01;  // of a camera that is held out
  EXPECT_THAT(refusal(moved, Initial()), HasSubstr("its set of cameras differs"));
  GaussianCloud initial = Initial();
  initial.means[7] += 0.01f;
  EXPECT_THAT(refusal(views_, initial), HasSubstr("its start differs"));

  // Another picture under the name of one of them, and back.
  const auto picture = views_.train[2].image, aside = folder_ / "aside.png";
  std::filesystem::rename(picture, aside);
  std::filesystem::copy_file(views_.train[5].image, picture);
  EXPECT_THAT(refusal(views_, Initial()), HasSubstr("its set of pictures differs"));
  std::filesystem::rename(aside, picture);
  EXPECT_EQ(refusal(views_, Initial()), "none");
}

// Files that grow beyond a few bytes cannot be written while it lives, as on a full disk.
class NoRoom {
 public:
  NoRoom() {
    (void)getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit none{100, before_.rlim_max};
    (void)setrlimit(RLIMIT_FSIZE, &none);
  }
  ~NoRoom() {
    (void)setrlimit(RLIMIT_FSIZE, &before_);
    (void)std::signal(SIGXFSZ, handler_);
  }
  NoRoom(const NoRoom&) = delete;
  NoRoom& operator=(const NoRoom&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(InterruptedFits, ACheckpointWithoutRoomCostsNoMoreThanItself) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  FitControl control;
  control.checkpoint = folder_ / "no such folder" / "state";
  control.checkpoint_every = 10;
  const auto without = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(without.ok()) << without.error().message;
  ExpectSameCloud(without->cloud, whole->cloud);

  // Stopped where no state can be written: the one of step 20 is still there.
  std::atomic<bool> stop{false};
  std::optional<NoRoom> full;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  control.observe = [&](const Fitter& fitter) {
    if (fitter.step() < 25) return;
    if (!full) full.emplace();
    stop = fitter.step() == 31;
  };
  const auto first = Fit(views_, Initial(), options_, control);
  full.reset();
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_TRUE(first->report.interrupted);
  EXPECT_EQ(first->report.steps, 31);
  EXPECT_EQ(first->report.kept_step, 20);
  EXPECT_TRUE(Validate(first->cloud).ok());

  // At the first step, none at all.
  stop = true;
  control.observe = nullptr;
  control.checkpoint = folder_ / "no such folder" / "state";
  EXPECT_EQ(Fit(views_, Initial(), options_, control)->report.kept_step, std::nullopt);

  control.checkpoint = folder_ / "state";
  stop = false;
  control.resume = true;
  const auto second = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->report.resumed_at, 20);
  ExpectSameCloud(second->cloud, whole->cloud);
}

TEST_F(InterruptedFits, WhatIsNotDeliveredIsKept) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.deliver = [](const Fitted&) { return Status(Error{ErrorCode::kIo, "out.ply: no room"}); };
  const auto lost = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::kIo);
  EXPECT_THAT(lost.error().message, HasSubstr("out.ply: no room; the state after step 60 is saved in "));

  GaussianCloud delivered;
  control.resume = true;
  control.deliver = [&](const Fitted& fitted) {
    delivered = fitted.cloud;
    return Status();
  };
  const auto again = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->report.resumed_at, 60);
  ExpectSameCloud(delivered, whole->cloud);
  EXPECT_EQ(again->report.train.psnr, whole->report.train.psnr);
  EXPECT_FALSE(std::filesystem::exists(control.checkpoint));
}

TEST_F(InterruptedFits, AFlippedBitIsNotGoneOnFrom) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{true};
  FitControl control;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  FlipBit(control.checkpoint, 5);

  stop = false;
  control.resume = true;
  const auto refused = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kBadFile);
  EXPECT_THAT(refused.error().message, HasSubstr("state: is damaged"));
  EXPECT_TRUE(std::filesystem::exists(control.checkpoint));
  control.anew_if_unfit = true;
  const auto anew = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_EQ(anew->report.resumed_at, 0);
  ExpectSameCloud(anew->cloud, whole->cloud);
}

// Whoever takes a checkpoint for his own does not lose it to a picture that cannot be read for once.
TEST_F(InterruptedFits, APictureAtFaultCostsNoCheckpoint) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{false};
  FitControl control;
  control.checkpoint = folder_ / "state";
  const RunScope run({.stop = &stop});
  control.observe = [&](const Fitter& fitter) { stop = fitter.step() == 31; };
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  stop = false;
  control.observe = nullptr;
  control.resume = true;
  control.anew_if_unfit = true;
  const auto picture = views_.train[2].image, aside = folder_ / "aside.png";
  std::filesystem::copy_file(picture, aside);
  std::filesystem::resize_file(picture, std::filesystem::file_size(picture) / 2);
  const auto failed = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(failed.ok());
  EXPECT_THAT(failed.error().message, HasSubstr(picture.filename().string()));
  std::filesystem::rename(aside, picture);
  const auto rest = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(rest.ok()) << rest.error().message;
  EXPECT_EQ(rest->report.resumed_at, 31);
  ExpectSameCloud(rest->cloud, whole->cloud);
}

TEST_F(InterruptedFits, AnErrorOnTheWayKeepsTheStepsBefore) {
  FitControl control;
  control.checkpoint = folder_ / "state";
  // It has been seen to be there, and is gone when its turn comes.
  control.observe = [&](const Fitter&) {
    for (const Camera& camera : views_.train) std::filesystem::remove(camera.image);
  };
  const auto failed = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(failed.error().message, HasSubstr("is saved in"));
  EXPECT_TRUE(IsFitCheckpoint(control.checkpoint));
}

TEST_F(InterruptedFits, ACheckpointOfAVersionWithFewerSettingsIsABadFile) {
  const auto path = folder_ / "state";
  FitState state = Fitter::Fresh(Initial());
  ASSERT_TRUE(WriteFitCheckpoint(path, state, R"({"steps":7})").ok());
  const auto read = ReadFitCheckpoint(path, R"({"steps":7,"temperature":1})");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kBadFile);  // which builders take as a reason to begin anew
  EXPECT_THAT(read.error().message, HasSubstr("another version, without temperature"));
}

TEST_F(InterruptedFits, DamagedCheckpointsAreRefused) {
  const auto path = folder_ / "state";
  FitState state = Fitter::Fresh(Initial());
  ASSERT_TRUE(WriteFitCheckpoint(path, state, "{}").ok());
  ASSERT_TRUE(ReadFitCheckpoint(path, "{}").ok());
  const auto rewrite = [&](const std::string& without, const std::string& step) {
    const TensorFile file = TensorFile::Open(path).value();
    std::vector<TensorEntry> entries;
    for (const TensorEntry& entry : file.tensors()) {
      if (entry.name != without) entries.push_back(entry);
    }
    auto metadata = file.metadata();
    metadata["step"] = step;
    metadata = WithChecksum(metadata, entries).value();
    EXPECT_TRUE(WriteSafetensors(folder_ / "damaged", entries, metadata, {.overwrite = true}).ok());
    return ReadFitCheckpoint(folder_ / "damaged", "{}");
  };
  EXPECT_THAT(rewrite("adam.sh.second", "0").error().message, HasSubstr("adam.sh.second"));
  EXPECT_THAT(rewrite("cloud.sh", "0").error().message, HasSubstr("cloud.sh"));
  EXPECT_THAT(rewrite("", "-1").error().message, HasSubstr("number of steps"));
  EXPECT_THAT(rewrite("", "x").error().message, HasSubstr("number of steps"));
  EXPECT_TRUE(rewrite("", "7").ok());
  EXPECT_EQ(rewrite("", "7")->optimizer.steps(), 7);
  ASSERT_TRUE(WriteSafetensors(path, {}, {{"format", "anchorsplat fit 1"}}, {.overwrite = true}).ok());
  EXPECT_THAT(ReadFitCheckpoint(path, "{}").error().message, HasSubstr("of an earlier version"));
  EXPECT_TRUE(IsFitCheckpoint(path)) << "so that -w can replace it";
  ASSERT_TRUE(WriteSafetensors(path, {}, {}, {.overwrite = true}).ok());
  EXPECT_THAT(ReadFitCheckpoint(path, "{}").error().message, HasSubstr("not a checkpoint of a fit"));
}

}  // namespace
}  // namespace anchorsplat
