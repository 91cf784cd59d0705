// fivepipe export on the kept recording.
#include "launch/export/session_export.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/base/usage_error.h"
#include "common/config/mesh/mesh_file.h"
#include "common/geometry/closed_mesh.h"
#include "common/hull/oracle/reference.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/recorded_deployment.h"
#include "common/recording/schema/cdr.h"
#include "launch/export/frame_export.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/source_text.h"
#include "tests/support/test_folder.h"
#include "tests/surface/mesh_checks.h"

namespace fivepipe::exports {
namespace {

using Eigen::Vector3d;
namespace fs = std::filesystem;

// The kept recording.
struct Kept {
  recording::Recording recording{test::kKeptRecording};
  replay::RecordedDeployment recorded{recording, {}};
  const config::Deployment& deployment = recorded.deployment();
  std::vector<replay::RecordedFrame> frames;
  Kept() {
    replay::RecordedFrames all(recording, deployment, {.colours = true, .head_poses = true});
    while (auto frame = all.next()) frames.push_back(std::move(*frame));
  }
  bool holds(std::size_t frame, const Vector3d& p_m) const {
    return hull::in_hull(frames[frame].set.silhouettes, p_m, deployment.hull_rule);
  }
};

using Row = std::map<std::string, std::string>;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line + ',');
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<Row> rows_of(const fs::path& csv) {
  std::istringstream in(test::text_of(csv));
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> head = cells_of(line);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    EXPECT_EQ(cells.size(), head.size()) << line;
    Row& row = rows.emplace_back();
    for (std::size_t i = 0; i < std::min(cells.size(), head.size()); ++i) row[head[i]] = cells[i];
  }
  return rows;
}

double number(const Row& row, const std::string& column) { return std::stod(row.at(column)); }

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder));
  std::ranges::sort(files);
  return files;
}

class Export : public testing::Test {
 protected:
  Export() {
    request_.recording = test::kKeptRecording;
    request_.folder = folder_.path / "out";
    request_.threads = 2;
  }
  ExportSummary run() {
    return export_session(request_, [](double) {});
  }
  std::string usage_error() {
    try {
      run();
    } catch (const base::UsageError& error) {
      return error.what();
    }
    return "none";
  }
  const test::TestFolder folder_;
  ExportRequest request_;
};

TEST_F(Export, MeshesAreClosedAndHaveTheCarvedVolume) {
  const Kept kept;
  request_.meshes = surface::MeshFormat::ply;
  request_.every = 16;
  request_.cell_m = 0.006;
  const ExportSummary summary = run();
  EXPECT_EQ(summary.frames, 3u);
  EXPECT_EQ(summary.frames_in_recording, 33u);
  EXPECT_EQ(summary.files, 4u);
  EXPECT_EQ(summary.without_mesh + summary.without_colour, 0u);
  const std::vector<Row> rows = rows_of(request_.folder / "frames.csv");
  ASSERT_EQ(rows.size(), 3u);
  const Eigen::AlignedBox3d& volume = kept.deployment.hull_rule.within_world_m;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t index = 16 * i;
    EXPECT_EQ(number(rows[i], "index"), double(index));
    const auto read = config::read_mesh(
        request_.folder / "meshes" / (name_of_frame(index, kept.frames[index].set.frame) + ".ply"),
        1);
    ASSERT_EQ(read.reason, "");
    EXPECT_EQ(geometry::open_edges(read.mesh), 0u);
    EXPECT_EQ(double(read.mesh.triangles.size()), number(rows[i], "triangles"));
    const double volume_m3 = geometry::enclosed_volume_m3(read.mesh);
    EXPECT_NEAR(volume_m3 / number(rows[i], "volume_m3"), 1, 1e-4);
    const double step_m = 0.008;
    std::size_t carved = 0;
    for (double z = volume.min().z() + step_m / 2; z < volume.max().z(); z += step_m)
      for (double y = volume.min().y() + step_m / 2; y < volume.max().y(); y += step_m)
        for (double x = volume.min().x() + step_m / 2; x < volume.max().x(); x += step_m)
          carved += kept.holds(index, {x, y, z});
    EXPECT_NEAR(volume_m3 / (double(carved) * std::pow(step_m, 3)), 1, 0.02);
  }
}

