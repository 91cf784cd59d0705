// The trace of the loopback interface: RTPS datagrams, the messages in them, and the socket.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <system_error>

#include "benchmarks/nodes/wire/loopback_trace.h"
#include "benchmarks/nodes/wire/message_times.h"
#include "benchmarks/nodes/wire/rtps.h"
#include "common/base/realtime.h"
#include "common/pipeline/bus/topics.h"
#include "tests/support/optional_package.h"

namespace fivepipe::wire {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::uint8_t kInfoTs = 0x09, kInfoDst = 0x0e, kData = 0x15, kDataFrag = 0x16;
constexpr std::uint8_t kInlineQos = 2, kPayload = 4, kKeyOnly = 8;

// Writes RTPS datagrams of one writer.
struct DatagramWriter {
  bool little = true;
  Bytes bytes;

  explicit DatagramWriter(bool little_endian, std::uint8_t participant = 7)
      : little(little_endian) {
    for (const char c : {'R', 'T', 'P', 'S'}) bytes.push_back(std::byte(c));
    for (const int b : {2, 1, 1, 16}) bytes.push_back(std::byte(b));
    for (int i = 0; i < 12; ++i) bytes.push_back(std::byte(participant + i));
  }
  static void put(Bytes& to, std::uint64_t value, int size, bool little_endian) {
    for (int i = 0; i < size; ++i)
      to.push_back(std::byte(value >> 8 * (little_endian ? i : size - 1 - i)));
  }
  void submessage(std::uint8_t id, std::uint8_t flags, const Bytes& contents) {
    bytes.push_back(std::byte(id));
    bytes.push_back(std::byte(flags | (little ? 1 : 0)));
    put(bytes, contents.size(), 2, little);
    bytes.insert(bytes.end(), contents.begin(), contents.end());
  }
  void data(std::uint8_t id, std::uint8_t flags, std::uint64_t number, std::uint32_t fragment,
            const Bytes& payload) {
    Bytes contents;
    put(contents, 0, 2, little);
    put(contents, id == kDataFrag ? 28 : 16, 2, little);
    for (const int b : {0, 0, 0, 0, 0, 0, 0x17, 2}) contents.push_back(std::byte(b));
    put(contents, number >> 32, 4, little);
    put(contents, number & 0xffffffff, 4, little);
    if (id == kDataFrag) {
      put(contents, fragment, 4, little);
      put(contents, 1, 2, little);
      put(contents, 65000, 2, little);
      put(contents, 100000, 4, little);
    }
    if (flags & kInlineQos) {
      put(contents, 0x70, 2, little);  // a key hash
      put(contents, 16, 2, little);
      for (int i = 0; i < 16; ++i) contents.push_back(std::byte(i));
      put(contents, 1, 2, little);
      put(contents, 0, 2, little);
    }
    contents.insert(contents.end(), payload.begin(), payload.end());
    submessage(id, flags, contents);
  }
  void destination(std::uint8_t participant) {
    Bytes contents;
    for (int i = 0; i < 12; ++i) contents.push_back(std::byte(participant + i));
    submessage(kInfoDst, 0, contents);
  }
};

std::string guid(int participant) {
  std::string text;
  for (int i = 0; i < 12; ++i) text += fmt::format("{:02x}", participant + i);
  return text + "00001702";
}
std::string prefix(int participant) { return guid(participant).substr(0, kGuidPrefixDigits); }

TEST(Rtps, ReadsDataOfBothByteOrders) {
  for (const bool little : {true, false}) {
    DatagramWriter w(little);
    w.submessage(kInfoTs, 0, Bytes(8));
    w.destination(40);
    w.data(kData, kPayload, 5, 1, {std::byte{1}, std::byte{2}});
    w.data(kData, kPayload | kInlineQos, (std::uint64_t{3} << 32) + 6, 1, {std::byte{9}});
    w.data(kData, kKeyOnly | kInlineQos, 7, 1, {std::byte{8}});  // a disposed key: no data
    w.data(kDataFrag, kInlineQos, 8, 2, {std::byte{4}});
    const RtpsDatagram read = parse_rtps(w.bytes);
    EXPECT_EQ(read.destination, prefix(40));
    ASSERT_EQ(read.data.size(), 3u);
    EXPECT_EQ(read.data[0].writer, guid(7));
    EXPECT_EQ(read.data[0].sequence_number, 5u);
    EXPECT_EQ(read.data[0].fragment, 1u);
    EXPECT_EQ(Bytes(read.data[0].cdr.begin(), read.data[0].cdr.end()),
              (Bytes{std::byte{1}, std::byte{2}}));
    EXPECT_EQ(read.data[1].sequence_number, (std::uint64_t{3} << 32) + 6);
    EXPECT_EQ(Bytes(read.data[1].cdr.begin(), read.data[1].cdr.end()), Bytes{std::byte{9}});
    EXPECT_EQ(read.data[2].sequence_number, 8u);
    EXPECT_EQ(read.data[2].fragment, 2u);
    EXPECT_EQ(Bytes(read.data[2].cdr.begin(), read.data[2].cdr.end()), Bytes{std::byte{4}});
  }
}

TEST(Rtps, SubmessageOfLengthZeroExtendsToTheEnd) {
  DatagramWriter w(true);
  w.data(kData, kPayload, 5, 1, Bytes(30));
  w.bytes[20 + 2] = w.bytes[20 + 3] = std::byte{0};
  const RtpsDatagram read = parse_rtps(w.bytes);
  ASSERT_EQ(read.data.size(), 1u);
  EXPECT_EQ(read.data[0].cdr.size(), 30u);
}

TEST(Rtps, ReadsNothingBeyondADatagramThatIsCutOffOrDamaged) {
  DatagramWriter w(true);
  w.destination(40);
  w.data(kData, kPayload | kInlineQos, 5, 1, Bytes(20));
  w.data(kDataFrag, 0, 6, 1, Bytes(20));
  for (std::size_t size = 0; size <= w.bytes.size(); ++size) {
    const Bytes cut(w.bytes.begin(), w.bytes.begin() + std::ptrdiff_t(size));  // the sanitizer's
    for (const RtpsData& data : parse_rtps(cut).data)
      EXPECT_LE(data.cdr.data() + data.cdr.size(), cut.data() + cut.size());
  }
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    Bytes damaged = w.bytes;
    for (int n = 0; n < 4; ++n) damaged[4 + random() % (damaged.size() - 4)] = std::byte(random());
    for (const RtpsData& data : parse_rtps(damaged).data)
      EXPECT_LE(data.cdr.data() + data.cdr.size(), damaged.data() + damaged.size());
  }
  w.bytes[0] = std::byte{'X'};
  EXPECT_TRUE(parse_rtps(w.bytes).data.empty());
}

