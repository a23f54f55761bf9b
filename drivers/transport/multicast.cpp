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

bool join4(int fd, const Address& group, unsigned index) {
  sockaddr_in address{};
  std::memcpy(&address, &group.storage, sizeof address);
  ip_mreqn wish{};
  wish.imr_multiaddr = address.sin_addr;
  wish.imr_ifindex = static_cast<int>(index);
  const int no = 0;
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &no, sizeof no);
  return ::setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &wish, sizeof wish) == 0;
}

bool join6(int fd, const Address& group, unsigned index) {
  sockaddr_in6 address{};
  std::memcpy(&address, &group.storage, sizeof address);
  ipv6_mreq wish{};
  wish.ipv6mr_multiaddr = address.sin6_addr;
  wish.ipv6mr_interface = index;
  const int no = 0;
  ::setsockopt(fd, IPPROTO_IPV6, IPV6_MULTICAST_ALL, &no, sizeof no);
  return ::setsockopt(fd, IPPROTO_IPV6, IPV6_ADD_MEMBERSHIP, &wish, sizeof wish) == 0;
}

}  // namespace

Result<> join_group(int fd, const Address& group, const std::string& interface) {
  const auto index = interface_index(interface);
  if (!index) return std::unexpected(index.error());
  const bool joined =
      group.storage.ss_family == AF_INET6 ? join6(fd, group, *index) : join4(fd, group, *index);
  if (joined) return {};
  return fail("cannot join the multicast group " + host_text(group) + " (" + errno_text() +
              "); name the network interface that the device is on");
}

}  // namespace posed::drivers
