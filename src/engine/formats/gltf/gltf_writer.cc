#include "formats/gltf/gltf_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/axes.h"
#include "formats/cloud_checks.h"
#include "formats/json_asset.h"
#include "formats/quantize.h"
#include "formats/record_blocks.h"
#include "formats/splat_order.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

constexpr const char* kPosition = "POSITION";
constexpr int kFloatComponent = 5126, kUnsignedShortComponent = 5123, kArrayBuffer = 34962;

// An accessor and how to pack its values.
struct WrittenAttribute {
  std::string name;
  const char* type;
  int component_type;
  size_t record;                                          // bytes
  std::function<void(int64_t row, uint8_t* bytes)> pack;  // packs one Gaussian
};

// glTF's COLOR_0 is linear; splats show sRGB (IEC 61966-2-1).
float LinearFromSrgb(float x) {
  return x <= 0.04045f ? std::max(0.0f, x) / 12.92f : std::pow((std::min(x, 1.0f) + 0.055f) / 1.055f, 2.4f);
}

void PutFloats(const float* values, size_t count, uint8_t* bytes) { std::memcpy(bytes, values, count * sizeof(float)); }

std::vector<WrittenAttribute> Attributes(const CloudView& cloud, const AxisFlip& flip) {
  std::vector<WrittenAttribute> out;
  out.push_back({kPosition, "VEC3", kFloatComponent, 12, [&](int64_t row, uint8_t* bytes) {
                   float mean[3];
                   for (size_t k = 0; k < 3; ++k)
                     mean[k] = flip.mean[k] * cloud.means[static_cast<size_t>(3 * row) + k];
                   PutFloats(mean, 3, bytes);
                 }});
  out.push_back({"COLOR_0", "VEC4", kUnsignedShortComponent, 8, [&](int64_t row, uint8_t* bytes) {
                   const float* dc = cloud.sh.data() + row * cloud.sh_stride();
                   uint16_t color[4];
                   for (size_t k = 0; k < 3; ++k) {
                     color[k] = static_cast<uint16_t>(QuantizeUnit(LinearFromSrgb(ColorFromDc(dc[k])), 65535));
                   }
                   const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(row)]);
                   color[3] = static_cast<uint16_t>(QuantizeUnit(opacity, 65535));
                   std::memcpy(bytes, color, sizeof color);
                 }});
  out.push_back({"KHR_gaussian_splatting:ROTATION", "VEC4", kFloatComponent, 16, [&](int64_t row, uint8_t* bytes) {
                   const std::array<float, 4> q = RescaledToFloat(cloud.quats.data() + 4 * row);
                   const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
                   const bool has_direction = norm > 0;
                   float xyzw[4] = {0, 0, 0, has_direction ? q[0] / norm : 1.0f};
                   for (size_t k = 0; has_direction && k < 3; ++k) xyzw[k] = flip.quat[k + 1] * q[k + 1] / norm;
                   PutFloats(xyzw, 4, bytes);
                 }});
  out.push_back({"KHR_gaussian_splatting:SCALE", "VEC3", kFloatComponent, 12, [&](int64_t row, uint8_t* bytes) {
                   float scale[3];
                   for (size_t k = 0; k < 3; ++k)
                     scale[k] = std::exp(cloud.log_scales[static_cast<size_t>(3 * row) + k]);
                   PutFloats(scale, 3, bytes);
                 }});
  out.push_back({"KHR_gaussian_splatting:OPACITY", "SCALAR", kFloatComponent, 4, [&](int64_t row, uint8_t* bytes) {
                   const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(row)]);
                   PutFloats(&opacity, 1, bytes);
                 }});
  for (int degree = 0; degree <= cloud.sh_degree; ++degree) {
    for (int n = 0; n <= 2 * degree; ++n) {
      const auto coefficient = static_cast<size_t>(degree * degree + n);
      out.push_back({Cat("KHR_gaussian_splatting:SH_DEGREE_", degree, "_COEF_", n), "VEC3", kFloatComponent, 12,
                     [&, coefficient](int64_t row, uint8_t* bytes) {
                       const float* sh = cloud.sh.data() + row * cloud.sh_stride() + 3 * coefficient;
                       const float sign = flip.sh[coefficient];
                       const float rgb[3] = {sign * sh[0], sign * sh[1], sign * sh[2]};
                       PutFloats(rgb, 3, bytes);
                     }});
    }
  }
  return out;
}

