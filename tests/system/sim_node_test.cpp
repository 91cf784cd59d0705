// Drives a real sim_node by crafted messages. Compares its verdicts with the exact reference, and
// its states with a simulation of the same frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "common/collision/oracle/triangle_reference.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/node/status_names.h"
#include "sim_node/simulation/simulation.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/sanitizer.h"
#include "tests/support/scripted/capture.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

struct Collision {
  std::string object;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, source_stamp_ns;
  fivepipe_v1_CollisionVerdict verdict;
  std::uint32_t triangles_colliding;
  std::vector<Eigen::Vector3d> points_m;
  std::vector<fivepipe_v1_FirstContact> first_contacts;
  std::size_t triangles;
};
Collision copied(const bus::Sample<bus::topics::CollisionResult>& sample) {
  const auto contacts = messages::span_of(sample->first_contact);
  Collision collision{sample->object,
                      sample->frame,
                      sample->capture_stamp_ns,
                      sample.source_stamp_ns(),
                      sample->verdict,
                      sample->triangles_colliding,
                      {},
                      {contacts.begin(), contacts.end()},
                      sample->triangles._length};
  for (const fivepipe_v1_Vec3& p : messages::span_of(sample->points_m))
    collision.points_m.push_back(messages::from_wire(p));
  return collision;
}

struct State {
  std::string simulation;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, source_stamp_ns;
  double time_s;
  std::map<std::string, Eigen::Isometry3d> world_from_object;
};
State copied_state(const bus::Sample<bus::topics::VirtualState>& sample) {
  State state{sample->simulation,        sample->frame,
              sample->capture_stamp_ns,  sample.source_stamp_ns(),
              sample->simulation_time_s, {}};
  for (const auto& object : messages::span_of(sample->objects))
    state.world_from_object[object.object] = messages::from_wire(object.world_from_object).value();
  return state;
}

struct Components {
  std::string simulation;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  std::vector<Eigen::Vector3d> centroids_m;
};
Components copied_components(const bus::Sample<bus::topics::HullComponents>& sample) {
  Components components{sample->simulation, sample->frame, sample->capture_stamp_ns, {}};
  for (const auto& component : messages::span_of(sample->components))
    components.centroids_m.push_back(messages::from_wire(component.centroid_m));
  return components;
}

// The top of the real ball enters `above` in some frames. `inside` always collides, `beside` never.
// Only `above` requests its triangles.
const std::string kScene = R"(
name: boxes
objects:
  - {name: inside, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, 0, 0.02]}
  - {name: above, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, 0.02, 0.18],
     report: {triangles: true}}
  - {name: scenery, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, 0, 0], reaction: none}
  - {name: beside, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0.3, 0, 0]}
  - {name: faller, sphere: {radius_m: 0.02}, position_m: [0.3, 0.3, 5], motion: dynamic,
     reaction: none}
)";

class SimNode : public ScriptedCapture {
 protected:
  bus::Writer<bus::topics::Command> commands_ = bus_.writer<bus::topics::Command>();
  Collected<bus::topics::CollisionResult, Collision> collisions_{bus_, copied};
  Collected<bus::topics::VirtualState, State> states_{bus_, copied_state};
  Collected<bus::topics::HullComponents, Components> components_{bus_, copied_components};

