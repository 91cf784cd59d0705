// Who writes and reads what: on the bus, or in a recording. Pure.
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
  std::set<std::string> types, qos;             // more than one: peers don't agree
  std::map<std::string, int> writers, readers;  // by participant: how many
  std::uint64_t messages = 0;                   // in a recording
};

// By name. This process's own endpoints are left out.
std::vector<ListedTopic> topics_of(const std::vector<bus::EndpointDescription>& endpoints);
std::vector<ListedTopic> topics_of(const recording::Recording& recording);

// "reliable, last 8, latched", from what discovery or a recording tells of an endpoint.
std::string short_qos(const std::map<std::string, std::string>& qos);

// Tables for 120 columns. Of a recording: messages instead of readers, which it does not know.
std::string topics_text(const std::vector<ListedTopic>& topics, bool of_recording);
std::string nodes_text(const std::vector<ListedTopic>& topics, bool of_recording);

}  // namespace fivepipe::launch
