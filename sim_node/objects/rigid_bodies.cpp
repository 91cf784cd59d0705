#include "sim_node/objects/rigid_bodies.h"

#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace fivepipe::sim {
namespace {

// Continuous collision detection: a body that moves more than this fraction of its smallest half
// extent per step is swept, so that it does not pass through a thin plate. It is swept as a sphere
// with half that extent as radius, well inside the body.
constexpr double kSweptFromExtents = 1.0, kSweptSphereExtents = 0.5;

// Smallest cosine between the motion that a joint allows and a move out of the hull.
constexpr double kMinJointGain = 0.3;
// Torque against rolling, as a fraction of the normal force times the radius: that of hard rubber.
constexpr double kRollingResistance = 0.01;
// Iterations of the contact solver per step.
constexpr int kSolverIterations = 30;

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
  std::unique_ptr<btTypedConstraint> joint;  // null: the body moves freely
  Eigen::Isometry3d object_from_body = Eigen::Isometry3d::Identity();
  btTransform start_world_from_body;
  btVector3 start_velocity_m_s{0, 0, 0};
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
  info.m_friction = object.friction;
  if (const auto* ball = std::get_if<config::SphereShape>(&object.shape))
    info.m_rollingFriction = kRollingResistance * ball->radius_m;
  body.body = std::make_unique<btRigidBody>(info);
  if (dynamic) {
    body.start_velocity_m_s = bt(object.velocity_world_m_s);
    body.body->setLinearVelocity(body.start_velocity_m_s);
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

// Connects the body with the world. Bullet needs the joint to solve contacts with the right
// effective mass; hold_joint() makes it exact.
void add_joint(const config::Joint& joint, Body& body) {
  const Eigen::Isometry3d body_from_object = body.object_from_body.inverse();
  const Eigen::Vector3d axis = body_from_object.linear() * joint.axis;
  if (joint.kind == config::JointKind::hinge) {
    // Bullet turns about the z axis of both frames; at the start they agree.
    Eigen::Isometry3d body_from_hinge = Eigen::Isometry3d::Identity();
    body_from_hinge.linear() =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
    body_from_hinge.translation() = body_from_object * joint.point_m;
    auto hinge = std::make_unique<btHingeConstraint>(
        *body.body, btTypedConstraint::getFixedBody(), bt(body_from_hinge),
        body.start_world_from_body * bt(body_from_hinge));
    hinge->setLimit(joint.lowest, joint.highest);
    body.joint = std::move(hinge);
  } else {
    Eigen::Isometry3d body_from_slider = Eigen::Isometry3d::Identity();  // slides along its x axis
    body_from_slider.linear() =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), axis).toRotationMatrix();
    auto slider =
        std::make_unique<btGeneric6DofSpring2Constraint>(*body.body, bt(body_from_slider));
    slider->setLinearLowerLimit({joint.lowest, 0, 0});
    slider->setLinearUpperLimit({joint.highest, 0, 0});
    slider->setAngularLowerLimit({0, 0, 0});
    slider->setAngularUpperLimit({0, 0, 0});
    body.joint = std::move(slider);
  }
  const double damping = 1 - std::exp(-joint.damping_1_s);  // Bullet: loss of velocity per second
  body.body->setDamping(damping, damping);
}

// Returns the present distance of the bodies along a contact's normal [m]; negative if they
// overlap. Returns nullopt if a body has left the contact, by the test of
// btPersistentManifold::refreshContactPoints(), which would also change the contact.
std::optional<double> distance_m(const btPersistentManifold& manifold,
                                 const btManifoldPoint& point) {
  const btVector3 b_to_a_m = manifold.getBody0()->getWorldTransform() * point.m_localPointA -
                             manifold.getBody1()->getWorldTransform() * point.m_localPointB;
  const double distance = b_to_a_m.dot(point.m_normalWorldOnB);
  const double slid_m = (b_to_a_m - distance * point.m_normalWorldOnB).length();
  return slid_m <= manifold.getContactBreakingThreshold() ? std::optional(distance) : std::nullopt;
}

// A velocity that would leave the limits is removed.
double held_velocity(double position, double velocity, const config::Joint& joint) {
  if (position <= joint.lowest) return std::max(0.0, velocity);
  if (position >= joint.highest) return std::min(0.0, velocity);
  return velocity;
}