// The CDR of a VirtualState: a header, the key, the frame.
Bytes state_of_frame(std::uint64_t frame) {
  Bytes cdr{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  DatagramWriter::put(cdr, 4, 4, true);
  for (const char c : {'s', 'i', 'm', '\0'}) cdr.push_back(std::byte(c));
  DatagramWriter::put(cdr, frame, 8, true);
  return cdr;
}

constexpr std::uint16_t kPortA = 7410, kPortB = 7412;

class TimesOfMessages : public ::testing::Test {
 protected:
  void send(std::int64_t stamp_ns, std::uint16_t port, const DatagramWriter& datagram) {
    times.add({stamp_ns, port, datagram.bytes});
  }
  DatagramWriter state(std::uint64_t number, std::uint64_t frame) {
    DatagramWriter w(true);
    w.data(kData, kPayload, number, 1, state_of_frame(frame));
    return w;
  }
  static constexpr const char* kTopic = bus::topics::VirtualState::name;
  MessageTimes times{{{guid(7), {kTopic, "sim"}}}, {{prefix(40), "render"}, {prefix(7), "sim"}}};
};

TEST_F(TimesOfMessages, AreThoseOfTheFirstAndLastDatagramByReader) {
  send(100, kPortA, state(1, 50));
  send(110, kPortB, state(1, 50));
  send(120, kPortA, state(2, 50));
  send(130, kPortA, state(3, 51));
  DatagramWriter acknowledgement(true, 60);
  acknowledgement.destination(40);
  send(140, kPortA, acknowledgement);  // names the reader of this port
  const auto frames = times.by_frame();
  ASSERT_EQ(frames.size(), 2u);
  const FrameMessages& messages = frames.at(50);
  ASSERT_EQ(messages.size(), 2u);
  const SendTimes a = messages.at({kTopic, "sim", "render"}), b = messages.at({kTopic, "sim", ""});
  EXPECT_EQ(a.first_ns, 100);
  EXPECT_EQ(a.last_ns, 120);
  EXPECT_EQ(b.first_ns, 110);
  EXPECT_EQ(b.last_ns, 110);
  EXPECT_EQ(frames.at(51).at({kTopic, "sim", "render"}).first_ns, 130);
}

TEST_F(TimesOfMessages, IgnoreRepeatedDatagramsAndOtherWriters) {
  send(100, kPortA, state(1, 50));
  send(110, kPortA, state(2, 51));
  send(120, kPortA, state(1, 50));  // repeated, because the reader lost it
  DatagramWriter other(true, 8);
  other.data(kData, kPayload, 1, 1, state_of_frame(50));
  send(130, kPortA, other);
  EXPECT_EQ(times.by_frame().at(50).at({kTopic, "sim", ""}).last_ns, 100);
}

TEST_F(TimesOfMessages, OfFragmentsAreThoseOfTheWholeMessage) {
  DatagramWriter first(true), second(true);
  first.data(kDataFrag, 0, 4, 1, state_of_frame(50));
  second.data(kDataFrag, 0, 4, 2, Bytes(40));
  send(90, kPortA, second);  // without its first fragment, the frame is not known
  EXPECT_TRUE(times.by_frame().empty());
  MessageTimes fresh{{{guid(7), {kTopic, "sim"}}}, {}};
  fresh.add({100, kPortA, first.bytes});
  fresh.add({120, kPortA, second.bytes});
  const SendTimes sent = fresh.by_frame().at(50).at({kTopic, "sim", ""});
  EXPECT_EQ(sent.first_ns, 100);
  EXPECT_EQ(sent.last_ns, 120);
}

// A UDP socket on the loopback interface that sends to itself.
class LoopbackSocket {
 public:
  LoopbackSocket() : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address_), sizeof address_), 0);
    socklen_t size = sizeof address_;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address_), &size);
  }
  ~LoopbackSocket() { close(socket_); }
  void send(const std::string& text) const {
    EXPECT_EQ(sendto(socket_, text.data(), text.size(), 0,
                     reinterpret_cast<const sockaddr*>(&address_), sizeof address_),
              ssize_t(text.size()));
  }
  std::uint16_t port() const { return ntohs(address_.sin_port); }

 private:
  int socket_;
  sockaddr_in address_{};
};

