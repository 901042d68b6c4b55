#include "metrics/side_by_side.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/text.h"
#include "metrics/caption_text.h"

namespace anchorsplat {

namespace {

using Colour = std::array<float, 3>;

constexpr int kWidestPanel = 640;
constexpr int kHighestPanel = 960;
constexpr int kNarrowestColumn = 400;  // captions need room
constexpr Colour kBackground = {0.086f, 0.09f, 0.102f};
constexpr Colour kText = {0.93f, 0.93f, 0.93f};
constexpr Colour kDimText = {0.6f, 0.61f, 0.63f};
constexpr Colour kFrame = {1.0f, 0.78f, 0.16f};

// NaN is shown as 0.
float Shown(float value) { return value > 0 ? std::min(value, 1.0f) : 0.0f; }

float Sample(const Image& image, int c, int y, int x) { return Shown(image.at(image.channels >= 3 ? c : 0, y, x)); }

// Mean over the colours of |a − b|, per pixel.
std::vector<float> Differences(const Image& a, const Image& b) {
  std::vector<float> out(static_cast<size_t>(a.plane()));
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      float sum = 0;
      for (int c = 0; c < 3; ++c) sum += std::abs(Sample(a, c, y, x) - Sample(b, c, y, x));
      out[static_cast<size_t>(int64_t{y} * a.width + x)] = sum / 3;
    }
  }
  return out;
}

// Differences to the right and lower neighbours.
std::vector<float> Detail(const Image& image) {
  std::vector<float> out(static_cast<size_t>(image.plane()));
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int right = std::min(x + 1, image.width - 1), below = std::min(y + 1, image.height - 1);
      float sum = 0;
      for (int c = 0; c < 3; ++c) {
        const float here = Sample(image, c, y, x);
        sum += std::abs(Sample(image, c, y, right) - here) + std::abs(Sample(image, c, below, x) - here);
      }
      out[static_cast<size_t>(int64_t{y} * image.width + x)] = sum;
    }
  }
  return out;
}

struct PanelSize {
  int width, height;
};

// Resamples a function of (channel, y, x) on a w × h view to a panel by area averaging.
template <typename Value>
Image Resampled(int w, int h, const PanelSize& panel, Value&& value) {
  Image out(panel.width, panel.height, 3);
  const double step_x = static_cast<double>(w) / panel.width, step_y = static_cast<double>(h) / panel.height;
  for (int y = 0; y < panel.height; ++y) {
    const double top = y * step_y, bottom = std::min<double>(h, top + step_y);
    for (int x = 0; x < panel.width; ++x) {
      const double left = x * step_x, right = std::min<double>(w, left + step_x);
      std::array<double, 3> sum{};
      for (int v = static_cast<int>(top); v < bottom; ++v) {
        const double weight_y = std::min<double>(bottom, v + 1) - std::max<double>(top, v);
        for (int u = static_cast<int>(left); u < right; ++u) {
          const double weight = weight_y * (std::min<double>(right, u + 1) - std::max<double>(left, u));
          for (int c = 0; c < 3; ++c) sum[static_cast<size_t>(c)] += weight * static_cast<double>(value(c, v, u));
        }
      }
      const double area = (bottom - top) * (right - left);
      for (int c = 0; c < 3; ++c) out.at(c, y, x) = static_cast<float>(sum[static_cast<size_t>(c)] / area);
    }
  }
  return out;
}

// Black, violet, red, orange, pale yellow: increasing brightness, so that it also works in greyscale.
Colour HeatColour(float value) {
  static constexpr Colour kStops[] = {
      {0.02f, 0.02f, 0.04f}, {0.32f, 0.07f, 0.43f}, {0.73f, 0.21f, 0.33f}, {0.98f, 0.55f, 0.04f}, {0.99f, 1.0f, 0.64f}};
  const float at = Shown(value) * (std::size(kStops) - 1);
  const auto lower = std::min(static_cast<size_t>(at), std::size(kStops) - 2);
  const float t = at - static_cast<float>(lower);
  Colour out;
  for (size_t c = 0; c < 3; ++c) out[c] = kStops[lower][c] + t * (kStops[lower + 1][c] - kStops[lower][c]);
  return out;
}

