#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/means_from_world.h"
#include "formats/wrapped_splat.h"
#include "io/input_record.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

std::optional<int> DegreeOf(int64_t rest_coefficients) {
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    if (rest_coefficients == ShCoefficients(degree) - 1) return degree;
  }
  return std::nullopt;
}

// A trainer's names for the tensors of Gaussians, and differences in shape.
struct Names {
  const char* prefix;
  const char *means, *scales, *quats, *opacities;
  const char* constant;  // constant SH coefficient
  const char* rest;
  bool flat_opacities;      // [N], not [N,1]
  bool flat_constant;       // [N,3], not [N,1,3]
  bool degree_0_is_logits;  // at degree 0 the constant is the colour's logit
  bool by_place;            // names are tuple indices, so shapes are checked too
};
constexpr Names kNames[] = {
    {"splats.", "means", "scales", "quats", "opacities", "sh0", "shN", true, false, false, false},
    {"pipeline._model.gauss_params.", "means", "scales", "quats", "opacities", "features_dc", "features_rest", false,
     true, true, false},
    {"pipeline._model.", "means", "scales", "quats", "opacities", "features_dc", "features_rest", false, true, true,
     false},  // nerfstudio before 1.0
    // INRIA's torch.save((gaussians.capture(), iteration)): tuple indices, with or without the iteration.
    {"0.", "1", "4", "5", "6", "2", "3", false, false, false, true},
    {"", "1", "4", "5", "6", "2", "3", false, false, false, true},
};

// Null: none of them.
const Names* NamesIn(const TensorFile& file) {
  for (const Names& names : kNames) {
    const auto find = [&](const char* tensor) { return file.Find(Cat(names.prefix, tensor)); };
    const TensorEntry *const means = find(names.means), *const rest = find(names.rest);
    const TensorEntry* const quats = find(names.quats);
    if (!names.by_place && means != nullptr && (rest != nullptr || names.flat_opacities)) return &names;
    const auto has = [](const TensorEntry* entry, size_t rank, int64_t last) {
      return entry != nullptr && entry->shape.size() == rank && entry->shape.back() == last;
    };
    if (names.by_place && has(means, 2, 3) && has(rest, 3, 3) && has(quats, 2, 4)) return &names;
  }
  return nullptr;
}

void Copy(const Float32Values& from, Buffer<float>& to) {
  std::copy(from.values().begin(), from.values().end(), to.begin());
}

// World coordinates [N,3] of a double-precision tensor, for which floats may be too coarse.
Result<Buffer<double>> CopyWorld(const TensorFile& file, const TensorEntry& means) {
  const Result<Buffer<std::byte>> bytes = CopyContiguous(means);
  if (!bytes.ok()) return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", bytes.error().message)};
  Buffer<double> world(bytes->size() / sizeof(double));
  std::memcpy(world.data(), bytes->data(), bytes->size());
  return world;
}

}  // namespace

bool IsTorchCheckpoint(std::string_view head) {
  if (head.starts_with("PK\x03\x04")) return head.find("/data.pkl") != head.npos;
  return head.starts_with("\x80\x02\x8a\x0a\x6c\xfc\x9c\x46");  // protocol 2, then the magic number
}

bool HoldsGaussians(const TensorFile& file) { return NamesIn(file) != nullptr; }

