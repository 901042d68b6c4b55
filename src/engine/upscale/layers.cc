#include "upscale/layers.h"

#include <utility>
#include <vector>

#include "core/text.h"
#include "upscale/architecture.h"
#include "upscale/convolution.h"

namespace anchorsplat {

Result<int64_t> ReadOutputs(const TensorFile& file, const std::string& name) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, file.Require(name + ".weight"));
  if (entry->shape.size() == 4 && entry->shape[0] >= 1 && entry->shape[0] <= kMostMapChannels) return entry->shape[0];
  return Error{ErrorCode::kBadFile,
               Cat(file.name(), ": tensor \"", entry->name, "\" has the shape ", entry->ShapeText(),
                   ", a convolution to 1 to ", kMostMapChannels, " channels has four dimensions")};
}

Result<Buffer<float>> ReadFinite(const TensorFile& file, const std::string& name, const std::vector<int64_t>& shape) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, file.Require(name, shape));
  auto values = CopyFloat32(*entry);
  const Status finite = values.ok() ? CheckFinite(name, *values) : Status(values.error());
  if (!finite.ok()) return Error{finite.error().code, Cat(file.name(), ": ", finite.error().message)};
  return values;
}

Result<ConvolutionValues> ReadConvolution(const TensorFile& file, const std::string& name, int64_t outputs,
                                          int64_t inputs, int64_t side) {
  ConvolutionValues out{outputs, inputs, {}, {}};
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.weights, ReadFinite(file, name + ".weight", {outputs, inputs, side, side}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.bias, ReadFinite(file, name + ".bias", {outputs}));
  return out;
}

double MultiplyAdds(const PackedWeights& weights) {
  return static_cast<double>(weights.outputs() * weights.inputs() * weights.taps());
}

PackedWeights Packed(const ConvolutionValues& values, int64_t side) {
  return PackConvolution(values.weights.data(), values.bias.data(), values.outputs, values.inputs, side);
}

}  // namespace anchorsplat
