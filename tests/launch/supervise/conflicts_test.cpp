// Other deployments in the same domain.
#include "launch/supervise/hosts/conflicts.h"

#include <gtest/gtest.h>

#include <functional>

namespace fivepipe::launch {
namespace {

const RunIdentity kAlpha{"lab one", "alpha", "a.lab", 4711, 1'000};

RunIdentity changed(const std::function<void(RunIdentity&)>& change) {
  RunIdentity run = kAlpha;
  change(run);
  return run;
}

TEST(Conflicts, TheNameOfTheParticipantHoldsTheRun) {
  EXPECT_EQ(participant_name(kAlpha),
            "fivepipe-up/1 pid=4711 start=1000 machine=a.lab host=alpha deployment=lab one");
  for (const RunIdentity& run :
       {kAlpha, changed([](RunIdentity& r) { r.host = ""; }),
        changed([](RunIdentity& r) { r.deployment = "pid=1 deployment=x"; }),
        changed([](RunIdentity& r) { r.start_stamp_ns = -5; })})
    EXPECT_EQ(run_of_participant(participant_name(run)), run) << participant_name(run);
  EXPECT_EQ(
      run_of_participant(participant_name(changed([](RunIdentity& r) { r.host = "a b"; })))->host,
      "a_b");
}

TEST(Conflicts, OtherNamesAreNoRun) {
  const std::string name = participant_name(kAlpha);
  for (const std::string& other :
       {std::string(), std::string("capture"), std::string("fivepipe-up/2") + name.substr(13),
        std::string("fivepipe-up/1 "), name.substr(0, 30), name.substr(0, name.find("deployment=")),
        std::string("fivepipe-up/1 pid=x start=1 machine=a host=b deployment=c"),
        std::string("fivepipe-up/1 pid=1 start=1e9 machine=a host=b deployment=c"),
        std::string(
            "fivepipe-up/1 pid=99999999999999999999 start=1 machine=a host=b deployment=c")})
    EXPECT_FALSE(run_of_participant(other)) << other;
}

TEST(Conflicts, HostsOfOneDeploymentAreNone) {
  const auto other = changed([](RunIdentity& r) { r.host = "beta"; });
  EXPECT_FALSE(are_in_conflict(kAlpha, other));
  EXPECT_TRUE(are_in_conflict(kAlpha, changed([](RunIdentity& r) { r.machine = "b.lab"; })))
      << "the same host twice";
  EXPECT_TRUE(
      are_in_conflict(changed([](RunIdentity& r) { r.host = ""; }), changed([](RunIdentity& r) {
                        r.host = "";
                        r.machine = "b.lab";
                      })))
      << "a deployment without hosts, on two machines";
  EXPECT_TRUE(are_in_conflict(other, changed([](RunIdentity& r) { r.deployment = "demo"; })));
}

TEST(Conflicts, TheLaterOneGivesWay) {
  const std::int64_t now_ns = 5'000;
  for (const RunIdentity& other : {changed([](RunIdentity& r) { r.start_stamp_ns = 999; }),
                                   changed([](RunIdentity& r) { r.start_stamp_ns = 1'001; }),
                                   changed([](RunIdentity& r) { r.machine = "b.lab"; }),
                                   changed([](RunIdentity& r) { r.pid = 12; })})
    EXPECT_NE(gives_way(kAlpha, other, now_ns), gives_way(other, kAlpha, now_ns))
        << participant_name(other);
  EXPECT_TRUE(gives_way(kAlpha, changed([](RunIdentity& r) { r.start_stamp_ns = 999; }), now_ns));
  // The clock of the other machine is ahead, so that it may have started earlier.
  EXPECT_TRUE(gives_way(kAlpha, changed([](RunIdentity& r) { r.start_stamp_ns = 5'001; }), now_ns));
}

TEST(Conflicts, AreFoundAmongTheParticipants) {
  const auto demo = changed([](RunIdentity& r) {
    r.deployment = "demo";
    r.pid = 12;
  });
  const auto beta = changed([](RunIdentity& r) { r.host = "beta"; });
  EXPECT_EQ(conflicts_of(kAlpha, {"capture", participant_name(demo), "", participant_name(kAlpha),
                                  participant_name(beta), participant_name(demo)}),
            std::vector<RunIdentity>{demo});
  EXPECT_EQ(text_of(demo), "deployment demo, process 12 on machine a.lab");
}

}  // namespace
}  // namespace fivepipe::launch