  // deployment: further keys of the deployment. nodes: its other nodes.
  void start_with(const std::string& scene, const std::string& options = "",
                  const std::string& deployment = "", const std::string& nodes = "") {
    const std::string path = three_cameras(
        scene, "  - {name: simulation, program: sim_node" + options + "}\n" + nodes, deployment);
    start("sim_node", "simulation", path);
    wait_for_readers(infos_, maps_, commands_);
    take();
  }
  void take() {
    collisions_.take();
    states_.take();
    components_.take();
  }
  bool has_states(std::size_t count) {
    return holds([&] {
      take();
      return states_.all().size() >= count;
    });
  }
  // Sends the frame and waits until the node has handled it.
  void simulate(std::uint64_t frame, std::int64_t later_ns = 0) {
    const std::size_t traced = traces().size();
    send_maps(frame, later_ns);
    ASSERT_TRUE(holds([&] {
      take();
      return traces().size() > traced;
    })) << said();
    ASSERT_TRUE(holds([&] {
      take();
      return std::any_of(states_.all().begin(), states_.all().end(), [&](const State& state) {
        return state.frame == frame && state.capture_stamp_ns == stamp_of(frame) + later_ns;
      });
    })) << said();
  }
  void command(fivepipe_v1_CommandKind kind, const std::string& target = "") {
    fivepipe_v1_Command command{};
    messages::set_text(command.target, target);
    command.kind = kind;
    deliver(commands_, command);
  }
  // The simulation that the node must match bit by bit.
  std::unique_ptr<sim::Simulation> same_simulation() const {
    return std::make_unique<sim::Simulation>(
        deployment_.scene, std::get<config::SimConfig>(deployment_.nodes[0].config),
        deployment_.rig.volume_m);
  }
  static void expect_same(const State& state, const sim::Simulation& expected) {
    EXPECT_EQ(state.time_s, expected.time_s());
    for (const sim::ObjectState& object : expected.states())
      if (const auto found = state.world_from_object.find(object.name);
          found != state.world_from_object.end()) {
        EXPECT_EQ(found->second.translation(), object.world_from_object.translation());
        // The wire has a quaternion.
        EXPECT_TRUE(found->second.isApprox(object.world_from_object, 1e-12));
      }
  }
  std::vector<Collision> collisions_of(std::uint64_t frame) const {
    std::vector<Collision> found;
    for (const Collision& collision : collisions_.all())
      if (collision.frame == frame) found.push_back(collision);
    return found;
  }
};

// The triangles of the object that the hull crosses, according to the exact reference.
std::vector<collision::TriangleTruth> truth_of(const config::SceneObject& object,
                                               const collision::HullDistance& hull) {
  std::vector<collision::TriangleTruth> truth;
  const geometry::Mesh mesh = config::mesh_of(object);
  for (const auto& triangle : mesh.triangles) {
    collision::Triangle corners_world_m;
    for (int i = 0; i < 3; ++i)
      corners_world_m[std::size_t(i)] =
          object.world_from_object * mesh.vertices_m[std::size_t(triangle[i])];
    truth.push_back(collision::triangle_truth(hull, corners_world_m));
  }
  return truth;
}

class SimNodeBackend : public SimNode, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Collision, SimNodeBackend, testing::Values("cpu", "gl"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(SimNodeBackend, PublishesTheCollisionsOfEachFrameBeforeItsState) {
  start_with(kScene, ", collision: " + std::string(GetParam()));
  constexpr std::uint64_t kFrames = 6;
  std::map<std::string, NodeReport::Collisions> totals;
  std::set<bool> above;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    simulate(frame);
    const std::vector<hull::Silhouette> silhouettes = silhouettes_of(frame);
    const collision::HullDistance hull(silhouettes);
    const std::vector<Collision> found = collisions_of(frame);
    const std::vector<std::string> reacting{"inside", "above", "beside"};
    // On a busy machine the clock repeats them against the same hull.
    ASSERT_GE(found.size(), reacting.size());
    ASSERT_EQ(found.size() % reacting.size(), 0u);
    for (const config::SceneObject& object : deployment_.scene.objects) {
      if (object.reaction == config::Reaction::none) continue;
      SCOPED_TRACE(object.name + " in frame " + std::to_string(frame));
      const auto collision = std::find_if(found.begin(), found.end(), [&](const Collision& one) {
        return one.object == object.name;
      });
      ASSERT_NE(collision, found.end());
      EXPECT_EQ(collision->capture_stamp_ns, stamp_of(frame));
      // Above eps_m a part is found for certain; the tests' frames have no thinner one.
      std::uint32_t crossing = 0;
      for (const collision::TriangleTruth& truth : truth_of(object, hull)) {
        ASSERT_TRUE(!truth.crosses || truth.deepest_m > 0.5e-3) << truth.deepest_m;
        crossing += truth.crosses;
      }
      EXPECT_EQ(collision->verdict, crossing ? fivepipe_v1_colliding : fivepipe_v1_free);
      EXPECT_EQ(collision->triangles_colliding, crossing);
      EXPECT_EQ(collision->triangles, object.name == "above" ? crossing : 0);
      EXPECT_EQ(collision->points_m.empty(), crossing == 0);
      for (const Eigen::Vector3d& p_m : collision->points_m) {
        EXPECT_GE(hull.signed_m(p_m), 0);
        const Eigen::Vector3d local_m = object.world_from_object.inverse() * p_m;
        EXPECT_NEAR(local_m.cwiseAbs().maxCoeff(), 0.05, 1e-9);
      }
      if (crossing) {
        ++totals[object.name].frames;
        totals[object.name].points += collision->points_m.size();
      }
      if (object.name == "above") above.insert(crossing > 0);
    }
    const State& state = states_.all().back();
    ASSERT_EQ(state.frame, frame);
    EXPECT_EQ(state.simulation, "simulation");
    EXPECT_EQ(state.capture_stamp_ns, stamp_of(frame));
    for (const Collision& collision : found)
      EXPECT_LT(collision.source_stamp_ns, state.source_stamp_ns);
  }
  EXPECT_EQ(above, (std::set<bool>{false, true})) << "frames with and without collision";
  const NodeReport report = ended();
  EXPECT_EQ(report.collisions, totals);
  EXPECT_EQ(report.counts.at(node::kFrameSetsComplete), kFrames);
  EXPECT_TRUE(report.drops.empty());
  EXPECT_EQ(report.gl_renderer.empty(), GetParam() == std::string("cpu"));
  EXPECT_TRUE(components_.all().empty()) << "the scene requests no history";
}

