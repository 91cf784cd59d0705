// Ends the receiving threads of Cyclone DDS although the network is gone.
#pragma once
#include <condition_variable>
#include <mutex>
#include <thread>

namespace fivepipe::bus::detail {

// Cyclone DDS 0.10 ends a thread that waits for a packet by a packet to its own address. If the
// interface with this address has disappeared (a cable adapter that was unplugged, a removed
// virtual interface), no packet arrives, and dds_delete() waits for ever. From kDelay after the
// construction until the destruction, this sends datagrams of one byte over the loopback interface
// to the UDP sockets of this process that are bound to no address, as those threads' sockets are.
class ReceiverWakeup {
 public:
  ReceiverWakeup();
  ~ReceiverWakeup();
  ReceiverWakeup(const ReceiverWakeup&) = delete;
  ReceiverWakeup& operator=(const ReceiverWakeup&) = delete;

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
