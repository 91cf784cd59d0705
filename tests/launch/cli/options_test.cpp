// The command line of `fivepipe`: options, their limits and defaults, and the keys of a replay.
#include "launch/cli/options.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "launch/cli/commands.h"
#include "launch/cli/replay_keys.h"
#include "tests/support/captured_log.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

class CommandLine : public testing::Test {
 protected:
  CommandLine() {
    std::ofstream(file_) << "text";
    for (const auto add :
         {add_up, add_top, add_record, add_replay, add_info, add_ls, add_echo, add_hz,
          add_simulation, add_keys, add_doctor, add_bench, add_maps, add_cameras})
      add(app_, command_);
  }
  // Parses the words of a line. The word FILE names an existing file.
  bool accepts(const std::string& line) {
    std::vector<std::string> words;
    std::istringstream in(line);
    for (std::string word; in >> word;) words.insert(words.begin(), word == "FILE" ? file_ : word);
    command_ = nullptr;
    try {
      app_.parse(words);
    } catch (const CLI::ParseError&) {
      return false;
    }
    return command_ != nullptr;
  }
  // The names, types, limits and defaults of the options in a subcommand's help.
  std::string options_of(const std::string& subcommand) const {
    std::istringstream help(app_.get_subcommand(subcommand)->help());
    std::string options;
    for (std::string line; std::getline(help, line) && line != "Examples:" && line != "Example:";)
      if (line.starts_with("  ") && line[2] != ' ')
        options += line.substr(2, line.find("  ", 2) - 2) + "\n";
    return options;
  }

  const test::TestFolder folder_;
  const std::string file_ = folder_.path / "file";
  CLI::App app_;
  Command command_;
};

const std::string kHelp = "-h,--help\n",
                  kHost =
                      "--host TEXT Needs: --deployment Excludes: --local\n"
                      "--local Needs: --deployment Excludes: --host\n",
                  kNetwork =
                      "--domain UINT:INT in [0 - 230]=0\n"
                      "--profile TEXT:{loopback}=loopback Excludes: --deployment\n"
                      "--deployment TEXT Excludes: --profile\n--set TEXT:KEY=VALUE ...\n" +
                      kHost,
                  kRange = "--start FLOAT:FLOAT in [0 - 1e+08]\n--end FLOAT:FLOAT in [0 - 1e+08]\n";

