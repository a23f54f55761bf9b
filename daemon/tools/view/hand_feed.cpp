#include "daemon/tools/view/hand_feed.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "drivers/transport/address.hpp"
#include "drivers/transport/socket.hpp"

namespace posed::view {
namespace {

constexpr std::string_view kUdp = "udp ";

bool is_any(const drivers::Address& address) {
  const std::string host = drivers::host_text(address);
  return host == "0.0.0.0" || host == "::";
}

}  // namespace

void HandFeed::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

// Only to this machine, whatever the daemon says. What listens on every address is reached there.
void HandFeed::connect(std::string_view source) {
  close();
  source_ = source;
  if (!source.starts_with(kUdp)) return;
  const auto to = drivers::parse_endpoint(std::string(source.substr(kUdp.size())));
  if (!to || !(drivers::is_loopback(drivers::host_of(*to)) || is_any(*to))) return;
  fd_ = drivers::open_socket(*to, SOCK_DGRAM);
  if (fd_ >= 0 && ::connect(fd_, to->get(), to->size) != 0) close();
}

std::string HandFeed::send(std::string_view source, std::string_view json) {
  if (source.empty()) {
    return "posed has no source for a camera's hands, so nobody gets them: add a [[source]] with"
           " driver = \"landmarks\" to its config, as config/stage/camera.toml has";
  }
  if (source != source_ || fd_ < 0) connect(source);
  // That nobody listens is what the system says of the datagram before; this one is not sent then.
  for (const bool again : {false, true}) {
    const auto sent = fd_ < 0 ? -1 : ::send(fd_, json.data(), json.size(), MSG_NOSIGNAL);
    if (sent >= 0 && !again) return {};
    if (sent < 0 && errno != ECONNREFUSED) break;
  }
  return "nobody gets the hands: let posed's source for them listen on this machine over UDP, such "
         "as"
         " listen = \"127.0.0.1:7420\" in its [source.landmarks]";
}

}  // namespace posed::view
