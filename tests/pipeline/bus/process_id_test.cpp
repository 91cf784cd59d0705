#include <dds/dds.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <set>

#include "common/base/machine.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/profile.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;
using test::eventually;
constexpr auto kTimeout = 20s;

TEST(ProcessId, SurvivesItsUserData) {
  const ProcessId process{"alpha", 4711, 0x0123456789abcdef};
  EXPECT_EQ(to_user_data(process), "fivepipe/1 pid=4711 start=0123456789abcdef host=alpha");
  EXPECT_EQ(from_user_data(to_user_data(process)), process);
  EXPECT_EQ(from_user_data(to_user_data(this_process())), this_process());
}

TEST(ProcessId, StandsBesideTheDeployment) {
  const ProcessId process{"alpha", 4711, 0x0123456789abcdef};
  const std::string text = to_user_data(process, "lab one");
  EXPECT_EQ(text, "fivepipe/1 pid=4711 start=0123456789abcdef host=alpha deployment=lab one");
  EXPECT_EQ(from_user_data(text), process);
  EXPECT_EQ(deployment_from_user_data(text), "lab one");
  EXPECT_EQ(deployment_from_user_data(to_user_data(process)), "");
  EXPECT_EQ(deployment_from_user_data("other deployment=lab one"), "");
  EXPECT_EQ(deployment_from_user_data(to_user_data(process, "a\x1b[2J")), "");
  EXPECT_EQ(deployment_from_user_data(to_user_data(process, std::string(300, 'a'))).size(), 256u);
}

TEST(ProcessId, EachPartDistinguishesProcesses) {
  const ProcessId process{"alpha", 4711, 1};
  EXPECT_NE(process, (ProcessId{"beta", 4711, 1}));
  EXPECT_NE(process, (ProcessId{"alpha", 4712, 1}));
  EXPECT_NE(process, (ProcessId{"alpha", 4711, 2}));
}

TEST(ProcessId, OtherUserDataStateNoIdentity) {
  const std::string start = " start=0123456789abcdef";
  for (const std::string& text :
       {std::string(), std::string("fivepipe/1"), "fivepipe/2 pid=1" + start + " host=alpha",
        "fivepipe/1 pid=" + start + " host=alpha", "fivepipe/1 pid=-1" + start + " host=alpha",
        "fivepipe/1 pid=4294967296" + start + " host=alpha",
        std::string("fivepipe/1 pid=1 start=0123 host=alpha"),
        std::string("fivepipe/1 pid=1 start=0123456789abcdeg host=alpha"),
        std::string("fivepipe/1 pid=0123456789abcdef host=alpha"), "fivepipe/1 pid=1" + start,
        "fivepipe/1 pid=1" + start + " host=", "fivepipe/1 pid=1" + start + " host=a\x1b[2J",
        "fivepipe/1 pid=1" + start + " host=a b",
        "fivepipe/1 pid=1" + start + " host=" + std::string(65, 'a')})
    EXPECT_FALSE(from_user_data(text)) << text;
}

TEST(ProcessId, HostNamesHaveUpTo64PrintableCharacters) {
  const auto accepts = [](const std::string& host) {
    const ProcessId process{host, 1, 2};
    return from_user_data(to_user_data(process)) == process;
  };
  for (const std::string& host : {std::string("!"), std::string("~"), std::string(64, 'a')})
    EXPECT_TRUE(accepts(host)) << host;
  for (const std::string& host : {std::string(" "), std::string("\x7f"), std::string(65, 'a')})
    EXPECT_FALSE(accepts(host)) << host;
}

TEST(ProcessId, ParticipantWithoutUserDataIsUnknown) {
  const std::uint32_t domain = test::own_domain();
  Bus bus({domain});
  auto reader = bus.reader<topics::FrameComposited>();
  const detail::Entity participant(dds_create_participant(domain, nullptr, nullptr));
  const dds_entity_t topic =
      dds_create_topic(participant.handle, topics::FrameComposited::descriptor,
                       topics::FrameComposited::name, nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  const dds_entity_t writer = dds_create_writer(participant.handle, topic, qos, nullptr);
  dds_delete_qos(qos);
  ASSERT_TRUE(eventually(bus, kTimeout, [&] { return reader.writers() == 1; }));
  const fivepipe_v1_FrameComposited message{};
  ASSERT_EQ(dds_write(writer, &message), DDS_RETCODE_OK);
  bool seen = false;
  EXPECT_TRUE(eventually(bus, kTimeout, [&] {
    for (const auto& sample : reader.take()) {
      seen = true;
      EXPECT_FALSE(reader.process(sample));
    }
    return seen;
  }));
}

// The handle and the identity in each status of the node.
struct StatusWriters {
  std::set<std::uint64_t> handles;
  std::set<std::optional<ProcessId>> processes;

  void take(Reader<topics::NodeStatus>& reader) {
    for (const auto& sample : reader.take())
      if (sample.valid()) {
        handles.insert(sample.writer());
        processes.insert(reader.process(sample));
      }
  }
};

TEST(ProcessId, StaysThatOfAProcessThatWasSilentForLongerThanItsLease) {
  // A shorter lease than that of the profile shortens the test.
  unsetenv("CYCLONEDDS_URI");
  std::string profile = profile_xml("loopback");
  const std::string lease = "<LeaseDuration>2s", short_lease = "<LeaseDuration>500ms";
  ASSERT_NE(profile.find(lease), std::string::npos);
  setenv("CYCLONEDDS_URI", profile.replace(profile.find(lease), lease.size(), short_lease).c_str(),
         1);
  const std::uint32_t domain = test::own_domain();
  Bus bus({domain});
  auto reader = bus.reader<topics::NodeStatus>();
  const test::TestFolder folder;
  const test::Program node({FIVEPIPE_BINARY_DIR "/status_writer", "sim", std::to_string(domain)},
                           folder.path / "log");
  unsetenv("CYCLONEDDS_URI");  // other tests may run after this one in the same process
  StatusWriters seen;
  ASSERT_TRUE(eventually(bus, kTimeout, [&] {
    seen.take(reader);
    return !seen.handles.empty();
  })) << node.said();
  node.signal(SIGSTOP);
  ASSERT_TRUE(eventually(bus, kTimeout, [&] {
    seen.take(reader);
    return reader.writers() == 0;
  }));
  node.signal(SIGCONT);
  EXPECT_TRUE(eventually(bus, kTimeout, [&] {
    seen.take(reader);
    return seen.handles.size() == 2;
  })) << "DDS kept the publication handle: the test does not test what it claims";
  ASSERT_EQ(seen.processes.size(), 1u);
  const std::optional<ProcessId> process = *seen.processes.begin();
  ASSERT_TRUE(process);
  EXPECT_EQ(process->pid, std::uint32_t(node.pid()));
  EXPECT_EQ(process->host, base::host_name());
  EXPECT_NE(process->start_id, this_process().start_id);
  EXPECT_NE((process->start_id | this_process().start_id) >> 48, 0u) << "has 64 random bits";
}

}  // namespace
}  // namespace fivepipe::bus
