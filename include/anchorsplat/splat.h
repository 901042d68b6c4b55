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

// How a splat is to be rendered: as in 3DGS (Kerbl et al. 2023), where every Gaussian is dilated by 0.3 px²; with
// opacity compensated for that (gsplat's "antialiased"); or with opacity compensated for 0.1 px² (Mip-Splatting).
enum class Rasterization { kClassic, kAntialiased, kMip };

// Borrowed columns of N Gaussians (a Splat, NumPy arrays, …); row i of each belongs to Gaussian i. Values are *stored*
// ones, before activation, as in an INRIA PLY. Functions that only read a splat take this and copy nothing. The arrays
// must stay valid and unchanged until the call returns.
struct SplatView {
  int sh_degree = 0;                      // 0–3
  std::span<const float> means;           // [N,3] world units, relative to `origin`
  std::span<const float> log_scales;      // [N,3] ln(world units), one per axis of the rotation
  std::span<const float> quats;           // [N,4] wxyz, any norm
  std::span<const float> opacity_logits;  // [N] ln(o / (1 − o))
  std::span<const float> sh;              // [N,(sh_degree+1)²,3] coefficient-major, rgb fastest; [.,0,.] is f_dc

  std::optional<Rasterization> rasterization = std::nullopt;  // unset: unknown
  std::span<const std::string> comments;                      // from the file, and about what was done to the splat
  // World position of a Gaussian is origin + mean, in double. Zero unless coordinates are too large for float, as on
  // maps. Cameras and regions are in world coordinates.
  std::array<double, 3> origin = {0, 0, 0};

  int64_t size() const { return static_cast<int64_t>(opacity_logits.size()); }
};

// Checks that the columns have matching sizes; kBadArgument names the one that does not. Does not read values.
// Functions that take a view check by themselves.
ANCHORSPLAT_PUBLIC Expected<void> CheckShape(const SplatView& view);

// Owns a splat, with the columns of SplatView. Values can be changed in place; count and degree are fixed. Movable, not
// copyable (use CopyOf); a moved-from Splat is empty.
//
// Not synchronised: concurrent reads are fine, writes need exclusive access.
class ANCHORSPLAT_PUBLIC Splat {
 public:
  Splat();  // no Gaussians
  ~Splat();
  Splat(Splat&& other) noexcept;
  Splat& operator=(Splat&& other) noexcept;

  // All values zero. kBadArgument: count not in 0–2³¹, degree not in 0–3; kIo: not enough memory.
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

  // Valid until the splat is moved, assigned to or destroyed.
  SplatView view() const;
  operator SplatView() const { return view(); }  // NOLINT: implicit on purpose

 private:
  struct Owned;
  friend struct SplatAccess;
  explicit Splat(std::unique_ptr<Owned> owned);

  std::unique_ptr<Owned> owned_;  // null: empty
};

}  // namespace anchorsplat