// The arm has a green sleeve, which is nearer to the camera's side (-y) than the hand.
TEST_F(Export, MeshesHaveTheRecordedColour) {
  request_.points = surface::MeshFormat::obj;
  request_.end_s = 0;
  EXPECT_EQ(run().frames, 1u);
  const auto file = request_.folder / "points" / (name_of_frame(0, 0) + ".obj");
  std::istringstream in(test::text_of(file));
  std::size_t sleeve = 0, green = 0, hand = 0, red = 0;
  for (std::string line; std::getline(in, line);) {
    double x, y, z, r, g, b;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf %lf %lf %lf", &x, &y, &z, &r, &g, &b) != 6)
      continue;
    if (y < -0.2) ++sleeve, green += g > r;
    if (y > 0.1) ++hand, red += r > g;
  }
  EXPECT_GT(sleeve, 1000u);
  EXPECT_GT(double(green), 0.95 * double(sleeve));
  EXPECT_GT(hand, 1000u);
  EXPECT_GT(double(red), 0.95 * double(hand));
  request_.folder = folder_.path / "plain";
  request_.colour = false;
  run();
  EXPECT_EQ(test::text_of(request_.folder / "points" / (name_of_frame(0, 0) + ".obj"))
                .find_first_of("\n"),
            std::string("# fivepipe: metres, z up").size());
  std::istringstream plain(
      test::text_of(request_.folder / "points" / (name_of_frame(0, 0) + ".obj")));
  std::string line;
  std::getline(plain, line);
  std::getline(plain, line);
  EXPECT_EQ(std::ranges::count(line, ' '), 3) << line;
}

// Exactly those that the recorded simulation tracked.
TEST_F(Export, ComponentsAreThoseOfTheSimulation) {
  const Kept kept;
  std::vector<nlohmann::ordered_json> recorded;
  auto cursor = kept.recording.messages();
  while (const auto message = cursor.next()) {
    if (message->channel->topic != "fivepipe/v1/HullComponents" || message->key_change) continue;
    const auto json =
        schema::decode(kept.recording.idl(*message->channel), message->channel->type, message->cdr);
    for (const auto& component : json["components"]) recorded.push_back(component);
  }
  request_.components = true;
  EXPECT_EQ(run().frames, 33u);
  const std::vector<Row> rows = rows_of(request_.folder / "components.csv");
  ASSERT_EQ(rows.size(), recorded.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ("component_" + rows[i].at("origin"), recorded[i]["origin"]);
    EXPECT_NEAR(number(rows[i], "volume_m3"), recorded[i]["volume_m3"].get<double>(), 1e-8);
    EXPECT_NEAR(number(rows[i], "centroid_y_m"), recorded[i]["centroid_m"]["y"].get<double>(),
                1e-5);
    EXPECT_EQ(rows[i].at("clipped") == "1", recorded[i]["clipped"].get<bool>());
    if (recorded[i]["frames"] == 0)
      EXPECT_EQ(rows[i].at("velocity_x_m_s"), "");
    else
      EXPECT_NEAR(number(rows[i], "velocity_x_m_s"), recorded[i]["velocity_m_s"]["x"].get<double>(),
                  1e-4);
  }
}

// The tracker needs all frames; a gap would give each component a new id.
TEST_F(Export, EveryNthFrameHasTheComponentsOfAllFrames) {
  request_.components = true;
  run();
  std::vector<Row> expected;
  for (Row& row : rows_of(request_.folder / "components.csv"))
    if (std::stoi(row.at("index")) % 8 == 0) expected.push_back(std::move(row));
  ASSERT_GT(expected.size(), 4u);
  request_.folder = folder_.path / "every";
  request_.every = 8;
  EXPECT_EQ(run().frames, 5u);
  EXPECT_EQ(rows_of(request_.folder / "components.csv"), expected);
}

hull::View recorded_view(const Kept& kept, std::size_t frame) {
  const config::Viewer& viewer = kept.deployment.viewer;
  return {{config::render_pinhole(viewer), *kept.frames[frame].eye_from_world},
          viewer.near_m,
          viewer.far_m};
}

TEST_F(Export, DepthOfTheViewerIsThatOfTheReference) {
  const Kept kept;
  request_.depth = DepthFormat::exr;
  request_.every = 20;
  EXPECT_EQ(run().files, 3u);
  const std::vector<Row> views = rows_of(request_.folder / "depth" / "views.csv");
  ASSERT_EQ(views.size(), 2u);
  for (const std::size_t index : {0, 20}) {
    const cv::Mat image = cv::imread(
        (request_.folder / "depth" / (name_of_frame(index, kept.frames[index].set.frame) + ".exr"))
            .string(),
        cv::IMREAD_UNCHANGED);
    ASSERT_EQ(image.size(), cv::Size(160, 120));
    const hull::View view = recorded_view(kept, index);
    int hits = 0;
    for (int v = 3; v < 120; v += 7)
      for (int u = 3; u < 160; u += 7) {
        const auto depth_m = hull::reference_depth_m(kept.frames[index].set.silhouettes, view, u, v,
                                                     kept.deployment.hull_rule);
        EXPECT_NEAR(image.at<float>(v, u), depth_m.value_or(0), 1e-5) << u << ' ' << v;
        hits += depth_m.has_value();
      }
    EXPECT_GT(hits, 5);
    const Row& row = views[index / 20];
    EXPECT_NEAR(number(row, "fx_px"), view.camera.pinhole.fx_px, 1e-6);
    EXPECT_NEAR(number(row, "camera_from_world_23"), view.camera.camera_from_world(2, 3), 1e-9);
  }
}

