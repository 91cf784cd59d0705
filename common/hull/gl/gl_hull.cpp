#include "common/hull/gl/gl_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/gl/gl_error.h"
#include "common/gl/shader_source.h"
#include "common/hull/gl/gl_hull_shaders.h"
#include "common/hull/gl/shaders_embedded.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {
namespace {

using namespace gl_hull;

// Bindings of the shaders' storage blocks. Both the preparation and the passes over a view use
// kDistances.
enum Binding {
  kBits = 0,
  kDistances = 1,
  kGrids = 2,
  kCandidates = 0,
  kStrips = 3,
  kTiles = 2,
  kWork = 3
};
static_assert(kMaxCameras == kMaxGlCameras);
// A side of the rule's box that is farther is none [m].
constexpr double kUnbounded_m = 1e30;
constexpr std::size_t kGroupsPerRow = 64;  // of the dispatch over tiles, as in work.glsl

int floor_to_multiple(int x, int of) { return x >= 0 ? x / of * of : -((-x + of - 1) / of * of); }

GLuint groups_of(std::size_t invocations) { return GLuint((invocations + kGroup - 1) / kGroup); }

struct QueryCamera {
  const Silhouette* silhouette;
  PixelRect bounds;  // of its object pixels
};

// Sorts the smallest object first, because it excludes most. The other keys make the order
// independent of the given one.
bool smaller_first(const QueryCamera& a, const QueryCamera& b) {
  const auto key = [](const QueryCamera& queried) {
    const geometry::Pinhole& k = queried.silhouette->camera.pinhole;
    const auto& m = queried.silhouette->camera.camera_from_world.matrix();
    std::array<double, 21> numbers{double(queried.bounds.area_px()), k.fx_px, k.fy_px, k.cx_px,
                                   k.cy_px};
    std::copy(m.data(), m.data() + m.size(), numbers.begin() + 5);
    return numbers;
  };
  const auto key_a = key(a), key_b = key(b);
  if (key_a != key_b) return key_a < key_b;
  return std::ranges::lexicographical_compare(a.silhouette->pixels.words(),
                                              b.silhouette->pixels.words());
}

// Copies the bits of the crop in rows of whole words. Pixels of the crop outside the image stay 0.
void copy_bits(const ObjectPixels& pixels, int u0_px, int v0_px, std::uint32_t words,
               std::uint32_t rows, std::uint32_t* to) {
  const int first = u0_px / 32, in_row = 2 * pixels.words_per_row();  // u0 is a multiple of 32
  for (int row = 0; row < int(rows); ++row, to += words) {
    const int v = v0_px + row;
    if (v < 0 || v >= pixels.height_px()) continue;
    const std::uint64_t* from = pixels.words().data() + std::size_t(v) * pixels.words_per_row();
    for (int i = std::max(0, -first); i < int(words) && first + i < in_row; ++i)
      to[i] = std::uint32_t(from[(first + i) / 2] >> (32 * ((first + i) % 2)));
  }
}

// Returns the program for this many cameras; compiles it when first needed.
template <class Programs>
const gl::GlProgram& program_for(Programs& programs, std::size_t cameras, const char* name,
                                 const char* source) {
  const auto found = std::find_if(programs.begin(), programs.end(),
                                  [&](const auto& p) { return cameras <= p.max_cameras; });
  if (!found->program)
    found->program = std::make_unique<gl::GlProgram>(
        name,
        gl::with_defines(source, "#define CAMERAS " + std::to_string(found->max_cameras) + "\n"));
  return *found->program;
}

}  // namespace

GlHull::GlHull()
    : cells_("hull: cells", kCellsComp),
      strips_("hull: strips", kStripsComp),
      distances_("hull: distances", kDistancesComp),
      tiles_("hull: tiles", kTilesComp),
      resolve_exact_("hull: resolve exact", kResolveExactComp) {
  for (const std::size_t max_cameras : {4, 16, 64}) {
    rays_.push_back({max_cameras, nullptr});
    seen_rays_.push_back({max_cameras, nullptr});
  }
  const Work none{};
  work_buffer_.write(&none, sizeof none);
}

