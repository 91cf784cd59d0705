// `fivepipe study space` moves a part of a running deployment, with real processes and DDS.
#include <signal.h>

#include <fstream>
#include <opencv2/videoio.hpp>

#include "common/recording/schema/cdr.h"
#include "tests/support/recording/replayed_nodes.h"
#include "tests/support/scripted/peer.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

// The arm of the demo reaches in from y = -0.75 m, to at most y = 0.2 m. It passes through the near
// face of the part at a spacing of 5 cm, and is far from it in the scene's pose.
const std::string kScene = R"(name: layout
objects:
  - {name: part, box: {size_m: [0.8, 0.4, 0.5]}, position_m: [0, 1.2, 0.25],
     colour_rgb: [0.1, 0.2, 0.9], spacing: {axis: [0, 1, 0], at_m: 1.2, range_m: [0, 1.5]}}
)";

struct Spacing {
  double spacing_m;
  bool requested;
};
Spacing copied_spacing(const bus::Sample<bus::topics::ObjectSpacing>& sample) {
  return {sample->spacing_m, sample->requested};
}

class StudySpace : public ReplayedNodesTest {
 protected:
  std::string deployment_file() {
    std::ofstream(folder_ / "layout.yaml") << kScene;
    return changed_deployment(folder_ / "layout",
                              "scene: " FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml",
                              "scene: " + (folder_ / "layout.yaml").string());
  }
  // Runs the command. Returns its exit code and sets `said`.
  std::optional<int> space(const std::vector<std::string>& words, std::string& said) {
    std::vector<std::string> all{"study", "space"};
    all.insert(all.end(), words.begin(), words.end());
    const auto program = fivepipe("space", all);
    const std::optional<int> exit_code = program->wait_for_end(kStart);
    said = program->said();
    return exit_code;
  }
  // The part's verdicts, by frame.
  using Verdicts = std::map<std::uint64_t, bool>;
  static void add(const nlohmann::ordered_json& result, Verdicts& verdicts) {
    verdicts[result["frame"].get<std::uint64_t>()] = result["verdict"] == "colliding";
  }
};

// The fraction of the pixels that are more red than blue, as the blue part is while it collides.
double red_part(const cv::Mat& image_bgr) {
  std::size_t red = 0;
  for (int v = 0; v < image_bgr.rows; ++v)
    for (int u = 0; u < image_bgr.cols; ++u) {
      const auto& bgr = image_bgr.at<cv::Vec3b>(v, u);
      red += bgr[2] > 60 && bgr[2] > 3 * bgr[1] && bgr[2] > bgr[0];
    }
  return double(red) / double(image_bgr.total());
}

cv::Mat last_image(const std::filesystem::path& video) {
  cv::VideoCapture capture(video.string(), cv::CAP_FFMPEG);
  cv::Mat image, last;
  while (capture.read(image)) last = image.clone();
  EXPECT_FALSE(last.empty()) << video;
  return last;
}