TEST(LoopbackTrace, StampsDatagramsBetweenTheClocksAroundTheirSending) {
  const LoopbackSocket sender;
  struct Seen {
    std::int64_t stamp_ns;
    std::string text;
  };
  std::vector<Seen> seen;  // only the thread of the trace accesses it until stop()
  try {
    LoopbackTrace trace([&](const Datagram& datagram) {
      if (datagram.destination_port == sender.port())
        seen.push_back(
            {datagram.stamp_ns,
             {reinterpret_cast<const char*>(datagram.payload.data()), datagram.payload.size()}});
    });
    constexpr int kDatagrams = 50;
    std::vector<std::int64_t> before_ns, after_ns;
    for (int i = 0; i < kDatagrams; ++i) {
      before_ns.push_back(base::now_realtime_ns());
      sender.send(std::string(std::size_t(i * 100), char('a' + i % 26)));
      after_ns.push_back(base::now_realtime_ns());
    }
    trace.stop();
    EXPECT_EQ(trace.dropped(), 0u);
    ASSERT_EQ(seen.size(), std::size_t(kDatagrams));
    for (int i = 0; i < kDatagrams; ++i) {
      EXPECT_EQ(seen[i].text.size(),
                std::min<std::size_t>(std::size_t(i) * 100, LoopbackTrace::kMaxPayloadBytes));
      EXPECT_EQ(seen[i].text, std::string(seen[i].text.size(), char('a' + i % 26)));
      EXPECT_GE(seen[i].stamp_ns, before_ns[i]);
      EXPECT_LE(seen[i].stamp_ns, after_ns[i]);
    }
  } catch (const std::system_error& error) {
    if (error.code().value() == EPERM) FIVEPIPE_SKIP_WITHOUT_PACKAGE("needs CAP_NET_RAW");
    throw;
  }
}

}  // namespace
}  // namespace fivepipe::wire
