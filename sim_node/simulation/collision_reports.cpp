#include "sim_node/simulation/collision_reports.h"

#include "common/collision/response/coverage_border.h"

namespace fivepipe::sim {
namespace {

// Copies at most max_points of the points, evenly spread over them. The detector keeps its buffer.
std::vector<collision::CollisionPoint> subsample(std::span<const collision::CollisionPoint> points,
                                                 std::size_t max_points) {
  const std::size_t count = points.size();
  if (count <= max_points) return {points.begin(), points.end()};
  std::vector<collision::CollisionPoint> kept;
  kept.reserve(max_points);
  for (std::size_t i = 0; i < max_points; ++i) kept.push_back(points[i * count / max_points]);
  return kept;
}

// Sets the report's result to `found` with at most max_points points. Moves found's triangles.
void set_collision(CollisionReport& report, collision::ObjectCollision& found,
                   std::size_t max_points) {
  report.truncated = found.truncated || found.points.size() > max_points;
  report.collision = {.verdict = found.verdict,
                      .triangles = std::move(found.triangles),
                      .undecided = std::move(found.undecided),
                      .points = subsample(found.points, max_points),
                      .truncated = found.truncated,
                      .hull_in_box = found.hull_in_box};
}

// An object's collision with all points, from which its response is computed.
struct FullCollision {
  std::size_t report;
  collision::ObjectCollision collision;
  collision::DetectionObject object;
};

// Detects the reacting objects. Sets all reports except those that need every point, and returns
// the collisions of the latter.
std::vector<FullCollision> add_collisions(const ReportSources& from, std::size_t max_points,
                                          std::vector<CollisionReport>& reports) {
  std::vector<collision::DetectionObject> objects;
  for (const std::size_t object : from.models.reacting)
    objects.push_back(detection_object(from.models, from.bodies, object));
  const std::span<collision::ObjectCollision> collisions = from.hull.detect(objects);
  std::vector<FullCollision> full;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::size_t object = from.models.reacting[i];
    const config::SceneObject& in_scene = from.scene.objects[object];
    CollisionReport report{.object = object, .name = in_scene.name};
    std::optional<HullContact> contact = from.contact.take_contact(object);
    if (contact) report.response = std::move(contact->response);
    collision::ObjectCollision& collision = contact ? contact->collision : collisions[i];
    if (collision.colliding() && needs_points(in_scene.requests))
      full.push_back({i, std::move(collision), contact ? contact->object : objects[i]});
    else
      set_collision(report, collision, max_points);
    reports.push_back(std::move(report));
  }
  return full;
}

void add_proximity(const ReportSources& from, std::vector<CollisionReport>& reports) {
  for (CollisionReport& report : reports)
    if (const auto& requests = from.scene.objects[report.object].requests.proximity)
      report.details.proximity = from.proximity.field(*from.hull.query(), report.object, *requests);
}

void add_first_contacts(const ReportSources& from, std::vector<CollisionReport>& reports) {
  const HullHistory* history = from.hull.history();
  if (!history) return;
  for (CollisionReport& report : reports)
    if (from.scene.objects[report.object].requests.first_contact)
      report.details.first_contact =
          history->first_contact(report.object, from.models.objects[report.object].bvh,
                                 from.bodies.world_from_object(report.object));
}

}  // namespace

std::vector<CollisionReport> collision_reports(ReportSources sources, std::size_t max_points,
                                               bool is_new_hull) {
  std::vector<CollisionReport> reports;
  if (!sources.hull.query()) return reports;
  // This loop runs after the results have been read, because its requeries use the same detector,
  // which invalidates them.
  for (FullCollision& full : add_collisions(sources, max_points, reports)) {
    CollisionReport& report = reports[full.report];
    add_response(report.details, *sources.hull.query(), full.collision,
                 full.object.rp_object_world_m, sources.hull.requery(full.object),
                 sources.scene.objects[report.object].requests);
    if (report.details.response)
      collision::refine_by_coverage(*report.details.response, sources.hull.coverage(),
                                    sources.hull.query()->hull().rule());
    set_collision(report, full.collision, max_points);
  }
  add_proximity(sources, reports);
  if (is_new_hull) add_first_contacts(sources, reports);
  return reports;
}

}  // namespace fivepipe::sim
