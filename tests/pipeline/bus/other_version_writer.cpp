// Writes fivepipe/v1/FrameComposited with another version's type until its standard input closes.
#include <dds/dds.h>

#include <cstdio>
#include <cstdlib>

#include "other_version.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const dds_entity_t participant =
      dds_create_participant(dds_domainid_t(std::atoi(argv[1])), nullptr, nullptr);
  const dds_entity_t topic = dds_create_topic(participant, &fivepipe_v1_FrameComposited_desc,
                                              "fivepipe/v1/FrameComposited", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  if (writer < 0) return 1;
  while (std::getchar() != EOF) {
  }
  return dds_delete(participant) == DDS_RETCODE_OK ? 0 : 1;
}
