#include "common/pipeline/bus/announcer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <utility>

#include "common/pipeline/bus/checked.h"
#include "common/pipeline/bus/discovery.h"
#include "common/pipeline/bus/process_id.h"

namespace fivepipe::bus::detail {

Announcer::Announcer(dds_entity_t participant, std::string user_data)
    : participant_(participant),
      user_data_(std::move(user_data)),
      reader_(checked(
          dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
          "reading participants")),
      ended_(checked(dds_create_guardcondition(participant), "guard condition")),
      waitset_(checked(dds_create_waitset(participant), "waitset")),
      announcements_(this_process().host, Announcements::Clock::now()) {
  checked(dds_set_status_mask(reader_.handle, DDS_DATA_AVAILABLE_STATUS), "status mask");
  for (const dds_entity_t entity : {reader_.handle, ended_.handle})
    checked(dds_waitset_attach(waitset_.handle, entity, 0), "waitset");
  thread_ = std::thread([this] { run(); });
}

Announcer::~Announcer() {
  dds_set_guardcondition(ended_.handle, true);
  thread_.join();
}

void Announcer::run() {
  using Clock = Announcements::Clock;
  for (bool ended = false; !ended; dds_read_guardcondition(ended_.handle, &ended)) {
    take_participants();
    if (announcements_.take_due(Clock::now())) announce();
    const auto next = announcements_.next();
    const dds_duration_t until_next_ns =
        next ? std::chrono::nanoseconds(*next - Clock::now()).count() : DDS_INFINITY;
    if (dds_waitset_wait(waitset_.handle, nullptr, 0, std::max<dds_duration_t>(until_next_ns, 0)) <
        0)
      return;
  }
}

void Announcer::take_participants() {
  std::array<void*, 64> samples{};
  std::array<dds_sample_info_t, 64> infos{};
  for (dds_return_t count = 0;
       (count = dds_take(reader_.handle, samples.data(), infos.data(), samples.size(),
                         std::uint32_t(samples.size()))) > 0;
       dds_return_loan(reader_.handle, samples.data(), count)) {
    for (std::size_t i = 0; i < std::size_t(count); ++i) {
      const auto& described = *static_cast<const dds_builtintopic_participant_t*>(samples[i]);
      const std::string guid = guid_text(described.key);
      if (infos[i].instance_state != DDS_IST_ALIVE || !infos[i].valid_data)
        announcements_.lost(guid, Announcements::Clock::now());
      else if (const auto process = from_user_data(user_data_of(described.qos)))
        announcements_.found(guid, process->host);
    }
  }
}

void Announcer::announce() {
  is_longer_ = !is_longer_;
  const std::string text = is_longer_ ? user_data_ + kAnnouncement : user_data_;
  const std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> qos(dds_create_qos(), dds_delete_qos);
  dds_qset_userdata(qos.get(), text.data(), text.size());
  dds_set_qos(participant_, qos.get());
}

}  // namespace fivepipe::bus::detail