// The depth of a camera that limits the hull is on its object pixels.
TEST_F(Export, DepthOfACameraIsOnItsObjectPixels) {
  const Kept kept;
  request_.depth = DepthFormat::png;
  request_.end_s = 0;
  for (std::size_t camera = 0; camera < 3; ++camera) {
    request_.camera = kept.frames[0].set.cameras[camera];
    request_.folder = folder_.path / request_.camera;
    run();
    const cv::Mat image =
        cv::imread((request_.folder / "depth" / (name_of_frame(0, 0) + ".png")).string(),
                   cv::IMREAD_UNCHANGED);
    const hull::ObjectPixels& pixels = kept.frames[0].set.silhouettes[camera].pixels;
    ASSERT_EQ(image.size(), cv::Size(pixels.width_px(), pixels.height_px()));
    int hits = 0;
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u)
        if (image.at<std::uint16_t>(v, u) != 0) {
          ++hits;
          EXPECT_TRUE(pixels.contains(u, v));
        }
    EXPECT_GT(hits, 50) << request_.camera;
  }
}

TEST_F(Export, SweptVolumeContainsTheHullOfEachFrame) {
  const Kept kept;
  request_.swept = surface::MeshFormat::glb;
  const ExportSummary summary = run();
  const auto read = config::read_mesh(request_.folder / "swept.glb", 1);
  ASSERT_EQ(read.reason, "");
  EXPECT_EQ(geometry::open_edges(read.mesh), 0u);
  ASSERT_TRUE(summary.swept);
  EXPECT_NEAR(geometry::enclosed_volume_m3(read.mesh) / summary.swept->volume_m3, 1, 1e-5);
  EXPECT_LT(summary.swept->hull_volume_m3, summary.swept->volume_m3);
  const test::MeshInside inside(read.mesh, request_.swept_cell_m);
  std::mt19937_64 random(1);
  const Eigen::AlignedBox3d box = geometry::bounds_m(read.mesh);
  std::uniform_real_distribution<double> part(0, 1);
  int found = 0, missing = 0;
  while (found < 30'000) {
    const Vector3d p =
        box.min() + Vector3d{part(random), part(random), part(random)}.cwiseProduct(box.sizes());
    const std::size_t frame = random() % kept.frames.size();
    if (!kept.holds(frame, p)) continue;
    ++found;
    missing += !inside.contains(p);
  }
  EXPECT_EQ(missing, 0);
  EXPECT_NE(text_of(request_, summary).find("its excess is"), std::string::npos);
}

TEST_F(Export, FilesDoNotDependOnTheThreads) {
  request_.meshes = surface::MeshFormat::stl;
  request_.swept = surface::MeshFormat::ply;
  request_.components = request_.volumes = true;
  request_.depth = DepthFormat::png;
  request_.start_s = 1;
  request_.every = 2;
  request_.cell_m = request_.swept_cell_m = 0.01;
  request_.threads = 1;
  std::vector<double> progress;
  export_session(request_, [&](double done) { progress.push_back(done); });
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  EXPECT_GT(progress.size(), 2u);
  EXPECT_GT(progress.front(), 0);
  EXPECT_EQ(progress.back(), 1);
  const fs::path one = request_.folder;
  request_.folder = folder_.path / "many";
  request_.threads = 3;
  run();
  const std::vector<fs::path> files = files_in(one);
  EXPECT_EQ(files, files_in(request_.folder));
  EXPECT_GT(files.size(), 10u);
  for (const fs::path& file : files)
    EXPECT_TRUE(test::text_of(one / file) == test::text_of(request_.folder / file)) << file;
}

