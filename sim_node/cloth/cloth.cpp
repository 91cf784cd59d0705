#include "sim_node/cloth/cloth.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::sim {
namespace {

// A point that a corner would have to move this many times as far for is held by the other corners,
// which are fixed. With equal masses a corner moves at most 1.21 times as far as the point.
constexpr double kMaxCornerMove = 2;

// The part of a displacement that the vertex can follow; the vertex must not be fixed.
Eigen::Vector3d followed(const ClothVertex& vertex, const Eigen::Vector3d& displacement) {
  const Eigen::Vector3d& slide = vertex.slides_along_world;
  if (slide.isZero(0)) return displacement;
  return slide.dot(displacement) * slide;
}

// The derivative of (F_u, F_v) * fibre by each corner of a triangle, a multiple of the identity
// [1/m]: that by corner 0 is minus the sum of the others.
std::array<double, 3> by_corner(const ClothTriangle& triangle, const Eigen::Vector2d& fibre) {
  const Eigen::Vector2d others = triangle.fibres_from_edges * fibre;
  return {-others.sum(), others.x(), others.y()};
}

}  // namespace

Cloth::Cloth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object,
             const config::ClothSettings& settings)
    : settings_(settings),
      model_(cloth_model(mesh, world_from_object, settings)),
      mesh_triangles_(mesh.triangles) {
  reset();
}

void Cloth::reset() {
  p_ = before_ = model_.start_world_m;
  v_.assign(p_.size(), Eigen::Vector3d::Zero());
}

void Cloth::step(double step_s, const Eigen::Vector3d& gravity_world_m_s2,
                 std::span<const ClothContact> contacts, double share, double max_speed_m_s) {
  assert(step_s > 0 && share >= 0 && share <= 1);
  std::vector<Placed> placed;
  for (const ClothContact& contact : contacts)
    placed.push_back({&contact, contact.normal_world.dot(point(contact).of(p_)), false});
  // A step that is a multiple of the substep must not become one substep more by rounding.
  const int substeps = std::max(1, int(std::ceil(step_s / kMaxClothSubstep_s - 1e-9)));
  for (int i = 1; i <= substeps; ++i)
    substep(step_s / substeps, gravity_world_m_s2, placed, share * i / substeps, max_speed_m_s);
}

bool Cloth::project(std::span<const ClothContact> contacts) {
  bool moved = false;
  for (const ClothContact& contact : contacts) moved |= place(contact, contact.offset_m);
  return moved;
}

void Cloth::substep(double substep_s, const Eigen::Vector3d& gravity_world_m_s2,
                    std::span<Placed> contacts, double progress, double max_speed_m_s) {
  const double kept = 1 / (1 + settings_.air_drag_1_s * substep_s);
  for (std::size_t i = 0; i < p_.size(); ++i) {
    before_[i] = p_[i];
    if (!(model_.vertices[i].inverse_mass_1_kg > 0)) continue;
    p_[i] +=
        followed(model_.vertices[i], kept * substep_s * (v_[i] + substep_s * gravity_world_m_s2));
  }
  for (const ClothTriangle& triangle : model_.triangles) project_triangle(triangle, substep_s);
  for (const ClothHinge& hinge : model_.hinges) project_hinge(hinge, substep_s);
  // The strain at the top of a strip that hangs by its own weight. The tethers keep a cloth that is
  // pulled harder, or hangs from few vertices, at this strain.
  const double hanging_strain = settings_.stretch_compliance_m_n * settings_.density_kg_m2 *
                                gravity_world_m_s2.norm() * model_.longest_tether_m;
  for (const ClothTether& tether : model_.tethers)
    project_tether(tether, (1 + hanging_strain) * tether.length_m);
  for (Placed& placed : contacts)
    placed.touches = place(*placed.contact,
                           placed.start_m + progress * (placed.contact->offset_m - placed.start_m));
  for (std::size_t i = 0; i < p_.size(); ++i) v_[i] = (p_[i] - before_[i]) / substep_s;
  for (const Placed& placed : contacts)
    if (placed.touches)
      slow(point(*placed.contact), placed.contact->normal_world,
           placed.contact->velocity_world_m_s);
  for (Eigen::Vector3d& v : v_)
    if (const double speed_m_s = v.norm(); speed_m_s > max_speed_m_s)
      v *= max_speed_m_s / speed_m_s;
}

