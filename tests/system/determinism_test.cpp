// A recording gives the same bits in every run, at every rate and for any number of threads and of
// reconstruction nodes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/recording/replayed_nodes.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

using test::kSmallDeployment;
using test::NodeUnderTest;
using test::Payload;

const std::vector<std::string> kReconOutputs = {bus::topics::HullTile::name};
const std::vector<std::string> kSimOutputs = {bus::topics::VirtualState::name,
                                              bus::topics::CollisionResult::name};
const NodeUnderTest kReconA{"recon_node", "recon_a"}, kReconB{"recon_node", "recon_b"},
    kSimulation{"sim_node", "simulation"};

int runs() { return std::getenv("FIVEPIPE_LONG") ? 5 : 1; }

class Determinism : public test::ReplayedNodesTest {
 protected:
  // At half speed, at the recorded speed and unthrottled.
  void expect_same_bits_at_every_rate(const NodeUnderTest& node,
                                      const std::vector<std::string>& outputs) {
    const auto recording = recorded(0.5);
    const auto expected = replayed(recording, {node}, outputs, {"--rate", "max"}).outputs;
    for (const std::string& topic : outputs) ASSERT_FALSE(expected.at(topic).empty()) << topic;
    for (int run = 0; run < runs(); ++run)
      for (const char* rate : {"0.5", "1", "max"})
        EXPECT_TRUE(replayed(recording, {node}, outputs, {"--rate", rate}).outputs == expected)
            << rate;
  }
};

TEST_F(Determinism, ReconstructionIsIdenticalAtEveryRate) {
  expect_same_bits_at_every_rate(kReconA, kReconOutputs);
}
TEST_F(Determinism, SimulationIsIdenticalAtEveryRate) {
  expect_same_bits_at_every_rate(kSimulation, kSimOutputs);
}

TEST_F(Determinism, ReconstructionIsIdenticalForTwoNodesAndForTwoThreads) {
  const auto recording = recorded(0.5);
  const auto by_two_nodes =
      replayed(recording, {kReconA, kReconB}, kReconOutputs, {"--rate", "max"}).outputs;
  const std::string recon_a =
      "{name: recon_a, program: recon_node, worker: 0, workers: 2}\n  - {name: recon_b, program: "
      "recon_node, worker: 1, workers: 2}";
  const std::string alone =
      test::changed_deployment(folder_ / "alone", recon_a, "{name: recon_a, program: recon_node}");
  const auto by_one =
      replayed(recording, {kReconA}, kReconOutputs, {"--rate", "max"}, alone).outputs;
  const std::string threads =
      test::changed_deployment(folder_ / "threads", recon_a,
                               "{name: recon_a, program: recon_node, backend: cpu, threads: 2}");
  const auto by_two_threads =
      replayed(recording, {kReconA}, kReconOutputs, {"--rate", "max"}, threads).outputs;
  ASSERT_FALSE(by_one.at(bus::topics::HullTile::name).empty());
  EXPECT_TRUE(by_two_nodes == by_one);
  EXPECT_TRUE(by_two_threads == by_one);
}

TEST_F(Determinism, SimulationIsIdenticalForTwoThreads) {
  const auto recording = recorded(0.5);
  const auto by_one = replayed(recording, {kSimulation}, kSimOutputs, {"--rate", "max"}).outputs;
  const std::string simulation = "{name: simulation, program: sim_node}";
  const std::string threads = test::changed_deployment(
      folder_ / "threads", simulation, "{name: simulation, program: sim_node, threads: 2}");
  ASSERT_FALSE(by_one.at(bus::topics::CollisionResult::name).empty());
  EXPECT_TRUE(replayed(recording, {kSimulation}, kSimOutputs, {"--rate", "max"}, threads).outputs ==
              by_one);
}