void FillRectangle(Image& canvas, int x, int y, int width, int height, const Colour& colour) {
  for (int v = std::max(0, y); v < std::min(canvas.height, y + height); ++v) {
    for (int u = std::max(0, x); u < std::min(canvas.width, x + width); ++u) {
      for (int c = 0; c < 3; ++c) canvas.at(c, v, u) = colour[static_cast<size_t>(c)];
    }
  }
}

// Draws a frame of `thickness` outside the rectangle.
void DrawFrame(Image& canvas, int x, int y, const PanelSize& size, int thickness) {
  const auto [width, height] = size;
  const int outer = width + 2 * thickness;
  FillRectangle(canvas, x - thickness, y - thickness, outer, thickness, kFrame);
  FillRectangle(canvas, x - thickness, y + height, outer, thickness, kFrame);
  FillRectangle(canvas, x - thickness, y, thickness, height, kFrame);
  FillRectangle(canvas, x + width, y, thickness, height, kFrame);
}

void Paste(Image& canvas, const Image& panel, int x, int y) {
  for (int c = 0; c < 3; ++c) {
    for (int v = 0; v < panel.height; ++v) {
      const float* from = panel.channel(c) + int64_t{v} * panel.width;
      std::copy(from, from + panel.width, &canvas.at(c, y + v, x));
    }
  }
}

void DrawCaption(Image& canvas, int x, int y, int width, const std::string& text, int scale, const Colour& colour) {
  DrawText(canvas, x, y, TruncatedText(text, width, scale), scale, colour);
}

// Display size of w × h pixels: an integer factor that makes them about `wanted` wide, or reduced if they exceed a
// panel.
PanelSize FitPanel(int w, int h, int wanted) {
  if (w <= kWidestPanel && h <= kHighestPanel) {
    const int factor = std::max(1, std::min((wanted + w / 2) / w, std::min(kWidestPanel / w, kHighestPanel / h)));
    return {w * factor, h * factor};
  }
  const double factor = std::min(static_cast<double>(kWidestPanel) / w, static_cast<double>(kHighestPanel) / h);
  return {std::max(1, static_cast<int>(std::lround(w * factor))),
          std::max(1, static_cast<int>(std::lround(h * factor)))};
}

// Layout in pixels of the result.
struct Layout {
  PanelSize view;
  PanelSize enlarged;
  int column;
  ViewRegion region;
  int scale;  // font scale of captions
  int margin;
  int line;  // frame thickness
  int caption_height;
  int view_y, enlarged_y, difference_y, credit_y, height;
  std::vector<std::string> credit_lines;

  int x(size_t column_index) const { return margin + static_cast<int>(column_index) * (column + margin); }
  int centred(const PanelSize& panel) const { return (column - panel.width) / 2; }
};