TEST_F(CommandLine, HelpListsEachOptionWithItsLimitsAndDefault) {
  EXPECT_EQ(options_of("up"), "DEPLOYMENT TEXT REQUIRED\n" + kHelp +
                                  "--host TEXT Excludes: --local\n--local Excludes: --host\n"
                                  "--duration FLOAT:POSITIVE\n--out TEXT\n"
                                  "--set TEXT:KEY=VALUE ...\n--every-frame\n--allow-clock-offset\n"
                                  "--no-watchdog\n"
                                  "--record TEXT\n"
                                  "--record-option TEXT ...\n--domain UINT:INT in [0 - 230]\n");
  EXPECT_EQ(options_of("top"), kHelp + kNetwork + "--once\n");
  EXPECT_EQ(options_of("record"), kHelp +
                                      "-o,--output TEXT REQUIRED\n--force\n--deployment TEXT\n"
                                      "--set TEXT:KEY=VALUE ...\n--topics TEXT:RE=.*\n--no-colour\n"
                                      "--compression TEXT:{lz4,none,zstd}=lz4\n--no-sync\n"
                                      "--duration FLOAT:POSITIVE\n--name TEXT=recorder\n"
                                      "--domain UINT:INT in [0 - 230]\n"
                                      "--profile TEXT:{loopback}=loopback\n" +
                                      kHost);
  EXPECT_EQ(options_of("replay"),
            "FILE TEXT:FILE REQUIRED\n" + kHelp + "--rate TEXT:R|max=1\n" + kRange +
                "--topics TEXT:RE=.*\n--inputs-of TEXT ...\n--set TEXT:KEY=VALUE ...\n"
                "--lossless\n--in-flight INT:INT in [1 - 6]=2\n--loop\n--paused\n"
                "--wait FLOAT:POSITIVE=20\n--no-wait\n--force\n" +
                test::replaced(kNetwork, "--set TEXT:KEY=VALUE ...\n", ""));
  EXPECT_EQ(options_of("info"),
            "FILE TEXT:FILE REQUIRED\n" + kHelp +
                "--recover Excludes: --extract\n--output TEXT Needs: --recover\n"
                "--extract TEXT Excludes: --recover --quick --json\n--quick Excludes: --extract "
                "read the index only: shows no MB by topic and checks no CRCs\n"
                "--json Excludes: --extract\n");
  const std::string live =
      "--domain UINT:INT in [0 - 230]=0 Excludes: FILE\n"
      "--profile TEXT:{loopback}=loopback Excludes: FILE --deployment\n"
      "--deployment TEXT Excludes: FILE --profile\n--set TEXT:KEY=VALUE ...\n" +
      kHost;
  EXPECT_EQ(options_of("ls"), "FILE TEXT:FILE Excludes: --domain --profile --deployment\n" + kHelp +
                                  "--nodes\n" + live);
  const std::string live_or_from =
      "--domain UINT:INT in [0 - 230]=0 Excludes: --from\n"
      "--profile TEXT:{loopback}=loopback Excludes: --from --deployment\n"
      "--deployment TEXT Excludes: --from --profile\n--set TEXT:KEY=VALUE ...\n" +
      kHost;
  EXPECT_EQ(
      options_of("echo"),
      "TOPIC TEXT REQUIRED\n" + kHelp +
          "--from TEXT:FILE Excludes: --domain --profile --deployment\n--count UINT:POSITIVE\n"
          "--start FLOAT:FLOAT in [0 - 1e+08] Needs: --from\n"
          "--end FLOAT:FLOAT in [0 - 1e+08] Needs: --from\n"
          "--field TEXT\n--full\n--json\n--hex\n--bare\n" +
          live_or_from);
  EXPECT_EQ(options_of("hz"),
            "TOPIC TEXT REQUIRED\n" + kHelp +
                "--from TEXT:FILE Excludes: --once --domain --profile --deployment\n"
                "--once FLOAT:FLOAT in [0.1 - 86400] Excludes: --from\n" +
                live_or_from);
  EXPECT_EQ(options_of("simulation"),
            "COMMAND TEXT:{pause,reset,resume} REQUIRED\n" + kHelp + "--node TEXT\n" + kNetwork);
  EXPECT_EQ(options_of("keys"), "DEPLOYMENT TEXT REQUIRED\n" + kHelp +
                                    "--set TEXT:KEY=VALUE ...\n--protection TEXT:{encrypt,sign}\n"
                                    "--days INT:INT in [1 - 3650]=365\n--force\n");
  EXPECT_EQ(options_of("doctor"), kHelp + kNetwork + "--wait FLOAT:FLOAT in [0 - 3600]\n");
  EXPECT_EQ(options_of("bench"), kHelp);
  EXPECT_EQ(options_of("maps"), "");
  EXPECT_EQ(options_of("cameras"), "");
}

TEST_F(CommandLine, ValuesWithinTheirLimitsAreAccepted) {
  for (const char* line : {"up a.yaml",
                           "up --set a=1 a.yaml",
                           "up --record-option=--force a.yaml",
                           "up --record-option --force a.yaml --domain 230",
                           "up a.yaml --domain 0 --duration 0.1",
                           "top",
                           "record -o x",
                           "record -o x --topics a|b --compression none --duration 0.1",
                           "replay FILE",
                           "replay --rate max FILE",
                           "replay --rate 1000 FILE --in-flight 6",
                           "replay --rate 0.001 FILE --in-flight 1",
                           "replay --inputs-of a --set b=c FILE",
                           "replay FILE --start 0 --end 100000000 --wait 0.1",
                           "info FILE",
                           "info FILE --recover",
                           "info FILE --recover --output x --quick --json",
                           "info FILE --extract x",
                           "ls",
                           "ls FILE",
                           "ls --domain 7 --nodes",
                           "echo a",
                           "echo a --from FILE --start 0.5 --end 1 --count 1",
                           "echo a --domain 3 --profile loopback",
                           "hz a",
                           "hz a --once 0.1",
                           "hz a --once 86400",
                           "hz a --from FILE",
                           "simulation pause",
                           "simulation resume --node a",
                           "simulation reset",
                           "doctor",
                           "bench",
                           "bench --any thing",
                           "maps",
                           "maps --any thing"})
    EXPECT_TRUE(accepts(line)) << line;
}

