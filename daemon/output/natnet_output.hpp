// NatNetOutput: a NatNet server, as Motive is one. It answers who it is and what its bodies are,
// and sends frames to each client that asks, in the version that it asks for, and to a multicast
// group if the config names one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/output/fit.hpp"
#include "daemon/output/inbox.hpp"
#include "daemon/output/output.hpp"
#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/protocol.hpp"
#include "drivers/transport/address.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

// People and props as Motive streams them: bones relative to their parents, Y up, and the
// description of the bodies. One thread.
class NatNetScene {
 public:
  // The server's clock, which shows 0 ticks at the zero of monotonic time and before.
  static constexpr std::uint64_t kClock_hz = 10'000'000;
  [[nodiscard]] static std::uint64_t ticks_at(std::int64_t time_ns) noexcept;

  explicit NatNetScene(std::size_t places) : bodies_(places), names_(places) {}

  // The stream of a place has come, or has another skeleton; null: it has left. A prop, or a person
  // with a skeleton of Motive's, is sent as it is, under Motive's own number (Streaming ID) unless
  // another body has that; any other person moves Motive's figure (Fit). An error leaves the place
  // empty. Cold.
  Result<> set_stream(std::size_t place, const LiveStream* stream);
  // Takes the newest pose of a place. Returns false, and does nothing, if the place is empty.
  [[nodiscard]] bool take(std::size_t place, const Frame& frame);

  [[nodiscard]] const drivers::natnet::ModelDef& model() const noexcept { return model_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
  // Makes the next frame from the newest pose of each place; it is valid until the next call.
  [[nodiscard]] const drivers::natnet::FramePacket& next_frame(std::int64_t now_ns);

 private:
  struct Body {
    Body(Fit fitted, bool is_own) : fit(std::move(fitted)), own(is_own) {}
    Fit fit;
    bool own;
    std::int32_t number = 0;  // LiveStream::number
    double rate_hz = 0.0;
    drivers::natnet::BodyDef described{};
    drivers::natnet::SkeletonPacket packet{};  // of a prop its one bone
    bool posed = false;                        // a pose has been taken
  };
  void number_bodies();
  void describe();

  std::vector<std::optional<Body>> bodies_;  // [place]
  std::vector<std::string> names_;           // the same
  drivers::natnet::ModelDef model_;
  drivers::natnet::FramePacket packet_{.invented = false};
  double rate_hz_ = 0.0;
  bool changed_ = false;                              // the bodies, since the last frame
  std::int64_t time_ns_ = 0, begin_ns_ = kNoTime_ns;  // of the newest pose, of the first
  Timecode timecode_{};
};

class NatNetOutput final : public Output {
 public:
  static constexpr std::size_t kMaxClients = 16;
  // A client that sends nothing for so long gets nothing; clients send KeepAlive about every
  // second.
  static constexpr std::int64_t kSilent_ns = 5 * kNanosPerSecond;

  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  // Takes the socket, which is bound. `group`: where everybody gets the frames.
  NatNetOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake, int fd,
               drivers::Peers peers, std::optional<drivers::Address> group);
  ~NatNetOutput() override;

  [[nodiscard]] int poll_fd() const noexcept override { return fd_; }
  [[nodiscard]] std::string endpoint() const;

 private:
  using Bytes = std::vector<std::byte>;
  using Version = drivers::natnet::Version;
  struct Client {
    drivers::Address address;
    Version version;
    std::int64_t heard_ns = 0;
  };
  // A silent client stays listed, with its version, until another needs the room.
  [[nodiscard]] static bool is_live(const Client& client, std::int64_t now_ns) noexcept {
    return now_ns - client.heard_ns <= kSilent_ns;
  }

  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  void begin_turn(std::int64_t now_ns) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;

  void answer(const drivers::Address& from, const drivers::natnet::Message& message,
              std::int64_t now_ns);
  [[nodiscard]] Bytes answer_request(std::span<const std::byte> payload, Client* client) const;
  // Null: nobody at this address has asked for frames.
  [[nodiscard]] Client* find(const drivers::Address& address) noexcept;
  // Lets a client in, if there is room.
  void admit(const drivers::Address& address, Version version, std::int64_t now_ns);
  void send_to(const drivers::Address& to, std::span<const std::byte> datagram) noexcept;

  int fd_;
  drivers::Peers peers_;
  std::uint16_t data_port_;
  double limit_hz_;
  std::optional<drivers::Address> group_;
  Version usual_;  // the group's; without a group, of senders that are no clients
  NatNetScene scene_;
  std::vector<Client> clients_;
  std::size_t live_ = 0;                  // of clients_, as of the beginning of the turn
  bool more_ = false;                     // requests are left for the next turn
  std::int64_t refused_ns_ = kNoTime_ns;  // when users were last told of a refusal
};

}  // namespace posed::output