// Moves the body to the nearest pose that its joint allows, and removes the other velocities.
// Bullet's constraints are soft: they drift and overshoot.
void hold_joint(const Jointed& jointed, Body& body) {
  const double position =
      jointed.position(eigen(body.body->getWorldTransform()) * body.object_from_body.inverse());
  const Eigen::Isometry3d held = jointed.pose(position);
  const Eigen::Vector3d axis_world = jointed.axis_world();
  if (jointed.joint.kind == config::JointKind::hinge) {
    const double speed_rad_s = held_velocity(
        position, axis_world.dot(eigen(body.body->getAngularVelocity())), jointed.joint);
    body.body->setAngularVelocity(bt(Eigen::Vector3d(speed_rad_s * axis_world)));
    body.body->setLinearVelocity(bt(
        Eigen::Vector3d(speed_rad_s * jointed.rate(held * body.object_from_body.translation()))));
  } else {
    const double speed_m_s = held_velocity(
        position, axis_world.dot(eigen(body.body->getLinearVelocity())), jointed.joint);
    body.body->setAngularVelocity({0, 0, 0});
    body.body->setLinearVelocity(bt(Eigen::Vector3d(speed_m_s * axis_world)));
  }
  body.body->setWorldTransform(bt(held * body.object_from_body));
}

}  // namespace

struct RigidBodies::World {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<Body> bodies;
  std::map<std::size_t, Jointed> jointed;  // by body
  // The hull's surfaces, one per manifold of a step. Bullet reads their velocities. They have no
  // shape, so the manifolds are their only contacts.
  btEmptyShape no_shape;
  std::vector<std::unique_ptr<btRigidBody>> surfaces;

  btRigidBody& surface(std::size_t i);
  btPersistentManifold* add(const HullManifold& manifold, btRigidBody& surface);

  ~World() {
    for (const auto& [body, joint] : jointed) dynamics.removeConstraint(bodies[body].joint.get());
    for (const auto& surface : surfaces) dynamics.removeRigidBody(surface.get());
    for (Body& body : bodies)
      if (body.body->isInWorld()) dynamics.removeRigidBody(body.body.get());
  }
};

// Returns the i-th surface, which the world creates on the first call.
btRigidBody& RigidBodies::World::surface(std::size_t i) {
  while (surfaces.size() <= i) {
    auto& surface = surfaces.emplace_back(std::make_unique<btRigidBody>(0.0, nullptr, &no_shape));
    surface->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    dynamics.addRigidBody(surface.get(), 0, 0);  // in no group: the broad phase finds no pairs
    // Bullet computes the velocity of an awake kinematic body from its poses; these have none.
    surface->forceActivationState(ISLAND_SLEEPING);
  }
  return *surfaces[i];
}

btPersistentManifold* RigidBodies::World::add(const HullManifold& manifold, btRigidBody& surface) {
  const RigidVelocity& velocity = manifold.velocity;
  surface.setWorldTransform(btTransform(btQuaternion::getIdentity(), bt(velocity.center_world_m)));
  surface.setLinearVelocity(bt(velocity.velocity_world_m_s));
  surface.setAngularVelocity(bt(velocity.angular_velocity_world_rad_s));
  btRigidBody& body = *bodies[manifold.object].body;
  btPersistentManifold* const points = dispatcher.getNewManifold(&body, &surface);
  assert(manifold.points.size() <= kMaxHullContacts);
  for (const HullContactPoint& point : manifold.points) {
    const btVector3 on_body = bt(point.on_object_world_m), normal = bt(point.normal_world),
                    on_hull = on_body - point.distance_m * normal;
    btManifoldPoint added(body.getWorldTransform().invXform(on_body),
                          surface.getWorldTransform().invXform(on_hull), normal,
                          std::max(0.0, point.distance_m));
    added.m_positionWorldOnA = on_body;
    added.m_positionWorldOnB = on_hull;
    added.m_combinedFriction = body.getFriction();
    added.m_combinedRollingFriction = body.getRollingFriction();
    added.m_combinedRestitution = point.restitution;
    added.m_appliedImpulse = point.impulse_n_s;
    points->addManifoldPoint(added);
  }
  return points;
}

RigidBodies::RigidBodies(const config::Scene& scene) : world_(std::make_unique<World>()) {
  world_->dynamics.setGravity({0, 0, -scene.gravity_m_s2});
  // By default Bullet sweeps no motion below 4 cm per step, whatever the body's threshold.
  world_->dynamics.getDispatchInfo().m_allowedCcdPenetration = 0;
  btContactSolverInfo& solver = world_->dynamics.getSolverInfo();
  // Friction in all directions; by default only along the velocity, so that a body at rest creeps.
  solver.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  solver.m_restitutionVelocityThreshold = kMinBounce_m_s;
  // With Bullet's default of 10, a stack of five blocks creeps twice as far.
  solver.m_numIterations = kSolverIterations;
  world_->bodies.reserve(scene.objects.size());
  for (const config::SceneObject& object : scene.objects) {
    world_->bodies.push_back(body_of(object));
    Body& body = world_->bodies.back();
    if (object.motion != config::Motion::cloth) world_->dynamics.addRigidBody(body.body.get());
    if (!object.joint) continue;
    add_joint(*object.joint, body);
    world_->dynamics.addConstraint(body.joint.get());
    world_->jointed[world_->bodies.size() - 1] = {*object.joint, object.world_from_object};
  }
}