TEST_F(CommandLine, ValuesOutsideTheirLimitsAreRefused) {
  for (const char* line : {"up",
                           "up a.yaml --set a",
                           "up a.yaml --set =a",
                           "up a.yaml b.yaml",
                           "up --set a=1 b=2 c",
                           "up --record-option a b c",
                           "up a.yaml --domain 231",
                           "up a.yaml --domain -1",
                           "up a.yaml --duration 0",
                           "top --profile x",
                           "record",
                           "record -o x --topics (",
                           "record -o x --compression gz",
                           "record -o x --duration 0",
                           "record -o x --set a",
                           "replay",
                           "replay /no/such",
                           "replay FILE --rate 0",
                           "replay FILE --rate -1",
                           "replay FILE --rate 1000.1",
                           "replay FILE --rate x",
                           "replay FILE --rate 1x",
                           "replay FILE --rate nan",
                           "replay FILE --rate 1e999",
                           "replay FILE --in-flight 0",
                           "replay FILE --in-flight 7",
                           "replay FILE --wait 0",
                           "replay FILE --start -1",
                           "replay FILE --end 100000001",
                           "replay FILE --inputs-of a b",
                           "replay FILE --topics *",
                           "info",
                           "info /no/such",
                           "info FILE --output x",
                           "info FILE --extract x --recover",
                           "info FILE --extract x --quick",
                           "info FILE --extract x --json",
                           "ls /no/such",
                           "ls FILE --domain 1",
                           "ls FILE --profile loopback",
                           "echo",
                           "echo a --from /no/such",
                           "echo a --start 1",
                           "echo a --end 1",
                           "echo a --count 0",
                           "echo a --count -1",
                           "echo a --from FILE --domain 1",
                           "echo a --from FILE --profile loopback",
                           "hz",
                           "hz a --from /no/such",
                           "hz a --once 0.09",
                           "hz a --once 86401",
                           "hz a --from FILE --once 1",
                           "hz a --from FILE --domain 1",
                           "hz a --from FILE --profile loopback",
                           "simulation",
                           "simulation stop",
                           "doctor x"})
    EXPECT_FALSE(accepts(line)) << line;
}

TEST(Options, SettingsAreSplitAtTheirFirstEqualsSign) {
  EXPECT_EQ(settings_from({"a=1", "bc=d=e", "a=2", "f="}),
            (std::map<std::string, std::string>{{"a", "2"}, {"bc", "d=e"}, {"f", ""}}));
}

TEST(Options, ARateIsANumberOrMax) {
  EXPECT_EQ(rate_from("max"), 0);
  EXPECT_EQ(rate_from("0.25"), 0.25);
}

// A pipe is the keyboard.
class KeysOfAReplay : public testing::Test {
 protected:
  KeysOfAReplay() {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    dup2(ends[0], STDIN_FILENO);
    close(ends[0]);
    keyboard_ = ends[1];
  }
  ~KeysOfAReplay() override {
    hang_up();
    dup2(stdin_, STDIN_FILENO);
    close(stdin_);
  }
  void type(const std::string& keys) const {
    ASSERT_EQ(write(keyboard_, keys.data(), keys.size()), ssize_t(keys.size()));
  }
  void hang_up() {
    if (keyboard_ >= 0) close(keyboard_);
    keyboard_ = -1;
  }

 private:
  const int stdin_ = dup(STDIN_FILENO);
  int keyboard_;
};

using replay::ReplayControl;