// Camera `front` sees neither the box nor the part of the ball around it.
struct SimNodeBesideTheBall : SimNode {
  std::vector<hull::Capsule> ball_of(std::uint64_t) const override {
    return {{{0.38, 0, 0}, {0.38, 0.05, 0}, 0.06}};
  }
  const std::string scene = R"(
name: beside
history: {cell_m: 0.01}
objects: [{name: box, box: {size_m: [0.02, 0.02, 0.02]}, position_m: [0.387, 0, 0]}]
)";
};

TEST_F(SimNodeBesideTheBall, UsesTheHullRuleOfTheDeployment) {
  start_with(scene, "", "hull: {limits: seen, min_seen: 2}\n");
  simulate(0);
  ASSERT_FALSE(collisions_of(0).empty());
  const Collision collision = collisions_of(0).front();
  EXPECT_EQ(collision.verdict, fivepipe_v1_colliding);
  for (const Eigen::Vector3d& p_m : collision.points_m)
    EXPECT_TRUE(hull::in_hull(silhouettes_of(0), p_m, deployment_.hull_rule));
  ASSERT_TRUE(holds([&] {
    take();
    return !components_.all().empty();
  }));
  ASSERT_EQ(components_.all().front().centroids_m.size(), 1u);
  EXPECT_GT(components_.all().front().centroids_m[0].x(), 0.355);
}

TEST_F(SimNodeBesideTheBall, EveryCameraLimitsTheHullByDefault) {
  start_with(scene);
  simulate(0);
  ASSERT_FALSE(collisions_of(0).empty());
  EXPECT_EQ(collisions_of(0).front().verdict, fivepipe_v1_free);
}

// Its capture_node decides whether the simulation goes on without a camera that sends nothing.
TEST_F(SimNode, GoesOnWithoutALostCamera) {
  start_with(kScene, "", "",
             "  - {name: capture, program: capture_node, sources: synthetic, lost_camera: "
             "continue}\n");
  simulate(0);
  constexpr std::uint64_t kLost = frames::FrameSetAssembler::kLostAfterFrames;
  for (std::uint64_t frame = 1; frame < kLost; ++frame) {
    send_maps(frame, 0, "side");
    if (frame % 5 == 0) {
      ASSERT_TRUE(reports_again()) << said();  // a reader holds 8
    }
  }
  send_maps(kLost, 0, "side");
  EXPECT_TRUE(holds([&] {
    take();
    return std::any_of(states_.all().begin(), states_.all().end(), [&](const State& state) {
      return state.frame == kLost && state.capture_stamp_ns == stamp_of(kLost);
    });
  })) << said();
}

