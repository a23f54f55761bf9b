#include "drivers/transport/multicast.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <cstring>

namespace posed::drivers {
namespace {

// 0 when there is no such interface.
unsigned interface_with(const Host& host) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return 0;
  unsigned index = 0;
  for (const ifaddrs* at = all; at != nullptr && index == 0; at = at->ifa_next) {
    if (at->ifa_addr == nullptr) continue;
    const auto family = at->ifa_addr->sa_family;
    if (family != AF_INET && family != AF_INET6) continue;
    Address address;
    address.size = family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    std::memcpy(&address.storage, at->ifa_addr, address.size);
    if (host_of(address) == host) index = ::if_nametoindex(at->ifa_name);
  }
  ::freeifaddrs(all);
  return index;
}

Result<unsigned> interface_index(const std::string& interface) {
  if (interface.empty()) return 0U;
  unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) {
    const auto address = parse_host(interface);
    if (address) index = interface_with(host_of(*address));
  }
  if (index != 0) return index;
  return fail("this machine has no network interface '" + interface +
              "'; name one that `ip address` lists, or one of its addresses");
}

// Joins or leaves.
bool change(int fd, const Address& group, unsigned index, bool join) noexcept {
  if (group.storage.ss_family == AF_INET6) {
    sockaddr_in6 address{};
    std::memcpy(&address, &group.storage, sizeof address);
    ipv6_mreq wish{};
    wish.ipv6mr_multiaddr = address.sin6_addr;
    wish.ipv6mr_interface = index;
    const int option = join ? IPV6_ADD_MEMBERSHIP : IPV6_DROP_MEMBERSHIP;
    return ::setsockopt(fd, IPPROTO_IPV6, option, &wish, sizeof wish) == 0;
  }
  sockaddr_in address{};
  std::memcpy(&address, &group.storage, sizeof address);
  ip_mreqn wish{};
  wish.imr_multiaddr = address.sin_addr;
  wish.imr_ifindex = static_cast<int>(index);
  const int option = join ? IP_ADD_MEMBERSHIP : IP_DROP_MEMBERSHIP;
  return ::setsockopt(fd, IPPROTO_IP, option, &wish, sizeof wish) == 0;
}

// Otherwise a socket receives every group that any program of this machine has joined.
void only_own_groups(int fd, sa_family_t family) {
  const int no = 0;
  if (family == AF_INET6) {
    ::setsockopt(fd, IPPROTO_IPV6, IPV6_MULTICAST_ALL, &no, sizeof no);
  } else {
    ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &no, sizeof no);
  }
}

}  // namespace

Result<Membership> Membership::join(int fd, const Address& group, const std::string& interface) {
  const auto index = TRY(interface_index(interface));
  only_own_groups(fd, group.storage.ss_family);
  if (!change(fd, group, index, true)) {
    return fail("cannot join the multicast group " + host_text(group) + " (" + errno_text() +
                "); name the network interface that the device is on");
  }
  Membership joined;
  joined.group_ = group;
  joined.index_ = index;
  if (index != 0) ::if_indextoname(index, joined.name_.data());
  return joined;
}

void Membership::change_to(int fd, const Address& group) noexcept {
  static_cast<void>(change(fd, group_, index_, false));
  group_ = group;
  static_cast<void>(change(fd, group_, index_, true));
}

void Membership::renew(int fd) noexcept {
  const unsigned now = name_[0] == '\0' ? 0 : ::if_nametoindex(name_.data());
  if (name_[0] != '\0' && now == 0) return;
  static_cast<void>(change(fd, group_, index_, false));
  static_cast<void>(change(fd, group_, now, true));
  index_ = now;
}

}  // namespace posed::drivers
