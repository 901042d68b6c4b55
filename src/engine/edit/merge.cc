#include "edit/merge.h"

#include <algorithm>

#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

bool SaysUp(const std::string& comment) { return UpOf({comment}).has_value(); }
bool SaysBackground(const std::string& comment) { return BackgroundOf({comment}).has_value(); }

bool Has(const std::vector<std::string>& comments, const std::string& comment) {
  return std::ranges::find(comments, comment) != comments.end();
}

// Turns "enhanced by anchorsplat: model, 4 times closer" into the mark of a partly enhanced splat.
std::string OfAPart(const std::string& mark) {
  for (const std::string_view whole : {kEnhancedMark, kPixelAreaMark}) {
    if (!mark.starts_with(whole)) continue;
    const bool enhanced = whole == kEnhancedMark;
    return Cat(kPartEnhancedMark, enhanced ? "" : whole, mark.substr(whole.size()));
  }
  return mark;
}

}  // namespace

std::vector<std::string> MergedComments(std::span<const EditedSplat> splats) {
  std::vector<std::string> merged;
  for (const EditedSplat& splat : splats) {
    for (const std::string& comment : splat.comments) {
      const bool everywhere =
          std::ranges::all_of(splats, [&](const EditedSplat& other) { return Has(other.comments, comment); });
      const std::string said = IsMark(comment) && !everywhere ? OfAPart(comment) : comment;
      if (Has(merged, said)) continue;
      if (SaysBackground(comment) && !everywhere) {
        LogWarning(Cat(splat.name, ": merged with splats that have another or no training background; \"",
                       Printable(comment), "\" is dropped"));
        continue;
      }
      if (SaysUp(comment) && std::ranges::any_of(merged, SaysUp)) {
        LogWarning(Cat(splat.name, ": has another up direction than the splats before it, which is used; \"",
                       Printable(comment), "\" is dropped"));
        continue;
      }
      merged.push_back(said);
    }
  }
  return merged;
}

std::optional<RenderMode> MergedMode(std::span<const std::optional<RenderMode>> modes) {
  const auto mode_of = [](const std::optional<RenderMode>& mode) { return mode.value_or(RenderMode::kClassic); };
  if (std::ranges::all_of(modes, [&](const auto& mode) { return mode_of(mode) == mode_of(modes[0]); })) {
    for (const auto& mode : modes) {
      if (mode) return mode;
    }
    return std::nullopt;
  }
  LogWarning(
      "the splats have different render modes (classic, antialiased, mip), so the result has none and parts of it "
      "will look wrong. Set one with --mode");
  return std::nullopt;
}

ExtraProperties MergedProperties(std::span<const ExtraProperties* const> extras) {
  ExtraProperties merged;
  const auto is_in = [](const ExtraProperties& all, const ExtraProperties::Property& property) {
    return std::ranges::any_of(all.properties, [&](const ExtraProperties::Property& other) {
      return other.name == property.name && other.type == property.type;
    });
  };
  for (const ExtraProperties* one : extras) {
    for (const ExtraProperties::Property& property : one->properties) {
      if (std::ranges::all_of(extras, [&](const ExtraProperties* other) { return is_in(*other, property); })) {
        if (one == extras[0]) merged.properties.push_back(property);
      } else if (const std::string name = Cat("\"", Printable(property.name), "\" of some");
                 !Has(merged.not_kept, name)) {
        merged.not_kept.push_back(name);
      }
    }
    for (const std::string& lost : one->not_kept) {
      if (!Has(merged.not_kept, lost)) merged.not_kept.push_back(lost);
    }
  }
  return merged;
}

void AppendExtras(const ExtraProperties& rows, int64_t first, int64_t last, int64_t gaussians, bool has_normals,
                  ExtraProperties& to) {
  if (has_normals) {
    to.normals.resize(3 * static_cast<size_t>(gaussians), 0.0f);
    if (rows.normals.empty()) {
      to.normals.insert(to.normals.end(), 3 * static_cast<size_t>(last - first), 0.0f);
    } else {
      to.normals.insert(to.normals.end(), rows.normals.begin() + 3 * first, rows.normals.begin() + 3 * last);
    }
  }
  if (to.properties.empty()) return;
  struct Piece {
    size_t offset, bytes;
  };
  std::vector<Piece> pieces;
  for (const ExtraProperties::Property& property : to.properties) {
    Piece piece{0, static_cast<size_t>(PlyTypeSize(property.type))};
    for (const ExtraProperties::Property& other : rows.properties) {
      if (other.name == property.name) break;
      piece.offset += static_cast<size_t>(PlyTypeSize(other.type));
    }
    pieces.push_back(piece);
  }
  const size_t from_row = rows.row_size(), to_row = to.row_size();
  to.rows.reserve(to.rows.size() + static_cast<size_t>(last - first) * to_row);
  for (int64_t i = first; i < last; ++i) {
    const auto row = rows.rows.begin() + static_cast<int64_t>(static_cast<size_t>(i) * from_row);
    for (const Piece& piece : pieces) {
      const auto begin = row + static_cast<int64_t>(piece.offset);
      to.rows.insert(to.rows.end(), begin, begin + static_cast<int64_t>(piece.bytes));
    }
  }
}

}  // namespace anchorsplat
