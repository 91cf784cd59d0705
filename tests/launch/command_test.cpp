// Runs the built `fivepipe` command.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

struct Answer {
  int exit_code = -1;
  std::string text;  // stdout and stderr
};

Answer fivepipe(const std::string& arguments) {
  Answer answer;
  FILE* pipe = popen((FIVEPIPE_BINARY_DIR "/fivepipe " + arguments + " 2>&1").c_str(), "r");
  if (!pipe) return answer;
  char buffer[4096];
  while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe))
    answer.text.append(buffer, got);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) answer.exit_code = WEXITSTATUS(status);
  return answer;
}

}  // namespace

TEST(Command, UsageErrorsExitWithTwo) {
  for (const char* arguments :
       {"", "fly", "up", "up demo.yaml --duration -3", "up demo.yaml --set novalue",
        "up demo.yaml --set =x", "up demo.yaml --domain 231", "top --once --domain 231",
        "simulation pause --domain 231", "top --surely-not", "bench", "bench no_such_suite"}) {
    const Answer answer = fivepipe(arguments);
    EXPECT_EQ(answer.exit_code, 2) << arguments << "\n" << answer.text;
    EXPECT_FALSE(answer.text.empty()) << arguments;
  }
}

TEST(Command, MissingDeploymentIsAConfigurationError) {
  const Answer answer = fivepipe("up /no/such/deployment.yaml");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_NE(answer.text.find("/no/such/deployment.yaml"), std::string::npos) << answer.text;
}

TEST(Command, HelpOfEverySubcommandHasAnExample) {
  for (const char* subcommand :
       {"", "up ", "top ", "record ", "replay ", "info ", "ls ", "echo ", "hz ", "simulation ",
        "doctor ", "bench ", "maps ", "bench simulation ", "bench compare "}) {
    const Answer answer = fivepipe(std::string(subcommand) + "--help");
    EXPECT_EQ(answer.exit_code, 0) << answer.text;
    EXPECT_NE(answer.text.find("Example"), std::string::npos) << subcommand << "\n" << answer.text;
    EXPECT_NE(answer.text.find("fivepipe " + std::string(subcommand)), std::string::npos)
        << answer.text;
  }
}

TEST(Command, MapsOfOneFrameAreImagesAndCameras) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("fivepipe_maps_" + std::to_string(getpid()));
  const Answer answer =
      fivepipe("maps " FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml --frame 30 --out " +
               folder.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  std::ifstream cameras(folder / "cameras.txt");
  int count = 0;
  for (std::string line; std::getline(cameras, line);) {
    if (line.empty() || line.front() == '#') continue;
    std::ifstream image(folder / (line.substr(0, line.find(' ')) + ".pbm"), std::ios::binary);
    std::string magic;
    image >> magic;
    EXPECT_EQ(magic, "P4") << line;
    ++count;
  }
  EXPECT_GE(count, 3);
  std::filesystem::remove_all(folder);
  EXPECT_EQ(fivepipe("maps /no/such.yaml --out " + folder.string()).exit_code, 2);
  EXPECT_EQ(fivepipe("maps").exit_code, 2);
}

TEST(Command, VersionIsOneLine) {
  const Answer answer = fivepipe("--version");
  EXPECT_EQ(answer.exit_code, 0);
  EXPECT_EQ(answer.text.rfind("fivepipe 0.", 0), 0u) << answer.text;
  EXPECT_EQ(answer.text.find('\n'), answer.text.size() - 1);
}

TEST(Command, TopReportsThatTheLargestDomainIsSilent) {
  const Answer answer = fivepipe("top --once --domain 230");
  EXPECT_EQ(answer.exit_code, 3) << answer.text;
  EXPECT_NE(answer.text.find("no node publishes a status in domain 230"), std::string::npos)
      << answer.text;
}

TEST(Command, DoctorFindsThisMachineReady) {
  const Answer answer = fivepipe("doctor --domain 198");
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const char* part :
       {"build:", "GL:", "receive buffers", "loopback", "DDS", "cores", "disk", "camera"})
    EXPECT_NE(answer.text.find(part), std::string::npos) << part << " is not in\n" << answer.text;
}
