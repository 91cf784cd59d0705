#include "sim_node/objects/rigid_bodies.h"

#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <btBulletDynamicsCommon.h>

#include <cassert>

namespace fivepipe::sim {
namespace {

// Friction coefficient of smooth wood on wood; the scene has no setting.
constexpr double kFriction = 0.5;
// Continuous collision detection: a body that moves more than this fraction of its smallest half
// extent per step is swept, so that it does not pass through a thin plate. It is swept as a sphere
// with half that extent as radius, well inside the body.
constexpr double kSweptFromExtents = 1.0, kSweptSphereExtents = 0.5;

// Bullet thickens meshes and convex hulls by a margin, by default 4 cm. Boxes and balls keep their
// size.
constexpr double kMeshMargin_m = 0.001;

btVector3 bt(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

btTransform bt(const Eigen::Isometry3d& b_from_a) {
  btTransform result;
  result.setFromOpenGLMatrix(b_from_a.data());  // 4x4, column-major
  return result;
}

Eigen::Isometry3d eigen(const btTransform& b_from_a) {
  Eigen::Isometry3d result;
  b_from_a.getOpenGLMatrix(result.data());
  return result;
}

// A body and the shapes that it refers to. Bullet places a body's origin at its centre of mass;
// object_from_body accounts for it.
struct Body {
  std::unique_ptr<btTriangleMesh> triangles;
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
  Eigen::Isometry3d object_from_body = Eigen::Isometry3d::Identity();
  btTransform start_world_from_body;
};

void make_shape(const config::SceneObject& object, Body& body) {
  if (const auto* box = std::get_if<config::BoxShape>(&object.shape)) {
    body.shape = std::make_unique<btBoxShape>(bt(0.5 * box->size_m));
    return;
  }
  if (const auto* sphere = std::get_if<config::SphereShape>(&object.shape)) {
    body.shape = std::make_unique<btSphereShape>(sphere->radius_m);
    return;
  }
  const geometry::Mesh mesh = config::mesh_of(object);
  body.object_from_body.translation() = geometry::bounds_m(mesh).center();
  if (object.motion == config::Motion::cloth) {
    body.shape = std::make_unique<btEmptyShape>();
    return;
  }
  const auto vertex = [&](std::size_t i) {
    return bt(Eigen::Vector3d(mesh.vertices_m[i] - body.object_from_body.translation()));
  };
  if (object.motion == config::Motion::fixed) {
    body.triangles = std::make_unique<btTriangleMesh>();
    for (const auto& [a, b, c] : mesh.triangles)
      body.triangles->addTriangle(vertex(a), vertex(b), vertex(c));
    body.shape = std::make_unique<btBvhTriangleMeshShape>(body.triangles.get(), true);
    body.shape->setMargin(kMeshMargin_m);
    return;
  }
  auto hull = std::make_unique<btConvexHullShape>();
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) hull->addPoint(vertex(i), false);
  hull->setMargin(kMeshMargin_m);
  hull->recalcLocalAabb();
  body.shape = std::move(hull);
}

Body body_of(const config::SceneObject& object) {
  Body body;
  make_shape(object, body);
  const bool dynamic = object.motion == config::Motion::dynamic;
  const double mass_kg = dynamic ? object.mass_kg : 0.0;  // Bullet: mass 0 is a static body
  body.start_world_from_body = bt(object.world_from_object * body.object_from_body);
  btRigidBody::btRigidBodyConstructionInfo info(mass_kg, nullptr, body.shape.get());
  if (dynamic) body.shape->calculateLocalInertia(mass_kg, info.m_localInertia);
  info.m_startWorldTransform = body.start_world_from_body;
  info.m_restitution = dynamic ? object.restitution : 1.0;  // Bullet multiplies both bodies' values
  info.m_friction = kFriction;
  body.body = std::make_unique<btRigidBody>(info);
  if (dynamic) {
    // A sleeping body would not react when the hull changes.
    body.body->setActivationState(DISABLE_DEACTIVATION);
    btVector3 low, high;
    body.shape->getAabb(btTransform::getIdentity(), low, high);
    const btVector3 half = 0.5 * (high - low);
    const double smallest_m = half[half.minAxis()];
    body.body->setCcdMotionThreshold(kSweptFromExtents * smallest_m);
    body.body->setCcdSweptSphereRadius(kSweptSphereExtents * smallest_m);
  }
  return body;
}

}  // namespace

struct RigidBodies::World {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<Body> bodies;

  ~World() {
    for (Body& body : bodies)
      if (body.body->isInWorld()) dynamics.removeRigidBody(body.body.get());
  }
};

RigidBodies::RigidBodies(const config::Scene& scene) : world_(std::make_unique<World>()) {
  world_->dynamics.setGravity({0, 0, -scene.gravity_m_s2});
  // By default Bullet sweeps no motion below 4 cm per step, whatever the body's threshold.
  world_->dynamics.getDispatchInfo().m_allowedCcdPenetration = 0;
  world_->bodies.reserve(scene.objects.size());
  for (const config::SceneObject& object : scene.objects) {
    world_->bodies.push_back(body_of(object));
    if (object.motion != config::Motion::cloth)
      world_->dynamics.addRigidBody(world_->bodies.back().body.get());
  }
}

RigidBodies::~RigidBodies() = default;
RigidBodies& RigidBodies::operator=(RigidBodies&&) noexcept = default;

void RigidBodies::step(double step_s) {
  assert(step_s > 0);
  world_->dynamics.stepSimulation(step_s, 0);  // 0: exactly one step, no substeps
}

Eigen::Isometry3d RigidBodies::world_from_object(std::size_t object) const {
  const Body& body = world_->bodies[object];
  return eigen(body.body->getWorldTransform()) * body.object_from_body.inverse();
}

Eigen::Vector3d RigidBodies::center_world_m(std::size_t object) const {
  return eigen(world_->bodies[object].body->getWorldTransform().getOrigin());
}
Eigen::Vector3d RigidBodies::velocity_m_s(std::size_t object) const {
  return eigen(world_->bodies[object].body->getLinearVelocity());
}

void RigidBodies::set_velocity_m_s(std::size_t object, const Eigen::Vector3d& velocity_world_m_s) {
  world_->bodies[object].body->setLinearVelocity(bt(velocity_world_m_s));
}

void RigidBodies::translate(std::size_t object, const Eigen::Vector3d& move_world_m) {
  btRigidBody& body = *world_->bodies[object].body;
  btTransform world_from_body = body.getWorldTransform();
  world_from_body.getOrigin() += bt(move_world_m);
  body.setWorldTransform(world_from_body);
}

void RigidBodies::respawn(std::size_t object) {
  btRigidBody& body = *world_->bodies[object].body;
  body.setWorldTransform(world_->bodies[object].start_world_from_body);
  for (const auto set : {&btRigidBody::setLinearVelocity, &btRigidBody::setAngularVelocity})
    (body.*set)({0, 0, 0});
}

}  // namespace fivepipe::sim
