// Discovery of other participants' writers, also of many.
#include "common/pipeline/bus/discovery.h"

#include <dds/dds.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "common/pipeline/bus/serialized.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;
using Qos = std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)>;
using Topic = topics::FrameComposited;

// A plain DDS participant; it states a fivepipe identity if given one.
class Peer {
 public:
  explicit Peer(const std::string& identity = "") {
    const Qos qos(dds_create_qos(), dds_delete_qos);
    if (!identity.empty()) dds_qset_userdata(qos.get(), identity.data(), identity.size());
    participant_.emplace(dds_create_participant(test::own_domain(), qos.get(), nullptr));
    topic_ =
        dds_create_topic(participant_->handle, Topic::descriptor, Topic::name, nullptr, nullptr);
  }
  // Adds writers and returns their publication handles.
  std::vector<std::uint64_t> add_writers(std::size_t count) {
    const Qos qos(dds_create_qos(), dds_delete_qos);
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    std::vector<std::uint64_t> handles;
    for (std::size_t i = 0; i < count; ++i) {
      writers_.push_back(std::make_unique<detail::Entity>(
          dds_create_writer(participant_->handle, topic_, qos.get(), nullptr)));
      dds_get_instance_handle(writers_.back()->handle, &handles.emplace_back());
    }
    return handles;
  }
  dds_guid_t guid() const {
    dds_guid_t guid{};
    dds_get_guid(participant_->handle, &guid);
    return guid;
  }
  dds_entity_t participant() const { return participant_->handle; }

 private:
  std::optional<detail::Entity> participant_;
  dds_entity_t topic_ = 0;
  std::vector<std::unique_ptr<detail::Entity>> writers_;
};

TEST(Discovery, FindsTheIdentityThatAParticipantStates) {
  const Bus bus({test::own_domain()});  // sets up the domain
  const ProcessId identity{"alpha", 7, 8};
  const Peer unnamed, named(to_user_data(identity)), other(to_user_data({"beta", 7, 9}));
  const auto found = detail::process_of_participant(unnamed.participant(), named.guid());
  EXPECT_TRUE(found.discovered);
  EXPECT_EQ(found.process, identity);
  const auto without = detail::process_of_participant(unnamed.participant(), unnamed.guid());
  EXPECT_TRUE(without.discovered);
  EXPECT_FALSE(without.process);
  dds_guid_t unknown = named.guid();
  unknown.v[0] ^= 1;
  EXPECT_FALSE(detail::process_of_participant(unnamed.participant(), unknown).discovered);
  EXPECT_THROW(detail::process_of_participant(0, named.guid()), BusError);
}

// A silent participant proves no security: the network may drop what follows its announcement.
TEST(Discovery, SilenceHasSeveralCauses) {
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(detail::silence_text({}, "", false), "");
  const std::string without = detail::silence_text({"lab", "demo"}, "", false),
                    with = detail::silence_text({"lab"}, "", true),
                    keys = detail::silence_text({"lab"}, "keys/observer", true);
  for (const std::string& text : {without, with})
    for (const char* cause :
         {"exchanges no messages", "firewall", "MTU", "still starting", "security"})
      EXPECT_TRUE(has(text, cause)) << cause << ": " << text;
  EXPECT_TRUE(has(without, "deployment 'demo', 'lab' runs there")) << without;
  EXPECT_TRUE(has(without, "add --deployment and its file")) << without;
  EXPECT_FALSE(has(with, "--deployment")) << "it was given: " << with;
  EXPECT_TRUE(has(keys, "with the keys in keys/observer: they are of another CA")) << keys;
}

// A recorder that starts late describes the writers that exist already.
TEST(Discovery, AReaderDescribesAllEarlierWriters) {
  Bus bus({test::own_domain()});
  Peer peer;
  const auto handles = peer.add_writers(300);
  const SerializedReader reader(bus, topics::described<Topic>());
  EXPECT_EQ(reader.writers(), 300);
  EXPECT_TRUE(std::all_of(handles.begin(), handles.end(),
                          [&](std::uint64_t handle) { return reader.writer(handle); }));
  EXPECT_FALSE(reader.writer(1));
}

// The limit bounds the memory that a peer's writers can use.
TEST(Discovery, Lists1024Writers) {
  Bus bus({test::own_domain()});
  Peer peer;
  peer.add_writers(1025);
  const auto endpoints = bus.endpoints();
  EXPECT_EQ(std::count_if(endpoints.begin(), endpoints.end(),
                          [](const EndpointDescription& endpoint) { return endpoint.writes; }),
            1024);
}

}  // namespace
}  // namespace fivepipe::bus
