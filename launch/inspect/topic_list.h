// Topics with their writers and readers, on the bus or in a recording. Independent of DDS.
#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "common/recording/files/recording.h"

namespace fivepipe::launch {

struct ListedTopic {
  std::string topic;
  std::set<std::string> types, qos;             // more than one element: the endpoints disagree
  std::map<std::string, int> writers, readers;  // number of endpoints by participant
  std::uint64_t messages = 0;                   // if from a recording
};

// Sorted by name, without the endpoints of this process.
std::vector<ListedTopic> topics_of(const std::vector<bus::EndpointDescription>& endpoints);
std::vector<ListedTopic> topics_of(const recording::Recording& recording);

// Abbreviates QoS from discovery or a recording: "reliable, last 8, latched".
std::string short_qos(const std::map<std::string, std::string>& qos);

// Tables for 120 columns. For a recording, message counts replace the readers, which it lacks.
std::string topics_text(const std::vector<ListedTopic>& topics, bool of_recording);
std::string nodes_text(const std::vector<ListedTopic>& topics, bool of_recording);

}  // namespace fivepipe::launch
