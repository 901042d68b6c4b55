#include "network/torch/render_op.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

// State of one view from rendering to gradient.
struct Slot {
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient output_gradient;
  CloudGradient gradient;
  Status status;
};

}  // namespace

// Slots not used by any graph.
struct RenderOp::Pool : std::enable_shared_from_this<RenderOp::Pool> {
  std::shared_ptr<Slot> Acquire() {
    std::unique_ptr<Slot> slot;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!free.empty()) {
        slot = std::move(free.back());
        free.pop_back();
      }
    }
    if (!slot) slot = std::make_unique<Slot>();
    return {slot.release(), [pool = shared_from_this()](Slot* used) {
              const std::lock_guard<std::mutex> lock(pool->mutex);
              pool->free.emplace_back(used);
            }};
  }

  std::mutex mutex;
  std::vector<std::unique_ptr<Slot>> free;
  double backward_seconds = 0;
};

namespace {

constexpr int64_t kRowsPerTask = 1 << 15;

// One call of the operation, alive until its backward pass.
struct Call : torch::CustomClassHolder {
  GaussianCloud cloud;
  std::vector<std::shared_ptr<Slot>> slots;  // one per view
  std::shared_ptr<RenderOp::Pool> pool;
};

torch::Tensor View(const Image& image, const std::shared_ptr<Slot>& slot) {
  return torch::from_blob(
      const_cast<float*>(image.pixels.data()), {image.channels, image.height, image.width}, [slot](void*) {},
      torch::kFloat32);
}

// Bounding box of the nonzero values of `picture` [C,H,W]; NaN counts as nonzero.
PixelBox NonZeroBox(const float* picture, int64_t channels, int height, int width) {
  PixelBox box = {width, height, 0, 0};
  const auto filled = [](float v) { return v != 0; };
  for (int64_t row = 0; row < channels * height; ++row) {
    const float* begin = picture + row * width;
    const float* first = std::find_if(begin, begin + width, filled);
    if (first == begin + width) continue;
    const int y = static_cast<int>(row % height);
    int last = width;
    while (!filled(begin[last - 1])) --last;
    box = {std::min(box.x0, static_cast<int>(first - begin)), std::min(box.y0, y), std::max(box.x1, last),
           std::max(box.y1, y + 1)};
  }
  return box.empty() ? PixelBox{} : box;
}

// Copies the nonzero part of `gradient` into `image`, resized like `like`. Returns its box.
PixelBox TakeGradient(const torch::Tensor& gradient, const Image& like, Image& image) {
  const torch::Tensor values = gradient.to(torch::kCPU, torch::kFloat32).contiguous();
  const float* from = values.const_data_ptr<float>();
  const PixelBox box = NonZeroBox(from, like.channels, like.height, like.width);
  if (image.width != like.width || image.height != like.height || image.channels != like.channels) {
    image = Image(like.width, like.height, like.channels);
  }
  for (int c = 0; c < like.channels; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      const int64_t at = (int64_t{c} * like.height + y) * like.width;
      std::copy(from + at + box.x0, from + at + box.x1, image.pixels.data() + at + box.x0);
    }
  }
  return box;
}

