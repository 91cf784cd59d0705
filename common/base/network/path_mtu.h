// The largest packets that reach another machine.
#pragma once
#include <string>

namespace fivepipe::base {

struct PathMtu {
  int bytes = 0;         // of IP packets, as far as the kernel knows; 0: there is no route
  bool answers = false;  // it has answered enough packets to know whether the large ones arrive
  bool arrives = false;  // it has answered a packet of `bytes`, which was not fragmented
};

// Sends ICMP echo requests, if the system permits it and the machine answers them. Else sends UDP
// packets to a port that no program uses, which the machine refuses. A firewall may drop either.
// address: IPv4. Takes up to 12 s.
PathMtu path_mtu(const std::string& address);

}  // namespace fivepipe::base