TEST_F(Export, FramesWithoutHullOrPoseAreCounted) {
  const Kept kept;
  request_.meshes = surface::MeshFormat::ply;
  request_.depth = DepthFormat::png;
  fs::create_directories(request_.folder / "depth");
  FrameExporter exporter(request_, kept.deployment, nullptr);
  replay::RecordedFrame frame = kept.frames[0];
  frame.eye_from_world.reset();
  EXPECT_FALSE(exporter.exported(frame, 0).view);
  EXPECT_EQ(files_in(request_.folder / "depth").size(), 0u);
  for (hull::Silhouette& silhouette : frame.set.silhouettes)
    silhouette.pixels = {silhouette.pixels.width_px(), silhouette.pixels.height_px()};
  frame.eye_from_world = kept.frames[0].eye_from_world;
  const FrameFigures figures = exporter.exported(frame, 1);
  EXPECT_EQ(figures.triangles, 0u);
  EXPECT_EQ(figures.volume_m3, 0);
  EXPECT_TRUE(figures.view);
  EXPECT_EQ(cv::countNonZero(
                cv::imread((request_.folder / "depth" / (name_of_frame(1, 0) + ".png")).string(),
                           cv::IMREAD_UNCHANGED)),
            0);
  EXPECT_TRUE(fs::exists(request_.folder / "meshes" / (name_of_frame(1, 0) + ".ply")));
  // Thinner than the cells.
  ExportRequest coarse = request_;
  coarse.folder = folder_.path / "coarse";
  coarse.cell_m = 1;
  coarse.end_s = 0;
  const ExportSummary summary = export_session(coarse, [](double) {});
  EXPECT_EQ(summary.without_mesh, 1u);
  EXPECT_NE(text_of(coarse, summary).find("Frames without a surface"), std::string::npos);
}

TEST_F(Export, RefusesWrongRequests) {
  EXPECT_NE(usage_error().find("nothing to export"), std::string::npos);
  request_.points = surface::MeshFormat::stl;
  EXPECT_NE(usage_error().find("STL holds only triangles"), std::string::npos);
  request_.points.reset();
  request_.depth = DepthFormat::png;
  request_.camera = "ceiling";
  EXPECT_NE(usage_error().find("no camera 'ceiling'; it has: "), std::string::npos);
  request_.camera.clear();
  request_.start_s = 2;
  request_.end_s = 1;
  EXPECT_NE(usage_error().find("--start is after --end"), std::string::npos);
  request_.start_s = 0;
  request_.start_s = request_.end_s = std::nan("");
  EXPECT_NE(usage_error().find("--start is after --end"), std::string::npos);
  request_.start_s = 0, request_.end_s = 1;
  request_.volumes = true;
  request_.cell_m = 1e-5;
  EXPECT_NE(usage_error().find("--cell: hull mesh: too many cells"), std::string::npos);
  request_.cell_m = 0.01;
  request_.swept = surface::MeshFormat::ply;
  request_.swept_cell_m = 1e-4;
  EXPECT_NE(usage_error().find("--swept-cell: swept volume: too many cells"), std::string::npos);
  EXPECT_FALSE(fs::exists(request_.folder));
  fs::create_directories(request_.folder / "mine");
  request_.swept_cell_m = 0.01;
  EXPECT_NE(usage_error().find("is not empty; choose another folder"), std::string::npos);
}

TEST_F(Export, ChecksOnlyTheCellsThatItUses) {
  request_.depth = DepthFormat::png;
  request_.every = 32;
  request_.cell_m = request_.swept_cell_m = 1e-5;
  EXPECT_EQ(run().frames, 2u);
}

// After the hulls, the error would be that of a recording without a frame in the range.
TEST_F(Export, ChecksTheCompositesFirst) {
  request_.volumes = request_.composites = true;
  request_.start_s = 1e6;
  EXPECT_NE(usage_error(), "none");
  EXPECT_FALSE(fs::exists(request_.folder));
}

TEST_F(Export, ReportsWhatARecordingLacks) {
  request_.volumes = true;
  request_.start_s = 1e6;
  EXPECT_THROW(run(), recording::RecordingError);
  EXPECT_FALSE(fs::exists(request_.folder));
  request_.start_s = 0;
  const fs::path cut = folder_.path / "cut.mcap";
  fs::copy_file(test::kKeptRecording, cut);
  fs::resize_file(cut, fs::file_size(cut) * 6 / 10);
  request_.recording = cut;
  const ExportSummary summary = run();
  EXPECT_GT(summary.frames, 5u);
  EXPECT_LT(summary.frames, 33u);
  EXPECT_NE(text_of(request_, summary).find("only what could be read was exported"),
            std::string::npos)
      << text_of(request_, summary);
  const fs::path empty = folder_.path / "empty.mcap";
  { recording::RecordingWriter writer(empty, "test", {}); }
  request_.recording = empty;
  EXPECT_THROW(run(), recording::RecordingError);
}

}  // namespace
}  // namespace fivepipe::exports