// Equation 18 of XPBD with the multiplier 0 at the start of the iteration, and its damping,
// equation 26, with gamma = damping / substep for a damping that is proportional to the stiffness.
template <std::size_t N>
void Cloth::project(const std::array<std::uint32_t, N>& vertices,
                    const std::array<Eigen::Vector3d, N>& gradient, double value, double compliance,
                    double substep_s) {
  std::array<Eigen::Vector3d, N> move;
  double sum = 0, change = 0;
  for (std::size_t k = 0; k < N; ++k) {
    const ClothVertex& vertex = model_.vertices[vertices[k]];
    move[k] = vertex.inverse_mass_1_kg * followed(vertex, gradient[k]);
    sum += gradient[k].dot(move[k]);
    change += gradient[k].dot(p_[vertices[k]] - before_[vertices[k]]);
  }
  const double gamma = settings_.damping_s / substep_s;
  const double scale = (1 + gamma) * sum + compliance / (substep_s * substep_s);
  if (!(scale > 0)) return;  // no vertex can follow the gradient
  const double multiplier = -(value + gamma * change) / scale;
  for (std::size_t k = 0; k < N; ++k) p_[vertices[k]] += multiplier * move[k];
}

void Cloth::project_triangle(const ClothTriangle& triangle, double substep_s) {
  const std::array<std::uint32_t, 3>& v = triangle.vertices;
  Eigen::Matrix<double, 3, 2> edges, fibres;
  const auto set_fibres = [&] {
    edges << p_[v[1]] - p_[v[0]], p_[v[2]] - p_[v[0]];
    fibres = edges * triangle.fibres_from_edges;
  };
  for (int fibre = 0; fibre < 2; ++fibre) {
    set_fibres();
    const double length = fibres.col(fibre).norm();
    if (!(length > 0)) continue;
    const Eigen::Vector3d direction = fibres.col(fibre) / length;
    const std::array<double, 3> by = by_corner(triangle, Eigen::Vector2d::Unit(fibre));
    project(triangle.vertices,
            std::array<Eigen::Vector3d, 3>{by[0] * direction, by[1] * direction, by[2] * direction},
            length - 1,
            (length > 1 ? settings_.stretch_compliance_m_n : settings_.compression_compliance_m_n) /
                triangle.area_m2,
            substep_s);
  }
  set_fibres();
  const std::array<double, 3> by_u = by_corner(triangle, Eigen::Vector2d::UnitX()),
                              by_v = by_corner(triangle, Eigen::Vector2d::UnitY());
  std::array<Eigen::Vector3d, 3> gradient;
  for (std::size_t c = 0; c < 3; ++c)
    gradient[c] = by_u[c] * fibres.col(1) + by_v[c] * fibres.col(0);
  project(triangle.vertices, gradient, fibres.col(0).dot(fibres.col(1)),
          settings_.shear_compliance_m_n / triangle.area_m2, substep_s);
}

void Cloth::project_hinge(const ClothHinge& hinge, double substep_s) {
  std::array<Eigen::Vector3d, 4> p;
  for (std::size_t k = 0; k < 4; ++k) p[k] = p_[hinge.vertices[k]];
  if (const std::optional<Bend> now = bend(p))
    project(hinge.vertices, now->gradient_1_m, now->value - hinge.rest_bend,
            settings_.bending_compliance_1_nm * hinge.shape, substep_s);
}

void Cloth::project_tether(const ClothTether& tether, double longest_m) {
  const Eigen::Vector3d to_vertex = p_[tether.vertex] - p_[tether.pin];
  const double distance_m = to_vertex.norm();
  if (!(distance_m > longest_m)) return;
  p_[tether.vertex] +=
      followed(model_.vertices[tether.vertex], (longest_m / distance_m - 1) * to_vertex);
}

template <std::size_t N>
Eigen::Vector3d Cloth::Sum<N>::of(const std::vector<Eigen::Vector3d>& vectors) const {
  Eigen::Vector3d sum = weights[0] * vectors[vertices[0]];
  for (std::size_t k = 1; k < N; ++k) sum += weights[k] * vectors[vertices[k]];
  return sum;
}