// Of the attributes, each stored contiguously.
uint64_t BytesOf(const std::vector<WrittenAttribute>& attributes, int64_t count) {
  uint64_t size = 0;
  for (const WrittenAttribute& attribute : attributes) size += attribute.record * static_cast<uint64_t>(count);
  return size;
}

nlohmann::json JsonOf(const CloudView& cloud, int64_t count, const std::vector<WrittenAttribute>& attributes,
                      const nlohmann::json& bounds) {
  nlohmann::json views = nlohmann::json::array(), accessors = nlohmann::json::array(), names;
  uint64_t offset = 0;
  for (const WrittenAttribute& attribute : attributes) {
    const uint64_t size = attribute.record * static_cast<uint64_t>(count);
    names[attribute.name] = accessors.size();
    nlohmann::json accessor = {{"bufferView", views.size()},
                               {"componentType", attribute.component_type},
                               {"count", count},
                               {"type", attribute.type}};
    if (attribute.component_type == kUnsignedShortComponent) accessor["normalized"] = true;
    if (attribute.name == kPosition) accessor.update(bounds);
    views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", size}, {"target", kArrayBuffer}});
    accessors.push_back(std::move(accessor));
    offset += size;
  }
  const nlohmann::json extension = {{"kernel", "ellipse"},
                                    {"colorSpace", "srgb_rec709_display"},
                                    {"projection", "perspective"},
                                    {"sortingMethod", "cameraDistance"}};
  const nlohmann::json primitive = {
      {"attributes", names}, {"mode", 0}, {"extensions", {{"KHR_gaussian_splatting", extension}}}};
  nlohmann::json asset = AssetOf(cloud.comments, {});
  asset["version"] = "2.0";
  nlohmann::json node = {{"mesh", 0}};
  if (!IsZero(cloud.origin)) {
    const AxisFlip flip = FlipBetween(kRdf, kLuf);
    for (size_t k = 0; k < 3; ++k) node["translation"].push_back(double{flip.mean[k]} * cloud.origin[k] + 0.0);
  }
  return {{"asset", asset},
          {"extensionsUsed", {"KHR_gaussian_splatting"}},
          {"scene", 0},
          {"scenes", {{{"nodes", {0}}}}},
          {"nodes", {node}},
          {"meshes", {{{"primitives", {primitive}}}}},
          {"buffers", {{{"byteLength", offset}}}},
          {"bufferViews", views},
          {"accessors", accessors}};
}

nlohmann::json BoundsOf(const CloudView& cloud, const AxisFlip& flip) {
  const std::optional<Bounds> bounds = ComputeBounds(cloud);
  if (!bounds) return nlohmann::json::object();
  nlohmann::json min, max;
  for (size_t k = 0; k < 3; ++k) {
    min.push_back(std::min(flip.mean[k] * bounds->min[k], flip.mean[k] * bounds->max[k]));
    max.push_back(std::max(flip.mean[k] * bounds->min[k], flip.mean[k] * bounds->max[k]));
  }
  return {{"min", min}, {"max", max}};
}

// Padded size of the JSON chunk: the same for all clouds of that size, degree and credits, however many digits their
// bounds have.
size_t JsonSize(const CloudView& cloud, int64_t count, const std::vector<WrittenAttribute>& attributes) {
  constexpr size_t kRoomForBounds = 2 * sizeof "\"min\":[,,]," + 6 * sizeof "-1.2345678901234567e-300";
  return (JsonOf(cloud, count, attributes, nlohmann::json::object()).dump().size() + kRoomForBounds + 3) / 4 * 4;
}