TEST_F(StudySpace, MovesAPartThatCollidesIsDrawnSurvivesARestartAndIsReplayed) {
  const std::string deployment = deployment_file();
  const std::filesystem::path recorded = folder_ / "recorded.mcap";
  bus::Reader<bus::topics::CollisionResult> results = bus_.reader<bus::topics::CollisionResult>();
  Verdicts live;
  const auto has_verdicts = [&](bool collides, std::size_t count) {
    std::size_t found = 0;
    return eventually(bus_, kStart, [&] {
      for (const auto& sample : results.take()) {
        if (!sample.valid()) continue;
        live[sample->frame] = sample->verdict == fivepipe_v1_colliding;
        found += live[sample->frame] == collides;
      }
      return found >= count;
    });
  };
  std::string said;
  {
    Deployed deployed(deployment, domain_, folder_ / "up", {"--record", recorded.string()});
    Collected<bus::topics::ObjectSpacing, Spacing> spacings{bus_, copied_spacing};
    ASSERT_TRUE(has_verdicts(false, 5)) << deployed.said();
    ASSERT_EQ(space({"5cm", "--deployment", deployment}, said), 0) << said;
    EXPECT_EQ(said, "part: 120.0 cm -> 5.0 cm\n");
    ASSERT_TRUE(has_verdicts(true, 5)) << deployed.said();

    // A restarted simulation begins with it.
    spacings.take();
    const std::size_t before = spacings.all().size();
    ::kill(deployed.pid_of("simulation").value(), SIGKILL);
    ASSERT_TRUE(eventually(bus_, kStart, [&] {
      spacings.take();
      return spacings.all().size() > before;
    })) << deployed.said();
    EXPECT_TRUE(spacings.all()[before].requested) << "it began with the scene's";
    EXPECT_EQ(spacings.all()[before].spacing_m, 0.05);
    ASSERT_EQ(space({"--deployment", deployment}, said), 0) << said;
    EXPECT_EQ(said, "part: 5.0 cm, 0.0 cm to 150.0 cm\n");
    ASSERT_EQ(space({"-2cm", "--part", "part", "--deployment", deployment}, said), 0) << said;
    EXPECT_EQ(said, "part: 5.0 cm -> 3.0 cm\n");
    ASSERT_EQ(space({"151cm", "--deployment", deployment}, said), 2) << said;
    ASSERT_TRUE(has_verdicts(true, 5)) << deployed.said();
    deployed.signal(SIGINT);
    EXPECT_EQ(deployed.wait_for_end(kStart), 130) << deployed.said();
  }
  // The part fills much of the picture, red. The video is there also on a machine so busy that `up`
  // kills render_node before it has written a still.
  EXPECT_GT(red_part(last_image(folder_ / "up" / "composite.mp4")), 0.2);

  const recording::Recording recording(recorded);
  std::vector<double> changes_m;
  Verdicts verdicts;
  for (auto cursor = recording.messages(); const auto message = cursor.next();) {
    const std::string& topic = message->channel->topic;
    if (message->key_change ||
        (topic != bus::topics::ObjectSpacing::name && topic != bus::topics::CollisionResult::name))
      continue;
    const auto json =
        schema::decode(recording.idl(*message->channel), message->channel->type, message->cdr);
    if (topic == bus::topics::CollisionResult::name)
      add(json, verdicts);
    else
      changes_m.push_back(json["spacing_m"]);
  }
  const std::vector<double> expected_m{1.2, 0.05, 0.05, 0.03};
  ASSERT_EQ(changes_m.size(), expected_m.size());
  for (std::size_t i = 0; i < expected_m.size(); ++i)
    EXPECT_NEAR(changes_m[i], expected_m[i], 1e-12) << i;

  const ReplayRun run =
      replayed(recorded, {{"sim_node", "simulation"}}, {bus::topics::CollisionResult::name},
               {"--rate", "max"}, deployment);
  const schema::Idl& idl = recording.idl(
      *std::ranges::find(recording.channels(), std::string(bus::topics::CollisionResult::name),
                         &recording::RecordedChannel::topic));
  Verdicts again;
  for (const Payload& payload : run.outputs.at(bus::topics::CollisionResult::name))
    add(schema::decode(idl, bus::topics::CollisionResult::type, payload), again);
  std::size_t colliding = 0, free = 0;
  for (const auto& [frame, collides] : verdicts) {
    ASSERT_TRUE(again.contains(frame)) << frame;
    EXPECT_EQ(again.at(frame), collides) << frame;
    ++(collides ? colliding : free);
  }
  EXPECT_GE(colliding, 10u);
  EXPECT_GE(free, 5u);

  // What-if takes the scene's axis, spacing and range, wherever the part was in a frame.
  Program what_if({std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "study", "what-if",
                   recorded.string(), "--part", "part", "--layouts", "4", "--verdicts", "--json",
                   (folder_ / "what_if.json").string()},
                  folder_ / "what_if.log");
  ASSERT_EQ(what_if.wait_for_end(kStart), 0) << what_if.said();
  const auto all = nlohmann::json::parse(test::text_of(folder_ / "what_if.json"));
  const auto& found = all["parts"][0];
  EXPECT_EQ(found["at_m"], 1.2);
  EXPECT_EQ(found["range_m"], (nlohmann::json{0.0, 1.5}));
  EXPECT_EQ(found["axis"], (nlohmann::json{0.0, 1.0, 0.0}));
  std::vector<double> listed_m;
  for (const auto& spacing : found["recorded"]) listed_m.push_back(spacing["spacing_m"]);
  EXPECT_EQ(listed_m, changes_m);
  const auto& layouts = found["layouts"];  // at 0, 0.5, 1 and 1.5 m
  EXPECT_EQ(layouts[0]["colliding_frames"], all["frames"]) << "also while the part was far away";
  for (const int far : {2, 3}) EXPECT_EQ(layouts[far]["colliding_frames"], 0) << far;
}

}  // namespace
}  // namespace fivepipe::test
