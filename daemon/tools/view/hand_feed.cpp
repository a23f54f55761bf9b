#include "daemon/tools/view/hand_feed.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/landmarks/protocol.hpp"
#include "drivers/transport/address.hpp"
#include "drivers/transport/socket.hpp"

namespace posed::view {

HandFeed::HandFeed() {
  const auto to =
      drivers::parse_endpoint("127.0.0.1:" + std::to_string(drivers::landmarks::kUsualPort));
  if (!to) return;
  fd_ = drivers::open_socket(*to, SOCK_DGRAM);
  if (fd_ < 0) return;
  if (::connect(fd_, to->get(), to->size) == 0) return;
  ::close(fd_);
  fd_ = -1;
}

HandFeed::~HandFeed() {
  if (fd_ >= 0) ::close(fd_);
}

std::string HandFeed::send(std::string_view json) {
  // That nobody listens is what the system says of the datagram before; this one is not sent then.
  for (const bool again : {false, true}) {
    const auto sent = fd_ < 0 ? -1 : ::send(fd_, json.data(), json.size(), MSG_NOSIGNAL);
    if (sent >= 0 && !again) return {};
    if (sent < 0 && errno != ECONNREFUSED) return "the hands cannot be sent to posed now";
  }
  return "posed has no source for a camera's hands: add a [[source]] with driver = \"landmarks\" to"
         " its config, as config/stage/camera.toml has";
}

}  // namespace posed::view
