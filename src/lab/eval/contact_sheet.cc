#include "eval/contact_sheet.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"
#include "eval/protocol.h"
#include "images/image_io.h"
#include "metrics/caption_text.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr int kTileSide = 256;  // maximum side of an excerpt, pixels
constexpr int kGap = 8;
constexpr int kTextScale = 2;
constexpr int kLine = (kCapitalHeight + 4) * kTextScale;
constexpr std::array<float, 3> kPaper = {0.11f, 0.11f, 0.12f};
constexpr std::array<float, 3> kInk = {0.95f, 0.95f, 0.95f};
constexpr std::array<float, 3> kDim = {0.65f, 0.65f, 0.68f};

void Fill(Image& canvas) {
  for (int c = 0; c < 3; ++c) {
    std::fill(canvas.channel(c), canvas.channel(c) + canvas.plane(), kPaper[static_cast<size_t>(c)]);
  }
}

// Draws every pixel as a square, to show exactly what was rendered; subsamples larger excerpts.
void Paste(Image& canvas, const Image& tile, int left, int top) {
  const int longest = std::max(tile.width, tile.height);
  const int side = longest <= kTileSide ? longest * (kTileSide / longest) : kTileSide;
  const int width = std::max(1, side * tile.width / longest), height = std::max(1, side * tile.height / longest);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        canvas.at(c, top + y, left + x) =
            tile.at(std::min(c, tile.channels - 1), y * tile.height / height, x * tile.width / width);
      }
    }
  }
}

// Truncates a text to the column's width.
std::string Fitting(const std::string& text) { return TruncatedText(text, kTileSide, kTextScale, ""); }

// Credits in lines of at most `width` pixels: each text once, with its objects' names if there are several objects.
std::vector<std::string> CreditLines(const Evaluation& evaluation, const std::vector<size_t>& rows, int width) {
  std::vector<std::pair<std::string, std::string>> credits;  // text, names
  for (const size_t row : rows) {
    for (const std::string& credit : evaluation.credits[row]) {
      const auto same = std::ranges::find(credits, credit, &std::pair<std::string, std::string>::first);
      if (same == credits.end()) {
        credits.emplace_back(credit, evaluation.objects[row]);
      } else {
        same->second += ", " + evaluation.objects[row];
      }
    }
  }
  std::vector<std::string> lines;
  for (const auto& [credit, objects] : credits) {
    const std::string text = rows.size() > 1 ? Cat(objects, ": ", credit) : credit;
    for (std::string& line : WrappedText(text, width, kTextScale)) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace

Result<Image> ContactSheet(const fs::path& out, const Evaluation& evaluation) {
  std::vector<size_t> with_results;
  for (size_t i = 0; i < evaluation.objects.size(); ++i) {
    const auto measured = [&](const MethodResult& r) { return r.object == evaluation.objects[i]; };
    if (std::any_of(evaluation.results.begin(), evaluation.results.end(), measured)) with_results.push_back(i);
  }
  if (with_results.empty()) return Image();
  const std::vector<size_t> rows = SubsampleEvenly(with_results, kMostSheetObjects);
  const int columns = static_cast<int>(evaluation.methods.size()) + 1;
  const int row_height = kTileSide + 2 * kLine + kGap;
  const int width = kGap + columns * (kTileSide + kGap);
  const std::vector<std::string> credits = CreditLines(evaluation, rows, width - 2 * kGap);
  const int64_t height = 2 * kGap + kLine + int64_t{row_height} * static_cast<int64_t>(rows.size()) +
                         int64_t{kLine} * static_cast<int64_t>(credits.size()) + (credits.empty() ? 0 : kGap);
  Image canvas(width, static_cast<int>(height), 3);
  Fill(canvas);
  const auto left = [](int column) { return kGap + column * (kTileSide + kGap); };
  for (int column = 0; column < columns; ++column) {
    const std::string heading = column + 1 == columns ? "truth" : evaluation.methods[static_cast<size_t>(column)];
    DrawText(canvas, left(column), kGap, Fitting(heading), kTextScale, kInk);
  }
  int top = 2 * kGap + kLine;
  for (const size_t row : rows) {
    const std::string& object = evaluation.objects[row];
    const fs::path folder = ObjectFolder(out, object);
    for (int column = 0; column < columns; ++column) {
      const bool truth = column + 1 == columns;
      const std::string method = truth ? "" : evaluation.methods[static_cast<size_t>(column)];
      const MethodResult* result = truth ? nullptr : evaluation.Find(object, method);
      std::string caption = truth ? "" : result == nullptr ? "failed" : Fixed(result->MeanPsnr(), 2) + " dB";
      if (truth || result != nullptr) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(
            const Image tile, ReadImage(folder / ((truth ? std::string(kTruthStem) : FileStem(method)) + ".png")));
        Paste(canvas, tile, left(column), top + kLine);
      }
      DrawText(canvas, left(column), top + kLine + kTileSide + 2 * kTextScale, caption, kTextScale, kDim);
    }
    DrawText(canvas, left(0), top, Fitting(object), kTextScale, kInk);
    top += row_height;
  }
  for (const std::string& line : credits) {
    DrawText(canvas, kGap, top, line, kTextScale, kDim);
    top += kLine;
  }
  return canvas;
}

}  // namespace anchorsplat
