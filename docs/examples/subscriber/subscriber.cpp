// Prints the collision verdict for each virtual object of a running deployment:
//   subscriber [DOMAIN [MESSAGES]]
// Before the start, set CYCLONEDDS_URI to the network profile of the deployment (launch/profiles/).
#include <dds/dds.h>

#include <cstdio>
#include <cstdlib>

#include "fivepipe.h"

// undecided is not free: the object may collide, but no collision point was found.
static const char* text_of(fivepipe_v1_CollisionVerdict verdict) {
  switch (verdict) {
    case fivepipe_v1_free: return "is free";
    case fivepipe_v1_undecided: return "is undecided";
    case fivepipe_v1_colliding: return "collides";
  }
  return "has an unknown verdict";
}

int main(int argc, char** argv) {
  const unsigned domain = argc > 1 ? unsigned(std::atoi(argv[1])) : 0;
  const long wanted = argc > 2 ? std::atol(argv[2]) : 0;  // 0: no limit

  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  const dds_entity_t topic = dds_create_topic(participant, &fivepipe_v1_CollisionResult_desc,
                                              "fivepipe/v1/CollisionResult", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 8);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  if (reader < 0) {
    std::fprintf(stderr, "cannot create a reader in domain %u: %s\n", domain,
                 dds_strretcode(-reader));
    return 1;
  }
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);

  for (long printed = 0; wanted == 0 || printed < wanted;) {
    if (dds_waitset_wait(waitset, nullptr, 0, DDS_SECS(10)) == 0) {
      std::fprintf(
          stderr,
          "no message arrived within 10 s; `fivepipe top --domain %u` lists the running nodes\n",
          domain);
      return 3;
    }
    void* samples[16] = {};
    dds_sample_info_t infos[16];
    const dds_return_t count = dds_take(reader, samples, infos, 16, 16);
    for (dds_return_t i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;  // a change of the key's state, such as no more writer
      const auto& result = *static_cast<const fivepipe_v1_CollisionResult*>(samples[i]);
      std::printf("frame %llu: %s %s, %u colliding triangles\n",
                  static_cast<unsigned long long>(result.frame), result.object,
                  text_of(result.verdict), result.triangles_colliding);
      ++printed;
    }
    if (count > 0) dds_return_loan(reader, samples, count);
  }
  return dds_delete(participant) == DDS_RETCODE_OK ? 0 : 1;
}