void GlHull::set_silhouettes(std::span<const Silhouette> silhouettes, const HullRule& rule) {
  if (silhouettes.size() > kMaxGlCameras)
    throw std::invalid_argument("backend gl supports at most 64 cameras, not " +
                                std::to_string(silhouettes.size()));
  rule_ = rule;
  maps_.clear();
  bits_.clear();
  std::vector<QueryCamera> order;
  empty_ = silhouettes.empty();
  for (const Silhouette& s : silhouettes) {
    order.push_back({&s, s.pixels.bounds()});
    empty_ |= !is_finite(s.camera) || (rule.limits == Limits::all && order.back().bounds.empty());
  }
  if (empty_) return;
  std::sort(order.begin(), order.end(), smaller_first);
  for (const auto& [s, b] : order) {
    Map map{s->camera, floor_to_multiple(b.u0_px - kPad_px, 32), b.v0_px - kPad_px, {}};
    map.bounds = {b.u0_px - map.u0_px, b.v0_px - map.v0_px, b.u1_px - map.u0_px,
                  b.v1_px - map.v0_px};
    map.pixel_words = std::uint32_t(map.bounds.u1_px + kPad_px + 31) / 32;
    map.pixel_rows = std::uint32_t(map.bounds.v1_px + kPad_px);
    map.first_pixel_word = std::uint32_t(bits_.size());
    bits_.resize(bits_.size() + std::size_t(map.pixel_words) * map.pixel_rows);
    copy_bits(s->pixels, map.u0_px, map.v0_px, map.pixel_words, map.pixel_rows,
              bits_.data() + map.first_pixel_word);
    maps_.push_back(map);
  }
  words_ = bits_.size();
  for (Map& map : maps_) {
    map.cell_words = (map.pixel_words + kCell_px - 1) / kCell_px;
    map.cell_rows = (map.pixel_rows + kCell_px - 1) / kCell_px;
    map.first_cell_word = std::uint32_t(words_);
    words_ += std::size_t(map.cell_words) * map.cell_rows;
  }
  prepare();
}

