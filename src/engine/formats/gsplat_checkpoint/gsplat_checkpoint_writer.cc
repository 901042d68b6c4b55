#include "formats/gsplat_checkpoint/gsplat_checkpoint_writer.h"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.h"
#include "io/atomic_file.h"
#include "io/little_endian.h"
#include "io/zip_archive.h"

namespace anchorsplat {

namespace {

// Writes the pickle opcodes (protocol 2) of a dictionary of tensors.
class PickleWriter {
 public:
  PickleWriter() { bytes_ = "\x80\x02"; }

  PickleWriter& Op(char opcode) {
    bytes_ += opcode;
    return *this;
  }
  PickleWriter& Text(std::string_view text) {
    bytes_ += 'X';
    Little(static_cast<uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  PickleWriter& Integer(int64_t value) {
    bytes_ += "\x8a\x08";  // LONG1 of eight bytes
    Little(value);
    return *this;
  }
  PickleWriter& Integers(const std::vector<int64_t>& values) {
    Op('(');
    for (const int64_t value : values) Integer(value);
    return Op('t');
  }
  PickleWriter& Global(std::string_view module, std::string_view name) {
    bytes_ += Cat('c', module, '\n', name, '\n');
    return *this;
  }

  // torch._utils._rebuild_tensor_v2(storage, offset, size, stride, requires_grad, backward_hooks) of a float32 tensor
  // that fills the storage `key`.
  PickleWriter& Tensor(std::string_view key, const std::vector<int64_t>& shape) {
    int64_t elements = 1;
    std::vector<int64_t> strides(shape.size());
    for (size_t d = shape.size(); d-- > 0;) {
      strides[d] = elements;
      elements *= std::max<int64_t>(1, shape[d]);  // PyTorch's strides of empty tensors
    }
    if (std::find(shape.begin(), shape.end(), 0) != shape.end()) elements = 0;
    Global("torch._utils", "_rebuild_tensor_v2").Op('(');
    Op('(').Text("storage").Global("torch", "FloatStorage").Text(key).Text("cpu").Integer(elements).Op('t').Op('Q');
    Integer(0).Integers(shape).Integers(strides).Op('\x89');
    Global("collections", "OrderedDict").Op(')').Op('R');
    return Op('t').Op('R');
  }

  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  void Little(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  std::string bytes_;
};

struct Tensor {
  const char* name;
  std::vector<int64_t> shape;
  std::span<const float> values;
};

std::string_view Bytes(std::span<const float> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

// Columns [first, first + count) of every Gaussian's SH row.
Buffer<float> ShColumns(const CloudView& cloud, int64_t first, int64_t count) {
  Buffer<float> out(static_cast<size_t>(cloud.size() * count));
  for (int64_t i = 0; i < cloud.size(); ++i) {
    std::copy_n(cloud.sh.data() + i * cloud.sh_stride() + first, count, out.data() + i * count);
  }
  return out;
}

}  // namespace

Status WriteGsplatCheckpoint(const std::filesystem::path& path, const CloudView& cloud, int64_t step,
                             const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const auto bad = [&](const char* what) {
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": cannot be written: ", what)};
  };
  if (cloud.empty()) return bad("there are no Gaussians");
  if (step < 0) return bad("the step is negative");

  const int64_t n = cloud.size();
  const Buffer<float> constant = ShColumns(cloud, 0, 3);
  const Buffer<float> higher = ShColumns(cloud, 3, cloud.sh_stride() - 3);
  const std::array<Tensor, 6> tensors = {{{"means", {n, 3}, cloud.means},
                                          {"opacities", {n}, cloud.opacity_logits},
                                          {"quats", {n, 4}, cloud.quats},
                                          {"scales", {n, 3}, cloud.log_scales},
                                          {"sh0", {n, 1, 3}, constant},
                                          {"shN", {n, cloud.coefficients() - 1, 3}, higher}}};

  PickleWriter pickle;
  pickle.Op('}').Op('(').Text("step").Integer(step).Text("splats").Op('}').Op('(');
  for (size_t t = 0; t < tensors.size(); ++t) pickle.Text(tensors[t].name).Tensor(Cat(t), tensors[t].shape);
  pickle.Op('u').Op('u').Op('.');

  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ZipWriter zip(file);
  // torch.load takes the folder name from the first member and requires a version in it.
  ANCHORSPLAT_RETURN_IF_ERROR(zip.Add("archive/data.pkl", pickle.bytes()));
  ANCHORSPLAT_RETURN_IF_ERROR(zip.Add("archive/byteorder", "little"));
  for (size_t t = 0; t < tensors.size(); ++t) {
    ANCHORSPLAT_RETURN_IF_ERROR(zip.Add(Cat("archive/data/", t), Bytes(tensors[t].values)));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(zip.Add("archive/version", "3\n"));
  ANCHORSPLAT_RETURN_IF_ERROR(zip.Finish());
  return file.Commit();
}

}  // namespace anchorsplat
