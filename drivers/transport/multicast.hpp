// A socket's membership of a multicast group on one network interface.
#pragma once

#include <net/if.h>

#include <array>
#include <string>

#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

class Membership {
 public:
  // Joins. `interface` is its name ("eth0") or one of its addresses; empty: the system's choice.
  // The socket then receives nothing from other groups that this machine has joined. Cold.
  static Result<Membership> join(int fd, const Address& group, const std::string& interface);

  // Leaves and joins again, because an interface that goes away takes the membership with it, and
  // one that returns has another number. While it is away, nothing happens. Other threads may read
  // the socket meanwhile. Cold.
  void renew(int fd) noexcept;

  // Leaves, and joins this group on the same interface. Cold.
  void change_to(int fd, const Address& group) noexcept;
  [[nodiscard]] const Address& group() const noexcept { return group_; }

 private:
  Address group_;
  std::array<char, IF_NAMESIZE> name_{};  // of the interface; empty: the system's choice
  unsigned index_ = 0;                    // its number when the socket joined
};

}  // namespace posed::drivers
