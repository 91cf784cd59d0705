// Octree nodes and voxels with SIMD.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "benchmarks/hull/baselines/voxel_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "benchmarks/hull/baselines/object_pixel_lookup-inl.h"
#include "benchmarks/hull/baselines/voxel_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {

using MI = hn::Mask<DI>;

HWY_INLINE V homogeneous(const CarvingCamera& c, std::size_t k, V x, V y, V z) {
  return hn::MulAdd(hn::Set(d, c.of_x[k]), x,
                    hn::MulAdd(hn::Set(d, c.of_y[k]), y,
                               hn::MulAdd(hn::Set(d, c.of_z[k]), z, hn::Set(d, c.of_1[k]))));
}

// Returns how far, in axis k of the image, a point of the cube may be from the image `position` of
// the cube's center. With p the rows of the projection, a point moved by m moves in the image by
// (p_k m - position p_w m) / (w + p_w m).
HWY_INLINE V extent(const CarvingCamera& c, std::size_t k, V position, V half, V min_w_reciprocal) {
  const auto part = [&](float of, float of_w) HWY_ATTR {
    return hn::Abs(hn::NegMulAdd(position, hn::Set(d, of_w), hn::Set(d, of)));
  };
  const V sum = hn::Add(part(c.of_x[k], c.of_x[2]),
                        hn::Add(part(c.of_y[k], c.of_y[2]), part(c.of_z[k], c.of_z[2])));
  return hn::MulAdd(hn::Mul(sum, half), min_w_reciprocal, hn::Set(d, kRounding_px));
}

// x, y, z are the cubes' centers, half_voxels is half their edge.
HWY_INLINE Contents contents_of_cubes(const CarvingCamera& c, V x, V y, V z, float half_voxels) {
  const V w = homogeneous(c, 2, x, y, z), scale = reciprocal(w), half = hn::Set(d, half_voxels);
  const V u = hn::Mul(homogeneous(c, 0, x, y, z), scale),
          v = hn::Mul(homogeneous(c, 1, x, y, z), scale);
  const V min_w = hn::Sub(w, hn::Set(d, half_voxels * (std::abs(c.of_x[2]) + std::abs(c.of_y[2]) +
                                                       std::abs(c.of_z[2]))));
  const V far = reciprocal(min_w), extent_u = extent(c, 0, u, half, far),
          extent_v = extent(c, 1, v, half, far);
  const Contents contents = contents_of(c.map, hn::Sub(u, extent_u), hn::Sub(v, extent_v),
                                        hn::Add(u, extent_u), hn::Add(v, extent_v));
  const M in_front = hn::Gt(min_w, hn::Zero(d));
  return {hn::And(contents.none, in_front), hn::And(contents.all, in_front)};
}

// Removes the cameras whose images are full from `mixed`; returns kCarved if an image is empty.
HWY_INLINE VI test_cubes(std::span<const CarvingCamera> cameras, V x, V y, V z, float half_voxels,
                         VI mixed) {
  const VI carved = hn::Set(di, kCarved);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const VI camera = hn::Set(di, std::int32_t(1) << i);
    const MI active = hn::AndNot(hn::Eq(mixed, carved), hn::TestBit(mixed, camera));
    if (hn::AllFalse(di, active)) continue;
    const Contents contents = contents_of_cubes(cameras[i], x, y, z, half_voxels);
    mixed = hn::IfThenElse(hn::And(active, hn::RebindMask(di, contents.all)),
                           hn::AndNot(camera, mixed), mixed);
    mixed = hn::IfThenElse(hn::And(active, hn::RebindMask(di, contents.none)), carved, mixed);
  }
  return mixed;
}

void test_nodes(std::span<const CarvingCamera> cameras, int size_voxels, CarvedNodes& nodes) {
  const std::size_t count = nodes.x.size(), lanes = hn::Lanes(d),
                    padded = (count + lanes - 1) / lanes * lanes;
  for (auto* v : {&nodes.x, &nodes.y, &nodes.z}) v->resize(padded, 0);
  nodes.mixed.resize(padded, kCarved);
  const float half = 0.5f * float(size_voxels);
  const V to_center = hn::Set(d, half);
  for (std::size_t i = 0; i < padded; i += lanes) {
    const auto center = [&](const std::vector<std::int32_t>& corner) HWY_ATTR {
      return hn::Add(hn::ConvertTo(d, hn::LoadU(di, corner.data() + i)), to_center);
    };
    const VI mixed = hn::LoadU(di, nodes.mixed.data() + i);
    hn::StoreU(test_cubes(cameras, center(nodes.x), center(nodes.y), center(nodes.z), half, mixed),
               di, nodes.mixed.data() + i);
  }
  for (auto* v : {&nodes.x, &nodes.y, &nodes.z, &nodes.mixed}) v->resize(count);
}

// Returns coordinate k (0: x), within the brick, of the block of two with this number in the
// brick's bit order.
HWY_INLINE VI block_coordinate(VI block, int k) {
  const VI one = hn::Set(di, 1);
  const VI fours = hn::And(k == 0   ? hn::ShiftRight<3>(block)
                           : k == 1 ? hn::ShiftRight<4>(block)
                                    : hn::ShiftRight<5>(block),
                           one);
  const VI twos = hn::And(k == 0   ? block
                          : k == 1 ? hn::ShiftRight<1>(block)
                                   : hn::ShiftRight<2>(block),
                          one);
  return hn::Add(hn::ShiftLeft<2>(fours), hn::ShiftLeft<1>(twos));
}

