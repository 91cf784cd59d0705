#include "common/collision/detection/gl/gl_contact_passes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/cpu/detection_common.h"
#include "common/collision/detection/gl/gl_contact_camera.h"
#include "common/collision/detection/gl/shaders_embedded.h"

namespace fivepipe::collision {

using namespace gl_contact;
using Eigen::Vector3d;

namespace {

// Binding points of boxes.comp and triangles.comp.
enum DescentBinding {
  kSkipMaps = 0,
  kCameras = 1,
  kObjects = 2,
  kTrees = 3,
  kDescent = 4,
  kIn = 5,
  kOut = 6,
  kLeaves = 7
};
// Binding points of refine.comp, sample.comp and blocks.comp.
enum RefineBinding {
  kFrameCameras = 0,
  kBlocks = 1,
  kTriangles = 2,
  kRefinement = 3,
  kPartsIn = 4,
  kPartsOut = 5,
  kFound = 6,
  kStates = 7
};

std::uint32_t groups_of(std::size_t invocations) {
  return std::uint32_t(std::min<std::size_t>((invocations + kGroup - 1) / kGroup, kMaxGroups));
}

constexpr std::size_t kBoxWords = sizeof(Bvh::Boxes) / sizeof(float),
                      kLeafWords = sizeof(Bvh::Leaf) / sizeof(float);
static_assert(kBoxWords == 6 * Bvh::kArity && kLeafWords == 9 * Bvh::kArity);

// Layout of a BVH on the GPU: the leaves, then the boxes level by level. Returns its number of
// words.
std::size_t words_of(const Bvh& tree, Object& object) {
  std::size_t words = std::size_t(tree.leaves()) * kLeafWords;
  for (int level = 0, below = tree.leaves(); level < tree.levels(); ++level) {
    below = (below + Bvh::kArity - 1) / Bvh::kArity;
    object.first_box_word[std::size_t(level)] = std::uint32_t(words);
    words += std::size_t(below) * kBoxWords;
  }
  return words;
}

void write_tree(const Bvh& tree, const Object& object, std::size_t words,
                const gl::GlBuffer& buffer) {
  const auto write = [&](std::size_t first_word, std::size_t count, const void* from) {
    glNamedBufferSubData(buffer.get(), GLintptr(first_word * sizeof(float)),
                         GLsizeiptr(count * sizeof(float)), from);
  };
  write(object.first_leaf_word, std::size_t(tree.leaves()) * kLeafWords, &tree.leaf(0));
  for (int level = 0; level < tree.levels(); ++level) {
    const std::size_t first = object.first_box_word[std::size_t(level)];
    const std::size_t end = level + 1 < tree.levels()
                                ? object.first_box_word[std::size_t(level + 1)]
                                : object.first_leaf_word + words;
    write(first, end - first, &tree.boxes(level, 0));
  }
}

}  // namespace

GlContactPasses::GlContactPasses()
    : boxes_("contacts: boxes", kBoxesComp),
      triangles_("contacts: triangles", kTrianglesComp),
      refine_("contacts: parts", kRefineComp),
      sample_("contacts: samples", kSampleComp),
      blocks_("contacts: blocks", kBlocksComp) {
  GLint64 max_block_bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &max_block_bytes);
  // The shaders index words and bytes with 31 bits.
  max_bytes_ = std::min(std::size_t(max_block_bytes), std::size_t{1} << 31);
}