void GlHull::prepare() {
  std::vector<Grid> grids;
  std::size_t max_cell_words = 0, all_strips = 0;
  for (const Map& m : maps_) {
    grids.push_back({m.first_pixel_word, m.pixel_words, m.pixel_rows, 0});
    grids.push_back({m.first_cell_word, m.cell_words, m.cell_rows, 0});
    max_cell_words = std::max(max_cell_words, std::size_t(m.cell_words) * m.cell_rows);
    for (const Grid& g : {grids.end()[-2], grids.end()[-1]})
      all_strips += std::size_t(g.words_per_row) * (32 / kStripWidth_px) *
                    ((g.rows + kStripHeight_px - 1) / kStripHeight_px);
  }
  GLint64 max_bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &max_bytes);
  if (words_ * 4 * sizeof(std::uint32_t) > std::size_t(max_bytes)) {
    empty_ = true;
    throw gl::GlError(
        "the object pixels need more memory than the driver's largest storage block, " +
        std::to_string(max_bytes) + " bytes");
  }
  bit_buffer_.reserve(words_ * sizeof(std::uint32_t));
  bit_buffer_.write(bits_.data(), bits_.size() * sizeof(std::uint32_t));
  distance_buffer_.reserve(words_ * 4 * sizeof(std::uint32_t));
  grid_buffer_.write(grids.data(), grids.size() * sizeof(Grid));
  const Strips none{{0, 1, 1}, 0};
  strip_buffer_.reserve(sizeof none + all_strips * 2 * sizeof(std::uint32_t));
  strip_buffer_.write(&none, sizeof none);
  bit_buffer_.bind_storage(kBits);
  distance_buffer_.bind_storage(kDistances);
  grid_buffer_.bind_storage(kGrids);
  strip_buffer_.bind_storage(kStrips);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, strip_buffer_.get());
  cells_.use();
  glDispatchCompute(groups_of(max_cell_words), GLuint(maps_.size()), 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  strips_.use();
  glDispatchCompute(groups_of(max_cell_words), GLuint(maps_.size()), 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
  distances_.use();
  glDispatchComputeIndirect(offsetof(Strips, groups));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

void GlHull::write_view(const View& view) {
  ViewBlock block;
  block.range_m[0] = view.near_m;
  block.range_m[1] = view.far_m;
  block.range_m[2] = rule_.min_seen;
  const ViewRays rays = view_rays(view.camera);
  Eigen::Vector3d::Map(block.eye_m) = rays.eye_world_m;
  Eigen::Vector3d::Map(block.column) = rays.direction_of_pixel.col(0);
  Eigen::Vector3d::Map(block.row) = rays.direction_of_pixel.col(1);
  Eigen::Vector3d::Map(block.constant) = rays.direction_of_pixel.col(2);
  // Shaders need not support infinity.
  Eigen::Vector3d::Map(block.box_min_m) = rule_.within_world_m.min().cwiseMax(-kUnbounded_m);
  Eigen::Vector3d::Map(block.box_max_m) = rule_.within_world_m.max().cwiseMin(kUnbounded_m);
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    const Map& m = maps_[i];
    const MapFromView map = map_from_view(m.camera, view.camera);
    Eigen::Matrix3d crop_from_map = Eigen::Matrix3d::Identity();
    crop_from_map(0, 2) = -m.u0_px;
    crop_from_map(1, 2) = -m.v0_px;
    ViewMap& to = block.maps[i];
    Eigen::Vector3d::Map(to.eye) = crop_from_map * map.at_eye;
    const Eigen::Matrix3d at_infinity = crop_from_map * map.at_infinity;
    Eigen::Vector3d::Map(to.column) = at_infinity.col(0);
    Eigen::Vector3d::Map(to.row) = at_infinity.col(1);
    Eigen::Vector3d::Map(to.constant) = at_infinity.col(2);
    Eigen::Vector4i::Map(to.bounds) << m.bounds.u0_px, m.bounds.v0_px, m.bounds.u1_px,
        m.bounds.v1_px;
    // Each word of bits has 32 columns and four words of distances.
    Eigen::Vector4i::Map(to.pixels) << int(4 * m.first_pixel_word), int(4 * m.pixel_words),
        int(m.pixel_rows), int(32 * m.pixel_words);
    Eigen::Vector4i::Map(to.cells) << int(4 * m.first_cell_word), int(4 * m.cell_words),
        int(m.cell_rows), int(32 * m.cell_words);
    const geometry::Pinhole& k = m.camera.pinhole;
    Eigen::Vector4i::Map(to.image) << -m.u0_px, -m.v0_px, k.width_px - m.u0_px,
        k.height_px - m.v0_px;
  }
  view_buffer_.reserve(sizeof block);
  view_buffer_.write(&block, offsetof(ViewBlock, maps) + maps_.size() * sizeof(ViewMap));
}

// Tiles are aligned in the view, not in a rect, so that a ray's arithmetic does not depend on how
// the view is divided into rects.
void GlHull::write_candidates(std::span<const PixelRect> rects) {
  std::vector<Candidate> candidates;
  std::size_t rays = 0;
  for (const PixelRect& r : rects) {
    rays += r.area_px();
    for (int v = r.v0_px / kTile_px * kTile_px; v < r.v1_px; v += kTile_px)
      for (int u = r.u0_px / kTile_px * kTile_px; u < r.u1_px; u += kTile_px) {
        const int first_u = std::max(r.u0_px - u, 0), last_u = std::min(r.u1_px - u, kTile_px) - 1;
        const int first_v = std::max(r.v0_px - v, 0), last_v = std::min(r.v1_px - v, kTile_px) - 1;
        candidates.push_back({std::uint32_t(u) | std::uint32_t(v) << 16,
                              std::uint32_t(first_u | last_u << 4 | first_v << 8 | last_v << 12)});
      }
  }
  candidates_ = candidates.size();
  candidate_buffer_.write(candidates.data(), candidates.size() * sizeof(Candidate));
  tile_buffer_.reserve(candidates.size() * sizeof(Tile));
  const Work work{{kGroupsPerRow, 0, 1}, 0, {0, 1, 1}, 0};
  work_buffer_.reserve(sizeof(Work) + rays * sizeof(std::uint32_t));
  work_buffer_.write(&work, sizeof work);
}

void GlHull::run(std::size_t cameras) {
  distance_buffer_.bind_storage(kDistances);
  view_buffer_.bind_uniform(0);
  candidate_buffer_.bind_storage(kCandidates);
  tile_buffer_.bind_storage(kTiles);
  work_buffer_.bind_storage(kWork);
  glBindImageTexture(0, depth_->get(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, work_buffer_.get());
  const bool seen = rule_.limits == Limits::seen;
  if (seen && !seen_tiles_)
    seen_tiles_ = std::make_unique<gl::GlProgram>("hull: seen tiles", kSeenTilesComp);
  const gl::GlProgram &tiles = seen ? *seen_tiles_ : tiles_,
                      &rays =
                          seen ? program_for(seen_rays_, cameras, "hull: seen rays", kSeenRaysComp)
                               : program_for(rays_, cameras, "hull: rays", kRaysComp);
  for (const GLuint program : {tiles.get(), rays.get(), resolve_exact_.get()})
    glProgramUniform1i(program, 0, GLint(cameras));
  glProgramUniform1ui(tiles.get(), 1, GLuint(candidates_));
  tiles.use();
  glDispatchCompute(groups_of(candidates_), 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
  rays.use();
  glDispatchComputeIndirect(offsetof(Work, tile_groups));
  if (!seen) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    resolve_exact_.use();
    glDispatchComputeIndirect(offsetof(Work, ray_groups));
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                  GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                  GL_FRAMEBUFFER_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

void GlHull::trace(const View& view, std::span<const PixelRect> rects) {
  const int width_px = view.camera.pinhole.width_px, height_px = view.camera.pinhole.height_px;
  if (width_px <= 0 || height_px <= 0 || width_px > kMaxViewSize_px || height_px > kMaxViewSize_px)
    throw std::invalid_argument("the view's image is empty or larger than 16000 px");
  for (const PixelRect& r : rects)
    if (!r.empty() && !(r == intersection(r, {0, 0, width_px, height_px})))
      throw std::invalid_argument("a rect extends beyond the view's image");
  if (!depth_ || depth_->width_px() != width_px || depth_->height_px() != height_px)
    depth_ = std::make_unique<gl::GlTexture>(width_px, height_px, GL_R32F);
  for (const PixelRect& r : rects)
    if (!r.empty())
      glClearTexSubImage(depth_->get(), 0, r.u0_px, r.v0_px, 0, r.width_px(), r.height_px(), 1,
                         GL_RED, GL_FLOAT, &kNoHull);
  const bool usable = is_finite(view.camera) && view.near_m > 0 && view.far_m > view.near_m &&
                      std::isfinite(view.far_m);
  const std::span<const PixelRect> queried =
      empty_ || !usable ? std::span<const PixelRect>() : rects;
  write_candidates(queried);
  if (candidates_ > 0) {
    write_view(view);
    run(maps_.size());
  }
}

const gl::GlTexture& GlHull::depth() const {
  if (!depth_) throw std::logic_error("there is no depth before the first GlHull::trace()");
  return *depth_;
}

DepthTile GlHull::read_back(const PixelRect& rect) const {
  DepthTile tile{rect, std::vector<float>(rect.area_px())};
  if (rect.empty()) return tile;
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glGetTextureSubImage(depth().get(), 0, rect.u0_px, rect.v0_px, 0, rect.width_px(),
                       rect.height_px(), 1, GL_RED, GL_FLOAT,
                       GLsizei(tile.depth_m.size() * sizeof(float)), tile.depth_m.data());
  gl::check_context();
  return tile;
}

std::vector<DepthTile> GlHull::depth(const View& view, std::span<const PixelRect> rects) {
  trace(view, rects);
  std::vector<DepthTile> tiles;
  for (const PixelRect& rect : rects) tiles.push_back(read_back(rect));
  return tiles;
}

GlHull::Counts GlHull::counts() const {
  Work work;
  glGetNamedBufferSubData(work_buffer_.get(), 0, sizeof work, &work);
  gl::check_context();
  return {candidates_, work.tiles, work.rays};
}

}  // namespace fivepipe::hull