TEST_F(SimNode, TimeIsThatOfTheCaptures) {
  start_with(kScene);
  begin_replay(true);
  const auto expected = same_simulation();
  std::map<std::uint64_t, std::vector<hull::Silhouette>> silhouettes;
  for (const std::uint64_t frame : {3, 4, 6, 9}) {
    simulate(frame);
    silhouettes[frame] = silhouettes_of(frame);
    expected->advance_to(1e-9 * double(stamp_of(frame) - stamp_of(3)), silhouettes[frame]);
    expect_same(states_.all().back(), *expected);
    // Free fall by steps of 1/240 s from 5 m: z = 5 - g t (t + step) / 2.
    const double t_s = states_.all().back().time_s;
    EXPECT_NEAR(t_s, 0.033 * double(frame - 3), 1.0 / 240);
    EXPECT_NEAR(states_.all().back().world_from_object.at("faller").translation().z(),
                5 - 9.80665 * t_s * (t_s + 1.0 / 240) / 2, 1e-3);
  }
  EXPECT_EQ(states_.all().size(), 4u) << "one per frame in a lossless replay";
  for (const State& state : states_.all())
    EXPECT_EQ(state.world_from_object.size(), 1u) << "fixed objects are as in the scene";
}

struct Metrics {
  std::uint64_t frame;
  std::int64_t source_stamp_ns;
  std::vector<fivepipe_v1_BodyMetrics> bodies;
  std::size_t others;
};
Metrics copied_metrics(const bus::Sample<bus::topics::SimulationMetrics>& sample) {
  const auto bodies = messages::span_of(sample->bodies);
  return {sample->frame,
          sample.source_stamp_ns(),
          {bodies.begin(), bodies.end()},
          sample->cloths._length + sample->particles._length};
}

class SimNodeMetrics : public SimNode {
 protected:
  Collected<bus::topics::SimulationMetrics, Metrics> metrics_{bus_, copied_metrics};
};

TEST_F(SimNodeMetrics, ArePublishedAfterTheStateOfEachFrame) {
  start_with(kScene);
  begin_replay(true);
  for (const std::uint64_t frame : {0, 3, 9}) {
    simulate(frame);
    ASSERT_TRUE(holds([&] {
      metrics_.take();
      return !metrics_.all().empty() && metrics_.all().back().frame == frame;
    })) << said();
    const Metrics& newest = metrics_.all().back();
    ASSERT_EQ(newest.bodies.size(), 1u) << "the faller";
    EXPECT_EQ(newest.others, 0u);
    EXPECT_EQ(newest.bodies[0].bodies, 1u);
    const State& state = states_.all().back();
    EXPECT_GT(newest.source_stamp_ns, state.source_stamp_ns);
    const double speed_m_s = 9.80665 * state.time_s;
    EXPECT_NEAR(newest.bodies[0].kinetic_j, 0.5 * speed_m_s * speed_m_s, 1e-6);
    EXPECT_NEAR(newest.bodies[0].potential_j,
                9.80665 * state.world_from_object.at("faller").translation().z(), 1e-6);
  }
  EXPECT_EQ(metrics_.all().size(), 3u);
}

TEST_F(SimNode, PublishesNoMetricsWithoutAReader) {
  start_with(kScene);
  for (const std::uint64_t frame : {0, 1, 2}) simulate(frame);
  EXPECT_EQ(ended().sent.at(bus::topics::SimulationMetrics::name), 0u);
}

TEST_F(SimNodeMetrics, AreAbsentWithoutAnObjectThatMoves) {
  start_with(
      "name: still\nobjects:\n  - {name: box, box: {size_m: [1, 1, 1]}, "
      "position_m: [0, 0, 0]}\n");
  simulate(0);
  EXPECT_EQ(metrics_.writers(), 0);
  EXPECT_FALSE(ended().sent.contains(bus::topics::SimulationMetrics::name));
}

TEST_F(SimNode, ReportsTheTimesOfEachFrame) {
  start_with(kScene);
  for (const std::uint64_t frame : {2, 5}) {
    const std::int64_t sent_ns = base::now_realtime_ns();
    simulate(frame);
    const TracedFrame& trace = traces().back();
    EXPECT_EQ(trace.node, "simulation");
    EXPECT_EQ(trace.frame, frame);
    EXPECT_EQ(trace.capture_stamp_ns, stamp_of(frame));
    ASSERT_EQ(trace.steps.size(), 2u);
    EXPECT_EQ(trace.steps[0].name, "simulate");
    EXPECT_EQ(trace.steps[1].name, "write_state");
    const auto state = std::find_if(states_.all().begin(), states_.all().end(),
                                    [&](const State& one) { return one.frame == frame; });
    const std::vector<std::int64_t> times{sent_ns,
                                          trace.first_input_ns,
                                          trace.last_input_ns,
                                          trace.steps[0].start_ns,
                                          trace.steps[0].end_ns,
                                          trace.steps[1].start_ns,
                                          state->source_stamp_ns,
                                          trace.steps[1].end_ns,
                                          base::now_realtime_ns()};
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end())) << testing::PrintToString(times);
  }
  const NodeReport report = ended();
  EXPECT_EQ(report.frame, 5u);
  EXPECT_EQ(report.latencies.at("simulate").count, 2u);
  EXPECT_EQ(report.latencies.at("write_state").count, 2u);
}

