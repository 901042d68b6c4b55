#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace anchorsplat {

// How a splat wants to be drawn: as 3DGS (Kerbl et al. 2023) does it, where every Gaussian is widened by 0.3 px²; with
// opacity compensated for that (gsplat's "antialiased"); or with opacity compensated for 0.1 px² (Mip-Splatting).
enum class Rasterization { kClassic, kAntialiased, kMip };

// Columns of N Gaussians that somebody else owns, row i of each belonging to Gaussian i: a Splat, NumPy arrays. Values
// are *stored* ones, before activation, exactly as an INRIA PLY keeps them. Every function that only looks at a splat
// takes this, and copies nothing. The arrays must stay where they are, unchanged, until the call returns.
struct SplatView {
  int sh_degree = 0;                      // 0–3
  std::span<const float> means;           // [N,3] world units, from `origin` on
  std::span<const float> log_scales;      // [N,3] ln(world units), one per axis of the rotation
  std::span<const float> quats;           // [N,4] wxyz, any norm
  std::span<const float> opacity_logits;  // [N] ln(o / (1 − o))
  std::span<const float> sh;              // [N,(sh_degree+1)²,3] coefficient-major, rgb fastest; [.,0,.] is f_dc

  std::optional<Rasterization> rasterization = std::nullopt;  // nothing where nobody said
  std::span<const std::string> comments;                      // of the file, and of what was done to the splat
  // A Gaussian's position in the world is origin + mean, in double. Zero, but for coordinates that are too large for
  // floats, such as those of maps. Cameras and regions are in the world.
  std::array<double, 3> origin = {0, 0, 0};

  int64_t size() const { return static_cast<int64_t>(opacity_logits.size()); }
};

// Whether the columns fit together: kBadArgument with the one that does not. Values are not looked at. All functions
// that take a view look themselves.
ANCHORSPLAT_PUBLIC Expected<void> CheckShape(const SplatView& view);

// The owner of a splat. Columns are those of SplatView; the values may be changed in place, the number of Gaussians
// and the degree are fixed. To be moved, not copied (CopyOf); what was moved from is empty.
//
// One thread may change a splat while nobody else looks at it; any number may look at the same time.
class ANCHORSPLAT_PUBLIC Splat {
 public:
  Splat();  // no Gaussians
  ~Splat();
  Splat(Splat&& other) noexcept;
  Splat& operator=(Splat&& other) noexcept;

  // All values zero. kBadArgument: a count that is not 0–2³¹, a degree that is not 0–3; kIo: not enough memory.
  static Expected<Splat> OfSize(int64_t count, int sh_degree);
  // kBadArgument: CheckShape; kIo: not enough memory.
  static Expected<Splat> CopyOf(const SplatView& view);

  int64_t size() const;
  int sh_degree() const;
  std::span<float> means();           // [N,3]
  std::span<float> log_scales();      // [N,3]
  std::span<float> quats();           // [N,4]
  std::span<float> opacity_logits();  // [N]
  std::span<float> sh();              // [N,(sh_degree+1)²,3]
  void set_rasterization(std::optional<Rasterization> rasterization);
  void set_comments(std::vector<std::string> comments);
  void set_origin(const std::array<double, 3>& origin);

  // Valid until the splat is moved, assigned to or gone.
  SplatView view() const;
  operator SplatView() const { return view(); }  // NOLINT: implicit on purpose

 private:
  struct Owned;
  friend struct SplatAccess;
  explicit Splat(std::unique_ptr<Owned> owned);

  std::unique_ptr<Owned> owned_;  // null: empty
};

}  // namespace anchorsplat
