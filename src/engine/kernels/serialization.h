#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// Point Transformer V3 orders voxels along space-filling curves (Wu et al. 2024, §4.2). Four curves take turns; `Trans`
// curves exchange x and y.
enum class Curve : uint8_t { kZ = 0, kZTrans = 1, kHilbert = 2, kHilbertTrans = 3 };
inline constexpr int kCurves = 4;

// Maximum bits per axis: three times this must fit a non-negative 64-bit integer.
inline constexpr int kMaxCurveDepth = 21;

// Bits per axis of the curves. PTv3's first releases use the bits of the largest coordinate, later ones those of that
// coordinate + 1. They differ only for a largest coordinate of 2^n − 1, and only in Hilbert codes.
enum class DepthRule { kLargest, kLargestPlusOne };
int CurveDepth(int32_t largest_coordinate, DepthRule rule = DepthRule::kLargest);

// Position of voxel (x, y, z), 0 ≤ each < 2^depth, along the curve. Z-order interleaves the bits, x most significant.
// Hilbert is Skilling's transposition (AIP Conf. Proc. 707, 2004), then the same interleaving and Gray decoding.
// For all four curves Code(v >> 1, depth − 1) = Code(v, depth) >> 3, so pooling needs no new codes.
int64_t CurveCode(Curve curve, int depth, int32_t x, int32_t y, int32_t z);

// Writes the codes of N voxels [N,3] to codes[N].
void CurveCodes(Curve curve, int depth, std::span<const int32_t> voxels, std::span<int64_t> codes);

// Rows sorted by code, stable. Codes must not be negative.
Buffer<int32_t> OrderOfCodes(std::span<const int64_t> codes);

// Curve of each slot of the order table: slot s of a level uses row shuffle[s] of the table before it.
using Shuffle = std::array<uint8_t, kCurves>;
inline constexpr Shuffle kNoShuffle = {0, 1, 2, 3};

// One shuffle for serialization and one for each of the four poolings, in that order. Upstream also shuffles at
// inference, unseeded, so its results vary from run to run; the identity is the deterministic choice.
inline constexpr int kShuffles = 5;
using Shuffles = std::array<Shuffle, kShuffles>;
inline constexpr Shuffles kNoShuffles = {kNoShuffle, kNoShuffle, kNoShuffle, kNoShuffle, kNoShuffle};

// kBadArgument if a shuffle is no permutation of 0 1 2 3.
Status Validate(const Shuffles& shuffles);

// The five results of torch.randperm(4) after torch.manual_seed(seed) on PyTorch's CPU generator: MT19937 and a
// Fisher–Yates shuffle from the front.
Shuffles ShufflesFromSeed(uint64_t seed);

}  // namespace anchorsplat