PixelBox Union(const PixelBox& a, const PixelBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

// Computes one view's gradient. Both planes are read inside `slot.output_gradient.box`, so zeros there must be written.
Status BackwardView(const GaussianCloud& cloud, const torch::Tensor& color, const torch::Tensor& alpha, Slot& slot) {
  RenderGradient& out = slot.output_gradient;
  const auto zero_frame = [](Image& image, const PixelBox& inside, const PixelBox& outside) {
    for (int c = 0; c < image.channels; ++c) {
      for (int y = outside.y0; y < outside.y1; ++y) {
        float* row = image.channel(c) + int64_t{y} * image.width;
        if (inside.empty() || y < inside.y0 || y >= inside.y1) {
          std::fill(row + outside.x0, row + outside.x1, 0.0f);
        } else {
          std::fill(row + outside.x0, row + inside.x0, 0.0f);
          std::fill(row + inside.x1, row + outside.x1, 0.0f);
        }
      }
    }
  };
  PixelBox color_box, alpha_box;
  if (color.defined()) {
    color_box = TakeGradient(color, slot.output.color, out.color);
  } else {
    out.color = Image(slot.output.color.width, slot.output.color.height, 3);
  }
  if (alpha.defined()) {
    alpha_box = TakeGradient(alpha, slot.output.alpha, out.alpha);
  } else {
    out.alpha = Image();
  }
  out.box = Union(color_box, alpha_box);
  zero_frame(out.color, color_box, out.box);
  if (alpha.defined()) zero_frame(out.alpha, alpha_box, out.box);
  return slot.rasterizer.Backward(cloud, out, slot.gradient);
}

// Sum over the views in order, whatever the number of threads.
torch::Tensor Sum(const Call& call, const torch::Tensor& like, Buffer<float> CloudGradient::*member) {
  torch::Tensor sum = torch::empty(like.sizes(), torch::kFloat32);
  float* out = sum.mutable_data_ptr<float>();
  ParallelFor(0, sum.numel(), kRowsPerTask, [&](int64_t first, int64_t last) {
    const auto part = [&](size_t view) { return (call.slots[view]->gradient.*member).data(); };
    std::copy(part(0) + first, part(0) + last, out + first);
    for (size_t view = 1; view < call.slots.size(); ++view) {
      const float* more = part(view);
      for (int64_t i = first; i < last; ++i) out[i] += more[i];
    }
  });
  return sum.to(like.device(), like.scalar_type());
}

class RenderFunction : public torch::autograd::Function<RenderFunction> {
 public:
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context, const torch::Tensor& means,
                                                const torch::Tensor& log_scales, const torch::Tensor& quats,
                                                const torch::Tensor& opacity_logits, const torch::Tensor& sh,
                                                const c10::intrusive_ptr<Call>& call) {
    context->set_materialize_grads(false);
    context->save_for_backward({means, log_scales, quats, opacity_logits, sh});
    context->saved_data["call"] =
        c10::IValue::make_capsule(c10::static_intrusive_pointer_cast<torch::CustomClassHolder>(call));
    torch::autograd::variable_list outputs;
    for (const auto& slot : call->slots) {
      outputs.push_back(View(slot->output.color, slot));
      outputs.push_back(View(slot->output.alpha, slot));
    }
    return outputs;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    const auto begin = std::chrono::steady_clock::now();
    const auto call = c10::static_intrusive_pointer_cast<Call>(context->saved_data["call"].toCapsule());
    const auto views = static_cast<int64_t>(call->slots.size());
    ParallelFor(0, views, 1, [&](int64_t view, int64_t) {
      Slot& slot = *call->slots[static_cast<size_t>(view)];
      slot.status = BackwardView(call->cloud, gradients[static_cast<size_t>(2 * view)],
                                 gradients[static_cast<size_t>(2 * view + 1)], slot);
    });
    for (const auto& slot : call->slots) {
      if (!slot->status.ok()) throw std::runtime_error(slot->status.error().message);
    }
    const auto inputs = context->get_saved_variables();
    torch::autograd::variable_list result = {
        Sum(*call, inputs[0], &CloudGradient::means), Sum(*call, inputs[1], &CloudGradient::log_scales),
        Sum(*call, inputs[2], &CloudGradient::quats), Sum(*call, inputs[3], &CloudGradient::opacity_logits),
        Sum(*call, inputs[4], &CloudGradient::sh),    torch::Tensor()};
    call->pool->backward_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return result;
  }
};

}  // namespace

RenderOp::RenderOp() : pool_(std::make_shared<Pool>()) {}

double RenderOp::backward_seconds() const { return pool_->backward_seconds; }
void RenderOp::ResetBackwardSeconds() { pool_->backward_seconds = 0; }

Result<std::vector<RenderedView>> RenderOp::operator()(const GaussianTensors& gaussians,
                                                       std::span<const Camera> cameras, const RenderOptions& options) {
  const bool gradient =
      torch::GradMode::is_enabled() &&
      (gaussians.means.requires_grad() || gaussians.log_scales.requires_grad() || gaussians.quats.requires_grad() ||
       gaussians.opacity_logits.requires_grad() || gaussians.sh.requires_grad());
  const auto call = c10::make_intrusive<Call>();
  call->cloud = ToCloud(gaussians);
  call->pool = pool_;
  for (size_t view = 0; view < cameras.size(); ++view) call->slots.push_back(pool_->Acquire());
  RenderOptions own = options;
  own.gradient = gradient;
  own.depth = false;
  ParallelFor(0, static_cast<int64_t>(cameras.size()), 1, [&](int64_t view, int64_t) {
    Slot& slot = *call->slots[static_cast<size_t>(view)];
    slot.status = slot.rasterizer.Render(call->cloud, cameras[static_cast<size_t>(view)], own, slot.output);
  });
  for (const auto& slot : call->slots) {
    if (!slot->status.ok()) return slot->status.error();
  }
  std::vector<RenderedView> views;
  if (!gradient || cameras.empty()) {
    for (const auto& slot : call->slots)
      views.push_back({View(slot->output.color, slot), View(slot->output.alpha, slot)});
    return views;
  }
  const auto outputs = RenderFunction::apply(gaussians.means, gaussians.log_scales, gaussians.quats,
                                             gaussians.opacity_logits, gaussians.sh, call);
  for (size_t view = 0; view < cameras.size(); ++view) views.push_back({outputs[2 * view], outputs[2 * view + 1]});
  return views;
}

}  // namespace anchorsplat