Layout Arrange(std::span<const LabelledImage> images, const SideBySideOptions& options) {
  const Image& reference = *images.back().image;
  const int w = reference.width, h = reference.height;
  Layout l{};
  l.view = FitPanel(w, h, kNarrowestColumn);
  l.column = std::max(l.view.width, kNarrowestColumn);
  if (options.region) {
    l.region = *options.region;
    l.enlarged = FitPanel(l.region.width, l.region.height, l.column);
    l.column = std::max(l.column, l.enlarged.width);
  } else {
    const int zoom = std::clamp(static_cast<int>(std::lround(l.column / (w * options.crop))), 1, l.column);
    const int width = std::clamp(l.column / zoom, 1, w);
    const int height = std::clamp(width * 3 / 4, 1, h);  // wider than high: two of them and the view fit on a screen
    l.region = MostDifferentRegion(*images.front().image, reference, width, height);
    l.enlarged = {width * zoom, height * zoom};
  }
  l.scale = std::max(1, l.column / 200);
  l.margin = l.column / 24;
  l.line = std::max(2, l.column / 256);
  const bool details = std::any_of(images.begin(), images.end(), [](const auto& i) { return !i.detail.empty(); });
  l.caption_height = (kCapitalHeight + 4) * l.scale;
  l.view_y = l.margin + l.caption_height * (details ? 2 : 1) + l.margin / 4;
  l.enlarged_y = l.view_y + l.view.height + l.margin;
  const int enlarged_end = l.enlarged_y + l.enlarged.height;
  const bool maps = options.differences && images.size() > 1;
  l.difference_y = enlarged_end + l.margin + l.caption_height;
  l.credit_y = (maps ? l.difference_y + l.view.height : enlarged_end) + l.margin;
  const int width = l.x(images.size()) - 2 * l.margin;
  for (const std::string& credit : options.credits) {
    for (std::string& line : WrappedText(credit, width, l.scale)) l.credit_lines.push_back(std::move(line));
  }
  const auto lines = static_cast<int>(l.credit_lines.size());
  l.height = l.credit_y + (lines == 0 ? 0 : lines * l.caption_height + l.margin / 2);
  return l;
}

void DrawView(Image& canvas, const LabelledImage& entry, const Layout& l, int x) {
  const Image& image = *entry.image;
  DrawCaption(canvas, x, l.margin, l.column, entry.label, l.scale, kText);
  DrawCaption(canvas, x, l.margin + l.caption_height, l.column, entry.detail, l.scale, kDimText);
  const int view_x = x + l.centred(l.view);
  const auto sample = [&](int c, int v, int u) { return Sample(image, c, v, u); };
  Paste(canvas, Resampled(image.width, image.height, l.view, sample), view_x, l.view_y);
  const double ratio_x = static_cast<double>(l.view.width) / image.width;
  const double ratio_y = static_cast<double>(l.view.height) / image.height;
  const PanelSize framed = {std::max(1, static_cast<int>(std::lround(l.region.width * ratio_x))),
                            std::max(1, static_cast<int>(std::lround(l.region.height * ratio_y)))};
  DrawFrame(canvas, view_x + static_cast<int>(l.region.x * ratio_x), l.view_y + static_cast<int>(l.region.y * ratio_y),
            framed, l.line);

  const auto part = [&](int c, int v, int u) { return Sample(image, c, l.region.y + v, l.region.x + u); };
  const int enlarged_x = x + l.centred(l.enlarged);
  DrawFrame(canvas, enlarged_x, l.enlarged_y, l.enlarged, l.line);
  Paste(canvas, Resampled(l.region.width, l.region.height, l.enlarged, part), enlarged_x, l.enlarged_y);
}

void DrawDifference(Image& canvas, const LabelledImage& entry, const LabelledImage& reference, float gain,
                    const Layout& l, int x) {
  const Image& image = *entry.image;
  const std::vector<float> difference = Differences(image, *reference.image);
  const auto heat = [&](int c, int v, int u) {
    const float value = difference[static_cast<size_t>(int64_t{v} * image.width + u)];
    return HeatColour(gain * value)[static_cast<size_t>(c)];
  };
  DrawCaption(canvas, x, l.difference_y - l.caption_height, l.column,
              Cat("difference to ", reference.label, ", x ", gain), l.scale, kDimText);
  Paste(canvas, Resampled(image.width, image.height, l.view, heat), x + l.centred(l.view), l.difference_y);
}

// Colour scale, shown in place of the reference's own map.
void DrawHeatScale(Image& canvas, float gain, const Layout& l, int x) {
  DrawCaption(canvas, x, l.difference_y - l.caption_height, l.column, "scale of the differences", l.scale, kDimText);
  const int height = std::min(l.view.height, l.margin);
  for (int u = 0; u < l.column; ++u) {
    const float value = static_cast<float>(u) / static_cast<float>(std::max(1, l.column - 1));
    FillRectangle(canvas, x + u, l.difference_y, 1, height, HeatColour(value));
  }
  const std::string most = Fixed(1 / static_cast<double>(gain), 2) + "+";
  const int y = l.difference_y + height + 2 * l.scale;
  DrawText(canvas, x, y, "0", l.scale, kDimText);
  DrawText(canvas, x + l.column - TextWidth(most, l.scale), y, most, l.scale, kDimText);
}