bool GlContactPasses::set_maps(const hull::CpuHull& hull) {
  maps_.clear();
  if (hull.cameras().size() > kMaxCameras) return false;
  std::size_t bytes = 0;
  for (const hull::CpuHull::MapCamera& c : hull.cameras()) {
    const hull::PixelRect& stored = c.skip_map.stored();
    const auto [base_u, base_v] = base_pixel(c);
    maps_.push_back({bytes + std::size_t(base_v - stored.v0_px) * std::size_t(c.skip_map.stride()) +
                         std::size_t(base_u - stored.u0_px),
                     c.skip_map.stride()});
    bytes += std::size_t(c.skip_map.stride()) * std::size_t(stored.height_px());
  }
  if (!(bytes < max_bytes_)) return false;
  skip_map_buffer_.reserve(bytes);
  bytes = 0;
  for (const hull::CpuHull::MapCamera& c : hull.cameras()) {
    // Each row consists of whole words.
    const std::size_t size =
        std::size_t(c.skip_map.stride()) * std::size_t(c.skip_map.stored().height_px());
    glNamedBufferSubData(skip_map_buffer_.get(), GLintptr(bytes), GLsizeiptr(size),
                         c.skip_map.bytes(hull::Quadrant::right_down));
    bytes += size;
  }
  origin_world_m_ = world_origin_near_hull_m(hull);
  Eigen::Isometry3d world_from_frame = Eigen::Isometry3d::Identity();
  world_from_frame.translation() = origin_world_m_;
  std::vector<GlCamera> cameras;
  for (std::size_t i = 0; i < maps_.size(); ++i)
    cameras.push_back(placed(gl_camera(hull.cameras()[i], world_from_frame, 0), i));
  frame_camera_buffer_.reserve(kMaxCameras * sizeof(GlCamera));
  frame_camera_buffer_.write(cameras.data(), cameras.size() * sizeof(GlCamera));
  return std::all_of(cameras.begin(), cameras.end(),
                     [](const GlCamera& c) { return fits_float(c, 0); });
}

GlCamera GlContactPasses::placed(GlCamera camera, std::size_t map) const {
  camera.first_byte = std::int32_t(maps_[map].first_byte), camera.stride = maps_[map].stride;
  return camera;
}

std::vector<char> GlContactPasses::set_objects(const hull::CpuHull& hull,
                                               std::span<const DetectionObject> objects) {
  std::vector<char> fits(objects.size(), 0);
  std::vector<GlCamera> cameras;
  objects_.assign(objects.size(), {});
  roots_.clear();
  nodes_ = leaves_ = all_triangles_ = 0, levels_ = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Bvh& tree = *objects[i].tree;
    if (tree.empty() || tree.levels() > kMaxTreeLevels) continue;
    if (!is_in_rule_box(hull.rule(), objects[i])) continue;
    Eigen::Isometry3d world_from_tree = objects[i].world_from_object;
    world_from_tree.translation() = objects[i].world_from_object * tree.origin_m();
    objects_[i].first_camera = std::uint32_t(cameras.size());
    objects_[i].triangles = std::uint32_t(tree.mesh().triangles.size());
    fits[i] =
        sizeof(OpenHeader) + (all_triangles_ + objects_[i].triangles) * sizeof(OpenTriangle) <=
        max_bytes_;
    all_triangles_ += fits[i] ? objects_[i].triangles : 0;
    for (std::size_t c = 0; c < maps_.size() && fits[i]; ++c) {
      GlCamera camera = placed(gl_camera(hull.cameras()[c], world_from_tree, tree.radius_m()), c);
      fits[i] = fits_float(camera, tree.radius_m());
      // One bound serves all points of the object.
      camera.of_x[3] += camera.at[3] * float(tree.radius_m());
      cameras.push_back(camera);
    }
    fits[i] = fits[i] && cameras.size() * sizeof(GlCamera) <= max_bytes_;
    if (!fits[i]) cameras.resize(objects_[i].first_camera);
  }
  place_trees(objects, fits);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!fits[i]) continue;
    const Bvh& tree = *objects[i].tree;
    roots_.push_back({std::uint32_t(i << 8 | std::size_t(tree.levels() - 1)), 0});
    levels_ = std::max(levels_, tree.levels());
    leaves_ += std::size_t(tree.leaves());
    nodes_ += (std::size_t(tree.leaves()) + Bvh::kArity - 1) / Bvh::kArity;
  }
  if (roots_.empty()) return fits;
  camera_buffer_.write(cameras.data(), cameras.size() * sizeof(GlCamera));
  object_buffer_.write(objects_.data(), objects_.size() * sizeof(Object));
  return fits;
}