// A quarter of a second to catch up takes longer than the two seconds in which the node must end:
// 2,500 steps with a cloth of 5,000 triangles.
TEST_F(SimNode, EndsInTimeWhileItCatchesUp) {
  start_with(R"(
name: slow
objects:
  - {name: cloth, curtain: {width_m: 1, height_m: 1, columns: 50, rows: 50}, position_m: [2, 0, 1],
     motion: cloth, cloth: {pins: [{from_m: [-1, -1, -0.001], to_m: [1, 1, 0.001]}]}}
)",
             ", step_s: 0.0001");
  simulate(0);
  send_maps(1, 250'000'000);
  std::this_thread::sleep_for(300ms);  // it has begun
  const auto start = std::chrono::steady_clock::now();
  ended();
  EXPECT_LT(std::chrono::steady_clock::now() - start, 2s * kSlowdown);
  EXPECT_EQ(traces().size(), 1u) << "it had caught up already";
}

// Without frame sets for 100 ms, the simulation continues against the last hull until that is 1 s
// old.
TEST_F(SimNode, ContinuesByTheClockForASecond) {
  start_with(kScene);
  simulate(0);
  simulate(1);
  // The clock may have advanced the state of frame 1 already.
  const auto of_frame_1 = std::find_if(states_.all().begin(), states_.all().end(),
                                       [](const State& state) { return state.frame == 1; });
  ASSERT_NE(of_frame_1, states_.all().end());
  const State last = *of_frame_1;
  const std::size_t first = std::size_t(of_frame_1 - states_.all().begin()) + 1;
  ASSERT_TRUE(holds([&] {
    take();
    return states_.all().back().time_s > 0.8;
  })) << said();
  // Two more statuses are at least half a second apart.
  ASSERT_TRUE(reports_again(2));
  take();
  ASSERT_GT(states_.all().size(), first + 3);
  double before_s = last.time_s, before_z_m = 10;
  for (std::size_t i = first; i < states_.all().size(); ++i) {
    const State& state = states_.all()[i];
    EXPECT_EQ(state.frame, 1u);
    EXPECT_EQ(state.capture_stamp_ns, stamp_of(1));
    EXPECT_GT(state.time_s, before_s);
    const double z_m = state.world_from_object.at("faller").translation().z();
    EXPECT_LT(z_m, before_z_m);
    before_s = state.time_s;
    before_z_m = z_m;
  }
  EXPECT_GE(states_.all()[first].time_s, 0.033 + 0.1 - 1.0 / 240);
  EXPECT_LE(before_s, 0.033 + 1);
  EXPECT_EQ(collisions_of(1).size(), 3 * (states_.all().size() - first + 1));
  const NodeReport report = ended();
  // On a busy machine the clock also advances frame 0.
  EXPECT_EQ(report.latencies.at("simulate_held_hull").count, states_.all().size() - 2);
  EXPECT_EQ(report.latencies.at("simulate").count, 2u);
  // The totals of collisions count frames, not the clock's steps.
  EXPECT_EQ(report.collisions.at("inside").frames, 2u);
}

TEST_F(SimNode, ALosslessReplayAdvancesByItsFramesAlone) {
  start_with(kScene);
  begin_replay(true);
  simulate(0);
  ASSERT_TRUE(reports_again(2));  // half a second
  take();
  EXPECT_EQ(states_.all().size(), 1u);
  end_replay();
  ASSERT_TRUE(reports_again(2));
  take();
  EXPECT_EQ(states_.all().size(), 1u) << "against the replay's last hull";
}