// Cloth, rigid bodies, a door and particles around the hand, which is at (0, 0.19, 0.34) m and
// moves along +x.
const std::string kEverything = R"(name: everything
history: {}
objects:
  - {name: floor, box: {size_m: [2, 2, 0.1]}, position_m: [0, 0, -0.05], reaction: none}
  - {name: panel, curtain: {width_m: 0.3, height_m: 0.4, columns: 10, rows: 12, fold_depth_m: 0.01,
     fold_count: 2}, position_m: [0.05, 0.2, 0.55], motion: cloth,
     cloth: {pins: [{from_m: [-1, -1, -0.001], to_m: [1, 1, 0.001]}]}}
  - {name: ball, sphere: {radius_m: 0.04}, position_m: [0.03, 0.17, 0.45], motion: dynamic,
     reaction: contact}
  - {name: paper_ball, sphere: {radius_m: 0.03}, position_m: [-0.03, 0.10, 0.45], motion: dynamic,
     reaction: bounce}
  - {name: door, box: {size_m: [0.3, 0.02, 0.3]}, position_m: [0.1, 0.1, 0.3], motion: dynamic,
     reaction: contact,
     hinge: {point_m: [0.15, 0, 0], axis: [0, 0, 1], from_deg: -90, to_deg: 90}}
particles:
  - {name: grains, from_m: [-0.1, 0.1, 0.6], to_m: [0.1, 0.3, 0.6], rate_hz: 3000, lifetime_s: 2,
     velocity_m_s: [0, 0, -2], spread_m_s: 0.2}
)";

TEST_F(Determinism, ClothBodiesADoorAndParticlesAreIdenticalAtEveryRateAndForTwoThreads) {
  // A replay stops waiting for a node that needs 5 s for a frame.
  std::string everything_text = test::replaced(
      kEverything, "rate_hz: 3000", "rate_hz: " + std::to_string(3000 / test::kSlowdown));
  if (test::kHasSanitizer)
    everything_text =
        test::replaced(everything_text, "columns: 10, rows: 12", "columns: 4, rows: 5");
  std::ofstream(folder_ / "everything.yaml") << everything_text;
  const std::string scene = "scene: " FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml",
                    everything = "scene: " + (folder_ / "everything.yaml").string();
  const std::string one = test::changed_deployment(folder_ / "one", scene, everything);
  const std::string two = test::changed_deployment(folder_ / "two", scene, everything);
  const std::string simulation = "{name: simulation, program: sim_node}";
  std::ofstream(two) << test::replaced(test::text_of(one), simulation,
                                       "{name: simulation, program: sim_node, threads: 2}");
  const auto recording = recorded(0.5);
  std::vector<std::string> outputs = kSimOutputs;
  outputs.push_back(bus::topics::Particles::name);
  const auto expected = replayed(recording, {kSimulation}, outputs, {"--rate", "max"}, one).outputs;
  const auto& states = expected.at(bus::topics::VirtualState::name);
  ASSERT_GT(states.size(), 5u);
  EXPECT_FALSE(states.front() == states.back()) << "nothing moves";
  const auto& particles = expected.at(bus::topics::Particles::name);
  ASSERT_EQ(particles.size(), states.size());
  EXPECT_FALSE(particles.front() == particles.back()) << "no particle";
  for (int run = 0; run < runs(); ++run) {
    for (const char* rate : {"0.5", "max"})
      EXPECT_TRUE(replayed(recording, {kSimulation}, outputs, {"--rate", rate}, one).outputs ==
                  expected)
          << rate;
    EXPECT_TRUE(replayed(recording, {kSimulation}, outputs, {"--rate", "max"}, two).outputs ==
                expected);
  }
}

// A node that has handled a recording starts from its initial state when the replay starts again.
TEST_F(Determinism, SecondReplayIntoSameProcessIsIdentical) {
  const auto recording = recorded(0.5);
  for (const auto& [node, topics] :
       {std::pair{kSimulation, kSimOutputs}, std::pair{kReconA, kReconOutputs}}) {
    const auto once = replayed(recording, {node}, topics, {"--rate", "max"}).outputs;
    const auto twice =
        replayed(recording, {node}, topics, {"--rate", "max"}, kSmallDeployment, 2).outputs;
    for (const std::string& topic : topics) {
      ASSERT_EQ(twice.at(topic).size(), 2 * once.at(topic).size()) << topic;
      for (std::size_t i = 0; i < once.at(topic).size(); ++i) {
        ASSERT_TRUE(twice.at(topic)[2 * i] == once.at(topic)[i]) << topic << " " << i;
        ASSERT_TRUE(twice.at(topic)[2 * i + 1] == once.at(topic)[i]) << topic << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace fivepipe::test
