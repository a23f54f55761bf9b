// SubscriptionTransport: receives topics of another posed over ZeroMQ. libzmq allocates, locks and
// wakes its own threads while it receives, so a thread of this object does that and passes each
// message on through a pair of connected sockets; the reader makes one read of a descriptor, as for
// UDP. The kernel's buffer between the two is the bounded queue: when it is full, its oldest
// message is discarded and counted, because newest data wins.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/cancel.hpp"
#include "drivers/transport/flood.hpp"
#include "drivers/transport/paused_hosts.hpp"
#include "drivers/transport/upkeep.hpp"
#include "proto/frame/event_fd.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/link_monitor.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::drivers {

struct SubscriptionSettings {
  std::string endpoint{};              // "tcp://192.168.1.10:5570"
  std::filesystem::path key{};         // own NAME.key; empty: no CURVE
  std::filesystem::path server_key{};  // the publisher's NAME.pub
  std::vector<std::string> topics{};   // whole topics; others with the same beginning are left out
};

// Checks the endpoint and reads the key files, without connecting. Cold.
Result<> check_subscription(const SubscriptionSettings& settings);

// The context of all subscriptions, while somebody keeps it: one thread of libzmq serves them all.
// An error when the threads of one more link cannot begin. Memory that libzmq's thread took for a
// peer that sends too much stays with that thread where posed locks its memory (mlockall): the
// next link, of whichever source, uses it again. Cold; any thread.
Result<std::shared_ptr<net::Context>> subscription_context();

class SubscriptionTransport final : public Transport, public Upkeep {
 public:
  // Waits for the connection for up to a second, or until `cancel` fires. If it floods, it ends,
  // and `paused` is told. Cold.
  static Result<std::unique_ptr<SubscriptionTransport>> open(const SubscriptionSettings& settings,
                                                             const Cancel& cancel,
                                                             std::shared_ptr<net::Context> context,
                                                             std::shared_ptr<PausedHosts> paused);
  ~SubscriptionTransport() override;

  [[nodiscard]] int poll_fd() const noexcept override { return reader_; }
  // Keeps what came since open(): a skeleton may be among it.
  Result<> start(std::int64_t now_ns) override;
  // A chunk is a topic, a zero byte, and the message. Chunk::lost when the connection ended.
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;
  RT_SAFE void decoded(bool used) noexcept override { flood_.decoded(used); }
  RT_SAFE void refuse() noexcept override { flood_.end(); }
  void upkeep(std::int64_t /*now_ns*/) noexcept override {}
  [[nodiscard]] std::string consume_note() override;

 private:
  SubscriptionTransport(const SubscriptionSettings& settings, std::shared_ptr<net::Context> context,
                        std::shared_ptr<PausedHosts> paused);
  Result<> connect();
  Result<> await_link(const Cancel& cancel);
  // The thread: receives until the link or the object ends.
  void receive_all();
  void accept_message();
  // Puts a message into the queue.
  void hand_over(std::size_t size) noexcept;

  SubscriptionSettings settings_;
  std::shared_ptr<PausedHosts> paused_;
  Flood flood_;
  std::uint64_t number_ = Chunk::kLink;  // tells this link from the ones before it
  bool is_reported_ = false;
  std::shared_ptr<net::Context> context_;
  net::Socket socket_;
  std::unique_ptr<net::LinkMonitor> monitor_;  // ends before the socket
  int reader_ = -1, writer_ = -1;              // the two ends of the queue
  RawEventFd stop_;
  std::vector<std::byte> outgoing_;  // of the thread
  std::vector<std::byte> incoming_;  // of the reader
  std::atomic<std::uint32_t> dropped_{0}, damaged_{0};
  std::thread thread_;
};

}  // namespace posed::drivers
