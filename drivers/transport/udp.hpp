// UdpTransport: receives the datagrams of a device on one or several sockets. It hands out one
// datagram per read, with the time at which the kernel received it. Nothing is allocated after
// open().
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/address.hpp"
#include "drivers/transport/multicast.hpp"
#include "drivers/transport/upkeep.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

// The buffer that each socket asks the kernel for, about a tenth of a second of a large system; the
// kernel gives at most net.core.rmem_max.
inline constexpr int kUdpBuffer_bytes = 1024 * 1024;

struct UdpSocketSettings {
  std::string listen{};  // "0.0.0.0:1511"; numbers only, IPv4 or IPv6
  std::string group{};   // multicast group to join, "239.255.42.99"; empty: none
  std::string to{};      // where send() goes; empty: to the last sender
};

// Where a device says that it sends its data: an IPv4 group with the first number in the highest
// byte (0: to one address only), and a port.
struct DataPlace {
  std::uint32_t group = 0;
  std::uint32_t port = 0;
  bool operator==(const DataPlace&) const = default;
};

struct UdpSettings {
  std::vector<UdpSocketSettings> sockets{};  // [Chunk::socket]
  // Reads it from a datagram to socket 0; nullopt: it says nothing of it. RT-safe. Null: none does.
  // A socket with a group then joins that group at that port instead.
  std::optional<DataPlace> (*data_place)(std::span<const std::byte> datagram) noexcept = nullptr;
  // On which the groups are joined: its name or one of its addresses; empty: the system's choice.
  std::string interface{};
  std::vector<std::string> peers{};  // addresses that may send; empty: loopback only
};

// Checks these settings without opening a socket. Cold.
Result<> check_udp(const UdpSettings& settings);

class UdpTransport final : public Transport, public Upkeep {
 public:
  // An address other than loopback without peers is an error. Cold.
  static Result<std::unique_ptr<UdpTransport>> open(const UdpSettings& settings);
  ~UdpTransport() override;

  // Returns the address at which a socket really listens: "127.0.0.1:40123". Cold.
  [[nodiscard]] std::string endpoint(std::size_t socket) const;

  [[nodiscard]] int poll_fd() const noexcept override { return epoll_; }
  [[nodiscard]] bool only_listens() const noexcept override { return true; }
  // In the past while datagrams wait in this object, where poll_fd does not show them.
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override {
    return next_ < received_ ? batch_ns_ : kNoTime_ns;
  }
  // Discards what came since open(): it is old by now.
  Result<> start(std::int64_t now_ns) override;
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;
  // A sender none of whose datagrams the decoder could use gives up the socket to the next sender.
  RT_SAFE void decoded(bool used) noexcept override;
  // Rejoins a silent group every two seconds; changes to the group and port that the device names.
  void upkeep(std::int64_t now_ns) noexcept override;
  [[nodiscard]] std::string consume_note() override;
  using Transport::send;
  [[nodiscard]] bool send(std::span<const std::byte> bytes, std::uint8_t socket) noexcept override;

 private:
  struct Socket {
    int fd = -1;
    std::optional<Address> to;  // a configured one, or the last sender
    bool keeps_to = false;      // `to` is configured
    std::uint32_t dropped = 0;  // by the kernel, of all so far; begins again at another port
    std::optional<Membership> membership{};   // of upkeep; whether there is one never changes
    Host sender{};                            // whose datagrams are accepted
    std::uint16_t port = 0, port_before = 0;  // of that sender, and the one it had before
    std::uint64_t datagrams = 0;              // that came from its port
    bool is_of_use = false;                   // the decoder has used one of them
    std::int64_t received_ns = kNoTime_ns;    // when it sent the last; kNoTime_ns: nobody has yet
  };
  struct Batch;  // the buffers of one recvmmsg

  UdpTransport();
  Result<> add(const UdpSocketSettings& settings, const UdpSettings& all);
  // Whether the descriptor now counts for poll_fd().
  [[nodiscard]] bool watch(int fd) const noexcept;
  void follow(const DataPlace& said);
  Result<> move(Socket& socket, const Address& group, std::uint32_t port);
  // Fills the batch from the next socket that has datagrams; false when none has.
  [[nodiscard]] bool receive(std::int64_t now_ns) noexcept;
  // Returns whether the socket accepts datagrams of this sender, which it then belongs to.
  [[nodiscard]] bool owns(Socket& socket, const Address& sender) noexcept;
  // Reads the ancillary data of a datagram: its arrival time, and what the kernel dropped.
  void read_control(std::size_t i, Chunk& chunk) noexcept;

  int epoll_ = -1;
  std::vector<Socket> sockets_;
  Peers peers_;
  std::unique_ptr<Batch> batch_;
  std::size_t received_ = 0, next_ = 0;  // datagrams in the batch, and those handed out
  std::size_t socket_ = 0;               // that the batch came from
  std::int64_t batch_ns_ = 0;            // host time and wall clock, taken before the batch
  std::int64_t wall_ns_ = 0;
  std::atomic<std::int64_t> group_received_ns_{kNoTime_ns};  // when a datagram of a group last came
  enum class SecondSender : std::uint8_t { kNone, kSeen, kTold };
  std::atomic<SecondSender> second_sender_{SecondSender::kNone};
  std::int64_t joined_ns_ = kNoTime_ns;  // of upkeep: when the groups were last joined
  decltype(UdpSettings::data_place) data_place_ = nullptr;
  std::atomic<DataPlace> said_{};  // by the device
  DataPlace followed_{};           // of upkeep
  std::string interface_{};        // the same: UdpSettings::interface
  std::string note_{};             // the same: for consume_note()
};

}  // namespace posed::drivers