HWY_INLINE M centers_in_hull(std::span<const CarvingCamera> cameras, V x, V y, V z, M active) {
  for (const CarvingCamera& c : cameras) {
    const V w = homogeneous(c, 2, x, y, z), scale = reciprocal(w);
    const M on = on_object(c.map, hn::Mul(homogeneous(c, 0, x, y, z), scale),
                           hn::Mul(homogeneous(c, 1, x, y, z), scale));
    active = hn::And(active, hn::And(on, hn::Gt(w, hn::Zero(d))));
    if (hn::AllFalse(d, active)) break;
  }
  return active;
}

constexpr int kBlocks = 64, kVoxelsPerBlock = 8;

// Collects the numbers of the blocks of two that must be decided voxel by voxel, and writes the
// bytes of the others.
int test_blocks(std::span<const CarvingCamera> cameras, const V (&corner)[3], std::uint8_t* bytes,
                std::int32_t* mixed_blocks) {
  HWY_ALIGN std::int32_t mixed[16];
  const int lanes = int(hn::Lanes(d));
  const V one = hn::Set(d, 1.0f);  // from a block's corner to its center
  int count = 0;
  for (int first = 0; first < kBlocks; first += lanes) {
    const VI block = hn::Iota(di, first);
    const auto center = [&](int k) HWY_ATTR {
      return hn::Add(hn::Add(corner[k], hn::ConvertTo(d, block_coordinate(block, k))), one);
    };
    const VI all = hn::Set(di, std::int32_t((1u << cameras.size()) - 1));
    hn::Store(test_cubes(cameras, center(0), center(1), center(2), 1.0f, all), di, mixed);
    for (int i = 0; i < lanes; ++i) {
      bytes[first + i] = mixed[i] == 0 ? 0xff : 0;
      mixed_blocks[count] = first + i;
      count += mixed[i] > 0;
    }
  }
  return count;
}

void carve_brick(std::span<const CarvingCamera> all_cameras, const std::array<int, 3>& corner_voxel,
                 std::int32_t mixed, std::uint32_t* words) {
  CarvingCamera cameras[32];
  std::size_t camera_count = 0;
  for (std::size_t i = 0; i < all_cameras.size(); ++i)
    if (mixed >> i & 1) cameras[camera_count++] = all_cameras[i];
  const std::span<const CarvingCamera> active(cameras, camera_count);

  const V corner[3] = {hn::Set(d, float(corner_voxel[0])), hn::Set(d, float(corner_voxel[1])),
                       hn::Set(d, float(corner_voxel[2]))};
  std::uint8_t bytes[kBlocks];
  std::int32_t blocks[kBlocks + 16];
  const int count = test_blocks(active, corner, bytes, blocks), lanes = int(hn::Lanes(d)),
            voxels = count * kVoxelsPerBlock;
  std::fill_n(blocks + count, 16, 0);
  for (int first = 0; first < voxels; first += lanes) {
    const VI voxel = hn::Iota(di, first), one = hn::Set(di, 1);
    const VI block = hn::GatherIndex(di, blocks, hn::ShiftRight<3>(voxel));
    const auto center = [&](int k) HWY_ATTR {
      const VI in_block = hn::And(k == 0   ? voxel
                                  : k == 1 ? hn::ShiftRight<1>(voxel)
                                           : hn::ShiftRight<2>(voxel),
                                  one);
      return hn::Add(
          hn::Add(corner[k], hn::ConvertTo(d, hn::Add(block_coordinate(block, k), in_block))),
          hn::Set(d, 0.5f));
    };
    const M in = centers_in_hull(active, center(0), center(1), center(2),
                                 as_float_mask(hn::Lt(voxel, hn::Set(di, voxels))));
    std::uint8_t in_bits[8] = {};
    hn::StoreMaskBits(d, in, in_bits);
    // A vector holds whole blocks, or a part of one if it is narrow.
    if (lanes < kVoxelsPerBlock)
      bytes[blocks[first / kVoxelsPerBlock]] |= std::uint8_t(in_bits[0] << first % kVoxelsPerBlock);
    else
      for (int i = 0; i < lanes / kVoxelsPerBlock && first + i * kVoxelsPerBlock < voxels; ++i)
        bytes[blocks[first / kVoxelsPerBlock + i]] = in_bits[i];
  }
  for (std::size_t w = 0; w < kWordsPerBrick; ++w)
    words[w] = bytes[4 * w] | std::uint32_t(bytes[4 * w + 1]) << 8 |
               std::uint32_t(bytes[4 * w + 2]) << 16 | std::uint32_t(bytes[4 * w + 3]) << 24;
}

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::baselines {
HWY_EXPORT(test_nodes);
HWY_EXPORT(carve_brick);
void test_nodes(std::span<const CarvingCamera> cameras, int size_voxels, CarvedNodes& nodes) {
  HWY_DYNAMIC_DISPATCH(test_nodes)(cameras, size_voxels, nodes);
}
void carve_brick(std::span<const CarvingCamera> cameras, const std::array<int, 3>& corner_voxel,
                 std::int32_t mixed, std::uint32_t* words) {
  HWY_DYNAMIC_DISPATCH(carve_brick)(cameras, corner_voxel, mixed, words);
}
}  // namespace fivepipe::baselines
#endif