// Stores the BVHs consecutively, each one once.
void GlContactPasses::place_trees(std::span<const DetectionObject> objects,
                                  std::vector<char>& fits) {
  std::vector<PlacedTree> placed;
  std::vector<std::size_t> number(objects.size()), words_each;
  std::size_t words = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!fits[i]) continue;
    const std::uint64_t content = objects[i].tree->content();
    std::size_t n = 0;
    while (n < placed.size() && placed[n].content != content) ++n;
    const std::size_t own = words_of(*objects[i].tree, objects_[i]);
    if (n == placed.size()) {
      if ((words + own) * sizeof(float) > max_bytes_) {
        fits[i] = 0;
        continue;
      }
      placed.push_back({content, words});
      words_each.push_back(own);
      words += own;
    }
    number[i] = n;
    objects_[i].first_leaf_word = std::uint32_t(placed[n].first_word);
    for (std::uint32_t& word : objects_[i].first_box_word)
      word += std::uint32_t(placed[n].first_word);
  }
  if (words > tree_words_) {
    placed_.clear();
    tree_buffer_.reserve(words * sizeof(float));
    tree_words_ = words;
  }
  for (std::size_t i = 0, next = 0; i < objects.size() && next < placed.size(); ++i) {
    if (!fits[i] || number[i] != next) continue;
    const PlacedTree& here = placed[next];
    const bool stored = next < placed_.size() && placed_[next].content == here.content &&
                        placed_[next].first_word == here.first_word;
    if (!stored) write_tree(*objects[i].tree, objects_[i], words_each[next], tree_buffer_);
    ++next;
  }
  placed_ = std::move(placed);
}

void GlContactPasses::use(const gl::GlProgram& program) const {
  glProgramUniform1i(program.get(), 0, GLint(maps_.size()));
  glProgramUniform1f(program.get(), 1, float(kMaxContactEps_px));
  skip_map_buffer_.bind_storage(kSkipMaps);
  program.use();
}

std::vector<OpenTriangle> GlContactPasses::open_triangles() {
  if (roots_.empty()) return {};
  Descent descent;
  descent.nodes[0] = {{groups_of(roots_.size() * Bvh::kArity), 1, 1}, std::uint32_t(roots_.size())};
  descent_buffer_.write(&descent, sizeof descent);
  for (gl::GlBuffer& nodes : node_buffers_) nodes.reserve(nodes_ * sizeof(Node));
  node_buffers_[0].write(roots_.data(), roots_.size() * sizeof(Node));
  leaf_buffer_.reserve(leaves_ * sizeof(Node));
  OpenHeader header;
  open_buffer_.reserve(sizeof header + all_triangles_ * sizeof(OpenTriangle));
  open_buffer_.write(&header, sizeof header);
  descent_timer_.begin();
  use(boxes_);
  camera_buffer_.bind_storage(kCameras);
  object_buffer_.bind_storage(kObjects);
  tree_buffer_.bind_storage(kTrees);
  descent_buffer_.bind_storage(kDescent);
  leaf_buffer_.bind_storage(kLeaves);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, descent_buffer_.get());
  for (int pass = 0; pass < levels_; ++pass) {
    glProgramUniform1i(boxes_.get(), 2, pass);
    node_buffers_[pass % 2].bind_storage(kIn);
    node_buffers_[1 - pass % 2].bind_storage(kOut);
    glDispatchComputeIndirect(
        GLintptr(offsetof(Descent, nodes) + std::size_t(pass) * sizeof(Dispatch)));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
  }
  use(triangles_);
  leaf_buffer_.bind_storage(kIn);
  open_buffer_.bind_storage(kOut);
  glDispatchComputeIndirect(GLintptr(offsetof(Descent, leaves)));
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  descent_timer_.end();
  glGetNamedBufferSubData(open_buffer_.get(), 0, sizeof header, &header);
  gl::check_context();
  std::vector<OpenTriangle> open(header.count);
  if (!open.empty())
    glGetNamedBufferSubData(open_buffer_.get(), sizeof header,
                            GLsizeiptr(open.size() * sizeof(OpenTriangle)), open.data());
  gl::check_context();
  return open;
}

