// An independent reader finds the same values in a recording of the pipeline as fivepipe's reader.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "common/recording/files/format.h"
#include "common/recording/mcap/format/bytes.h"
#include "common/recording/schema/cdr.h"
#include "tests/support/optional_package.h"
#include "tests/support/recording/npm_reader.h"
#include "tests/support/recording/recordings.h"

namespace fivepipe::test {
namespace {

using nlohmann::ordered_json;
using recording::Recording;
using schema::Kind;

// tests/npm/read_mcap.mjs prints longer octet sequences as checksums.
constexpr std::size_t kMaxHexBytes = 64;

std::string printed_octets(const ordered_json& octets) {
  std::vector<std::byte> bytes;
  for (const auto& octet : octets) bytes.push_back(std::byte(octet.get<unsigned>()));
  char text[64];
  if (bytes.size() > kMaxHexBytes) {
    std::snprintf(text, sizeof text, "crc32:%08x/%zu", mcap::crc32_of(bytes), bytes.size());
    return text;
  }
  std::string hexadecimal;
  for (const std::byte byte : bytes) {
    std::snprintf(text, sizeof text, "%02x", unsigned(byte));
    hexadecimal += text;
  }
  return hexadecimal;
}

// Converts fivepipe's values to the form of the other reader: 64-bit integers as text, enumerators
// as numbers, octets in hexadecimal.
class Printer {
 public:
  explicit Printer(const schema::Idl& idl) : idl_(idl) {}

  ordered_json structure(const schema::Struct& type, const ordered_json& values) const {
    ordered_json printed = ordered_json::object();
    for (const schema::Member& member : type.members) {
      EXPECT_TRUE(member.dimensions.empty()) << "arrays are not printed here";
      printed[member.name] = value(member.type, values.at(member.name));
    }
    return printed;
  }

 private:
  ordered_json value(const schema::Type& type, const ordered_json& value) const {
    if (type.kind == schema::Kind::structure)
      return structure(idl_.structs[type.definition], value);
    if (type.kind == schema::Kind::int64) return std::to_string(value.get<std::int64_t>());
    if (type.kind == schema::Kind::uint64) return std::to_string(value.get<std::uint64_t>());
    if (type.kind == schema::Kind::enumeration) {
      const auto& names = idl_.enums[type.definition].enumerators;
      return std::find(names.begin(), names.end(), value.get<std::string>()) - names.begin();
    }
    if (type.kind != schema::Kind::sequence) return value;
    if (type.element[0].kind == schema::Kind::octet) return printed_octets(value);
    ordered_json list = ordered_json::array();
    for (const auto& element : value) list.push_back(this->value(type.element[0], element));
    return list;
  }

  const schema::Idl& idl_;
};

using Where = std::tuple<std::string, std::uint32_t, std::string,
                         std::string>;  // topic, sequence, log stamp, publish stamp

// Reads the file with fivepipe's reader. Key states are messages of their own, as in the file.
std::map<Where, ordered_json> read_by_us(const recording::Recording& recording) {
  std::map<Where, ordered_json> values;
  auto cursor = recording.mcap().messages();
  while (const auto message = cursor.next()) {
    const recording::RecordedChannel& channel = *recording.channel(message->channel);
    const schema::Idl& idl = recording.idl(channel);
    const ordered_json decoded = schema::decode(
        idl, channel.type, message->payload,
        {.max_numeric_elements = std::size_t(-1), .floats = schema::FloatFormat::finite_number});
    const std::string topic = recording.mcap().channels().at(message->channel).topic;
    values[{topic, message->sequence, std::to_string(message->log_stamp_ns),
            std::to_string(message->publish_stamp_ns)}] =
        Printer(idl).structure(idl.at(channel.type), decoded);
  }
  return values;
}

class RecordingConformance : public test::RecordingTest {
 protected:
  void SetUp() override {
    const ShellAnswer install = install_npm_reader();
    if (install.exit_code == 77) FIVEPIPE_SKIP_WITHOUT_PACKAGE(install.text);
    ASSERT_EQ(install.exit_code, 0) << install.text;
  }
};

TEST_F(RecordingConformance, ReferenceReaderDecodesEveryTopicIdentically) {
  const auto file = recorded(0.5);
  const recording::Recording recording(file);
  const std::map<Where, ordered_json> ours = read_by_us(recording);
  ASSERT_EQ(ours.size(), recording.mcap().statistics().messages);
  const ShellAnswer output = read_with_npm(file);
  ASSERT_EQ(output.exit_code, 0) << output.text;
  std::istringstream lines(output.text);
  std::map<std::string, std::size_t> compared;
  for (std::string line; std::getline(lines, line);) {
    const auto theirs = ordered_json::parse(line);
    const auto found =
        ours.find({theirs["topic"], theirs["sequence"], theirs["log"], theirs["publish"]});
    ASSERT_NE(found, ours.end()) << line.substr(0, 200);
    ASSERT_EQ(found->second, theirs["value"]) << theirs["topic"];
    ++compared[theirs["topic"]];
  }
  std::size_t all = 0;
  for (const auto& [topic, count] : compared) all += count;
  EXPECT_EQ(all, ours.size());
  for (const bus::topics::Topic& topic : bus::topics::all()) {
    const std::string name = topic.name;
    // This run has one host, no commands, no replay and no sub-pixel silhouettes, and its scene has
    // no history, no particles and no spacing.
    const bool is_written =
        name != bus::topics::Command::name && name != bus::topics::ObjectCoverage::name &&
        name != bus::topics::ReplaySession::name && name != bus::topics::HostStatus::name &&
        name != bus::topics::HullComponents::name && name != bus::topics::Particles::name &&
        name != bus::topics::SpacingRequest::name && name != bus::topics::ObjectSpacing::name;
    EXPECT_EQ(compared.contains(name), is_written) << name;
  }
  EXPECT_GT(compared[std::string(bus::topics::ObjectPixelMap::name) + recording::kKeyStateSuffix],
            0u);
}

}  // namespace
}  // namespace fivepipe::test