namespace {

struct Part {
  GaussianCloud cloud;
  std::optional<int64_t> step;  // training step, if stated
};

// Gaussians of one file.
Result<Part> ReadPart(const InputFile& input, const ReadLimits& limits) {
  const auto bad = [&](const std::string& what) { return Error{ErrorCode::kBadFile, Cat(input.name(), ": ", what)}; };
  Buffer<std::byte> bytes(static_cast<size_t>(input.size()));
  ANCHORSPLAT_RETURN_IF_ERROR(input.ReadAt(0, bytes.data(), bytes.size()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::FromBytes(std::move(bytes), input.name()));

  const Names* const names = NamesIn(file);
  if (names == nullptr) {
    return bad(
        "is a PyTorch checkpoint, but not of gsplat (no tensor \"means\" in \"splats\"), nerfstudio's splatfacto or "
        "INRIA's trainer");
  }
  const auto called = [&](const char* name) { return Cat(names->prefix, name); };
  const TensorEntry* const means = file.Find(called(names->means));
  const int64_t n = means->shape.empty() ? 0 : means->shape[0];
  if (n == 0) return bad("holds no Gaussians");
  if (n > limits.max_gaussians) {
    return bad(
        Cat("holds ", WithThousands(n), " Gaussians, more than the limit of ", WithThousands(limits.max_gaussians)));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* rest, file.Require(called(names->rest)));
  const std::optional<int> degree = rest->shape.size() == 3 ? DegreeOf(rest->shape[1]) : std::nullopt;
  if (!degree) {
    return bad(Cat("tensor \"", called(names->rest), "\" has shape ", rest->ShapeText(),
                   ", expected [N, 0, 3], [N, 3, 3], [N, 8, 3] or [N, 15, 3] (SH degree 0 to 3)"));
  }

  // Check all shapes before allocating: N is trusted only if six tensors have it.
  using Shape = std::vector<int64_t>;
  const int64_t rest_coefficients = ShCoefficients(*degree) - 1;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* const world, file.Require(called(names->means), Shape{n, 3}));
  // 2DGS has two scales: surfels, whose third axis is the normal.
  const TensorEntry* const scale_entry = file.Find(called(names->scales));
  const bool surfels = scale_entry != nullptr && scale_entry->shape == Shape{n, 2};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values scales,
                               file.ReadFloat32(called(names->scales), Shape{n, surfels ? 2 : 3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values quats, file.ReadFloat32(called(names->quats), Shape{n, 4}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Float32Values opacities,
      file.ReadFloat32(called(names->opacities), names->flat_opacities ? Shape{n} : Shape{n, 1}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Float32Values sh0,
      file.ReadFloat32(called(names->constant), names->flat_constant ? Shape{n, 3} : Shape{n, 1, 3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values sh_n,
                               file.ReadFloat32(called(names->rest), Shape{n, rest_coefficients, 3}));

  Part part;
  GaussianCloud& cloud = part.cloud;
  cloud.Resize(n, *degree);
  if (surfels) {
    for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
      std::copy_n(scales.values().data() + 2 * i, 2, cloud.log_scales.data() + 3 * i);
      cloud.log_scales[3 * i + 2] = -std::numeric_limits<float>::infinity();
    }
  } else {
    Copy(scales, cloud.log_scales);
  }
  Copy(quats, cloud.quats);
  Copy(opacities, cloud.opacity_logits);
  const int64_t rest_stride = 3 * rest_coefficients;
  ParallelFor(0, n, 8192, [&](int64_t begin, int64_t end) {
    const float* constant = sh0.values().data() + 3 * begin;
    const float* higher = sh_n.values().data() + rest_stride * begin;
    float* out = cloud.sh.data() + cloud.sh_stride() * begin;
    for (int64_t i = begin; i < end; ++i) {
      out = std::copy_n(constant, 3, out);
      out = std::copy_n(higher, rest_stride, out);
      constant += 3;
      higher += rest_stride;
    }
  });
  if (*degree == 0 && names->degree_0_is_logits) {
    for (float& value : cloud.sh) value = DcFromColor(Sigmoid(value));
  }
  if (world->type == TensorType::kFloat64) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<double> centres, CopyWorld(file, *world));
    MeansFromWorld(file.name(), centres, cloud);
    cloud.double_means = !IsZero(cloud.origin);
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values centres, file.ReadFloat32(called(names->means), Shape{n, 3}));
    Copy(centres, cloud.means);
  }
  if (const auto step = file.scalars().find("step"); step != file.scalars().end()) {
    if (const auto* const number = std::get_if<int64_t>(&step->second)) part.step = *number;
  }
  return part;
}

// File name of a distributed part: "ckpt_29999_rank" and ".pt" around the rank.
struct RankName {
  std::string before, after;
  int rank = 0;
};

std::optional<RankName> RankOf(const std::string& name) {
  constexpr std::string_view kRank = "_rank";
  const size_t at = name.rfind(kRank);
  if (at == name.npos) return std::nullopt;
  const char* const begin = name.data() + at + kRank.size();
  RankName found{name.substr(0, at + kRank.size()), {}, 0};
  const auto [end, failed] = std::from_chars(begin, name.data() + name.size(), found.rank);
  if (failed != std::errc() || found.rank < 0 || *end != '.') return std::nullopt;
  found.after = end;
  return found;
}

// Ranks of this file and its siblings; only its own if the name has no rank.
std::set<int> RanksBeside(const InputFile& input, const RankName& own) {
  std::set<int> ranks = {own.rank};
  std::error_code failed;
  const std::filesystem::path parent = input.path().parent_path();
  std::filesystem::directory_iterator entry(parent.empty() ? "." : parent, failed), end;
  for (; !failed && entry != end; entry.increment(failed)) {
    const std::optional<RankName> other = RankOf(entry->path().filename().string());
    if (other && other->before == own.before && other->after == own.after) ranks.insert(other->rank);
  }
  return ranks;
}

constexpr const char* kAlone = "; to read it alone, rename it without \"_rank\"";

std::string NameOf(const RankName& own, int rank) { return Cat(own.before, rank, own.after); }

}  // namespace

Result<GaussianCloud> ReadGsplatCheckpoint(const InputFile& input, const ReadLimits& limits) {
  const std::optional<RankName> own = input.has_folder() ? RankOf(input.path().filename().string()) : std::nullopt;
  const std::set<int> ranks = own ? RanksBeside(input, *own) : std::set<int>{0};
  if (!own || ranks == std::set<int>{0}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Part whole, ReadPart(input, limits));
    return std::move(whole.cloud);
  }
  int expected = 0;
  for (const int rank : ranks) {
    if (rank == expected++) continue;
    return Error{ErrorCode::kBadFile, Cat(input.name(), ": is one part of a splat, but ", NameOf(*own, expected - 1),
                                          " is missing beside it", kAlone)};
  }
  GaussianCloud cloud;
  std::optional<int64_t> step;
  for (const int rank : ranks) {
    ReadLimits left = limits;
    left.max_gaussians -= cloud.size();
    const auto read = [&]() -> Result<Part> {
      if (rank == own->rank) return ReadPart(input, left);
      ANCHORSPLAT_ASSIGN_OR_RETURN(InputFile file, input.OpenBeside(NameOf(*own, rank)));
      ANCHORSPLAT_ASSIGN_OR_RETURN(const UnwrappedSplat part, Unwrap(std::move(file)));
      return ReadPart(part.file, left);
    };
    ANCHORSPLAT_ASSIGN_OR_RETURN(Part part, read());
    const auto differ = [&](const char* what, int64_t first, int64_t other) {
      return Error{ErrorCode::kBadFile,
                   Cat(input.name(), ": the parts of this splat do not match: ", NameOf(*own, 0), " has ", what, " ",
                       first, " and ", NameOf(*own, rank), " has ", other, kAlone)};
    };
    if (rank == 0) {
      cloud = std::move(part.cloud);
      step = part.step;
      continue;
    }
    if (step && part.step && *step != *part.step) return differ("step", *step, *part.step);
    if (part.cloud.sh_degree != cloud.sh_degree) return differ("SH degree", cloud.sh_degree, part.cloud.sh_degree);
    ANCHORSPLAT_RETURN_IF_ERROR(Append(cloud, part.cloud));
    cloud.double_means |= part.cloud.double_means;
  }
  LogInfo(Cat(input.name(), ": reading all ", ranks.size(), " parts of this splat (", NameOf(*own, 0), " to ",
              NameOf(*own, expected - 1), ")", kAlone));
  return cloud;
}

uint64_t GsplatCheckpointSize(const InputFile& input) {
  uint64_t sum = input.size();
  const std::optional<RankName> own = input.has_folder() ? RankOf(input.path().filename().string()) : std::nullopt;
  for (const int rank : own ? RanksBeside(input, *own) : std::set<int>()) {
    if (rank == own->rank) continue;
    const std::filesystem::path other = input.path().parent_path() / NameOf(*own, rank);
    std::error_code failed;
    const uint64_t size = std::filesystem::file_size(other, failed);
    if (failed) continue;
    RecordInput(other);
    sum += size;
  }
  return sum;
}

}  // namespace anchorsplat