Status CheckArguments(std::span<const LabelledImage> images, const SideBySideOptions& options) {
  const auto bad = [](std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; };
  if (images.empty()) return bad("no images to put side by side");
  for (const LabelledImage& entry : images) {
    if (entry.image == nullptr || entry.image->plane() < 1 || entry.image->channels < 1) {
      return bad(Cat("image \"", entry.label, "\" is empty"));
    }
  }
  const Image& first = *images.front().image;
  for (const LabelledImage& entry : images) {
    if (entry.image->width != first.width || entry.image->height != first.height) {
      return bad(Cat("images of ", first.width, " x ", first.height, " and ", entry.image->width, " x ",
                     entry.image->height, " cannot be shown side by side: the sizes differ"));
    }
  }
  if (!(options.crop > 0 && options.crop <= 1)) return bad(Cat("crop ", options.crop, " is not in (0, 1]"));
  if (!(options.gain > 0) || !std::isfinite(options.gain)) return bad(Cat("gain ", options.gain, " is not positive"));
  if (const auto& r = options.region) {
    if (r->x < 0 || r->y < 0 || r->width < 1 || r->height < 1 || r->width > first.width - r->x ||
        r->height > first.height - r->y) {
      return bad(Cat("region ", r->width, " x ", r->height, " at ", r->x, ", ", r->y, " is not inside the view"));
    }
  }
  return {};
}

}  // namespace

ViewRegion MostDifferentRegion(const Image& a, const Image& b, int width, int height) {
  std::vector<float> weight = Differences(a, b);
  if (std::all_of(weight.begin(), weight.end(), [](float x) { return x == 0; })) weight = Detail(b);
  // Summed-area table with a leading row and column of zeros.
  const auto stride = static_cast<size_t>(b.width) + 1;
  std::vector<double> sums(stride * (static_cast<size_t>(b.height) + 1));
  for (size_t y = 0; y < static_cast<size_t>(b.height); ++y) {
    double row = 0;
    for (size_t x = 0; x + 1 < stride; ++x) {
      row += static_cast<double>(weight[y * (stride - 1) + x]);
      sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
    }
  }
  ViewRegion best{0, 0, width, height};
  double most = -1;
  const auto w = static_cast<size_t>(width), h = static_cast<size_t>(height);
  for (int y = 0; y + height <= b.height; ++y) {
    for (int x = 0; x + width <= b.width; ++x) {
      const size_t at = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
      const double sum = sums[at + h * stride + w] - sums[at + h * stride] - sums[at + w] + sums[at];
      if (sum <= most) continue;
      most = sum;
      best.x = x;
      best.y = y;
    }
  }
  return best;
}

Result<Image> SideBySide(std::span<const LabelledImage> images, const SideBySideOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckArguments(images, options));
  const Layout l = Arrange(images, options);
  Image canvas(l.x(images.size()), l.height, 3);
  FillRectangle(canvas, 0, 0, canvas.width, canvas.height, kBackground);
  for (size_t i = 0; i < images.size(); ++i) {
    DrawView(canvas, images[i], l, l.x(i));
    if (!options.differences || images.size() < 2) continue;
    if (i + 1 < images.size()) {
      DrawDifference(canvas, images[i], images.back(), options.gain, l, l.x(i));
    } else {
      DrawHeatScale(canvas, options.gain, l, l.x(i));
    }
  }
  for (size_t i = 0; i < l.credit_lines.size(); ++i) {
    DrawText(canvas, l.margin, l.credit_y + static_cast<int>(i) * l.caption_height, l.credit_lines[i], l.scale,
             kDimText);
  }
  return canvas;
}

}  // namespace anchorsplat