// Writes the values of all attributes, one after another, from byte `at` on.
Status WriteValues(OutputFile& file, uint64_t at, const CloudView& cloud, const CloudWriteOptions& options,
                   const std::vector<WrittenAttribute>& attributes) {
  const Buffer<uint32_t> order = WriteOrder(cloud, options.order, SplatOrder::kKeep);
  for (const WrittenAttribute& attribute : attributes) {
    ANCHORSPLAT_RETURN_IF_ERROR(
        WriteRecords(file, at, cloud.size(), attribute.record, [&](int64_t first, int64_t last, uint8_t* bytes) {
          for (int64_t i = first; i < last; ++i, bytes += attribute.record) {
            attribute.pack(order.empty() ? i : int64_t{order[static_cast<size_t>(i)]}, bytes);
          }
        }));
    at += attribute.record * static_cast<uint64_t>(cloud.size());
  }
  return {};
}

// A name as a relative URI (RFC 3986): every byte except letters, digits and "-._~" becomes %XX.
std::string UriOf(const std::string& name) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string uri;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') || (byte >= '0' && byte <= '9');
    if (plain || std::string_view("-._~").find(c) != std::string_view::npos) {
      uri += c;
    } else {
      uri += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return uri;
}

constexpr uint64_t kHeads = 12 + 8 + 8;  // headers of the file and its two chunks

}  // namespace

uint64_t PredictedGlbSize(int64_t count, int sh_degree) {
  CloudView none;
  none.sh_degree = sh_degree;
  const AxisFlip flip = FlipBetween(kRdf, kLuf);
  const std::vector<WrittenAttribute> attributes = Attributes(none, flip);
  return kHeads + JsonSize(none, count, attributes) + BytesOf(attributes, count);
}

Status WriteGlb(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const AxisFlip flip = FlipBetween(kRdf, kLuf);
  const std::vector<WrittenAttribute> attributes = Attributes(cloud, flip);
  std::string json = JsonOf(cloud, cloud.size(), attributes, BoundsOf(cloud, flip)).dump();
  json.resize(JsonSize(cloud, cloud.size(), attributes), ' ');
  const uint64_t binary = BytesOf(attributes, cloud.size());
  const uint64_t begin = kHeads + json.size();
  if (begin + binary > 0xffffffffu) {
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": ", WithThousands(cloud.size()), " Gaussians need ",
                                              HumanBytes(binary), ", but a GLB file holds at most 4.3 GB")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Reserve(begin + binary));
  const uint32_t head[5] = {0x46546c67, 2, static_cast<uint32_t>(begin + binary), static_cast<uint32_t>(json.size()),
                            0x4e4f534a};                                  // "glTF", version, length; length, "JSON"
  const uint32_t chunk[2] = {static_cast<uint32_t>(binary), 0x004e4942};  // length, "BIN"
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(head, sizeof head));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(json));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(chunk, sizeof chunk));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteValues(file, begin, cloud, options, attributes));
  return file.Commit();
}

uint64_t EstimatedGltfSize(int64_t count, int sh_degree) {
  CloudView none;
  none.sh_degree = sh_degree;
  const AxisFlip flip = FlipBetween(kRdf, kLuf);
  const std::vector<WrittenAttribute> attributes = Attributes(none, flip);
  constexpr uint64_t kBoundsAndName = 250;
  return JsonOf(none, count, attributes, nlohmann::json::object()).dump(2).size() + kBoundsAndName +
         BytesOf(attributes, count);
}

std::filesystem::path GltfFileBeside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".bin");
}

Status WriteGltf(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const std::filesystem::path beside = GltfFileBeside(path);
  const AxisFlip flip = FlipBetween(kRdf, kLuf);
  const std::vector<WrittenAttribute> attributes = Attributes(cloud, flip);
  nlohmann::json json = JsonOf(cloud, cloud.size(), attributes, BoundsOf(cloud, flip));
  json["buffers"][0]["uri"] = UriOf(beside.filename().string());
  std::vector<OutputFile> files;
  for (const std::filesystem::path& name : {beside, path}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(name, options.overwrite, options.memory));
    files.push_back(std::move(file));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(files[0].Reserve(BytesOf(attributes, cloud.size())));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteValues(files[0], 0, cloud, options, attributes));
  ANCHORSPLAT_RETURN_IF_ERROR(files[1].Write(json.dump(2)));
  return CommitTogether(files);
}

}  // namespace anchorsplat