TEST_F(KeysOfAReplay, SpacePausesAndContinuesAndQStops) {
  ReplayKeys keys(false);
  EXPECT_EQ(keys.control(), ReplayControl::resume);
  type("x ");
  EXPECT_EQ(keys.control(), ReplayControl::pause);
  EXPECT_EQ(keys.control(), ReplayControl::pause);
  EXPECT_TRUE(keys.paused());
  type(" ");
  EXPECT_EQ(keys.control(), ReplayControl::resume);
  EXPECT_FALSE(keys.paused());
  type("q");
  EXPECT_EQ(keys.control(), ReplayControl::stop);
  EXPECT_EQ(keys.control(), ReplayControl::stop);
}

TEST_F(KeysOfAReplay, EachSIsOneStepOfAPausedReplay) {
  ReplayKeys keys(false);
  type("ss");
  EXPECT_EQ(keys.control(), ReplayControl::step);
  EXPECT_TRUE(keys.paused());
  EXPECT_EQ(keys.control(), ReplayControl::step);
  EXPECT_EQ(keys.control(), ReplayControl::pause);
  type("s");
  EXPECT_EQ(keys.control(), ReplayControl::step);
  EXPECT_EQ(keys.control(), ReplayControl::pause);
  type(" ");
  EXPECT_EQ(keys.control(), ReplayControl::resume);
}

TEST_F(KeysOfAReplay, TheEndOfTheInputStopsOnlyAPausedReplay) {
  ReplayKeys running(false);
  ReplayKeys paused(true);
  EXPECT_TRUE(paused.paused());
  EXPECT_EQ(paused.control(), ReplayControl::pause);
  type("s");
  hang_up();
  const test::CapturedLog log;
  EXPECT_EQ(paused.control(), ReplayControl::step);
  EXPECT_EQ(log.text(), "");
  EXPECT_EQ(paused.control(), ReplayControl::stop);
  EXPECT_EQ(paused.control(), ReplayControl::stop);
  const std::string text = log.text(), reason = "stdin closed while paused";
  EXPECT_NE(text.find(reason), std::string::npos) << text;
  EXPECT_EQ(text.find(reason), text.rfind(reason)) << "once";
  EXPECT_EQ(running.control(), ReplayControl::resume);
  EXPECT_EQ(running.control(), ReplayControl::resume);
}

// Runs `check` in a child process whose stdin is a terminal, in its foreground or its background.
// Returns whether it holds.
bool in_terminal(bool foreground, const std::function<bool(int keyboard)>& check) {
  const pid_t leader = fork();
  if (leader == 0) {
    setsid();
    const int keyboard = posix_openpt(O_RDWR | O_NOCTTY);
    if (grantpt(keyboard) != 0 || unlockpt(keyboard) != 0) _exit(2);
    const int terminal = open(ptsname(keyboard), O_RDWR);  // becomes the controlling terminal
    dup2(terminal, STDIN_FILENO);
    const pid_t job = fork();
    if (job == 0) {
      if (!foreground) setpgid(0, 0);
      _exit(check(keyboard) ? 0 : 1);
    }
    int status = 0;
    waitpid(job, &status, 0);
    _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 3);
  }
  int status = 0;
  return waitpid(leader, &status, 0) == leader && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

tcflag_t line_flags() {
  termios now{};
  tcgetattr(STDIN_FILENO, &now);
  return now.c_lflag & tcflag_t(ICANON | ECHO);
}

TEST(KeysInATerminal, AreReadWithoutReturnAndWithoutEchoAndTheTerminalIsRestored) {
  EXPECT_TRUE(in_terminal(true, [](int keyboard) {
    if (line_flags() != (ICANON | ECHO)) return false;
    {
      ReplayKeys keys(false);
      if (line_flags() != 0 || keys.control() != ReplayControl::resume) return false;
      if (write(keyboard, "q", 1) != 1 || keys.control() != ReplayControl::stop) return false;
    }
    return line_flags() == (ICANON | ECHO);
  }));
}

TEST(KeysInATerminal, ABackgroundJobReadsNoneAndLeavesTheTerminalAlone) {
  EXPECT_TRUE(in_terminal(false, [](int) {
    signal(SIGTTOU, SIG_IGN);
    ReplayKeys running(false), paused(true);
    return line_flags() == (ICANON | ECHO) && running.control() == ReplayControl::resume &&
           paused.control() == ReplayControl::stop;
  }));
}

}  // namespace
}  // namespace fivepipe::launch
