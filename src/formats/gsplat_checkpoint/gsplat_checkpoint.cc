#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

std::optional<int> DegreeOf(int64_t rest_coefficients) {
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    if (rest_coefficients == ShCoefficients(degree) - 1) return degree;
  }
  return std::nullopt;
}

// How a trainer calls the tensors of Gaussians, and where their shapes differ.
struct Names {
  const char* prefix;
  const char* constant;  // of spherical harmonics
  const char* rest;
  bool flat_opacities;      // [N], not [N,1]
  bool flat_constant;       // [N,3], not [N,1,3]
  bool degree_0_is_logits;  // without view-dependent colour the constant is the colour's logit
};
constexpr Names kNames[] = {
    {"splats.", "sh0", "shN", true, false, false},
    {"pipeline._model.gauss_params.", "features_dc", "features_rest", false, true, true},
    {"pipeline._model.", "features_dc", "features_rest", false, true, true},  // nerfstudio before 1.0
};

// Null: of none of them.
const Names* NamesIn(const TensorFile& file) {
  for (const Names& names : kNames) {
    const std::string means = std::string(names.prefix) + "means";
    if (file.Find(means) != nullptr &&
        (file.Find(std::string(names.prefix) + names.rest) != nullptr || names.flat_opacities))
      return &names;
  }
  return nullptr;
}

void Copy(const Float32Values& from, Buffer<float>& to) {
  std::copy(from.values().begin(), from.values().end(), to.begin());
}

}  // namespace

bool IsTorchCheckpoint(std::string_view head) {
  if (head.starts_with("PK\x03\x04")) return head.find("/data.pkl") != head.npos;
  return head.starts_with("\x80\x02\x8a\x0a\x6c\xfc\x9c\x46");  // protocol 2, then the magic number
}

Result<GaussianCloud> ReadGsplatCheckpoint(const InputFile& input, const ReadLimits& limits) {
  const auto bad = [&](const std::string& what) { return Error{ErrorCode::kBadFile, Cat(input.name(), ": ", what)}; };
  Buffer<std::byte> bytes(static_cast<size_t>(input.size()));
  ANCHORSPLAT_RETURN_IF_ERROR(input.ReadAt(0, bytes.data(), bytes.size()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::FromBytes(std::move(bytes), input.name()));

  const Names* const names = NamesIn(file);
  if (names == nullptr) {
    return bad(
        "is a PyTorch checkpoint, but neither one of gsplat with Gaussians (no tensor \"means\" in \"splats\") nor one "
        "of "
        "nerfstudio's splatfacto");
  }
  const auto called = [&](const char* name) { return Cat(names->prefix, name); };
  const TensorEntry* const means = file.Find(called("means"));
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

  // All shapes are checked before the cloud is allocated: N is only believed when six tensors really have it.
  using Shape = std::vector<int64_t>;
  const int64_t rest_coefficients = ShCoefficients(*degree) - 1;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values centres, file.ReadFloat32(called("means"), Shape{n, 3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values scales, file.ReadFloat32(called("scales"), Shape{n, 3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values quats, file.ReadFloat32(called("quats"), Shape{n, 4}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values opacities,
                               file.ReadFloat32(called("opacities"), names->flat_opacities ? Shape{n} : Shape{n, 1}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Float32Values sh0,
      file.ReadFloat32(called(names->constant), names->flat_constant ? Shape{n, 3} : Shape{n, 1, 3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values sh_n,
                               file.ReadFloat32(called(names->rest), Shape{n, rest_coefficients, 3}));

  GaussianCloud cloud;
  cloud.Resize(n, *degree);
  Copy(centres, cloud.means);
  Copy(scales, cloud.log_scales);
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
  return cloud;
}

}  // namespace anchorsplat