RigidBodies::~RigidBodies() = default;
RigidBodies& RigidBodies::operator=(RigidBodies&&) noexcept = default;

void RigidBodies::step(double step_s, std::span<HullManifold> manifolds) {
  assert(step_s > 0);
  std::vector<btPersistentManifold*> added;
  for (std::size_t i = 0; i < manifolds.size(); ++i)
    added.push_back(world_->add(manifolds[i], world_->surface(i)));
  world_->dynamics.stepSimulation(step_s, 0);  // 0: exactly one step, no substeps
  for (const auto& [body, joint] : world_->jointed) hold_joint(joint, world_->bodies[body]);
  for (std::size_t i = manifolds.size(); i-- > 0;) {
    for (std::size_t k = 0; k < manifolds[i].points.size(); ++k)
      manifolds[i].points[k].impulse_n_s = added[i]->getContactPoint(int(k)).m_appliedImpulse;
    world_->dispatcher.releaseManifold(added[i]);
  }
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

Eigen::Vector3d RigidBodies::velocity_m_s(std::size_t object,
                                          const Eigen::Vector3d& p_world_m) const {
  const btRigidBody& body = *world_->bodies[object].body;
  return eigen(body.getVelocityInLocalPoint(bt(p_world_m) - body.getWorldTransform().getOrigin()));
}

double RigidBodies::kinetic_energy_j(std::size_t object) const {
  const btRigidBody& body = *world_->bodies[object].body;
  if (!(body.getInvMass() > 0)) return 0;
  const btVector3 turn_body_rad_s =
      body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
  return 0.5 * (body.getLinearVelocity().length2() / body.getInvMass() +
                turn_body_rad_s.dot(body.getLocalInertia() * turn_body_rad_s));
}

BodyContacts RigidBodies::contacts() const {
  double deepest_m = 0;
  std::set<std::pair<const void*, const void*>> pairs;
  for (int i = 0; i < world_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *world_->dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      const auto distance = distance_m(manifold, point);
      if (!distance || (*distance > 0 && !(point.m_appliedImpulse > 0))) continue;
      pairs.insert(std::minmax<const void*>(manifold.getBody0(), manifold.getBody1()));
      deepest_m = std::max(deepest_m, -*distance);
    }
  }
  return {pairs.size(), deepest_m};
}

double RigidBodies::overlap_m(std::size_t a, std::size_t b) const {
  struct Deepest : btCollisionWorld::ContactResultCallback {
    double depth_m = 0;
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      depth_m = std::max(depth_m, -point.getDistance());
      return 0;  // without a meaning
    }
  };
  Deepest deepest;
  const auto thickness_m = [&](std::size_t object) {
    const btCollisionShape& shape = *world_->bodies[object].shape;
    return shape.isConcave() || shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE ? kMeshMargin_m
                                                                                    : 0.0;
  };
  world_->dynamics.contactPairTest(world_->bodies[a].body.get(), world_->bodies[b].body.get(),
                                   deepest);
  return std::max(0.0, deepest.depth_m - thickness_m(a) - thickness_m(b));
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

Eigen::Vector3d RigidBodies::move_out(std::size_t object, const Eigen::Vector3d& p_world_m,
                                      const Eigen::Vector3d& move_world_m) {
  const auto found = world_->jointed.find(object);
  if (found == world_->jointed.end()) {
    translate(object, move_world_m);
    return move_world_m;
  }
  const Jointed& jointed = found->second;
  Body& body = world_->bodies[object];
  // The joint moves p along the direction of the move by its length.
  const Eigen::Vector3d rate = jointed.rate(p_world_m);
  const double gain = rate.dot(move_world_m.normalized());
  if (!(std::abs(gain) > kMinJointGain * std::max(rate.norm(), kMinJointLever_m)))
    return Eigen::Vector3d::Zero();  // the joint does not move it there
  const Eigen::Isometry3d now = world_from_object(object);
  const double position = jointed.position(now) + move_world_m.norm() / gain,
               allowed = std::clamp(position, jointed.joint.lowest, jointed.joint.highest);
  const Eigen::Isometry3d moved = jointed.pose(allowed);
  body.body->setWorldTransform(bt(moved * body.object_from_body));
  return moved * (now.inverse() * p_world_m) - p_world_m;
}

void RigidBodies::respawn(std::size_t object) {
  btRigidBody& body = *world_->bodies[object].body;
  body.setWorldTransform(world_->bodies[object].start_world_from_body);
  body.setLinearVelocity(world_->bodies[object].start_velocity_m_s);
  body.setAngularVelocity({0, 0, 0});
}

}  // namespace fivepipe::sim
