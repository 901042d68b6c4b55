#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// Point Transformer V3 puts an unordered set of voxels into a row by following a space-filling curve (Wu et al. 2024,
// §4.2). Four curves are used in turn; the `Trans` ones follow the same path with x and y exchanged.
enum class Curve : uint8_t { kZ = 0, kZTrans = 1, kHilbert = 2, kHilbertTrans = 3 };
inline constexpr int kCurves = 4;

// Bits per axis that a code can hold: three times this must fit into a non-negative 64-bit integer.
inline constexpr int kMaxCurveDepth = 21;

// How many bits per axis the curves run over. PTv3's first releases take the bits of the largest coordinate, later ones
// the bits of the largest coordinate + 1. They differ only when that coordinate is 2^n − 1, and then only in the
// Hilbert codes.
enum class DepthRule { kLargest, kLargestPlusOne };
int CurveDepth(int32_t largest_coordinate, DepthRule rule = DepthRule::kLargest);

// Position of voxel (x, y, z), 0 ≤ each < 2^depth, along the curve. Z-order interleaves the bits, x most significant;
// Hilbert is Skilling's transposition (AIP Conf. Proc. 707, 2004) followed by the same interleaving and Gray decoding.
// For all four curves Code(v >> 1, depth − 1) = Code(v, depth) >> 3, so pooling needs no new codes.
int64_t CurveCode(Curve curve, int depth, int32_t x, int32_t y, int32_t z);

// Codes of N voxels [N,3] into codes[N].
void CurveCodes(Curve curve, int depth, std::span<const int32_t> voxels, std::span<int64_t> codes);

// Rows in ascending order of code, equal codes in their original order. Codes are not negative.
Buffer<int32_t> OrderOfCodes(std::span<const int64_t> codes);

// Which curve stands in which slot of the order table: slot s of a level uses row shuffle[s] of the table before it.
using Shuffle = std::array<uint8_t, kCurves>;
inline constexpr Shuffle kNoShuffle = {0, 1, 2, 3};

// One shuffle when the points are serialized and one in each of the four poolings, in that order. Upstream shuffles at
// inference too and seeds nothing, so its results differ from run to run; the identity is the deterministic choice.
inline constexpr int kShuffles = 5;
using Shuffles = std::array<Shuffle, kShuffles>;
inline constexpr Shuffles kNoShuffles = {kNoShuffle, kNoShuffle, kNoShuffle, kNoShuffle, kNoShuffle};

// kBadArgument when one of them is not a permutation of 0 1 2 3.
Status Validate(const Shuffles& shuffles);

// The five results of torch.randperm(4) after torch.manual_seed(seed) with PyTorch's CPU generator: MT19937 and a
// Fisher–Yates exchange from the front.
Shuffles ShufflesFromSeed(uint64_t seed);

}  // namespace anchorsplat