Cloth::Sum<3> Cloth::point(const ClothContact& contact) const {
  const Eigen::Vector3d& w = contact.weights;
  return {mesh_triangles_[contact.triangle], {w.x(), w.y(), w.z()}};
}

Cloth::Sum<4> Cloth::offset(const ClothSelfTouch& touch) const {
  const auto& [a, b, c] = mesh_triangles_[touch.triangle];
  const Eigen::Vector3d& w = touch.weights;
  return {{touch.vertex, a, b, c}, {1, -w.x(), -w.y(), -w.z()}};
}

template <std::size_t N>
bool Cloth::push(const Sum<N>& sum, const Eigen::Vector3d& direction, double change,
                 std::span<std::vector<Eigen::Vector3d>* const> of) {
  std::array<Eigen::Vector3d, N> move;
  double moved = 0;
  for (std::size_t k = 0; k < N; ++k) {
    const ClothVertex& vertex = model_.vertices[sum.vertices[k]];
    move[k] = sum.weights[k] * vertex.inverse_mass_1_kg * followed(vertex, direction);
    moved += sum.weights[k] * direction.dot(move[k]);
  }
  if (!(moved > 0)) return false;  // the vertices are fixed, or slide across the direction only
  double largest = 0;
  for (const Eigen::Vector3d& of_vertex : move) largest = std::max(largest, of_vertex.norm());
  if (largest > kMaxCornerMove * moved) return false;  // fixed vertices hold the point
  for (std::size_t k = 0; k < N; ++k)
    for (std::vector<Eigen::Vector3d>* vectors : of)
      (*vectors)[sum.vertices[k]] += change / moved * move[k];
  return true;
}

bool Cloth::place(const ClothContact& contact, double offset_m) {
  const double missing_m = offset_m - contact.normal_world.dot(point(contact).of(p_));
  if (!(missing_m > 0)) return false;
  return push(point(contact), contact.normal_world, missing_m,
              std::array<std::vector<Eigen::Vector3d>*, 2>{&p_, &before_});
}

template <std::size_t N>
void Cloth::slow(const Sum<N>& sum, const Eigen::Vector3d& normal,
                 const Eigen::Vector3d& surface_m_s) {
  const std::array<std::vector<Eigen::Vector3d>*, 1> velocity = {&v_};
  const double approach_m_s = normal.dot(surface_m_s - sum.of(v_));
  if (!(approach_m_s > 0)) return;
  push(sum, normal, approach_m_s, velocity);
  const Eigen::Vector3d v = sum.of(v_) - surface_m_s, tangential = v - normal.dot(v) * normal;
  const double speed_m_s = tangential.norm();
  if (!(speed_m_s > 0)) return;
  push(sum, -tangential / speed_m_s, std::min(speed_m_s, settings_.friction * approach_m_s),
       velocity);
}

void Cloth::stop(const ClothVertexContact& contact) {
  const std::array<std::vector<Eigen::Vector3d>*, 1> position = {&p_};
  const Sum<1> vertex{{contact.vertex}, {1}};
  const Eigen::Vector3d& normal = contact.normal_world;
  push(vertex, normal, contact.missing_m, position);
  const Eigen::Vector3d along_m = contact.slid_world_m - normal.dot(contact.slid_world_m) * normal;
  if (const double way_m = along_m.norm(); way_m > 0)
    push(vertex, -along_m / way_m, std::min(way_m, settings_.friction * contact.missing_m),
         position);
  slow(vertex, normal, contact.velocity_world_m_s);
}

double Cloth::separate(std::span<const ClothSelfTouch> touches) {
  const std::array<std::vector<Eigen::Vector3d>*, 1> position = {&p_}, velocity = {&v_};
  double max_missing_m = 0;
  for (const ClothSelfTouch& touch : touches) {
    const Sum<4> apart = offset(touch);
    const Eigen::Vector3d& normal = touch.normal_world;
    const double missing_m = touch.distance_m - normal.dot(apart.of(p_));
    if (!(missing_m > 0) || !push(apart, normal, missing_m, position)) continue;
    max_missing_m = std::max(max_missing_m, missing_m);
    if (const double approach_m_s = -normal.dot(apart.of(v_)); approach_m_s > 0)
      push(apart, normal, approach_m_s, velocity);
  }
  return max_missing_m;
}

}  // namespace fivepipe::sim
