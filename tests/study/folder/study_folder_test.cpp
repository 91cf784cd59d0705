#include "launch/study/folder/study_folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/base/usage_error.h"
#include "launch/study/folder/pseudonym_search.h"
#include "launch/study/folder/scene_pose.h"
#include "launch/supervise/claims.h"
#include "tests/support/deployments.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

using report::Answer;
using report::ParticipantKind;
using test::contains;
namespace fs = std::filesystem;

class StudyFolderTest : public testing::Test {
 protected:
  StudyFolder study() {
    return StudyFolder::create(
        folder_.path / "study",
        {"Name", FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml", {}, "a"});
  }
  // What opening or using the study says.
  static std::string refusal(const std::function<void()>& use) {
    try {
      use();
      return "";
    } catch (const base::UsageError& error) {
      return error.what();
    }
  }
  test::TestFolder folder_;
};

TEST_F(StudyFolderTest, HasACopyOfTheDeployment) {
  study();
  const StudyFolder opened(folder_.path / "study");
  EXPECT_EQ(opened.settings().name, "Name");
  EXPECT_EQ(opened.settings().spacing_of, "a");
  const config::Deployment deployment = opened.deployment();
  EXPECT_EQ(deployment.name, "demo");
  for (const fs::path& file : deployment.files)
    EXPECT_TRUE(fs::canonical(file).string().starts_with(fs::canonical(folder_.path).string()))
        << file;
  EXPECT_TRUE(opened.trials().empty());
}

TEST_F(StudyFolderTest, IsMadeFromMeshes) {
  const fs::path mesh = folder_.path / "tetrahedron.obj";
  std::ofstream(mesh) << "v 0 0 0\nv 100 0 0\nv 0 200 0\nv 0 0 50\n"
                         "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const auto made_of = [&](const MeshPart& part) {
    return StudyFolder::create(
        folder_.path / "study",
        {"Name", FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml", {}, ""}, {part});
  };
  const config::Spacing spacing{Eigen::Vector3d::UnitZ(), 0.18, 0.1, 0.34};
  // The folder is as before.
  EXPECT_THROW(made_of({"part", mesh, "miles"}), config::ConfigError);
  EXPECT_THROW(made_of({"part", mesh, ""}), config::ConfigError);
  EXPECT_THROW(made_of({"part", mesh, "mm", config::Spacing{{0, 0, 1}, 0.5, 0.1, 0.2}}),
               config::ConfigError);
  EXPECT_TRUE(contains(refusal([&] { made_of({"part", "/no/such.obj", "mm"}); }), "is no file"));
  EXPECT_FALSE(fs::exists(folder_.path / "study"));
  const config::Scene scene = made_of({"part", mesh, "mm", spacing}).deployment().scene;
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_TRUE(geometry::bounds_m(config::mesh_of(scene.objects[0]))
                  .sizes()
                  .isApprox(Eigen::Vector3d(0.1, 0.2, 0.05)));
  EXPECT_EQ(scene.objects[0].spacing->at_m, 0.18);
  EXPECT_EQ(scene.objects[0].spacing->high_m, 0.34);
}

// The files that a mesh file names are copied, too.
TEST_F(StudyFolderTest, IsMadeFromAMeshWithMaterials) {
  const fs::path parts = folder_.path / "parts";
  fs::create_directories(parts / "looks");
  std::ofstream(parts / "part.obj") << "mtllib looks/part.mtl\nusemtl red\n"
                                       "v 0 0 0\nv 100 0 0\nv 0 200 0\nv 0 0 50\n"
                                       "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(parts / "looks" / "part.mtl") << "newmtl red\nKd 1 0 0\n";
  const auto made = [&] {
    return StudyFolder::create(
        folder_.path / "study",
        {"Name", FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml", {}, ""},
        {{"bracket", parts / "part.obj", "mm"}});
  };
  const config::Deployment deployment = made().deployment();
  const auto& shape = std::get<config::MeshShape>(deployment.scene.objects[0].shape);
  ASSERT_TRUE(shape.materials);
  EXPECT_EQ(shape.materials->materials[0].base_rgb[0], 1);
  EXPECT_EQ(shape.file.parent_path().filename(), "bracket");

  fs::remove_all(folder_.path / "study");
  std::ofstream(folder_.path / "part.mtl") << "newmtl red\nKd 1 0 0\n";
  const std::string text = test::text_of(parts / "part.obj");
  std::ofstream(parts / "part.obj") << test::replaced(text, "looks/part.mtl", "../part.mtl");
  EXPECT_TRUE(contains(refusal([&] { made(); }), "part.mtl, which is not below its folder"));
}

// The copy would change with the original.
TEST_F(StudyFolderTest, RefusesADeploymentThatNamesAnAbsolutePath) {
  const std::string file = test::changed_deployment(folder_.path / "files", "nodes:\n", "nodes:\n");
  EXPECT_TRUE(contains(refusal([&] {
                         StudyFolder::create(folder_.path / "study", {"Name", file, {}, ""});
                       }),
                       "a study needs paths that are relative"));
  EXPECT_FALSE(fs::exists(folder_.path / "study"));
}

TEST_F(StudyFolderTest, RefusesAFolderWithFiles) {
  fs::create_directories(folder_.path / "study");
  std::ofstream(folder_.path / "study" / "mine.txt") << "text";
  EXPECT_TRUE(contains(refusal([&] { study(); }), "is not empty"));
  EXPECT_TRUE(contains(refusal([&] { StudyFolder opened(folder_.path / "study"); }),
                       "is no study; make one by: fivepipe study new"));
}

TEST_F(StudyFolderTest, NamesTheFileOfADamagedStudy) {
  study();
  for (const char* text : {"{", "{}", "[]", R"({"format": 2})"}) {
    std::ofstream(folder_.path / "study" / "study.json") << text;
    EXPECT_TRUE(contains(refusal([&] { StudyFolder opened(folder_.path / "study"); }),
                         "study/study.json: "))
        << text;
  }
}

TEST_F(StudyFolderTest, KeepsTrials) {
  StudyFolder made = study();
  const std::string hostile = "=1+1\"</script>\n../\xc3\xa9";
  StoredTrial trial = made.add_trial(hostile, ParticipantKind::scripted);
  EXPECT_EQ(trial.number, 1);
  trial.state = TrialState::discarded;
  trial.discarded_because = "a camera was covered";
  trial.tool = "tongs";
  trial.answers = {Answer{0.15}, std::nullopt, Answer{0.16, 0.17, "adjust tool"}, std::nullopt};
  trial.notes = {{123, "note"}};
  trial.recordings = {"recording_1.mcap", "recording_2.mcap"};
  made.save(trial);
  EXPECT_EQ(made.add_trial("P2", ParticipantKind::human).number, 2);
  const std::vector<StoredTrial> trials = StudyFolder(made.path()).trials();
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(json_of(trials[0]), json_of(trial));
  EXPECT_EQ(trials[0].participant, hostile);
  EXPECT_EQ(trials[0].answers.found->remark, "adjust tool");
  EXPECT_EQ(trials[0].kind, ParticipantKind::scripted);
  EXPECT_EQ(trials[1].kind, ParticipantKind::human);
  // No file is named after the participant.
  for (const auto& entry : fs::recursive_directory_iterator(made.path() / "trials"))
    EXPECT_TRUE(entry.path().filename() == "trial.json" || entry.is_directory()) << entry.path();
}

TEST_F(StudyFolderTest, RefusesPseudonymsThatAreNoText) {
  StudyFolder made = study();
  for (const std::string& name : {std::string(), std::string(1001, 'x'), std::string("\xff")})
    EXPECT_TRUE(contains(refusal([&] { made.add_trial(name, ParticipantKind::human); }),
                         "1 to 1000 bytes of UTF-8"));
  made.add_trial("P1", ParticipantKind::human);
  EXPECT_TRUE(contains(refusal([&] { made.add_trial("P1", ParticipantKind::scripted); }),
                       "use another pseudonym"));
  EXPECT_TRUE(contains(refusal([&] { made.trial(7); }), "has no trial 7"));
}

TEST_F(StudyFolderTest, NamesWhatIsWrongInATrial) {
  StudyFolder made = study();
  nlohmann::ordered_json good = json_of(made.add_trial("P1", ParticipantKind::human));
  const fs::path file = made.folder_of(1) / "trial.json";
  const std::vector<std::pair<std::string, nlohmann::ordered_json>> faults{
      {"state", "lost"},
      {"kind", "robot"},
      {"trial", "one"},
      {"trial", 2},
      {"recordings", {"../../secret.mcap"}},
      {"recordings", {"1/../../secret.mcap"}},
      {"recordings", {".."}},
      {"answers", {{"found", {{"low_m", -1}, {"remark", ""}}}}},
      {"answers", {{"found", {{"low_m", 0.2}, {"high_m", 0.1}, {"remark", ""}}}}},
      {"answers", {{"found", {{"low_m", 1e9}, {"remark", ""}}}}}};
  for (const auto& [key, value] : faults) {
    nlohmann::ordered_json bad = good;
    bad[key] = value;
    std::ofstream(file) << bad;
    EXPECT_TRUE(contains(refusal([&] { made.trials(); }), "trial.json: ")) << key << value;
  }
}

TEST_F(StudyFolderTest, ForgetsAParticipant) {
  StudyFolder made = study();
  for (const char* name : {"Quentin", "Rosa", "Quentin"}) {
    StoredTrial trial = made.add_trial(name, ParticipantKind::human);
    trial.recordings = {"recording_1.mcap"};
    made.save(trial);
    std::ofstream(made.folder_of(trial.number) / "recording_1.mcap") << "frames";
  }
  fs::create_directories(made.report_folder());
  std::ofstream(made.report_folder() / "report.html") << "Quentin";
  const Forgotten forgotten = made.forget("Quentin");
  EXPECT_EQ(forgotten.trials, 2);
  EXPECT_TRUE(forgotten.mentioned_in.empty());
  for (const auto& entry : fs::recursive_directory_iterator(made.path()))
    if (entry.is_regular_file()) {
      EXPECT_FALSE(contains(test::text_of(entry.path()), "Quentin")) << entry.path();
    }
  ASSERT_EQ(made.trials().size(), 1u);
  EXPECT_EQ(made.trials()[0].participant, "Rosa");
  // A number is not used again: a note may name it.
  EXPECT_EQ(made.add_trial("Sam", ParticipantKind::human).number, 4);
  EXPECT_TRUE(contains(refusal([&] { made.forget("Quentin"); }), "has no trial of Quentin"));
}

TEST_F(StudyFolderTest, NamesFilesThatStillMentionTheParticipant) {
  StudyFolder made = study();
  made.add_trial("P1", ParticipantKind::human);
  StoredTrial other = made.add_trial("P10", ParticipantKind::human);
  other.notes = {{1, "as P1 did"}};
  made.save(other);
  const Forgotten forgotten = made.forget("P1");
  EXPECT_EQ(forgotten.trials, 1);
  EXPECT_EQ(forgotten.mentioned_in, (std::vector<fs::path>{made.folder_of(2) / "trial.json"}));
}

// At the start, at the end, and across the blocks in which files are read.
TEST_F(StudyFolderTest, FindsThePseudonymAnywhereInAFile) {
  StudyFolder made = study();
  made.add_trial("Rosalind", ParticipantKind::human);
  for (const std::size_t before : {0, 1, 5, (1 << 20) - 9, (1 << 20) - 8, (1 << 20) - 7,
                                   (1 << 20) - 3, 1 << 20, (1 << 20) + 1})
    for (const bool is_word : {true, false}) {
      std::string text(before, '-');
      text += is_word ? "Rosalind" : "Rosalinde";
      const fs::path file = folder_.path / "file.csv";
      std::ofstream(file) << text;
      EXPECT_EQ(PseudonymSearch("Rosalind").is_in_content(file), is_word) << before;
      // Not a text: the pseudonym need not be a word.
      std::ofstream(file, std::ios::binary) << '\0' << text;
      EXPECT_TRUE(PseudonymSearch("Rosalind").is_in_content(file)) << before;
      EXPECT_FALSE(PseudonymSearch("Rosal").is_in_content(file)) << "by chance";
    }
}

TEST_F(StudyFolderTest, FindsOtherFormsOfThePseudonym) {
  const fs::path file = folder_.path / "file.md";
  const auto finds = [&](const std::string& pseudonym, const std::string& text) {
    std::ofstream(file) << text;
    return PseudonymSearch(pseudonym).is_in_content(file);
  };
  EXPECT_TRUE(finds("Rosa", "as ROSA did"));
  EXPECT_TRUE(finds("ROSA", "rosa's"));
  EXPECT_TRUE(finds("Zo\u00c9", "ZO\u00c9"));
  EXPECT_TRUE(finds("Zo\u00c9", "zo\u00e9"));
  EXPECT_TRUE(finds("\u0394\u03a9", "\u03b4\u03c9"));           // Greek
  EXPECT_TRUE(finds("Zo\u00e9", "{\"name\": \"zo\\u00e9\"}"));  // JSON in ASCII
  EXPECT_TRUE(finds("a\"b", R"({"name": "a\"b"})"));
  EXPECT_TRUE(finds("A <1>", "<b>A &lt;1&gt;</b>"));
  EXPECT_TRUE(finds("A <1>", R"({"name":"A \u003c1\u003e"})"));
  EXPECT_TRUE(finds("a\"b", "\"a\"\"b\",1\r\n"));
  EXPECT_TRUE(finds("P1", "video_P1_left"));
  EXPECT_FALSE(finds("P1", "P10, XP1"));
  EXPECT_FALSE(finds("Rosa", ""));
  EXPECT_THROW(PseudonymSearch("Rosa").is_in_content(folder_.path / "absent"), std::system_error);
}

// Whatever a person has put there, and what an interrupted command left.
TEST_F(StudyFolderTest, NamesAllFilesAndFoldersThatHaveThePseudonym) {
  StudyFolder made = study();
  made.add_trial("Quentin", ParticipantKind::human);
  made.add_trial("Rosa", ParticipantKind::human);
  const fs::path root = made.path(), other = made.folder_of(2);
  fs::create_directories(root / "export QUENTIN" / "meshes");
  fs::create_directories(other / "run_1");
  std::ofstream(root / "export QUENTIN" / "meshes" / "000001.ply") << "ply";
  for (const fs::path& file : {root / "notes.md", other / "trial.json.part",
                               other / "run_1" / "log", root / "deployment" / "scene.yaml.before"})
    std::ofstream(file) << "of quentin";
  std::ofstream(other / "quentin_left.mp4") << "video";
  fs::create_symlink(made.folder_of(1) / "recording_1.mcap", other / "Quentin.mcap");
  const Forgotten forgotten = made.forget("Quentin");
  std::vector<fs::path> expected{root / "export QUENTIN",
                                 root / "notes.md",
                                 other / "trial.json.part",
                                 other / "run_1" / "log",
                                 root / "deployment" / "scene.yaml.before",
                                 other / "quentin_left.mp4",
                                 other / "Quentin.mcap"};
  std::ranges::sort(expected);
  EXPECT_EQ(forgotten.mentioned_in, expected);
  EXPECT_EQ(forgotten.unknown, (std::vector<fs::path>{root / "export QUENTIN", root / "notes.md"}));
  // It searches again, until nothing is left.
  for (const fs::path& file : expected) fs::remove_all(file);
  EXPECT_TRUE(contains(refusal([&] { made.forget("Quentin"); }), "has no trial of Quentin"));
}

// An export of a recording has no pseudonym in it, and is of no trial.
TEST_F(StudyFolderTest, NamesWhatMayHoldFramesOfTheParticipant) {
  StudyFolder made = study();
  made.add_trial("Quentin", ParticipantKind::human);
  made.add_trial("Rosa", ParticipantKind::human);
  fs::create_directories(made.path() / "export" / "meshes");
  std::ofstream(made.path() / "export" / "meshes" / "000001.ply") << "ply";
  fs::create_directories(made.path() / "trials" / "0009");  // without a trial.json
  const Forgotten forgotten = made.forget("Quentin");
  EXPECT_TRUE(forgotten.mentioned_in.empty());
  EXPECT_EQ(forgotten.unknown,
            (std::vector<fs::path>{made.path() / "export", made.path() / "trials" / "0009"}));
}

TEST_F(StudyFolderTest, ForgetsNoOneElse) {
  StudyFolder made = study();
  made.add_trial("Rosa", ParticipantKind::human);
  EXPECT_TRUE(contains(refusal([&] { made.forget("rosa"); }), "has no trial of rosa, but of Rosa"));
  // After `run` was killed, its deployment still writes.
  fs::create_directories(made.folder_of(1) / "run_1");
  {
    const launch::FolderClaim deployment(made.folder_of(1) / "run_1");
    EXPECT_THROW(made.forget("Rosa"), launch::ClaimRefused);
  }
  EXPECT_EQ(made.trials().size(), 1u);
  EXPECT_EQ(made.forget("Rosa").trials, 1);
}

TEST_F(StudyFolderTest, WritesThePoseOfAPart) {
  const StudyFolder made = study();
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
  const fs::path file = write_pose(made, "side_block", pose);
  EXPECT_EQ(file.filename(), "scene.yaml");
  for (const config::SceneObject& object : made.deployment().scene.objects) {
    if (object.name == "side_block") {
      EXPECT_TRUE(object.world_from_object.isApprox(pose, 1e-5));
    }
  }
  EXPECT_TRUE(contains(test::text_of(file), "# Next to the hand's path."));
  EXPECT_FALSE(fs::exists(file.string() + ".before"));
  EXPECT_TRUE(contains(refusal([&] { write_pose(made, "absent", pose); }), "one key per line"));
}

TEST(AnswerFrom, ReadsWhatPeopleWrite) {
  const auto equals = [](const std::string& text, const Answer& expected) {
    const Answer found = answer_from(text);
    EXPECT_DOUBLE_EQ(found.low_m, expected.low_m) << text;
    EXPECT_EQ(found.high_m.has_value(), expected.high_m.has_value()) << text;
    if (found.high_m && expected.high_m) {
      EXPECT_DOUBLE_EQ(*found.high_m, *expected.high_m) << text;
    }
    EXPECT_EQ(found.remark, expected.remark) << text;
  };
  equals("15cm", {0.15});
  equals(" 22.5 cm ", {0.225});
  equals("15-16cm", {0.15, 0.16});
  equals("15cm - 160 mm", {0.15, 0.16});
  equals("15 to 16 cm", {0.15, 0.16});
  equals("16.0cm  adjust the tool", {0.16, std::nullopt, "adjust the tool"});
  equals("15-16cm (tight)", {0.15, 0.16, "(tight)"});
  for (const char* text : {"", "15", "cm", "about 15cm", "16-15cm", "-3cm", "1e9m", "15cm-",
                           "1.2.3cm", "15cm - 16", "15cm to 16", "15cm \xff"})
    EXPECT_THROW(answer_from(text), base::UsageError) << text;
}

// Unlike a spacing, which is where a part is, a space is an amount.
TEST(AnswerFrom, StatesThatANegativeOneIsNone) {
  for (const char* text : {"-3cm", " - 0.5 cm",
                           "\xe2\x88\x92"
                           "3cm",
                           "-3 to 4cm"})
    try {
      answer_from(text);
      FAIL() << text;
    } catch (const base::UsageError& error) {
      EXPECT_EQ(std::string(error.what()),
                "'" + std::string(text) +
                    "' is negative; an answer is how much space there is, at least 0 cm");
    }
  EXPECT_EQ(answer_from("0cm").low_m, 0);
}

}  // namespace
}  // namespace fivepipe::study