TEST_F(SimNode, ExecutesItsCommandsBeforeTheNextFrame) {
  start_with(kScene);
  begin_replay(true);
  const auto expected = same_simulation();
  std::vector<std::vector<hull::Silhouette>> silhouettes;
  std::uint64_t frame = 0;
  const auto next = [&] {
    simulate(frame);
    silhouettes.push_back(silhouettes_of(frame));
    expected->advance_to(1e-9 * double(stamp_of(frame) - stamp_of(0)), silhouettes.back());
    expect_same(states_.all().back(), *expected);
    ++frame;
    return states_.all().back().world_from_object.at("faller").translation().z();
  };
  next();
  const double falling_m = next();
  EXPECT_LT(falling_m, 5);
  command(fivepipe_v1_pause_simulation, "another");
  EXPECT_LT(next(), falling_m);
  command(fivepipe_v1_pause_simulation, "simulation");
  expected->pause();
  const double paused_m = next();
  EXPECT_EQ(next(), paused_m);
  command(fivepipe_v1_resume_simulation);
  expected->resume();
  EXPECT_LT(next(), paused_m);
  command(fivepipe_v1_reset_simulation);
  expected->reset();
  EXPECT_GT(next(), paused_m);
}

// A busy node finds commands from before a replay together with the replay's own.
TEST_F(SimNode, ExecutesTheFirstCommandsOfAReplayThatBeginsWhileItIsBusy) {
  start_with(kScene);
  begin_replay(true);
  simulate(0);
  for (const bool pauses : {true, false}) {
    at_once([&] {
      if (!pauses) command(fivepipe_v1_pause_simulation, "simulation");
      begin_replay(true);
      if (pauses) command(fivepipe_v1_pause_simulation, "simulation");
    });
    std::vector<double> z_m;
    for (const std::uint64_t frame : {0, 1, 2}) {
      simulate(frame);
      z_m.push_back(states_.all().back().world_from_object.at("faller").translation().z());
    }
    EXPECT_EQ(z_m[2] == z_m[1], pauses);
  }
}

// DDS reports the end of a writer as a sample without data.
TEST_F(SimNode, TheEndOfACommandersWriterIsNoCommand) {
  start_with(kScene);
  begin_replay(true);
  simulate(0);
  simulate(1);
  {
    auto commander = bus_.writer<bus::topics::Command>();
    wait_for_readers(commander);
    fivepipe_v1_Command pause{};
    messages::set_text(pause.target, "simulation");
    pause.kind = fivepipe_v1_pause_simulation;
    deliver(commander, pause);
  }
  const double paused_m = states_.all().back().world_from_object.at("faller").translation().z();
  EXPECT_LT(paused_m, 5);
  for (const std::uint64_t frame : {2, 3, 4}) {
    simulate(frame);
    EXPECT_EQ(states_.all().back().world_from_object.at("faller").translation().z(), paused_m);
  }
}

// Without frame sets the node sleeps. A node that polls uses a whole core.
TEST_F(SimNode, UsesNoCpuTimeWithoutFrameSets) {
  Collected<bus::topics::NodeStatus, double> cpu_s(
      bus_, [](const bus::Sample<bus::topics::NodeStatus>& sample) { return sample->cpu_s; });
  start_with(kScene);
  simulate(0);
  ASSERT_TRUE(reports_again(4));  // the hull is held for 1 s
  cpu_s.take();
  const std::size_t first = cpu_s.all().size();
  ASSERT_TRUE(holds([&] { return cpu_s.take().size() >= first + 3; })) << said();
  // Two periods of half a second.
  EXPECT_LT(cpu_s.all()[first + 2] - cpu_s.all()[first], 0.2);
}