std::optional<GlContactPasses::Refined> GlContactPasses::refine(
    std::span<const RefinedTriangle> triangles, std::span<const Part> first, std::size_t room) {
  Refined refined;
  if (first.empty()) return refined;
  if (first.size() > room || triangles.size_bytes() > max_bytes_) return std::nullopt;
  Refinement refinement;
  refinement.parts[0] = {{groups_of(first.size()), 1, 1}, std::uint32_t(first.size())};
  refinement_buffer_.write(&refinement, sizeof refinement);
  triangle_buffer_.write(triangles.data(), triangles.size() * sizeof(RefinedTriangle));
  for (gl::GlBuffer& parts : part_buffers_) parts.reserve(room * sizeof(Part));
  part_buffers_[0].write(first.data(), first.size() * sizeof(Part));
  FoundHeader header;
  found_buffer_.reserve(sizeof header + room * sizeof(Part));
  found_buffer_.write(&header, sizeof header);
  block_buffer_.reserve(room * sizeof(Part));
  refined.states.assign(triangles.size(), {kNever, kNever});
  state_buffer_.write(refined.states.data(), refined.states.size() * sizeof(State));
  int sampled = 0, beyond = 0;  // levels down to the last sampled one, and below it
  for (const RefinedTriangle& t : triangles)
    sampled = std::max(sampled, int(t.sampled)),
    beyond = std::max(beyond, int(t.finest - t.sampled));
  run_passes(sampled + 1, beyond, room);
  glGetNamedBufferSubData(found_buffer_.get(), 0, sizeof header, &header);
  gl::check_context();
  if (header.overflow) return std::nullopt;
  refined.parts = first.size() + 4 * std::size_t(header.split);
  refined.found.resize(header.found);
  if (!refined.found.empty())
    glGetNamedBufferSubData(found_buffer_.get(), sizeof header,
                            GLsizeiptr(refined.found.size() * sizeof(Part)), refined.found.data());
  glGetNamedBufferSubData(state_buffer_.get(), 0, GLsizeiptr(refined.states.size() * sizeof(State)),
                          refined.states.data());
  gl::check_context();
  std::sort(refined.found.begin(), refined.found.end(), [](const Part& a, const Part& b) {
    return std::tuple(a.triangle, a.b, a.a) < std::tuple(b.triangle, b.b, b.a);
  });
  return refined;
}

// Runs the passes down to the blocks, samples the blocks, and refines what remains of them.
void GlContactPasses::run_passes(int to_blocks, int beyond, std::size_t room) {
  const auto dispatch = [&](const gl::GlProgram& program, int pass, std::size_t offset) {
    use(program);
    glProgramUniform1ui(program.get(), 2, GLuint(pass));
    glProgramUniform1ui(program.get(), 3, GLuint(room));
    part_buffers_[pass % 2].bind_storage(kPartsIn);
    part_buffers_[1 - pass % 2].bind_storage(kPartsOut);
    glDispatchComputeIndirect(GLintptr(offset));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT |
                    GL_BUFFER_UPDATE_BARRIER_BIT);
  };
  const auto parts_at = [](int pass) {
    return offsetof(Refinement, parts) + std::size_t(pass) * sizeof(Dispatch);
  };
  refine_timer_.begin();
  frame_camera_buffer_.bind_uniform(kFrameCameras);
  triangle_buffer_.bind_storage(kTriangles);
  refinement_buffer_.bind_storage(kRefinement);
  block_buffer_.bind_storage(kBlocks);
  found_buffer_.bind_storage(kFound);
  state_buffer_.bind_storage(kStates);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, refinement_buffer_.get());
  int pass = 0;
  for (; pass < to_blocks; ++pass) dispatch(refine_, pass, parts_at(pass));
  dispatch(sample_, pass, offsetof(Refinement, samples));
  dispatch(blocks_, pass, offsetof(Refinement, blocks));
  ++pass;
  for (const int end = pass + beyond; pass < end; ++pass) dispatch(refine_, pass, parts_at(pass));
  refine_timer_.end();
}

}  // namespace fivepipe::collision
