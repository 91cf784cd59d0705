// Reads our MCAP files with @mcap/core and @foxglove/omgidl-serialization (tests/npm).
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "common/recording/mcap/format/compression.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/optional_package.h"
#include "tests/support/recording/mcap_files.h"
#include "tests/support/recording/npm_reader.h"

namespace fivepipe::mcap {
namespace {

using nlohmann::json;

constexpr const char* kIdl = R"(module made_up {
  module v1 {
    struct Point { double x; double y; double z; };
    struct Thing {
      unsigned long number;
      unsigned long long stamp_ns;
      string name;
      sequence<octet> pixels;
      float ratios[3];
      sequence<Point> corners;
      boolean seen;
      long long offset;
    };
  };
};
)";

// Plain CDR, little-endian: every number aligned to its size, counted from the end of the
// encapsulation header (DDS-XTypes 1.3, 7.4.1.1).
class Cdr {
 public:
  Cdr() : bytes_{std::byte(0), std::byte(1), std::byte(0), std::byte(0)} {}
  template <typename T>
  Cdr& add(T value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(std::byte(0));
    append(bytes_, std::as_bytes(std::span(&value, 1)));
    return *this;
  }
  Cdr& add_text(const std::string& text) {
    add(std::uint32_t(text.size() + 1));
    append(bytes_, std::as_bytes(std::span(text.c_str(), text.size() + 1)));
    return *this;
  }
  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

struct Thing {
  std::uint32_t number;
  std::uint64_t stamp_ns;
  std::string name;
  std::vector<std::uint8_t> pixels;
  std::vector<double> corners;  // x, y, z each
  std::int64_t offset;
};

Thing thing(std::uint32_t number) {
  // Stamps that a double cannot represent exactly.
  Thing made{number, 1'700'000'000'000'000'001u + number, "thing " + std::to_string(number), {},
             {},     -(std::int64_t(1) << 60) - number};
  for (std::uint32_t i = 0; i < number % 100; ++i) made.pixels.push_back(std::uint8_t(number + i));
  for (std::uint32_t i = 0; i < 3 * (number % 4); ++i) made.corners.push_back(0.1 * i + number);
  return made;
}

Bytes cdr_of(const Thing& thing) {
  Cdr cdr;
  cdr.add(thing.number)
      .add(thing.stamp_ns)
      .add_text(thing.name)
      .add(std::uint32_t(thing.pixels.size()));
  for (const std::uint8_t pixel : thing.pixels) cdr.add(pixel);
  for (const float ratio : {0.5f, -1.25f, 3.f}) cdr.add(ratio);
  cdr.add(std::uint32_t(thing.corners.size() / 3));
  for (const double number : thing.corners) cdr.add(number);
  cdr.add(std::uint8_t(thing.number % 2)).add(thing.offset);
  return cdr.bytes();
}

std::string printed_octets(const std::vector<std::uint8_t>& octets) {
  char text[64];
  if (octets.size() > 64) {
    std::snprintf(text, sizeof text, "crc32:%08x/%zu", crc32_of(std::as_bytes(std::span(octets))),
                  octets.size());
    return text;
  }
  std::string hexadecimal;
  for (const std::uint8_t octet : octets) {
    std::snprintf(text, sizeof text, "%02x", octet);
    hexadecimal += text;
  }
  return hexadecimal;
}

json line_of(const Thing& thing, const std::string& topic, std::uint64_t log_stamp_ns) {
  json corners = json::array();
  for (std::size_t i = 0; i < thing.corners.size(); i += 3)
    corners.push_back(
        {{"x", thing.corners[i]}, {"y", thing.corners[i + 1]}, {"z", thing.corners[i + 2]}});
  const json value = {{"number", thing.number},
                      {"stamp_ns", std::to_string(thing.stamp_ns)},
                      {"name", thing.name},
                      {"pixels", printed_octets(thing.pixels)},
                      {"ratios", {0.5, -1.25, 3}},
                      {"corners", corners},
                      {"seen", thing.number % 2 == 1},
                      {"offset", std::to_string(thing.offset)}};
  return {{"topic", topic},
          {"sequence", thing.number},
          {"log", std::to_string(log_stamp_ns)},
          {"publish", std::to_string(thing.stamp_ns)},
          {"value", value}};
}

constexpr std::uint32_t kThings = 300, kThingsAChunk = 70;
std::uint64_t log_stamp_ns(std::uint32_t number) {
  return 1'700'000'000'000'000'500u + 10 * number;
}
const char* topic_of(std::uint32_t number) { return number % 3 == 0 ? "things/b" : "things/a"; }

void write_things(const std::filesystem::path& path, Compression compression, bool finishes) {
  ChunkBuilder builder;
  const Id schema = builder.add_schema({"made_up::v1::Thing", "omgidl", kIdl});
  const Id a = builder.add_channel({schema, "things/a", "cdr", {{"reliability", "reliable"}}});
  const Id b = builder.add_channel({schema, "things/b", "cdr", {}});
  FileWriter writer(path, compression, "fivepipe tests");
  writer.add({"recording", {{"machine", "made up"}}});
  writer.attach({7, 8, "rig.yaml", "text/yaml", "cameras: []\n"});
  for (std::uint32_t number = 0; number < kThings; ++number) {
    const Thing made = thing(number);
    const Bytes payload = cdr_of(made);
    builder.add({number % 3 == 0 ? b : a, number, log_stamp_ns(number), made.stamp_ns, payload});
    if ((number + 1) % kThingsAChunk == 0) writer.write(builder.take());
  }
  writer.write(builder.take());
  writer.attach({9, 0, "empty", "", ""});
  if (finishes) writer.finish();
}

void expect_all_things(const std::filesystem::path& path) {
  const test::ShellAnswer output = test::read_with_npm(path);
  ASSERT_EQ(output.exit_code, 0) << output.text;
  std::istringstream lines(output.text);
  std::uint32_t number = 0;
  for (std::string line; std::getline(lines, line); ++number)
    ASSERT_EQ(json::parse(line), line_of(thing(number), topic_of(number), log_stamp_ns(number)));
  EXPECT_EQ(number, kThings);
}

class McapConformance : public testing::TestWithParam<Compression> {
 protected:
  void SetUp() override {
    const test::ShellAnswer install = test::install_npm_reader();
    if (install.exit_code == 77) FIVEPIPE_SKIP_WITHOUT_PACKAGE(install.text);
    ASSERT_EQ(install.exit_code, 0) << install.text;
  }
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "things.mcap";
};

TEST_P(McapConformance, ReferenceReaderReadsEveryMessage) {
  write_things(path_, GetParam(), true);
  expect_all_things(path_);
  const test::ShellAnswer output = test::read_with_npm(path_, "--summary");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const json summary = json::parse(output.text);
  EXPECT_EQ(summary["topics"], (json{{"things/a", 200}, {"things/b", 100}}));
  EXPECT_EQ(summary["compressions"], json::array({name_of(GetParam())}));
  EXPECT_EQ(summary["chunks"], 5);
  EXPECT_EQ(summary["attachments"][0]["name"], "rig.yaml");
  EXPECT_EQ(summary["attachments"][0]["create"], "8");
  EXPECT_EQ(summary["attachments"].size(), 2u);
  EXPECT_EQ(summary["metadata"][0]["values"], (json{{"machine", "made up"}}));
}

TEST_P(McapConformance, ReferenceReaderReadsRepairedFile) {
  write_things(path_, GetParam(), false);
  EXPECT_NE(test::read_with_npm(path_).exit_code, 0);
  recover(path_);
  expect_all_things(path_);
}

// Truncated within the index records after the last chunk, which recover() rebuilds.
TEST_P(McapConformance, ReferenceReaderReadsRepairedFileWithTruncatedIndex) {
  write_things(path_, GetParam(), false);
  const Reader whole(path_);
  const ChunkIndex& last = whole.chunks().back();
  ASSERT_EQ(last.message_index_offsets.size(), 2u);
  std::filesystem::resize_file(path_,
                               last.offset + last.length_bytes + last.message_index_bytes - 5);
  recover(path_);
  expect_all_things(path_);
}

// Damaged index records in the middle of the file: recover() moves their chunk to the end.
TEST_P(McapConformance, ReferenceReaderReadsRepairedFileWithDamagedIndex) {
  write_things(path_, GetParam(), false);
  Bytes bytes = test::file_bytes(path_);
  const ChunkIndex chunk = Reader(path_).chunks()[1];
  bytes[chunk.offset + chunk.length_bytes + chunk.message_index_bytes - 3] ^= std::byte(1);
  test::write_file(path_, bytes);
  EXPECT_EQ(recover(path_).damage.damaged_records, 0u);
  expect_all_things(path_);
}

TEST_P(McapConformance, ReferenceReaderSkipsQuarantinedChunk) {
  write_things(path_, GetParam(), false);
  Bytes bytes = test::file_bytes(path_);
  const ChunkIndex damaged = Reader(path_).chunks()[1];
  bytes[damaged.offset + damaged.length_bytes - 10] ^= std::byte(1);
  test::write_file(path_, bytes);
  const Recovery recovery = recover(path_);
  EXPECT_EQ(recovery.damage.damaged_records, 1u);
  const test::ShellAnswer output = test::read_with_npm(path_, "--summary");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const json summary = json::parse(output.text);
  EXPECT_EQ(summary["chunks"], 4);
  EXPECT_EQ(summary["topics"]["things/a"].get<int>() + summary["topics"]["things/b"].get<int>(),
            int(kThings - kThingsAChunk));
}

INSTANTIATE_TEST_SUITE_P(All, McapConformance,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& test) {
                           return test.param == Compression::none
                                      ? "None"
                                      : "With_" + std::string(name_of(test.param));
                         });

}  // namespace
}  // namespace fivepipe::mcap