// A replay starts from the state after the start of the process. Its frames have earlier stamps.
TEST_F(SimNode, EachReplayStartsFromTheInitialState) {
  start_with(kScene);
  simulate(100);
  // A frame set that stays incomplete.
  deliver(
      maps_,
      messages::map_message("front", 101, stamp_of(101), silhouettes_of(101)[0].pixels).message());
  ASSERT_TRUE(has_states(3)) << said();  // by the clock
  begin_replay(false);
  const std::int64_t begin_ns = base::now_realtime_ns();
  ASSERT_TRUE(reports_again(1));
  take();
  // The node may still have been in a step of the clock.
  for (const State& state : states_.all())
    EXPECT_LT(state.source_stamp_ns, begin_ns + 200'000'000)
        << "against the hull before the replay";
  for (int round = 0; round < 2; ++round) {
    begin_replay(true);
    const auto expected = same_simulation();
    std::map<std::uint64_t, std::vector<hull::Silhouette>> silhouettes;
    for (const std::uint64_t frame : {7, 8}) {
      const std::size_t before = states_.all().size();
      const std::size_t traced = traces().size();
      send_maps(frame);
      ASSERT_TRUE(holds([&] { return traces().size() > traced; })) << said();
      ASSERT_TRUE(has_states(before + 1)) << said();
      silhouettes[frame] = silhouettes_of(frame);
      expected->advance_to(1e-9 * double(stamp_of(frame) - stamp_of(7)), silhouettes[frame]);
      expect_same(states_.all().back(), *expected);
    }
  }
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "late_map"), 0u);
  EXPECT_EQ(report.drops.at("incomplete_set"), 1u);
}

// Objects that rest on, hang in and fall out of everything.
const std::string kEventfulScene = R"(
name: eventful
gravity_m_s2: 9.8
objects:
  - {name: bouncing, sphere: {radius_m: 0.02}, position_m: [0, 0.02, 0.17], motion: dynamic,
     reaction: bounce}
  - {name: swallowed, sphere: {radius_m: 0.01}, position_m: [0, 0.02, 0.02], motion: dynamic,
     reaction: bounce}
  - {name: wedged, box: {size_m: [0.1, 0.3, 0.1]}, position_m: [0, 0.02, 0.15], motion: dynamic,
     reaction: bounce}
  - {name: falling, sphere: {radius_m: 0.02}, position_m: [0.3, 0.3, 0], motion: dynamic,
     reaction: none}
  - {name: resting, sphere: {radius_m: 0.02}, position_m: [-0.01, 0.02, 0.3], motion: dynamic,
     reaction: contact}
)";

using Counts = std::map<std::string, std::uint64_t>;

