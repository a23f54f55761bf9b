// UdpReceivers: sends datagrams to any number of addresses, each through a socket of its own. A
// receiver that is absent or unreachable affects no other one: failures are counted, and their
// beginning and end are reported.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <sys/socket.h>

#include "daemon/output/send_outcome.hpp"
#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::output {

// Datagrams that go out together: what an output sends in one turn, or for one pose. It keeps its
// memory. One thread.
class Datagrams {
 public:
  void add(std::span<const std::byte> datagram);

 private:
  friend class UdpReceivers;
  // As the system takes them, valid until the next add().
  [[nodiscard]] std::span<mmsghdr> messages();

  std::vector<std::byte> bytes_;
  std::vector<std::size_t> bytes_of_;  // [datagram]
  std::vector<iovec> pieces_;          // the same
  std::vector<mmsghdr> messages_;      // the same
};

// One thread.
class UdpReceivers {
 public:
  // Takes addresses such as "127.0.0.1:39539", numbers only. Fails if one is malformed or if no
  // socket can be opened; an address that cannot be reached now is tried again once a second. Cold.
  static Result<UdpReceivers> open(const std::vector<std::string>& endpoints);
  ~UdpReceivers();
  UdpReceivers(UdpReceivers&& other) noexcept : receivers_(std::move(other.receivers_)) {}
  UdpReceivers& operator=(UdpReceivers&&) = delete;
  UdpReceivers(const UdpReceivers&) = delete;
  UdpReceivers& operator=(const UdpReceivers&) = delete;

  // Sends the datagrams to all receivers and forgets them: in one call of the system where all is
  // well, because the call costs more than the datagram, and never waits. While an address cannot
  // be reached, all datagrams to it fail until the next try, a second later.
  [[nodiscard]] SendOutcome send(Datagrams& datagrams, std::int64_t now_ns);

  // Returns what has changed since the last call. A receiver counts as failing from its first
  // failure until all datagrams have reached it for five seconds.
  [[nodiscard]] std::vector<News> drain_news(std::int64_t now_ns);

  [[nodiscard]] std::size_t size() const noexcept { return receivers_.size(); }

 private:
  struct Receiver {
    std::string endpoint;
    drivers::Address address;
    int fd = -1;
    bool connected = false;
    std::int64_t retry_ns = kNoTime_ns;  // when to connect again
    int error = 0;                       // the last one
    std::uint64_t refused = 0;  // datagrams that were counted as sent; later ones fail for them
    bool failing = false, reported = false;  // reported: that it is
    std::int64_t good_ns = kNoTime_ns;       // when it took a datagram again; kNoTime_ns: not since
  };
  UdpReceivers() = default;
  static void connect(Receiver& receiver) noexcept;
  [[nodiscard]] static bool is_connected(Receiver& receiver, std::int64_t now_ns) noexcept;
  // Counts what became of the datagrams.
  static void send_to(Receiver& receiver, std::span<mmsghdr> datagrams, std::int64_t now_ns,
                      SendOutcome& outcome) noexcept;
  // Takes what the network has answered to earlier datagrams; returns whether there was something.
  static bool take_answers(Receiver& receiver) noexcept;
  // Tries one alone that the system did not take, and counts it. `error` is why, or 0 where the
  // system does not say it.
  static void retry_first(Receiver& receiver, const mmsghdr& datagram, int error,
                          std::int64_t now_ns, SendOutcome& outcome) noexcept;

  std::vector<Receiver> receivers_;
};

}  // namespace posed::output