// Twice, because the counts of the node go on when a replay resets its simulation. Some stamps go
// back or leave gaps.
class SimNodeEvents : public SimNode {
 protected:
  // Without the CPU time.
  Counts counts_at_end() {
    auto counts = ended().counts;
    EXPECT_GT(counts[node::kFramesCpu], 0u);
    counts.erase(node::kFramesCpu);
    return {counts.begin(), counts.end()};
  }
  Counts replayed_twice(const std::string& options, const std::string& more_objects = "") {
    start_with(kEventfulScene + more_objects, options);
    Counts counts;
    const auto add = [&](const char* name, std::uint64_t count) {
      if (count > 0) counts[name] += count;
    };
    std::vector<std::pair<std::uint64_t, std::int64_t>> frames;  // and later_ns
    for (std::uint64_t frame = 0; frame < 6; ++frame) frames.emplace_back(frame, 0);
    frames.emplace_back(6, -50'000'000);  // before frame 5
    // Two gaps of more than 2 s.
    frames.emplace_back(7, 2'345'000'000);
    for (std::uint64_t frame = 8; frame < 24; frame += 4) frames.emplace_back(frame, 2'345'000'000);
    for (std::uint64_t frame = 24; frame < 40; frame += 4)
      frames.emplace_back(frame, 4'567'000'000);
    for (int round = 0; round < 2; ++round) {
      begin_replay(true);
      const auto expected = same_simulation();
      std::vector<std::vector<hull::Silhouette>> silhouettes;
      for (const auto& [frame, later_ns] : frames) {
        const std::size_t traced = traces().size();
        send_maps(frame, later_ns);
        EXPECT_TRUE(holds([&] {
          take();
          return traces().size() > traced;
        })) << said();
        silhouettes.push_back(silhouettes_of(frame));
        expected->advance_to(1e-9 * double(stamp_of(frame) + later_ns - stamp_of(0)),
                             silhouettes.back());
      }
      const sim::SimulationCounters now = expected->counters();
      add("contacts", now.contacts);
      add("contacts_unrecovered", now.unrecovered);
      add("contacts_still_colliding", now.still_colliding);
      add("contact_impacts", now.impacts);
      add("objects_respawned", now.respawned);
      add("backward_stamps", now.backward_stamps);
      add("milliseconds_skipped", std::uint64_t(1e3 * now.skipped_s));
      add("objects_undecided", now.detection.undecided);
      add("points_unconfirmed", now.detection.points_unconfirmed);
      counts[node::kFrameSetsComplete] += frames.size();
    }
    return counts;
  }
};

TEST_F(SimNodeEvents, AreCountedAsTheSimulationCountsThem) {
  const Counts counts = replayed_twice("");
  for (const char* name :
       {"contacts", "contacts_unrecovered", "contacts_still_colliding", "contact_impacts",
        "objects_respawned", "backward_stamps", "milliseconds_skipped"})
    EXPECT_TRUE(counts.contains(name)) << name;
  EXPECT_EQ(counts_at_end(), counts);
}

TEST_F(SimNodeEvents, AreCountedWithUndecidedObjects) {
  // Its corner enters the hull between the points that a large spacing leaves.
  const Counts counts = replayed_twice(
      ", eps_m: 0.1, spacing_m: 1",
      "  - {name: grazing, box: {size_m: [0.4, 0.4, 0.4]}, position_m: [0.27, 0.24, 0.2]}\n");
  EXPECT_TRUE(counts.contains("objects_undecided"));
  EXPECT_EQ(counts_at_end(), counts);
}

TEST_F(SimNodeEvents, AreCountedWithThePapersSampling) {
  const CheckedGlContext context;
  const Counts counts = replayed_twice(", collision: paper");
  EXPECT_TRUE(counts.contains("points_unconfirmed"));
  EXPECT_EQ(counts_at_end(), counts);
}

TEST_F(SimNodeEvents, AreCountedWhileTheClockAdvancesTheSimulation) {
  start_with(kEventfulScene);
  simulate(0);
  EXPECT_TRUE(holds([&] {
    take();
    return report().counts.contains("contacts");
  })) << said();
}

// The real ball moves towards a box in steps of 2 cm and meets it between two frames.
class SimNodeWithHistory : public SimNode {
 protected:
  std::vector<hull::Capsule> ball_of(std::uint64_t frame) const override {
    const double x_m = -0.15 + 0.02 * double(frame);
    return {{{x_m, 0, 0}, {x_m, 0.05, 0}, 0.06}};
  }
};

TEST_F(SimNodeWithHistory, PublishesTheComponentsAndTheFirstContact) {
  start_with(R"(
name: met
history: {cell_m: 0.02}
objects:
  - {name: box, box: {size_m: [0.1, 0.3, 0.3]}, position_m: [0.2, 0, 0],
     report: {first_contact: true}}
)");
  begin_replay(true);
  int contacts = 0, colliding = 0;
  constexpr std::uint64_t kFrames = 14;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    simulate(frame);
    ASSERT_TRUE(holds([&] {
      take();
      return components_.all().size() > frame;
    }));
    const Components& components = components_.all()[frame];
    EXPECT_EQ(components.simulation, "simulation");
    EXPECT_EQ(components.frame, frame);
    EXPECT_EQ(components.capture_stamp_ns, stamp_of(frame));
    ASSERT_EQ(components.centroids_m.size(), 1u);
    // The hull of three cameras with pixels of 2 cm is larger than the ball, by up to its radius.
    EXPECT_NEAR(components.centroids_m[0].x(), -0.15 + 0.02 * double(frame), 0.06);
    const std::vector<Collision> found = collisions_of(frame);
    ASSERT_EQ(found.size(), 1u);
    colliding += found[0].verdict == fivepipe_v1_colliding;
    for (const fivepipe_v1_FirstContact& contact : found[0].first_contacts) {
      ++contacts;
      EXPECT_EQ(colliding, 1) << "the first frame of the collision";
      EXPECT_GT(contact.stamp_ns, stamp_of(frame - 1));
      EXPECT_LE(contact.stamp_ns, stamp_of(frame));
    }
  }
  EXPECT_EQ(contacts, 1);
  EXPECT_GT(colliding, 2);
  const NodeReport report = ended();
  EXPECT_EQ(report.collisions.at("box").first_contacts, 1u);
  EXPECT_EQ(report.collisions.at("box").frames, std::uint64_t(colliding));
}

}  // namespace
}  // namespace fivepipe::test
